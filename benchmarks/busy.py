"""Frames beside other programs: `python -m benchmarks busy`.

On every core but one, then on every core, a process counts without end. The same world is stepped meanwhile on one thread and on
as many as pyverlet chooses, in turns, so that both meet the same machine.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT
from benchmarks.tables import timed
from pyverlet.common.threads import max_threads

TURNS = 8
"""Of each world; a turn is long enough for the threads of the other to have gone to sleep."""

SETTLE_SECONDS = 6.0

MEDIAN, LATE = 1.25, 2.0
"""Times that of one thread: the median of a frame, and its 95th percentile."""


@dataclass(frozen=True)
class Row:
    """A world beside so many busy processes. Times in ms, (median, 95th percentile, largest)."""

    world: str
    busy: int
    one: tuple[float, float, float]
    default: tuple[float, float, float]
    passed: bool

    def __str__(self) -> str:
        def told(times: tuple[float, float, float]) -> str:
            return " / ".join(f"{ms:.2f}" for ms in times)

        ratio = ", ".join(f"{b / a:.2f}" for a, b in zip(self.one[:2], self.default[:2], strict=True))
        said = "" if self.passed else "FAIL"
        return f"{self.world:<16}{self.busy:>5}  {told(self.one):<24} {told(self.default):<24} {ratio:<14}{said}"


@contextmanager
def busy(count: int) -> Iterator[None]:
    """So many processes that do nothing but count."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def worlds(particles: int) -> dict[str, Callable[[], pv.World]]:
    """By name."""

    def ten() -> pv.World:
        world = pv.World(boundary=pv.Circle(radius=5), ledger=True)
        world.add(position=np.stack(np.divmod(np.arange(10), 4), axis=-1) - 1.5)
        return world

    scene = pv.scenes.get
    return {
        "cage": lambda: scene("cage").world(particles=particles),
        "soft-bodies": lambda: scene("soft-bodies").world(particles=particles),
        "ten, a ledger": ten,
    }


def quantiles(times: list[float]) -> tuple[float, float, float]:
    """(median, 95th percentile, largest)."""
    return float(np.median(times)), float(np.quantile(times, 0.95)), max(times)


def measure(name: str, build: Callable[[], pv.World], counts: tuple[int, ...], frames: int) -> Iterator[Row]:
    """One world beside so many busy processes after the other."""
    pair = []
    for threads in (1, None):
        pair.append(world := build())
        world.threads = threads
        world.run(seconds=SETTLE_SECONDS if len(world) > 100 else 1.0, dt=DT)
    for count in counts:
        times: list[list[float]] = [[], []]
        with busy(count):
            for _ in range(TURNS):
                for world, spent in zip(pair, times, strict=True):
                    spent += [timed(partial(world.step, DT)) for _ in range(max(frames // TURNS, 1))]
        one, default = map(quantiles, times)
        holds = default[0] <= MEDIAN * one[0] and default[1] <= LATE * one[1]
        yield Row(name, count, one, default, holds)


def main(particles: int, frames: int) -> bool:
    """Print a line for each; whether all hold."""
    cores = max_threads()
    counts = tuple(sorted({0, max(cores - 1, 1), cores}))
    print(f"ms a frame, median / 95th percentile / largest; default at most {MEDIAN:g} and {LATE:g} times one thread's")
    print(f"{'world':<16}{'busy':>5}  {'one thread':<24}{'default':<24}{'ratio':<14}")
    rows = []
    for name, build in worlds(particles).items():
        for row in measure(name, build, counts, frames):
            rows.append(row)
            print(row, flush=True)
    return all(row.passed for row in rows)
