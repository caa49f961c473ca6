"""Kernels of the unit `motion`, compiled and as plain Python: the same bits, in both precisions."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.uncompiled import UNCOMPILED

from pyverlet import core

N = 21
PAIRS = N * (N - 1) // 2

Chance = np.random.Generator
Make = Callable[[Chance, Any], tuple[Any, ...]]


def rows(chance: Chance, dtype: Any, size: float = 1.0) -> Any:
    return chance.normal(0, size, (N, 2)).astype(dtype)


def column(chance: Chance, dtype: Any) -> Any:
    return chance.uniform(0.5, 2, N).astype(dtype)


def holed(array: Any, where: Any, value: float) -> Any:
    array[where] = value
    return array


def light(chance: Chance, dtype: Any) -> Any:
    return holed(column(chance, dtype), [3, 17], 0)


def masses(chance: Chance, dtype: Any) -> Any:
    return holed(column(chance, dtype), [3, 17], np.inf)


def twins(chance: Chance, dtype: Any) -> Any:
    """Rows of which two are the same: there is no direction from one to the other."""
    made = rows(chance, dtype)
    made[4] = made[5]
    return made


def clumped(chance: Chance, dtype: Any) -> Any:
    """Rows of which many are at one point, and one nowhere."""
    made = np.repeat(rows(chance, dtype), 3, axis=0)[:N]
    made[9:15], made[20] = made[0], np.nan
    return made


def listed() -> tuple[Any, Any]:
    i, j = np.triu_indices(N, 1)
    return i.astype(np.int32), j.astype(np.int32)


def pairs() -> tuple[Any, ...]:
    i, j = np.triu_indices(N, 1)
    half = PAIRS // 2
    first, count = np.array([0, half], np.int64), np.array([half, PAIRS - half], np.int64)
    return first, count, i.astype(np.uint32), j.astype(np.uint32)


def moving(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    return *(rows(chance, dtype) for _ in range(3)), column(chance, dtype)


def bodies(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    return rows(chance, dtype), rows(chance, dtype), column(chance, dtype), column(chance, dtype), masses(chance, dtype)


def order(chance: Chance) -> Any:
    return chance.permutation(N).astype(np.int32)


def calm(chance: Chance, least: float) -> Any:
    return chance.uniform(least, 1, N).astype(np.float32)


def flow_of_fluid(chance: Chance, dtype: Any) -> tuple[Any, ...]:
    slots, seam = order(chance)[:-2].copy(), (-3.0, 0.0, 6.0, 0.0)
    mirrors = np.array([  # a floor and a wall at a right angle, a disc that moves, and a cage
        (0, -1, 0, 0, 1, 0, 0, -1), (-2, 0, 0, 1, 0, 0, 0, -1), (1, 1, 0.5, 0, 0, 0.3, -0.2, 7), (0, 0, -2, 0, 0, 0, 0, -1),
    ], float)  # fmt: skip
    law = 0.9, 2.0, 7.0, 0.3, 0, 1
    given = rows(chance, dtype), rows(chance, dtype), rows(chance, dtype), column(chance, dtype)[:-2]
    return *given, slots, mirrors, seam, *law, *np.empty((2, N - 2))


def walled(chance: Chance, dtype: Any, law: tuple[float, ...]) -> tuple[Any, ...]:
    """What walls confine."""
    own = chance.uniform(-1, 1, (2, N)).astype(dtype)
    circles = *moving(chance, dtype), 0.2 * column(chance, dtype), *own
    return circles, light(chance, dtype), np.full((N, 2), (-1, 0), dtype), law


LIMITS = (3.0, 0.02, 0.0, -9.81, 3.0, 0.0, True, False, 1e-5, 0.1)

KERNELS: dict[str, Make] = {
    "advance": lambda c, t: (rows(c, t), rows(c, t), rows(c, t), 0.013),
    "newton": lambda c, t: (rows(c, t), rows(c, t), light(c, t), 0.1, -9.81),
    "all_finite": lambda c, t: (rows(c, t), rows(c, t)),
    "first_non_finite": lambda c, t: (holed(holed(rows(c, t), (7, 1), np.nan), (9, 0), np.inf),),
    "measure_near": lambda c, t: (
        twins(c, t), *listed(), 1.5, 0.0, 3.0, True, np.zeros((2, PAIRS), np.int32), np.zeros(PAIRS), np.zeros((PAIRS, 2)),
    ),
    "touching": lambda c, t: (
        twins(c, t), column(c, t), column(c, t), *np.ones((2, N), np.uint32), 0.0, 0.0, np.zeros((1, 2)), np.arange(5),
        np.zeros(90, np.int64),
    ),
    "add_along": lambda c, t: (rows(c, t), *listed(), c.normal(size=(PAIRS, 2)), *c.normal(size=(2, PAIRS))),
    "moved_beyond": lambda c, t: (where := rows(c, t), where + t(0.1), 0.2, 3.0, 0.0),
    "thermalize": lambda c, t: (
        rows(c, t), rows(c, t), light(c, t), order(c), np.arange(N) * 3, (7, 2**40, 3), 0.9, 0.5, 0.01,
    ),
    "take_motion": lambda c, t: (moving(c, t), moving(c, t), order(c), np.zeros(N, np.uint8), 0, 1),
    "put_motion": lambda c, t: (
        moving(c, t), moving(c, t), column(c, np.float64), 0.0083, order(c), np.array([False]), np.zeros(1, np.uint8), 0, 1,
    ),
    "wrap": lambda c, t: (rows(c, t, 3.0), -1.0, 0.3, 2.0, 0.0, rows(c, t)),
    "add_drag": lambda c, t: (rows(c, t), rows(c, t), column(c, t), rows(c, t), 0.3, 0.4),
    "add_values": lambda c, t: (
        rows(c, t), holed(c.normal(0, 1, (5, N)), ([4, 0], [2, 6]), np.inf), holed(c.normal(0, 1, N), [2, 6, 9], np.nan),
        np.array([0.3]),
    ),
    "next_velocity": lambda c, t: (rows(c, t), rows(c, t), rows(c, t), c.normal(0, 1, (N, 10)), 0.013, False),
    "soften": lambda c, t: (rows(c, t), 50 * column(c, t), light(c, t), 0.1, -9.81, 0.013),
    "attract": lambda c, t: (rows(c, t), rows(c, t), light(c, t), 0.1, 0.2, 3.3, 0.05, 2.5, 0.0),
    "gravitate": lambda c, t: (
        rows(c, t), clumped(c, t), masses(c, t), order(c)[:-2].copy(), 0.7, 0.01, 0.9, (-1.0, 0.0, 0.0, 3.0), 0, 1,
    ),
    "flow_of_fluid": flow_of_fluid,
    "energy_of_fluid": lambda c, t: (c.uniform(1, 3, N), column(c, t), 2.0, 7.0),
    "function_arguments": lambda c, t: (rows(c, t), rows(c, t), masses(c, t), np.empty((5, N))),
    "join_rows": lambda c, t: (c.integers(0, N, (9, 2)).astype(np.int32), light(c, t), np.arange(N)),
    "join_near_pairs": lambda c, t: (
        rows(c, t), rows(c, t, 0.01), 0.1 * column(c, t), 0.0, 3.0, light(c, t), pairs(), 1.1, np.arange(N),
    ),
    "time_at_rest": lambda c, t: (
        rows(c, t), column(c, t), column(c, t), np.flatnonzero(np.arange(N) % 5), 1.5, 0.016, 0.5, calm(c, 0.0),
    ),
    "find_islands": lambda c, t: (
        rows(c, t), 0.1 * column(c, t), 0.0, 3.0, light(c, t), calm(c, 0.4), pairs(), 1.1, 0.5, np.empty(N, np.int64),
    ),
    "energy_gained": lambda c, t: (bodies(c, t), bodies(c, t), 0.1, -9.81),
    "total_energy": lambda c, t: (
        rows(c, t), rows(c, t), rows(c, t), 0.01, column(c, t), column(c, t), masses(c, t), 0.1, -9.81,
    ),
    "raise_of": lambda c, t: (
        bodies(c, t), bodies(c, t), order(c), rows(c, float), rows(c, float), LIMITS, np.empty(N), np.empty((N, 2)),
    ),
    "take_energy": lambda c, t: (
        bodies(c, t), bodies(c, t), (np.arange(N) // 3 * 3, rows(c, float), order(c), c.normal(0, 1, N)), LIMITS,
        c.normal(0, 1, N), rows(c, float), np.empty((N, 2)),
    ),
    "confine_to_box": lambda c, t: (-0.7, -0.8, 0.9, 1.0, *walled(c, t, (0.01, 0.005, 0.5, 0.3, 0.0, 0.05))),
    "confine_to_circle": lambda c, t: (0.1, 0.2, 0.9, *walled(c, t, (0.01, 0.0, 0.0, 0.3, 2.0, 0.05))),
}  # fmt: skip
"""What each kernel is called with."""

OF_ENGINE = {"any_differs", "energy_gained", "put_motion", "take_motion", "total_energy", "wrap"}


def flat(value: Any) -> list[Any]:
    """All arrays and numbers in nested tuples."""
    return [each for part in value for each in flat(part)] if isinstance(value, tuple) else [value]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", KERNELS)
def test_compiled_and_uncompiled_have_the_same_bits(name: str, dtype: Any) -> None:
    unit = "engine" if name in OF_ENGINE else "tools" if name == "touching" else "motion"
    given = KERNELS[name](np.random.default_rng(11), dtype)
    other = copy.deepcopy(given)
    with np.errstate(all="ignore"):
        plain = getattr(UNCOMPILED(unit, dtype), name)(*given)
    compiled = getattr(core.unit(unit, dtype), name)(*other)
    for one, two in zip(flat((plain, given)), flat((compiled, other)), strict=True):
        assert np.array_equal(np.asarray(one), np.asarray(two), equal_nan=np.asarray(one).dtype.kind == "f"), name


def test_all_kernels_are_compared() -> None:
    missing = (set(core.unit("motion").__all__) | OF_ENGINE | {"touching"}) - set(KERNELS)
    assert missing == {"any_differs", "settle", "tree_work"}  # comparisons, a line, and empty arrays
