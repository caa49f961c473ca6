"""Every control of the page, driven in Chromium as a user does, its effect read in the numbers. With and without WebGL."""

import math
import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

import pyverlet as pv

from . import browser
from .browser import Serve, ask_for, box, comes_true, draw, each, everywhere, number, pause, rgb, shown, status, visit, where

pytestmark = pytest.mark.slow


def reads(page: Page, name: str, value: Any) -> bool:
    return comes_true(page, lambda: status(page)[name] == value)


def tool(page: Page, name: str) -> None:
    page.locator(f"#tool label:has(input[value={name}])").click()


def picture(page: Page) -> NDArray[np.float32]:
    page.wait_for_timeout(150)
    return browser.seen_pixels(page)


def test_gravity_has_a_strength_and_a_direction(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100).address)
    assert status(page)["ledger"] is None  # a world without one shows none
    expect(page.get_by_test_id("ledger")).to_be_hidden()
    pause(page)
    page.get_by_test_id("gravity").fill("4")
    assert reads(page, "gravity", [0, -4])
    page.get_by_test_id("angle").fill("90")
    assert reads(page, "gravity", [4, 0])
    page.get_by_test_id("angle").blur()
    page.keyboard.press("ArrowRight")
    turned = math.radians(15)
    assert comes_true(page, lambda: status(page)["gravity"] == pytest.approx([4 * math.cos(turned), 4 * math.sin(turned)]))
    page.keyboard.press("0")
    assert reads(page, "gravity", [0, 0])
    expect(page.locator("#gravity-value")).to_have_text("0.00")
    page.keyboard.press("0")
    assert comes_true(page, lambda: math.hypot(*status(page)["gravity"]) == pytest.approx(4))
    page.get_by_test_id("angle").dblclick(position={"x": 5, "y": 5})  # back to where it was at first
    assert comes_true(page, lambda: status(page)["gravity"][0] == pytest.approx(0, abs=1e-6))


def test_substeps_restitution_friction_and_integrator(page: Page, program: Serve) -> None:
    visit(page, program("box", 60).address)
    expect(page.get_by_test_id("restitution")).to_have_value("0.5")
    expect(page.get_by_test_id("friction")).to_have_value("0.2")
    page.get_by_test_id("restitution").fill("1")
    assert reads(page, "restitution", 1)
    page.get_by_test_id("friction").fill("0")
    assert reads(page, "friction", 0)
    # Elastic and smooth: while all fall and bounce for the first time, no energy is lost; with e = 0.5, six tenths. Later on, who
    # lies on others when it is hit loses some.
    start = pv.scenes.get("box").world(particles=60).energy().total
    page.get_by_test_id("reset").click()
    assert comes_true(page, lambda: number(page, "time") > 2 and status(page)["energy"] == pytest.approx(start, rel=0.01))
    assert (status(page)["restitution"], status(page)["friction"]) == (1, 0)
    page.get_by_test_id("substeps").fill("3")
    assert reads(page, "substeps", 3)
    page.get_by_test_id("integrator").select_option("rk4")
    assert reads(page, "integrator", "rk4")
    expect(page.get_by_test_id("integrator")).to_have_value("rk4")


def test_the_ledger_says_where_the_energy_has_gone(page: Page, program: Serve) -> None:
    visit(page, program("box", 60, 150_000, 1).address)
    assert comes_true(page, lambda: number(page, "time") > 2)
    pause(page)
    page.wait_for_timeout(300)
    booked = status(page)["ledger"]
    assert sum(booked.values()) == pytest.approx(status(page)["energy"], rel=1e-6)
    assert booked["restitution"] < -10  # this scene bounces with e = 0.5 and rubs
    assert booked["friction"] < -1
    rows = {row.locator("td").nth(0).inner_text(): row for row in page.locator("#ledger tr").all()}
    assert list(rows) == [name for name in booked if booked[name] or name == "residual"]
    assert float(rows["restitution"].locator("td").nth(2).inner_text()) == pytest.approx(booked["restitution"], abs=0.6)
    middle, bar = (box(rows["restitution"].locator(each).first) for each in ("td:nth-child(2)", "i"))
    # What is lost goes to the left of the middle; the largest loss fills its half.
    assert bar["x"] + bar["width"] == pytest.approx(middle["x"] + middle["width"] / 2, abs=1)
    assert bar["width"] == pytest.approx(middle["width"] / 2, abs=1)
    page.get_by_test_id("scene").select_option("cage")  # another scene keeps one too
    assert comes_true(page, lambda: status(page)["particles"] == 5000 and status(page)["ledger"] is not None)


def test_another_number_of_circles_and_another_scene(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100).address)
    page.get_by_test_id("gravity").fill("5")
    ask_for(page, 150)
    assert reads(page, "particles", 150)
    assert status(page)["gravity"] == [0, -5]
    expect(page.get_by_test_id("particles")).to_have_text("150")
    page.get_by_test_id("scene").select_option("bounce-order")
    expect(page.locator("#title")).to_have_text("bounce-order")
    expect(page.locator("#panels h2")).to_have_text(["position first", "velocity first"])
    # What this world lacks is not offered, nor what the two differ in.
    expect(page.locator("#friction-field")).to_be_hidden()
    expect(page.locator("#integrator-field")).to_be_hidden()
    expect(page.locator("#restitution-field")).to_be_visible()
    assert comes_true(page, lambda: number(page, "time") > 0.3)
    page.get_by_test_id("scene").select_option("box")
    expect(page.locator("#title")).to_have_text("box")
    expect(page.locator("#panels h2")).to_have_count(0)
    assert reads(page, "particles", 2000)


def test_the_scene_image_shows_its_colours(page: Page, program: Serve) -> None:
    visit(page, program("image", 40).address)
    expect(page.get_by_test_id("colour")).to_have_value("picture")
    inks = each(page, "tint", 40)
    pause(page)
    colours, seen = rgb(inks) / 255, picture(page)
    places = everywhere(page, 40)
    inside = [i for i, (_, _, left, top) in enumerate(places) if 0 < left < 960 and 70 < top < 790]
    assert len(inside) >= 3
    for i in inside:
        assert seen[round(places[i, 3]), round(places[i, 2])] == pytest.approx(colours[i], abs=0.02)
    page.get_by_test_id("colour").select_option("order")
    assert shown(page, "tint(0)") != inks[0]


@pytest.mark.parametrize("colouring", ["mass", "speed", "energy"])
def test_colours_say_what_they_say(page: Page, program: Serve, colouring: str) -> None:
    """Brighter and yellower for more: the palette's lightness grows along it."""
    page.emulate_media(color_scheme="dark")
    visit(page, program("box", 100).address)
    assert comes_true(page, lambda: number(page, "time") > 0.3)
    pause(page)  # before the choice: the scale follows what was usual, and lags behind what is while the circles land
    page.get_by_test_id("colour").select_option(colouring)
    page.wait_for_timeout(500)
    light = rgb(each(page, "tint", 100)) @ (0.3, 0.59, 0.11)
    assert np.ptp(light) > 40
    if colouring == "mass":
        assert np.corrcoef(light, np.log(each(page, "mass", 100)))[0, 1] > 0.9


def test_groups_have_a_colour_each(page: Page, program: Serve) -> None:
    visit(page, program("soft-bodies", 2200).address)
    page.get_by_test_id("colour").select_option("group")
    groups = shown(page, "groups()")
    assert len(groups) == 6  # the grains, and five bodies
    assert sum(count for _, count in groups) == 2200
    inks = each(page, "tint", 2200)
    colours = np.split(rgb(inks), np.cumsum([count for _, count in groups])[:-1])
    assert max(np.ptp(own, axis=0).max() for own in colours) < 60  # tones of one hue
    apart = np.hypot.reduce(np.diff([own.mean(axis=0) for own in colours], axis=0), axis=1)
    assert apart.min() > 60  # neighbours in the order of adding are told apart
    page.keyboard.press("4")
    page.mouse.click(500, 120)  # a circle added by pointer is a group of its own
    assert comes_true(page, lambda: len(shown(page, "groups()")) == len(groups) + 1)
    assert shown(page, "tint(0)") == inks[0]


def test_slow_motion(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100).address)
    page.get_by_test_id("speed").select_option("0.125")
    assert reads(page, "speed", 0.125)
    page.wait_for_timeout(400)
    before = status(page)["time"]
    page.wait_for_timeout(2000)
    assert 0.1 < status(page)["time"] - before < 0.5
    assert number(page, "fps") > 15  # smooth all the same: eight frames a second are made
    assert 0.06 < number(page, "pace") < 0.2
    expect(page.locator("#link")).to_have_text(re.compile(r"^live at 0\.\d+\W speed$"))
    page.keyboard.press("s")
    assert reads(page, "speed", 0.03125)
    page.keyboard.press("s")
    assert reads(page, "speed", 1)
    pause(page)
    expect(page.locator("#link")).to_have_text("paused")
    expect(page.get_by_test_id("pace")).to_have_text(browser.NO_OUTLINES)


def test_pin_and_let_go(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100).address)
    pause(page)
    page.keyboard.press("r")  # a page that opens late finds it in the heap, with nothing to fall into
    assert reads(page, "time", 0)
    place = where(page, 99)
    tool(page, "pin")
    page.mouse.click(place["left"], place["top"])
    assert comes_true(page, lambda: bool(page.evaluate("() => window.pyverlet.mass(99) === Infinity")))
    page.keyboard.press("Space")
    assert comes_true(page, lambda: number(page, "time") > 1.5)
    assert where(page, 99)["y"] == pytest.approx(place["y"], abs=0.01)
    page.mouse.click(place["left"], place["top"])
    assert comes_true(page, lambda: where(page, 99)["y"] < place["y"] - 1)


def test_circles_are_added_and_erased_one_by_one_and_in_strokes(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100).address)
    page.keyboard.press("4")
    page.mouse.click(500, 300)
    assert reads(page, "particles", 101)
    draw(page, (300, 300), (600, 300), steps=20)
    assert comes_true(page, lambda: status(page)["particles"] > 104)
    page.get_by_test_id("reset").click()
    assert reads(page, "particles", 100)
    # Erased, and back again.
    pause(page)
    place = where(page, 99)
    page.keyboard.press("5")
    page.mouse.click(place["left"], place["top"])
    assert reads(page, "particles", 99)
    # A stroke over four others, wherever the fall was when it was paused; each within a frame of its own.
    spots = everywhere(page, 100)[[5, 30, 55, 80], 2:].tolist()
    draw(page, spots[0], *spots, wait=100)
    assert comes_true(page, lambda: status(page)["particles"] <= 95)
    page.keyboard.press("r")
    assert reads(page, "particles", 100)


def test_zoom_move_and_fit(page: Page, program: Serve) -> None:
    visit(page, program("cage", 400).address)
    pause(page)
    fitted = shown(page, "camera.scale")
    place = where(page, 200)
    mouse = [round(place["left"]), round(place["top"])]  # wheels come in whole pixels
    page.mouse.move(*mouse)
    for _ in range(4):
        page.mouse.wheel(0, -300)
    assert comes_true(page, lambda: shown(page, "camera.scale") > 5 * fitted)
    page.wait_for_timeout(300)
    near = where(page, 200)
    closer = shown(page, "camera.scale") / fitted
    expected = [mouse[0] + closer * (place["left"] - mouse[0]), mouse[1] + closer * (place["top"] - mouse[1])]
    assert [near["left"], near["top"]] == pytest.approx(expected, abs=2)
    # As large as it should be: a disc's colours over its whole width, and the wall's or a neighbour's beyond.
    radius = 0.5 * shown(page, "camera.scale")
    seen = picture(page)
    row = seen[round(near["top"]), round(near["left"] - 0.9 * radius) : round(near["left"] + 0.9 * radius)]
    assert np.ptp(row, axis=0).max() < 0.02
    draw(page, mouse, (place["left"] + 50, place["top"] + 20), steps=4, button="right", wait=300)
    moved = where(page, 200)
    assert [moved["left"] - near["left"], moved["top"] - near["top"]] == pytest.approx([50, 20], abs=2)
    tool(page, "move")
    draw(page, (400, 400), (360, 400), steps=4, wait=300)
    assert where(page, 200)["left"] == pytest.approx(moved["left"] - 40, abs=2)
    page.keyboard.press("+")
    page.keyboard.press("-")
    page.get_by_test_id("fit").click()
    assert shown(page, "camera.scale") == pytest.approx(fitted)
    page.wait_for_timeout(300)
    assert where(page, 200)["left"] == pytest.approx(place["left"], abs=1)


def test_velocities_and_contacts_are_drawn(page: Page, program: Serve) -> None:
    visit(page, program("box", 200).address)
    assert comes_true(page, lambda: number(page, "time") > 0.5)
    page.get_by_test_id("velocities").check()
    assert comes_true(page, lambda: shown(page, "overlay.arrows") > 50)
    assert comes_true(page, lambda: number(page, "time") > 4)
    pause(page)
    page.get_by_test_id("contacts").check()
    assert comes_true(page, lambda: shown(page, "overlay.contacts") > 100)
    page.wait_for_timeout(300)
    found = shown(page, "overlay.contacts")
    # As many as there are, found here pair by pair from where the circles are.
    places = everywhere(page, 200)[:, :2]
    radii = each(page, "mass", 200) ** 0.5 / 2
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    touching = np.triu(apart < 1.004 * (radii[:, None] + radii), 1).sum()
    assert found == pytest.approx(touching, abs=3)
    page.get_by_test_id("velocities").uncheck()
    page.keyboard.press("t")
    assert comes_true(page, lambda: shown(page, "overlay.contacts") == 0)


def test_circles_that_do_not_collide_have_no_contacts(page: Page, program: Serve) -> None:
    visit(page, program("orbit", 300).address)  # a world without collisions
    page.get_by_test_id("contacts").check()
    assert comes_true(page, lambda: number(page, "time") > 1)
    assert shown(page, "overlay.contacts") == 0
    # Six circles in a row, each of radius 0.5 and touching the next: who may not is left out.
    row = """async (shape) => (await import("/contacts.js")).touching(
        {count: 6, mass: [1, 1, 1, 1, 1, 1], apart: [], kinds: null, ...shape},
        [0, 1, 2, 3, 4, 5], [0, 0, 0, 0, 0, 0], Array(6).fill(0.5))"""
    assert page.evaluate(row, {}) == [0, 1, 1, 2, 2, 3, 3, 4, 4, 5]
    assert page.evaluate(row, {"apart": [1, 2, 4, 5]}) == [0, 1, 2, 3, 3, 4]
    everyone = 0xFFFFFFFF
    kinds = [1, everyone, 2, everyone, 4, everyone - 2, 4, everyone, 4, everyone, 4, 4]
    assert page.evaluate(row, {"kinds": kinds}) == [0, 1, 2, 3, 3, 4, 4, 5]
    pinned = """async () => (await import("/contacts.js")).touching(
        {count: 3, mass: [1, Infinity, Infinity], apart: [], kinds: null}, [0, 1, 2], [0, 0, 0], [0.5, 0.5, 0.5])"""
    assert page.evaluate(pinned) == [0, 1]


def test_the_page_says_why_an_overlay_is_off(page: Page, program: Serve) -> None:
    visit(page, program("cage", 100, 50).address)  # the server draws
    for name in ("velocities", "contacts"):
        expect(page.get_by_test_id(name)).to_be_disabled()
        expect(page.locator(f"label:has(#{name})")).to_have_attribute("title", re.compile("Not drawn over pictures"))
    ask_for(page, 40)
    for name in ("velocities", "contacts"):
        expect(page.get_by_test_id(name)).to_be_enabled()
        expect(page.locator(f"label:has(#{name})")).to_have_attribute("title", "")


def test_dark_and_light(page: Page, program: Serve) -> None:
    visit(page, program("cage", 50).address)

    def corner() -> float:
        return float(picture(page)[-5, 5].mean())

    page.get_by_test_id("theme").select_option("dark")
    assert corner() < 0.2
    page.keyboard.press("d")
    expect(page.get_by_test_id("theme")).to_have_value("light")
    assert corner() > 0.8


def test_the_sheet_lists_the_keys(page: Page, program: Serve) -> None:
    visit(page, program("cage", 50).address)
    page.keyboard.press("?")
    expect(page.get_by_test_id("sheet")).to_be_visible()
    assert page.locator("#sheet tr").count() >= 18
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("sheet")).to_be_hidden()
    page.get_by_test_id("help").click()
    page.locator("#sheet-close").click()
    expect(page.get_by_test_id("sheet")).to_be_hidden()
    for key in "cvtd":  # nothing fails
        page.keyboard.press(key)
    page.keyboard.press("f")


def test_a_link_carries_scene_and_settings(page: Page, browser: Browser, program: Serve) -> None:
    address = program("cage", 100).address
    visit(page, address)
    assert page.url == address  # nothing was changed yet
    page.get_by_test_id("scene").select_option("box")
    expect(page.locator("#title")).to_have_text("box")
    ask_for(page, 70)
    assert reads(page, "particles", 70)
    for name, value in (("gravity", "3"), ("substeps", "5"), ("restitution", "0.9"), ("friction", "0.1")):
        page.get_by_test_id(name).fill(value)
    page.get_by_test_id("integrator").select_option("velocity-verlet")
    page.get_by_test_id("colour").select_option("mass")
    page.get_by_test_id("copy").click()
    expect(page).to_have_url(re.compile("friction=0.1"))
    expect(page).to_have_url(re.compile("integrator=velocity-verlet"))
    link = page.url
    assert "#" in link

    elsewhere = program("cage", 100).address + "#" + link.partition("#")[2]
    other = browser.new_page()
    visit(other, elsewhere)
    expect(other.locator("#title")).to_have_text("box")
    assert reads(other, "integrator", "velocity-verlet")
    now = status(other)
    assert (now["particles"], now["gravity"], now["substeps"]) == (70, [0, -3], 5)
    assert (now["restitution"], now["friction"]) == (0.9, 0.1)
    expect(other.get_by_test_id("colour")).to_have_value("mass")
    frames = status(other)["frames"]
    other.reload()  # asks for what is there already: nothing begins anew
    assert comes_true(other, lambda: (status(other) or {"frames": 0})["frames"] > frames)
    other.close()


@pytest.mark.parametrize(
    "settings", ["scene=nowhere&particles=-5", "particles=1e99&gravity=a,b&substeps=x", "%%%", "integrator=<b>&colour=pink"]
)
def test_a_link_of_nonsense_does_no_harm(page: Page, program: Serve, settings: str) -> None:
    visit(page, program("cage", 50).address + "#" + settings)
    assert comes_true(page, lambda: number(page, "time") > 0.3)
    assert status(page)["particles"] == 50
    assert status(page)["error"] is None


def test_curves_and_stages(page: Page, program: Serve) -> None:
    visit(page, program("cage", 5000).address)
    assert comes_true(page, lambda: number(page, "time") > 1)
    pause(page)
    now = status(page)
    assert now["kinetic"] + now["potential"] + now["links"] == pytest.approx(now["energy"])
    assert number(page, "potential") == pytest.approx(now["potential"], rel=0.01, abs=1)
    assert {"integrate", "pairs"} <= now["stages"].keys()
    expect(page.get_by_test_id("stages")).to_contain_text("pairs")
    drawn = """(id) => { const canvas = document.getElementById(id); const data = canvas.getContext("2d").getImageData(0, 0,
        canvas.width, canvas.height).data; return new Set(Array.from({length: data.length / 4}, (_, i) => data[4 * i + 3] > 200 ?
        (data[4 * i] << 16) | (data[4 * i + 1] << 8) | data[4 * i + 2] : -1)).size }"""
    assert page.evaluate(drawn, "physics-chart") > 3  # several stages, several colours
    assert page.evaluate(drawn, "energy-chart") > 3


def test_a_phone_has_a_drawer_and_fingers(chrome: Browser, program: Serve) -> None:
    context = chrome.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True, device_scale_factor=2)
    page = context.new_page()
    visit(page, program("cage", 200).address)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    drawer = box(page.locator("aside"))["y"]
    assert drawer > 400
    fold = page.get_by_test_id("fold")
    fold.tap()
    expect(fold).to_have_attribute("aria-expanded", "false")
    assert box(page.locator("aside"))["y"] > drawer + 200
    page.get_by_test_id("pause").tap()
    assert reads(page, "paused", True)
    before = shown(page, "camera.scale")
    session = context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        fingers = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    for gap, kind in ((20, "touchStart"), (60, "touchMove"), (100, "touchMove")):  # two fingers zoom
        touch(kind, (195 - gap, 300), (195 + gap, 300))
    touch("touchEnd")
    assert shown(page, "camera.scale") > 3 * before
    page.keyboard.press("f")
    page.get_by_test_id("pause").tap()
    assert comes_true(page, lambda: number(page, "time") > 3)  # at rest: it is still there when the finger comes
    place = where(page, 100)
    touch("touchStart", (place["left"], place["top"]))  # one pulls
    for k in range(1, 7):
        touch("touchMove", (195, place["top"] - 10 * k))
    assert comes_true(page, lambda: where(page, 100)["top"] < place["top"] - 30)
    touch("touchEnd")
    context.close()


def test_large_worlds_are_drawn_by_the_server(page: Page, program: Serve) -> None:
    """Chosen by itself and shown; zoom, theme and colours reach the picture, and the mouse its circles."""
    page.emulate_media(color_scheme="dark")
    visit(page, program("cage", 300, 300).address)
    expect(page.get_by_test_id("drawing")).to_have_text("pictures (JPEG)")
    expect(page.get_by_test_id("velocities")).to_be_disabled()
    assert comes_true(page, lambda: number(page, "time") > 2)
    pause(page)
    page.wait_for_timeout(300)

    def seen() -> NDArray[np.float32]:
        # The heap, at the cage's foot: the middle of what is left of the controls.
        return picture(page)[500:780, 300:700]

    before = seen()
    assert (np.ptp(before, axis=2) > 0.15).mean() > 0.5
    page.mouse.move(500, 700)
    page.mouse.wheel(0, -600)
    assert comes_true(page, lambda: bool(np.abs(seen() - before).mean() > 0.05))
    page.get_by_test_id("fit").click()
    assert comes_true(page, lambda: bool(np.abs(seen() - before).mean() < 0.01))
    page.get_by_test_id("colour").select_option("mass")  # all alike: one colour instead of many
    hues = np.ptp(before.reshape(-1, 3), axis=0).sum()
    assert comes_true(page, lambda: bool(np.abs(seen() - before).mean() > 0.05))
    assert hues > 1
    page.get_by_test_id("theme").select_option("light")
    assert comes_true(page, lambda: bool(seen().mean() > before.mean() + 0.15))
    ask_for(page, 200)
    assert reads(page, "particles", 200)
    expect(page.get_by_test_id("drawing")).to_have_text("Canvas2D")  # few enough again


def test_circles_that_roll_have_marks(page: Page, program: Serve) -> None:
    visit(page, program("conveyor", 60).address)
    assert comes_true(page, lambda: shown(page, "overlay.marks") > 10)
    visit(page, program("cage", 60).address)
    assert comes_true(page, lambda: status(page)["frames"] > 5)
    assert shown(page, "overlay.marks") == 0  # nobody turns there


def test_links_are_drawn_and_a_cloth_is_torn(page: Page, program: Serve) -> None:
    visit(page, program("cloth", 500).address)
    assert comes_true(page, lambda: shown(page, "overlay.links") > 500)
    whole = shown(page, "overlay.links")
    # Take the cloth in its middle and throw the mouse across the page: what pulls too hard breaks.
    place = where(page, 240)
    page.mouse.move(place["left"], place["top"])
    page.mouse.down()
    page.mouse.move(place["left"] + 400, place["top"] + 300, steps=4)
    assert comes_true(page, lambda: shown(page, "overlay.links") < whole)
    page.mouse.up()
