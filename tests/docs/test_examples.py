"""Every Python example and every command in the README and docs runs as it stands there."""

import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

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
    # The steps of a sketch build on each other: `test_every_step` of tests/viewers/test_sketch_page.py.
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
    monkeypatch.setattr(pyverlet.viewers.window, "Window", lambda world, **how: SimpleNamespace(run=lambda: shown.append(how)))
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
