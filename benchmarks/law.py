"""The worlds of docs/design/contact-law.md in every engine: `python -m benchmarks law`.

Energies are those of motion and height, without spins, over m g R with R half the side of the box; overlaps are per cent of the
contact distance, mean and largest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.engines import DT, RADIUS, Array, Engine, Heap, overlap

G = 9.81
DISCS, FEW = 2_000, 400
SETTLE_SECONDS = 20.0
VARYING_SECONDS = 10.0


def spread(count: int, cage: float, spacing: float) -> Array:
    """(count, 2) points of a square lattice, those nearest to the centre of a cage of this radius."""
    side = np.arange(-cage, cage, spacing)
    points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return points[np.argsort(np.hypot(*points.T), kind="stable")[:count]]


def heap(count: int = DISCS, *, masses: float = 1.0, radii: float = 1.0, e: float = 0.0, mu: float = 0.0) -> Heap:
    """Discs of half the area of their box; masses and radii are uniform in their logarithm, from 1 to so much.

    In a smooth round cage heaps would swing for ever, as a whole.
    """
    rng = np.random.default_rng(1)
    radius = RADIUS * radii ** -rng.uniform(0, 1, count)
    mass = masses ** rng.uniform(0, 1, count) * (radius / RADIUS) ** 2
    side = RADIUS * float(np.sqrt(0.5 * np.pi * count))
    place = spread(count, side, 2.04 * RADIUS) + rng.uniform(-0.02, 0.02, (count, 2)) * RADIUS  # else columns stay columns
    return Heap(place, side, radius=radius, mass=mass, restitution=e, friction=mu, box=True)


def column(top: float) -> Heap:
    """Twenty discs on each other on a flat floor, the highest `top` times as heavy as the others."""
    y = RADIUS * (2 * np.arange(20.0) + 1) - 12.0
    return Heap(np.column_stack((np.zeros(20), y)), 12.0, mass=np.r_[np.ones(19), top], box=True)


def energy(world: Engine, of: Heap) -> float:
    """J of motion and height."""
    v, y = world.velocity().astype(float), world.position()[:, 1].astype(float)
    return float((of.mass * (0.5 * (v**2).sum(axis=1) + G * y)).sum())


def settled(engine: type[Engine], of: Heap) -> Engine:
    """These discs after a while."""
    world = engine(of)
    for _ in range(round(SETTLE_SECONDS / DT)):
        world.step()
    return world


def overlaps(engine: type[Engine], of: Heap) -> str:
    """Mean and largest, per cent."""
    found = overlap(settled(engine, of).position(), of.radius)
    return f"{100 * found.mean:.2g} / {100 * found.max:.2g}"


def rest(engine: type[Engine]) -> str:
    """Kinetic energy of a disc of a rough heap over m g R."""
    of = heap(e=0.3, mu=0.5)
    v = settled(engine, of).velocity().astype(float)
    return f"{0.5 * float((v**2).sum()) / (DISCS * G * of.cage):.0e}"


def rises(engine: type[Engine], lengths: Sequence[float], *, falling: bool) -> str:
    """Largest rise of the energy in frames of these lengths by chance, over m g R; of a heap at rest, too, the fastest after."""
    of = heap(FEW, e=0.5, mu=0.3)
    world, rng = engine(of) if falling else settled(engine, of), np.random.default_rng(2)
    most, before, passed = 0.0, energy(world, of), 0.0
    while passed < VARYING_SECONDS:
        world.step(dt := float(rng.choice(lengths)))
        passed, now = passed + dt, energy(world, of)
        most, before = max(most, now - before), now
    fastest = float(np.hypot(*world.velocity().T).max())
    return f"{most / (of.mass.sum() * G * of.cage):.0e}" + ("" if falling else f"; {fastest:.0e}")


def crash(engine: type[Engine]) -> str:
    """2,000 discs at 20 m/s into a corner of a box, without gravity: largest rise in a frame over the kinetic energy."""
    side = RADIUS * float(np.sqrt(np.pi * DISCS / 0.4)) / 2
    of = Heap(
        spread(DISCS, side, 2.02 * RADIUS), side, velocity=(-14.0, -14.0), mass=np.ones(DISCS), box=True, gravity=(0.0, 0.0)
    )
    world = engine(of)
    first = before = 0.5 * float((world.velocity().astype(float) ** 2).sum())
    most = 0.0
    for _ in range(240):
        world.step()
        now = 0.5 * float((world.velocity().astype(float) ** 2).sum())
        most, before = max(most, now - before), now
    return f"{most / first:.0e}"


TRIALS: dict[str, Callable[[type[Engine]], str]] = {
    "heap of 2,000, smooth": lambda engine: overlaps(engine, heap()),
    "e = 0.3, mu = 0.5": lambda engine: overlaps(engine, heap(e=0.3, mu=0.5)),
    "its kinetic energy": rest,
    "masses 1:100": lambda engine: overlaps(engine, heap(masses=100.0)),
    "the same, rough": lambda engine: overlaps(engine, heap(masses=100.0, e=0.3, mu=0.5)),
    "radii 1:5": lambda engine: overlaps(engine, heap(radii=5.0)),
    "column of 20, top 100 times as heavy": lambda engine: overlaps(engine, column(100.0)),
    "top 1000 times": lambda engine: overlaps(engine, column(1000.0)),
    "settled, dt of 1/240 and 1/60": lambda engine: rises(engine, (1 / 240, 1 / 60), falling=False),
    "settled, 1/60 and 1/30": lambda engine: rises(engine, (1 / 60, 1 / 30), falling=False),
    "settled, 1/60 and 0.25": lambda engine: rises(engine, (1 / 60, 0.25), falling=False),
    "falling, 1/240 and 1/60": lambda engine: rises(engine, (1 / 240, 1 / 60), falling=True),
    "falling, 1/60 and 1/30": lambda engine: rises(engine, (1 / 60, 1 / 30), falling=True),
    "crash of 2,000 at 20 m/s": crash,
}


def main(engines: list[type[Engine]]) -> None:
    """Print a line for each world."""
    print("| world | " + " | ".join(f"{engine.name}, {engine.settings}" for engine in engines) + " |")
    for name, trial in TRIALS.items():
        print(f"| {name} | " + " | ".join(trial(engine) for engine in engines) + " |", flush=True)
