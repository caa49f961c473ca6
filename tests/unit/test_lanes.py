"""Eight numbers at once must be what one number at a time is, to the last bit."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest

from pyverlet.compile.bits import count_bits, distinct_lanes, lowest_bit, write_all, write_chosen
from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import (
    LANES,
    add_lanes,
    copy_row,
    larger,
    load,
    load_rows,
    pick,
    place,
    put,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_above,
    where_zero,
    which_above,
    which_set,
    widen,
)

DTYPES = [np.float32, np.float64]


@kernel
def compute_lanes(a: Any, b: Any, out: Any) -> None:
    for k in range(0, a.shape[0], LANES):
        x, y = load(a, k), load(b, k)
        store(out[0], k, x + y)
        store(out[1], k, x - y)
        store(out[2], k, x * y)
        store(out[3], k, x / y)
        store(out[4], k, square_root(x * x))
        store(out[5], k, larger(x, y))
        store(out[6], k, smaller(x, y))
        store(out[7], k, where_zero(x, y, x))
        store(out[8], k, x * spread(b[0]))


@pytest.mark.parametrize("dtype", DTYPES)
def test_arithmetic_is_that_of_single_numbers(dtype: Any) -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 3, (2, 10 * LANES)).astype(dtype)
    a[3] = 0
    out = np.empty((9, len(a)), dtype)
    compute_lanes(a, b, out)
    expected = (a + b, a - b, a * b, a / b, np.sqrt(a * a), np.maximum(a, b), np.minimum(a, b), np.where(a == 0, b, a), a * b[0])
    for row, right in zip(out, expected, strict=True):
        assert row.tobytes() == right.tobytes()


@kernel
def turn_lanes(points: Any, index: Any) -> None:
    for k in range(0, index.shape[0], LANES):
        x, y = take(points, index, k)
        put(points, index, k, y, x + y)


@pytest.mark.parametrize("dtype", DTYPES)
def test_rows_are_taken_and_put_by_their_index(dtype: Any) -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(0, 1, (50, 2)).astype(dtype)
    index = rng.permutation(50)[: 4 * LANES].astype(np.uint32)
    expected = points.copy()
    expected[index] = np.column_stack((points[index, 1], points[index, 0] + points[index, 1]))
    turn_lanes(points, index)
    assert points.tobytes() == expected.tobytes()


@kernel
def copy_lanes(to: Any, source: Any, index: Any) -> None:
    for k in range(index.shape[0]):
        copy_row(to, k, source, np.int64(index[k]))


@pytest.mark.parametrize("dtype", DTYPES)
def test_rows_are_copied_whole(dtype: Any) -> None:
    rng = np.random.default_rng(4)
    source, index = rng.normal(0, 1, (20, 2)).astype(dtype), rng.permutation(20).astype(np.int32)
    to = np.empty_like(source)
    copy_lanes(to, source, index)
    assert to.tobytes() == source[index].tobytes()
    with pytest.raises(numba.TypingError):  # bits of one dtype are nothing in another
        copy_lanes(to.astype(np.float32 if dtype is np.float64 else np.float64), source, index)


@kernel
def move_lanes(points: Any, numbers: Any, index: Any, limit: Any, above: Any) -> None:
    for k in range(0, points.shape[0], LANES):
        x, y = load_rows(points, k)
        above[k // LANES] = which_above(x, spread(limit))
        place(numbers, index, k, pick(numbers, index, k) + y)


@pytest.mark.parametrize("dtype", DTYPES)
def test_rows_and_numbers_come_lane_by_lane(dtype: Any) -> None:
    rng = np.random.default_rng(2)
    points, numbers = rng.normal(0, 1, (3 * LANES, 2)).astype(dtype), rng.normal(0, 1, 50).astype(dtype)
    index = rng.permutation(50)[: 3 * LANES].astype(np.uint32)
    expected, above = numbers.copy(), np.zeros(3, np.int64)
    expected[index] += points[:, 1]
    move_lanes(points, numbers, index, dtype(0.3), above)
    assert numbers.tobytes() == expected.tobytes()
    bits = (points[:, 0] > dtype(0.3)).reshape(3, LANES)
    assert above.tolist() == [sum(1 << lane for lane in np.flatnonzero(row)) for row in bits]


@kernel
def look_at_bytes(flags: Any, mask: Any, found: Any) -> None:
    for k in range(0, flags.shape[0], LANES):
        found[k // LANES] = which_set(flags, k, mask)


@pytest.mark.parametrize("mask", [1, 2, 0x80, 0xFF])
def test_bytes_are_looked_at_eight_at_a_time(mask: int) -> None:
    flags = np.random.default_rng(4).integers(0, 256, 8 * LANES).astype(np.uint8)
    flags[:LANES] = 0
    found = np.zeros(8, np.int64)
    look_at_bytes(flags, mask, found)
    assert found.tolist() == [sum(1 << lane for lane in np.flatnonzero(row & mask)) for row in flags.reshape(8, LANES)]


@kernel
def sift_lanes(numbers: Any, limit: Any, found: Any, of: Any, lowest: Any) -> int:
    count = 0
    for k in range(0, numbers.shape[0], LANES):
        above = which_above(load(numbers, k), spread(limit))
        write_chosen(found, count, above, k)
        write_all(of, count, k)
        lowest[k // LANES] = lowest_bit(above)
        count += count_bits(above)
    return count


def test_lanes_are_chosen_by_bits() -> None:
    # Each of the 256 ways to choose among eight comes up among 4,096 packs, but for one with probability 256 exp(-16).
    numbers = np.random.default_rng(3).normal(0, 1, 4096 * LANES)
    found, of = (np.zeros(len(numbers) + LANES, np.uint32) for _ in range(2))
    expected = np.flatnonzero(numbers > 0)
    lowest = np.zeros(4096, np.int64)
    assert sift_lanes(numbers, 0.0, found, of, lowest) == len(expected)
    rows = (numbers > 0).reshape(-1, LANES)
    assert lowest[rows.any(axis=1)].tolist() == rows[rows.any(axis=1)].argmax(axis=1).tolist()
    assert found[: len(expected)].tolist() == expected.tolist()
    assert of[: len(expected)].tolist() == (expected // LANES * LANES).tolist()


@kernel
def count_pairs(index: Any, other: Any) -> Any:
    return distinct_lanes(index, other, LANES)


@pytest.mark.parametrize("pairs", range(1, LANES + 1))
def test_a_pack_that_repeats_its_last_pair_counts_it_once(pairs: int) -> None:
    # Pairs of a pack share no circle, so those before the last are all different; what stands before the pack says nothing.
    index, other = np.full((2, 2 * LANES), 5, np.uint32)
    index[LANES:] = [5 + 2 * min(lane, pairs - 1) for lane in range(LANES)]
    other[LANES:] = index[LANES:] + 1
    assert count_pairs(index, other) == pairs
    other[-1] += 100  # the same first circle alone is no repetition
    assert count_pairs(index, other) == LANES


@kernel
def sum_lanes(numbers: Any, count: Any) -> Any:
    return add_lanes(load(numbers, 0), count) + add_lanes(widen(load(numbers, 0)), LANES)


@pytest.mark.parametrize("dtype", DTYPES)
def test_lanes_are_added_in_float64(dtype: Any) -> None:
    numbers = (np.arange(1, LANES + 1) / 3).astype(dtype)
    for count in range(LANES + 1):
        expected = sum(map(float, numbers[:count])) + sum(map(float, numbers))
        assert sum_lanes(numbers, count) == pytest.approx(expected, rel=1e-15)


@kernel
def where_lanes(a: Any, b: Any, out: Any) -> None:
    store(out, 0, where_above(load(a, 0), load(b, 0), load(a, 0) + load(a, 0), load(b, 0)))


@pytest.mark.parametrize("dtype", DTYPES)
def test_where_above(dtype: Any) -> None:
    a, b = np.random.default_rng(5).normal(0, 1, (2, LANES)).astype(dtype)
    a[0], a[1], b[2] = np.nan, np.inf, np.inf  # NaN is above nothing
    out = np.empty(LANES, dtype)
    where_lanes(a, b, out)
    assert out.tobytes() == np.where(a > b, a + a, b).tobytes()
