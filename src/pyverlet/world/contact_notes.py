"""What the core says of contacts: what they gave in a frame, and which have touched and bounced, as events take it."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.laws.events import LOST, SURFACE, Told, between, key_of_surface
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.laws.obstacles import rows as at
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
        apart = arrays["reach"][lane if len(arrays["reach"]) > 8 else 0 * lane] - arrays["depth"][lane]
        i, j, normal = i[lane], j[lane], arrays["normal"][:, lane].astype(float)
        self._hear(i, j, normal, np.vstack((push, rub, struck)), state.inverse_mass[[i, j]].astype(float).sum(axis=0), apart)

    def _hear(self, i: Array, j: Array, normal: Array, given: Array, inverse: Array, apart: Array) -> None:
        """What pairs of slots have given: (4, k) along normals and tangents, and (x, y) in impacts; times `inverse`, 1/kg."""
        (x, y), (push, rub, *struck) = normal, given / inverse
        impulse = np.column_stack((push * x + rub * y + struck[0], push * y - rub * x + struck[1]))
        self._touches.hear(self._state, i, j, impulse)
        self._virial += float((impulse * normal.T).sum(axis=1) @ apart)

    def _hear_sleepers(self, world: Any, dt: float) -> None:
        """They go on to give what they gave when they fell asleep: rates, which the core knows nothing of."""
        kept, state, room, obstacles = world._frames.held.asleep, self._state, world.boundary, world._obstacle_arrays
        if len(kept.pairs):
            i, j = state.slots_of(kept.pairs.T)
            x, radius = state.position.astype(float), state.radius.astype(float)
            _, normal = between(room.seam, x[i], x[j], radius[i], radius[j])
            given = dt * np.column_stack((kept.values[:, :2], np.zeros((len(i), 2)))).T
            apart = np.hypot(*room.seam.nearest(x[j] - x[i]).T)
            self._hear(i, j, normal.T, given, 1 / state.mass[i].astype(float) + 1 / state.mass[j], apart)
        bears = kept.pushes[:, 0] > 0  # one-way lines that let one pass have -1
        if bears.any():
            particle, surface = kept.surfaces[bears].T
            slot, (at_obstacle, number) = state.slots_of(particle), numbers_of(surface, obstacles)
            x, normal = state.position[slot].astype(float), np.zeros((len(slot), 2))
            within = 2 * float(state.radius[slot].max())
            normal[at_obstacle] = -obstacles.facing(x[at_obstacle], number[at_obstacle], within=within, ahead=dt)[1]
            if not at_obstacle.all():
                walls = np.flatnonzero(~at_obstacle)
                normal[walls] = -room.facing(x[walls])[1][np.arange(len(walls)), number[walls]]
            (nx, ny), (push, rub) = normal.T, dt * kept.pushes[bears, :2].T
            given = np.column_stack((rub * ny - push * nx, -rub * nx - push * ny, push, rub))
            self._met.append((particle, surface, state.mass[slot, None] * given))

    def close(self, world: Any, dt: float) -> None:
        """The frame of dt seconds is over."""
        self._engine.note(None)
        self._hear_sleepers(world, dt)
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
