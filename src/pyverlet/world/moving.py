"""Particles that are put elsewhere without a motion: as if they had just been added there, with the velocities they have."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.state.group import Group, Particle
from pyverlet.world.actors import Sink

if TYPE_CHECKING:
    from pyverlet.world.world import World


def move(world: World, which: Group | Particle, position: ArrayLike) -> None:
    """`Group.move_to`."""
    state, index = world._state, np.atleast_1d(which.index)
    goal = checks.rows("position", position, np.dtype(np.float64))
    if not len(index):
        return
    if np.ndim(position) == 1:
        here = state.position[index].astype(np.float64)
        shape = state.seam.nearest(here - here[0])  # of one that lies across the seam, too
        goal = goal + shape - shape.mean(axis=0)
    elif len(goal) != len(index):
        raise InputError(f"position has shape {goal.shape}; allowed is (2,), for their centre, or ({len(index)}, 2)")
    where = np.ascontiguousarray(goal, state.dtype)
    free, marks = np.isfinite(state.mass[index]), (state.category[index], state.mask[index])
    held, within = free & world.boundary.holds(*marks), np.where(free, world._course.covering(where, *marks), -1)
    world._refuse_misplaced(where, held, within, allowed="free places, and any for pinned ones")
    inside = state.seam.wrapped(where)
    state.crossed[index] = state.seam.periods(where.astype(np.float64) - inside)
    index, inside = index[moved := (inside != state.position[index]).any(axis=1)], inside[moved]
    lone = ~np.isin(index, world.links.joined())
    state.position[index], state.acceleration[index[lone]] = inside, np.nan
    world._frames.held.leave(index, index[lone])
    for actor in world.actors:
        if isinstance(actor, Sink):
            actor.forget(state.number[index])
