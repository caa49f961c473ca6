"""Eight numbers at once: a type for kernels whose values the processor adds, multiplies and compares in one instruction.

Inside a kernel `take` and `load` give Lanes; + - * / and the functions here work on them lane by lane, with the same rounding as
on single numbers; `put` and `store` write them back. The compiler cannot do this by itself where rows are chosen by an index: it
would have to know that no two lanes write to the same row. Whoever calls `put` knows.

Machines whose registers are narrower than eight numbers get the same bits from several instructions.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 8

ALL = (1 << LANES) - 1
"""What `which_above` gives if it is so in every lane."""

ANY = 0xFF
"""Any bit of a byte."""

_INT32, _INT64 = ir.IntType(32), ir.IntType(64)


class LanesType(types.Type):  # type: ignore[misc]
    """What Numba calls LANES numbers of one floating type."""

    def __init__(self, real: Any) -> None:
        self.real = real
        super().__init__(name=f"Lanes({real})")

    @property
    def key(self) -> Any:
        return self.real


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: Any) -> None:
        super().__init__(manager, lanes, ir.VectorType(manager.lookup(lanes.real).get_value_type(), LANES))


_TYPES = (LanesType(types.float32), LanesType(types.float64))


def _operator(symbol: Callable[..., Any], instruction: str) -> None:
    """Teach Numba one of + - * / between lanes."""

    @infer_global(symbol)
    class _Typed(ConcreteTemplate):  # type: ignore[misc]
        cases = [signature(lanes, lanes, lanes) for lanes in _TYPES]  # noqa: RUF012

    for lanes in _TYPES:

        @lower_builtin(symbol, lanes, lanes)  # type: ignore[untyped-decorator]
        def _lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return getattr(builder, instruction)(*args)


for _symbol, _instruction in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv"),
):  # fmt: skip
    _operator(_symbol, _instruction)


def order(lanes: Any) -> Any:
    """Which lanes a shuffle picks."""
    lanes = list(lanes)
    return ir.Constant(ir.VectorType(_INT32, len(lanes)), lanes)


@intrinsic  # type: ignore[untyped-decorator]
def spread(typing: Any, value: Any) -> Any:
    """One number in every lane."""
    lanes = LanesType(value)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        empty = ir.Constant(context.get_value_type(lanes), ir.Undefined)
        first = builder.insert_element(empty, args[0], ir.Constant(_INT32, 0))
        return builder.shuffle_vector(first, empty, order([0] * LANES))

    return lanes(value), generate


def _function(name: str) -> Any:
    @intrinsic  # type: ignore[untyped-decorator]
    def function(typing: Any, a: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            kind, full = ir.FunctionType(args[0].type, [args[0].type]), f"llvm.{name}.v{LANES}f{a.real.bitwidth}"
            return builder.call(cgutils.get_or_insert_function(builder.module, kind, full), args)

        return a(a), generate

    return function


square_root, nearest_whole = _function("sqrt"), _function("rint")
"""Lane by lane: the square root, and the nearest whole number, the even one of two."""


def _chosen(comparison: str) -> Any:
    @intrinsic  # type: ignore[untyped-decorator]
    def choose(typing: Any, a: Any, b: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(comparison, *args), *args)

        return a(a, b), generate

    return choose


larger = _chosen(">")
"""The larger of two, lane by lane."""

smaller = _chosen("<")
"""The smaller of two, lane by lane."""


@intrinsic  # type: ignore[untyped-decorator]
def larger_finite(typing: Any, a: Any, b: Any) -> Any:
    """The larger of two single numbers, neither NaN: knowing that, the compiler seeks the largest of many eight at a time."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        promise = ("nnan", "nsz")
        return builder.select(builder.fcmp_ordered(">", *args, flags=promise), *args, flags=promise)

    return a(a, b), generate


@intrinsic  # type: ignore[untyped-decorator]
def where_zero(typing: Any, test: Any, a: Any, b: Any) -> Any:
    """a where test is 0, b elsewhere."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        zero = ir.Constant(context.get_value_type(test), None)
        return builder.select(builder.fcmp_ordered("==", args[0], zero), args[1], args[2])

    return a(test, a, b), generate


@intrinsic  # type: ignore[untyped-decorator]
def where_above(typing: Any, test: Any, limit: Any, a: Any, b: Any) -> Any:
    """a where test > limit, b elsewhere."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3])

    return a(test, limit, a, b), generate


@intrinsic  # type: ignore[untyped-decorator]
def where_set(typing: Any, bits: Any, a: Any, b: Any) -> Any:
    """a in the lanes whose bit is set, b elsewhere."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        chosen = builder.bitcast(builder.trunc(args[0], ir.IntType(LANES)), ir.VectorType(ir.IntType(1), LANES))
        return builder.select(chosen, args[1], args[2])

    return a(bits, a, b), generate


@intrinsic  # type: ignore[untyped-decorator]
def widen(typing: Any, a: Any) -> Any:
    """The same numbers in float64."""
    wide = LanesType(types.float64)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return args[0] if a == wide else builder.fpext(args[0], context.get_value_type(wide))

    return wide(a), generate


@intrinsic  # type: ignore[untyped-decorator]
def add_lanes(typing: Any, a: Any, lanes: Any) -> Any:
    """The sum, in float64, of the first so many lanes, one after the other."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        wide, total = ir.DoubleType(), ir.Constant(ir.DoubleType(), 0.0)
        for lane in range(LANES):
            value = builder.extract_element(args[0], ir.Constant(_INT32, lane))
            value = value if value.type == wide else builder.fpext(value, wide)
            counts = builder.icmp_signed(">", args[1], ir.Constant(args[1].type, lane))
            total = builder.fadd(total, builder.select(counts, value, ir.Constant(wide, 0.0)))
        return total

    return types.float64(a, lanes), generate


@intrinsic  # type: ignore[untyped-decorator]
def which_above(typing: Any, a: Any, b: Any) -> Any:
    """The lanes in which a > b, as the bits of a number: 1 for the first."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(builder.fcmp_ordered(">", *args), ir.IntType(LANES))
        return builder.zext(bits, _INT64)

    return types.int64(a, b), generate


@intrinsic  # type: ignore[untyped-decorator]
def which_set(typing: Any, array: Any, k: Any, mask: Any) -> Any:
    """The lanes in which array[k : k + LANES] & mask is not 0, of an (n,) array of uint8; as the bits of a number."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        byte = ir.IntType(8)
        eight = ir.VectorType(byte, LANES)
        value = builder.load(pointer(context, builder, array, args[0], args[1], eight))
        value.align = 1
        asked = builder.insert_element(ir.Constant(eight, ir.Undefined), builder.trunc(args[2], byte), ir.Constant(_INT32, 0))
        asked = builder.shuffle_vector(
            asked, ir.Constant(eight, ir.Undefined), ir.Constant(ir.VectorType(_INT32, LANES), [0] * LANES)
        )
        some = builder.icmp_unsigned("!=", builder.and_(value, asked), ir.Constant(eight, [0] * LANES))
        return builder.zext(builder.bitcast(some, ir.IntType(LANES)), _INT64)

    return types.int64(array, k, types.int64), generate


def pointer(context: Any, builder: Any, array: Any, value: Any, index: Any, item: Any) -> Any:
    """To array[index], as if the array were of `item`s."""
    data = context.make_array(array)(context, builder, value).data
    return builder.bitcast(builder.gep(data, [index]), item.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(typing: Any, array: Any, k: Any) -> Any:
    """array[k : k + LANES] of an (n,) array."""
    lanes = LanesType(array.dtype)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = builder.load(pointer(context, builder, array, args[0], args[1], context.get_value_type(lanes)))
        value.align = array.dtype.bitwidth // 8
        return value

    return lanes(array, k), generate


@intrinsic  # type: ignore[untyped-decorator]
def store(typing: Any, array: Any, k: Any, value: Any) -> Any:
    """array[k : k + LANES] = value, on an (n,) array."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        written = builder.store(args[2], pointer(context, builder, array, args[0], args[1], context.get_value_type(value)))
        written.align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, k, value), generate


@intrinsic  # type: ignore[untyped-decorator]
def load_rows(typing: Any, array: Any, k: Any) -> Any:
    """(x, y) of the rows array[k : k + LANES] of an (n, 2) array in C order."""
    lanes = LanesType(array.dtype)
    both = types.UniTuple(lanes, 2)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        real = context.get_value_type(array.dtype)
        first = builder.shl(args[1], ir.Constant(args[1].type, 1))
        rows = builder.load(pointer(context, builder, array, args[0], first, ir.VectorType(real, 2 * LANES)))
        rows.align = array.dtype.bitwidth // 8
        return context.make_tuple(builder, both, _columns(builder, rows))

    return both(array, k), generate


def _columns(builder: Any, rows: Any) -> list[Any]:
    """The eight x and the eight y of eight rows that follow each other."""
    empty = ir.Constant(rows.type, ir.Undefined)
    return [builder.shuffle_vector(rows, empty, order(range(axis, 2 * LANES, 2))) for axis in range(2)]


_TURNS = {
    32: (((0, 1, 4, 5), (2, 3, 6, 7)), (0, 2, 8, 10, 4, 6, 12, 14)),
    64: (((0, 2), (1, 3), (4, 6), (5, 7)), (0, 4, 2, 6)),
}
"""By the bits of a number: which lanes' rows of two stand in each register, and where the x of each lane is in two registers, one
after the other. So no number has to leave its half of a register when they become columns, or columns rows: that takes twice as
many instructions, of the slower kind."""


def unmerged(builder: Any, vector: Any) -> Any:
    """The same, and LLVM does not look through it: shuffles that rows are to share it would else do again for each of them."""
    if "x86_64" not in str(builder.module.triple):  # there few shuffles can be done at a time
        return vector
    kind, bits = ir.FunctionType(vector.type, [vector.type]), 32 if vector.type.element == ir.FloatType() else 64
    fence = cgutils.get_or_insert_function(builder.module, kind, f"llvm.arithmetic.fence.v{vector.type.count}f{bits}")
    return builder.call(fence, [vector])


def _joined(builder: Any, parts: list[Any]) -> Any:
    """Vectors of one length, one after the other."""
    while len(parts) > 1:
        double = order(range(2 * parts[0].type.count))
        parts = [builder.shuffle_vector(a, b, double) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def pointers(context: Any, builder: Any, array: Any, index: Any, args: Any, width: int = 2) -> list[Any]:
    """Pointers to the rows, or numbers, index[k], index[k + 1], ... of an (n, width), or (n,), array."""
    zero, real = ir.Constant(_INT64, 0), context.get_value_type(array.dtype)
    start = pointer(context, builder, array, args[0], zero, ir.VectorType(real, width) if array.ndim == 2 else real)
    first = pointer(context, builder, index, args[1], args[2], context.get_value_type(index.dtype))
    numbers = [builder.load(builder.gep(first, [ir.Constant(_INT64, lane)])) for lane in range(LANES)]
    return [builder.gep(start, [builder.zext(number, _INT64)]) for number in numbers]


@intrinsic  # type: ignore[untyped-decorator]
def take(typing: Any, array: Any, index: Any, k: Any) -> Any:
    """(x, y) of the rows index[k : k + LANES] of an (n, 2) array in C order; index: unsigned."""
    lanes = LanesType(array.dtype)
    both = types.UniTuple(lanes, 2)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows, (registers, even) = [], _TURNS[array.dtype.bitwidth]
        for row in pointers(context, builder, array, index, args):
            rows.append(builder.load(row))
            rows[-1].align = array.dtype.bitwidth // 8
        held = [_joined(builder, [rows[lane] for lane in lanes]) for lanes in registers]
        twos, turns = [*zip(held[::2], held[1::2], strict=True)], (order(axis + place for place in even) for axis in range(2))
        columns = [_joined(builder, [builder.shuffle_vector(*two, turn) for two in twos]) for turn in turns]
        return context.make_tuple(builder, both, columns)

    return both(array, index, k), generate


@intrinsic  # type: ignore[untyped-decorator]
def put(typing: Any, array: Any, index: Any, k: Any, x: Any, y: Any) -> Any:
    """Rows index[k : k + LANES] of an (n, 2) array = (x, y). Lanes of one row must hold the same value."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        places, (registers, _) = pointers(context, builder, array, index, args), _TURNS[array.dtype.bitwidth]
        single, double = array.dtype == types.float32, ir.DoubleType()
        for lanes in registers:
            turn = order(lane + LANES * axis for lane in lanes for axis in range(2))
            turned = unmerged(builder, builder.shuffle_vector(*args[3:5], turn))
            if single:  # a row is as long as a float64, and is stored as one, from either half of a register
                turned = builder.bitcast(turned, ir.VectorType(double, len(lanes)))
            for number, lane in enumerate(lanes):
                if single:
                    row = builder.extract_element(turned, ir.Constant(_INT32, number))
                    written = builder.store(row, builder.bitcast(places[lane], double.as_pointer()))
                else:
                    row = builder.shuffle_vector(turned, turned, order([2 * number, 2 * number + 1]))
                    written = builder.store(row, places[lane])
                written.align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, index, k, x, y), generate


@intrinsic  # type: ignore[untyped-decorator]
def copy_row(typing: Any, array: Any, k: Any, source: Any, i: Any) -> Any:
    """array[k] = source[i] for two (n, 2) arrays of one type: one load and one store."""
    if array.dtype != source.dtype:
        return None  # does not compile

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        row = ir.VectorType(context.get_value_type(array.dtype), 2)
        to, start = (pointer(context, builder, a, args[n], ir.Constant(_INT64, 0), row) for n, a in ((0, array), (2, source)))
        value = builder.load(builder.gep(start, [args[3]]))
        written = builder.store(value, builder.gep(to, [args[1]]))
        value.align = written.align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, k, source, i), generate


@intrinsic  # type: ignore[untyped-decorator]
def pick(typing: Any, array: Any, index: Any, k: Any) -> Any:
    """array[index[k : k + LANES]] of an (n,) array; index: unsigned."""
    lanes = LanesType(array.dtype)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = ir.Constant(context.get_value_type(lanes), ir.Undefined)
        for lane, item in enumerate(pointers(context, builder, array, index, args)):
            value = builder.insert_element(value, builder.load(item), ir.Constant(_INT32, lane))
        return value

    return lanes(array, index, k), generate


@intrinsic  # type: ignore[untyped-decorator]
def place(typing: Any, array: Any, index: Any, k: Any, value: Any) -> Any:
    """array[index[k : k + LANES]] = value, on an (n,) array. Lanes of one item must hold the same value."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        for lane, item in enumerate(pointers(context, builder, array, index, args)):
            builder.store(builder.extract_element(args[3], ir.Constant(_INT32, lane)), item)
        return context.get_dummy_value()

    return types.void(array, index, k, value), generate
