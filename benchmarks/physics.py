"""How well engines bounce, keep energy and come to rest: the same three trials for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT, RADIUS, Engine, Heap, overlap
from pyverlet.lab.physics.friction import DROPS, RESTITUTIONS

G = 9.81
CAGE = 20.0
"""Radius of the cage circles are dropped in, m."""

GAS = 500
GAS_SECONDS = 10.0
REST_SECONDS = 30.0


@dataclass(frozen=True)
class Row:
    """What one engine did.

    Attributes:
        rebound: worst |height - e^2 H| / H over restitutions and drops, and where.
        energy: of an elastic gas after 10 s, as a fraction of the start.
        kinetic: of a pile after 30 s, per disc over m g R.
        overlap: of that pile, mean and largest, as fractions of the diameter.
    """

    engine: str
    settings: str
    rebound: float
    rebound_at: str
    energy: float
    kinetic: float
    overlap_mean: float
    overlap_max: float


def rebound(engine: type[Engine], e: float, drop: float) -> float:
    """Height (m) to which a disc dropped on the bottom of a cage rises, from v^2 / 2 g in its first frame on the way up."""
    bottom = -CAGE + RADIUS
    world = engine(Heap(np.array([[0.0, bottom + drop]]), CAGE, restitution=e))
    for _ in range(round(2 * np.sqrt(2 * drop / G) / DT) + 2):
        before = world.velocity()[0, 1]
        world.step()
        if before < -0.1 and world.velocity()[0, 1] >= 0:  # at rest some tremble
            break
    speed = max(float(world.velocity()[0, 1]), 0.0)
    return float(world.position()[0, 1]) - bottom + speed**2 / (2 * G)


def gas_energy(engine: type[Engine]) -> float:
    """Kinetic energy of elastic discs without gravity after 10 s, over that at the start."""
    cage = RADIUS * np.sqrt(GAS / 0.3)
    axis = 1.5 * np.arange(-30, 31)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    position = points[np.argsort(np.hypot(*points.T), kind="stable")[:GAS]]
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, GAS)
    velocity = 5.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    world = engine(Heap(position, cage, velocity=velocity, restitution=1.0, gravity=(0.0, 0.0)))
    for _ in range(round(GAS_SECONDS / DT)):
        world.step()
    return float((world.velocity().astype(float) ** 2).sum() / (velocity**2).sum())


def rest(engine: type[Engine], particles: int) -> tuple[float, pv.Overlap]:
    """(kinetic energy per disc over m g R, overlap) of the scene `cage` after the engine has settled it for 30 s."""
    start = pv.scenes.get("cage").world(particles=particles)
    extent = start.boundary.extent()
    assert extent is not None
    world = engine(Heap(start.position.astype(float), extent[2]))
    for _ in range(round(REST_SECONDS / DT)):
        world.step()
    return float((world.velocity().astype(float) ** 2).sum() / 2 / (particles * G * RADIUS)), overlap(world.position())


def measure(engine: type[Engine], particles: int) -> Row:
    """All three trials."""
    error, e, drop = max((abs(rebound(engine, e, drop) - e * e * drop) / drop, e, drop) for e in RESTITUTIONS for drop in DROPS)
    kinetic, found = rest(engine, particles)
    at = f"e {e:g}, {drop:g} m"
    return Row(engine.name, engine.settings, error, at, gas_energy(engine), kinetic, found.mean, found.max)


def main(engines: list[type[Engine]], particles: int) -> None:
    """Print a line for each engine."""
    print(
        "\nworst rebound: e 0 to 1, drops of 0.5 to 10 m, off by this fraction of the drop"
        f"\ngas: energy of {GAS} elastic discs after {GAS_SECONDS:g} s, over that at the start"
        f"\nrest: {particles:,} discs in a cage after {REST_SECONDS:g} s, kinetic energy over m g R; overlap over the diameter\n"
    )
    print(f"{'engine':<26}{'settings':<38}{'worst rebound':>14}  {'at':<14}{'gas':>9}{'rest':>10}{'mean overlap':>14}{'max':>8}")
    for engine in engines:
        row = measure(engine, particles)
        print(
            f"{row.engine:<26}{row.settings:<38}{row.rebound:>14.3%}  {row.rebound_at:<14}{row.energy:>9.3f}{row.kinetic:>10.1e}"
            f"{row.overlap_mean:>14.3%}{row.overlap_max:>8.2%}",
            flush=True,
        )
