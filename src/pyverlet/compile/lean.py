"""What Numba does on the way to a kernel and nobody needs, left out: a third of the time that a first start takes.

- A kernel has in it all that it calls, and the bodies of its loops over threads. Numba optimises each of these by itself, and
  makes machine code of it, before it puts them all together and does so again. Only what is called from outside needs that.
- Loops over threads are those that say `prange`. Others are looked for in vain.
- Whether two sets of options are equal is asked a hundred thousand times, and each time a table is made of all options of both.

Only while our kernels compile: a user's own functions are compiled as ever. What a version of Numba does not have is left alone.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen
from numba.core.targetconfig import TargetConfig

PRANGE_ONLY = dict.fromkeys(("comprehension", "reduction", "inplace_binop", "setitem", "numpy", "stencil", "fusion"), False)
"""Of what Numba may spread over threads."""

_wanted: str | None = None
_hashes: dict[Any, int] = {}


@contextlib.contextmanager
def only(name: str) -> Iterator[None]:
    """Optimise the function of this name, and make machine code of it, but of none that is put into it; "": of none at all."""
    global _wanted
    before, _wanted = _wanted, name
    try:
        with contextlib.ExitStack() as changes:
            if before is None:  # the outermost
                for owner, method, other in _CHANGES:
                    changes.enter_context(_changed(owner, method, other))
            yield
    finally:
        _wanted = before


@contextlib.contextmanager
def _changed(owner: Any, method: str, other: Callable[..., Any]) -> Iterator[None]:
    as_it_was = vars(owner).get(method)
    if as_it_was is None:
        yield
        return
    setattr(owner, method, lambda self, *arguments: other(as_it_was, self, *arguments))
    try:
        yield
    finally:
        setattr(owner, method, as_it_was)


def _optimise(as_it_was: Callable[..., Any], library: Any) -> None:
    if library.name == _wanted:
        as_it_was(library)


def _finalise(as_it_was: Callable[..., Any], library: Any) -> None:
    if library.name == _wanted:
        as_it_was(library)
    else:
        library._finalize_dynamic_globals()
        library._finalized = True


def _serialise(as_it_was: Callable[..., Any], library: Any) -> Any:
    return as_it_was(library) if library.name == _wanted else library.serialize_using_bitcode()


def _set_environment(as_it_was: Callable[..., Any], codegen: Any, name: str, environment: Any) -> None:
    """What a function needs of Python's: there is nowhere to put it where there is no machine code."""
    if codegen._engine.is_symbol_defined(name):
        as_it_was(codegen, name, environment)


def _hash(as_it_was: Callable[..., Any], options: Any) -> int:
    kind = type(options)
    if kind not in _hashes:  # it is that of their names
        _hashes[kind] = as_it_was(options)
    return _hashes[kind]


def _equal(as_it_was: Callable[..., Any], options: Any, other: Any) -> Any:
    return (type(options) is type(other) and options._values == other._values) or as_it_was(options, other)


_CHANGES: tuple[tuple[Any, str, Callable[..., Any]], ...] = (
    (CPUCodeLibrary, "_optimize_final_module", _optimise),
    (CPUCodeLibrary, "_finalize_final_module", _finalise),
    (CPUCodeLibrary, "serialize_using_object_code", _serialise),
    (JITCPUCodegen, "set_env", _set_environment),
    (TargetConfig, "__eq__", _equal),
    (TargetConfig, "__hash__", _hash),
)
