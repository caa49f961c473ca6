"""What stands where on the page: nothing covers anything else."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from tests.programs import python

from .browser import Serve, box, chromium, number, shown, visit

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_no_wall_runs_through_the_title(page: Page, program: Serve, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    visit(page, program("rope-bridge", 40).address)
    x0, y0, x1, y1 = shown(page, "camera.room")
    margin = 0.03 / 1.06 * max(x1 - x0, y1 - y0)  # VIEW_MARGIN around the bounds
    foot = box(page.locator("aside"))["y"] if size[0] < 600 else size[1]
    upper, lower = (shown(page, f"camera.toScreen({x0 + margin}, {y})")[1] for y in (y1 - margin, y0 + margin))
    assert box(page.locator("header"))["bottom"] < upper < lower < foot
    for _ in range(5):
        page.keyboard.press("+")  # what is nearer is also seen behind the title
    top = shown(page, "camera.toWorld(0, 0)")[1]
    assert top < y1
    assert shown(page, "camera.part")[3] == pytest.approx(top)


# Where only a part of a room is on show, and where a round one leaves the corner to the title.
@pytest.mark.parametrize("scene", ["image", "cage"])
def test_all_the_height_is_for_some_rooms(page: Page, program: Serve, scene: str) -> None:
    visit(page, program(scene, 40).address)
    free = shown(page, "camera.free")
    assert (free["top"], free["height"]) == (0, 800)


def test_panels_have_their_names_on_a_phone(page: Page, program: Serve) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    visit(page, program("energy-10-substeps", 1).address)
    for section in page.locator("#panels section").all():
        strip, name, energy = (box(each) for each in (section, section.locator("h2"), section.locator("p")))
        assert name["height"] > 12
        assert name["bottom"] <= energy["y"] + 0.5
        assert energy["bottom"] <= strip["bottom"] + 0.5  # where its room begins


def test_words_have_room_in_their_buttons(page: Page, program: Serve) -> None:
    visit(page, program("cage", 40).address)
    for name in ("fit", "copy", "help"):
        room = page.get_by_test_id(name).evaluate(
            """(button) => { const text = document.createRange(); text.selectNodeContents(button);
            return (button.getBoundingClientRect().width - text.getBoundingClientRect().width) / 2 }"""
        )
        assert room >= 8


# ---- The page for those who see little or use no mouse, and on small phones: what axe-core finds, and what the keyboard
# reaches ----


SIZES = [(1280, 800), (320, 640)]


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES, ids=["wide", "phone"])
def test_axe_finds_nothing(page: Page, program: Serve, size: tuple[int, int], theme: str) -> None:
    if importlib.util.find_spec("axe_playwright_python") is None:
        pytest.skip("axe-playwright-python is not installed")
    from axe_playwright_python.sync_playwright import Axe

    page.set_viewport_size({"width": size[0], "height": size[1]})
    visit(page, program("bounce-order" if theme == "dark" else "cage", 1 if theme == "dark" else 40, 1_000_000, 1).address)
    page.get_by_test_id("theme").select_option(theme)
    found = Axe().run(page).response["violations"]
    assert [(each["id"], each["impact"], [node["html"][:80] for node in each["nodes"]]) for each in found] == []


@pytest.mark.parametrize("size", SIZES, ids=["wide", "phone"])
def test_all_of_it_is_within_reach(page: Page, program: Serve, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    visit(page, program("cage", 40).address)
    beyond = page.locator("html, aside").evaluate_all("(all) => all.map((each) => each.scrollWidth - each.clientWidth)")
    assert beyond == [0, 0]  # nothing stands out
    if size[0] < 600:
        for each in page.locator("aside .bar button:visible, .choice label").all():
            place = box(each)
            assert place["height"] >= 24  # WCAG 2.2, 2.5.8: a finger finds it
            assert 0 <= place["x"] < place["x"] + place["width"] <= size[0]

    page.get_by_test_id("help").click()
    assert page.get_by_test_id("sheet").evaluate("(sheet) => sheet.scrollWidth - sheet.clientWidth") == 0
    page.keyboard.press("Escape")

    # Everything that can be used can be tabbed to, and has a name.
    usable = "aside button:visible:enabled, aside select:visible, aside input:visible, aside summary:visible"
    wanted = set(page.locator(usable).evaluate_all("(all) => all.map((each) => each.id || each.value || each.textContent)"))
    assert len(wanted) > 15
    page.evaluate("() => document.activeElement.blur()")
    met: set[str] = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        met.add(page.evaluate("() => { const at = document.activeElement; return at.id || at.value || at.textContent; }"))
    # One of a group of radio buttons is tabbed to; arrows choose among them.
    tools = set(page.locator("[name=tool]").evaluate_all("(all) => all.map((each) => each.value)"))
    assert wanted - tools <= met
    assert met & tools
    page.locator("[name=tool][value=drag]").focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator("[name=tool][value=poke]")).to_be_checked()
    page.get_by_test_id("substeps").focus()
    before = page.get_by_test_id("substeps").input_value()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("substeps")).to_have_value(str(int(before) + 1))
    page.get_by_test_id("pause").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("pause")).to_have_text("Resume")
    assert number(page, "particles") == 40


# ---- The measurement of the page runs and accounts for all of a frame's time ----


ROOT = Path(__file__).resolve().parents[2]

PARTS = ("physics ran", "queued", "waited", "a frame every")
"""Of a frame's time, as the benchmark of the page prints them, and the whole."""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="who had the processor is read off Linux's /proc")
def test_the_page_is_measured_watched_and_unwatched() -> None:
    chromium()
    run = python("-m", "benchmarks", "page", "--particles", "300", "--seconds", "2", cwd=ROOT, check=True)
    _, unwatched, alone, watched, shared, pictures, costs, late = run.stdout.splitlines()
    for which, pace, times in (("unwatched", unwatched, alone), ("watched", watched, shared)):
        assert pace.split()[:2] == ["300", which]
        ran, queued, waited, every = (float(re.findall(rf"{part} ([\d.]+)", pace + times)[0]) for part in PARTS)
        assert ran > 0
        assert ran + queued + waited == pytest.approx(every, abs=0.05)  # a frame's time, all accounted for
    assert 0 < float(pictures.split()[0]) < 70
    each, whole = costs.split(": in all ")
    assert {"web", "renderer"} <= set(re.findall(r"[a-z-]+(?= [\d.]+)", each))
    assert float(whole.split(",")[0]) == pytest.approx(sum(map(float, re.findall(r"\d+\.\d", each))), abs=0.5)
    assert float(late.split()[3]) > 0
