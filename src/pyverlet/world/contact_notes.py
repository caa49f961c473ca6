"""What contacts gave in a frame, read from the core substep by substep: for `World.contacts`, `force_on` and `pressure`."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.laws.touches import Touches
from pyverlet.state.slots import Slots


class ContactNotes:
    """The notes of one frame. Impulses of contacts at rest count as for h, whatever kick the first substep has."""

    def __init__(self, touches: Touches, engine: Any, state: Slots) -> None:
        self._touches, self._engine, self._state = touches, engine, state
        self._by_walls, self._by_obstacles = np.zeros((2, len(state), 2), state.dtype)
        self._virial = 0.0
        touches.open(len(state))
        engine.note(self._by_walls, self._by_obstacles)

    def read(self, weigh: float) -> None:
        """A substep is over. weigh: what impulses of contacts at rest are worth."""
        state, arrays = self._state, self._engine.arrays
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
        for slots, what in ((i, -impulse), (j, impulse)):
            self._touches.give(0, state.particle[slots], what * (state.inverse_mass[slots] > 0)[:, None])
        apart = arrays["reach"][lane if len(arrays["reach"]) > 8 else 0 * lane] - arrays["depth"][lane]
        self._virial += float((impulse * np.column_stack((x, y))).sum(axis=1) @ apart)

    def close(self, world: Any, dt: float) -> None:
        """The frame of dt seconds is over."""
        self._engine.note(None, None)
        state = self._state
        for whose, given in ((1, self._by_walls), (2, self._by_obstacles)):
            free = np.flatnonzero(given.any(axis=1) & (state.inverse_mass > 0))
            self._touches.give(whose, state.particle[free], state.mass[free, None] * given[free].astype(float))
        self._touches.close(state, world._state, world.boundary, world._course, dt, self._virial)
