"""What contacts gave in a frame, read from the core substep by substep: for `World.contacts`, `force_on` and `pressure`."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.laws.touches import Met, Touches
from pyverlet.state.slots import Slots
from pyverlet.world.heard import numbers_of


class ContactNotes:
    """The notes of one frame. Impulses of contacts at rest count as for h, whatever kick the first substep has."""

    def __init__(self, touches: Touches, engine: Any, state: Slots) -> None:
        self._touches, self._engine, self._state = touches, engine, state
        self._by_walls = np.zeros((len(state), 2), state.dtype)  # what links pull out of the room
        self._virial = 0.0
        self._met: list[tuple[Any, Any, Any]] = []
        touches.open()
        engine.note(self._by_walls)

    def read(self, weigh: float) -> None:
        """A substep is over. weigh: what impulses of contacts at rest are worth."""
        state, arrays = self._state, self._engine.arrays
        slot, surface, given = self._engine.take_given()
        self._met.append((state.particle[slot], surface, state.mass[slot, None] * given))
        first, count, i, j = self._engine.pairs()
        lane = np.concatenate([np.zeros(0, np.int64), *(np.arange(f, f + c) for f, c in zip(first, count, strict=True))])
        if not len(lane):  # a world of one circle has no arrays of pairs
            return
        push, rub = weigh * arrays["impulse"][lane].astype(float), weigh * arrays["tangent_impulse"][lane].astype(float)
        struck = arrays["struck"][:, lane].astype(float)
        given = (push != 0) | (rub != 0) | struck.any(axis=0)
        given[1:] &= (i[lane[1:]] != i[lane[:-1]]) | (j[lane[1:]] != j[lane[:-1]])  # those that fill a batch are repeated
        lane, push, rub, struck = lane[given], push[given], rub[given], struck[:, given]
        if not len(lane):
            return
        i, j, (x, y) = i[lane], j[lane], arrays["normal"][:, lane].astype(float)
        mass = 1.0 / (state.inverse_mass[i].astype(float) + state.inverse_mass[j])
        impulse = mass[:, None] * np.column_stack((push * x + rub * y + struck[0], push * y - rub * x + struck[1]))
        self._touches.hear(state, i, j, impulse)
        apart = arrays["reach"][lane if len(arrays["reach"]) > 8 else 0 * lane] - arrays["depth"][lane]
        self._virial += float((impulse * np.column_stack((x, y))).sum(axis=1) @ apart)

    def close(self, world: Any, dt: float) -> None:
        """The frame of dt seconds is over."""
        self._engine.note(None)
        state, room = self._state, world.boundary
        slot = np.flatnonzero(self._by_walls.any(axis=1))
        if len(slot):
            given = self._by_walls[slot].astype(float)
            column = np.column_stack((given, np.hypot(*given.T), np.zeros(len(slot))))
            nearest = np.argmin(room.facing(state.position[slot])[0], axis=1)
            self._met.append((state.particle[slot], nearest, state.mass[slot, None] * column))
        particle, surface, given = (np.concatenate(parts) for parts in zip(*self._met, strict=True))
        met = Met(particle.astype(np.int64), *numbers_of(surface, world._course), given)
        self._touches.close(state, world._state, met, room, world._course, dt, self._virial)
