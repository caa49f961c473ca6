"""What a frame has gained, and what it may gain: see `laws.limiter`."""

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
"""Errors of the largest coordinate that places of both ends of a link come to in eight substeps, three times their mean."""

DEEP = 0.1
"""Of the contact distance: circles that overlap by more are where none can be."""

_RISE, _PARTING_S = 2.5, 1.0
"""Radii, and seconds in which what is left of the energy to part falls by e."""

_measured: Any = itemgetter("position", "velocity", "spin", "inertia", "radius", "mass")

TO_PART = 0.1
"""Of what a frame may gain: with less, no one needs energy to part."""


def gained(world: Any) -> float:
    """J that a frame under gravity alone has put in, beside what moves no particle."""
    particles = world._sorted
    then, now = body_of(world._state), body_of(particles)
    if len(particles.island) and 2 * len(particles.free) < len(particles):  # sleepers have gained nothing
        order = particles.particle[particles.free]
        then, now = tuple(column[order] for column in then), tuple(column[particles.free] for column in now)
    more: float = particles.engine.energy_gained(then, now, *world.gravity, *particles.thread_team)
    return more


def body_of(of: State | SortedState) -> tuple[Array, ...]:
    """What energies are measured of."""
    position, velocity, spin, inertia, radius, mass = _measured(vars(of) if isinstance(of, SortedState) else of.shown)
    return position, velocity, spin, spin_radius(inertia, radius, mass), mass


def most_gained(world: Any) -> float:
    """J that it may be."""
    return SURPLUS * fall(world._sorted.total_mass, world.gravity, world.boundary.extent())


def gained_much(world: Any) -> bool:
    """Whether there is anything to ask about a frame under gravity alone."""
    more, most = gained(world), most_gained(world)
    return more > most * TO_PART and (more > most or bool(world._sorted.placed.any()))


def fall(mass: float, gravity: tuple[float, float], extent: Extent | None) -> float:
    """What a fall through the room would give, m g H, J; without walls H is a fall of a second, g t^2 / 2."""
    gx, gy = gravity
    if extent is None:
        return mass * 0.5 * (gx * gx + gy * gy)
    return mass * (abs(gx) * (extent[2] - extent[0]) + abs(gy) * (extent[3] - extent[1]))


def rounding(state: SortedState, pulled: Sequence[State | SortedState]) -> float:
    """J that are not worth looking for: by rounding errors of the largest coordinate.

    Energy of motion by one in 1/60 s, and the work along some of what accelerates each of `pulled`. That has either sign: to undo
    what it gives would slow springs far from the origin.
    """
    error, work = float(np.finfo(state.dtype).eps) * float(np.abs(state.position).max(initial=0.0)), 0.0
    for now in pulled:
        free = np.isfinite(now.mass)
        work += float(np.nansum(now.mass[free] * np.hypot(*now.acceleration[free].T)))
    return 0.5 * state.total_mass * (60.0 * error) ** 2 + _ROUNDED_WORK * error * work


def undriven(world: Any) -> bool:
    """Whether nothing but contacts and links could raise the energy of a world.

    Forces have a potential or are drag, which wind is not, no motor runs, no link is given another length, no obstacle, wall or
    pinned circle moves, gravity does not point along a period, and the integrator does not raise it either: it is of order 2 or
    more.
    """
    boundary = world.boundary
    if world.integrator.order < 2 or boundary.moves or world.links.pool.drives:
        return False
    if world._sorted.pins and pinned_move(world._sorted):
        return False
    periodic = boundary.periodic
    if periodic and any(g != 0 and period > 0 for g, period in zip(world.gravity, periodic.period, strict=True)):
        return False  # what falls for ever gains for ever
    if world.forces and not all(type(force) is Drag or has_potential(force) for force in world.forces):
        return False
    return not world._obstacle_arrays.drives


def pinned_move(state: State | SortedState) -> bool:
    """Whether pinned particles push others about: they go on at their velocity, and nothing stops them."""
    return bool(unit("engine", state.mass.dtype).pinned_move(state.mass, state.velocity, state.spin))


def to_part(
    state: SortedState, position: Array, listed: Listed, heap: Array, weight: Array, gravity: tuple[float, float]
) -> float:
    """J that circles which the user has put into each other may gain.

    position: (n, 2) m, where they have been put. heap: (n,) lowest sorted index of the heap that each is in. weight: (n,) N.
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
    """What a frame of dt seconds may gain of so many J."""
    return parting * -float(np.expm1(-dt / _PARTING_S))


def less_to_part(parting: float, dt: float, most: float) -> float:
    """What is left of so many J after a frame of dt seconds; none where frames may gain so much anyway."""
    left = parting * float(np.exp(-dt / _PARTING_S))
    return left if left * dt > TO_PART * _PARTING_S * most else 0.0
