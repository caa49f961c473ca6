"""The saved state of a world."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.laws.events import Events
from pyverlet.laws.ledger import EnergyLedger
from pyverlet.laws.sleep import Sleep
from pyverlet.state.data import Columns
from pyverlet.state.state import State
from pyverlet.world.actors import Actor

INTO = "the world that a saved state is taken up by"
"""Key of the memo of `copy.deepcopy` for the world that receives a saved state."""


@dataclass(frozen=True, repr=False)
class Saved:
    """The state that `World.save` returns, enough to continue with the same bits. Opaque."""

    world: State
    arrays: dict[str, Array]
    time: float
    frames: int
    next_birth: int
    sorted_state: dict[str, Array]
    impulses: Any
    energy_ledger: EnergyLedger | None
    events: Events | None
    sleep: Sleep | None
    obstacles: Any
    actors: list[tuple[Actor, Any]]
    links: Any
    forces: list[tuple[Any, Any]]
    data: Columns

    def __repr__(self) -> str:
        return f"Saved(particles={len(self.arrays['mass'])}, time={self.time:g}, frames={self.frames})"

    def of(self, world: Any) -> Saved:
        """This state for use in `world`; if that is a copy or pickle, the objects are replaced by its own.

        Raises:
            InputError: it belongs to another world.
        """
        state: State = world._state
        if self.world is state:
            return self
        if self.world.key != state.key:
            raise InputError("saved is the state of another world; allowed is what save() of this one returned")
        memo: dict[Any, Any] = {id(self.world): state, INTO: world}
        # Laws are not restored, only their state: each force of the world takes the state of its counterpart.
        own = [force for force, _ in world._memories()]
        if list(map(type, own)) == [type(force) for force, _ in self.forces]:
            memo |= {id(force): mine for (force, _), mine in zip(self.forces, own, strict=True)}
        return copy.deepcopy(self, memo)
