"""Ours alone, the second half of `python -m benchmarks links`: scenes, a cloth of 100,000 circles, links that come and go.

Frames are said by their median, their 95th percentile and the longest: one frame of a hundred that comes late is seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT, Array
from benchmarks.links import Linked, Pyverlet, cloth
from benchmarks.tables import timed, write

SCENES = {"newton-cradle": 0.15, "wrecking-ball": 0.5, "rope-bridge": 0.3}
"""Scenes, and ms a frame that they may take on one thread."""

WITH_LEDGER = 1.5
"""Times as long as without."""

SCREEN_MS = 16.7
"""A frame of a screen that shows 60 a second."""

PER_FRAME = 167
"""Links that come in a frame, and as many that go: 10,000 a second of each."""

STAY = 30
"""Frames that they stay."""


@dataclass(frozen=True)
class Frames:
    """What the frames of a world took."""

    world: str
    threads: int
    median: float
    late: float
    longest: float
    asked: float

    def __str__(self) -> str:
        return f"{self.world:<58}{self.threads:>8}{self.median:>10.3f}{self.late:>10.3f}{self.longest:>10.3f}{self.asked:>10.3g}"


def _frames(name: str, threads: int, asked: float, step: Callable[[], None], count: int) -> Frames:
    spent = [timed(step) for _ in range(count)]
    return Frames(name, threads, float(np.median(spent)), float(np.quantile(spent, 0.95)), max(spent), asked)


def scenes() -> list[Frames]:
    """Each with and without a ledger, on one thread."""
    found = []
    for name, asked in SCENES.items():
        without = 0.0
        for ledger in (False, True):
            world = pv.scenes.get(name).world(ledger=ledger)
            world.threads = 1
            world.run(seconds=2.0, dt=DT)
            label = f"{name}, with a ledger" if ledger else name
            found.append(_frames(label, 1, WITH_LEDGER * without if ledger else asked, lambda w=world: w.step(DT), 600))  # type: ignore[misc]
            without = found[-1].median
    return found


def large_cloth(side: int = 317) -> list[Frames]:
    """Sticks across and down, springs on one diagonal of each square: three links a circle."""
    what = cloth(side, side, side * 9 // 50)
    what = replace(what, springs=what.springs[: len(what.springs) // 2])
    found = []
    for threads in (1, 2):
        world = Pyverlet(what, threads=threads).world
        world.run(seconds=0.5, dt=DT)
        name = f"cloth, {len(what.position):,} circles, {what.links:,} links"
        found.append(_frames(name, threads, SCREEN_MS if threads == 2 else np.inf, lambda w=world: w.step(DT), 60))  # type: ignore[misc]
        mean, most = what.stretch(world.position)
    print(f"stretch of the large cloth's sticks {mean:.4%} in the mean, {most:.2%} at most")
    return found


class Passing:
    """A cloth of which springs come and go, a frame's as one object or each by itself."""

    def __init__(self, what: Linked, columns: int, *, single: bool) -> None:
        self._world, self._single = Pyverlet(what, threads=2).world, single
        (self._group,) = self._world.groups
        self._rng, self._columns, self._there = np.random.default_rng(1), columns, list[pv.Spring]()

    def _join(self, a: int | Array, b: int | Array) -> None:
        self._there.append(self._world.links.append(pv.Spring(self._group, a, b, stiffness=1.0, collide=False)))

    def step(self) -> None:
        """A frame, with what comes and goes in it."""
        low = self._rng.integers(0, len(self._world) - 3 * self._columns, PER_FRAME)
        if self._single:
            for a in low.tolist():
                self._join(a, a + 2 * self._columns)
        else:
            self._join(low, low + 2 * self._columns)
        while len(self._there) > (STAY * PER_FRAME if self._single else STAY):
            self._world.links.remove(self._there.pop(0))
        self._world.step(DT)


def passing() -> list[Frames]:
    """Beside 20,346 links that stay."""
    found, columns = [], 100
    for single in (False, True):
        world = Passing(cloth(columns, 52, 18), columns, single=single)
        for _ in range(2 * STAY):
            world.step()
        name = f"cloth, {PER_FRAME} springs in and out a frame, {'each by itself' if single else 'as one object'}"
        found.append(_frames(name, 2, SCREEN_MS, world.step, 180))
    return found


def main(path: Path | None) -> None:
    """Print the table; write it as CSV and JSON if asked to."""
    rows = [*scenes(), *large_cloth(), *passing()]
    print(f"\n{'ours alone':<58}{'threads':>8}{'ms':>10}{'95 %':>10}{'longest':>10}{'asked':>10}")
    for row in rows:
        print(row)
    write(rows, path and path.with_stem(f"{path.stem}-frames"))
