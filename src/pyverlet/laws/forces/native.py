"""User-defined functions as machine code, if Numba is installed: `pip install pyverlet[native]`.

The core calls the code for blocks of particles, on all threads. NumPy is used for functions that Numba does not compile, that
depend on variables which may change, or whose results differ.
"""

from __future__ import annotations

import dis
import importlib
import importlib.util
from functools import cache, partial
from types import ModuleType
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array

_BUILTINS = {"abs", "bool", "float", "int", "max", "min", "pow", "range", "round"}

_ALIKE = 1e-9
"""Relative tolerance: functions such as the sine differ from NumPy's in their last bits; more means another result."""


_TRIED = 256
"""Particles for which compiled code is compared with NumPy, once."""


@cache  # functions ask at each evaluation, and a failed import takes longer than the call
def installed() -> bool:
    """Whether Numba is installed."""
    return importlib.util.find_spec("numba") is not None


class Native:
    """A compiled function of five columns and the time that returns two numbers.

    Args:
        function: (x, y, vx, vy, mass, t) -> (fx, fy).

    Attributes:
        address: of code for `core.function_calls`; 0: NumPy calls the function.
    """

    def __init__(self, function: Any) -> None:
        self.address = 0
        self._constants = _constants(function)
        if self._constants is not None:
            self._code = _compiled(function)  # kept alive as long as its address
            self.address = self._code.address if self._code else 0

    def holds(self) -> bool:
        """Whether the constants of the function are unchanged since compilation; otherwise the code is no longer used."""
        if self.address and any(current() is not value for current, value in self._constants or []):
            self.address = 0
        return self.address != 0

    def agree(self, motion: Any, columns: Array, t: float, expected: list[Array]) -> None:
        """Disable the code if its results differ from NumPy's by more than rounding, or if it mixes particles.

        columns: (5, n), n > 1; expected: two columns of (n,), or of (1,).
        """
        count = min(columns.shape[1], _TRIED)
        half, expected = count // 2, [each[:count] for each in expected]
        parts = [np.ascontiguousarray(columns[:, part]) for part in (slice(half), slice(half, count))]
        values = np.hstack([motion.compiled_values(part, self.address, t) for part in parts])
        for ours, theirs in zip(values, expected, strict=True):
            most = np.abs(theirs[np.isfinite(theirs)]).max(initial=0.0)
            if not np.allclose(ours, theirs, rtol=0.0, atol=_ALIKE * most, equal_nan=True):
                self.address = 0


def _constants(function: Any) -> list[tuple[Any, Any]] | None:
    """Getters and values of the constants that a function uses, which Numba compiles in; None: use NumPy.

    None if it uses other variables that may change, or raises, which code called from C cannot.
    """
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    found: list[tuple[Any, Any]] = []
    for step in dis.get_instructions(function):
        if step.opname in ("RAISE_VARARGS", "MAKE_FUNCTION", "STORE_GLOBAL", "STORE_DEREF"):
            return None
        if step.opname == "LOAD_DEREF":
            read = partial(getattr, cells.get(step.argval), "cell_contents", None)
        elif step.opname == "LOAD_GLOBAL" and step.argval in function.__globals__:
            read = partial(function.__globals__.get, step.argval)
        elif step.opname == "LOAD_GLOBAL" and step.argval not in _BUILTINS:
            return None
        else:
            continue
        if not isinstance(value := read(), bool | int | float | ModuleType) and not hasattr(value, "nopython_signatures"):
            return None
        found.append((read, value))
    return found


def _compiled(function: Any) -> Any:
    """Compile with Numba, to code with an `address`; None if Numba fails, or the result is not two numbers.

    A function of plain numbers becomes a loop over particles. One that calls `where`, which returns arrays, gets columns.
    """
    numba = importlib.import_module("numba")
    number, types = numba.float64, numba.types
    column = number[::1] if "where" in function.__code__.co_names else number
    try:
        one = numba.njit(*[(*[column] * 5, number)], error_model="numpy")(function)
        returned = one.nopython_signatures[0].return_type
        if not isinstance(returned, types.BaseTuple) or len(returned) != 2:
            return None
        if not all(isinstance(getattr(each, "dtype", each), types.Number | types.Boolean) for each in returned):
            return None

        def by_particle(given: Any, result: Any, count: int, t: float) -> None:
            for k in range(count):
                result[k], result[count + k] = one(
                    given[k], given[count + k], given[2 * count + k], given[3 * count + k], given[4 * count + k], t
                )

        def by_column(given: Any, result: Any, count: int, t: float) -> None:
            x = numba.carray(given, (5, count))
            f = numba.carray(result, (2, count))
            fx, fy = one(x[0], x[1], x[2], x[3], x[4], t)
            f[0, :] = fx
            f[1, :] = fy

        signature = numba.void(types.CPointer(number), types.CPointer(number), numba.intp, number)
        return numba.cfunc(signature, error_model="numpy")(by_particle if column is number else by_column)
    except numba.core.errors.NumbaError:
        return None
