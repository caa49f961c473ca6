"""Fields: what they let through, and the sentence for what they do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pyverlet.ground.errors import InputError
from pyverlet.ground.fields import Field

REAL = np.dtype(np.float32)
NAN, INF = np.nan, np.inf


def check(field: Field, values: Any, dtype: Any = None, **sizes: int) -> None:
    field.check("it", np.array(values, REAL if dtype is None else dtype), REAL, dict(sizes))


@pytest.mark.parametrize(
    ("field", "values", "dtype"),
    [
        (Field(None, "n", above=0), [1, 2.5], None),
        (Field(None, "n", above=0, infinite=True), [1, INF], None),
        (Field(None, "n", 2, nan=True), [(1, 2), (NAN, NAN)], None),
        (Field(None, "n", 2), np.empty((0, 2)), None),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [2, 0, 1], np.int32),
        (Field(np.int64, "n", order="ascending"), [-1, 3, 7], np.int64),
        (Field(np.int64, "n", order="rising"), [3, 3, 7], np.int64),
    ],
)
def test_what_is_right(field: Field, values: Any, dtype: Any) -> None:
    check(field, values, dtype)


@pytest.mark.parametrize(
    ("field", "values", "dtype", "said"),
    [
        (Field(None, "n", above=0), [1, 0], None, "it has 0; allowed is greater than 0"),
        (Field(None, "n", above=0), [1, NAN], None, r"it\[1\] is nan"),
        (Field(None, "n"), [-INF, 1], None, r"it\[0\] is -inf"),
        (Field(None, "n", above=0, infinite=True), [-INF, INF], None, "it has -inf"),
        (Field(None, "n", infinite=True), [INF, NAN], None, r"it\[1\] is nan"),
        (Field(None, "n", 2, nan=True), [(1, NAN), (NAN, NAN)], None, r"it\[0\]"),
        (Field(None, "n", 2, nan=True), [(INF, 1), (NAN, NAN)], None, r"it\[0\]"),
        (Field(None, "n"), [1, 2], np.float64, "float64 of shape .2,.; allowed is float32"),
        (Field(None, "n", 2), [1, 2], None, r"shape \(2,\); allowed is float32 of shape \(2, 2\)"),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [2, 0, 2], np.int32, "it lacks 1"),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [3, 0, 1], np.int32, "it has 3; allowed is .*at most 2"),
        (Field(np.int64, "n", order="ascending"), [3, 3], np.int64, r"it\[1\] is less"),
        (Field(np.int64, "n", order="rising"), [3, 2], np.int64, r"it\[1\] is less"),
    ],
)
def test_what_is_wrong(field: Field, values: Any, dtype: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check(field, values, dtype)


def test_equal_names_are_equal_lengths() -> None:
    sizes: dict[str, int] = {}
    Field(None, "n").check("one", np.zeros(3, REAL), REAL, sizes)
    with pytest.raises(InputError, match="other is"):
        Field(None, "n").check("other", np.zeros(4, REAL), REAL, sizes)
    assert sizes == {"n": 3}
