"""Which lanes are set in a number: how many, the lowest, and their numbers written one after another."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pyverlet.compile.lanes import ALL, LANES, order, pointer

_INT32, _INT64 = ir.IntType(32), ir.IntType(64)


@intrinsic  # type: ignore[untyped-decorator]
def count_bits(typing: Any, bits: Any) -> Any:
    """How many bits of a number are set."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.ctpop(args[0])

    return bits(bits), generate


@intrinsic  # type: ignore[untyped-decorator]
def lowest_bit(typing: Any, bits: Any) -> Any:
    """The number of the lowest bit of a number that is set; how many bits it has if none is."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 0))

    return bits(bits), generate


@intrinsic  # type: ignore[untyped-decorator]
def write_chosen(typing: Any, array: Any, where: Any, bits: Any, first: Any) -> Any:
    """array[where], array[where + 1], ... = first + the number of each lane that is set in `bits`, on an (n,) array of 32 bits.

    LANES items are written, whatever they are behind the chosen ones: cheaper than to ask of each lane whether it counts.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector, rows = ir.VectorType(_INT32, LANES), 1 << LANES
        picked = [[lane for lane in range(LANES) if row >> lane & 1] for row in range(rows)]
        table = ir.Constant(ir.ArrayType(vector, rows), [ir.Constant(vector, (p + [0] * LANES)[:LANES]) for p in picked])
        place = cgutils.global_constant(builder, "lanes chosen by bits", table)
        chosen = builder.load(builder.gep(place, [ir.Constant(_INT64, 0), args[2]]))
        written = builder.store(
            builder.add(chosen, _spread_int(builder, args[3])), pointer(context, builder, array, args[0], args[1], vector)
        )
        written.align = 4
        return context.get_dummy_value()

    return types.void(array, where, bits, first), generate


@intrinsic  # type: ignore[untyped-decorator]
def write_all(typing: Any, array: Any, where: Any, value: Any) -> Any:
    """array[where : where + LANES] = value, on an (n,) array of 32 bits."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = ir.VectorType(_INT32, LANES)
        written = builder.store(_spread_int(builder, args[2]), pointer(context, builder, array, args[0], args[1], vector))
        written.align = 4
        return context.get_dummy_value()

    return types.void(array, where, value), generate


@intrinsic  # type: ignore[untyped-decorator]
def which_are(typing: Any, array: Any, k: Any, value: Any) -> Any:
    """The lanes in which array[k : k + LANES] is `value`, of an (n,) array of 32 bits; as the bits of a number."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        found = builder.load(pointer(context, builder, array, args[0], args[1], ir.VectorType(_INT32, LANES)))
        found.align = 4
        same = builder.icmp_unsigned("==", found, _spread_int(builder, args[2]))
        return builder.zext(builder.bitcast(same, ir.IntType(LANES)), _INT64)

    return types.int64(array, k, value), generate


@intrinsic  # type: ignore[untyped-decorator]
def store_bits(typing: Any, array: Any, k: Any, bits: Any) -> Any:
    """array[k : k + LANES] = 1 for the lanes that are set in `bits`, else 0, on an (n,) array of uint8."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        eight = ir.VectorType(ir.IntType(8), LANES)
        some = builder.bitcast(builder.trunc(args[2], ir.IntType(LANES)), ir.VectorType(ir.IntType(1), LANES))
        builder.store(builder.zext(some, eight), pointer(context, builder, array, args[0], args[1], eight)).align = 1
        return context.get_dummy_value()

    return types.void(array, k, bits), generate


@intrinsic  # type: ignore[untyped-decorator]
def distinct_lanes(typing: Any, index: Any, other: Any, k: Any) -> Any:
    """How many pairs a pack, from lane k on of both, holds before it repeats its last one to be full."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        eight, before, alike = ir.VectorType(_INT32, LANES), order([0, *range(LANES - 1)]), None
        for array, value in ((index, args[0]), (other, args[1])):
            numbers = builder.load(pointer(context, builder, array, value, args[2], eight))
            numbers.align = 4
            same = builder.icmp_unsigned("==", numbers, builder.shuffle_vector(numbers, numbers, before))
            alike = same if alike is None else builder.and_(alike, same)
        bits = builder.and_(builder.bitcast(alike, ir.IntType(LANES)), ir.Constant(ir.IntType(LANES), ALL - 1))
        repeated = builder.zext(builder.ctlz(builder.not_(bits), ir.Constant(ir.IntType(1), 0)), _INT64)
        return builder.sub(ir.Constant(_INT64, LANES), repeated)

    return types.int64(index, other, k), generate


def _spread_int(builder: Any, value: Any) -> Any:
    empty = ir.Constant(ir.VectorType(_INT32, LANES), ir.Undefined)
    first = builder.insert_element(empty, builder.trunc(value, _INT32), ir.Constant(_INT32, 0))
    return builder.shuffle_vector(first, empty, order([0] * LANES))
