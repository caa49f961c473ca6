"""Frames in which nothing but motion changes: the core makes them by itself, as long as all is what it was."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet import core
from pyverlet.common.errors import PyverletError
from pyverlet.common.interrupts import without_interrupts
from pyverlet.common.step_lock import exclusive
from pyverlet.laws.gains import most_gained
from pyverlet.laws.obstacles import journal
from pyverlet.laws.precision import fine_up_to
from pyverlet.state.state import MARKS, SET, moving
from pyverlet.world.core_arrays import SORTED_FROM
from pyverlet.world.long_frames import LONGEST
from pyverlet.world.materials import BOUNDARIES

_WORLD = ("actors", "observer", "_contact_records")
"""What a world is to have as it was, beside what its setters and frames that are not plain change: they drop what is prepared."""


def plain_frames(world: Any, dt: float) -> Any:
    """What makes the frames that follow one of dt seconds that has just been made; None: more than motion may change in them."""
    frames, state, sorted_state, obstacles, boundary = (
        world._frames,
        world._state,
        world._sorted,
        world._obstacle_arrays,
        world._boundary,
    )
    held = frames.held
    if not (
        frames.repeats
        and frames.gravity is world.gravity
        and 0 < len(sorted_state) < SORTED_FROM
        and dt <= LONGEST
        and held.steps == world._substeps
        and type(boundary) in BOUNDARIES
        and not (world.forces or world.links or world.actors or obstacles.moving or sorted_state.periodic or sorted_state.others)
        and world.observer is world._events is world._sleep is world._energy_ledger is None
        and not (sorted_state.own_inertia or held.parting)
        and all(isinstance(value, float | int | str | tuple) for value in vars(boundary).values())
    ):
        return None
    others = [
        (state, "shown"),
        (world._force_sum, "gravity"),
        (obstacles, "solid"),
        (obstacles, "moving"),
        (held, "rough"),
        (held, "rolls"),
        (held, "parting"),
    ]
    limited = (world._collisions and len(sorted_state) > 1) or obstacles.solid
    most = most_gained(world) if limited else np.inf
    precise = fine_up_to(sorted_state, float(np.hypot(*world.gravity)), sorted_state.h, world._substeps)
    return core.unit("engine", state.dtype).PlainFrames(
        held.engine, state.lock, moving(sorted_state), sorted_state.placed, moving(state), sorted_state.particle,
        state.shown["angle"], sorted_state.mass,
        [state.shown[name] for name in SET], [state.shown[name] for name in MARKS],
        np.array((dt, world._substeps, *world.gravity, most, precise)),
        [
            *((None, name, getattr(world, name)) for name in _WORLD),
            *((of, name, getattr(of, name)) for of, name in others),
            *((boundary, name, value) for name, value in vars(boundary).items()),
        ],
        _of_obstacles(world),
        [world.actors, world.forces, world.links._links], _end, world.profile.plain,
    )  # fmt: skip


@exclusive
def follow(world: Any, dt: float) -> bool:
    """Whether obstacles have come, gone or been changed since plain frames of dt seconds were prepared; the core sees them then.

    Raises:
        InputError: an obstacle is not what is allowed.
    """
    now = _of_obstacles(world)
    if world._plain is None or dt != world._plain.dt or now == world._plain.obstacles:
        return False
    world._frames.held.follow_obstacles(world, dt)
    world._plain.obstacles = now
    return bool(world._frames.held.h)


def _of_obstacles(world: Any) -> list[tuple[Any, str, int]]:
    """What is another number whenever obstacles are others."""
    watched = [(world.obstacles, "version"), *([(journal, "latest")] if world.obstacles else [])]
    return [(of, name, getattr(of, name)) for of, name in watched]


def _end(world: Any, plain: Any) -> None:
    """End a frame in which a number may not be finite, or that may have gained too much.

    Raises:
        NonFiniteError: a particle turned NaN or infinite; the world still holds the frame before.
    """
    with without_interrupts:
        try:
            world._frames.end_plain(world, plain)
            world._sorted.scatter(world._state, plain.dt, world._frames.held.still())
        except PyverletError:
            world._plain = None
            raise
        finally:
            plain.pending = False
