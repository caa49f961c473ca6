"""What the core says of contacts: what they gave in a frame, and which have touched and bounced, as events take it."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.laws.events import LOST, SURFACE, Told, key_of_surface
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.laws.obstacles import columns as at
from pyverlet.laws.touches import Met, Touches
from pyverlet.state.slots import Slots
from pyverlet.world.obstacle_rows import SIDES


class ContactNotes:
    """What contacts gave in one frame, read substep by substep: for `World.contacts`, `force_on` and `pressure`.

    Impulses of contacts at rest count as for h, whatever kick the first substep has.
    """

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
        push = weigh * arrays["impulse"][lane].astype(float)
        rub = weigh * arrays["tangent_impulse"][lane].astype(float) if "tangent_impulse" in arrays else np.zeros(len(lane))
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
        met = Met(particle.astype(np.int64), *numbers_of(surface, world._obstacle_arrays), given)
        self._touches.close(state, world._state, met, room, world._obstacle_arrays, dt, self._virial)


def numbers_of(surface: Any, obstacles: ObstacleArrays) -> tuple[Any, Any]:
    """(k,) whether surfaces of the core are of obstacles, and the numbers of these or of walls."""
    at_obstacle, number = surface >= SIDES, surface.astype(np.int64)
    if obstacles.seen:
        number[at_obstacle] = obstacles.segments[surface[at_obstacle] - SIDES, at.OF].astype(np.int64) % len(obstacles.seen)
    return at_obstacle, number


def told_of(engine: Any, obstacles: ObstacleArrays) -> Told:
    """What the engine has heard since it listens. A lane may stand twice in a batch, the second time for nothing."""
    told = Told.of([Told(*part) for part in engine.tell()])
    if obstacles.seen:
        which = np.flatnonzero(told.keys & SURFACE)
        at_obstacle, number = numbers_of(told.keys[which] & LOST, obstacles)
        told.keys[which] = key_of_surface(told.keys[which] >> 32, number, at_obstacle)
    return told


def sensed_by(engine: Any, number: Array, obstacles: ObstacleArrays) -> list[Array]:
    """Keys, sorted, of contacts with sensors in this frame, and of those at its end; number: of the particle in each slot."""
    sensors, found = np.array(obstacles.sensors, np.int64), engine.touched_sensors()
    return [np.sort(key_of_surface(number[slot], sensors[sensor], np.ones(len(slot), bool))) for slot, sensor in found]
