"""What pyverlet promises about its own speed, each promise measured: `python -m benchmarks own`.

Every line is a ratio of two times taken in turn in one process, or a time beside the machine's own (NumPy's triad), with
substeps, spread of the radii and overlap of the heap it was measured on.
"""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT, RADIUS, Engine, Heap, Pymunk, PyverletOneThread
from benchmarks.tables import timed
from pyverlet.common.memory import mapped

SUBSTEPS = 8
SETTLE_SECONDS = 10.0
MIXED_SECONDS = 25.0
"""The same for circles of mixed sizes: they start on top of each other and grow for five seconds."""

SETTLED_REBUILDS = 0.25
"""A heap has settled if its list of pairs is made anew less than so often a frame: that of 20,000 after 10 s, 0.1 times."""

ROUNDS = 5
"""Worlds that are compared take turns this often, so that the machine's moods hit them alike."""

TURN_SECONDS = 0.25
"""A turn takes at least so long: a core that had nothing to do meanwhile, the second one, needs some time to be lent again."""


@dataclass(frozen=True)
class Row:
    """One promise."""

    name: str
    asked: str
    measured: str
    passed: bool


def cage(particles: int, seconds: float = SETTLE_SECONDS, ratio: float = 1.0, **options: Any) -> pv.World:
    """The scene `cage`, settled; with a ratio of radii above 1 a heap of as much area, radii uniform in their logarithm."""
    if ratio == 1.0:
        world = pv.scenes.get("cage").world(particles=particles)
    else:
        rng = np.random.default_rng(1)
        radius = ratio ** rng.uniform(-1, 0, particles)
        radius *= RADIUS / np.sqrt((radius**2).mean())
        size = np.sqrt(particles * RADIUS**2 / 0.6)
        world = pv.World(boundary=pv.Circle(radius=size), **options)
        place(world, rng, radius, size)
    world.run(seconds=seconds, dt=DT)
    return world


def rough(particles: int) -> pv.World:
    """Rough discs that have come to rest in a cage."""
    law: dict[str, Any] = {"friction": 0.5, "restitution": 0.3}
    size = float(max(2.0, 0.52 * np.sqrt(particles)))
    world = pv.World(boundary=pv.Circle(radius=size, **law), collisions=pv.Collisions(**law))
    side = int(np.ceil(np.sqrt(particles)))
    x, y = np.divmod(np.arange(particles), side)
    world.add(position=0.51 * (np.column_stack((x, y)) - 0.5 * (side - 1)), radius=0.25)
    world.run(seconds=SETTLE_SECONDS, dt=DT)
    return world


def place(world: pv.World, rng: np.random.Generator, radius: Any, size: float) -> None:
    """Circles at random places of a cage of this size; many overlap."""
    angle, out = rng.uniform(0, 2 * np.pi, len(radius)), (size - radius.max()) * np.sqrt(rng.uniform(0, 1, len(radius)))
    world.add(position=out[:, None] * np.column_stack((np.cos(angle), np.sin(angle))), radius=radius)


def in_turn(steps: list[Callable[[], object]], frames: int) -> list[float]:
    """Median milliseconds of each, called in turns of so many calls at least, and of TURN_SECONDS at least."""
    return [median(spent) for spent in times_in_turn(steps, frames)]


def times_in_turn(steps: list[Callable[[], object]], frames: int) -> list[list[float]]:
    """All of their milliseconds."""
    times: list[list[float]] = [[] for _ in steps]
    for _ in range(ROUNDS):
        for step, spent in zip(steps, times, strict=True):
            step()  # memory of the one before is still in the caches
            begin, enough = perf_counter(), len(spent) + frames
            while len(spent) < enough or perf_counter() - begin < TURN_SECONDS:
                spent.append(timed(step))
    return times


def stepping(world: pv.World, threads: int | None = None) -> Callable[[], None]:
    """A frame of the world on so many threads."""

    def step() -> None:
        world.threads = threads
        world.step(DT)

    return step


def one_then_two(world: pv.World, frames: int) -> tuple[float, float]:
    """Median milliseconds on one thread and on two. Not in turns: threads that have just worked still wait for more, spinning."""
    return in_turn([stepping(world, 1)], frames)[0], in_turn([stepping(world, 2)], frames)[0]


def rebuilt(world: pv.World, seconds: float) -> float:
    """How often a frame the list of pairs is made anew, in so many more seconds."""
    before, frames = world.rebuilds, world.frames
    world.run(seconds=seconds, dt=DT)
    return (world.rebuilds - before) / (world.frames - frames)


def settle(world: pv.World) -> None:
    """Until it has settled. Large rooms take longer: in one of 100,000 circles the fall is twice as deep as in one of 20,000."""
    while (rebuilds := rebuilt(world, seconds=1.0)) > SETTLED_REBUILDS:
        print(f"{len(world):,} circles after {world.time:.0f} s: list made {rebuilds:.2f} times a frame", flush=True)


def quiet(spent: list[float]) -> float:
    """What the fastest tenth takes at most: each of two threads waits for the other, so whoever disturbs one has both wait."""
    return float(np.quantile(spent, 0.1))


def heap(world: pv.World) -> str:
    """What a reader must know to judge the time."""
    found = world.overlap()
    spread = float(world.radius.max() / world.radius.min())
    return f"{world.substeps} substeps, radii 1:{spread:.3g}, overlap mean {found.mean:.2%}, max {found.max:.1%}"


def per_substep(ms: float, particles: int) -> float:
    """Nanoseconds a particle and substep."""
    return 1e6 * ms / (particles * SUBSTEPS)


def threads(triad: float) -> Iterator[Row]:
    """20,000 on one thread and on two; 100,000 too."""
    world = cage(20_000)
    one, two = one_then_two(world, 20)
    a, b = per_substep(one, 20_000), per_substep(two, 20_000)
    yield Row(
        "20,000 circles",
        "<= 20 ns a particle and substep on one thread, <= 11 on two",
        f"{a:.1f} and {b:.1f} ns ({a / triad:.1f} and {b / triad:.1f} triads); {heap(world)}",
        a <= 20 and b <= 11,
    )
    world = cage(100_000)
    settle(world)
    # In turns all the same, for the pace of the cores changes within seconds; a thread spins for a millisecond of a turn.
    times = times_in_turn([stepping(world, 1), stepping(world, 2)], 100)
    one, two = map(median, times)
    gain = quiet(times[0]) / quiet(times[1])
    yield Row(
        "100,000 circles",
        "a frame <= 16.7 ms on two threads, and at least 1.8 times as fast as on one",
        f"{two:.1f} ms, {one / two:.2f} times as fast, {gain:.2f} in the fastest tenth of frames; {heap(world)}",
        two <= 16.7 and one / two >= 1.8,
    )


def growth(particles: int = 1_000_000) -> Iterator[Row]:
    """A million costs a million times one. A large room takes longer to settle: these falls are seven times as deep."""
    small, large = cage(20_000), cage(particles)
    for world in (small, large):
        settle(world)
    a, b = in_turn([stepping(small), stepping(large)], 4)
    cost = per_substep(b, particles) / per_substep(a, 20_000)
    yield Row(
        f"{particles:,} circles",
        "a particle costs <= 1.4 times what it does at 20,000",
        f"{cost:.2f} times, {b:.0f} ms a frame; {heap(large)}",
        cost <= 1.4,
    )


def sizes(particles: int = 20_000) -> Iterator[Row]:
    """Circles of unequal sizes, by contact."""
    worlds = {ratio: cage(particles, seconds=MIXED_SECONDS, ratio=ratio) for ratio in (1.0, 4.0, 50.0)}
    times = dict(zip(worlds, in_turn([stepping(world, 1) for world in worlds.values()], 8), strict=True))
    cost = {ratio: times[ratio] / world.overlap().contacts for ratio, world in worlds.items()}
    for ratio, most in ((4.0, 1.8), (50.0, 4.0)):
        times_as_much = cost[ratio] / cost[1.0]
        yield Row(
            f"radii 1:{ratio:g}",
            f"a contact costs <= {most:g} times what it does with equal radii",
            f"{times_as_much:.2f} times; {heap(worlds[ratio])}",
            times_as_much <= most,
        )


def motion(particles: int = 20_000) -> Iterator[Row]:
    """Falling and splashing, and stirred, against settled."""
    settled = cage(particles)
    still = median(in_turn([stepping(settled, 1)], 20))
    falling = pv.scenes.get("cage").world(particles=particles)
    splash = [timed(stepping(falling, 1)) for _ in range(round(5 / DT))]
    stirred, churned = cage(particles), []
    for angle in 2 * np.pi * DT / 3 * np.arange(1, round(3 / DT) + 1):
        stirred.gravity = (9.81 * np.sin(angle), -9.81 * np.cos(angle))
        churned.append(timed(stepping(stirred, 1)))
    for name, spent in (("falling, splashing", splash), ("stirred", churned)):
        ratio = float(np.mean(spent)) / still
        yield Row(
            name,
            "a frame costs <= 2 times a settled one, on average",
            f"{ratio:.2f} times (worst second {max_second(spent) / still:.2f}); {heap(settled)}",
            ratio <= 2,
        )


def max_second(spent: list[float]) -> float:
    """Largest mean over a second."""
    frames = round(1 / DT)
    return max(float(np.mean(spent[a : a + frames])) for a in range(0, len(spent) - frames + 1, frames))


def resting(particles: int = 20_000) -> Iterator[Row]:
    """A heap on a flat floor, asleep, and a ball that drops on a small heap beside it."""
    worlds = []
    for sleep in (False, True):
        side = round(np.sqrt(2 * particles))
        world = pv.World(boundary=pv.Box((0, 0), (1.4 * side, 2 * side)), sleep=sleep)
        world.obstacles.append(pv.Segment((1.1 * side, 0), (1.1 * side, 2 * side)))
        row, column = np.divmod(np.arange(particles), side)
        shaken = np.random.default_rng(0).uniform(0, 0.02, (particles, 2))
        world.add(position=np.column_stack((1 + 1.05 * column, 1 + 1.05 * row)) + shaken, radius=RADIUS)
        world.run(seconds=60, dt=DT)
        world.add(position=(1.2 * side, 2 * side - 2), radius=RADIUS)
        worlds.append(world)
    awake, asleep = in_turn([stepping(world, 1) for world in worlds], 4)
    yield Row(
        "resting",
        "a mostly resting world costs less",
        f"{asleep / awake:.2f} of what it costs awake, {worlds[1].asleep.sum():,} of {particles + 1:,} asleep; {heap(worlds[0])}",
        asleep < 0.7 * awake,
    )


def small(machine_limit_ms: float = 0.15) -> Iterator[Row]:
    """A hundred circles, ten and a hundred rough ones on one thread, and ten beside pymunk."""
    for count, most in ((10, 0.015), (100, 0.025)):
        world = rough(count)
        (ms,) = in_turn([stepping(world, 1)], 200)
        yield Row(f"{count} rough circles", f"a frame <= {1e3 * most:g} us", f"{1e3 * ms:.1f} us; {heap(world)}", ms <= most)
    hundred = cage(100)
    (ms,) = in_turn([stepping(hundred)], 100)
    yield Row("100 circles", f"a frame <= {machine_limit_ms:g} ms", f"{ms:.3f} ms; {heap(hundred)}", ms <= machine_limit_ms)
    ten = cage(10)
    extent = ten.boundary.extent()
    assert extent is not None
    start = Heap(ten.position.copy(), extent[2])
    engines: list[Engine] = [PyverletOneThread(start)]
    try:
        engines.append(Pymunk(start))
    except ImportError:
        return
    ours, theirs = in_turn([engine.step for engine in engines], 200)
    yield Row(
        "10 circles",
        "not slower than pymunk (10 iterations, one step a frame)",
        f"{ours:.3f} ms a frame, pymunk {theirs:.3f}",
        ours <= theirs,
    )


def memory(particles: int = 200_000) -> Iterator[Row]:
    """What the engine keeps beyond the arrays a user sees."""
    tracemalloc.start()
    before = mapped()
    world = pv.scenes.get("cage").world(particles=particles)
    seen = sum(array.nbytes for _, array in world._state.arrays())
    held = []
    for _ in range(8):
        world.run(seconds=0.5)
        held.append((tracemalloc.get_traced_memory()[0] + mapped() - before - seen) / particles)
    tracemalloc.stop()
    most = max(held)
    yield Row(
        "memory",
        "<= 350 bytes a particle beyond the arrays a user sees",
        f"{most:.0f} bytes at most in a fall of 4 s",
        most <= 350,
    )


def start() -> Iterator[Row]:
    """Import, and a start up to the first frame."""
    first = "import pyverlet as pv\nw = pv.scenes.get('cage').world(particles=5000); w.step(1 / 60)"
    for name, code, most in (("import pyverlet", "import pyverlet", 0.6), ("start to first frame", first, 2.5)):
        command = partial(subprocess.run, [sys.executable, "-c", code], check=True)
        took = median(timed(command) for _ in range(ROUNDS)) / 1e3
        yield Row(name, f"<= {most:g} s", f"{took:.2f} s, Python's own start included", took <= most)


def views(particles: int = 100_000) -> Iterator[Row]:
    """Reading and writing all positions is no loop."""
    world = pv.World()
    world.add(position=np.random.default_rng(0).uniform(0, 1e3, (particles, 2)), radius=0.5)
    values = np.zeros((particles, 2), world.dtype)
    read, write, copy = in_turn(
        [lambda: world.position, lambda: world.position.__setitem__(slice(None), values), lambda: values.copy()], 100
    )
    yield Row(
        "all positions of 100,000",
        "a view: reading takes no time, writing that of a copy",
        f"reading {1e3 * read:.1f} us, writing {1e3 * write:.0f} us, a copy of as many numbers {1e3 * copy:.0f} us",
        read < 0.1 * copy and write < 5 * copy,
    )


def rays(limit_ms: float = 5.0) -> Iterator[Row]:
    """What 100 robots see that look around in a degree's steps, in a frame in which particles have moved."""
    rng, angle = np.random.default_rng(1), np.radians(np.arange(360.0))
    world = pv.World(boundary=pv.Box((0, 0), (40, 40)))
    world.add(position=rng.uniform(0, 40, (10_000, 2)), radius=0.1, on_overlap="push")
    eye, look = np.repeat(rng.uniform(0, 40, (100, 2)), 360, axis=0), np.column_stack((np.cos(angle), np.sin(angle)))
    ways = np.tile(look, (100, 1))

    def cast() -> None:
        world.position[0] = rng.uniform(0, 40, 2)
        world.ray(eye, ways)

    def brute() -> None:  # one robot, among particles alone
        to = world.position - eye[0]
        along = look @ to.T
        root = world.radius**2 - ((to**2).sum(axis=1) - along**2)
        np.where((root >= 0) & (along >= 0), along - np.sqrt(np.maximum(root, 0)), np.inf).min(axis=1)

    ms, one = in_turn([cast, brute], 3)
    measured = f"{ms:.2f} ms; NumPy over all discs takes {100 * one / ms:,.0f} times as long a ray"
    yield Row("36,000 rays, 10,000 discs", f"<= {limit_ms:g} ms", measured, ms <= limit_ms)


def main(triad: float, million: bool) -> bool:
    """Print a line for each promise; returns whether all hold."""
    parts = [start(), small(), views(), sizes(), motion(), resting(), memory(), rays(), threads(triad)]
    return told(chain(*parts, growth() if million else ()))


def told(rows: Iterable[Row]) -> bool:
    """Print each as it comes; returns whether all hold."""
    held = True
    for row in rows:
        held &= row.passed
        print(f"{row.name:<36}{'pass' if row.passed else 'FAIL':<6}{row.measured}\n{'':<42}asked: {row.asked}", flush=True)
    return held
