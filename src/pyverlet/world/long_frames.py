"""Divides frames whose substeps are longer than contacts and forces bear."""

from __future__ import annotations

from math import ceil, hypot, sqrt
from typing import Any

import numpy as np

from pyverlet.common.constants import MOST_SUBSTEPS
from pyverlet.common.errors import InputError
from pyverlet.laws.boundaries import Open
from pyverlet.world.materials import knows

LONGEST = 1 / 30
"""s, for up to eight substeps. In longer frames contacts of discs of 0.5 m that fall on Earth are as soft as mud."""

FALL, WAY = 0.05, 0.1
"""Larger or slower worlds may use longer frames: so many times sqrt(r / a), and so many times r / v, with the smallest radius,
the largest acceleration and the largest speed. Among moons a frame may last minutes."""


SINK = 0.04
"""Largest fall by gravity in a substep, in mean radii. Contacts sink in by a fourth of it for each circle on top."""

MOST = 32
"""Most parts of a frame for the sake of small circles; circles of a micrometre need all, at 60 frames a second on Earth."""


def parts_of(world: Any, dt: float) -> int:
    """How many frames, each of `substeps` substeps, replace a frame of dt seconds; the core must know its circles.

    Raises:
        InputError: too many to wait for.
    """
    boundary, meet, substeps = world.boundary, world.collisions and len(world) > 1, world.substeps
    borne = substeps * world._force_sum.longest_substep(world._sorted)
    parts = np.ceil(dt / borne * (1 - 1e-9)) if dt > borne else 1.0
    longest = LONGEST * max(1.0, substeps / 8)
    # Without collisions, rooms with a confining method of their own are shown with long frames, as the method handles them.
    holds = world.obstacles or world.links or (not isinstance(boundary, Open) and (world.collisions or knows(boundary)))
    if dt > longest and (meet or holds):
        parts = max(parts, np.ceil(dt / max(longest, _borne(world, dt / parts)) * (1 - 1e-9)))
    if parts * substeps > MOST_SUBSTEPS:
        raise InputError(f"dt is {dt:g}, which takes {parts * substeps:.3g} substeps here; allowed are {MOST_SUBSTEPS:,}")
    if meet:
        h = dt / (parts * substeps)
        sinks = hypot(*world.gravity) * h * h / (SINK * world._frames.held.mean_radius)
        parts *= max(1, ceil(min(sqrt(sinks), MOST) * (1 - 1e-9)))
    return int(parts)


def _borne(world: Any, dt: float) -> float:
    """The longest frame that contacts bear, s."""
    state, forces = world._sorted, world._force_sum
    if world.links or world._obstacle_arrays.drives or not len(state):
        return 0.0  # links and obstacles may be faster than any particle
    state.h = dt / world.substeps  # drag needs it
    forces.look(state, world.time)
    fastest, radius = float(np.sqrt((state.velocity.astype(float) ** 2).sum(axis=1).max())), float(state.radius.min())
    falls = FALL * float(np.sqrt(radius / forces.strongest)) if forces.strongest else np.inf
    borne = min(falls, WAY * radius / fastest if fastest else np.inf)
    return borne if borne > 0.0 else 0.0  # non-finite values are reported by the frame
