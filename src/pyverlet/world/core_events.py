"""Converts contact records of the core to what events take, and adds the contacts of sleepers, which the core does not know."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.laws.events import LOST, SURFACE, RecordedEvents, key_of_surface
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.laws.obstacles import rows as at
from pyverlet.world.obstacle_rows import SIDES
from pyverlet.world.sleepers import Remembered

_NO_KEYS = np.zeros(0, np.int64)
PAIR, ROW, PUSHES, TANGENT, ABOUT = 1 << 32, 7, 1, 3, 4  # see `core.contact_recording`


def rows_of_sleepers(kept: Remembered, mass: Array, dt: float) -> tuple[Array, Array]:
    """(keys, rows) as in `core.contact_recording`: impulses of sleeping contacts in dt seconds, at their last rates.

    kept: rates, unknown to the core; mass: of each particle, kg.
    """
    (low, high), at_surface = kept.pairs.astype(np.int64).T, kept.pushes[:, 0] > 0  # -1: a one-way line lets the particle pass
    particle, surface = kept.surfaces[at_surface].astype(np.int64).T
    rows = np.full((len(low) + len(particle), ROW), np.nan)
    rows[: len(low), [PUSHES, TANGENT]] = kept.values[:, :2] / (1 / mass[low] + 1 / mass[high])[:, None]
    rows[len(low) :, [PUSHES, TANGENT]], rows[len(low) :, ABOUT] = kept.pushes[at_surface, :2] * mass[particle, None], surface
    rows[:, [PUSHES, TANGENT]] *= dt
    return np.concatenate(((low << 33) + PAIR + high, (particle << 33) + surface)), rows


def numbers_of(surface: Any, obstacles: ObstacleArrays) -> tuple[Any, Any]:
    """(k,) whether surfaces of the core belong to obstacles, and the numbers of these obstacles or walls."""
    at_obstacle, number = surface >= SIDES, surface.astype(np.int64)
    if obstacles.seen:
        number[at_obstacle] = obstacles.segments[surface[at_obstacle] - SIDES, at.OF].astype(np.int64) % len(obstacles.seen)
    return at_obstacle, number


def recorded_events(engine: Any, obstacles: ObstacleArrays) -> RecordedEvents:
    """Contacts that the engine has recorded. A lane may be listed twice in a batch, the second time without effect."""
    recorded = RecordedEvents.of([RecordedEvents(*part) for part in engine.recorded_events()])
    if obstacles.seen:
        which = np.flatnonzero(recorded.keys & SURFACE)
        at_obstacle, number = numbers_of(recorded.keys[which] & LOST, obstacles)
        recorded.keys[which] = key_of_surface(recorded.keys[which] >> 32, number, at_obstacle)
    return recorded


def sensed_by(engine: Any, world: Any) -> list[Array]:
    """Sorted keys of the contacts with sensors during this frame, and of those at its end."""
    if not world._obstacle_arrays.sensors:
        return [_NO_KEYS, _NO_KEYS]
    sensors, found = np.array(world._obstacle_arrays.sensors, np.int64), engine.touched_sensors()
    number = world._state.shown["number"][world._sorted.particle]
    return [
        np.sort(key_of_surface(number[sorted_index], sensors[sensor], np.ones(len(sorted_index), bool)))
        for sorted_index, sensor in found
    ]
