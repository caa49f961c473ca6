"""Collisions between particles: the settings (`Collisions`), and measuring overlaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.core import unit
from pyverlet.state.state import State


@dataclass(frozen=True)
class Fast:
    """Find pairs with nested grids, and keep them in a list until a particle has moved by the skin.

    Args:
        skin: extra distance, in mean diameters, within which pairs are listed. None adapts it to the motion.
    """

    skin: float | None = None

    def __post_init__(self) -> None:
        if self.skin is not None:
            checks.number("skin", self.skin, least=0.0)


@dataclass(frozen=True)
class BruteForce:
    """Test all pairs, in O(n^2): the reference for `Fast`."""


COMBINE = ("geometric", "mean", "min", "max", "multiply")
"""Rules for combining two values, as the core numbers them."""

TOGETHER = ("restitution", "friction", "rolling_resistance")
"""Properties that a pair of materials may have."""


def _materials(table: Any) -> dict[tuple[str, str], dict[str, float]]:
    """The checked table, with the names of a pair sorted. In files, whose keys are text, a key is both names with a comma."""
    if not isinstance(table, Mapping):
        raise InputError(f"materials is {table!r}; allowed is a table such as {{('rubber', 'ice'): {{'friction': 0.1}}}}")
    checked: dict[tuple[str, str], dict[str, float]] = {}
    for key, values in table.items():
        names: Any = tuple(name.strip() for name in key.split(",")) if isinstance(key, str) else key
        if not (isinstance(names, tuple) and len(names) == 2 and all(isinstance(name, str) and name for name in names)):
            raise InputError(f"materials has the key {key!r}; allowed are two names, such as ('rubber', 'ice')")
        if not isinstance(values, Mapping) or not values.keys() <= set(TOGETHER):
            raise InputError(f"materials of {names} is {values!r}; allowed is a table of {', '.join(TOGETHER)}")
        if "restitution" in values:
            checks.fraction(f"restitution of {names}", values["restitution"])
        first, second = sorted(names)
        if (first, second) in checked:
            raise InputError(f"materials has {names} twice; allowed is one table for two materials, in either order")
        checked[first, second] = {name: checks.number(f"{name} of {names}", value, least=0.0) for name, value in values.items()}
    return checked


@dataclass(frozen=True, kw_only=True)
class Collisions:
    """How particles collide with each other.

    The numbers apply to circles added without values of their own. Of two different values the larger restitution is used, and
    the geometric mean of frictions (as in Box2D) and of rolling resistances; also between a wall and a circle with values of its
    own.

    Args:
        restitution: e, 0 to 1. After an impact the normal speed is e times that before; resting contacts never bounce.
        friction: Coulomb's mu, 0 or more. 0 leaves spin unchanged.
        rolling_resistance: c, 0 or more: contacts resist rolling by a torque of at most c r N, N being the normal force and r the
            radius, between two circles r_i r_j / (r_i + r_j). A disc that rolls on a level floor at v0 stops after
            v0^2 (1 + 1/2) / (2 c g), and rests on a slope of less than c. Impacts are not affected.
        combine: rule for combining two values: "geometric", "mean", "min", "max" or "multiply" (as in pymunk). With "geometric"
            the larger restitution is used. Between a surface and a circle without values of its own, the surface's are used.
        materials: properties of pairs of materials, which override all others: {("rubber", "ice"): {"friction": 0.1}}, with
            any of restitution, friction and rolling_resistance; also for a material with itself. Circles, obstacles and rooms
            have the material that their `material` names.
        method: how pairs are found, Fast() or the O(n^2) reference BruteForce(). Both find the same contacts.
    """

    restitution: float = 0.0
    friction: float = 0.0
    rolling_resistance: float = 0.0
    combine: str = "geometric"
    materials: Mapping[Any, Mapping[str, float]] = field(default_factory=dict, hash=False)
    method: Fast | BruteForce = field(default_factory=Fast)

    def __post_init__(self) -> None:
        checks.fraction("restitution", self.restitution)
        checks.number("friction", self.friction, least=0.0)
        checks.number("rolling_resistance", self.rolling_resistance, least=0.0)
        checks.choice("combine", self.combine, COMBINE)
        object.__setattr__(self, "materials", _materials(self.materials))
        if not isinstance(self.method, Fast | BruteForce):
            raise InputError(f"method is {self.method!r}; allowed are pyverlet.Fast() and pyverlet.BruteForce()")

    @property
    def names(self) -> list[str]:
        """Names of all materials in the table."""
        return sorted({name for names in self.materials for name in names})

    def most(self, name: str) -> float:
        """The largest value of this property between two circles without values of their own."""
        own: float = getattr(self, name)
        return max([own, *(values.get(name, 0.0) for values in self.materials.values())])

    def table(self, names: Sequence[str]) -> Array:
        """(k, k, 3) properties of pairs of these materials, in the order of `TOGETHER`; -1 where the table has none."""
        values, table = np.full((len(names), len(names), len(TOGETHER)), -1.0), dict[Any, Any](self.materials)
        for i, first in enumerate(names):
            for j, second in enumerate(names):
                together = table.get((min(first, second), max(first, second)), {})
                values[i, j] = [together.get(name, -1.0) for name in TOGETHER]
        return values


class Overlap(NamedTuple):
    """Statistics of overlaps, as fractions of the contact distance r_i + r_j."""

    mean: float
    max: float
    contacts: int


def find_contacts(state: State, radius: Array | None = None) -> NDArray[np.int64]:
    """(k, 2) user's indices i < j of all overlapping pairs, sorted; without pinned and filtered pairs.

    radius: (n,) m, instead of those of the state.
    """
    pairs = np.empty(8 * len(state), np.int64)
    while (found := _touching(state, state.shown["radius"] if radius is None else radius, _NONE, pairs)[0]) > len(pairs):
        pairs = np.empty(found, np.int64)
    return np.column_stack(np.divmod(np.sort(pairs[:found]), max(len(state), 1)))


def measure_overlap(state: State, apart: Array) -> Overlap:
    """Measure the overlaps of a state, except for the pairs `apart` (k, 2) that links keep from colliding."""
    if len(state) < 2:
        return Overlap(0.0, 0.0, 0)
    keys = np.sort(np.sort(apart, axis=1) @ (len(state), 1)) if len(apart) else _NONE
    number, total, largest = _touching(state, state.shown["radius"], keys, _NONE)
    return Overlap(total / max(number, 1), largest, number)


_NONE = np.empty(0, np.int64)


def _touching(state: State, radius: Array, apart: Array, pairs: Array) -> tuple[int, float, float]:
    """`core.touching` for a state with these radii."""
    s, periodic = state.shown, state.periodic
    about = periodic.wrapped(s["position"]), radius, s["mass"], s["category"], s["mask"], *periodic.period, periodic.images()
    found: tuple[int, float, float] = unit("tools", state.dtype).touching(*about, apart, pairs)
    return found
