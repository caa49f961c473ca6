"""Who has touched and bounced in a frame of the contact law, in the form in which events take it."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.laws.events import Told, key_of_pair, key_of_surface
from pyverlet.laws.obstacles import Course
from pyverlet.laws.obstacles import columns as at
from pyverlet.state.slots import Slots
from pyverlet.world.obstacle_rows import SIDES


def numbers_of(surface: Any, course: Course) -> tuple[Any, Any]:
    """(k,) whether surfaces of the core are of obstacles, and the numbers of these or of walls."""
    at_obstacle, number = surface >= SIDES, surface.astype(np.int64)
    if course.count:
        number[at_obstacle] = course.segments[surface[at_obstacle] - SIDES, at.OF].astype(np.int64) % course.count
    return at_obstacle, number


def told_of(engine: Any, state: Slots, course: Course) -> list[Told]:
    """What the engine has heard since it listens, by the user's indices."""
    told, particle = [], state.particle.astype(np.int64)
    for (i, j, speed, bounces), (slot, surface, fast, thrown) in engine.tell():
        a, b = particle[i], particle[j]
        # A lane may stand twice in a batch, the second time for nothing.
        told.append(Told(key_of_pair(np.minimum(a, b), np.maximum(a, b)), speed, bounces.astype(np.int64)))
        at_obstacle, number = numbers_of(surface, course)
        told.append(Told(key_of_surface(particle[slot], number, at_obstacle), fast, thrown))
    return told


def sensed_by(engine: Any, state: Slots, course: Course) -> list[Any]:
    """Keys, sorted, of contacts with sensors in this frame, and of those at its end, by the user's indices."""
    if not course.sensors:
        return [np.zeros(0, np.int64)] * 2
    numbers, particle = np.array(course.sensors), state.particle.astype(np.int64)
    found = engine.touched_sensors()
    return [np.sort(key_of_surface(particle[slot], numbers[sensor], np.ones(len(slot), bool))) for slot, sensor in found]
