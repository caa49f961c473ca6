"""Compile what a world needs before it is shown or timed, telling how far it is, with several processes if there are cores."""

from __future__ import annotations

import atexit
import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.ground.file_lock import PATIENCE_S
from pyverlet.kernels import frame
from pyverlet.kernels.kinds import BOUNCING, HEARD, ROUGH, SMOOTH
from pyverlet.world.rehearsals import PARTS, rehearse
from pyverlet.world.world import World

OF_CIRCLES = (
    "bounce", "bounds", "cage", "clusters", "contact", "contacts", "frame", "friction", "grid", "impacts", "leaving", "loans",
    "measure", "motion", "packs", "pairs", "refine", "sweeps",
)  # fmt: skip
"""Modules of the kernels that every world of circles may need: how many there are is what progress is measured by."""

MOST_HELPERS = 3
"""Processes that help to compile: beyond that the longest part is what takes the time."""

OTHER_KINDS = (HEARD, BOUNCING, ROUGH, *(f"{beside}_{SMOOTH}" for beside in frame.BESIDE if beside))
"""How the names of kernels end that a plain world of smooth circles does not need, nor its like of another kind."""

Progress = Callable[[int, int], None]


class Rest(Enum):
    """When to compile what a world needs only once settings are changed."""

    NOW, LATER, NEVER = range(3)


def warm_up(world: World, progress: Progress | None = None, *, settings: bool = True) -> float:
    """Compile or load every kernel this world may need, without touching it.

    The first time on a machine that is done on all cores, for one thread, or for several if the world uses several. The compiled
    code is kept on disk, and later only what is in use is loaded. What links, obstacles, a ledger, events and sleep need is
    compiled for a world that has them.

    Args:
        world: the world about to be stepped.
        progress: called as progress(done, total) when a kernel begins to compile; not at all if none needs to.
        settings: compile also what circles of its dtype need in other rooms, of other materials and masses, so that nothing
            stalls when that is changed later: it takes two to three times as long.

    Returns:
        Seconds spent.
    """
    return _warm_up(world, progress, Rest.NOW if settings else Rest.NEVER)


def warm_up_to_show(world: World, progress: Progress | None = None) -> float:
    """The same, without waiting for what settings need: other processes, which stand back for all others, go on with that.

    They end with this one. Where none can be started, what is changed to compiles what it needs.
    """
    return _warm_up(world, progress, Rest.LATER)


def _warm_up(world: World, progress: Progress | None, rest: Rest) -> float:
    start, missing = time.perf_counter(), _missing(world.dtype, world.threads)
    total, done, helpers = _expected(rest), 0, list[_Helper]()
    with contextlib.ExitStack() as ending:

        @cache
        def call_helpers() -> None:
            if missing:
                about = world.dtype, world.threads, len(missing)
                helpers.extend(ending.enter_context(_helping(*about, stay=rest is Rest.LATER)))

        def started() -> None:
            nonlocal done
            done += 1
            call_helpers()
            if progress:  # of what helpers compile most is for later, if anything is
                progress(min(done + sum(helper.done for helper in helpers if rest is Rest.NOW), total), total)

        with jit.watch_compiling(started):
            if rest is Rest.NOW:
                call_helpers()
                _compile(world.dtype, world.threads, missing)
            rehearse(world)
        if rest is Rest.LATER:
            call_helpers()
    if done and progress:
        progress(total, total)
    return time.perf_counter() - start


def _expected(rest: Rest) -> int:
    """About how many kernels are to be compiled: of circles, and if only one world's, of one kind without services."""
    found = [name.rpartition(".") for name in jit.KERNELS if name.split(".")[-2] in OF_CIRCLES]
    return sum(rest is Rest.NOW or not name.endswith(OTHER_KINDS) for _, _, name in found)


# ---- the first time ----------------------------------------------------------------------------------------------------


def _compile(dtype: np.dtype[Any], threads: int, parts: list[str]) -> None:
    """Compile these parts, but for those that other processes compile meanwhile."""
    patience = 0.0
    while parts:
        later = []
        for part in parts:
            with jit.turn(f"{_kind(dtype, threads)} {part}", patience) as mine:
                if _done(dtype, threads, part):
                    continue
                if not (mine or patience):
                    later.append(part)
                    continue
                PARTS[part](dtype, threads)
                _remember(dtype, threads, part)
        # All that is left others have begun. If one of them gives up, its turn is free.
        parts, patience = later, PATIENCE_S


def _kind(dtype: np.dtype[Any], threads: int) -> str:
    return f"compiled-{dtype.name}{'-threads' if threads > 1 else ''}"


def _marker(dtype: np.dtype[Any], threads: int, part: str) -> Path | None:
    folder = jit.cache_dir()
    return folder / _kind(dtype, threads) / part if folder else None


def _done(dtype: np.dtype[Any], threads: int, part: str) -> bool:
    marker = _marker(dtype, threads, part)
    return marker is not None and marker.exists()


def _missing(dtype: np.dtype[Any], threads: int) -> list[str]:
    return [part for part in PARTS if not _done(dtype, threads, part)]


def _remember(dtype: np.dtype[Any], threads: int, part: str) -> None:
    marker = _marker(dtype, threads, part)
    if marker is not None:
        with contextlib.suppress(OSError):
            marker.parent.mkdir(exist_ok=True)
            marker.touch()


# ---- other processes -----------------------------------------------------------------------------------------------------


_ASIDE = getattr(subprocess, "CREATE_NO_WINDOW", 0) | getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
"""On Windows, no window, and others have the cores first."""

_STAND_BACK = 10
"""The same elsewhere, as for `os.nice`."""


class _Helper:
    """A process that compiles parts into the same folder, and ends with us. Whatever becomes of it, we compile the rest.

    Attributes:
        done: kernels it has begun to compile.
    """

    def __init__(self, dtype: np.dtype[Any], threads: int) -> None:
        folder = jit.cache_dir()
        assert folder is not None
        ours = str(Path(__file__).parents[2])
        env = {
            **os.environ,
            "PYVERLET_CACHE_DIR": str(folder.parent),
            "PYTHONPATH": os.pathsep.join(filter(None, (ours, os.environ.get("PYTHONPATH")))),
        }
        code = f"from pyverlet.world.warmup import help_compiling; help_compiling({dtype.name!r}, {threads})"
        # Not multiprocessing: it would run the user's own script again. -P: nor take the user's files for modules.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", code], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, creationflags=_ASIDE,
        )  # fmt: skip
        self.done = 0
        self._reader = threading.Thread(target=self._count, daemon=True)
        self._reader.start()

    def _count(self) -> None:
        assert self._process.stdout is not None
        while self._process.stdout.read(1):
            self.done += 1

    @property
    def busy(self) -> bool:
        """Whether it has not come to its end."""
        return self._process.poll() is None

    def end(self) -> None:
        """Nothing is left to do."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()


_staying: list[_Helper] = []
"""Helpers that go on when we do not wait for them any longer."""


@atexit.register
def _send_away() -> None:
    while _staying:
        _staying.pop().end()


@contextlib.contextmanager
def _helping(dtype: np.dtype[Any], threads: int, parts: int, *, stay: bool = False) -> Iterator[list[_Helper]]:
    """Helpers, as many as there are cores and parts for; none where they would not be Python, or could not hand anything over.

    Only one process at a time has helpers: of many that start at once each would bring its own. stay: they go on afterwards, one
    of them even if there is but one core.
    """
    least, helpers = int(stay), list[_Helper]()
    count = min(max(jit.max_threads() - 1, least), parts - 1 + least, MOST_HELPERS)
    if stay and any(helper.busy for helper in _staying):
        count = 0
    with jit.turn("helpers", 0.0) as mine:
        try:
            if mine and jit.cache_dir() and _python():
                with contextlib.suppress(OSError):
                    helpers.extend(_Helper(dtype, threads) for _ in range(count))
            yield helpers
            if stay:
                _staying.extend(helpers)
        finally:
            for helper in helpers:
                if helper not in _staying:
                    helper.end()


def _python() -> bool:
    """Whether `sys.executable` is Python, and not a program that Python was built into."""
    return bool(sys.executable) and not getattr(sys, "frozen", False) and Path(sys.executable).stem.lower().startswith("py")


def help_compiling(dtype: str, threads: int) -> None:
    """What a helper does: compile parts, and write a byte whenever a kernel begins to. Whoever else wants a core has it first."""
    if hasattr(os, "nice"):
        os.nice(_STAND_BACK)

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    kind = np.dtype(dtype)

    def started() -> None:
        os.write(1, b".")

    with jit.watch_compiling(started):
        _compile(kind, threads, _missing(kind, threads))
