"""A world at a moment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class Saved:
    """What `World.save` keeps: enough to continue with the same bits. Opaque."""

    arrays: dict[str, Array]
    time: float
    frames: int
    h_last: float | None
    slots: tuple[Array, Array]
    neighbours: Any
    links: Any
