"""Energy that a frame has gained, and may gain: see `laws.limiter`."""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import SURPLUS
from pyverlet.core import unit
from pyverlet.laws.forces import Drag, has_potential
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State, spin_radius

Listed = tuple[Array, Array, Array, Array]
Extent = tuple[float, float, float, float]

_ROUNDED_WORK = 2.0
"""Rounding errors of the largest coordinate in the ends of a link over eight substeps, three times their mean."""

DEEP = 0.1
"""Overlap over contact distance beyond which circles must have been placed by the user."""

_RISE, _PARTING_S = 2.5, 1.0
"""Rise in radii, and the time constant, s, by which the remaining separation energy decays."""

_measured: Any = itemgetter("position", "velocity", "spin", "inertia", "radius", "mass")

TO_PART = 0.1
"""Fraction of the allowed gain below which no separation energy is needed."""


def gained(world: Any) -> float:
    """Energy that a frame under gravity alone has added, J, without that of pinned and sleeping particles."""
    particles = world._sorted
    then, now = body_of(world._state), body_of(particles)
    if len(particles.island) and 2 * len(particles.free) < len(particles):  # sleepers have gained nothing
        order = particles.particle[particles.free]
        then, now = tuple(column[order] for column in then), tuple(column[particles.free] for column in now)
    more: float = particles.engine.energy_gained(then, now, *world.gravity, *particles.thread_team)
    return more


def body_of(of: State | SortedState) -> tuple[Array, ...]:
    """The arrays from which energies are computed."""
    position, velocity, spin, inertia, radius, mass = _measured(vars(of) if isinstance(of, SortedState) else of.shown)
    return position, velocity, spin, spin_radius(inertia, radius, mass), mass


def most_gained(world: Any) -> float:
    """The energy that a frame may gain, J."""
    return SURPLUS * fall(world._sorted.total_mass, world.gravity, world.boundary.extent())


def gained_much(world: Any) -> bool:
    """Whether a frame under gravity alone has gained enough to be examined."""
    more, most = gained(world), most_gained(world)
    return more > most * TO_PART and (more > most or bool(world._sorted.placed.any()))


def fall(mass: float, gravity: tuple[float, float], extent: Extent | None) -> float:
    """Energy m g H of a fall through the room, J; without walls H is a fall of one second, g t^2 / 2."""
    gx, gy = gravity
    if extent is None:
        return mass * 0.5 * (gx * gx + gy * gy)
    return mass * (abs(gx) * (extent[2] - extent[0]) + abs(gy) * (extent[3] - extent[1]))


def rounding(state: SortedState, pulled: Sequence[State | SortedState]) -> float:
    """Energy below which gains are rounding errors, J, from the error of the largest coordinate.

    It is the kinetic energy of such an error in 1/60 s, plus its work along the accelerations of each of `pulled`. That work may
    have either sign: removing it would slow springs far from the origin.
    """
    error, work = float(np.finfo(state.dtype).eps) * float(np.abs(state.position).max(initial=0.0)), 0.0
    for now in pulled:
        free = np.isfinite(now.mass)
        work += float(np.nansum(now.mass[free] * np.hypot(*now.acceleration[free].T)))
    return 0.5 * state.total_mass * (60.0 * error) ** 2 + _ROUNDED_WORK * error * work


def undriven(world: Any) -> bool:
    """Whether only contacts and links could raise the energy of a world.

    That is, forces have a potential or are drag (not wind), no motor runs, no link is given another length, no obstacle, wall or
    pinned circle moves, gravity has no component along a period, and the integrator is of order 2 or more, so that it does not
    raise the energy either.
    """
    boundary = world.boundary
    if world.integrator.order < 2 or boundary.moves or world.links.pool.drives:
        return False
    if world._sorted.pins and pinned_move(world._sorted):
        return False
    periodic = boundary.periodic
    if periodic and any(g != 0 and period > 0 for g, period in zip(world.gravity, periodic.period, strict=True)):
        return False  # an endless fall gains energy for ever
    if world.forces and not all(type(force) is Drag or has_potential(force) for force in world.forces):
        return False
    return not world._obstacle_arrays.drives


def pinned_move(state: State | SortedState) -> bool:
    """Whether pinned particles move, and push others: nothing stops them."""
    return bool(unit("engine", state.mass.dtype).pinned_move(state.mass, state.velocity, state.spin))


def to_part(
    state: SortedState, position: Array, listed: Listed, heap: Array, weight: Array, gravity: tuple[float, float]
) -> float:
    """Energy that circles which the user has placed inside each other may gain, J.

    position: (n, 2) m, where they were placed. heap: (n,) lowest row of the heap of each. weight: (n,) N.
    """
    first, count, i, j = listed
    at = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
    pairs = np.unique(np.sort(np.column_stack((i[at], j[at])), axis=1), axis=0)
    a, b = pairs[state.placed[pairs].any(axis=1)].T
    near = np.hypot(*state.periodic.nearest(position[b] - position[a]).T) < (1.0 - DEEP) * (state.radius[a] + state.radius[b])
    overlapped, fallen = np.bincount(np.concatenate((a[near], b[near])), minlength=len(state)), position @ gravity  # J/kg
    top = fallen.copy()
    np.minimum.at(top, heap, fallen)
    mass = np.where(state.inverse_mass > 0, state.mass, 0.0).astype(float)
    lift = mass * (fallen - top[heap]) + _RISE * weight * state.radius * np.sqrt(overlapped)
    return float(lift[overlapped > 0].sum())


def parting_now(parting: float, dt: float) -> float:
    """The part of this energy, J, that a frame of dt seconds may gain."""
    return parting * -float(np.expm1(-dt / _PARTING_S))


def less_to_part(parting: float, dt: float, most: float) -> float:
    """The energy that remains after a frame of dt seconds, J; 0 if frames may gain as much anyway."""
    left = parting * float(np.exp(-dt / _PARTING_S))
    return left if left * dt > TO_PART * _PARTING_S * most else 0.0
