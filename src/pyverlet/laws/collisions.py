"""Collisions between particles: what a user sets (`Collisions`), and which particles overlap."""

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
    """Pairs from nested grids, kept in a list until a particle has moved by the skin.

    Args:
        skin: extra distance, in mean diameters, within which pairs are listed. None adapts it to the motion.
    """

    skin: float | None = None

    def __post_init__(self) -> None:
        if self.skin is not None:
            checks.number("skin", self.skin, least=0.0)


@dataclass(frozen=True)
class BruteForce:
    """All pairs, in O(n^2): the reference for `Fast`."""


COMBINE = ("geometric", "mean", "min", "max", "multiply")
"""Ways to make one value of two, as the core numbers them."""

TOGETHER = ("restitution", "friction", "rolling_resistance")
"""What two materials may have together."""


def _materials(table: Any) -> dict[tuple[str, str], dict[str, float]]:
    """Checked, with names in alphabetical order. In files, where keys are text, a key is both names with a comma between."""
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

    These numbers are for circles added without values of their own. Of two that differ the larger restitution counts, and the
    geometric mean of the frictions, as in Box2D, and of the rolling resistances; so do those of a wall and of a circle that has
    values of its own.

    Args:
        restitution: e, 0 to 1. An impact leaves with e times the normal speed it came with; contact at rest never bounces.
        friction: mu of Coulomb, 0 or more. 0 leaves spin alone.
        rolling_resistance: c, 0 or more: contacts resist rolling by a torque of at most c r N, N being the normal force and r the
            radius, between two circles r_i r_j / (r_i + r_j). A disc that rolls on a level floor at v0 stops after
            v0^2 (1 + 1/2) / (2 c g), and rests on a slope of less than c. Bounces are free of it.
        combine: how the values of two that touch become one: "geometric", "mean", "min", "max" or "multiply" (as in pymunk). With
            "geometric" the larger restitution counts. Of a surface and a circle without values of its own, the surface's do.
        materials: what two materials have together, whatever each has of its own: {("rubber", "ice"): {"friction": 0.1}}, with
            any of restitution, friction and rolling_resistance; also of two of the same. Circles, obstacles and rooms are of
            the material that their `material` names.
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
        """Of all materials in the table."""
        return sorted({name for names in self.materials for name in names})

    def most(self, name: str) -> float:
        """The largest value of this name that two of circles without values of their own may have."""
        own: float = getattr(self, name)
        return max([own, *(values.get(name, 0.0) for values in self.materials.values())])

    def table(self, names: Sequence[str]) -> Array:
        """(k, k, 3) what two of these materials have together, in the order of `TOGETHER`; -1 where the table says nothing."""
        values, table = np.full((len(names), len(names), len(TOGETHER)), -1.0), dict[Any, Any](self.materials)
        for i, first in enumerate(names):
            for j, second in enumerate(names):
                together = table.get((min(first, second), max(first, second)), {})
                values[i, j] = [together.get(name, -1.0) for name in TOGETHER]
        return values


class Overlap(NamedTuple):
    """Overlap of the touching pairs, as a fraction of the contact distance r_i + r_j."""

    mean: float
    max: float
    contacts: int


def find_contacts(state: State, radius: Array | None = None) -> NDArray[np.int64]:
    """(k, 2) user's indices i < j of all overlapping pairs, sorted; not of two that are pinned, or that masks keep apart.

    radius: (n,) m, in place of those of the state.
    """
    pairs = np.empty(8 * len(state), np.int64)
    while (found := _touching(state, state.shown["radius"] if radius is None else radius, _NONE, pairs)[0]) > len(pairs):
        pairs = np.empty(found, np.int64)
    return np.column_stack(np.divmod(np.sort(pairs[:found]), max(len(state), 1)))


def measure_overlap(state: State, apart: Array) -> Overlap:
    """Overlap of all touching pairs of a state but for those of `apart` (k, 2), which links keep from colliding."""
    if len(state) < 2:
        return Overlap(0.0, 0.0, 0)
    keys = np.sort(np.sort(apart, axis=1) @ (len(state), 1)) if len(apart) else _NONE
    number, total, largest = _touching(state, state.shown["radius"], keys, _NONE)
    return Overlap(total / max(number, 1), largest, number)


_NONE = np.empty(0, np.int64)


def _touching(state: State, radius: Array, apart: Array, pairs: Array) -> tuple[int, float, float]:
    """As `core.touching`, of a state with these radii."""
    s, periodic = state.shown, state.periodic
    about = periodic.wrapped(s["position"]), radius, s["mass"], s["category"], s["mask"], *periodic.period, periodic.images()
    found: tuple[int, float, float] = unit("tools", state.dtype).touching(*about, apart, pairs)
    return found
