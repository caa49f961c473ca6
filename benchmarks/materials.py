"""What circles may be made of, and what a world may be asked to do, beside the smooth heap: `python -m benchmarks materials`.

One settled heap for all, laid out anew for each material and settled again; all take turns in one process, so that the machine's
moods hit them alike. A ratio is that of the quartiles of the faster frames. Overlap stands beside each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT, RADIUS, Array, Box2D, Engine, Heap, Pymunk, PymunkCareful, overlap
from benchmarks.own import times_in_turn
from benchmarks.tables import timed, write

SETTLE_SECONDS = 10.0
"""Each material is given so long to come to terms with the heap in its own way."""

FRAMES = 20
"""Of each world in a turn, at least."""

GAS_FRAMES = 60
"""That is its start: without restitution it has lost half its speed by then."""

MILLION_SECONDS, MILLION_FRAMES = 10.0, 10
"""How long a million have fallen, and how many frames are looked at then."""


@dataclass(frozen=True)
class Row:
    """One world, or one engine, beside the smooth heap of the same kind."""

    world: str
    particles: int
    threads: int
    ms_per_frame: float
    ratio: float
    asked: float
    overlap_mean: float
    overlap_max: float


@dataclass(frozen=True)
class Material:
    """How a heap is made, and how many times the smooth one's time it may take."""

    name: str
    asked: float
    collisions: pv.Collisions
    options: dict[str, Any]
    change: Callable[[pv.World], Any] = lambda world: None


def _radii(ratio: float) -> Callable[[pv.World], None]:
    """Radii uniform in their logarithm, as much area as before, masses by area: started small, for they overlap at first."""

    def change(world: pv.World) -> None:
        position, rng = world.position.copy(), np.random.default_rng(1)
        radius = ratio ** rng.uniform(-1, 0, len(position))
        radius *= RADIUS / np.sqrt((radius**2).mean())
        world.remove(np.ones(len(position), bool))
        world.add(position=position * (1 - radius.max() / world.boundary.extent()[2]), radius=radius)  # type: ignore[index]

    return change


def _masses(ratio: float) -> Callable[[pv.World], None]:
    """Masses uniform in their logarithm."""

    def change(world: pv.World) -> None:
        world.mass[:] = ratio ** np.random.default_rng(1).uniform(0, 1, len(world))

    return change


def _nothing(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return 0.0 * x, 0.0 * y


def _odd(world: pv.World) -> None:
    world.restitution[len(world) // 2] = 0.3
    world.friction[len(world) // 2] = 0.5


def _segment(world: pv.World) -> None:
    extent = world.boundary.extent()
    assert extent is not None
    world.obstacles.append(pv.Segment((-1.0, 0.8 * extent[3]), (1.0, 0.8 * extent[3])))


def _stick(world: pv.World) -> None:
    group = world.add(position=[(-0.5, 0.9 * world.boundary.extent()[3]), (0.5, 0.9 * world.boundary.extent()[3])], radius=0.4)  # type: ignore[index]
    world.links.append(pv.Stick(group, 0, 1))


SMOOTH = pv.Collisions()
BOUNCING, ROUGH, BOTH = pv.Collisions(restitution=0.3), pv.Collisions(friction=0.5), pv.Collisions(restitution=0.3, friction=0.5)

LARGE = (
    Material("smooth", 1.0, SMOOTH, {}),
    Material("e = 0.3", 1.3, BOUNCING, {}),
    Material("mu = 0.5", 1.8, ROUGH, {}),
    Material("e = 0.3, mu = 0.5", 2.2, BOTH, {}),
    Material("radii 1:5, masses 1:25", 1.6, SMOOTH, {}, _radii(5.0)),
    Material("masses 1:100", 1.8, SMOOTH, {}, _masses(100.0)),
    Material("e = 0.3, mu = 0.5, masses 1:100", 3.0, BOTH, {}, _masses(100.0)),
    Material("events", 1.4, SMOOTH, {"events": True}),
    Material("ledger", 1.25, SMOOTH, {"ledger": True}),
    Material("a user's force", 1.2, SMOOTH, {}, lambda world: world.forces.append(pv.force(_nothing))),
    Material("float64", 1.6, SMOOTH, {"dtype": np.float64}),
)
"""Heaps of 20,000."""

SMALL = (
    Material("smooth", 1.0, SMOOTH, {}),
    Material("one odd circle", 1.1, SMOOTH, {}, _odd),
    Material("one segment", 1.3, SMOOTH, {}, _segment),
    Material("one stick", 1.3, SMOOTH, {}, _stick),
    Material("drag", 1.2, SMOOTH, {}, lambda world: world.forces.append(pv.Drag(linear=0.01))),
    Material("sleep (awake)", 1.2, SMOOTH, {"sleep": True}, lambda world: world.forces.append(pv.Wind((0, 0), linear=0.01))),
)
"""Heaps of 1,000."""


def heap(particles: int) -> tuple[Array, float]:
    """Positions of a settled heap of equal smooth discs, and the radius of its cage."""
    world = pv.scenes.get("cage").world(particles=particles)
    world.run(seconds=SETTLE_SECONDS, dt=DT)
    extent = world.boundary.extent()
    assert extent is not None
    return world.position.copy(), float(extent[2])


def build(material: Material, position: Array, cage: float, threads: int) -> pv.World:
    """This heap, of this material, settled."""
    options = {"substeps": 8, "threads": threads} | material.options
    world = pv.World(boundary=pv.Circle(radius=cage), collisions=material.collisions, **options)
    world.add(position=position, radius=RADIUS, mass=1.0)
    material.change(world)
    world.run(seconds=SETTLE_SECONDS, dt=DT)
    return world


def compare(materials: tuple[Material, ...], particles: int, threads: int) -> list[Row]:
    """All of them in turn; the first is what the others are compared with."""
    position, cage = heap(particles)
    worlds = [build(material, position, cage, threads) for material in materials]
    times = times_in_turn([lambda world=world: world.step(DT) for world in worlds], FRAMES)  # type: ignore[misc]
    quick = [float(np.quantile(spent, 0.25)) for spent in times]
    rows = []
    for material, world, ms in zip(materials, worlds, quick, strict=True):
        found = world.overlap()
        rows.append(Row(material.name, len(world), threads, ms, ms / quick[0], material.asked, found.mean, found.max))
    return rows


def gas(particles: int, threads: int) -> list[Row]:
    """A gas that covers 0.3 of its box, which begins without restitution, and with e = 1; frame by frame in turn."""
    cells, rng = int(np.ceil(np.sqrt(particles))), np.random.default_rng(0)
    side = float(np.sqrt(np.pi * particles / 0.3)) * RADIUS
    middle = (np.arange(cells) + 0.5) * side / cells
    place = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)[:particles]
    place = place + rng.uniform(-0.5, 0.5, place.shape) * (side / cells - 2.02 * RADIUS)
    angle = rng.uniform(0, 2 * np.pi, particles)
    worlds, rows = [], []
    for e in (0.0, 1.0):
        box, law = pv.Box((0, 0), (side, side), restitution=e), pv.Collisions(restitution=e)
        world = pv.World(boundary=box, gravity=(0, 0), collisions=law, substeps=8, threads=threads)
        world.add(position=place, velocity=3 * np.column_stack((np.cos(angle), np.sin(angle))), radius=RADIUS, mass=1.0)
        world.step(DT)
        worlds.append(world)
    times = np.array([[timed(partial(world.step, DT)) for world in worlds] for _ in range(GAS_FRAMES)]).T
    for world, spent, name, asked in zip(worlds, times, ("gas, e = 0, at its start", "gas, e = 1"), (1.0, 1.2), strict=True):
        found, ms = world.overlap(), float(np.quantile(spent, 0.25))
        rows.append(Row(name, particles, threads, ms, ms / float(np.quantile(times[0], 0.25)), asked, found.mean, found.max))
    return rows


def falling(threads: int, settled: Row) -> list[Row]:
    """A million that have fallen for a while and go on falling; the ratio is that of a circle's time, to `settled`."""
    world = pv.scenes.get("cage").world(particles=1_000_000)
    world.threads = threads
    world.run(seconds=MILLION_SECONDS, dt=DT)
    spent = [timed(partial(world.step, DT)) for _ in range(MILLION_FRAMES)]
    found, ms = world.overlap(), float(np.mean(spent))  # some frames make the list anew, some do not
    ratio = ms / len(world) / (settled.ms_per_frame / settled.particles)
    return [Row("a million that still falls", len(world), threads, ms, ratio, 2.0, found.mean, found.max)]


def peers(particles: int, threads: int) -> list[Row]:
    """Ours, pymunk and Box2D, with e = 0.3 and mu = 0.5 on the same heap; ratios are to ours."""
    position, cage = heap(particles)
    ours = build(Material("pyverlet", 1.0, BOTH, {}), position, cage, threads)
    few = build(Material("pyverlet", 1.0, BOTH, {"substeps": 4}), position, cage, threads)  # as many as Box2D takes by default
    engines: list[Engine] = []
    for engine in (Box2D, Pymunk, PymunkCareful):
        try:
            engines.append(engine(Heap(ours.position.copy(), cage, restitution=0.3, friction=0.5)))
        except ImportError:
            continue
    steps: list[Callable[[], object]] = [partial(ours.step, DT), partial(few.step, DT), *(engine.step for engine in engines)]
    for step in steps[1:]:
        for _ in range(60):
            step()
    times = times_in_turn(steps, FRAMES)
    quick = [float(np.quantile(spent, 0.25)) for spent in times]
    places = [ours.position, few.position, *(engine.position() for engine in engines)]
    rows = []
    names = ("pyverlet", "pyverlet, 4 substeps", "Box2D (pyb2d3)", "pymunk", "pymunk, 8 steps")
    for name, asked, place, ms in zip(names, (1, 1, 10, 30, 30), places, quick, strict=False):
        found = overlap(place)
        rows.append(Row(f"{name}, e = 0.3, mu = 0.5", len(place), threads, ms, ms / quick[0], asked, found.mean, found.max))
    return rows


def main(particles: int, path: Path | None, *, million: bool) -> None:
    """Print the tables; write them as CSV and JSON if asked to."""
    rows: list[Row] = []
    for threads in (1, 2):
        large = compare(LARGE, particles, threads)
        others = [gas(particles, threads)]
        others += [compare(SMALL, 1_000, 1)] if threads == 1 else []
        others += [falling(threads, large[0])] if million else []
        for part in (large, *others):
            print(f"\n{part[0].particles:,} circles, {threads} thread{'s' * (threads > 1)}, 8 substeps, radii 1:1 unless said")
            print(f"{'world':<34}{'ms a frame':>11}{'ratio':>8}{'asked':>8}{'mean overlap':>14}{'max':>8}")
            for row in part:
                print(
                    f"{row.world:<34}{row.ms_per_frame:>11.3f}{row.ratio:>8.2f}{row.asked:>8.2f}"
                    f"{row.overlap_mean:>14.3%}{row.overlap_max:>8.2%}"
                )
            rows += part
    for threads in (1, 2):
        print(
            f"\nbeside others, {threads} thread{'s' * (threads > 1)}: asked is how many times as long as ours they take at least"
        )
        for row in peers(particles, threads):
            print(
                f"{row.world:<40}{row.ms_per_frame:>9.2f}{row.ratio:>8.1f}{row.asked:>8.1f}{row.overlap_mean:>10.3%}{row.overlap_max:>8.1%}"
            )
            rows.append(row)
    write(rows, path)
