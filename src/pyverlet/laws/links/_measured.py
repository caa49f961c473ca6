"""What rows of links measure, and its gradients: distances, angles, areas. Motors measure nothing."""

from __future__ import annotations

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.state.seam import Seam

ANGLE, AREA, MOTOR = range(3)
"""Kinds of rows that are no distances."""

TURN = 2.0 * np.pi


def cross(a: Array, b: Array) -> Array:
    """(k,) of (k, 2) and (k, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def across(a: Array) -> Array:
    """(k, 2) turned by a right angle, clockwise."""
    return np.column_stack((a[:, 1], -a[:, 0]))


def stretches(corner: Array, rest: Array, seam: Seam) -> Array:
    """(k,) how much farther than at rest the (2 k, 2) ends of each are apart, m."""
    return np.asarray(np.hypot(*seam.nearest(corner[1::2].astype(float) - corner[::2]).T) - rest)


def measured(first: Array, kind: Array, rest: Array, corner: Array, seam: Seam) -> tuple[Array, Array]:
    """(k,) what angles and areas measure beyond that at rest, with their particles in `corner`, and (entries, 2) gradients."""
    value, gradient, corner = np.zeros(len(kind)), np.zeros((len(corner), 2)), corner.astype(np.float64)
    if (angles := np.flatnonzero(kind == ANGLE)).size:
        e = first[angles]
        a, b = seam.nearest(corner[e] - corner[e + 1]), seam.nearest(corner[e + 2] - corner[e + 1])
        turn = np.arctan2(cross(a, b), (a * b).sum(axis=1)) - rest[angles]
        value[angles] = turn - TURN * np.floor(turn / TURN + 0.5)
        gradient[e] = across(a) / np.maximum((a * a).sum(axis=1), 1e-300)[:, None]
        gradient[e + 2] = -across(b) / np.maximum((b * b).sum(axis=1), 1e-300)[:, None]
        gradient[e + 1] = -gradient[e] - gradient[e + 2]
    for row in np.flatnonzero(kind == AREA):
        here = slice(first[row], first[row + 1])
        way = seam.nearest(corner[here] - corner[first[row]])  # triangles at the first particle
        after, before = np.roll(way, -1, axis=0), np.roll(way, 1, axis=0)
        value[row] = 0.5 * cross(way, after).sum() - rest[row]
        gradient[here] = 0.5 * across(after - before)
    return value, gradient
