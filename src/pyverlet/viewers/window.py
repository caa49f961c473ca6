"""A desktop window instead of the page, with pygame. Needs the extra `window`."""

import contextlib
import os
import time
from functools import partial
from typing import Any

from pyverlet.common.errors import InputError, PyverletError
from pyverlet.common.outside import require
from pyverlet.picture import View
from pyverlet.picture.raster import check_size
from pyverlet.viewers.commands import Drag, Pause, Poke, Release, Reset, Step
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.renderer import PictureStyle, Renderer
from pyverlet.viewers.session import Session
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

POINTER = 0  # there is one mouse
REACH_PX = 9.0  # tolerance of the mouse, as on the page
ZOOM = 1.15  # factor per notch of the wheel
CAPTION_S = 0.25  # interval of updates of the title bar

KEYS = "space pause, . step, r reset, f fit, q quit; drag a circle, shift-drag pokes, wheel zooms, right button moves"


class Window:
    """Steps a world in real time, in frames of dt seconds, and shows it, (width, height) pixels, in the calling thread.

    Reset returns to the initial state of the world.

    Raises:
        InputError: an argument is outside what is allowed, or the extra `window` is missing.
        PyverletError: there is no screen.
    """

    def __init__(
        self,
        world: World,
        *,
        title: str = "pyverlet",
        dt: float = 1 / 60,
        size: tuple[int, int] = (1280, 720),
        style: PictureStyle | None = None,
    ) -> None:
        check_extra()
        self._world, self._title, self._dt = world, title, dt
        self._session = Session(Presentation(title, Panels.of(world), part=style.part if style else None), dt=dt)
        self._new_renderer = partial(Renderer, world, style=style)
        self._renderer = self._new_renderer(check_size(size))
        self._caption_due = self._pictures_since = 0.0
        self._pictures = 0
        self.view: View | None = None  # zoomed by the user; None for the renderer's own
        self.paused = False
        self.ended = False
        self._poking = False
        self._open(size)

    @property
    def error(self) -> str | None:
        """Why the world has stopped, if it has; reset restarts it."""
        return self._session.latest.status.error

    def _open(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        import pygame

        self._pygame: Any = pygame
        try:
            pygame.display.init()
            pygame.display.set_mode(size, pygame.RESIZABLE)
        except pygame.error as error:
            pygame.display.quit()
            raise PyverletError(
                f"no window can be opened ({error}): the page needs no screen here, nor does `pyverlet record`"
            ) from None

    def run(self) -> None:
        """Run until the window is closed."""
        try:
            while not self.ended:
                self.run_once()
        finally:
            for command in (Pause(True), Release(POINTER)):
                self._session.submit(command)
            self._session.run_once()
            self._pygame.display.quit()

    def run_once(self) -> None:
        """Apply input, run the frames that are due, and show one picture."""
        for event in self._pygame.event.get():
            self._apply(event)
        rest = min(self._session.run_once(), self._dt)
        began = time.perf_counter()
        self._show()
        time.sleep(max(rest - (time.perf_counter() - began), 0.0))

    def _show(self) -> None:
        pygame, screen = self._pygame, self._pygame.display.get_surface()
        pixels = self._renderer.paint(self.view)
        # The surface uses the raster's pixels without copying.
        screen.blit(pygame.image.frombuffer(pixels, self._renderer.size, "RGBX"), (0, 0))
        pygame.display.flip()
        self._pictures += 1
        now = time.perf_counter()
        if now >= self._caption_due:
            rate = self._pictures / max(now - self._pictures_since, 1e-9)
            self._pictures, self._pictures_since, self._caption_due = 0, now, now + CAPTION_S
            state = self.error or ("paused" if self.paused else f"{rate:.0f} frames/s")
            physics = self._session.latest.status.physics_median_ms
            numbers = f"{len(self._world):,} circles, {self._world.time:.2f} s, physics {physics:.1f} ms"
            pygame.display.set_caption(f"{self._title}: {state}, {numbers}")

    def _apply(self, event: Any) -> None:
        pygame = self._pygame
        if event.type == pygame.QUIT:
            self.ended = True
        elif event.type == pygame.KEYDOWN:
            self._press(event.key)
        elif event.type == pygame.VIDEORESIZE:
            self._renderer, self.view = self._new_renderer((max(event.w, 1), max(event.h, 1))), None
        elif event.type == pygame.MOUSEWHEEL:
            self.view = self._seen().zoomed(ZOOM**event.y, pygame.mouse.get_pos())
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            self._session.submit(Release(POINTER))
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._poking = bool(pygame.key.get_mods() & pygame.KMOD_SHIFT)
            self._point_at(event.pos)
        elif event.type == pygame.MOUSEMOTION and event.buttons[0]:
            self._point_at(event.pos)
        elif event.type == pygame.MOUSEMOTION and event.buttons[2]:
            self.view = self._seen().moved(event.rel)

    def _point_at(self, pixel: tuple[int, int]) -> None:
        view = self._seen()
        x, y = (float(value) for value in view.to_world(pixel))
        with contextlib.suppress(InputError):  # beyond the range of pointers
            self._session.submit(Poke(POINTER, x, y) if self._poking else Drag(POINTER, x, y, REACH_PX / view.scale))

    def _pause(self) -> None:
        self.paused = not self.paused
        self._session.submit(Pause(self.paused))

    def _press(self, key: int) -> None:
        pygame = self._pygame
        if key == pygame.K_SPACE:
            self._pause()
        elif key == pygame.K_PERIOD:
            self.paused = True
            self._session.submit(Step())
        elif key == pygame.K_r:
            self._session.submit(Reset())
        elif key == pygame.K_f:
            self.view = None
        elif key in (pygame.K_q, pygame.K_ESCAPE):
            self.ended = True

    def _seen(self) -> View:
        return self._renderer.view if self.view is None else self.view


def check_extra() -> None:
    """Raise InputError with the install command if pygame is missing."""
    require("a window", "pygame", extra="window")
