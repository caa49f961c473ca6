"""Colours say what they should; metres become pixels and pixels metres."""

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.picture import DARK, LIGHT, ByMass, ByOrigin, BySpeed, Fixed, Groups, View
from pyverlet.picture.colour import STEPS, TONES, heat, hues, oklch


def row(count: int = 100, **options: Any) -> pv.World:
    world = pv.World(collisions=None)
    world.add(position=np.column_stack((np.arange(count) * 2.0, np.zeros(count))), **options)
    return world


def steps(colours: Any, palette: Any) -> list[int]:
    """Which step of the palette each colour is."""
    where = {int(colour): k // TONES for k, colour in enumerate(palette)}
    return [where[int(colour)] for colour in colours]


def test_oklch_knows_white_black_and_red() -> None:
    # sRGB red is L 0.6280, C 0.2577, h 29.23 in OKLCH (Ottosson 2020).
    white, black, red = oklch(np.array([1.0, 0.0, 0.62796]), np.array([0.0, 0.0, 0.25768]), np.array([0.0, 0.0, 29.234]))
    assert (white, black, red) == (0xFFFFFF, 0x000000, 0x0000FF)


@pytest.mark.parametrize("dark", [True, False])
def test_palettes_have_a_colour_for_every_step(dark: bool) -> None:
    for palette in (hues(dark), heat(dark)):
        assert len(palette) == STEPS * TONES
        assert len(set(palette.tolist())) > 0.95 * len(palette)


@pytest.mark.parametrize(
    ("colouring", "world", "theme", "palette", "expected"),
    [
        (ByOrigin(), row(), DARK, hues(True), [k * STEPS // 100 for k in range(100)]),  # the hues in order
        (BySpeed(full=10), row(5, velocity=[(v, 0) for v in (0, 2.5, 5, 10, 99)]), LIGHT, heat(False), [0, 15, 31, 63, 63]),
        (ByMass(), row(4, mass=[1.0, 10.0, 100.0, np.inf]), DARK, heat(True), [0, 31, 63, 63]),  # even in ratios
        (ByMass(), row(2), DARK, heat(True), [0, 0]),
    ],
)
def test_steps_of_the_palette(colouring: Any, world: pv.World, theme: Any, palette: Any, expected: list[int]) -> None:
    assert steps(colouring.colours(world, theme), palette) == expected


def test_by_speed_follows_what_is_usual() -> None:
    world = row(3, velocity=(4.0, 0.0))
    colouring = BySpeed()
    assert steps(colouring.colours(world, DARK), heat(True)) == [STEPS // 3] * 3  # the mean is a third of the scale
    # The scale nears the new mean with a time constant of 1/3 s, however many pictures there are on the way.
    world.velocity[:, 0] = 2.0
    for world.time in np.linspace(0, 1 / 3, 7):
        found = steps(colouring.colours(world, DARK), heat(True))
    assert found == [int((STEPS - 1) * 2.0 / (3 * (2.0 + 2.0 * np.exp(-1))))] * 3
    world.time = 0.0  # it was reset: begin anew
    assert steps(colouring.colours(world, DARK), heat(True)) == [STEPS // 3] * 3


def test_groups_have_a_hue_each_and_the_rest_is_grey() -> None:
    world = row(2)
    first, second = world.add(position=[(0, 5)]), world.add(position=[(0, 9), (3, 9)])
    colours = Groups(first, second).colours(world, DARK)
    assert colours[:2].tolist() == [0x9A9A9A] * 2
    assert steps(colours[2:], hues(True)) == [0, STEPS // 2, STEPS // 2]


def test_all_groups_of_a_world_have_hues_far_apart() -> None:
    world = row(2)
    for k in range(5):
        world.add(position=[(0, 5 + 4 * k)])
    found = steps(Groups().colours(world, DARK), hues(True))
    assert found[0] == found[1]
    assert found[1:] == [int(k * (5**0.5 - 1) / 2 % 1 * STEPS) for k in range(6)]
    assert np.diff(sorted(found[1:])).min() >= 5
    world.remove(3)
    assert steps(Groups().colours(world, DARK), hues(True)) == found[:3] + found[4:]


def test_fixed_colours_are_the_users() -> None:
    world = row(2)
    assert Fixed([(255, 0, 1), (0, 128, 0)]).colours(world, DARK).tolist() == [0x0100FF, 0x008000]
    assert Fixed((1, 2, 3)).colours(world, DARK).tolist() == [0x030201] * 2


@pytest.mark.parametrize("colouring", [ByOrigin(), BySpeed(), ByMass(), Groups()])
def test_an_empty_world_has_no_colours(colouring: Any) -> None:
    assert len(colouring.colours(pv.World(), DARK)) == 0


@pytest.mark.parametrize("y_up", [False, True])
def test_to_screen_and_back(y_up: bool) -> None:
    view = View.fit((-3, -1, 5, 3), (640, 480), y_up=y_up)
    assert view.scale == 80.0  # 8 m on 640 pixels; 4 m would have room for 120 pixels a metre
    assert view.to_screen((1, 1)).tolist() == [320, 240]
    assert view.to_screen((1, 2)).tolist() == [320, 320 if y_up else 160]
    points = np.random.default_rng(0).uniform(-5, 5, (20, 2))
    assert view.to_world(view.to_screen(points)) == pytest.approx(points, abs=1e-12)


@pytest.mark.parametrize("y_up", [False, True])
def test_zoom_keeps_what_is_under_the_mouse_and_a_drag_moves_it(y_up: bool) -> None:
    view = View.fit((0, 0, 10, 10), (200, 100), y_up=y_up)
    under = view.to_world((30, 40))
    zoomed = view.zoomed(2.5, (30, 40))
    assert zoomed.scale == 2.5 * view.scale
    assert zoomed.to_screen(under) == pytest.approx((30, 40))
    assert view.moved((12, -7)).to_screen(under) == pytest.approx((42, 33))


def test_pick_finds_what_is_under_the_mouse() -> None:
    world = row(3)  # radius 0.5 m at x = 0, 2, 4
    view = View.fit((-1, -1, 5, 1), (600, 200))
    assert view.pick(world, view.to_screen((2.3, 0.1))) == 1
    assert view.pick(world, view.to_screen((4.55, 0.0))) == 2  # 5 pixels beyond its rim
    assert view.pick(world, view.to_screen((4.55, 0.0)), reach=3) is None
    assert view.pick(world, view.to_screen((1.0, 0.9))) is None
    assert view.pick(pv.World(), (1, 1)) is None
