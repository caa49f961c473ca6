"""A world at a moment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from pyverlet.laws.events import Events
from pyverlet.laws.ledger import Bookkeeper
from pyverlet.laws.sleep import Sleep
from pyverlet.state.state import State
from pyverlet.world.actors import Actor

Array = NDArray[Any]


@dataclass(frozen=True)
class Saved:
    """What `World.save` keeps: enough to continue with the same bits. Opaque."""

    world: State
    arrays: dict[str, Array]
    time: float
    frames: int
    h_last: float | None
    slots: dict[str, Array]
    contacts: Any
    impulses: Any
    books: Bookkeeper | None
    events: Events | None
    sleep: Sleep | None
    obstacles: Any
    actors: list[tuple[Actor, Any]]
    links: Any
