"""Compresses a world's frames as numbers, for a page that draws them itself.

A film consists of blocks: shapes, as for the live page, and chunks of up to a second. Positions are integer steps of a grid, and
a frame of a chunk is stored as the difference from a linear extrapolation of the two frames before; velocities as the difference
from what the positions imply. Almost all of these are small numbers: their bytes are sorted by significance and compressed by
zlib, which browsers decompress natively. The page's part is `viewers/page/reel.js`.
"""

import base64
import itertools
import zlib
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError
from pyverlet.picture import Colouring, Groups
from pyverlet.picture.colour import COLOURINGS
from pyverlet.viewers import protocol
from pyverlet.viewers.frames import Frame, Shape
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.readouts import Readouts
from pyverlet.viewers.renderer import PictureStyle
from pyverlet.viewers.view_state import ViewState
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

FINENESS = 256  # grid steps in the median radius: visible only if a circle fills a tenth of the screen
RATIO = 2  # velocity steps per grid step per frame
MOST_NUMBERS = 2_000_000  # most circles times frames in a chunk: a page unpacks that quickly, and holds a few
LEVEL = 6  # of zlib: more takes twice as long for one per cent


def page_colour(colour: Colouring | None) -> str:
    """The page's name of this colouring, `picture` for the user's colours; InputError if it has no such colouring."""
    if colour is None:
        return "order"
    if getattr(colour, "_full", None) is not None:
        raise InputError(f"colour is {type(colour).__name__}(full=...); allowed for .html is one that finds its scale itself")
    if isinstance(colour, Groups) and colour._groups:
        return "picture"
    return next((name for name, kind in COLOURINGS.items() if type(colour) is kind), "picture")


def watch(world: World, style: PictureStyle, *, title: str) -> Callable[[], Frame]:
    """A function that returns the world's current frame, as on the live page."""
    rgb = None
    if style.colour is not None and page_colour(style.colour) == "picture":
        packed = style.colour.colours(world, style.theme)
        rgb = np.stack([(packed >> shift) & 255 for shift in (0, 8, 16)], axis=1).astype(np.uint8)
    view_state = ViewState(Presentation(title, Panels.of(world), colours=rgb, part=style.part))
    readouts, number = Readouts(), itertools.count(1)

    def picture() -> Frame:
        status = readouts.read(view_state, dropped=0, speed=1.0, paused=False, busy=None, error=None, at_once=True)
        return replace(view_state.picture(next(number), status), drawing=style.drawing(world))

    return picture


class Reel:
    """Converts frames to the blocks of a film."""

    def __init__(self, fps: int) -> None:
        self._fps = fps
        self._frames: list[Frame] = []
        self._first = 0
        self._shape: Shape | None = None
        self._shapes = 0
        self._step = 0.0

    @property
    def finished(self) -> int:
        """Number of frames in blocks."""
        return self._first

    def add(self, frame: Frame) -> list[str]:
        """Add a frame; returns the blocks completed by it."""
        blocks = []
        if frame.shape is not self._shape:
            blocks += self.rest()
            self._shape = frame.shape
            self._shapes += 1
            if self._step == 0.0:
                self._step = float(np.median(frame.shape.radius)) / FINENESS if len(frame.shape.radius) else 0.0
            blocks.append(_block("shape", {"id": self._shapes}, protocol.encode_shape(frame.shape)))
        self._frames.append(frame)
        if len(self._frames) >= max(1, min(self._fps, MOST_NUMBERS // max(len(frame.position), 1))):
            blocks += self.rest()
        return blocks

    def rest(self) -> list[str]:
        """A block of the remaining frames."""
        frames, self._frames = self._frames, []
        if not frames:
            return []
        first, self._first = self._first, self._first + len(frames)
        return [_block("chunk", {"first": first, "count": len(frames), "shape": self._shapes}, self._chunk(frames))]

    def _chunk(self, frames: list[Frame]) -> bytes:
        step = self._step or 1e-3
        rate = self._fps * step  # m/s per step per frame
        joined, strain, heads = [], [], []
        before: NDArray[np.uint32] | None = None
        for frame in frames:
            # Without timings of this machine, so that the same world gives the same film.
            timeless = {"physics_ms": 0.0, "physics_median_ms": 0.0, "physics_p95_ms": 0.0, "stages": {}}
            head = {
                "status": asdict(frame.status) | timeless,
                "room": frame.view,
                "obstacles": protocol.lines(frame.obstacles),
                "drawing": protocol.written(frame.drawing),
                "links": len(frame.joined),
            }
            if before is None or not np.array_equal(before, frame.joined):
                before = frame.joined
                joined.append(frame.joined.astype("<u4").tobytes())
                head["joined"] = True
            strain.append(frame.strain.tobytes())
            heads.append(head)
        place = _whole(np.array([frame.position for frame in frames], np.float64) / step)
        way = np.diff(place, axis=0, prepend=0)
        bend = way.copy()
        bend[2:] -= way[1:-1]
        way[0] = 0
        velocity = _whole(np.array([frame.velocity for frame in frames], np.float64) * (RATIO / rate))
        position_bytes, planes = _packed(bend)
        velocity_bytes, velocity_planes = _packed(velocity - RATIO * way)
        about = {"step": step, "unit": rate / RATIO, "ratio": RATIO, "planes": [planes, velocity_planes], "frames": heads}
        return protocol.joined(about, *joined, *strain, position_bytes, velocity_bytes)


def _whole(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Round to integers; NaN and values too large to draw are placed outside."""
    return np.rint(np.clip(np.nan_to_num(values, nan=-(2.0**28)), -(2.0**28), 2.0**28)).astype(np.int64)


def _packed(values: NDArray[np.int64]) -> tuple[bytes, int]:
    """(f, n, 2) small numbers as bytes: all x, then all y; each with the lowest bytes first, then the next. And the bytes per
    number.

    Signed numbers 0, -1, 1, -2, 2, ... become 0, 1, 2, 3, 4, ..., so that near 0 only the lowest byte is not zero.
    """
    folded = ((values << 1) ^ (values >> 63)).astype("<u4")
    planes = max(1, (int(folded.max(initial=0)).bit_length() + 7) // 8)
    parts = np.ascontiguousarray(folded.transpose(2, 0, 1)).view(np.uint8).reshape(2, -1, 4)
    return np.ascontiguousarray(parts.transpose(0, 2, 1)[:, :planes]).tobytes(), planes


def _block(kind: str, about: dict[str, int], content: bytes) -> str:
    """A block as an element of a page, which checks by `size` whether it is complete."""
    text = base64.b64encode(zlib.compress(content, LEVEL)).decode()
    attributes = "".join(f' data-{name}="{value}"' for name, value in about.items())
    return f'<script type="application/x-pyverlet-{kind}"{attributes} data-size="{len(text)}">{text}</script>\n'
