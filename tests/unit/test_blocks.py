"""Kernels that go through all rows block by block, on several threads, see the last one, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pyverlet.kernels import motion
from pyverlet.laws.contacts.grids import Grids

ROWS = 2 * motion.BLOCK + 7
AT = [0, motion.BLOCK - 1, motion.BLOCK, ROWS - 1]


@pytest.mark.parametrize("row", AT)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_first_row_that_is_not_finite_is_found(row: int, value: float, axis: int) -> None:
    rows = np.zeros((ROWS, 2), np.float32)
    assert motion.first_non_finite(rows) == -1
    rows[row, axis] = value
    assert motion.first_non_finite(rows) == row
    rows[-1] = value
    assert motion.first_non_finite(rows) == row


def given() -> list[Any]:
    """Six columns, of which one is the same for all, and known by one number."""
    columns = [np.linspace(1, 2, ROWS, dtype=np.float32) for _ in range(4)] + [np.arange(ROWS, dtype=np.uint32)] * 2
    columns[1] = np.full(ROWS, 3, np.float32)
    return columns


@pytest.mark.parametrize("row", AT)
@pytest.mark.parametrize("column", range(6))
def test_one_row_that_differs_is_found(column: int, row: int) -> None:
    then = given()
    then[1] = then[1][:1]
    now = [array.copy() for array in given()]
    assert not motion.any_differs(*then, *now)
    now[column][row] += 1
    assert motion.any_differs(*then, *now)


def test_other_numbers_of_rows_differ() -> None:
    then = given()
    then[1] = then[1][:1]
    assert motion.any_differs(*then, *(array[:-1] for array in given()))


def test_grids_in_the_memory_of_others_are_as_good() -> None:
    rng, worn = np.random.default_rng(0), None
    for count in (3000, 2900, 3100, 500, 4000):
        position, radius = (
            rng.uniform(-30, 30, (count, 2)).astype(np.float32),
            rng.choice(np.array([0.1, 0.5], np.float32), count),
        )
        worn, fresh = Grids(position, radius, 0.1, worn=worn), Grids(position, radius, 0.1)
        assert worn.falls == fresh.falls
        assert np.array_equal(worn.order, fresh.order)
        assert np.array_equal(worn.start, fresh.start)
        assert np.array_equal(np.sort(worn.order), np.arange(count))
        worn.renumber()
        assert np.array_equal(worn.order, np.arange(count))
