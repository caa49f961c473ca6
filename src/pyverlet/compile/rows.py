"""Rows of four numbers, of eight places at once: what one circle brings to a contact comes, and goes, in one piece.

To fetch eight single numbers from eight places takes as long as to fetch eight rows. So what is read together lies together.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from pyverlet.compile.lanes import LANES, LanesType, order, pointer, pointers, unmerged

WIDTH = 4

_HALF = LANES // 2

# Of two vectors [a0 b0 c0 d0 a4 b4 c4 d4] and [a1 b1 c1 d1 a5 b5 c5 d5]: their first, or last, two columns; then whole ones of
# two of those. Numbers stay in their half of the register, which processors like.
_FIRST, _LAST = order([0, 8, 1, 9, 4, 12, 5, 13]), order([2, 10, 3, 11, 6, 14, 7, 15])
_LOW, _HIGH = order([0, 1, 8, 9, 4, 5, 12, 13]), order([2, 3, 10, 11, 6, 7, 14, 15])


def _columns(builder: Any, rows: list[Any]) -> list[Any]:
    """Four vectors of eight from eight rows of four."""
    both = order(range(LANES))
    pairs = [builder.shuffle_vector(rows[k], rows[k + _HALF], both) for k in range(_HALF)]
    columns = []
    for part in (_FIRST, _LAST):
        a, b = (builder.shuffle_vector(pairs[k], pairs[k + 1], part) for k in (0, 2))
        columns += [builder.shuffle_vector(a, b, half) for half in (_LOW, _HIGH)]
    return columns


def _rows(builder: Any, columns: Any) -> list[Any]:
    """Eight rows of four from four vectors of eight."""
    a, b, c, d = columns
    pairs = []
    for part in (_FIRST, _LAST):
        ab, cd = builder.shuffle_vector(a, b, part), builder.shuffle_vector(c, d, part)
        pairs += [unmerged(builder, builder.shuffle_vector(ab, cd, half)) for half in (_LOW, _HIGH)]
    empty = ir.Constant(pairs[0].type, ir.Undefined)
    halves = order(range(_HALF)), order(range(_HALF, LANES))
    return [builder.shuffle_vector(pair, empty, half) for half in halves for pair in pairs]


@intrinsic  # type: ignore[untyped-decorator]
def take_four(typing: Any, array: Any, index: Any, k: Any) -> Any:
    """The columns of the rows index[k : k + LANES] of an (n, WIDTH) array in C order; index: unsigned."""
    four = types.UniTuple(LanesType(array.dtype), WIDTH)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = [builder.load(row) for row in pointers(context, builder, array, index, args, WIDTH)]
        for row in rows:
            row.align = array.dtype.bitwidth // 8
        return context.make_tuple(builder, four, _columns(builder, rows))

    return four(array, index, k), generate


@intrinsic  # type: ignore[untyped-decorator]
def put_four(typing: Any, array: Any, index: Any, k: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Rows index[k : k + LANES] of an (n, WIDTH) array = (a, b, c, d). Lanes of one row must hold the same values."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        places = pointers(context, builder, array, index, args, WIDTH)
        for place, row in zip(places, _rows(builder, args[3:]), strict=True):
            builder.store(row, place).align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, index, k, a, b, c, d), generate


def _consecutive(context: Any, builder: Any, array: Any, args: Any) -> list[Any]:
    """Pointers to the rows k, k + 1, ..."""
    row = ir.VectorType(context.get_value_type(array.dtype), WIDTH)
    first = builder.mul(args[1], ir.Constant(args[1].type, WIDTH))
    start = pointer(context, builder, array, args[0], first, row)
    return [builder.gep(start, [ir.Constant(ir.IntType(64), lane)]) for lane in range(LANES)]


@intrinsic  # type: ignore[untyped-decorator]
def load_four(typing: Any, array: Any, k: Any) -> Any:
    """The columns of the rows array[k : k + LANES] of an (n, WIDTH) array in C order."""
    four = types.UniTuple(LanesType(array.dtype), WIDTH)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = [builder.load(row) for row in _consecutive(context, builder, array, args)]
        for row in rows:
            row.align = array.dtype.bitwidth // 8
        return context.make_tuple(builder, four, _columns(builder, rows))

    return four(array, k), generate


@intrinsic  # type: ignore[untyped-decorator]
def store_four(typing: Any, array: Any, k: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Rows array[k : k + LANES] of an (n, WIDTH) array = (a, b, c, d)."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        for place, row in zip(_consecutive(context, builder, array, args), _rows(builder, args[2:]), strict=True):
            builder.store(row, place).align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, k, a, b, c, d), generate


@intrinsic  # type: ignore[untyped-decorator]
def store_rows(typing: Any, array: Any, k: Any, x: Any, y: Any) -> Any:
    """Rows array[k : k + LANES] of an (n, 2) array in C order = (x, y)."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        turns = order(lane + LANES * axis for lane in range(LANES) for axis in range(2))
        rows = builder.shuffle_vector(args[2], args[3], turns)
        first = builder.shl(args[1], ir.Constant(args[1].type, 1))
        builder.store(rows, pointer(context, builder, array, args[0], first, rows.type)).align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, k, x, y), generate
