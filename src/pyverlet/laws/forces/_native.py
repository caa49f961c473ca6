"""Functions of the user's own in compiled form, where Numba is installed: only this module imports it, and only when it is used.

What is called is not the function but a loop over particles around it. There the compiler puts the function in line and takes
eight particles at once, where a call for each took five times as long.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable
from operator import is_
from typing import Any

import numba
import numpy as np
from numba.core import cgutils, types
from numba.extending import intrinsic

_REAL = types.float64
_ONE = np.uint64(1)


class NotCompiled(Exception):  # noqa: N818  (the caller says whose code it was)
    """A user's function cannot be compiled, or not to what was asked for; the message says why, as the end of a sentence."""


class Native:
    """A user's function of so many float64 numbers that returns so many, compiled.

    Attributes:
        call: for Python, with the exceptions it raises.

    Raises:
        NotCompiled: it does not compile, or returns something else.
    """

    def __init__(self, function: Callable[..., Any], arguments: int, results: int) -> None:
        self.call = numba.njit(nogil=True, error_model="numpy")(function)
        compiled, parts = self._compiled(arguments)
        if any(isinstance(part, types.Array) and part.ndim == 0 for part in parts):  # of `np.where`
            self.call = numba.njit(nogil=True, error_model="numpy")(_as_numbers(self.call, results))
            compiled, parts = self._compiled(arguments)
        returned = compiled.signature.return_type
        if len(parts) != results or not all(isinstance(part, types.Integer | types.Float | types.Boolean) for part in parts):
            raise NotCompiled(f"returns {_plain(returned)}")
        self._attempt = _attempt(compiled, parts)
        self._loops: dict[Any, Any] = {}
        self._arrays: tuple[Any, ...] = (None,) * 4
        self._addresses: tuple[int, ...] = ()

    def _compiled(self, arguments: int) -> tuple[Any, list[Any]]:
        """The compiled code, and the types of the numbers that it returns."""
        try:
            self.call.compile((_REAL,) * arguments)
        except Exception as error:  # the compiler raises all kinds
            raise NotCompiled(f"does not compile: {_reason(str(error))}") from error
        (compiled,) = self.call.overloads.values()
        returned = compiled.signature.return_type
        return compiled, list(returned) if isinstance(returned, types.BaseTuple) else [returned]

    def add(self, state: Any, position: Any, t: float) -> int:
        """Add the two numbers returned for (x, y, vx, vy, mass, t) of every free particle to `state.force`.

        It returns for how many of them the function raised, or returned something that is not finite.
        """
        arrays = state.force, position, state.velocity, state.mass
        if not all(map(is_, arrays, self._arrays)):
            self._arrays, self._addresses = arrays, tuple(array.ctypes.data for array in arrays)
        return int(self._loop(state.dtype)(*self._addresses, len(position), t))

    def potential(self, position: Any, mass: Any) -> float:
        """Sum of the number returned for (x, y, mass) of every free particle; NaN where the function raises."""
        loop = self._loop(position.dtype, potential=True)
        return float(loop(position.ctypes.data, mass.ctypes.data, len(mass)))

    def _loop(self, dtype: np.dtype[Any], *, potential: bool = False) -> Any:
        """What Python calls with the addresses of arrays; it releases the GIL."""
        if dtype not in self._loops:
            make, pointers = (_potential_loop, 2) if potential else (_force_loop, 4)
            address, rest = types.CPointer(numba.from_dtype(dtype)), (types.int64,) if potential else (types.int64, _REAL)
            returned = _REAL if potential else types.int64
            signature = returned(*(address for _ in range(pointers)), *rest)
            compiled = numba.cfunc(signature, error_model="numpy")(make(self._attempt))
            back, after = (ctypes.c_double, ()) if potential else (ctypes.c_int64, (ctypes.c_double,))
            kind = ctypes.CFUNCTYPE(back, *(ctypes.c_void_p for _ in range(pointers)), ctypes.c_int64, *after)
            self._loops[dtype] = kind(compiled.address), compiled
        return self._loops[dtype][0]


def _as_numbers(function: Any, results: int) -> Any:
    """The same force or potential, whose results are numbers where they were arrays without axes."""

    def one(x: float, y: float, mass: float) -> Any:
        return np.asarray(function(x, y, mass)).item()

    def pair(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> Any:
        fx, fy = function(x, y, vx, vy, mass, t)
        return np.asarray(fx).item(), np.asarray(fy).item()

    return one if results == 1 else pair


def _force_loop(attempt: Any) -> Any:
    def loop(force, position, velocity, mass, count, t):  # type: ignore[no-untyped-def]
        f, x = numba.carray(force, 2 * count), numba.carray(position, 2 * count)
        v, masses, wrong = numba.carray(velocity, 2 * count), numba.carray(mass, count), 0
        for k in range(count):
            i = np.uint64(k)
            a = i + i
            b = a + _ONE
            m, ax, ay, vx, vy = _REAL(masses[i]), _REAL(x[a]), _REAL(x[b]), _REAL(v[a]), _REAL(v[b])
            fine, fx, fy = attempt((ax, ay, vx, vy, m, t))
            free = m < np.inf
            f[a] += fx if free else 0.0
            f[b] += fy if free else 0.0
            # z - z is 0 for finite numbers, NaN for others.
            fine &= (fx - fx) + (fy - fy) == 0.0
            wrong += int(free and not fine and (ax - ax) + (ay - ay) + (vx - vx) + (vy - vy) == 0.0)
        return wrong

    return loop


def _potential_loop(attempt: Any) -> Any:
    def loop(position, mass, count):  # type: ignore[no-untyped-def]
        x, masses, total = numba.carray(position, 2 * count), numba.carray(mass, count), 0.0
        for i in range(count):
            m = _REAL(masses[i])
            fine, value = attempt((_REAL(x[2 * i]), _REAL(x[2 * i + 1]), m))
            if m < np.inf:
                total += value if fine else np.nan
        return total

    return loop


def _attempt(compiled: Any, parts: list[Any]) -> Any:
    """For compiled code: call a function with a tuple of arguments. Returns whether it did not raise, and what it returned.

    In place of `try`, which takes the compiler five times as long and keeps loops from being turned into vectors.
    """
    made, library, kind = compiled.fndesc, compiled.library, compiled.signature
    gives = types.Tuple((types.boolean, *(_REAL for _ in parts)))

    @intrinsic  # type: ignore[untyped-decorator]
    def attempt(typing: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            context.active_code_library.add_linking_library(library)
            given = cgutils.unpack_tuple(builder, args[0])
            status, result = context.call_internal_no_propagate(builder, made, kind, given)
            values = cgutils.unpack_tuple(builder, result) if isinstance(kind.return_type, types.BaseTuple) else [result]
            numbers = [context.cast(builder, *what, _REAL) for what in zip(values, parts, strict=True)]
            return context.make_tuple(builder, gives, [status.is_ok, *numbers])

        return gives(arguments), generate

    return attempt


def _reason(message: str) -> str:
    """What the compiler means, out of the pages it writes: its first telling line, and where."""
    message = re.sub(r"\x1b\[[0-9;]*m", "", message)  # in colours, where a library for them is installed
    lines = [line.strip() for line in message.splitlines() if line.strip() and not line.startswith("Failed in")]
    says = lines[0].removesuffix(" found for signature:")
    if says != lines[0]:
        says += " for " + next((line.removeprefix(">>> ") for line in lines if line.startswith(">>> ")), "these arguments")
    says = re.sub(r"Function\(<(.*?)>\)", r"\1", says).split(" Raised from ")[0].rstrip(".:")
    where = re.findall(r"line (\d+):", message)
    return f"{says} (line {where[-1]})" if where else says


def _plain(returned: Any) -> str:
    """A type in words that a user of Python knows."""
    if isinstance(returned, types.Optional):
        return "None on some of its ways"
    if isinstance(returned, types.NoneType):
        return "None"
    if isinstance(returned, types.BaseTuple):
        return f"a tuple of {len(returned)}, {returned}"
    return f"one number, {returned}" if isinstance(returned, types.Number) else str(returned)
