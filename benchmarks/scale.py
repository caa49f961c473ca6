"""What a frame costs against the number of discs and of threads: `python -m benchmarks scale`.

The scene `cage` falls until it has settled. The second of its fall that costs most and the settled heap are each kept, and the
same frames are run again on 1, 2, 4, ... threads, in turn and several times. Any number of threads gives the same bits, so of
each frame the shortest time counts, in which others took least of the machine: on one thread its processor time, on several that
of the clock, with the part of their processors that they had. To these are fitted

    T(n) = c0 + c1 n        T(n) ~ n^b        T(p) = T(1) (s + (1 - s) / p)

with n discs and p threads: c0 is what any frame costs, s is Amdahl's serial share.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time, thread_time
from typing import Any

import numpy as np

import pyverlet as pv
from benchmarks import roofline
from benchmarks.engines import DT
from benchmarks.own import SETTLED_REBUILDS
from benchmarks.tables import write
from pyverlet.common.threads import max_threads
from pyverlet.world.team import Team, ladder

LEAST = 1_000
LARGEST = 100_000
LEAST_SECONDS = 5.0
"""Of a fall, at least."""

ROUNDS, MOST_ROUNDS = 5, 15
"""Turns of each; more where others have the processors."""

QUIET = 0.9
"""Part of its processors that a frame on several threads has to have had, to be believed."""

TURN_SECONDS = 0.3
"""A turn has frames for about so long, within these bounds."""
FEWEST, MOST = 8, 60

UNCOUNTED = 2
"""Frames that begin a turn and are not counted: they find nothing in the caches, and a world that was taken up anew."""


@dataclass(frozen=True)
class Row:
    """One heap on so many threads.

    Attributes:
        cores: part of its threads' processors that the process had; if that is less than QUIET, ms says little.
        alone: part of the frame in which a single thread had something to do, by `world.profile`.
        mean, largest: overlap, as fractions of the diameter. spread: largest radius over the smallest.
    """

    motion: str
    particles: int
    threads: int
    ms: float
    ns_per_particle_substep: float
    cores: float
    alone: float
    substeps: int
    spread: float
    mean: float
    largest: float


class Exactly(Team):
    """A team of as many threads as are asked for."""

    def size(self, most: int, frame_ms: float) -> int:
        return most


def sizes(largest: int) -> list[int]:
    """1,000, 3,000, 10,000, ... and the largest."""
    steps = [round(each) for k in range(20) for each in (10.0**k, 3 * 10.0**k)]
    return sorted({*(n for n in steps if LEAST <= n < largest), largest})


def fall(particles: int) -> tuple[pv.World, Any, Any]:
    """A world of the scene `cage`; what it was at the start of the second that cost the most processor time; and settled."""
    world = pv.scenes.get("cage").world(particles=particles)
    worst, most, moved = None, 0.0, True
    while moved or world.time < LEAST_SECONDS:
        start, rebuilds, spent = world.save(), world.rebuilds, thread_time()
        for _ in range(round(1 / DT)):
            world.step(DT)
        if (spent := thread_time() - spent) > most:
            worst, most = start, spent
        moved = world.rebuilds - rebuilds > SETTLED_REBUILDS / DT
    return world, worst, world.save()


def replay(world: pv.World, start: Any, threads: int, frames: int) -> tuple[Any, float]:
    """(2, frames) seconds of each by the clock and by processors; part of the time in which one thread was at work."""
    world.restore(start)
    world.threads = threads
    seconds, alone, whole = np.zeros((2, frames)), 0.0, 0.0
    for k in range(-UNCOUNTED, frames):
        spent, begin = process_time(), perf_counter()
        world.step(DT)
        if k >= 0:
            seconds[:, k] = perf_counter() - begin, process_time() - spent
            alone += sum(ms for stage, ms in world.profile.stages.items() if stage not in world.profile.threads)
            whole += world.profile.frame_ms
    return seconds, alone / whole


def shortest(tries: Sequence[tuple[Any, float]], threads: int) -> tuple[float, float]:
    """Milliseconds of a frame, each the shortest of several tries; part of the processors that those had."""
    clock, spent = np.array([seconds for seconds, _ in tries]).transpose(1, 0, 2)
    if threads == 1:
        return 1e3 * float(spent.min(axis=0).mean()), 1.0
    best = clock.argmin(axis=0), np.arange(clock.shape[1])
    return 1e3 * float(clock[best].mean()), float(spent[best].sum() / (threads * clock[best].sum()))


def costs(world: pv.World, motion: str, start: Any, counts: Sequence[int]) -> Iterator[Row]:
    """The frames from `start` on, on each of these numbers of threads, in turn."""
    world._team = Exactly()
    once = replay(world, start, counts[-1], FEWEST)[0][0].mean()
    frames = int(np.clip(TURN_SECONDS / once, FEWEST, MOST))
    tries: dict[int, list[tuple[Any, float]]] = {threads: [] for threads in counts}
    for turn in range(MOST_ROUNDS):
        for threads in counts:
            if turn < ROUNDS or shortest(tries[threads], threads)[1] < QUIET:
                tries[threads].append(replay(world, start, threads, frames))
    overlap, spread = world.overlap(), float(world.radius.max() / world.radius.min())
    for threads in counts:
        ms, cores = shortest(tries[threads], threads)
        alone = min(alone for _, alone in tries[threads])
        shape = (world.substeps, spread, overlap.mean, overlap.max)
        yield Row(motion, len(world), threads, ms, 1e6 * ms / (len(world) * world.substeps), cores, alone, *shape)


# ---- fits --------------------------------------------------------------------------------------------------------------------


def line(n: Sequence[float], ms: Sequence[float]) -> tuple[float, float]:
    """c0 and c1 of ms = c0 + c1 n with the least squares of relative errors; c0 is not below 0."""
    weight = 1.0 / np.asarray(ms)
    rows = np.column_stack((weight, weight * np.asarray(n)))
    c0, c1 = np.linalg.lstsq(rows, np.ones(len(weight)), rcond=None)[0]
    if c0 < 0.0:
        c0, c1 = 0.0, rows[:, 1].sum() / (rows[:, 1] ** 2).sum()
    return float(c0), float(c1)


def exponent(n: Sequence[float], ms: Sequence[float]) -> float:
    """b of ms ~ n^b: the slope of logarithms."""
    return float(np.polyfit(np.log(n), np.log(ms), 1)[0])


def serial_share(ms: Mapping[int, float]) -> float:
    """s of T(p) = T(1) (s + (1 - s) / p) with the least squares of T(p) / T(1), by threads p."""
    away = np.array([1.0 - 1.0 / p for p in ms if p > 1])
    slower = np.array([t / ms[1] - 1.0 / p for p, t in ms.items() if p > 1])
    return float((away * slower).sum() / (away**2).sum())


def fits(rows: Sequence[Row]) -> Iterator[str]:
    """A sentence for each fit."""
    for motion in dict.fromkeys(row.motion for row in rows):
        mine = [row for row in rows if row.motion == motion]
        for threads in sorted({row.threads for row in mine}):
            n, ms = zip(*((row.particles, row.ms) for row in mine if row.threads == threads), strict=True)
            if len(n) > 2:
                c0, c1 = line(n, ms)
                yield (
                    f"{motion}, threads {threads}: {c0:.3f} ms + {1e6 * c1:.1f} ns a disc, as n^{exponent(n, ms):.3f}"
                    f"; {1e6 * c1 / mine[0].substeps:.1f} ns a disc and substep"
                )
        for particles in sorted({row.particles for row in mine}):
            these = {row.threads: row for row in mine if row.particles == particles}
            most = max(these)
            if these[most].cores < QUIET:
                yield f"{motion}, {particles:,} discs: others had {1 - these[most].cores:.0%} of {most} processors: no share"
            elif most > 1:
                times = {threads: row.ms for threads, row in these.items()}
                yield (
                    f"{motion}, {particles:,} discs: serial share {serial_share(times):.1%}, "
                    f"{times[1] / times[most]:.2f} times as fast on {most} threads as on one"
                )


# ---- the table and the picture -----------------------------------------------------------------------------------------------

HEAD = (
    f"{'motion':<9}{'discs':>10}{'threads':>8}{'ms a frame':>12}{'ns, disc and substep':>22}{'processors had':>16}"
    f"{'one at work':>13}{'substeps':>10}{'radii':>7}{'overlap':>9}{'max':>7}"
)


def text(row: Row) -> str:
    """A line of the table."""
    return (
        f"{row.motion:<9}{row.particles:>10,}{row.threads:>8}{row.ms:>12.3f}{row.ns_per_particle_substep:>22.2f}"
        f"{row.cores:>16.0%}{row.alone:>13.0%}{row.substeps:>10}{f'1:{row.spread:.3g}':>7}{row.mean:>9.3%}{row.largest:>7.1%}"
    )


def plot(rows: Sequence[Row], path: Path) -> None:
    """Two pictures: ms a frame against discs with the fits, and times as fast against threads with Amdahl's law."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    colours, counts = ("#0072B2", "#D55E00", "#009E73", "#56B4E9", "#CC79A7", "#999999"), sorted({row.threads for row in rows})
    for motion, dashes in (("settled", "-"), ("falling", "--")):
        for threads, colour in zip(counts, colours, strict=False):
            mine = [row for row in rows if (row.motion, row.threads) == (motion, threads)]
            if not mine:
                continue
            n, ms = np.array([row.particles for row in mine]), [row.ms for row in mine]
            mark, name = "o" if motion == "settled" else "^", f"{motion}, {threads} thread{'s' * (threads > 1)}"
            left.loglog(n, ms, mark, color=colour, fillstyle="full" if motion == "settled" else "none", label=name)
            if len(mine) > 2:
                c0, c1 = line(n.tolist(), ms)
                along = np.geomspace(n[0], n[-1], 100)
                left.loglog(along, c0 + c1 * along, dashes, color=colour, linewidth=0.8)
    left.axhline(1e3 / 60, color="k", linewidth=0.7)
    left.annotate("60 frames a second", (LEAST, 1e3 / 60), xytext=(0, 3), textcoords="offset points", fontsize=8)
    left.set(xlabel="discs", ylabel="ms a frame", title="Frames of the scene cage; lines: c0 + c1 n")
    along = np.geomspace(1, max(*counts, 2), 50)
    several = sorted({row.particles for row in rows if row.threads > 1})
    for particles, colour in zip(several[-len(colours) :], colours, strict=False):
        for motion, mark, dashes in (("settled", "o", "-"), ("falling", "^", "--")):
            these = [row for row in rows if (row.motion, row.particles) == (motion, particles)]
            times = {row.threads: row.ms for row in these}
            fill, name = "full" if motion == "settled" else "none", f"{particles:,} {motion}"
            quiet = min(row.cores for row in these) >= QUIET
            label = None if quiet else f"{name}, disturbed"
            right.plot(list(times), [times[1] / t for t in times.values()], mark, color=colour, fillstyle=fill, label=label)
            if quiet:
                share = serial_share(times)
                label = f"{name}, serial {share:.0%}"
                right.plot(along, 1 / (share + (1 - share) / along), dashes, color=colour, linewidth=0.8, label=label)
    right.plot(along, along, ":", color="k", linewidth=0.7)
    right.set(xlabel="threads", ylabel="times as fast as one", title="Lines: 1 / (s + (1 - s) / p)", xticks=counts)
    for axes in (left, right):
        axes.grid(which="major", alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7)
    figure.savefig(path, dpi=120)


def main(largest: int, threads: int | None, table: Path | None, picture: Path | None) -> None:
    """Print a line for each heap, the fits, and how far that is from what memory allows."""
    print(f"each frame by the shortest of several times; falling: the costliest second of the fall\n{HEAD}")
    rows: list[Row] = []
    for particles in sizes(largest):
        world, worst, settled = fall(particles)
        world.threads = threads or max_threads()
        counts = ladder(world.threads)  # fewer where a world is too small for several
        for motion, start in (("settled", settled), ("falling", worst)):
            for row in costs(world, motion, start, counts):
                rows.append(row)
                print(text(row), flush=True)
        world.restore(settled)
    print()
    for sentence in fits(rows):
        print(sentence)
    roofline.main(world, counts)
    write(rows, table)
    if picture:
        plot(rows, picture)
