"""From float64 back to what a kernel's arrays hold, where there is no array to do it."""

from __future__ import annotations

from typing import Any

from numba.extending import intrinsic


@intrinsic  # type: ignore[untyped-decorator]
def rounded(typing: Any, value: Any, like: Any) -> Any:
    """The number `value`, in the dtype of `like`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.cast(builder, args[0], value, like)

    return like(value, like), generate
