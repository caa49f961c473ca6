"""What stands where on the page: nothing covers anything else."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Locator, Page

from .browser import Serve, visit


def box(element: Locator) -> dict[str, float]:
    found = element.bounding_box()
    assert found is not None
    return {"y": found["y"], "height": found["height"], "bottom": found["y"] + found["height"]}


def place(page: Page, x: float, y: float) -> list[float]:
    found: list[float] = page.evaluate("([x, y]) => window.pyverlet.camera.toScreen(x, y)", [x, y])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_no_wall_runs_through_the_title(page: Page, program: Serve, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    visit(page, program("rope-bridge", 40).address)
    x0, y0, x1, y1 = page.evaluate("() => window.pyverlet.camera.room")
    margin = 0.03 / 1.06 * max(x1 - x0, y1 - y0)  # VIEW_MARGIN around the bounds
    assert place(page, x0 + margin, y1 - margin)[1] > box(page.locator("header"))["bottom"]
    foot = box(page.locator("aside"))["y"] if size[0] < 600 else size[1]
    assert place(page, x0 + margin, y0 + margin)[1] < foot
    for _ in range(5):
        page.keyboard.press("+")  # what is nearer is also seen behind the title
    top = page.evaluate("() => window.pyverlet.camera.toWorld(0, 0)")[1]
    assert top < y1
    assert page.evaluate("() => window.pyverlet.camera.part")[3] == pytest.approx(top)


@pytest.mark.slow
def test_where_only_a_part_of_a_room_is_on_show_it_has_all_the_height(page: Page, program: Serve) -> None:
    visit(page, program("image", 40).address)
    assert page.evaluate("() => window.pyverlet.camera.free.top") == 0


@pytest.mark.slow
def test_a_round_room_leaves_the_corner_to_the_title_and_has_all_the_height(page: Page, program: Serve) -> None:
    visit(page, program("cage", 40).address)
    free: dict[str, Any] = page.evaluate("() => window.pyverlet.camera.free")
    assert (free["top"], free["height"]) == (0, 800)


@pytest.mark.slow
def test_panels_have_their_names_on_a_phone(page: Page, program: Serve) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    visit(page, program("energy-10-substeps", 1).address)
    for section in page.locator("#panels section").all():
        strip, name, energy = (box(each) for each in (section, section.locator("h2"), section.locator("p")))
        assert name["height"] > 12
        assert name["bottom"] <= energy["y"] + 0.5
        assert energy["bottom"] <= strip["bottom"] + 0.5  # where its room begins


@pytest.mark.slow
def test_words_have_room_in_their_buttons(page: Page, program: Serve) -> None:
    visit(page, program("cage", 40).address)
    for name in ("fit", "copy", "help"):
        room = page.get_by_test_id(name).evaluate(
            """(button) => { const text = document.createRange(); text.selectNodeContents(button);
            return (button.getBoundingClientRect().width - text.getBoundingClientRect().width) / 2 }"""
        )
        assert room >= 8
