"""Kernels of the unit `motion`, compiled and as plain Python: the same bits, in both precisions."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.uncompiled import UNCOMPILED

from pyverlet import core

N = 21

Chance = np.random.Generator
KERNELS: dict[str, Callable[[Chance, Any], tuple[Any, ...]]] = {}


def kernel(make: Callable[[Chance, Any], tuple[Any, ...]]) -> Callable[[Chance, Any], tuple[Any, ...]]:
    """What a kernel is called with, under its name."""
    KERNELS[make.__name__] = make
    return make


def rows(chance: Chance, dtype: Any, size: float = 1.0) -> Any:
    return chance.normal(0, size, (N, 2)).astype(dtype)


def column(chance: Chance, dtype: Any) -> Any:
    return chance.uniform(0.5, 2, N).astype(dtype)


def light(chance: Chance, dtype: Any) -> Any:
    made = column(chance, dtype)
    made[[3, 17]] = 0
    return made


def masses(chance: Chance, dtype: Any) -> Any:
    made = column(chance, dtype)
    made[[3, 17]] = np.inf
    return made


def pairs(chance: Chance) -> tuple[Any, ...]:
    i, j = np.triu_indices(N, 1)
    half = len(i) // 2
    first, count = np.array([0, half], np.int64), np.array([half, len(i) - half], np.int64)
    return first, count, i.astype(np.uint32), j.astype(np.uint32)


def bodies(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    return rows(chance, dtype), rows(chance, dtype), column(chance, dtype), column(chance, dtype), masses(chance, dtype)


LIMITS = (3.0, 0.02, 0.0, -9.81, 3.0, 0.0, True, False, 1e-5, 0.1)


def order(chance: Chance) -> Any:
    return chance.permutation(N).astype(np.int32)


@kernel
def first_non_finite(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    made = rows(chance, dtype)
    made[7, 1], made[9, 0] = np.nan, np.inf
    return (made,)


def listed(chance: Chance) -> tuple[Any, Any]:
    i, j = np.triu_indices(N, 1)
    return i.astype(np.int32), j.astype(np.int32)


@kernel
def measure_near(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    where, count = rows(chance, dtype), N * (N - 1) // 2
    where[4] = where[5]  # no direction
    return where, *listed(chance), 1.5, 0.0, 3.0, np.zeros((2, count), np.int32), np.zeros(count), np.zeros((count, 2))


@kernel
def add_along(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    count = N * (N - 1) // 2
    return rows(chance, dtype), *listed(chance), chance.normal(size=(count, 2)), *chance.normal(size=(2, count))


@kernel
def moved_beyond(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    where = rows(chance, dtype)
    return where, where + dtype(0.1), 0.2, 3.0, 0.0


@kernel
def thermalize(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    who, number = order(chance), np.arange(N) * 3
    return rows(chance, dtype), rows(chance, dtype), light(chance, dtype), who, number, (7, 2**40, 3), 0.9, 0.5, 0.01


@kernel
def take_motion(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    one, other = ((*(rows(chance, dtype) for _ in range(3)), column(chance, dtype)) for _ in range(2))
    return one, other, order(chance), 0, 1


@kernel
def put_motion(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    one, other = ((*(rows(chance, dtype) for _ in range(3)), column(chance, dtype)) for _ in range(2))
    still, written = np.array([False]), np.zeros(1, np.uint8)
    return one, other, column(chance, np.float64), 0.0083, order(chance), still, written, 0, 1


@kernel
def gravitate(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    where = rows(chance, dtype)
    where[4] = where[5]  # no direction
    return rows(chance, dtype), where, masses(chance, dtype), order(chance)[:-2].copy(), 0.7, 0.0, 0.0, 3.0


@kernel
def gravitate_by_tree(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    where = rows(chance, dtype)
    where[4:8], where[12] = where[8], np.nan  # at one point, and nowhere
    slots = order(chance)[:-2].copy()
    return rows(chance, dtype), np.repeat(where, 3, axis=0)[:N], masses(chance, dtype), slots, 0.7, 0.01, 0.9, 0, 1


@kernel
def flow_of_fluid(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    slots, seam = order(chance)[:-2].copy(), (-3.0, 0.0, 6.0, 0.0)
    mirrors = np.array([  # a floor and a wall at a right angle, a disc that moves, and a cage
        (0, -1, 0, 0, 1, 0, 0, -1), (-2, 0, 0, 1, 0, 0, 0, -1), (1, 1, 0.5, 0, 0, 0.3, -0.2, 7), (0, 0, -2, 0, 0, 0, 0, -1),
    ], float)  # fmt: skip
    law = 0.9, 2.0, 7.0, 0.3, 0, 1
    given = rows(chance, dtype), rows(chance, dtype), rows(chance, dtype), column(chance, dtype)[:-2]
    return *given, slots, mirrors, seam, *law, *np.empty((2, N - 2))


@kernel
def energy_of_fluid(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    return chance.uniform(1, 3, N), column(chance, dtype), 2.0, 7.0


@kernel
def add_values(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    columns, fx = chance.normal(0, 1, (5, N)), chance.normal(0, 1, N)
    columns[4, 2] = columns[0, 6] = np.inf
    fx[[2, 6, 9]] = np.nan
    return rows(chance, dtype), columns, fx, np.array([0.3])


@kernel
def join_near_pairs(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    moved, size = rows(chance, dtype, 0.01), 0.1 * column(chance, dtype)
    return rows(chance, dtype), moved, size, 0.0, 3.0, light(chance, dtype), pairs(chance), 1.1, np.arange(N)


@kernel
def time_at_rest(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    free, calm = np.flatnonzero(np.arange(N) % 5), chance.uniform(0, 1, N).astype(np.float32)
    return rows(chance, dtype), column(chance, dtype), column(chance, dtype), free, 1.5, 0.016, 0.5, calm


@kernel
def find_islands(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    size, calm = 0.1 * column(chance, dtype), chance.uniform(0.4, 1, N).astype(np.float32)
    return rows(chance, dtype), size, 0.0, 3.0, light(chance, dtype), calm, pairs(chance), 1.1, 0.5, np.empty(N, np.int64)


@kernel
def total_energy(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    moving = rows(chance, dtype), rows(chance, dtype), rows(chance, dtype)
    return *moving, 0.01, column(chance, dtype), column(chance, dtype), masses(chance, dtype), 0.1, -9.81


@kernel
def raise_of(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    pull = rows(chance, float), rows(chance, float)
    return bodies(chance, dtype), bodies(chance, dtype), order(chance), *pull, LIMITS, np.empty(N), np.empty((N, 2))


@kernel
def take_energy(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    root = np.arange(N) // 3 * 3
    about = root, rows(chance, float), order(chance), chance.normal(0, 1, N)
    work = chance.normal(0, 1, N), rows(chance, float), np.empty((N, 2))
    return bodies(chance, dtype), bodies(chance, dtype), about, LIMITS, *work


def walled(chance: Chance, dtype: Any, law: tuple[float, ...]) -> tuple[Any, ...]:
    """What walls confine."""
    own = chance.uniform(-1, 1, (2, N)).astype(dtype)
    circles = *(rows(chance, dtype) for _ in range(3)), column(chance, dtype), 0.2 * column(chance, dtype), *own
    return circles, light(chance, dtype), np.full(N, -1, dtype), law


KERNELS |= {
    "advance": lambda c, t: (rows(c, t), rows(c, t), rows(c, t), 0.013),
    "newton": lambda c, t: (rows(c, t), rows(c, t), light(c, t), 0.1, -9.81),
    "all_finite": lambda c, t: (rows(c, t), rows(c, t)),
    "wrap": lambda c, t: (rows(c, t, 3.0), -1.0, 0.3, 2.0, 0.0, rows(c, t)),
    "add_constant": lambda c, t: (rows(c, t), 0.3, -0.7),
    "add_point_spring": lambda c, t: (rows(c, t), rows(c, t, 3.0), 0.1, 0.2, 7.7, 2.0, 0.0),
    "add_drag": lambda c, t: (rows(c, t), rows(c, t), column(c, t), 0.1, 0.2, 0.3, 0.4),
    "add_drag_in_field": lambda c, t: (rows(c, t), rows(c, t), column(c, t), rows(c, t), 0.3, 0.4),
    "soften": lambda c, t: (rows(c, t), 50 * column(c, t), light(c, t), 0.1, -9.81, 0.013),
    "attract": lambda c, t: (rows(c, t), rows(c, t), light(c, t), 0.1, 0.2, 3.3, 0.05, 2.5, 0.0),
    "gravitational_potential": lambda c, t: (rows(c, float), masses(c, float), 0.1, 0.0, 3.0),
    "function_arguments": lambda c, t: (rows(c, t), rows(c, t), masses(c, t), np.empty((5, N))),
    "join_rows": lambda c, t: (c.integers(0, N, (9, 2)).astype(np.int32), light(c, t), np.arange(N)),
    "energy_gained": lambda c, t: (bodies(c, t), bodies(c, t), 0.1, -9.81),
    "confine_to_box": lambda c, t: (-0.7, -0.8, 0.9, 1.0, *walled(c, t, (0.01, 0.005, 0.5, 0.3, 0.0, 0.05))),
    "confine_to_circle": lambda c, t: (0.1, 0.2, 0.9, *walled(c, t, (0.01, 0.0, 0.0, 0.3, 2.0, 0.05))),
}

OF_ENGINE = {"any_differs", "energy_gained", "put_motion", "take_motion", "total_energy", "wrap"}


def flat(value: Any) -> list[Any]:
    """All arrays and numbers in nested tuples."""
    return [each for part in value for each in flat(part)] if isinstance(value, tuple) else [value]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", KERNELS)
def test_compiled_and_uncompiled_have_the_same_bits(name: str, dtype: Any) -> None:
    unit = "engine" if name in OF_ENGINE else "motion"
    given = KERNELS[name](np.random.default_rng(11), dtype)
    other = copy.deepcopy(given)
    with np.errstate(all="ignore"):
        plain = getattr(UNCOMPILED(unit, dtype), name)(*given)
    compiled = getattr(core.unit(unit, dtype), name)(*other)
    for one, two in zip(flat((plain, given)), flat((compiled, other)), strict=True):
        assert np.array_equal(np.asarray(one), np.asarray(two), equal_nan=np.asarray(one).dtype.kind == "f"), name


def test_all_kernels_are_compared() -> None:
    missing = (set(core.unit("motion").__all__) | OF_ENGINE) - set(KERNELS)
    assert missing == {"any_differs", "settle", "tree_work"}  # comparisons, a line, and empty arrays
