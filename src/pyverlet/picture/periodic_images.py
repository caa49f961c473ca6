"""Copies of circles and links that reach across a periodic boundary."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.arrays import Array
from pyverlet.laws.obstacles import Outline
from pyverlet.state.periodicity import Periodicity
from pyverlet.world.world import World


def copies(position: Array, radius: Array, periodic: Periodicity) -> tuple[NDArray[np.uint32], Array]:
    """Circles (n, 2) and (n,), m, inside a periodic room, that reach into another image of it.

    Returns:
    (k,) the circle of each copy, and (k, 2) its position, m.
    """
    owner, place = [np.empty(0, np.uint32)], [np.empty((0, 2), position.dtype)]
    low, period = np.array((periodic.low_x, periodic.low_y)), np.array(periodic.period)
    near = np.zeros((len(position), 2), np.int8)  # direction in which each is shifted
    for axis in range(2):
        if period[axis] > 0:
            x = position[:, axis]
            near[:, axis] = (x - low[axis] < radius).astype(np.int8) - (low[axis] + period[axis] - x < radius)
    for ways in ((1, 0), (0, 1), (1, 1)):
        rows = np.flatnonzero((near[:, np.array(ways, bool)] != 0).all(axis=1))
        owner.append(rows.astype(np.uint32))
        place.append((position[rows] + near[rows] * ways * period).astype(position.dtype))
    return np.concatenate(owner), np.concatenate(place)


def circles(world: World, colours: Array) -> tuple[Array, Array, Array, Array]:
    """Positions, radii, angles and colours of a world's circles, followed by those of their copies at a periodic boundary."""
    position, radius, angle = world.position, world.radius, world.angle
    if not world.boundary.periodic:
        return position, radius, angle, colours
    owner, place = copies(position, radius, world.boundary.periodic)
    radius, angle, colours = (np.concatenate((column, column[owner])) for column in (radius, angle, colours))
    return np.concatenate((position, place)), radius, angle, colours


def links(world: World) -> tuple[Array, Array] | None:
    """Links (m, 2, 2) in m and their tension, N, with copies; None if there are none."""
    if not len(world.links):
        return None
    ends, force = world.links.segments()
    periodic = world.boundary.periodic
    return lines(world.position[world.links.pulls()[0]], force, periodic) if periodic else (ends, force)


def lines(ends: Array, force: Array, periodic: Periodicity) -> tuple[Array, Array]:
    """Links (m, 2, 2) in m and their tension, with copies from the second end for those across the boundary."""
    way = periodic.nearest(ends[:, 1] - ends[:, 0])
    there = ends.copy()
    there[:, 1] = ends[:, 0] + way
    through = np.flatnonzero(np.abs(there[:, 1] - ends[:, 1]).max(axis=1, initial=0) > 0.25 * periodic.shortest)
    back = ends[through][:, ::-1].copy()
    back[:, 1] = back[:, 0] - way[through]
    return np.concatenate((there, back)), np.concatenate((force, force[through]))


def outlines(drawn: Sequence[Outline], periodic: Periodicity) -> list[Outline]:
    """Outlines, with copies of those that reach into another image of the room."""
    if not periodic:
        return list(drawn)
    low, high = (
        np.array((periodic.low_x, periodic.low_y)),
        np.array((periodic.low_x + periodic.period_x, periodic.low_y + periodic.period_y)),
    )
    repeats, found = np.array(periodic.period) > 0, []
    for points, filled in drawn:
        for shift in periodic.images():
            moved = points + shift
            inside = ((moved.max(axis=0) > low) & (moved.min(axis=0) < high)) | ~repeats
            if inside.all() or not shift.any():
                found.append(Outline(moved, filled))
    return found
