"""Bounce: a dropped circle rises to e^2 of its drop, and an elastic one keeps its energy for ever."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.lab.physics._check import DT, RADIUS, G, Result
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import VelocityVerlet
from pyverlet.laws.rooms import Boundary, Box, Circle, Open
from pyverlet.world.world import World

RESTITUTIONS = (0.0, 0.3, 0.5, 0.8, 0.95, 1.0)
DROPS = (0.5, 2.0, 10.0)  # metres

ROUNDING = 1e-4
"""Of the drop: below this, an error in float32 is rounding and need not fall any further with more substeps. A position near 10 m
is rounded to 1e-6 m in each of some thousand substeps."""


def rebound_height(floor: str, e: float, drop: float, substeps: int, dtype: DTypeLike = np.float32) -> float:
    """Height in metres to which a circle dropped by `drop` (m) on a `floor` ("box", "cage" or "circle") rises again.

    Taken from v^2 / 2 g at the first frame on the way up, since a frame rarely falls on the apex.
    """
    rooms: dict[str, Boundary] = {
        "box": Box((-20, 0), (20, 40), restitution=e),
        "cage": Circle(center=(0, 20), radius=20, restitution=e),
        "circle": Open(),
    }
    world = World(boundary=rooms[floor], collisions=Collisions(restitution=e), substeps=substeps, dtype=dtype)
    rest = RADIUS
    if floor == "circle":
        world.add(position=(0, 0), radius=RADIUS, mass=np.inf)
        rest = 2 * RADIUS
    ball = world.add(position=(0, rest + drop), radius=RADIUS)
    for _ in range(round(2 * np.sqrt(2 * drop / G) / DT) + 2):
        before = float(ball.velocity[0, 1])
        world.step(DT)
        if before < 0 <= float(ball.velocity[0, 1]):
            break
    return float(ball.position[0, 1]) - rest + float(ball.velocity[0, 1]) ** 2 / (2 * G)


def worst_rebound(floor: str, substeps: int) -> tuple[float, float, float]:
    """(error over the drop, e, drop) of the worst rebound."""
    return max(
        (abs(rebound_height(floor, e, drop, substeps) - e * e * drop) / drop, e, drop) for e in RESTITUTIONS for drop in DROPS
    )


def rebound(floor: str, within: float = 0.01) -> Result:
    """The rebound is e^2 of the drop: v' = e v and H = v^2 / 2 g."""
    error, e, drop = worst_rebound(floor, 8)
    return Result(
        f"e^2 of the drop within {within:.0%}: e 0 to 1, drops 0.5 to 10 m, on {floor}, 8 substeps",
        f"worst {error:.2e} of the drop (e {e:g}, {drop:g} m)",
        error <= within,
        {"error": error},
    )


def rebound_substeps() -> Result:
    """The rebound's error falls with more substeps, or is rounding."""
    counts = (1, 2, 4, 8, 16, 32)
    errors = [max(worst_rebound(floor, substeps)[0] for floor in ("box", "cage", "circle")) for substeps in counts]
    falls = all(after <= max(before, ROUNDING) for before, after in pairwise(errors))
    return Result(
        f"worst rebound improves with substeps, or is rounding (below {ROUNDING:g} of the drop)",
        ", ".join(f"{n}: {error:.1e}" for n, error in zip(counts, errors, strict=True)),
        falls,
        {f"error_{n}": error for n, error in zip(counts, errors, strict=True)},
    )


def ball_in_box(steps: int, within: float = 1e-9) -> Result:
    """An elastic ball in a box keeps m v^2 / 2 + m g y: flight is exact for second order, so is a reflection in time."""
    world = World(
        boundary=Box((0, 0), (10, 10), restitution=1.0), integrator=VelocityVerlet(), collisions=None, substeps=10_000,
        dtype=np.float64,
    )  # fmt: skip
    world.add(position=(3, 7.1), velocity=(2.2, 1.1), radius=RADIUS)
    start, worst = world.energy().total, 0.0
    for _ in range(steps // world.substeps):
        world.step(world.substeps * DT / 8)
        worst = max(worst, abs(world.energy().total / start - 1))
    return Result(
        f"energy of one ball in a box for {steps:,} steps within {within:g}, float64, VelocityVerlet",
        f"{worst:.1e}",
        worst <= within,
        {"error": worst},
    )
