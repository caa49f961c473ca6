"""How kernels are compiled, cached and counted.

Numba's disk cache looks at the file a kernel stands in and misses an edit in another file whose function was inlined.
The cache folder is therefore named after a hash of all sources of kernels (and Numba's version): any edit starts a fresh one.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import event as numba_event
from numba.core.compiler_lock import global_compiler_lock

from pyverlet.compile import entry, lean
from pyverlet.ground import file_lock

Function = TypeVar("Function", bound=Callable[..., Any])

_COMPILED_FROM = ("compile", "kernels")

_STALE_AFTER_S = 30 * 24 * 3600.0


def sources_hash(root: Path | None = None) -> str:
    """Hash, 16 hex digits, of every source that compiled code can come from, and of the compiler's version.

    Kernels live in `kernels/` and may use `compile/` and `ground/constants.py`, nothing else: a test looks. An edit elsewhere,
    in a viewer say, need not compile anything anew.
    """
    root = Path(__file__).parents[1] if root is None else root
    digest = hashlib.blake2b(f"{numba.__version__} {sys.version_info[:2]}".encode(), digest_size=8)
    for path in (
        root / "ground" / "constants.py",
        *(path for room in _COMPILED_FROM for path in sorted((root / room).rglob("*.py"))),
    ):
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


@contextlib.contextmanager
def caching(variant: str) -> Iterator[bool]:
    """Declare functions whose compiled code is kept in the folder of this name; False if it cannot be kept."""
    folder = cache_dir()
    previous = numba.config.CACHE_DIR
    # Numba reads the folder once, when a function is declared. Nothing global changes for the user's own functions.
    numba.config.CACHE_DIR = str(folder / variant) if folder else previous
    try:
        yield folder is not None
    finally:
        numba.config.CACHE_DIR = previous


@contextlib.contextmanager
def turn(name: str, patience: float = file_lock.PATIENCE_S) -> Iterator[bool]:
    """The turn of this name among all processes that compile into our folder."""
    folder = cache_dir()
    if folder is None:
        yield True
        return
    with file_lock.turn(folder / "turns", name, patience=patience) as mine:
        yield mine


@contextlib.contextmanager
def _litter() -> Iterator[None]:
    """Leave what is thrown away where it is: compiling makes so many objects that looking through them takes a sixth of it."""
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()


def _in_turn(function: Any, name: str, wanted: str) -> Any:
    """The compiler of a function: no two processes compile it at a time, and whoever comes second finds it on disk."""
    compiling = function.compile

    def compile_in_turn(kinds: Any) -> Any:
        with global_compiler_lock, turn(name), _litter(), lean.only(wanted):
            return compiling(kinds)

    return compile_in_turn


_VIEWS = {"T", "dtype", "fill", "flat", "itemsize", "nbytes", "ndim", "reshape", "shape", "size", "strides"}
_MAKERS = {"arange", "array", "empty", "empty_like", "full", "full_like", "ones", "zeros", "zeros_like"} | {
    name for name in vars(np.ndarray) if not name.startswith("_") and name not in _VIEWS
}


def _allocates(function: Callable[..., Any]) -> bool:
    """Whether a kernel may make arrays: with NumPy's functions for it, or by a method, for even `min` makes one.

    Others need no counts of who refers to an array, a sixth of what is compiled.
    """
    return not _MAKERS.isdisjoint(function.__code__.co_names)


class Kernel(functools.partial[Any]):
    """A compiled function: compiled on its first call with arguments of some kinds, then called by the short way of `_entry`.

    Attributes:
        function: as it is written.
        alone: the same, on one thread always.
        parallel: whether it has loops to spread over threads.
    """

    function: Callable[..., Any]
    alone: Kernel
    parallel: bool
    _made: dict[str, Any]
    _met: set[Any]

    def __new__(cls, function: Callable[..., Any], parallel: bool = False) -> Kernel:
        self = super().__new__(cls, function)
        self.function, self.__doc__ = function, function.__doc__
        self.parallel, self._made, self._met = parallel, {}, set()
        self.alone = cls(function) if parallel else self
        self._lead_to(self._learn)
        return self

    def _lead_to(self, callee: Callable[..., Any]) -> None:
        self.__setstate__((callee, (), {}, self.__dict__))  # type: ignore[attr-defined]

    @property
    def _numba_type_(self) -> Any:
        """What other kernels call: one thread's code."""
        return numba.types.Dispatcher(self.alone.variant(parallel=False, inner=True))

    def variant(self, *, parallel: bool, wrapped: bool = False, inner: bool = False) -> Any:
        """Numba's own: its loops over threads or not; `wrapped` to be called with any arguments, `inner` by other kernels."""
        name = ("inner" if inner else "parallel" if parallel else "alone") + ("-wrapped" if wrapped else "")
        if self._made.get(name) is None:
            with caching(name) as kept:
                # No fastmath: it would break NaN checks and equal bits. error_model: a division is a division, not a branch and a
                # raise. Wrappers take as long to compile as the kernel. Loops over threads may make arrays of their own.
                made = numba.njit(
                    nogil=True, error_model="numpy", cache=kept, parallel=parallel and {**lean.PRANGE_ONLY}, fastmath=False,
                    no_cpython_wrapper=not wrapped, no_cfunc_wrapper=True, _nrt=parallel or _allocates(self.function),
                )(self.function)  # fmt: skip
            qualname = self.function.__qualname__
            made.compile = _in_turn(made, f"{name} {self.function.__module__}.{qualname}", "" if inner else qualname)
            self._made[name] = made
        return self._made[name]

    def _learn(self, *arguments: Any) -> Any:
        """Called with arguments of kinds that no entry knows."""
        entry.miss()
        parallel = self.parallel and numba.get_num_threads() > 1
        kinds = tuple(map(numba.typeof, arguments)) if entry.takes(arguments) and entry.usable() else ()
        if not kinds or (parallel, kinds) in self._met:
            return self.variant(parallel=parallel, wrapped=True)(*arguments)
        self._met.add((parallel, kinds))
        lean = self.variant(parallel=parallel)
        lean.compile(kinds)
        compiled = lean.overloads[kinds]
        if entry.gives(compiled):
            when = entry.ANY if not self.parallel else entry.TOGETHER if parallel else entry.ALONE
            with caching("entry") as kept, global_compiler_lock, turn("entry"):
                self._lead_to(entry.entry(compiled, arguments, when, self.func, kept))
        return self(*arguments)


KERNELS: dict[str, Kernel] = {}
"""Every kernel by qualified name, in the order it was declared."""


def _declared(kernel: Kernel) -> Any:
    KERNELS[f"{kernel.function.__module__}.{kernel.function.__qualname__}"] = kernel
    return kernel


def kernel(function: Function) -> Function:
    """Compile on first call, to one thread's code; may be called from other kernels."""
    return _declared(Kernel(function))  # type: ignore[no-any-return]


def parallel_kernel(function: Callable[..., Any]) -> Kernel:
    """Compile on first call, its `prange` loops spread over threads if there are several: not at all for one.

    Each element of the output must have one writer. `kernel.alone` never leaves the thread it is called from.
    """
    return _declared(Kernel(function, parallel=True))  # type: ignore[no-any-return]


prange = numba.prange


def max_threads() -> int:
    """Threads the pool was started with: the cores this process may use, or NUMBA_NUM_THREADS."""
    return int(numba.config.NUMBA_NUM_THREADS)


_chosen = threading.local()


def use_threads(count: int) -> None:
    """Let the parallel kernels called from this thread use `count` threads."""
    if getattr(_chosen, "count", 0) != count:  # asking Numba takes as long as a stage of a small world
        numba.set_num_threads(count)
        _chosen.count = count


def threads_in_use() -> int:
    """How many the parallel kernels called from this thread use."""
    return getattr(_chosen, "count", 0) or int(numba.get_num_threads())


@contextlib.contextmanager
def one_thread(only_if: bool = True) -> Iterator[None]:
    """Parallel kernels called inside use one thread: work that is too little to be worth a meeting."""
    before = numba.get_num_threads()
    use_threads(1 if only_if else before)
    try:
        yield
    finally:
        use_threads(before)


class _CompileListener(numba_event.Listener):  # type: ignore[misc]
    def __init__(self, ours: set[Any], started: Callable[[], None]) -> None:
        self._ours = ours
        self._started = started

    def on_start(self, event: Any) -> None:
        if getattr(event.data.get("dispatcher"), "py_func", None) in self._ours:
            self._started()

    def on_end(self, event: Any) -> None:
        pass


@contextlib.contextmanager
def watch_compiling(started: Callable[[], None]) -> Iterator[None]:
    """Call `started` whenever one of our kernels begins to compile (not when it is loaded from disk)."""
    with numba_event.install_listener(
        "numba:compile", _CompileListener({kernel.function for kernel in KERNELS.values()}, started)
    ):
        yield
