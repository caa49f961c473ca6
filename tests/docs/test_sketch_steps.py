"""`docs/sketch.md`, step by step: its commands typed, its changes saved, and the page looked at in a browser."""

from __future__ import annotations

import re
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from pyverlet.cli import main

ROOT = Path(__file__).resolve().parents[2]
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
