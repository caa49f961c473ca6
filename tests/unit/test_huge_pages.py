"""Large arrays in memory of their own are arrays like any other."""

from __future__ import annotations

import gc
import sys
from typing import Any

import numpy as np
import pytest

from pyverlet.ground import memory

LARGE = 1 << 20  # of 4 bytes: 4 MB


@pytest.mark.parametrize("shape", [10, (10, 2), LARGE, (LARGE, 2), (2, LARGE + 3), 0])
@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint32])
def test_arrays_are_what_numpy_makes(shape: int | tuple[int, ...], dtype: type) -> None:
    array = memory.empty(shape, dtype)
    same: np.ndarray[Any, Any] = np.empty(shape, dtype)
    assert (array.shape, array.dtype, array.strides) == (same.shape, same.dtype, same.strides)
    assert array.flags.writeable
    assert array.flags.aligned
    assert array.flags.c_contiguous
    array[...] = 7
    assert (array == 7).all()
    assert not memory.zeros(shape, dtype).any()


def test_rows_taken_are_those_of_numpy() -> None:
    rng = np.random.default_rng(0)
    array, order = rng.normal(size=(LARGE, 2)), rng.permutation(LARGE)
    assert np.array_equal(memory.taken(array, order), array[order])
    assert np.array_equal(memory.taken(array[:, 0], order[:9]), array[order[:9], 0])


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere they come from NumPy")
def test_memory_is_counted_and_goes_back() -> None:
    gc.collect()
    before = memory.mapped()
    array = memory.empty(LARGE, np.float32)
    part = array[:5]
    assert memory.mapped() - before == array.nbytes
    del array
    assert memory.mapped() > before  # a view is left
    del part
    assert memory.mapped() == before
    assert memory.empty(10, np.float32).base is None
    assert memory.mapped() == before
