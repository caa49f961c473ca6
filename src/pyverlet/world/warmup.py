"""Compile what a world needs before it is shown or timed, telling how far it is, with several processes if there are cores."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.ground.file_lock import PATIENCE_S
from pyverlet.world.rehearsals import PARTS, rehearse
from pyverlet.world.world import World

OF_CIRCLES = (
    "bounce", "bounds", "cage", "clusters", "contact", "contacts", "frame", "friction", "grid", "impacts", "leaving", "loans",
    "measure", "motion", "packs", "pairs", "refine", "sweeps",
)  # fmt: skip
"""Modules of the kernels that every world of circles may need: how many there are is what progress is measured by."""

MOST_HELPERS = 3
"""Processes that help to compile: beyond that the longest part is what takes the time."""

Progress = Callable[[int, int], None]


def warm_up(world: World, progress: Progress | None = None) -> float:
    """Compile or load every kernel this world may need, without touching it.

    The first time on a machine all kernels that circles of the world's dtype need are compiled, so that nothing stalls when a
    setting is changed later: for one thread, or for several if the world uses several, and on all cores. Those of links,
    obstacles, the ledger and sleep are compiled when a world has them first. The compiled code is kept on disk, and later only
    what is in use is loaded.

    Args:
        world: the world about to be stepped.
        progress: called as progress(done, total) when a kernel begins to compile; not at all if none needs to.

    Returns:
        Seconds spent.
    """
    start = time.perf_counter()
    total = sum(name.split(".")[-2] in OF_CIRCLES for name in jit.KERNELS)
    done = 0
    helpers: list[_Helper] = []

    def started() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(min(done + sum(helper.done for helper in helpers), total), total)

    with jit.watch_compiling(started):
        if missing := _missing(world.dtype, world.threads):
            with _helping(world.dtype, world.threads, len(missing)) as helpers:
                _compile(world.dtype, world.threads, missing)
        rehearse(world)
    if done and progress:
        progress(total, total)
    return time.perf_counter() - start


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
            stderr=subprocess.DEVNULL, creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )  # fmt: skip
        self.done = 0
        self._reader = threading.Thread(target=self._count, daemon=True)
        self._reader.start()

    def _count(self) -> None:
        assert self._process.stdout is not None
        while self._process.stdout.read(1):
            self.done += 1

    def end(self) -> None:
        """Nothing is left to do."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()


@contextlib.contextmanager
def _helping(dtype: np.dtype[Any], threads: int, parts: int) -> Iterator[list[_Helper]]:
    """Helpers, as many as there are cores and parts for; none where they would not be Python, or could not hand anything over.

    Only one process at a time has helpers: of many that start at once each would bring its own.
    """
    count = min(jit.max_threads() - 1, parts - 1, MOST_HELPERS)
    helpers: list[_Helper] = []
    with jit.turn("helpers", 0.0) as mine:
        try:
            if mine and jit.cache_dir() and _python():
                with contextlib.suppress(OSError):
                    helpers.extend(_Helper(dtype, threads) for _ in range(count))
            yield helpers
        finally:
            for helper in helpers:
                helper.end()


def _python() -> bool:
    """Whether `sys.executable` is Python, and not a program that Python was built into."""
    return bool(sys.executable) and not getattr(sys, "frozen", False) and Path(sys.executable).stem.lower().startswith("py")


def help_compiling(dtype: str, threads: int) -> None:
    """What a helper does: compile parts, and write a byte whenever a kernel begins to."""

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    kind = np.dtype(dtype)

    def started() -> None:
        os.write(1, b".")

    with jit.watch_compiling(started):
        _compile(kind, threads, _missing(kind, threads))
