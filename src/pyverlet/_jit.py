"""The only place that calls numba: how kernels are compiled, cached and counted.

Numba's disk cache looks at the file a kernel stands in and misses an edit in another file whose function was inlined.
The cache folder is therefore named after a hash of all sources of kernels (and Numba's version): any edit starts a fresh one.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from numba.core import event as numba_event

Function = TypeVar("Function", bound=Callable[..., Any])

KERNELS: dict[str, Any] = {}
"""Every kernel by qualified name, in the order it was declared."""

_STALE_AFTER_S = 30 * 24 * 3600.0


def sources_hash(root: Path | None = None) -> str:
    """Hash, 16 hex digits, of every source that compiled code can come from, and of the compiler's version.

    Kernels live in `kernels/` and may use `constants.py`, `_lanes.py` and this file, nothing else (a test checks that). An edit
    elsewhere, in a viewer say, need not compile anything anew.
    """
    root = Path(__file__).parent if root is None else root
    digest = hashlib.blake2b(f"{numba.__version__} {sys.version_info[:2]}".encode(), digest_size=8)
    for path in (root / "_jit.py", root / "_lanes.py", root / "constants.py", *sorted((root / "kernels").rglob("*.py"))):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _user_cache() -> Path:
    if chosen := os.environ.get("PYVERLET_CACHE_DIR"):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "pyverlet"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "pyverlet"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "pyverlet"


@cache
def cache_dir() -> Path | None:
    """The folder compiled kernels are kept in; None if nothing here can be written, and every start compiles."""
    for base in (_user_cache, lambda: Path(tempfile.gettempdir()) / "pyverlet"):
        try:
            folder = base() / sources_hash()
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except (OSError, RuntimeError):
            continue
        _forget_stale(folder)
        return folder
    return None


def _forget_stale(current: Path) -> None:
    """Remove caches of older sources that nobody has used for a month; touch ours to say it is in use."""
    with contextlib.suppress(OSError):
        os.utime(current)
        for other in current.parent.iterdir():
            if other != current and other.is_dir() and time.time() - other.stat().st_mtime > _STALE_AFTER_S:
                shutil.rmtree(other, ignore_errors=True)


def _compile_lazily(function: Function, parallel: bool) -> Function:
    folder = cache_dir()
    previous = numba.config.CACHE_DIR
    # Numba reads the folder once, when the kernel is declared. Nothing global changes for the user's own functions.
    numba.config.CACHE_DIR = str(folder) if folder else previous
    try:
        # No fastmath: it would break NaN checks and equal bits. error_model: a division is a division, not a branch and a raise.
        compiled = numba.njit(nogil=True, error_model="numpy", cache=folder is not None, parallel=parallel, fastmath=False)(
            function
        )
    finally:
        numba.config.CACHE_DIR = previous
    KERNELS[f"{function.__module__}.{function.__qualname__}"] = compiled
    return compiled  # type: ignore[no-any-return]


def kernel(function: Function) -> Function:
    """Compile on first call, to one thread's code; may be called from other kernels."""
    return _compile_lazily(function, parallel=False)


def parallel_kernel(function: Function) -> Function:
    """Compile on first call, its `prange` loops spread over threads. Each element of the output must have one writer."""
    return _compile_lazily(function, parallel=True)


prange = numba.prange


def max_threads() -> int:
    """Threads the pool was started with: the cores this process may use, or NUMBA_NUM_THREADS."""
    return int(numba.config.NUMBA_NUM_THREADS)


def use_threads(count: int) -> None:
    """Let the parallel kernels called from this thread use `count` threads."""
    numba.set_num_threads(count)


@contextlib.contextmanager
def one_thread(only_if: bool = True) -> Iterator[None]:
    """Parallel kernels called inside use one thread: work that is too little to be worth a meeting."""
    before = numba.get_num_threads()
    numba.set_num_threads(1 if only_if else before)
    try:
        yield
    finally:
        numba.set_num_threads(before)


class _CompileListener(numba_event.Listener):  # type: ignore[misc]
    def __init__(self, ours: set[Any], started: Callable[[], None]) -> None:
        self._ours = ours
        self._started = started

    def on_start(self, event: Any) -> None:
        if event.data.get("dispatcher") in self._ours:
            self._started()

    def on_end(self, event: Any) -> None:
        pass


@contextlib.contextmanager
def watch_compiling(started: Callable[[], None]) -> Iterator[None]:
    """Call `started` whenever one of our kernels begins to compile (not when it is loaded from disk)."""
    with numba_event.install_listener("numba:compile", _CompileListener(set(KERNELS.values()), started)):
        yield


class NotCompiled(Exception):  # noqa: N818  (the caller says whose code it was)
    """A user's function cannot be compiled, or not to what was asked for; the message says why, as the end of a sentence."""


class Native(NamedTuple):
    """A user's function of float64 numbers in compiled form."""

    pointer: Any
    """For kernels: of one type for all functions with as many arguments and results, so that no kernel is compiled anew."""
    call: Any
    """For Python, with the exceptions it raises."""


def native(function: Callable[..., Any], arguments: int, results: int) -> Native:
    """Compile a user's function of 6 numbers that returns 2, or of 3 that returns 1. Where it raises, the pointer returns NaN.

    Raises:
        NotCompiled: it does not compile, or returns something else.
    """
    real = numba.float64
    compiled = numba.njit(nogil=True, error_model="numpy")(function)
    try:
        compiled.compile((real,) * arguments)
    except Exception as error:  # the compiler raises all kinds
        raise NotCompiled(f"does not compile: {_reason(str(error))}") from error
    (overload,) = compiled.overloads.values()
    returned = overload.signature.return_type
    parts = list(returned) if isinstance(returned, numba.types.BaseTuple) else [returned]
    if len(parts) != results or not all(
        isinstance(part, numba.types.Integer | numba.types.Float | numba.types.Boolean) for part in parts
    ):
        raise NotCompiled(f"returns {_plain(returned)}")

    # No star in the arguments of a pointer, and no conversion between a number and a tuple of one: a guard for each shape.
    if results == 1:

        def guard(a: float, b: float, c: float) -> Any:
            try:
                return real(compiled(a, b, c))
            except Exception:
                return np.nan
    else:

        def guard(a: float, b: float, c: float, d: float, e: float, f: float) -> Any:  # type: ignore[misc]
            try:
                x, y = compiled(a, b, c, d, e, f)
            except Exception:
                return np.nan, np.nan
            return real(x), real(y)

    gives = real if results == 1 else numba.types.UniTuple(real, 2)
    return Native(numba.cfunc(gives(*(real,) * arguments))(guard), compiled)


def _reason(message: str) -> str:
    """What the compiler means, out of the pages it writes: its first telling line, and where."""
    lines = [line.strip() for line in message.splitlines() if line.strip() and not line.startswith("Failed in")]
    says = lines[0].removesuffix(" found for signature:")
    if says != lines[0]:
        says += " for " + next((line.removeprefix(">>> ") for line in lines if line.startswith(">>> ")), "these arguments")
    says = re.sub(r"Function\(<(.*?)>\)", r"\1", says).split(" Raised from ")[0].rstrip(".:")
    where = re.findall(r"line (\d+):", message)
    return f"{says} (line {where[-1]})" if where else says


def _plain(returned: Any) -> str:
    """A type in words that a user of Python knows."""
    if isinstance(returned, numba.types.Optional):
        return "None on some of its ways"
    if isinstance(returned, numba.types.NoneType):
        return "None"
    if isinstance(returned, numba.types.BaseTuple):
        return f"a tuple of {len(returned)}, {returned}"
    return f"one number, {returned}" if isinstance(returned, numba.types.Number) else str(returned)
