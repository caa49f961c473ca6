"""The widget: its words over the comm, its picture where widgets do not run, and the page's script as one piece in Chromium."""

import base64
import importlib.util
import json
import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import image
from playwright.sync_api import Browser, Page, expect

import pyverlet as pv
from pyverlet.viewers import bundle
from pyverlet.viewers.notebook import MOST_VIEWS

from .browser import seen_pixels, tab
from .sessions import LOOK, unpack


class Comm:
    """A widget, and what it answers."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, world: Any, **options: Any) -> None:
        self.widget = pv.widget(world, **options)
        self.answers: list[tuple[Any, list[bytes]]] = []
        monkeypatch.setattr(self.widget, "send", lambda content, buffers=(): self.answers.append((content, list(buffers))))

    def say(self, *messages: Any, view: str = "a") -> list[tuple[dict[str, Any], bytes]]:
        """Send messages as the page does; head and body of each answer."""
        return self.raw({"view": view, "words": [json.dumps(message) for message in messages]})

    def raw(self, content: Any) -> list[tuple[dict[str, Any], bytes]]:
        reply, buffers = self.hear(content)
        assert reply in (None, {"view": content["view"]})
        return [unpack(data) for data in buffers]

    def hear(self, content: Any) -> tuple[Any, list[bytes]]:
        """The answer and its buffers; None where there is none."""
        self.answers.append((None, []))
        self.widget._handle_custom_msg(content, [])
        return self.answers[-1]


@pytest.fixture
def comm(monkeypatch: pytest.MonkeyPatch, world: pv.World) -> Comm:
    return Comm(monkeypatch, world, title="nine")


def test_the_first_question_is_answered_with_shape_and_frame(comm: Comm) -> None:
    (shape, radii), (frame, grid) = comm.say(LOOK)
    assert (shape["kind"], shape["title"], shape["count"], len(radii)) == ("shape", "nine", 9, 108)
    assert (frame["kind"], len(grid)) == ("frame", 36)


def test_the_world_moves_when_asked_and_only_then(comm: Comm, world: pv.World) -> None:
    comm.say(LOOK)
    before = world.frames
    time.sleep(0.05)
    assert world.frames == before
    comm.say()
    assert before + 1 <= world.frames <= before + 4
    time.sleep(0.5)  # a cell that takes long
    before = world.frames
    ((frame, _),) = comm.say()
    assert before < world.frames <= before + 6  # a tenth of a second, no more, is made up for
    assert frame["status"]["dropped"] <= 4


def test_commands_work_and_silence_costs_nothing(comm: Comm, world: pv.World) -> None:
    comm.say(LOOK, {"type": "pause", "on": True}, {"type": "gravity", "x": 1, "y": 2}, {"type": "integrator", "value": "rk4"})
    assert world.gravity == (1.0, 2.0)
    held = world.frames
    assert comm.say() == []
    ((refused, _),) = comm.say({"type": "substeps", "value": 0})  # which words are is a matter of `decode`
    assert (refused["kind"], "allowed" in refused["reason"]) == ("refused", True)
    ((frame, _),) = comm.say({"type": "step"})
    assert frame["status"]["paused"]
    assert world.frames == held + 1
    ((again, _),) = comm.say({**LOOK, "part": [0, 0, 1, 1]})
    assert again["view"] == [0, 0, 1, 1]


@pytest.mark.parametrize("content", [None, 3, [], {}, {"view": 3}, {"view": "a", "words": 5}, {"view": "a", "words": [5, None]}])
def test_nonsense_over_the_comm_does_no_harm(comm: Comm, world: pv.World, content: Any) -> None:
    comm.widget._handle_custom_msg(content, [])
    comm.say(LOOK)
    assert world.time >= 0


def test_two_views_have_looks_of_their_own_and_a_closed_one_lets_go(comm: Comm, world: pv.World) -> None:
    comm.say(LOOK, {"type": "pause", "on": True})
    (_, (frame, _)) = comm.say({**LOOK, "part": [0, 0, 1, 1]}, view="b")
    assert frame["view"] == [0, 0, 1, 1]
    assert comm.say() == []  # the first has what it wants
    comm.say({"type": "drag", "x": 0, "y": 0.5, "reach": 1}, view="b")
    assert len(world.forces) == 1
    comm.widget._handle_custom_msg({"view": "b", "gone": True}, [])
    comm.say()
    assert world.forces == []


def test_views_that_left_without_a_word_make_room(comm: Comm) -> None:
    for k in range(MOST_VIEWS + 5):
        comm.say(LOOK, view=str(k))
    assert len(comm.widget._displays) == MOST_VIEWS


def test_large_worlds_come_as_pictures(monkeypatch: pytest.MonkeyPatch, world: pv.World) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 5)
    (shape, _), (frame, jpeg) = Comm(monkeypatch, world).say(LOOK)
    assert shape["drawnHere"]
    assert frame["kind"] == "picture"
    assert image.imread(BytesIO(jpeg), format="jpeg").shape == (300, 300, 3)  # a square room in 400 x 300


def still(comm: Comm) -> Any:
    data, _ = comm.widget._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in data
    return image.imread(BytesIO(base64.b64decode(data["image/png"])))


def test_where_widgets_do_not_run_there_is_a_picture(comm: Comm) -> None:
    pixels = still(comm)
    assert pixels.shape == (480, 720, 3)
    coloured = np.ptp(pixels, axis=2) > 0.3
    assert 9 * 100 < coloured.sum() < 9 * 1000  # nine circles of 11 pixels radius


def test_several_worlds_are_shown_by_their_first(monkeypatch: pytest.MonkeyPatch) -> None:
    assert still(Comm(monkeypatch, pv.scenes.get("bounce-order").panels())).any()


@pytest.mark.parametrize("script", [bundle.script, lambda: bundle.modules("film.js")], ids=["notebook", "film"])
def test_modules_share_no_names(script: Callable[[], str]) -> None:
    """Put together they are one module: two constants of one name would be an error, two functions a mix-up."""
    text = script()
    names = re.findall(r"^(?:async )?(?:export )?(?:const|let|class|(?:async )?function) (\w+)", text, re.MULTILINE)
    # Several to a line: const a = 1, b = 2;
    names += re.findall(r"^const \w+ = [^;(\n]*?, (\w+) = ", text, re.MULTILINE)
    assert len(names) > 50
    assert sorted(names) == sorted(set(names))
    assert "</script" not in text or "const MARKUP" in text
    assert "import " not in re.sub(r"^const (STYLE|MARKUP).*$|^\s*(//|\*).*$|//.*$", "", text, flags=re.MULTILINE)


HOST = """
<!doctype html><body><div id="cell" style="width: 900px"></div><script type="module">
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const listeners = new Set();
const model = {
  get: () => 500,
  on: (_, listener) => listeners.add(listener),
  off: (_, listener) => listeners.delete(listener),
  send: async (content) => {
    const [reply, buffers] = await window.hear(content);
    if (reply) for (const listener of listeners) listener(reply, buffers.map(bytes));
  },
};
const { default: widget } = await import(URL.createObjectURL(new Blob([await window.source()], { type: "text/javascript" })));
const el = document.getElementById("cell");
window.leave = widget.render({ model, el });
window.host = el.firstChild;
</script></body>
"""


@pytest.fixture
def cell(comm: Comm, browser: Browser) -> Iterator[Page]:
    """A cell of a notebook in Chromium, around the real widget."""

    def hear(content: Any) -> Any:
        reply, buffers = comm.hear(content)
        return [reply, [base64.b64encode(data).decode() for data in buffers]]

    with tab(browser, viewport={"width": 1000, "height": 700}) as page:
        page.expose_function("hear", hear)
        page.expose_function("source", bundle.script)
        page.set_content(HOST)
        yield page


@pytest.mark.slow
def test_a_cell_shows_steers_and_leaves(cell: Page, comm: Comm, world: pv.World) -> None:
    time_shown = cell.get_by_test_id("time")
    cell.wait_for_function("window.host?.pyverlet.status()?.time > 0.3")
    assert float(time_shown.inner_text()) > 0
    cell.get_by_test_id("pause").click()
    expect(cell.get_by_test_id("pause")).to_have_text("Resume")
    held = world.frames
    cell.get_by_test_id("step").click()
    cell.wait_for_function(f"window.host?.pyverlet.status().frames === {held + 1}")
    cell.get_by_test_id("restitution").fill("0.5")
    cell.wait_for_function("window.host?.pyverlet.status().restitution === 0.5")
    assert world.collisions is not None
    assert world.collisions.restitution == 0.5
    expect(cell.get_by_test_id("count")).to_be_hidden()

    place = cell.evaluate("window.host?.pyverlet.where(4)")
    cell.get_by_test_id("pause").click()
    cell.mouse.move(place["left"], place["top"])
    cell.mouse.down()
    cell.mouse.move(place["left"], place["top"] - 60, steps=4)
    cell.wait_for_function("window.host?.pyverlet.where(4).y > 2")
    assert len(world.forces) == 1
    where = cell.evaluate("window.host?.pyverlet.where(0)")
    assert np.ptp(seen_pixels(cell)[round(where["top"]), round(where["left"])]) > 0.15  # a colour where a circle is
    cell.evaluate("leave()")
    cell.wait_for_timeout(300)
    assert comm.widget._displays == {}
    frames = world.frames
    cell.wait_for_timeout(300)
    assert world.frames == frames


# ---- The widget in the real JupyterLab and marimo; skipped where they are not installed, as in CI they are: extra `programs`
# ----


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
def port() -> int:
    """One that is free."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return int(taken.getsockname()[1])


@pytest.fixture
def program_page(chrome: Browser) -> Iterator[Page]:
    """Whose errors are the program's affair."""
    page = chrome.new_page(viewport={"width": 1280, "height": 900})
    yield page
    page.close()


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
def test_marimo(tmp_path: Path, start: Start, program_page: Page, port: int) -> None:
    (tmp_path / "cage.py").write_text(MARIMO)
    options = ("--headless", "--host", "127.0.0.1", "--port", str(port), "--no-token")
    program_page.goto(start(port, "/", "marimo", "run", str(tmp_path / "cage.py"), *options))
    use(program_page)


@pytest.mark.slow
@pytest.mark.skipif(missing("jupyterlab"), reason="JupyterLab is not installed")
def test_jupyterlab(tmp_path: Path, start: Start, program_page: Page, port: int) -> None:
    (tmp_path / "cage.ipynb").write_text(json.dumps(NOTEBOOK))
    options = [f"--port={port}", "--no-browser", "--IdentityProvider.token=", f"--ServerApp.root_dir={tmp_path}"]
    root = ["--allow-root"] if hasattr(os, "getuid") and os.getuid() == 0 else []
    program_page.goto(start(port, "/lab/tree/cage.ipynb", "jupyterlab", *options, *root))
    program_page.get_by_text("| Idle").wait_for(timeout=90_000)  # the kernel is there
    program_page.get_by_role("menuitem", name="Run", exact=True).click()
    program_page.get_by_text("Run All Cells", exact=True).click()
    use(program_page)
