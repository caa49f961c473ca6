"""The words on the wire. Page to server: small JSON texts. Server to page: a JSON head, then an array of numbers.

- 4 bytes: length of the head, little-endian, a multiple of 4.
- head: JSON padded with spaces, {"kind": "shape" | "frame" | "refused", ...}.
- body, little-endian: of a shape n float32 radii, of a frame n pairs of uint16 on the grid over "view".
"""

from __future__ import annotations

import dataclasses
import json
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pyverlet.errors import InputError
from pyverlet.viewers.commands import (
    MAX_SUBSTEPS,
    Command,
    Drag,
    Pause,
    Poke,
    Release,
    Reset,
    SetGravity,
    SetSubsteps,
    Step,
)
from pyverlet.viewers.frames import Frame, Shape
from pyverlet.viewers.hands import POKE_RADIUS

MAX_MESSAGE = 4096
"""Bytes. The longest honest message is about a hundred."""


@dataclass(frozen=True, slots=True)
class Ack:
    """The page has drawn frame `seq`, and with it all before."""

    seq: int


def decode(text: str, hand: int) -> Command | Ack:
    """Read one message of a page. `hand` is the tab's own number: no tab moves another's hand.

    Raises:
        InputError: the message is too long, no JSON object, of no known type, or a field is missing or wrong.
    """
    if len(text) > MAX_MESSAGE:
        raise InputError(f"message has {len(text)} characters; allowed are {MAX_MESSAGE}")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError(f"message {_short(text)} is not JSON; allowed is one JSON object") from None
    if not isinstance(message, dict):
        raise InputError(f"message {_short(text)} is not an object; allowed is one JSON object")
    kind = message.get("type")
    maker = _MAKERS.get(kind) if isinstance(kind, str) else None
    if maker is None:
        raise InputError(f"message type is {_short(kind)}; allowed are {', '.join(_MAKERS)}")
    return maker(message, hand)


def encode_frame(frame: Frame) -> bytes:
    """A frame as one binary message."""
    head = {"kind": "frame", "seq": frame.seq, "view": frame.view, "status": dataclasses.asdict(frame.status)}
    return _join(head, frame.grid.tobytes())


def encode_shape(shape: Shape) -> bytes:
    """A shape as one binary message."""
    head = {
        "kind": "shape",
        "title": shape.title,
        "dt": shape.dt,
        "budgetMs": shape.budget_ms,
        "bounded": shape.bounded,
        "outlines": shape.outlines,
        "lines": shape.lines,
        "panels": [dataclasses.asdict(panel) for panel in shape.panels],
        "substepsDiffer": shape.substeps_differ,
        "maxSubsteps": MAX_SUBSTEPS,
        "pokeRadius": POKE_RADIUS,
    }
    return _join(head, shape.radius.tobytes())


def encode_refusal(reason: str) -> bytes:
    """Tells a page why its message was not obeyed."""
    return _join({"kind": "refused", "reason": reason}, b"")


def _join(head: dict[str, Any], body: bytes) -> bytes:
    text = json.dumps(_finite(head), allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)  # arrays on the page must start at a multiple of their element's size
    return b"".join((struct.pack("<I", len(text)), text, body))


def _finite(value: Any) -> Any:
    """JSON has no NaN: a number that is none becomes null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return value


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _real(message: Mapping[str, Any], name: str) -> float:
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{name} is {_short(value)}; allowed is a number")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is {_short(value)}; allowed is a number that fits a float") from None


def _whole(message: Mapping[str, Any], name: str) -> int:
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{name} is {_short(value)}; allowed is a whole number")
    return value


def _flag(message: Mapping[str, Any], name: str) -> bool:
    value = message.get(name)
    if not isinstance(value, bool):
        raise InputError(f"{name} is {_short(value)}; allowed are true and false")
    return value


_MAKERS: dict[str, Callable[[Mapping[str, Any], int], Command | Ack]] = {
    "ack": lambda m, hand: Ack(_whole(m, "seq")),
    "pause": lambda m, hand: Pause(_flag(m, "on")),
    "step": lambda m, hand: Step(),
    "reset": lambda m, hand: Reset(),
    "gravity": lambda m, hand: SetGravity(_real(m, "x"), _real(m, "y")),
    "substeps": lambda m, hand: SetSubsteps(_whole(m, "value")),
    "drag": lambda m, hand: Drag(hand, _real(m, "x"), _real(m, "y"), _real(m, "reach")),
    "poke": lambda m, hand: Poke(hand, _real(m, "x"), _real(m, "y")),
    "release": lambda m, hand: Release(hand),
}
