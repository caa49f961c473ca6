"""The widget in the real JupyterLab and marimo; skipped where they are not installed, as in CI they are: extra `programs`."""

from __future__ import annotations

import importlib.util
import json
import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Playwright, expect

from .browser import FLAGS, chromium

CELL = """import pyverlet as pv
world = pv.scenes.get("cage").world(particles=300)
pv.widget(world, title="cage", height=420)"""

MARIMO = f"""import marimo
app = marimo.App()

@app.cell
def _():
{chr(10).join("    " + line for line in CELL.splitlines())}
    return
"""

NOTEBOOK = {
    "cells": [{"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": CELL}],
    "metadata": {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}},
    "nbformat": 4,
    "nbformat_minor": 4,
}

PAGE = """() => { const search = (node) => { for (const each of node.querySelectorAll("*")) {
    if (each.pyverlet) return each.pyverlet;
    const found = each.shadowRoot && search(each.shadowRoot);
    if (found) return found;
} return null; }; window.found = search(document); return Boolean(window.found); }"""

Start = Callable[..., str]


def missing(program: str) -> bool:
    """Whether to do without: not in CI, which installs it."""
    return importlib.util.find_spec(program) is None and not os.environ.get("CI")


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a program and waits until it answers; ends it afterwards."""
    running: list[subprocess.Popen[bytes]] = []

    def begin(port: int, path: str, *command: str) -> str:
        running.append(subprocess.Popen([sys.executable, "-m", *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        address = f"http://127.0.0.1:{port}{path}"
        for _ in range(240):
            try:
                urllib.request.urlopen(address, timeout=2)
            except (urllib.error.URLError, OSError):
                time.sleep(0.25)
            else:
                return address
        raise AssertionError(f"{command[0]} does not answer")

    yield begin
    for each in running:
        each.terminate()
        each.wait(30)


@pytest.fixture
def tab(playwright: Playwright) -> Iterator[Page]:
    browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
    yield browser.new_page(viewport={"width": 1280, "height": 900})
    browser.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return int(taken.getsockname()[1])


def use(page: Page) -> None:
    """What a user does: watch, pause, step, pull a circle, reset."""
    page.get_by_test_id("time").wait_for(timeout=90_000)
    page.wait_for_function(PAGE)
    page.wait_for_function("window.found.status()?.time > 1", timeout=60_000)
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("pause")).to_have_text("Resume")
    frames = page.evaluate("window.found.status().frames")
    page.get_by_test_id("step").click()
    page.wait_for_function(f"window.found.status().frames === {frames + 1}")
    page.get_by_test_id("pause").click()
    place = page.evaluate("window.found.where(299)")
    page.mouse.move(place["left"], place["top"])
    page.mouse.down()
    page.mouse.move(place["left"], place["top"] - 60, steps=4)
    page.wait_for_function(f"window.found.where(299).y > {place['y'] + 1}")
    page.mouse.up()
    page.get_by_test_id("reset").click()
    page.wait_for_function("window.found.status().time < 1")


@pytest.mark.slow
@pytest.mark.skipif(missing("marimo"), reason="marimo is not installed")
def test_marimo(tmp_path: Path, start: Start, tab: Page) -> None:
    (tmp_path / "cage.py").write_text(MARIMO)
    port = free_port()
    options = ("--headless", "--host", "127.0.0.1", "--port", str(port), "--no-token")
    tab.goto(start(port, "/", "marimo", "run", str(tmp_path / "cage.py"), *options))
    use(tab)


@pytest.mark.slow
@pytest.mark.skipif(missing("jupyterlab"), reason="JupyterLab is not installed")
def test_jupyterlab(tmp_path: Path, start: Start, tab: Page) -> None:
    (tmp_path / "cage.ipynb").write_text(json.dumps(NOTEBOOK))
    port = free_port()
    options = [f"--port={port}", "--no-browser", "--IdentityProvider.token=", f"--ServerApp.root_dir={tmp_path}"]
    root = ["--allow-root"] if hasattr(os, "getuid") and os.getuid() == 0 else []
    tab.goto(start(port, "/lab/tree/cage.ipynb", "jupyterlab", *options, *root))
    tab.get_by_text("| Idle").wait_for(timeout=90_000)  # the kernel is there
    tab.get_by_role("menuitem", name="Run", exact=True).click()
    tab.get_by_text("Run All Cells", exact=True).click()
    use(tab)
