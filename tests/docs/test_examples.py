"""Every Python example and every command in the README and docs runs as it stands there."""

import re
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

import pyverlet
import pyverlet as pv
import pyverlet.viewers
import pyverlet.viewers.launch
import pyverlet.viewers.window
from pyverlet.cli import main

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[tuple[int, str]]:
    """(line, source) of every fenced block in that language."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, match.start(2)), match[2]) for match in BLOCK.finditer(text) if match[1] == language]


# Commands that take long for what others show too.
SLOW = (
    "pyverlet bench --particles 20000", "pyverlet check fuzz ", "pyverlet check physics --only sliding-disc --only gas-energy",
    "pyverlet order", "pyverlet sweep run box --vary friction=0,0.4", "pyverlet truth", "pyverlet record conveyor ",
    "pyverlet record drum ", "pyverlet record droplets ", "pyverlet record dam-break ", "pyverlet record boids ",
    "pyverlet compare bounce-euler --seconds 10", "pyverlet check pressure ", "pyverlet compare fall --seconds 2 --plot",
    "pyverlet record cage cage.mp4 --seconds 1", "pyverlet record cloth cloth.png ", "pyverlet run cage --headless --seconds 5",
    "pyverlet record particle-life ", "pyverlet record galton ", "pyverlet record hourglass ", "pyverlet record gas gas.png ",
    "pyverlet record cage-brute-force ", "pyverlet record cage cage.png ", "pyverlet record orbit ",
    "pyverlet record rope-bridge ", "pyverlet record car ", "pyverlet record wrecking-ball ", "pyverlet record ragdoll ",
    "pyverlet record image boat.png ", "pyverlet record image image.png ", "pyverlet record soft-bodies ",
)  # fmt: skip


def commands() -> list[str]:
    """Every line of the shell blocks, and every row of the README's table, that starts with our command."""
    # The steps of a sketch build on each other: `test_every_step`.
    shell = [
        line for page in PAGES if page.name != "sketch.md" for _, source in blocks(page, "sh") for line in source.splitlines()
    ]
    table = re.findall(r"^\| `(pyverlet [^`]*)`", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    return sorted({line for line in shell + table if line.startswith("pyverlet ")})


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """In place of a live page: what would have been shown on it. Files go to a folder that is forgotten."""
    shown: list[Any] = []

    def serve(build: Any, **options: Any) -> None:
        build()
        shown.append(options)

    real = pyverlet.view

    def view(world: Any, **options: Any) -> Any:
        shown.append((world, options))
        return None if options.get("block", True) else real(world, **options)

    monkeypatch.setattr(pyverlet, "view", view)
    monkeypatch.setattr(pyverlet.viewers.launch, "serve", serve)
    monkeypatch.setattr(pyverlet.viewers.window, "show", serve)
    monkeypatch.chdir(tmp_path)
    return shown


# Pages that take long, run with `--all`.
SLOW_PAGES = ("docs/integrators.md", "docs/pair-forces.md")


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name, marks=pytest.mark.slow if name in SLOW_PAGES else ())
        for page in PAGES
        if blocks(page, "python") and (name := page.relative_to(ROOT).as_posix())
    ],
)
def test_python_examples(page: Path, shown: list[Any]) -> None:
    names: dict[str, Any] = {"__name__": "example"}
    for line, source in blocks(page, "python"):
        # Blank lines in front: a failure names the line of the page.
        exec(compile("\n" * line + source, page, "exec"), names)


@pytest.mark.parametrize(
    "command", [pytest.param(c, id=c, marks=pytest.mark.slow if c.startswith(SLOW) else ()) for c in commands()]
)
def test_commands(command: str, shown: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(shlex.split(command)[1:]) == 0, capsys.readouterr().err


@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_no_page_is_longer_than_300_lines(page: Path) -> None:
    assert len(page.read_text(encoding="utf-8").splitlines()) <= 300


def test_the_pages_have_examples() -> None:
    assert len(commands()) >= 8
    assert sum(len(blocks(page, "python")) for page in PAGES) >= 8


def test_links_lead_somewhere() -> None:
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if not target.startswith(("http://", "https://")):
                assert (page.parent / target).exists(), f"{page}: {target}"


@pytest.mark.parametrize("page", ["coming-from.md", "names.md"])
def test_tables_name_what_there_is(page: str) -> None:
    world = pv.World(events=True, contacts=True)
    group = world.add(position=(0, 0))
    found: dict[str, Any] = {"pv": pv, "world": world, "group": group, "link": pv.Pin(group, 0), "pen": pv.picture.Pen()}
    row = re.compile(r"^\|([^|]*)\|(.*)\|$", re.M)
    for theirs, ours in row.findall((ROOT / "docs" / page).read_text(encoding="utf-8")):
        for said in re.findall(r"`([^`]*)`", theirs if page == "names.md" else ours.split(" | ")[0]):
            for kind, names in re.findall(r"\b(pv|world|group|link|pen)((?:\.\w+)+)", said):
                thing = found[kind]
                for name in names[1:].split("."):
                    assert hasattr(thing, name), f"{page}: {kind}{names}"
                    thing = getattr(thing, name)


# ---- `docs/sketch.md`, step by step: its commands typed, its changes saved, and the page looked at in a browser ----


STEPS = re.findall(r"^```(sh|diff|text)\n(.*?)^```", (ROOT / "docs" / "sketch.md").read_text(encoding="utf-8"), re.M | re.S)
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]


def changed(source: str, diff: str) -> str:
    """The sketch after a change: lines with + in place of those with -, or behind those that stay."""
    lines = diff.splitlines()
    before = "\n".join(line[1:] for line in lines if line[0] in "- ")
    after = "\n".join(line[1:] for line in lines if line[0] in "+ ")
    assert source.count(before) == 1, before
    return source.replace(before, after)


class Watched:
    """`pyverlet run mysketch.py --watch`, and a browser on its page."""

    def __init__(self, page: Page, command: list[str], left_over: ExitStack) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "pyverlet", *command, "--no-open", "--port", "0"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        left_over.callback(self.kill)
        assert self.process.stdout is not None
        address = re.search(r"http://\S+", self.process.stdout.readline())
        assert address
        self.page = page
        page.goto(address[0])
        page.wait_for_function("() => window.pyverlet.status() !== null")

    def saved(self, said: str | None) -> None:
        """What the page does when the sketch was saved: says what is wrong, or begins anew."""
        notice = self.page.get_by_test_id("notice")
        if said is not None:
            expect(notice).to_contain_text(said, timeout=10_000)
            return
        self.page.wait_for_function("() => !window.pyverlet.status().complaint && window.pyverlet.status().time < window.before")
        expect(notice).to_be_hidden()

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        _, err = self.process.communicate(timeout=20)
        assert "Traceback" not in err

    def kill(self) -> None:
        """Whatever has happened: nothing is left behind."""
        with self.process:
            self.process.kill()


def test_changes_are_applied() -> None:
    assert changed("a\nb\nc\n", "-b\n+d\n+e\n") == "a\nd\ne\nc\n"
    assert changed("a\nb\nc\n", " b\n+d\n") == "a\nb\nd\nc\n"


@pytest.mark.slow
def test_every_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    chromium = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("no Chromium found")
    monkeypatch.chdir(tmp_path)
    sketch, watched, steps = tmp_path / "mysketch.py", None, iter([*STEPS, ("end", "")])
    with sync_playwright() as playwright, ExitStack() as left_over:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": 900, "height": 700})
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.set_default_timeout(120_000)  # kernels may have to be compiled first
        kind, text = next(steps)
        while kind != "end":
            after = next(steps)
            if kind == "sh":
                for line in text.splitlines():
                    if line.endswith("--watch"):
                        watched = Watched(page, shlex.split(line)[1:], left_over)
                    else:
                        assert main(shlex.split(line)[1:]) == 0, capsys.readouterr().err
            if kind == "diff":
                assert watched is not None
                # That it begins anew shows in its time, for as long as it is before this one.
                page.wait_for_function("() => (window.before = window.pyverlet.status().time) > 2")
                sketch.write_text(changed(sketch.read_text(encoding="utf-8"), text), encoding="utf-8")
                watched.saved(after[1].strip() if after[0] == "text" else None)
            kind, text = after
        assert watched is not None
        watched.end()
        browser.close()
    assert errors == []
    with Image.open(ROOT / "docs" / "images" / "sketch.png") as shown, Image.open(tmp_path / "mysketch.png") as made:
        assert shown.size == made.size
    assert (tmp_path / "mysketch.html").stat().st_size > 10_000
    assert (tmp_path / "study" / "table.csv").exists()
