"""How kernels are compiled, cached and called.

Each is a function compiled by Numba's `njit` as its manual says, in one or two variants: for one thread, and, if it has loops
over threads or calls kernels that have, for several.

Numba's disk cache looks at the file a kernel stands in and misses an edit in another file whose function was inlined. The cache
folder is therefore named after a hash of all sources of kernels (and Numba's version): any edit starts a fresh one.
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
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.extending import typeof_impl

from pyverlet.compile import pool, watching
from pyverlet.ground import file_lock, interrupts

Function = TypeVar("Function", bound=Callable[..., Any])

_COMPILED_FROM = ("compile", "kernels")

_ROOM = 100_000_000
"""Bytes that must be free where compiled kernels are kept: all of them are a third of it, and Numba does not bear a full disk."""

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
            if shutil.disk_usage(folder).free < _ROOM:
                continue
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
def _turn_or_wait(name: str) -> Iterator[None]:
    """The turn of a kernel; who watches is told if another process compiles it just now, and we wait."""
    with turn(name, 0.0) as mine:
        if mine:
            yield
            return
    watching.tell()
    with turn(name):
        yield


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


def _distrust(variant: str) -> bool:
    """A kernel could not be called, and what was kept of it may be why: throw away all that is kept. Whether there was any.

    Half a file, after a power cut, is an error of Python's `pickle` and says nothing about which file it is.
    """
    folder = cache_dir()
    kept = list((folder / variant).rglob("*.nb?")) if folder else []
    for path in kept:
        path.unlink(missing_ok=True)
    return bool(kept)


_compiling = threading.RLock()
"""Held while a kernel is declared to Numba or called for the first time: Numba compiles one at a time in any case."""

_launching = threading.Lock()
"""Held by who launches threads where only one may: Numba's own pool, `workqueue`, ends the process when two do."""

_chosen = threading.local()
"""`wanted`: what `use_threads` was told by this thread."""


def _free_locks() -> None:
    """A fork begins: whoever held them is not here."""
    global _compiling, _launching
    _compiling, _launching = threading.RLock(), threading.Lock()
    if pool.usable(2) == 1:
        _chosen.wanted = 1, False


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_free_locks)


class Kernel:
    """A compiled function: compiled when it is first called with arguments of some types, or found on disk.

    From Python it runs on as many threads as are in use. Other kernels call one thread's code; those that are drivers, that of
    their own variant. One whose name begins with an underscore is part of another: only kernels call it, and what would take
    Python's objects apart for it is left out: 7 % of what a first start compiles.

    Attributes:
        function: as it is written.
        parallel: whether it has a variant for several threads.
        inner: whether only kernels can call it.
    """

    def __init__(self, function: Callable[..., Any], *, loops: bool = False, drives: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.function, self.parallel = function, loops or drives
        self._loops = loops
        self.inner = not self.parallel and function.__name__.startswith("_")
        self._alone = self._refuse if self.inner else functools.partial(self._first, "alone")
        self._together = functools.partial(self._first, "together")

    def __reduce__(self) -> str:
        return self.function.__qualname__  # there is one of it, whoever is copied

    def __call__(self, *arguments: Any) -> Any:
        """Call the variant for the threads in use."""
        # What `_in_use` says, mostly without its call: this is called nine times in the smallest frame.
        if not (self.parallel and (getattr(_chosen, "wanted", None) or _in_use())[1]):
            return self._alone(*arguments)
        if pool.layer() != "workqueue":
            return self._masked(arguments)
        with _launching:
            return self._masked(arguments)

    def _masked(self, arguments: tuple[Any, ...]) -> Any:
        """On as many threads as are in use; afterwards the user's own parallel functions have as many as before."""
        count, before = threads_in_use(), numba.get_num_threads()
        if count == before:
            return self._together(*arguments)
        numba.set_num_threads(count)
        try:
            return self._together(*arguments)
        finally:
            numba.set_num_threads(before)

    @functools.cached_property
    def alone(self) -> Any:
        """Numba's dispatcher of one thread's code."""
        return self._dispatcher("alone", self.function)

    @functools.cached_property
    def together(self) -> Any:
        """Numba's dispatcher of the code for several threads; `alone` if it has none."""
        if not self.parallel:
            return self.alone
        return self._dispatcher("together", self.function if self._loops else _with_threads(self.function))

    def _dispatcher(self, variant: str, function: Callable[..., Any]) -> Any:
        with _compiling:
            if variant in vars(self):  # by now, by another thread
                return vars(self)[variant]
            with caching(variant) as kept:
                # No fastmath: it would break NaN checks and equal bits. error_model: a division is a division, not a branch and
                # a raise. No kernel is handed to another as an argument, which is what cfunc wrappers are for.
                made = numba.njit(
                    nogil=True, error_model="numpy", cache=kept, parallel=self._loops and variant == "together",
                    no_cfunc_wrapper=True, no_cpython_wrapper=self.inner,
                )(function)  # fmt: skip
            return vars(self).setdefault(variant, made)

    def _refuse(self, *_: Any) -> Any:
        raise TypeError(f"{self.function.__module__}.{self.function.__qualname__} is called by kernels, not from Python")

    def _first(self, variant: str, *arguments: Any) -> Any:
        """The first call: no two processes compile a kernel at a time, and whoever comes second finds it on disk."""
        dispatcher = getattr(self, variant)
        name = f"{variant} {self.function.__module__}.{self.function.__qualname__}"
        with interrupts.whole.long(), _compiling, _turn_or_wait(name), _litter():
            try:
                result = dispatcher(*arguments)
            except numba.core.errors.NumbaError:
                raise
            except OSError:  # it is compiled, and could not be kept: the disk is full, say
                result = dispatcher(*arguments)
            except Exception:
                if not _distrust(variant):
                    raise
                del vars(self)[variant]
                dispatcher = getattr(self, variant)
                result = dispatcher(*arguments)
        setattr(self, f"_{variant}", dispatcher)
        return result


@typeof_impl.register(Kernel)  # type: ignore[untyped-decorator]
def _type_of_kernel(kernel: Kernel, _: Any) -> Any:
    """What compiled code calls by the name of a kernel."""
    return numba.typeof(kernel.alone)


def _bound(function: Callable[..., Any], names: dict[str, Any], suffix: str = "") -> Callable[..., Any]:
    """The same function, where these names are something else."""
    other = types.FunctionType(
        function.__code__, {**function.__globals__, **names}, function.__name__, function.__defaults__, function.__closure__
    )
    other.__qualname__, other.__module__ = function.__qualname__ + suffix, function.__module__
    return other


def _with_threads(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, where the kernels it calls by their names are their variants for several threads."""
    used = function.__code__.co_names
    return _bound(
        function,
        {name: value.together for name, value in function.__globals__.items() if isinstance(value, Kernel) and name in used},
    )


KERNELS: dict[str, Kernel] = {}
"""Every kernel by qualified name, in the order it was declared."""


def _declared(kernel: Kernel) -> Any:
    KERNELS[f"{kernel.function.__module__}.{kernel.function.__qualname__}"] = kernel
    return kernel


def variant(function: Callable[..., Any], name: str, **names: Any) -> Callable[..., Any]:
    """The same function by another `name`, where `names` of its module are something else: constants, or other kernels.

    What a constant rules out is not compiled: one text serves as several kernels.
    """
    return _bound(function, names, f"_{name}")


FALSE, TRUE = np.bool_(False), np.bool_(True)
"""For kernels that are handed one: no literals, see `kernel`."""


def kernel(function: Function) -> Function:
    """Compile on first call, to one thread's code; may be called from other kernels.

    Handed a literal, by a call in another kernel or by a variable that starts as one, Numba compiles it for that beside what it
    compiles for numbers: `np.int64(0)` is none.
    """
    return _declared(Kernel(function))  # type: ignore[no-any-return]


def parallel_kernel(function: Callable[..., Any]) -> Kernel:
    """Compile on first call, its `prange` loops spread over threads if there are several: not at all for one.

    Each element of the output must have one writer. Two `prange` loops in a row need a call between them, for Numba would make
    one loop of two that have as many turns. `kernel.alone` never leaves the thread it is called from.
    """
    return _declared(Kernel(function, loops=True))  # type: ignore[no-any-return]


def driver(function: Callable[..., Any], **stages: Kernel) -> Kernel:
    """Compile on first call a function that calls kernels: all on one thread, or each with its loops over threads.

    It has no `prange` of its own. It calls kernels, and other drivers, by names of its module, not as `module.kernel`. A stage
    that is to stay on one thread in any case is called by a name for `stage.alone`. `stages`: what some of these names are; so
    one function serves as several drivers.
    """
    if stages:
        function = _bound(function, stages, "_" + "_".join(stage.function.__name__ for stage in stages.values()))
    return _declared(Kernel(function, drives=True))  # type: ignore[no-any-return]


prange = numba.prange


def max_threads() -> int:
    """Threads the pool was started with: the cores this process may use, or NUMBA_NUM_THREADS."""
    return int(numba.config.NUMBA_NUM_THREADS)


def use_threads(count: int, most: int | None = None) -> None:
    """Let the parallel kernels called from this thread use `count` threads, in a fork of a process that had several one.

    most: as many as the same caller may use at other times. Where that is several, a single thread runs the code for several,
    or a program that goes from one number to the other would have to compile everything twice.
    """
    count, most = (min(number, max_threads()) for number in (count, count if most is None else most))
    _chosen.wanted = pool.usable(count), pool.usable(most) > 1


def _in_use() -> tuple[int, bool]:
    """How many threads the parallel kernels called from this thread use, and whether they run the code for several."""
    chosen: tuple[int, bool] | None = getattr(_chosen, "wanted", None)
    if chosen is None:
        if pool.usable(2) == 1:
            return 1, False
        pool.layer()
        chosen = int(numba.get_num_threads()), int(numba.get_num_threads()) > 1
    return chosen


def threads_in_use() -> int:
    """How many the parallel kernels called from this thread use."""
    return _in_use()[0]


@contextlib.contextmanager
def one_thread(only_if: bool = True) -> Iterator[None]:
    """Parallel kernels called inside use one thread: work that is too little to be worth a meeting."""
    count, several = _in_use()
    if only_if:
        use_threads(1)
    try:
        yield
    finally:
        use_threads(count, 2 if several else 1)


@contextlib.contextmanager
def watch_compiling(started: Callable[[], None]) -> Iterator[None]:
    """Call `started` whenever one of our kernels begins to compile, or another process is about it (not when it is on disk)."""
    with watching.told({kernel.function.__code__ for kernel in KERNELS.values()}, started):
        yield
