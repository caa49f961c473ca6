"""What time it is, told to compiled code: stages that Python does not call one by one are timed all the same.

A function that holds an address cannot be kept on disk, for in the next process it is another. So the address of the system's
clock is a number that is handed over with each call.
"""

from __future__ import annotations

import ctypes
import sys
import time
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pyverlet.compile.jit import kernel

_WINDOWS = sys.platform == "win32"

_WHICH = getattr(time, "CLOCK_UPTIME_RAW" if sys.platform == "darwin" else "CLOCK_MONOTONIC", 0)
"""Of the system's clocks that which `time.perf_counter` reads."""


@cache
def address() -> int:
    """Of the system's clock, as `seconds` takes it."""
    if _WINDOWS:
        read = ctypes.WinDLL("kernel32").QueryPerformanceCounter  # type: ignore[attr-defined,unused-ignore]
    else:
        read = ctypes.CDLL(None).clock_gettime
    found = ctypes.cast(read, ctypes.c_void_p).value
    assert found
    return found


@cache
def tick() -> float:
    """s between two counts of the clock, as `seconds` takes it; where it counts seconds and nanoseconds, 1e-9."""
    if not _WINDOWS:
        return 1e-9
    frequency = ctypes.c_int64()
    ctypes.WinDLL("kernel32").QueryPerformanceFrequency(ctypes.byref(frequency))  # type: ignore[attr-defined,unused-ignore]
    return 1.0 / frequency.value


@intrinsic  # type: ignore[untyped-decorator]
def _read(typing: Any, address: Any) -> Any:
    """Both words that the clock at an address writes: seconds and nanoseconds, or counts and 0."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        word, which = ir.IntType(64), ir.IntType(32)
        words = cgutils.alloca_once(builder, ir.ArrayType(word, 2))
        builder.store(ir.Constant(ir.ArrayType(word, 2), None), words)
        if _WINDOWS:
            kind, given = ir.FunctionType(which, [words.type]), [words]
        else:
            kind, given = ir.FunctionType(which, [which, words.type]), [ir.Constant(which, _WHICH), words]
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), given)
        both = builder.load(words)
        return context.make_tuple(builder, sig.return_type, [builder.extract_value(both, k) for k in range(2)])

    return types.UniTuple(types.int64, 2)(types.int64), generate


@kernel
def seconds(clock: Any, tick: Any) -> Any:
    """What `time.perf_counter` says; clock: `address()`, tick: `tick()`. Needs neither Python nor its lock."""
    whole, part = _read(clock)
    if _WINDOWS:
        return whole * tick
    return whole + part * tick


@kernel
def note(spent: Any, stage: Any, clock: Any, tick: Any) -> None:
    """spent[stage] += seconds since the last note; spent[0] is when that was. clock 0: nobody wants to know."""
    if clock != 0:
        now = seconds(clock, tick)
        spent[stage] += now - spent[0]
        spent[0] = now
