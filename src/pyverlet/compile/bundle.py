"""Many arrays under one name, handed to kernels, and from kernel to kernel, as a single pointer.

To a compiled function an array is ten numbers and a count of who holds it. A tuple of forty is taken apart whenever Python calls
and copied for every call from kernel to kernel; of a function that took three of them more than half of what compiling took was
that. Numba's structrefs are kept in memory once and handed on.
"""

from __future__ import annotations

from operator import is_
from typing import Any

from llvmlite import ir
from numba import types
from numba.experimental import structref
from numba.extending import intrinsic

from pyverlet.compile.jit import kernel, variant


class _Bundle(types.StructRef):  # type: ignore[misc]
    def preprocess_fields(self, fields: Any) -> Any:
        """A field is what its type says, not the one value it is known to have where it is made."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Held(structref.StructRefProxy):  # type: ignore[misc]
    """What Python holds of a bundle: it, and the arrays in it."""

    arrays: tuple[Any, ...]

    def __reduce__(self) -> Any:
        """A copy is of copies of the arrays."""
        return hold, (type(self), self.arrays)


def bundle(described: type) -> Any:
    """What a class with annotations describes, in that order: made by `hold`, read by compiled code."""
    kind = structref.register(type("Type", (_Bundle,), {"__module__": described.__module__}))
    kind.__qualname__ = f"{described.__qualname__}.Type"  # compiled code is kept on disk under the names of its types
    about = {name: getattr(described, name) for name in ("__module__", "__qualname__", "__doc__")}
    held: Any = type(described.__name__, (_Held,), {**about, "Type": kind})
    structref.define_constructor(held, kind, list(described.__annotations__))
    structref.define_boxing(kind, held)
    held.make = kernel(variant(make, described.__name__, Bundle=held))
    return held


def hold(described: Any, arrays: tuple[Any, ...], before: Any = None) -> Any:
    """A bundle of these arrays, or bundles, which its attribute `arrays` keeps; the one `before` if that is of the same.

    It is an argument by itself: a tuple that held it would have its type looked up anew in each call, 250 us.
    """
    if before is not None and all(map(is_, arrays, before.arrays)):
        return before
    made = described.make(*arrays)
    made.arrays = arrays
    return made


Bundle: Any = None
"""What `make` makes."""


def make(*arrays):  # type: ignore[no-untyped-def]
    """A bundle, the arrays of which somebody else holds."""
    return Bundle(*_borrowed(arrays))


@intrinsic  # type: ignore[untyped-decorator]
def _borrowed(typing: Any, arrays: Any) -> Any:
    """The same, but of arrays that are held by whoever holds those: nobody counts who reads them out of a bundle.

    To count is an atomic operation, twice for each array that a function reads: more than a small strip of pairs takes.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lent = []
        for k, kind in enumerate(arrays):
            lent.append(builder.extract_value(args[0], k))
            if isinstance(kind, types.Array):
                array = context.make_array(kind)(context, builder, lent[k])
                array.meminfo, array.parent = (ir.Constant(given.type, None) for given in (array.meminfo, array.parent))
                lent[k] = array._getvalue()
        given = context.make_tuple(builder, arrays, lent)
        context.nrt.incref(builder, arrays, given)
        return given

    return arrays(arrays), generate
