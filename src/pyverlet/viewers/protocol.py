"""The messages between page and server. Page to server: small JSON texts. Server to page: a JSON head, then an array of numbers.

- 4 bytes: length of the head, little-endian, a multiple of 4.
- head: JSON padded with spaces, {"kind": "shape" | "frame" | "picture" | "refused", ...}.
- body, little-endian: of a shape n float32 radii, n float32 masses, n uint32 numbers, "apart" pairs of uint32, circles that do
  not collide, if "kinds" n pairs of uint32, category and mask, and if "coloured" n times three bytes R, G, B; of a frame n pairs
  of uint16 on the grid over "view", if the tab needs velocities n pairs of int16 in units of "unit" m/s, for "copies" of circles
  across a periodic boundary a uint32 each, the circle, and then a pair of uint16, for "links" two uint32 each, the circles they
  join, and then a byte each, their tension, if "turned" n bytes, in 1/256 of a turn, and for "contacts" two uint32 each, then a
  byte each, their force in units of "push" N, and a byte each, the direction of the normal; of a picture a JPEG.
"""

import dataclasses
import json
import math
import re
import struct
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from pyverlet.common.errors import InputError
from pyverlet.common.shown import brief
from pyverlet.laws import integrators
from pyverlet.laws.obstacles import Outline
from pyverlet.picture.pen import Drawing, Stroke
from pyverlet.picture.view import Rect
from pyverlet.viewers.commands import COMMANDS, MAX_PARTICLES, MAX_SUBSTEPS, Ack, Command, SetIntegrator, Step, ViewOptions, typed
from pyverlet.viewers.frames import Frame, Shape, quantise
from pyverlet.viewers.pointers import POKE_RADIUS
from pyverlet.viewers.renderer import JpegRenderer, advice, draws_here
from pyverlet.viewers.session import Session

MAX_MESSAGE = 4096  # bytes; normal messages have about a hundred

Request = Command | Ack | ViewOptions

REQUESTS: dict[str, type[Request]] = {"ack": Ack, "look": ViewOptions, **COMMANDS}


def decode(text: str, pointer: int) -> Request:
    """Read one message of a page. `pointer` is the tab's own number: tabs move only their own pointers.

    Raises:
        InputError: the message is too long, not a JSON object, of an unknown type, or a field is missing or wrong.
    """
    if len(text) > MAX_MESSAGE:
        raise InputError(f"message has {len(text)} characters; allowed are {MAX_MESSAGE}")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError(f"message {brief(text)} is not JSON; allowed is one JSON object") from None
    if not isinstance(message, dict):
        raise InputError(f"message {brief(text)} is not an object; allowed is one JSON object")
    kind = message.get("type")
    request = REQUESTS.get(kind) if isinstance(kind, str) else None
    if request is None:
        raise InputError(f"message type is {brief(kind)}; allowed are {', '.join(REQUESTS)}")
    if request is Step:  # always one frame
        return Step()
    if request is SetIntegrator:
        return SetIntegrator(typed("value", message.get("value"), str))
    return request.read({"force": False} | message | {"pointer": pointer})


def encode_frame(frame: Frame, part: Rect | None = None, *, velocity: bool = False, force: bool = False) -> bytes:
    """Encode a frame as a binary message, for a part of the plane or the camera's; with velocities and forces on request."""
    grid = frame.grid if part is None else quantise(frame.position, part)
    head = _head("frame", frame, part)
    body = grid.tobytes()
    if velocity:
        head["unit"] = frame.velocity_unit
        body += frame.velocity_grid.tobytes()
    owner, place = frame.copies
    if len(owner):
        head["copies"] = len(owner)
        body += owner.tobytes() + quantise(place, frame.view if part is None else part).tobytes()
    if len(frame.joined):
        head["links"] = len(frame.joined)
        body += frame.joined.tobytes() + frame.strain.tobytes()
    if len(frame.turned):
        head["turned"] = True
        body += frame.turned.tobytes()
    if force and len(frame.contacts.pairs):
        push, head["push"] = frame.push
        head["contacts"] = len(push)
        body += frame.contacts.pairs.tobytes() + push.tobytes() + frame.normals.tobytes()
    return joined(head, body)


def encode_picture(frame: Frame, part: Rect | None, jpeg: bytes) -> bytes:
    """Encode a frame drawn by the server."""
    return joined(_head("picture", frame, part), jpeg)


def _head(kind: str, frame: Frame, part: Rect | None) -> dict[str, Any]:
    return {
        "kind": kind,
        "seq": frame.seq,
        "view": frame.view if part is None else part,
        "room": frame.view,
        "obstacles": lines(frame.obstacles),
        "drawing": written(frame.drawing),
        "status": dataclasses.asdict(frame.status),
    }


def lines(outlines: Iterable[Outline]) -> list[Any]:
    """Points of each outline in metres, and whether it is filled; for JSON."""
    return [(np.round(points, 6).tolist(), filled) for points, filled in outlines]


def written(drawing: Drawing) -> list[Any]:
    """A `Pen`'s drawing for JSON: lines and areas [points, closed, filled, colour, px], texts [x, y, text, colour, px]."""
    marks: list[Any] = []
    for mark in drawing:
        colour = None if mark.colour is None else f"#{mark.colour:06x}"
        if isinstance(mark, Stroke):
            marks.append([mark.points, mark.closed, mark.filled, colour, mark.width])
        else:
            marks.append([mark.x, mark.y, mark.text, colour, mark.size])
    return marks


def encode_shape(shape: Shape, *, drawn_here: bool = False, note: str | None = None) -> bytes:
    """Encode a shape as a binary message; without circles if the server draws them, and with a note for the page, if any."""
    arrays = {"radius", "mass", "number", "group", "kinds", "apart", "colours"}
    head = {re.sub("_(.)", lambda at: at[1].upper(), name): each for name, each in vars(shape).items() if name not in arrays}
    starts = np.flatnonzero(np.diff(shape.group, prepend=-1))  # of runs of circles of one group
    runs = np.column_stack((shape.group[starts], np.diff(starts, append=len(shape.group))))
    head |= {
        "kind": "shape",
        "panels": [dataclasses.asdict(panel) for panel in shape.panels],
        "obstacles": lines(shape.obstacles),
        "integrators": list(integrators.BY_NAME),
        "count": len(shape.radius),
        "groups": [] if drawn_here else runs.tolist(),  # [number, count]
        "apart": 0 if drawn_here else len(shape.apart),
        "kinds": shape.kinds is not None,
        "coloured": shape.colours is not None,
        "drawnHere": drawn_here,
        "note": note,
        "maxSubsteps": MAX_SUBSTEPS,
        "maxParticles": MAX_PARTICLES,
        "pokeRadius": POKE_RADIUS,
    }
    sent = () if drawn_here else (shape.radius, shape.mass, shape.number, shape.apart, shape.kinds, shape.colours)
    return joined(head, *(array.tobytes() for array in sent if array is not None))


def encode_refusal(reason: str) -> bytes:
    """Encode the reason why a page's message was refused."""
    return joined({"kind": "refused", "reason": reason})


class Encoder:
    """Encodes messages, each once for any number of pages with the same options."""

    def __init__(self) -> None:
        self.renderer = JpegRenderer()
        self._frame: Frame | None = None
        self._frames: dict[Any, bytes] = {}
        self._shape: Shape | None = None
        self._shape_bytes = b""

    def frame(self, frame: Frame, options: ViewOptions) -> bytes:
        """A frame for these options; if pages are sent pictures, in the renderer's thread."""
        if frame is not self._frame:
            self._frame, self._frames = frame, {}
        frames, drawn = self._frames, draws_here(frame.shape)
        key = options if drawn else (options.part, options.velocity, options.pushes)
        if key not in frames and drawn:
            frames[key] = encode_picture(frame, options.part, self.renderer.jpeg(frame, options))
        elif key not in frames:
            frames[key] = encode_frame(frame, options.part, velocity=options.velocity, force=options.pushes)
        return frames[key]

    def shape(self, shape: Shape) -> bytes:
        """A shape, and for pages that could be sent pictures the information for that."""
        if shape is not self._shape:
            self._shape = shape
            self._shape_bytes = encode_shape(shape, drawn_here=draws_here(shape), note=advice(shape))
        return self._shape_bytes


class Display:
    """One display of a session: its view options, and what it was sent. Its `pointer` belongs to it alone."""

    def __init__(self, session: Session, encoder: Encoder, pointer: int) -> None:
        self._session, self._encoder, self.pointer = session, encoder, pointer
        self._options = ViewOptions()
        self._shape: Shape | None = None
        self._sent: tuple[int, ViewOptions] | None = None

    def obey(self, said: object, acknowledge: Callable[[int], None] = lambda seq: None) -> list[bytes]:
        """Apply a message of the page; returns refusals."""
        try:
            if not isinstance(said, str):
                raise InputError("message is no text; allowed is a JSON text")
            request = decode(said, self.pointer)
            if isinstance(request, Ack):
                acknowledge(request.seq)
            elif isinstance(request, ViewOptions):
                self._options = request
            else:
                self._session.submit(request)
        except InputError as error:
            return [encode_refusal(str(error))]
        return []

    def news(self) -> tuple[Frame, ViewOptions, list[bytes]] | None:
        """The newest frame, its view options, and its shape if that has changed; None if it was sent already."""
        frame, options = self._session.latest, self._options
        if (frame.seq, options) == self._sent:
            return None
        shape = [] if frame.shape is self._shape else [self._encoder.shape(frame.shape)]
        self._sent, self._shape = (frame.seq, options), frame.shape
        if options.pushes:
            self._session.want_forces(frame)
        return frame, options, shape


def joined(head: dict[str, Any], *body: bytes) -> bytes:
    """A message: the length of the head, the head, and the body."""
    text = json.dumps(finite(head), allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)  # arrays on the page must be aligned to their element size
    return b"".join((struct.pack("<I", len(text)), text, *body))


def finite(value: Any) -> Any:
    """Convert non-finite numbers to null, as JSON has none."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [finite(entry) for entry in value]
    return value
