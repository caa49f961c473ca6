"""Many arrays under one name, handed from kernel to kernel as a single pointer.

To a compiled function an array is ten numbers and a count of who holds it. A tuple of forty is copied for every call, which in a
world of ten circles takes longer than what is called does. Numba's structrefs are kept in memory once and handed on.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.experimental import structref
from numba.extending import intrinsic


class _Bundle(types.StructRef):  # type: ignore[misc]
    def preprocess_fields(self, fields: Any) -> Any:
        """A field is what its type says, not the one value it is known to have where it is made."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


def bundle(described: type) -> Any:
    """What a class with annotations describes, to be made and read by them in compiled code.

    Reading a field counts who holds the array: outside of inner loops.
    """
    kind = structref.register(type("Type", (_Bundle,), {"__module__": described.__module__}))
    kind.__qualname__ = f"{described.__qualname__}.Type"  # compiled code is kept on disk under the names of its types
    described.Type = kind  # type: ignore[attr-defined]
    structref.define_constructor(described, kind, fields(described))
    return described


@intrinsic  # type: ignore[untyped-decorator]
def borrowed(typing: Any, arrays: Any) -> Any:
    """A tuple of the same arrays, held by whoever holds those: of these nobody counts who reads them out of a bundle.

    To count is an atomic operation, twice for each array that a function reads: more than a small strip of pairs takes.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lent = []
        for k, kind in enumerate(arrays):
            array = context.make_array(kind)(context, builder, builder.extract_value(args[0], k))
            array.meminfo, array.parent = (ir.Constant(given.type, None) for given in (array.meminfo, array.parent))
            lent.append(array._getvalue())
        return context.make_tuple(builder, arrays, lent)

    return arrays(arrays), generate


def fields(described: type) -> list[str]:
    """Names of what is in a bundle, in order."""
    return list(described.__annotations__)
