"""Output formats of recordings, one class each, by suffix. PyAV contains the encoders, Pillow writes single pictures.

An HTML page draws by itself: it gets the numbers of the world instead of pixels.
"""

import os
import re
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError
from pyverlet.common.outside import file_errors, require
from pyverlet.picture import Colouring
from pyverlet.picture.raster import check_size
from pyverlet.record import _reel
from pyverlet.viewers import bundle
from pyverlet.viewers.frames import Frame
from pyverlet.viewers.renderer import PictureStyle, Renderer
from pyverlet.world.world import World


class Disk:
    """A binary file for an encoder that survives a full disk: `error` says why nothing is written any more.

    It never raises, so that the encoder can continue and be closed normally; at the end the file is cut to its size at the last
    call of `whole`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.error: OSError | None = None
        with file_errors("path", path, "written"):
            self._file = path.open("w+b", buffering=0)
        self._at = self.end = self._whole = 0

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.end}[whence]
        return self._at

    def write(self, data: bytes) -> int:
        """Write as much as fits, and report that all was written."""
        left = memoryview(data)
        while self.error is None and len(left):
            try:
                self._file.seek(self._at + len(data) - len(left))
                left = left[self._file.write(left) or 0 :]
            except OSError as error:
                self.error = error
        self._at += len(data)
        self.end = max(self.end, self._at)
        return len(data)

    def read(self, count: int = -1) -> bytes:
        """Read existing data, as encoders do when they finish."""
        self._file.seek(self._at)
        data = self._file.read(count)
        self._at += len(data)
        return data

    def whole(self) -> None:
        """Mark the file as complete so far."""
        if self.error is None:
            self._whole = self.end

    def close(self, *, mend: bytes = b"") -> None:
        """Close; a file that was cut ends with `mend`."""
        if self.error is not None:
            self._file.truncate(self._whole)
            self._file.seek(self._whole)
            self._file.write(mend)  # there is room for it after cutting
        self._file.close()


DEFAULT_SIZE = (1280, 720)  # pixels
Pixels = NDArray[np.uint8]  # (height, width, 4) bytes R, G, B and an unused one


class Film(ABC):
    """Base class of films, which take pictures in sequence. `error`: why no more are written, if so; `kept`: number written."""

    needs: ClassVar[tuple[str, ...]] = ("av",)
    default_fps: ClassVar[int] = 60
    error: OSError | None = None
    kept: int = 0

    @classmethod
    def sized(cls, size: tuple[int, int] | None, fps: int) -> tuple[int, int]:
        """The requested size, or the default. Raise InputError if this kind of file cannot hold such pictures."""
        return check_size(DEFAULT_SIZE if size is None else size)

    @classmethod
    def check_colour(cls, colour: Colouring | None) -> None:
        """Raise InputError if this kind of file cannot show such colours."""

    def watch(self, world: World, style: PictureStyle) -> Callable[[], Any]:
        """A function that returns a picture of the world's current state, in the form that `add` takes."""
        return Renderer(world, self.size, style).paint

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        self.path, self.size, self.fps = path, size, fps

    @abstractmethod
    def add(self, picture: Any) -> None:
        """Add the next picture: pixels, unless `watch` says otherwise."""

    def close(self) -> None:
        """Finish the file."""


class _Stream(Film):
    """A file that PyAV writes. `movie` names its container, `codec` the encoder with its options."""

    movie: ClassVar[str]
    codec: ClassVar[str]
    pixel_format: ClassVar[str]
    options: ClassVar[dict[str, str]] = {}
    muxing: ClassVar[dict[str, str]] = {}
    mend: ClassVar[bytes] = b""

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        super().__init__(path, size, fps)
        import av

        self._av: Any = av
        self._disk = Disk(path)
        muxing = {"flush_packets": "1", "fflags": "+bitexact", **self.muxing}
        self._container: Any = av.open(self._disk, "w", format=self.movie, options=muxing)
        self._stream = self._container.add_stream(self.codec, rate=fps, options=self.options)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = self.pixel_format
        self._stream.codec_context.time_base = Fraction(1, fps)
        self._pictures = self._muxed = self._end = 0

    @abstractmethod
    def _frame(self, pixels: Pixels) -> Any:
        """Convert a picture to PyAV's form."""

    def add(self, picture: Pixels) -> None:
        frame = self._frame(picture)
        frame.pts, frame.time_base = self._pictures, self._stream.codec_context.time_base
        self._pictures += 1
        self._write(self._stream.encode(frame))

    def _write(self, packets: list[Any]) -> None:
        for packet in packets:
            self._container.mux(packet)
            self._note(self._muxed)
            self._muxed += 1

    def _note(self, pictures: int) -> None:
        """If the file has grown, it contains `pictures` now: containers hold back the last one, MP4 its current fragment."""
        self.error = self._disk.error
        if self.error is None and self._disk.end > self._end:
            self._end = self._disk.end
            self._disk.whole()
            self.kept = pictures

    def close(self) -> None:
        self._write(self._stream.encode())
        self._container.close()
        self._note(self._muxed)
        self._disk.close(mend=self.mend)


class Mp4(_Stream):
    """H.264. Written in fragments of a second, so that an incomplete file is playable; at the end an ordinary file."""

    movie, codec, pixel_format = "mp4", "libx264", "yuv420p"
    # No B-frames: pictures are then stored in order, and the first is at time 0 in every player.
    options: ClassVar[dict[str, str]] = {"crf": "20", "preset": "veryfast", "bf": "0", "threads": "2"}
    muxing: ClassVar[dict[str, str]] = {"movflags": "hybrid_fragmented+frag_keyframe"}

    @classmethod
    def sized(cls, size: tuple[int, int] | None, fps: int) -> tuple[int, int]:
        width, height = size = super().sized(size, fps)
        if width % 2 or height % 2 or min(size) < 16:
            even = f"{max(16, width + width % 2)}x{max(16, height + height % 2)}"
            raise InputError(f"size is {width}x{height}; allowed for .mp4 are even numbers of at least 16, such as {even}")
        return size

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        super().__init__(path, size, fps)
        context = self._stream.codec_context
        context.gop_size = fps
        # ITU-R BT.709, also declared in the file: otherwise players guess by the size of the picture, and colours shift.
        context.color_primaries = context.color_trc = context.colorspace = 1
        context.color_range = 1

    def _frame(self, pixels: Pixels) -> Any:
        frame = self._av.VideoFrame.from_ndarray(pixels, format="rgba")
        return frame.reformat(format=self.pixel_format, dst_colorspace="ITU709", dst_color_range="MPEG")


class Gif(_Stream):
    """GIF: at most 256 colours per picture, times in hundredths of a second; loops."""

    needs = ("av", "PIL")
    default_fps = 25
    movie, codec, pixel_format = "gif", "gif", "pal8"
    mend = b";"

    @classmethod
    def sized(cls, size: tuple[int, int] | None, fps: int) -> tuple[int, int]:
        size = super().sized(size, fps)
        if fps > 50:
            raise InputError(f"fps is {fps}; allowed for .gif is at most 50, since browsers slow down what is faster")
        return size

    def _frame(self, pixels: Pixels) -> Any:
        from PIL import Image

        picture = Image.fromarray(np.ascontiguousarray(pixels[..., :3])).quantize(256, dither=Image.Dither.NONE)
        palette = np.zeros((256, 4), dtype=np.uint8)
        rgb = np.array(picture.getpalette(), dtype=np.uint8).reshape(-1, 3)
        palette[:, 0], palette[: len(rgb), 1:] = 255, rgb
        return self._av.VideoFrame.from_ndarray((np.asarray(picture), palette), format="pal8")


class WebP(_Stream):
    """WebP: times in milliseconds; loops."""

    movie, codec, pixel_format = "webp", "libwebp", "bgra"
    options: ClassVar[dict[str, str]] = {"quality": "80", "compression_level": "2"}
    muxing: ClassVar[dict[str, str]] = {"loop": "0"}

    def _frame(self, pixels: Pixels) -> Any:
        opaque = pixels.copy()
        opaque[..., 3] = 255
        return self._av.VideoFrame.from_ndarray(opaque, format="rgba").reformat(format=self.pixel_format)

    def close(self) -> None:
        super().close()
        if self.error is not None:  # the length of the file is in its header
            with self._disk.path.open("r+b") as file:
                length = file.seek(0, 2)
                file.seek(4)
                file.write(struct.pack("<I", max(length - 8, 0)))


class Page(Film):
    """An HTML page that plays the world: one file for any browser, drawn as on the live page."""

    needs = ()

    @classmethod
    def sized(cls, size: tuple[int, int] | None, fps: int) -> tuple[int, int]:
        if size is not None:
            raise InputError(
                f"size is {size[0]}x{size[1]}; allowed for .html is none: it is as large as the window it is seen in"
            )
        return DEFAULT_SIZE

    @classmethod
    def check_colour(cls, colour: Colouring | None) -> None:
        _reel.page_colour(colour)

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        super().__init__(path, size, fps)
        self._disk = Disk(path)
        self._reel = _reel.Reel(fps)

    def watch(self, world: World, style: PictureStyle) -> Callable[[], Any]:
        picture = _reel.watch(world, style, title=self.path.stem)
        colour, theme = _reel.page_colour(style.colour), "dark" if style.theme.dark else "light"
        self._write([bundle.film(self.path.stem, fps=self.fps, colour=colour, theme=theme)])
        return picture

    def add(self, picture: Frame) -> None:
        self._write(self._reel.add(picture))

    def _write(self, parts: list[str]) -> None:
        for part in parts:
            self._disk.write(part.encode())
            self._disk.whole()
        self.error = self._disk.error
        if self.error is None:
            self.kept = self._reel.finished

    def close(self) -> None:
        if self.error is None:
            self._write(self._reel.rest())
        self._disk.close()


class Frames(Film):
    """Single pictures. The path may be a template such as frame-{:04d}.png, for a file per picture."""

    needs = ("PIL",)

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        super().__init__(path, size, fps)
        self._template = str(path)
        first = self._named(0)
        with file_errors("path", first, "written"):
            first.open("ab").close()  # check now, not after a long run, that it can be written

    def add(self, picture: Pixels) -> None:
        try:
            write_picture(self._named(self.kept), picture)
        except OSError as error:
            self.error = error
        else:
            self.kept += 1

    def _named(self, number: int) -> Path:
        return Path(self._template.format(number) if "{" in self._template else self._template)


PICTURE = ".png"  # suffix of single pictures

FILMS: dict[str, type[Film]] = {".mp4": Mp4, ".gif": Gif, ".webp": WebP, ".html": Page, PICTURE: Frames}
"""Films by suffix. A new kind of file is a class and an entry here."""


def film_for(path: Path) -> type[Film]:
    """The kind of film for a path.

    Raises:
        InputError: the suffix is unknown, a template has no number in it, or a library is missing.
    """
    kind = FILMS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"path is '{path}'; allowed is a name that ends in {', '.join(FILMS)}")
    if kind is Frames and ("{" in str(path) or re.search(r"%\d*d", path.name)):  # the latter is another common form
        try:
            numbered = str(path).format(0) != str(path).format(1)
        except (IndexError, KeyError, ValueError):
            numbered = False
        if not numbered:
            raise InputError(f"path is '{path}'; allowed for numbered pictures is one number, such as frame-{{:04d}}.png")
    require("recording", *kind.needs, extra="record")
    return kind


def write_picture(path: Path, pixels: Pixels) -> None:
    """Write a PNG; an incomplete one is removed if the disk is full."""
    from PIL import Image

    try:
        Image.fromarray(np.ascontiguousarray(pixels[..., :3])).save(path, format="PNG")
    except OSError:
        path.unlink(missing_ok=True)
        raise
