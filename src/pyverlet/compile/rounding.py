"""From one precision to that of a kernel's arrays, where there is no array to do it."""

from __future__ import annotations

from typing import Any

from numba.extending import intrinsic

from pyverlet.compile.lanes import LanesType


@intrinsic  # type: ignore[untyped-decorator]
def rounded(typing: Any, value: Any, like: Any) -> Any:
    """The number `value`, in the dtype of `like`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.cast(builder, args[0], value, like)

    return like(value, like), generate


@intrinsic  # type: ignore[untyped-decorator]
def lanes_like(typing: Any, a: Any, array: Any) -> Any:
    """The same numbers in the dtype of an array, rounded where that holds fewer digits."""
    like = LanesType(array.dtype)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if a == like:
            return args[0]
        change = builder.fpext if a.real.bitwidth < like.real.bitwidth else builder.fptrunc
        return change(args[0], context.get_value_type(like))

    return like(a, array), generate
