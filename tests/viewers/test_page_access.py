"""The page for those who see little or use no mouse, and on small phones: what axe-core finds, and what the keyboard reaches."""

from __future__ import annotations

import importlib.util

import pytest
from playwright.sync_api import Page, expect

from .browser import Serve, number, visit

SIZES = [(1280, 800), (320, 640)]


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES, ids=["wide", "phone"])
def test_all_of_it_is_within_reach(page: Page, program: Serve, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    visit(page, program("cage", 40).address)
    beyond = page.locator("html, aside").evaluate_all("(all) => all.map((each) => each.scrollWidth - each.clientWidth)")
    assert beyond == [0, 0]  # nothing stands out
    if size[0] < 600:
        for each in page.locator("aside .bar button:visible, .choice label").all():
            box = each.bounding_box()
            assert box is not None
            assert box["height"] >= 24  # WCAG 2.2, 2.5.8: a finger finds it
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= size[0]

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
        here = page.evaluate("() => { const at = document.activeElement; return at.id || at.value || at.textContent; }")
        met.add(here)
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
