"""The short way into kernels: the same results as Numba's own, for whatever it is given."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError

from pyverlet.compile import entry, jit
from pyverlet.compile.jit import kernel, parallel_kernel, prange


@kernel
def total(values: Any, factor: Any) -> Any:
    found = factor - factor
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            found += factor * values[i, j]
    return found


@kernel
def describe(values: Any, whole: Any, real: Any, flag: Any) -> Any:
    return values.shape[0] + whole, real, flag


@parallel_kernel
def spread(out: Any, value: Any) -> None:
    for i in prange(out.shape[0]):
        out[i] = value + i


def test_objects_lie_in_memory_as_expected() -> None:
    # If this fails with a new Python or NumPy, everything still works, by the long way.
    assert entry.usable()


def test_kernels_are_built_in_functions_after_their_first_call() -> None:
    values = np.arange(6, dtype=np.float32).reshape(3, 2)
    assert total(values, np.float32(2)) == 30
    assert type(total.func).__name__ == "builtin_function_or_method"  # type: ignore[attr-defined]
    before = total.func  # type: ignore[attr-defined]
    assert total(values + 1, np.float32(2)) == 42
    assert total.func is before  # type: ignore[attr-defined]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_any_array_is_taken(dtype: type) -> None:
    values: Any = np.arange(24, dtype=dtype).reshape(6, 4)
    frozen = values.copy()
    frozen.flags.writeable = False
    for array in (values, values[::2], values[:, 1:3], values.T, np.asfortranarray(values), frozen, values[:0], values[:1]):
        assert total(array, dtype(0.5)) == 0.5 * array.sum()
    odd: Any = np.frombuffer(b"x" + values.tobytes(), dtype, offset=1).reshape(values.shape)
    assert not odd.flags.aligned
    assert total(odd, dtype(0.5)) == 0.5 * values.sum()


def test_numbers_of_any_kind_are_taken() -> None:
    values = np.ones((2, 2))
    for whole in (0, 1, -1, 2**31, -(2**40), 2**62, np.int64(-7), True):
        for real in (0.5, np.float32(0.25), np.float64(-2.0), 3):
            for flag in (True, False):
                assert describe(values, whole, real, flag) == (2 + whole, real, flag)


def test_wrong_arguments_are_refused_not_read() -> None:
    values: Any = np.ones((2, 2))
    assert total(values, 1.0) == 4
    for wrong in ((values,), (values, 1.0, 2.0), (None, 1.0), ("values", 1.0), (values, "1"), ([1.0], 1.0)):
        with pytest.raises((TypeError, TypingError)):
            total(*wrong)
    assert total(values, 1.0) == 4


def test_one_thread_takes_the_plain_loop_and_several_the_parallel_one() -> None:
    out = np.zeros(1000)
    jit.use_threads(1)
    spread(out, 1.0)
    assert [*spread._made] == ["alone"]
    expected = out.copy()
    if jit.max_threads() > 1:
        jit.use_threads(2)
        out[:] = 0
        spread(out, 1.0)
        assert "parallel" in spread._made
        assert np.array_equal(out, expected)
        jit.use_threads(1)
        spread(out, 2.0)
        assert np.array_equal(out, expected + 1)


def test_calls_hold_on_to_nothing() -> None:
    values, factor = np.ones((5, 2)), 1.5
    total(values, factor)
    before = sys.getrefcount(values), sys.getrefcount(factor), sys.getrefcount(None)
    for _ in range(1000):
        total(values, factor)
        spread(np.zeros(3), factor)
    after = sys.getrefcount(values), sys.getrefcount(factor), sys.getrefcount(None)
    assert all(abs(a - b) < 100 for a, b in zip(after, before, strict=True))
