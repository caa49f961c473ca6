"""The only place that calls numba: how kernels are compiled, cached and counted.

Numba's disk cache looks at the file a kernel stands in and misses an edit in another file whose function was inlined.
The cache folder is therefore named after a hash of all sources of kernels (and Numba's version): any edit starts a fresh one.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import event as numba_event

Function = TypeVar("Function", bound=Callable[..., Any])

KERNELS: dict[str, Any] = {}
"""Every kernel by qualified name, in the order it was declared."""

_STALE_AFTER_S = 30 * 24 * 3600.0


def sources_hash(root: Path | None = None) -> str:
    """Hash, 16 hex digits, of every source that compiled code can come from, and of the compiler's version.

    Kernels live in `kernels/` and may use `constants.py` and this file, nothing else (a test checks that). An edit
    elsewhere, in a viewer say, need not compile anything anew.
    """
    root = Path(__file__).parent if root is None else root
    digest = hashlib.blake2b(f"{numba.__version__} {sys.version_info[:2]}".encode(), digest_size=8)
    for path in (root / "_jit.py", root / "constants.py", *sorted((root / "kernels").rglob("*.py"))):
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
