"""What the compiled core is told of the circles of a world, sizes and whether they are all alike, and of its walls."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.collisions import BruteForce, Collisions
from pyverlet.laws.rooms import Box, Circle, Open, Periodic
from pyverlet.state.slots import Slots

Array = NDArray[Any]

ROOMS = Open, Circle, Box, Periodic

OPEN, CAGE, BOX = range(3)
"""Rooms, as the core numbers them."""

ALONE = 256
MUCH_LARGER = 4.0
"""Circles so many times as large as all but one in ALONE stand in no cell of the grid."""

ALL = 1e12
"""Mean diameters: farther than positions of either precision mean anything."""


def materials_of(state: Slots, radius: Array, collisions: Collisions | None) -> dict[str, Any]:
    """The arguments of `Engine.set_materials`; radius: (n,) m, in the user's order, on which the last bit of a mean depends."""
    ordered = np.sort(radius)[::-1] if len(radius) else np.ones(1)
    # Very few that are much larger than all others stand in no cell.
    usual = float(ordered[min(len(ordered) // ALONE, len(ordered) - 1)])
    brute = collisions is not None and isinstance(collisions.method, BruteForce)
    return {
        "collides": collisions is not None,
        "sized": _differs(state.radius),
        "varied": _differs(state.inverse_mass),
        "mixed": any(map(_differs, (state.radius, state.restitution, state.friction))),
        "brute": brute,
        "bulk": 0.0 if brute else float(ordered[ordered <= MUCH_LARGER * usual][0]),
        "smallest": float(ordered[-1]),
        "largest": float(ordered[0]),
        "mean_radius": float(radius.mean(dtype=np.float64)) if len(radius) else 1.0,
        "restitution": collisions.restitution if collisions else 0.0,
        "friction": collisions.friction if collisions else 0.0,
        "picky": bool(len(state.category)) or not bool((state.inverse_mass > 0).all()),
    }


def skin_of(collisions: Collisions | None) -> float | None:
    """Thickness of the skin in mean diameters; None: it adapts. For brute force no pair is too far apart to be listed."""
    if collisions is None:
        return None
    return ALL if isinstance(collisions.method, BruteForce) else collisions.method.skin


def _differs(column: Array) -> bool:
    """Whether not all are the same."""
    return bool(len(column) and (column != column[0]).any())


def knows(room: Any) -> bool:
    """Whether the core knows the walls of a room; others, of a user's own, confine the particles after each substep."""
    return type(room).confine in (each.confine for each in ROOMS)


def walls_of(room: Any) -> tuple[float, ...]:
    """The arguments of `Engine.set_room`."""
    if not knows(room):
        return OPEN, *(0.0,) * 7, 0, 0
    if isinstance(room, Circle):
        speed = room.angular_velocity * room.radius
        return CAGE, *room.center, room.radius, 0.0, room.restitution, room.friction, speed, room.category, room.mask
    if not isinstance(room, Box | Periodic) or (isinstance(room, Periodic) and room.axes == "xy"):
        return OPEN, *(0.0,) * 7, 0, 0
    corners = room._box if isinstance(room, Periodic) else (*room.lower, *room.upper)
    return BOX, *corners, room.restitution, room.friction, 0.0, room.category, room.mask
