"""The window, under SDL's dummy driver: every key and the mouse, and their effect in the world and in the pixels."""

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.cli import main
from pyverlet.picture import DARK
from pyverlet.viewers.commands import Step
from pyverlet.viewers.window import Window

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
pygame: Any = pytest.importorskip("pygame")


@pytest.fixture
def shown(world: pv.World) -> Iterator[Window]:
    """The nine circles in a window, 20 pixels a metre and a little; paused."""
    window = Window(world, size=(424, 424))
    window._pause()
    yield window
    pygame.display.quit()


def press(window: Window, key: int) -> None:
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0))
    window.run_once()


def mouse(window: Window, kind: int, pixel: Any, **values: Any) -> None:
    pos = tuple(round(float(value)) for value in pixel)
    pygame.event.post(pygame.event.Event(kind, pos=pos, **values))
    window.run_once()


@pytest.mark.parametrize("size", [(424, 424), (200, 100)])
def test_the_screen_shows_the_painters_pixels_whatever_its_size(shown: Window, world: pv.World, size: tuple[int, int]) -> None:
    if size != (424, 424):
        pygame.display.set_mode(size, pygame.RESIZABLE)
        pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, w=size[0], h=size[1], size=size))
    shown.run_once()
    screen = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    assert (screen == world.to_image(size=size)).all()


def test_it_runs_in_real_time_and_space_pauses_and_resumes(shown: Window, world: pv.World) -> None:
    shown.run_once()
    assert world.frames == 0
    press(shown, pygame.K_SPACE)
    assert not shown.paused
    for _ in range(5):
        shown.run_once()
    assert world.frames >= 4  # each turn waits for the next frame to be due
    press(shown, pygame.K_SPACE)
    frames = world.frames
    shown.run_once()
    assert world.frames == frames


def test_period_steps_once_and_r_resets(shown: Window, world: pv.World) -> None:
    before = world.state_hash()
    world.velocity[0] = (0, 5)
    press(shown, pygame.K_PERIOD)
    press(shown, pygame.K_PERIOD)
    assert world.frames == 2
    press(shown, pygame.K_r)
    assert world.state_hash() == before


@pytest.mark.parametrize("key", ["K_q", "K_ESCAPE"])
def test_quitting_by_key(shown: Window, key: str) -> None:
    press(shown, getattr(pygame, key))
    assert shown.ended


def test_closing_ends_run_and_lets_go(shown: Window, world: pv.World) -> None:
    mouse(shown, pygame.MOUSEBUTTONDOWN, shown._seen().to_screen(world.position[4]), button=1)
    assert len(world.forces) == 1
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    shown.run()
    assert not world.forces
    assert not pygame.display.get_init()


def test_a_drag_lifts_the_circle(shown: Window, world: pv.World) -> None:
    shown.run_once()
    start = shown._seen().to_screen(world.position[4])
    mouse(shown, pygame.MOUSEBUTTONDOWN, start, button=1)
    mouse(shown, pygame.MOUSEMOTION, start - (0, 100), rel=(0, -100), buttons=(1, 0, 0))
    shown._session.submit(Step(60))
    shown.run_once()
    assert world.position[4, 1] > 2.0
    assert np.delete(world.position[:, 1], 4).max() < 0.6
    mouse(shown, pygame.MOUSEBUTTONUP, start, button=1)
    assert not world.forces


def test_a_poke_pushes_away(shown: Window, world: pv.World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pygame.key, "get_mods", lambda: pygame.KMOD_LSHIFT)
    shown.run_once()
    mouse(shown, pygame.MOUSEBUTTONDOWN, shown._seen().to_screen((0.3, 0.5)), button=1)
    shown._session.submit(Step(3))
    shown.run_once()
    assert world.velocity[4, 0] < -0.1


def test_the_wheel_zooms_the_right_button_moves_and_f_fits(shown: Window) -> None:
    shown.run_once()
    whole = shown._seen()
    pygame.event.post(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=2, flipped=False))
    shown.run_once()
    assert shown._seen().scale == pytest.approx(1.15**2 * whole.scale)
    left = shown._seen().left
    mouse(shown, pygame.MOUSEMOTION, (9, 9), rel=(30, 0), buttons=(0, 0, 1))
    assert shown._seen().left == pytest.approx(left - 30 / shown._seen().scale)
    press(shown, pygame.K_f)
    assert shown._seen() == whole


def test_the_title_bar_tells_the_numbers(shown: Window) -> None:
    shown.run_once()
    assert pygame.display.get_caption()[0] == "pyverlet: paused, 9 circles, 0.00 s, physics 0.0 ms"


def test_an_error_stops_the_world_not_the_window(shown: Window, world: pv.World) -> None:
    world.velocity[2] = np.nan
    press(shown, pygame.K_PERIOD)
    assert "particle 2 turned non-finite" in str(shown.error)
    shown._caption_due = 0.0
    shown.run_once()
    assert "particle 2" in pygame.display.get_caption()[0]
    press(shown, pygame.K_r)
    assert str(shown.error) == "None"
    press(shown, pygame.K_PERIOD)
    assert world.frames == 1


def test_on_the_command_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    asked: list[Window] = []
    monkeypatch.setattr(Window, "run", lambda window: asked.append(window))
    assert main(["run", "box", "--window", "--particles", "20", "--dt", "1/100"]) == 0
    (window,) = asked
    assert (len(window._world), window._title, window._dt) == (20, "box", 0.01)
    assert "space pause" in capsys.readouterr().err
    assert main(["run", "image", "--window", "--particles", "30"]) == 0
    assert len(asked[1]._renderer._colour.colours(asked[1]._world, DARK)) == 30
    pygame.display.quit()
    assert [main(["run", "--window", *more]) for more in (["--json"], ["--port", "80"], ["--ledger"])] == [2, 2, 2]


def test_without_a_screen_there_is_one_sentence(world: pv.World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "nonesuch")
    with pytest.raises(pv.PyverletError, match="no window can be opened"):
        Window(world)
