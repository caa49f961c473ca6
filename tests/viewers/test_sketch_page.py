"""Sketches on the page, as their writer sees them: built anew when saved, wrong, endless; and what they draw and answer."""

import colorsys
import itertools
import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from pyverlet.cli import main

from .browser import Served, comes_true, each, number, rgb, shown, status, tab, visit

pytestmark = pytest.mark.slow

SKETCH = """
import pyverlet as pv

lift = pv.slider("lift", 0.0, 20.0, 9.81)

def build(particles=COUNT):
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
    start = pv.fill(world.boundary, radius=0.3, count=particles)
    world.add(position=start.position, radius=start.radius)
    world.watch("highest", lambda world: world.position[:, 1].max())
    return world

def update(world, dt):
    world.gravity = (0, lift.value - 9.81)

def draw(world, pen):
    pen.circle((5, 5), 2)
    pen.text((5, 5), "COUNT", colour="#ff0000")

def keys(world, key):
    if key == "x":
        world.remove(0)

def click(world, point, button):
    world.add(position=point, radius=0.1 if button == "left" else 0.2, mass=7)
"""


class Sketching(Served):
    """A sketch in a file, on a page."""

    def __init__(self, path: Path, *options: str) -> None:
        self.path = path
        super().__init__("-m", "pyverlet", "run", str(path), "--no-open", "--port", "0", *options)

    def save(self, source: str) -> None:
        """As editors do: a new file in the place of the old."""
        fresh = self.path.with_suffix(".new")
        fresh.write_text(source, encoding="utf-8")
        os.replace(fresh, self.path)  # noqa: PTH105


Start = Callable[..., Sketching]


@pytest.fixture
def sketching(tmp_path: Path, programs: list[Served]) -> Start:
    def start(source: str, *options: str) -> Sketching:
        (tmp_path / "mine.py").write_text(source, encoding="utf-8")
        programs.append(mine := Sketching(tmp_path / "mine.py", *options))
        return mine

    return start


def drops(count: int) -> str:
    return SKETCH.replace("COUNT", str(count))


def spot(page: Page) -> list[float]:
    """Where circle 2 is: left, top on the page, x in the world. There is no frame for a moment when circles come or go."""
    script = "() => { try { const { left, top, x } = window.pyverlet.where(2); return [left, top, x]; } catch { return null; } }"
    found: list[float] = page.wait_for_function(script).json_value()
    return found


def has(page: Page, count: int) -> bool:
    return comes_true(page, lambda: number(page, "particles") == count)


def goes_on(page: Page) -> bool:
    now = number(page, "time")
    return comes_true(page, lambda: number(page, "time") > now)


def test_saved_it_is_built_anew_and_the_page_stays(page: Page, sketching: Start) -> None:
    mine = sketching(drops(5), "--watch")
    visit(page, mine.address)
    assert has(page, 5)
    page.get_by_test_id("theme").select_option("light")
    page.locator("[name=tool][value=pin]").check(force=True)
    for _ in range(3):
        page.keyboard.press("+")
    page.get_by_test_id("slider-lift").fill("4")
    assert comes_true(page, lambda: abs(status(page)["gravity"][1] - (4 - 9.81)) < 1e-6)
    before = shown(page, "camera.own")
    for count in (6, 7):
        mine.save(drops(count))
        assert has(page, count)
    assert shown(page, "camera.own") == before
    expect(page.locator("#pyverlet")).to_have_attribute("data-theme", "light")
    expect(page.locator("[name=tool][value=pin]")).to_be_checked()
    assert status(page)["sliders"][0][4] == 4  # where it was left

    # Something wrong: its line is told, and the last good world goes on.
    mine.save(drops(8).replace("    return world", "    return wrold"))
    notice = page.get_by_test_id("notice")
    expect(notice).to_contain_text("mine.py, line 11: NameError: name 'wrold' is not defined")
    assert number(page, "particles") == 7
    assert goes_on(page)
    mine.save(drops(8).replace("def update(", "def update(("))
    expect(notice).to_contain_text("mine.py, line 13: ")
    mine.save(drops(8).replace("def build(", "def bild("))
    expect(notice).to_contain_text("mine.py has no build() (did you mean 'bild'?)")
    mine.save(drops(8))
    assert has(page, 8)
    expect(notice).to_be_hidden()

    # A function that fails is left out, and the rest goes on.
    mine.save(drops(9).replace("    pen.circle((5, 5), 2)", "    pen.circle((5, 5), -2)"))
    assert has(page, 9)
    expect(notice).to_contain_text("mine.py, line 17: radius is -2")
    mine.save(drops(10).replace("lift.value - 9.81)", "lift.valeu - 9.81)"))
    assert has(page, 10)
    expect(notice).to_contain_text("mine.py, line 14: AttributeError")
    assert goes_on(page)


def test_one_that_loops_for_ever_is_told_of(page: Page, sketching: Start) -> None:
    mine = sketching(drops(5), "--watch", "--patience", "1")
    visit(page, mine.address)
    assert has(page, 5)
    mine.save(drops(6).replace("    return world", "    while True:\n        pass"))
    expect(page.get_by_test_id("notice")).to_contain_text(re.compile(r"mine.py, line 1[12] does not come back"), timeout=10_000)
    assert goes_on(page)
    mine.save(drops(7))
    assert has(page, 7)
    mine.save(drops(8).replace("    pen.circle((5, 5), 2)", "    while True:\n        pass"))
    assert has(page, 8)
    expect(page.get_by_test_id("notice")).to_contain_text("draw is not called any more", timeout=15_000)
    assert goes_on(page)


def test_modules_beside_it_are_watched_and_bring_no_change_of_their_own(page: Page, sketching: Start, tmp_path: Path) -> None:
    beside = tmp_path / "many_beside.py"
    beside.write_text("MANY = 4\n", encoding="utf-8")
    mine = sketching(drops(5), "--watch")
    visit(page, mine.address)
    mine.save("import many_beside\n" + drops(5).replace("particles=5", "particles=many_beside.MANY"))
    assert has(page, 4)
    page.wait_for_timeout(700)  # some looks at the files: that there is one more is no reason to begin anew
    assert comes_true(page, lambda: number(page, "time") > 0.4)
    beside.write_text("MANY = 6  # more\n", encoding="utf-8")
    assert has(page, 6)


def test_one_that_is_wrong_from_the_start_comes_when_it_is_mended(page: Page, sketching: Start) -> None:
    mine = sketching("import nothing_of_that_name\n", "--watch")
    page.goto(mine.address)
    expect(page.get_by_test_id("notice")).to_contain_text("mine.py, line 1: ModuleNotFoundError")
    mine.save(drops(5))
    assert has(page, 5)


def test_it_draws_and_answers(page: Page, sketching: Start) -> None:
    mine = sketching(drops(5).replace("lift.value - 9.81", "0"))
    visit(page, mine.address)
    assert has(page, 5)
    assert comes_true(page, lambda: shown(page, "overlay.drawn") == 2)
    left, top = shown(page, "camera.toScreen(7, 5)")  # on the circle of 2 m about (5, 5)
    script = """([x, y]) => {
        const canvas = document.querySelector("#overlay"), ratio = canvas.width / canvas.clientWidth;
        const { data } = canvas.getContext("2d").getImageData(x * ratio - 2, y * ratio - 2, 5, 5);
        return data.filter((v, k) => k % 4 == 3 && v > 100).length;
    }"""
    assert page.evaluate(script, [left, top]) > 4
    assert page.evaluate(script, [left - 30, top - 60]) == 0
    page.keyboard.press("x")
    assert has(page, 4)
    page.keyboard.press("r")  # a key of the page's own otherwise: the sketch has them all
    left, top = shown(page, "camera.toScreen(8, 8)")
    page.mouse.click(left, top)
    assert has(page, 5)
    page.mouse.click(left, top - 60, button="right")
    assert has(page, 6)
    assert each(page, "mass", 6)[4:].tolist() == [7, 7]
    assert [round(shown(page, f"where({i}).x"), 2) for i in (4, 5)] == [8, 8]
    assert comes_true(page, lambda: status(page)["watched"]["highest"] > 5)
    expect(page.get_by_test_id("watched-highest")).to_be_visible()


def test_a_still_picture_and_a_film_are_saved(page: Page, sketching: Start, tmp_path: Path) -> None:
    page.set_viewport_size({"width": 800, "height": 480})
    mine = sketching(drops(5).replace("(0, lift.value - 9.81)", "(0, -9.81)"))
    visit(page, mine.address)
    with page.expect_download() as saved:
        page.get_by_test_id("still").click()
    saved.value.save_as(tmp_path / "still.png")
    assert saved.value.suggested_filename == "mine.png"
    with Image.open(tmp_path / "still.png") as still:
        pixels = np.asarray(still.convert("RGB"))
    assert pixels.shape == (480, 800, 3)
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20  # the ground, the room, circles, a drawing
    red = (pixels[..., 0] > 200) & (pixels[..., 1:] < 60).all(axis=-1)
    assert red.any()  # the text that the sketch writes
    film = page.get_by_test_id("film")
    film.click()
    expect(film).to_have_text("Stop")
    page.wait_for_timeout(500)
    page.get_by_test_id("theme").select_option("dark")
    assert comes_true(page, lambda: shown(page, "capture.bytes") > 20_000)
    with page.expect_download() as saved:
        film.click()
    saved.value.save_as(tmp_path / "film.webm")
    with av.open(str(tmp_path / "film.webm")) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) > 5
    assert frames[0].shape == (480, 800, 3)
    assert np.abs(frames[-1].astype(int) - frames[0]).max() > 100  # it was light, then dark
    expect(film).to_have_text("Film")


def test_what_a_hand_has_done_can_be_undone(page: Page, sketching: Start) -> None:
    quiet = drops(5)[: drops(5).index("def keys")].replace("lift.value - 9.81", "0")
    mine = sketching(quiet)
    visit(page, mine.address)
    undo, redo = page.get_by_test_id("undo"), page.get_by_test_id("redo")
    expect(undo).to_be_disabled()
    at = spot(page)[:2]

    page.keyboard.press("5")
    page.mouse.click(*at)
    assert has(page, 4)
    undo.click()
    assert has(page, 5)
    redo.click()
    assert has(page, 4)
    page.keyboard.press("Control+z")
    assert has(page, 5)
    page.keyboard.press("Control+Shift+z")
    assert has(page, 4)
    page.keyboard.press("Control+z")
    expect(undo).to_be_disabled()

    at = spot(page)[:2]
    page.keyboard.press("3")
    page.mouse.click(*at)
    assert comes_true(page, lambda: shown(page, "mass(2)") == float("inf"))
    page.keyboard.press("Control+z")
    assert comes_true(page, lambda: shown(page, "mass(2)") == 1.0)

    page.keyboard.press("4")
    page.mouse.move(300, 200)
    page.mouse.down()
    stroke = itertools.cycle((*range(310, 610, 30), *range(600, 300, -30)))

    def drawn() -> bool:  # a slow page sees the mouse only where it is when it draws
        page.mouse.move(next(stroke), 200)
        return number(page, "particles") > 7

    assert comes_true(page, drawn)
    page.mouse.up()
    page.keyboard.press("Control+z")  # one stroke is one thing
    assert has(page, 5)

    where = spot(page)
    page.keyboard.press("1")
    page.mouse.move(*at)
    page.mouse.down()
    page.mouse.move(at[0] + 150, at[1] - 100, steps=5)
    assert comes_true(page, lambda: spot(page)[2] > where[2] + 0.5)
    page.mouse.up()
    page.keyboard.press("Control+z")
    assert comes_true(page, lambda: abs(spot(page)[2] - where[2]) < 0.05)


COLUMN = """
import pyverlet as pv

def build():
    world = pv.World(boundary=pv.Box((0, 0), (1, 6)))
    world.add(position=[(0.5, 0.5 + k) for k in range(4)], radius=0.5)
    return world
"""


def test_forces_are_drawn_as_wide_as_they_are(page: Page, sketching: Start) -> None:
    mine = sketching(COLUMN)
    visit(page, mine.address)
    page.get_by_test_id("theme").select_option("light")
    page.get_by_test_id("forces").check()
    assert comes_true(page, lambda: shown(page, "overlay.forces") == 4)  # three contacts, and the floor
    script = """() => {
        const canvas = document.querySelector("#overlay"), context = canvas.getContext("2d");
        const ratio = canvas.width / canvas.clientWidth;
        const wide = (y) => {
            const [x0, top] = window.pyverlet.camera.toScreen(0, y), [x1] = window.pyverlet.camera.toScreen(1, y);
            const { data } = context.getImageData(x0 * ratio, top * ratio, (x1 - x0) * ratio, 1);
            return data.filter((v, k) => k % 4 == 3 && v > 128).length;
        };
        return [0.1, 1.0, 2.0, 3.0].map(wide);
    }"""
    # Below circle k hangs the weight of 4 - k: 4, 3, 2 and 1 of them.
    assert comes_true(page, lambda: (found := page.evaluate(script))[0] > found[1] > found[2] > found[3] > 0)
    page.get_by_test_id("forces").uncheck()
    assert comes_true(page, lambda: shown(page, "overlay.forces") == 0)
    page.get_by_test_id("colour").select_option("force")
    assert comes_true(page, lambda: len(set(each(page, "tint", 4))) >= 3)
    page.get_by_test_id("colour").select_option("group")
    # Tones of one hue, which forces are not.
    assert comes_true(page, lambda: np.ptp([colorsys.rgb_to_hsv(*tint)[0] for tint in rgb(each(page, "tint", 4))]) < 0.01)


# ---- `docs/sketch.md`, step by step: its commands typed, its changes saved, and the page looked at in a browser ----


DOCS = Path(__file__).resolve().parents[2] / "docs"
STEPS = re.findall(r"^```(sh|diff|text)\n(.*?)^```", (DOCS / "sketch.md").read_text(encoding="utf-8"), re.M | re.S)


def changed(source: str, diff: str) -> str:
    """The sketch after a change: lines with + in place of those with -, or behind those that stay."""
    lines = diff.splitlines()
    before, after = ("\n".join(line[1:] for line in lines if line[0] in kept) for kept in ("- ", "+ "))
    assert source.count(before) == 1, before
    return source.replace(before, after)


def test_every_step(
    chrome: Browser, programs: list[Served], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    watched: Any = None
    with tab(chrome, viewport={"width": 900, "height": 700}) as page:
        page.set_default_timeout(120_000)
        for (kind, text), (after, said) in zip(STEPS, [*STEPS[1:], ("end", "")], strict=True):
            for line in text.splitlines() if kind == "sh" else ():
                if line.endswith("--watch"):
                    programs.append(watched := Sketching(Path("mysketch.py"), "--watch"))
                    visit(page, watched.address)
                else:
                    assert main(shlex.split(line)[1:]) == 0, capsys.readouterr().err
            if kind == "diff":
                # That it begins anew shows in its time, for as long as it is before this one.
                page.wait_for_function("() => (window.before = window.pyverlet.status().time) > 2")
                watched.save(changed(watched.path.read_text(encoding="utf-8"), text))
                if after == "text":  # what is wrong with it
                    expect(page.get_by_test_id("notice")).to_contain_text(said.strip(), timeout=10_000)
                else:
                    status = "window.pyverlet.status()"
                    page.wait_for_function(f"() => !{status}.complaint && {status}.time < window.before")
                    expect(page.get_by_test_id("notice")).to_be_hidden()
        page.goto("about:blank")  # before the server ends
        watched.end()
    with Image.open(DOCS / "images" / "sketch.png") as known, Image.open(tmp_path / "mysketch.png") as made:
        assert known.size == made.size
    assert (tmp_path / "mysketch.html").stat().st_size > 10_000
    assert (tmp_path / "study" / "table.csv").exists()
