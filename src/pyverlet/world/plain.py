"""Plain frames: while only motion changes, the core runs whole frames by itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet import core
from pyverlet.common.checked import Checked, changes
from pyverlet.common.constants import SLEEP_AFTER_S, SLEEP_SPEED
from pyverlet.common.errors import PyverletError
from pyverlet.common.interrupts import without_interrupts
from pyverlet.common.step_lock import exclusive
from pyverlet.laws.gains import most_gained
from pyverlet.laws.obstacles import journal
from pyverlet.laws.precision import fine_up_to
from pyverlet.laws.sleep import laws
from pyverlet.state.state import MARKS, SET, moving
from pyverlet.world.core_arrays import SORTED_FROM
from pyverlet.world.frame_plan import FramePlan
from pyverlet.world.long_frames import LONGEST
from pyverlet.world.materials import BOUNDARIES

_WORLD = ("actors", "observer", "_contact_records")
"""Attributes that must stay the same; all others have setters or belong to other frames, which end plain frames."""


_NO_ROWS = np.zeros(0, np.int64)


def plain_frames(world: Any, dt: float) -> Any:
    """An object that runs frames like the last one, of dt seconds; None if more than motion may change in them."""
    frames, state, sorted_state, obstacles, boundary = (
        world._frames,
        world._state,
        world._sorted,
        world._obstacle_arrays,
        world._boundary,
    )
    held, sleep = frames.held, world._sleep
    asleep = sleep is not None and sleep.all_asleep(sorted_state)
    repeats = frames.repeats and frames.gravity is world.gravity and held.steps == world._substeps
    if not (
        (asleep or repeats)
        and (sleep is None or (sleep.is_plain and world._contact_records is None))
        and 0 < len(sorted_state) < SORTED_FROM
        and dt <= LONGEST
        and type(boundary) in BOUNDARIES
        and not (world.forces or world.links or world.actors or obstacles.moving or sorted_state.periodic or sorted_state.others)
        and world.observer is world._events is world._energy_ledger is None
        and not (sorted_state.own_inertia or held.parting)
        and all(isinstance(value, float | int | str | tuple) for value in vars(boundary).values())
    ):
        return None
    walls = [(boundary, name, value) for name, value in vars(boundary).items()]
    checked = [wall for wall in walls if isinstance(getattr(type(boundary), wall[1], None), Checked)]
    limited = (world._collisions and len(sorted_state) > 1) or obstacles.solid
    most = most_gained(world) if limited else np.inf
    gravity = float(np.hypot(*world.gravity))
    precise = fine_up_to(sorted_state, gravity, sorted_state.h, world._substeps)
    return core.unit("engine", state.dtype).PlainFrames(
        held.engine, state.lock, moving(sorted_state), sorted_state.placed, moving(state), sorted_state.particle,
        state.shown["angle"], sorted_state.mass,
        [state.shown[name] for name in SET], [state.shown[name] for name in MARKS],
        np.array((dt, world._substeps, *world.gravity, most, precise, SLEEP_SPEED**2 * gravity, SLEEP_AFTER_S)),
        [
            *((None, name, getattr(world, name)) for name in _WORLD),
            *((of, name, getattr(of, name)) for of, name in ((state, "shown"), (world._force_sum, "gravity"), (held, "parting"))),
            *(wall for wall in walls if wall not in checked),
        ],
        checked, changes, _of_obstacles(world),
        [world.actors, world.forces, world.links._links], _end, world.profile.plain,
        bool(sleep and sleep.anyone), asleep, sorted_state.sleep_timer, sorted_state.free if sleep else _NO_ROWS,
    )  # fmt: skip


@exclusive
def follow(world: Any, dt: float) -> bool:
    """Whether obstacles have changed since plain frames of dt seconds were prepared; they are then passed to the core.

    Not where particles may sleep: they wake.

    Raises:
        InputError: an obstacle is invalid.
    """
    now = _of_obstacles(world)
    if world._plain is None or world._sleep or dt != world._plain.dt or now == world._plain.obstacles:
        return False
    before = _made_of(world)
    world._frames.held.follow_obstacles(world, dt)
    world._plain.obstacles = now
    return bool(world._frames.held.h) and _made_of(world) == before


def _made_of(world: Any) -> tuple[Any, ...]:
    """Properties of obstacles that plain frames are prepared for."""
    obstacles, held = world._obstacle_arrays, world._frames.held
    return obstacles.solid, obstacles.moving, held.rough, held.rolls


def _of_obstacles(world: Any) -> list[tuple[Any, str, int]]:
    """Numbers that change whenever obstacles change."""
    watched = [(world.obstacles, "version"), *([(journal, "latest")] if world.obstacles else [])]
    return [(of, name, getattr(of, name)) for of, name in watched]


def _end(world: Any, plain: Any) -> None:
    """End a frame in which a number may not be finite, that may have gained too much energy, or in which particles sleep or wake.

    Raises:
        NonFiniteError: a particle turned NaN or infinite; the world still holds the frame before.
    """
    with without_interrupts:
        try:
            if world._sleep:
                world._sleep.look_again(world._state, laws(world))
            with np.errstate(over="ignore", invalid="ignore"):
                if _end_substeps(world, plain):
                    world._plain = None
            world._sorted.scatter(world._state, plain.dt, world._frames.held.still())
        except PyverletError:
            world._plain = None
            raise
        finally:
            plain.pending = False


def _end_substeps(world: Any, plain: Any) -> bool:
    """Make the remaining substeps, check the frame, and put particles to sleep. Returns whether particles fell asleep or woke."""
    frames, held, woken = world._frames, world._frames.held, plain.reached < world._substeps
    if woken:  # before the next substep
        frame = FramePlan(world, held, plain.dt, lambda _: None)
        frames.close(world, frame, finite=frames.substeps(world, frame, plain.reached))
    if world._sorted.first_non_finite() >= 0:
        particle, known, _, _, *numbers = held.note(world._sorted)
        try:
            frames.refuse_non_finite(world, plain.dt)
        finally:
            held.go_back((particle, known, plain.given[:, :2], plain.given[:, 2], *numbers))
            held.engine.record_contacts(False)
    if plain.limited and not woken:
        frames.limit(world, None, plain.dt)
    return bool(woken or frames.let_sleep(world, plain.dt, world.gravity))
