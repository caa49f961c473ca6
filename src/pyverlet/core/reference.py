"""The kernels of a unit as plain Python: the readable reference, slow, with the bits of the compiled ones.

`load("engine", np.float32)` runs the same files. What they take from C stands here in NumPy: a lane vector is an array of eight,
the address of an array is the array, flat, and a struct is an object with attributes. Needs Cython, for its `cython` module.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any, Final

import numpy as np

from pyverlet.core import joining

_LANES: Final = 8


def _integer(dtype: type[np.integer[Any]]) -> Callable[..., Any]:
    """A C integer type: wraps around, truncates."""
    bits = 8 * np.dtype(dtype).itemsize

    def cast(value: Any = 0) -> Any:
        whole = int(value) & ((1 << bits) - 1)
        return dtype(whole - (1 << bits) if np.issubdtype(dtype, np.signedinteger) and whole >> (bits - 1) else whole)

    return cast


def _address(dtype: Any, *, writable: bool) -> Callable[[Any], Any]:
    """What gives the address of an array: here the array as one row, which must be of the type and contiguous."""

    def address(array: Any) -> Any:
        wrong = array.dtype != dtype and not (dtype == np.uint8 and array.dtype == np.bool_)
        if wrong:
            raise TypeError(f"the array has items {array.dtype}; allowed is {np.dtype(dtype).name}")
        if not array.flags.c_contiguous or (writable and not array.flags.writeable):
            raise ValueError("the array is not C-contiguous and writable")
        return array.reshape(-1)

    return address


def _lanes(real: Any) -> dict[str, Any]:
    """`lanes.h` in NumPy."""

    def at(index: Any, k: int, width: int = 1) -> Any:
        return width * index[k : k + _LANES].astype(np.int64)

    def store(array: Any, k: int, a: Any) -> None:
        array[k : k + _LANES] = a

    def scatter(array: Any, index: Any, k: int, a: Any) -> None:
        array[at(index, k)] = a

    def take(array: Any, index: Any, k: int) -> Any:
        i = at(index, k, 2)
        return SimpleNamespace(x=array[i], y=array[i + 1])

    def take4(array: Any, index: Any, k: int) -> Any:
        i = at(index, k, 4)
        return SimpleNamespace(x=array[i], y=array[i + 1], z=array[i + 2], w=array[i + 3])

    def put(array: Any, index: Any, k: int, *values: Any) -> None:
        i = at(index, k, len(values))
        for offset, value in enumerate(values):
            array[i + offset] = value

    def spread(a: Any) -> Any:
        return np.full(_LANES, a, real)

    return {
        "LANES": _LANES,
        "real": real,
        "lanes": real,
        "mask": np.bool_,
        "lanes2": SimpleNamespace,
        "lanes4": SimpleNamespace,
        "spread": spread,
        "load": lambda array, k: array[k : k + _LANES].copy(),
        "store": store,
        "above": np.greater,
        "equal": np.equal,
        "both": np.logical_and,
        "either": np.logical_or,
        "outside": np.logical_not,
        "choose": lambda mask, a, b: np.where(mask, a, b),
        "any_lane": np.any,
        "any_above": lambda a, b: bool(np.any(a > b)),
        "larger": lambda a, b: np.where(a > b, a, b),
        "smaller": lambda a, b: np.where(a < b, a, b),
        "where_zero": lambda test, a, b: np.where(test == 0, a, b),
        "magnitude": lambda a: np.where(a < 0, -a, a),
        "square_root": np.sqrt,
        "gather": lambda array, index, k: array[at(index, k)],
        "scatter": scatter,
        "take": take,
        "put": put,
        "take4": take4,
        "put4": put,
    }


def _arrays(real: Any) -> dict[str, Any]:
    """`arrays.h` in NumPy."""
    types = {
        "reals": real,
        "doubles": np.float64,
        "integers": np.int64,
        "small_integers": np.int32,
        "indices": np.uint32,
        "words": np.uint64,
        "shorts": np.uint16,
        "octets": np.uint8,
    }
    made = {name: _address(dtype, writable=True) for name, dtype in types.items()}
    return made | {f"const_{name}": _address(dtype, writable=False) for name, dtype in types.items()}


def _team() -> dict[str, Any]:
    """`team.h` with one thread."""
    return {
        "thread_team": SimpleNamespace,
        "team_function": None,
        "team_new": lambda threads: SimpleNamespace(threads=1, parts=1),
        "team_run": lambda team, function, argument, parts: function(argument, 0, 1),
        "team_barrier": lambda team: None,
        "team_free": lambda team: None,
    }


def _math(real: Any) -> dict[str, Any]:
    """What kernels take from `libc.math`: functions of float64, and those of float32 whose name ends in f."""
    names = ("sqrt", "floor", "ceil", "hypot", "sin", "cos", "atan2", "log", "exp", "pow")
    single = {
        f"{name}f": lambda *values, of=getattr(np, name if name != "atan2" else "arctan2"): of(*map(np.float32, values))
        for name in names
    }
    double = {name: lambda *values, of=getattr(math, name): np.float64(of(*map(float, values))) for name in names}
    return single | double | {"fabs": abs, "INFINITY": np.inf, "NAN": np.nan, "isfinite": math.isfinite, "isnan": math.isnan}


_INTEGERS: Final = {
    f"{sign}int{bits}_t": _integer(np.dtype(f"{sign}int{bits}").type) for sign in ("", "u") for bits in (8, 16, 32, 64)
}


def _cython() -> Any:
    """Cython's own module for uncompiled code, with structs that are objects with attributes, and addresses that are what they are of."""
    from Cython import Shadow

    made = ModuleType("cython")
    vars(made).update(vars(Shadow))

    def struct(**_: Any) -> type:
        return type("struct", (SimpleNamespace,), {})

    def declare(kind: Any = None, value: Any = None, **_: Any) -> Any:
        return value if value is None or not callable(kind) else kind(value)

    def cast(kind: Any, value: Any, **_: Any) -> Any:
        return kind(value) if isinstance(kind, type) and issubclass(kind, np.generic) or kind in _INTEGERS.values() else value

    vars(made).update(struct=struct, declare=declare, cast=cast, address=lambda value: value)
    return made


def load(unit: str, dtype: Any = np.float32) -> ModuleType:
    """The unit as a module of plain Python functions, for arrays of this precision."""
    real = np.dtype(dtype).type
    shims = {
        "lanes": _lanes(real),
        "arrays": _arrays(real),
        "team": _team(),
        "libc.math": _math(real),
        "libc.stdint": _INTEGERS,
        "processor": {"has_x86_64_v3": lambda: False},
    }
    module = ModuleType(f"{unit}_reference")
    names = vars(module)
    for part in joining.parts(unit):
        kept = []
        for node in part.tree.body:
            if isinstance(node, ast.Import) and node.names[0].name == "cython":
                names["cython"] = _cython()
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cython.cimports."):
                shim = shims[str(node.module).removeprefix("cython.cimports.")]
                names.update({alias.asname or alias.name: shim[alias.name] for alias in node.names})
            else:
                kept.append(node)
        future = ast.parse("from __future__ import annotations").body
        exec(compile(ast.Module(future + kept, []), str(part.path), "exec"), names)
    return module
