"""The core's view of what circles and walls are made of, of circle sizes, and whether all circles are alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.laws.boundaries import Box, Circle, Open, Periodic
from pyverlet.laws.collisions import COMBINE, BruteForce, Collisions
from pyverlet.state.sorted_state import SortedState

BOUNDARIES = Open, Circle, Box, Periodic

_KNOWN = tuple(boundary.confine for boundary in BOUNDARIES)

OPEN, CAGE, BOX = range(3)
"""Numbers of the kinds of rooms in the core."""

_NO_WALLS = OPEN, *(0.0,) * 8, 0, 0, 0

ALONE = 256
MUCH_LARGER = 4.0
"""If at most one circle in ALONE is larger than all others by this factor, such circles are left out of the grid."""

ALL = 1e12
"""Mean diameters: beyond it positions of either precision have no meaning."""


def ease_of(state: SortedState) -> Array:
    """(n,) m r^2 over the moment of inertia: 2 for discs and pinned particles, 0 for fixed rotation."""
    if not (state.own_inertia or len(state.fixed_rotation)):
        return np.broadcast_to(state.real(2), len(state))
    ease = np.full(len(state), 2, state.dtype)
    own = np.flatnonzero((state.inertia > 0) & np.isfinite(state.mass))
    ease[own] = state.mass[own] * state.radius[own] ** 2 / state.inertia[own]
    ease[np.flatnonzero(state.fixed_rotation)] = 0
    return ease


def mixed(state: SortedState) -> bool:
    """Whether circles differ in material or size."""
    own = ("radius", "restitution", "friction", "rolling_resistance")
    return bool(len(state.material) or len(state.fixed_rotation) or state.own_inertia) or any(map(state.differ, own))


def names_of(collisions: Collisions | None) -> list[str]:
    """Names of the materials in the core's numbering, "" for none first; empty if the table has no pairs."""
    return ["", *collisions.names] if collisions and collisions.materials else []


def numbers_of(state: SortedState, names: list[str]) -> Array:
    """(n,) the number of each circle's material in `names`, 0 for none.

    Raises:
        InputError: a material is not in `names`.
    """
    if not len(state.material):
        return np.broadcast_to(np.uint32(0), len(state))
    which = np.unique(state.material)
    place = np.zeros(len(state.materials), np.uint32)
    place[which] = [number_of(state.materials[k], names, "circles") for k in which]
    return place[state.material]


def number_of(material: str, names: list[str], whose: str) -> int:
    """The number of a surface's material in `names`.

    Raises:
        InputError: the material is not in `names`.
    """
    if material and material not in names:
        known = ", ".join(map(repr, names[1:])) or "none, since `collisions` has no materials"
        raise InputError(f"material of {whose} is {material!r}; allowed: {known}")
    return names.index(material) if names else 0


def materials_of(state: SortedState, radius: Array, collisions: Collisions | None) -> dict[str, Any]:
    """The arguments of `Engine.set_materials`; radius: (n,) m, in the user's order, on which the last bit of a mean depends."""
    radius = radius if state.differ("radius") else radius[:1]
    ordered = np.sort(radius) if len(radius) else np.ones(1)
    # A few circles that are much larger than all others are left out of the grid.
    usual = float(ordered[-1 - min(len(ordered) // ALONE, len(ordered) - 1)])
    bulk = np.searchsorted(ordered, ordered.dtype.type(MUCH_LARGER * usual), "right") - 1
    names = names_of(collisions)
    brute = collisions is not None and isinstance(collisions.method, BruteForce)
    return {
        "collides": collisions is not None,
        "sized": state.differ("radius"),
        "varied": _differs(state.inverse_mass),
        "combine": COMBINE.index(collisions.combine) if collisions else 0,
        "together": collisions.table(names) if collisions and names else np.zeros((0, 0, 3)),
        "mixed": mixed(state),
        "brute": brute,
        "bulk": 0.0 if brute else float(ordered[bulk]),
        "smallest": float(ordered[0]),
        "largest": float(ordered[-1]),
        "mean_radius": float(radius.mean(dtype=np.float64)) if len(radius) else 1.0,
        "restitution": collisions.restitution if collisions else 0.0,
        "friction": collisions.friction if collisions else 0.0,
        "rolling": collisions.rolling_resistance if collisions else 0.0,
        "tests_pairs": bool(len(state.category)) or not bool((state.inverse_mass > 0).all()),
    }


def resist(boundary: Any, name: str, *most: float) -> bool:
    """Whether any contact has friction, or the property called `name`; most: largest values of pairs, circles and obstacles."""
    return max(getattr(boundary, name, 0.0), *most) > 0.0


def skin_of(collisions: Collisions | None) -> float | None:
    """Thickness of the skin in mean diameters; None: adaptive. For brute force it is so thick that all pairs are listed."""
    if collisions is None:
        return None
    return ALL if isinstance(collisions.method, BruteForce) else collisions.method.skin


def _differs(column: Array) -> bool:
    """Whether the values are not all equal."""
    return bool(len(column) and (column != column[0]).any())


def knows(boundary: Any) -> bool:
    """Whether the core knows the walls of a room; user-defined rooms confine the particles after each substep."""
    return type(boundary).confine in _KNOWN


def walls_of(boundary: Any, names: list[str]) -> tuple[float, ...]:
    """The arguments of `Engine.set_boundary`; names: of materials."""
    if not knows(boundary) or not isinstance(boundary, (Circle, Box, Periodic)):
        return _NO_WALLS
    material = number_of(boundary.material, names, "the room")
    about = boundary.restitution, boundary.friction, boundary.rolling_resistance
    marks = material, boundary.category, boundary.mask
    if isinstance(boundary, Circle):
        return CAGE, *boundary.center, boundary.radius, 0.0, *about, boundary.angular_velocity * boundary.radius, *marks
    return _NO_WALLS if isinstance(boundary, Periodic) and boundary.axes == "xy" else (BOX, *boundary._box, *about, 0.0, *marks)
