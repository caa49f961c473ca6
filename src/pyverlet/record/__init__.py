"""Records worlds: films and pictures without a screen, with exact frame times, byte for byte reproducible.

Importing this loads only the engine; films need the extra `record`.
"""

import math
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError, Interrupted, PyverletError
from pyverlet.common.interrupts import first_signal
from pyverlet.common.outside import file_errors
from pyverlet.common.progress import OnProgress
from pyverlet.common.submodules import lazily
from pyverlet.picture import DARK, Colouring, Theme
from pyverlet.picture.pen import Draw
from pyverlet.picture.view import Rect
from pyverlet.record import _films
from pyverlet.scenes.report import frame_count
from pyverlet.viewers.renderer import PictureStyle, Renderer
from pyverlet.world.world import World

__all__ = ["FilmPlan", "Recorded", "plan", "to_image", "to_video"]

__getattr__, __dir__ = lazily(__name__)

LONGEST_DT = 1 / 60  # s: longest frame of physics; longer intervals between pictures are divided
MOST_FPS = 1000  # pictures per second: WebP has a resolution of a millisecond


@dataclass(frozen=True)
class Recorded:
    """Result of a recording: the file, its number of pictures, and the seconds that they span (0 for a single one)."""

    path: Path
    pictures: int
    seconds: float


@dataclass(frozen=True)
class FilmPlan:
    """A recording, checked before anything long begins."""

    film: type[_films.Film]  # the kind of file
    path: Path  # where it goes
    size: tuple[int, int]  # (width, height), pixels
    fps: int  # pictures per second
    frames_before: int  # frames of physics before the first picture
    pictures: int  # number of pictures
    frames_between: int  # frames of physics between pictures

    @property
    def dt(self) -> float:
        """Length of a frame of physics, s."""
        return 1.0 / (self.fps * self.frames_between)


def plan(path: str | Path, *, seconds: float = 10.0, fps: int | None = None, size: tuple[int, int] | None = None) -> FilmPlan:
    """Check everything about a recording. Parameters as for `to_video`; a plain .png shows the end."""
    path = checks.path("path", path)
    film = _films.film_for(path)
    fps = checks.integer("fps", film.default_fps if fps is None else fps, most=MOST_FPS)
    size = film.sized(size, fps)
    pictures = frame_count(seconds=seconds, dt=1.0 / fps)
    # The least number of frames of physics between pictures so that none is longer than a sixtieth of a second.
    between = max(1, math.ceil(1.0 / (fps * LONGEST_DT) - 1e-9))
    if _is_still(path):
        return FilmPlan(film, path, size, fps, pictures * between, 1, between)
    return FilmPlan(film, path, size, fps, 0, pictures, between)


def to_video(
    world: World,
    path: str | Path,
    *,
    seconds: float = 10.0,
    fps: int | None = None,
    size: tuple[int, int] | None = None,
    colour: Colouring | None = None,
    theme: Theme = DARK,
    part: Rect | None = None,
    draw: Draw | None = None,
    progress: OnProgress | None = None,
) -> Recorded:
    """Step `world` and record it.

    Picture k shows the world k / fps seconds from now; in between it is stepped by 1 / fps, or by equal parts of at most a
    sixtieth of a second. The same world gives the same file, byte for byte.

    Args:
        world: stepped in place, to the time of the last picture.
        path: .mp4, .gif or .webp; .html for a page that plays the world, in one file; or .png with a number in it, such as
            frame-{:04d}.png, for a file per picture.
        seconds: simulated seconds.
        fps: pictures per second; by default 60, and 25 for .gif.
        size: (width, height) in pixels, 1280 x 720 by default; even numbers for .mp4, none for .html.
        colour: the colouring, such as `pyverlet.picture.BySpeed()`; by default the initial position of each circle. A page shows
            your own colourings as they are at the start.
        theme: `pyverlet.picture.DARK` or `LIGHT`.
        part: the visible part of the plane, (x0, y0, x1, y1) in metres; by default the bounds, or where the particles are.
        draw: a function of (world, pen), a `pyverlet.picture.Pen`, that draws over each picture.
        progress: called as progress(done, total) after every picture.

    Raises:
        InputError: an argument is outside what is allowed, the file cannot be written, or the extra `record` is missing.
        Interrupted: Ctrl-C; the file has what was recorded until then, and is playable.
        PyverletError: the disk is full; as for Ctrl-C.
    """
    film_plan = plan(path, seconds=seconds, fps=fps, size=size)
    return shoot(world, film_plan, PictureStyle(colour, theme, part, draw), progress=progress)


def shoot(world: World, film_plan: FilmPlan, style: PictureStyle, *, progress: OnProgress | None = None) -> Recorded:
    """Make the recording of a plan; see `to_video`."""
    film_plan.film.check_colour(style.colour)
    film = film_plan.film(film_plan.path, film_plan.size, film_plan.fps)
    picture = film.watch(world, style)
    before, total = film_plan.frames_before, film_plan.frames_before + film_plan.pictures
    pressed: list[int] = []  # Ctrl-C: the current picture is finished first
    ignored = signal.getsignal(signal.SIGINT) in (signal.SIG_IGN, None)
    with first_signal(pressed.append, *(() if ignored else (signal.SIGINT,))):
        try:
            for frame in range(before):
                if pressed:
                    break
                world.step(film_plan.dt)
                if progress:
                    progress(frame + 1, total)
            for number in range(film_plan.pictures):
                for _ in range(film_plan.frames_between if number else 0):
                    world.step(film_plan.dt)
                film.add(picture())
                if progress:
                    progress(before + number + 1, total)
                if film.error or pressed:
                    break
        finally:
            film.close()
    done = Recorded(film_plan.path, film.kept, film.kept / film_plan.fps if film_plan.pictures > 1 else 0.0)
    if film.error:
        raise PyverletError(f"{film.error.strerror or film.error}; {_holds(done, world)}")
    if pressed:
        raise Interrupted(f"interrupted; {_holds(done, world)}")
    return done


def to_image(
    world: World,
    path: str | Path | None = None,
    *,
    size: tuple[int, int] = (1280, 720),
    colour: Colouring | None = None,
    theme: Theme = DARK,
    part: Rect | None = None,
    draw: Draw | None = None,
) -> NDArray[np.uint8]:
    """A picture of the current `world`: (height, width, 3) bytes R, G, B, also written to `path` if given.

    Args:
        world: only read.
        path: a name that ends in .png, which needs the extra `record`; None writes nothing.
        size: (width, height) in pixels.
        colour: the colouring; by default the initial position of each circle.
        theme: `pyverlet.picture.DARK` or `LIGHT`.
        part: the visible part of the plane, (x0, y0, x1, y1) in metres; by default the bounds, or where the particles are.
        draw: a function of (world, pen), a `pyverlet.picture.Pen`, that draws over each picture.

    Raises:
        InputError: an argument is outside what is allowed, or the file cannot be written.
    """
    if path is not None:
        path = checks.path("path", path)
        if not _is_still(path):
            raise InputError(f"path is '{path}'; allowed is a name that ends in {_films.PICTURE}")
        _films.film_for(path)
    pixels = np.ascontiguousarray(Renderer(world, size, PictureStyle(colour, theme, part, draw)).paint()[..., :3])
    if path is not None:
        with file_errors("path", path, "written"):
            _films.write_picture(path, pixels)
    return pixels


def _is_still(path: Path) -> bool:
    return path.suffix.lower() == _films.PICTURE and "{" not in str(path)


def _holds(done: Recorded, world: World) -> str:
    if _is_still(done.path):
        return f"'{done.path}' shows the world at {world.time:.4g} s" if done.pictures else f"'{done.path}' is not written"
    if "{" in str(done.path):
        return f"the first {done.pictures} pictures are written"
    return f"'{done.path}' holds the first {done.pictures} pictures, {done.seconds:.4g} s, and plays"
