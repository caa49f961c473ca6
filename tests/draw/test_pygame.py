"""The pygame adapter, under SDL's dummy driver: the world's circles over the game's own picture."""

import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet import draw
from pyverlet.picture import Fixed, View

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
pygame: Any = pytest.importorskip("pygame")
adapter = pytest.importorskip("pyverlet.draw.pygame")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
BACK = (10, 60, 200)
ORANGE = (250, 120, 30)


def two() -> pv.World:
    world = pv.World(boundary=pv.Box((0, 0), (10, 8)))
    world.add(position=[(3, 4), (7.3, 4.2)], radius=[1.0, 1.5])
    return world


SURFACES: dict[str, Any] = {
    "plain": pygame.Surface((200, 160), depth=32),
    "red first": pygame.Surface((200, 160), depth=32, masks=(0xFF, 0xFF00, 0xFF0000, 0)),
    "alpha": pygame.Surface((200, 160), pygame.SRCALPHA),
    "part of another": pygame.Surface((300, 200), depth=32).subsurface((20, 10, 200, 160)),
}


@pytest.mark.parametrize("kind", SURFACES)
def test_circles_over_the_games_picture(kind: str) -> None:
    surface = SURFACES[kind]
    surface.fill(BACK)
    world = two()
    view = View.fit((0, 0, 10, 8), (200, 160))  # 20 pixels a metre
    adapter.draw(surface, world, view, colour=Fixed(ORANGE), walls=False)
    seen = [tuple(surface.get_at(place)) for place in ((60, 80), (146, 76), (5, 5))]
    assert [colour[:3] for colour in seen] == [ORANGE, ORANGE, BACK]
    assert seen[0][3] == 255
    # The colour mixes by covered area: red goes from 10 to 250 over pi (20^2 + 30^2) pixels. A pixel of a rim, at most 8 r + 8,
    # is off by half of 1/255 in what it covers and half a level in its colour.
    red = pygame.surfarray.array3d(surface)[..., 0].astype(float)
    assert ((red - 10) / 240).sum() == pytest.approx(np.pi * (20**2 + 30**2), abs=(8 * 50 + 16) * (0.5 / 255 + 0.5 / 240))


def test_a_circle_that_has_turned_has_a_mark() -> None:
    surface, world, view = pygame.Surface((200, 160), depth=32), two(), View.fit((0, 0, 10, 8), (200, 160))
    world.angle[1] = np.pi / 2  # up, in half of its brightness; the other one's points to the right
    adapter.draw(surface, world, view, colour=Fixed(ORANGE), walls=False)
    half = np.array(ORANGE) // 2
    for x, y in ((146, 61), (70, 80)):
        assert np.abs(np.array(surface.get_at((x, y)))[:3] - half).max() < 40
    for x, y in ((146, 91), (50, 80)):
        assert tuple(surface.get_at((x, y)))[:3] == ORANGE


def test_walls_are_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = pygame.Surface((220, 180), depth=32)
    world = two()
    view = draw.fit(world, (220, 180))
    adapter.draw(surface, world, view, colour=Fixed(ORANGE))
    x, y = view.to_screen((0, 4)).round().astype(int)
    near = [tuple(surface.get_at((int(x) + k, int(y))))[:3] for k in (-1, 0, 1)]
    assert max(near) > (60, 60, 60)
    assert tuple(surface.get_at((int(x) + 4, int(y))))[:3] == (0, 0, 0)


def test_what_does_not_fit_is_refused() -> None:
    world, view = two(), View.fit((0, 0, 10, 8), (200, 160))
    refused("surface has 24 bits a pixel", adapter.draw, pygame.Surface((200, 160), depth=24), world, view)
    with pytest.raises(pv.InputError, match=r"allowed is one of the surface's size, \(100, 160\)"):
        adapter.draw(pygame.Surface((100, 160), depth=32), world, view)
    refused("y_up=False", adapter.draw, SURFACES["plain"], world, View.fit((0, 0, 10, 8), (200, 160), y_up=True))


def test_the_example_runs_and_obeys_the_mouse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    example = importlib.import_module("with_pygame")
    world = example.make_world()
    monkeypatch.setattr(example, "make_world", lambda: world)
    view = draw.fit(world, example.SIZE)
    tenth = tuple(int(value) for value in view.to_screen(world.position[10]))
    held: list[int] = []
    flips = iter(range(1000))

    def flip() -> None:
        step = next(flips)
        if step == 0:
            pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=(300, 60), button=3))
            pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=tenth, button=1))
        elif step == 1:
            held.extend(force.particle for force in world.forces)
            pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=(500, 100), rel=(1, 1), buttons=(1, 0, 0)))
            pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONUP, pos=(500, 100), button=1))
        elif step == 8:
            pixels = pygame.surfarray.array3d(pygame.display.get_surface())
            assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    monkeypatch.setattr(pygame.display, "flip", flip)
    example.main()
    assert held == [10]
    assert not world.forces
    assert len(world) == 301
    assert world.frames > 0
