"""What worlds cost as data: snapshots of a large one, many small ones at once, and sweeps; asked beside measured."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np

import pyverlet as pv
from pyverlet.common.threads import max_threads
from pyverlet.data import sweep_run

DT = 1 / 60
ROUNDS = 5
MILLION = 1_000_000
SETTLED, SETTLE_S = 50_000, 8.0


class Line(NamedTuple):
    """One promise: what is asked, what was measured, and whether that is enough (None: nothing is asked at this size)."""

    name: str
    asked: str
    measured: str
    holds: bool | None


class Spent(NamedTuple):
    """Seconds of an action, by the clock and of all processors: the first hold others up, the second they do not."""

    clock: float
    cpu: float

    def __str__(self) -> str:
        return f"{self.clock:.3f} s ({self.cpu:.2f} s)"


def spent(action: Callable[[], Any], rounds: int = ROUNDS) -> Spent:
    """Of the fastest round: others wait for the disk or for who else uses the machine."""
    times = []
    for _ in range(rounds):
        begin, begin_cpu = perf_counter(), process_time()
        action()
        times.append(Spent(perf_counter() - begin, process_time() - begin_cpu))
    return Spent(*map(min, zip(*times, strict=True)))


def fastest(action: Callable[[], Any], rounds: int = ROUNDS) -> float:
    """Seconds of the fastest round."""
    return spent(action, rounds).clock


def snapshots(particles: int, folder: Path) -> list[Line]:
    """Save and load a heap: of equal circles, of mixed sizes, and of mixed sizes that rub. Small ones cost what names do.

    Bytes are those of a smaller heap that has settled: of a larger one they are as many a circle.
    """
    asked = particles >= MILLION
    lines = []
    cases: list[tuple[str, dict[str, Any], int]] = [
        ("equal circles", {"radius_spread": 1.0, "restitution": 0.0, "friction": 0.0}, 40),
        ("mixed sizes", {"radius_spread": 2.0, "restitution": 0.0, "friction": 0.0}, 90),
        ("mixed, friction", {"radius_spread": 2.0, "restitution": 0.0, "friction": 0.4}, 120),
    ]
    path = folder / "heap.pvsnap"
    for name, options, most in cases:
        world = pv.scenes.get("box").world(particles=min(particles, SETTLED), **options)
        world.run(seconds=SETTLE_S, dt=DT)
        pv.save(world, path)
        held = path.stat().st_size / len(world)
        world = pv.scenes.get("box").world(particles=particles, **options)
        world.run(seconds=0.5, dt=DT)
        pv.save(world, path)
        assert pv.load(path, exact=True).state_hash() == world.state_hash()
        saving, loading = spent(partial(pv.save, world, path)), spent(partial(pv.load, path))
        lines += [
            Line(f"save, {name}", "<= 0.3 s", f"{saving}", saving.clock <= 0.3 if asked else None),
            Line(f"load, {name}", "<= 0.5 s", f"{loading}", loading.clock <= 0.5 if asked else None),
            Line(f"bytes a circle, {name}", f"<= {most}", f"{held:.1f}", held <= most if asked else None),
        ]
    return lines


def trajectory(particles: int, folder: Path) -> list[Line]:
    """A frame of a film of all circles, of places and velocities, on the disk."""
    world = pv.scenes.get("box").world(particles=particles, radius_spread=2.0)
    frames = 2 * ROUNDS
    with pv.Trajectory(folder / "film.gsd") as film:
        film.add(world)  # with what does not change

        def add() -> None:
            film.add(world)

        times = []
        for _ in range(frames):
            world.step(DT)
            times.append(spent(add, 1))
    adding = Spent(*map(min, zip(*times, strict=True)))
    return [Line("a frame of a .gsd", "<= 0.25 s", f"{adding}", adding.clock <= 0.25 if particles >= MILLION else None)]


def resident() -> int:
    """Bytes of this process in memory; 0 where nobody says."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def worlds(count: int) -> list[Line]:
    """Many worlds of 100 circles: by themselves on one core, on all cores as threads and as processes, in turn."""
    loose = [pv.scenes.get("cage").world(particles=100, seed=k, threads=1) for k in range(count)]
    for world in loose[:3]:
        world.step(DT)
    before = resident()
    alone = pv.Worlds("cage", count, particles=100, processes=1)
    start = alone.save()
    alone.step(DT)
    each = (resident() - before) / count
    cores = max_threads()

    def step_loose() -> None:
        for world in loose:
            world.step(DT)

    with pv.Worlds("cage", count, particles=100, processes=cores) as together:
        for _ in range(3):
            alone.step(DT)
            together.step(DT)
            step_loose()
        steps: tuple[Callable[[], None], ...] = (step_loose, lambda: alone.step(DT), lambda: together.step(DT))
        times = [[fastest(step, 1) for step in steps] for _ in range(8 * ROUNDS)]
        one, threads, processes = (min(column) for column in zip(*times, strict=True))
    reset_s = fastest(lambda: alone.restore(start, 7))
    least = 0.85 * cores
    paces = {"threads": one / threads, "processes": one / processes}
    return [
        *(
            Line(f"pace of {name} over one core", f">= {least:.2f}", f"{pace:.2f}", pace >= least if cores > 1 else None)
            for name, pace in paces.items()
        ),
        Line("a frame of a world of 100", "", f"{1e6 * one / count:.1f} us", None),
        Line("reset of one", "<= 0.5 ms", f"{1e3 * reset_s:.3f} ms", reset_s <= 0.5e-3),
        Line("memory of one, with its start", "<= 130 KiB", f"{each / 1024:.0f} KiB", each <= 130 * 1024),
    ]


def discs(settings: pv.scenes.Settings) -> pv.World:
    """Twenty rough discs that fall in a box."""
    rough: dict[str, Any] = {"friction": 0.5, "restitution": 0.3}
    world = pv.World(boundary=pv.Box((-3, -3), (3, 3), **rough), collisions=pv.Collisions(**rough), threads=1)
    chance, (x, y) = np.random.default_rng(settings.seed), np.divmod(np.arange(20), 4)
    place = 0.55 * np.column_stack((x - 2.0, y - 1.5)) + chance.uniform(-0.02, 0.02, (20, 2))
    world.add(position=place, velocity=chance.uniform(-1, 1, (20, 2)), radius=0.25)
    return world


def many_small_worlds(count: int) -> list[Line]:
    """Worlds of twenty discs, in flight and when they have come to rest."""
    many, lines = pv.Worlds(pv.scenes.Scene("discs", "", discs), count, processes=1), []
    for name, frames in (("in flight", 4), ("at rest", 240)):
        many.run(seconds=frames * DT, dt=DT)
        ms = 1e3 * fastest(lambda: many.step(DT), 2 * ROUNDS)
        asked = 12 * count / 10_000
        lines.append(Line(f"{count:,} worlds of 20 discs {name}", f"<= {asked:.3g} ms", f"{ms:.1f} ms", ms <= asked))
    return lines


def sweeps(folder: Path, runs: int, rows: int) -> list[Line]:
    """What a run costs beside its simulation, and how soon a study that is done is back."""
    study = pv.sweep("box", {"seed": range(runs)}, particles=20, seconds=0.1, out=folder / "study")

    def simulate() -> None:
        for run in study._runs[: runs // 10]:
            sweep_run.one(study._plan, run)

    simulate()
    alone = spent(simulate, 3)
    whole = spent(lambda: study.run(processes=1), 1)
    beside = Spent(*(all_s / runs - part_s / (runs // 10) for all_s, part_s in zip(whole, alone, strict=True)))
    large = pv.sweep("box", {"seed": range(rows)}, particles=20, seconds=0.1, out=folder / "large")
    known = {"values": {"height": 1.0}, "start": "0" * 16, "end": "0" * 16}
    lines = [json.dumps({**sweep_run._blank(run), **known}) for run in large._runs]
    (folder / "large" / "rows.jsonl").write_text("\n".join(lines) + "\n")

    def resume() -> None:
        again = pv.sweep("box", {"seed": range(rows)}, particles=20, seconds=0.1, out=folder / "large")
        assert again.status().done == rows

    resumed = spent(resume, 1)
    told = f"{1e3 * beside.clock:.2f} ms ({1e3 * beside.cpu:.2f} ms)"
    return [
        Line("a run beside its simulation", "<= 2 ms", told, beside.clock <= 2e-3),
        Line(f"{rows:,} finished rows are back in", "<= 1 s", f"{resumed}", resumed.clock <= 1.0),
    ]


def load() -> str:
    """How many programs would use a processor, on average of the last minute."""
    return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} processors" if hasattr(os, "getloadavg") else "unknown"


def main(particles: int) -> bool:
    """Print a line for each promise; whether all hold."""
    small = particles < 100_000
    print(f"{particles:,} circles in a snapshot; seconds by the clock (and of all processors); load average {load()}")
    print(f"{'':<36}{'asked':>14}{'measured':>20}")
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts: tuple[Callable[[], list[Line]], ...] = (
            lambda: snapshots(particles, folder),
            lambda: trajectory(particles, folder),
            lambda: worlds(20 if small else 1_000),
            lambda: many_small_worlds(100 if small else 10_000),
            lambda: sweeps(folder, 50 if small else 500, 1_000 if small else 10_000),
        )
        for part in parts:
            for line in part():
                lines.append(line)
                verdict = "  NOT HELD" if line.holds is False and not small else ""
                print(f"{line.name:<36}{line.asked:>14}{line.measured:>20}{verdict}", flush=True)
    print(f"load average {load()}")
    return bool(np.all([line.holds is not False for line in lines])) or small
