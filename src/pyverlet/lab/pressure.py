"""What a coarse step costs an elastic gas: circles that move by much of their radius in a substep meet late and deep."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from pyverlet.ground.progress import OnProgress
from pyverlet.lab.physics._worlds import RADIUS
from pyverlet.lab.table import Table, measured
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.rooms import Box
from pyverlet.scenes.gas import henderson
from pyverlet.world.world import World

STEPS = (0.01, 0.03, 0.1, 0.2, 0.3)  # root mean square way in a substep, over the radius
FRACTIONS = (0.1, 0.3, 0.6)  # of the area, that circles cover
SIDE = 20  # circles along a side of the room at the start
SPEED = 3.0  # m/s, root mean square


@dataclass(frozen=True)
class Pressed:
    """A gas in a box."""

    fraction: float  # of the area
    step: float  # root mean square way in a substep, over the radius
    compressibility: float  # Z = P A / (N k T), where k T = m <v^2> / 2 and A is where centres may be
    overlap: float  # largest at the end of a frame, over the contact distance


def measure(fraction: float, step: float, *, seconds: float) -> Pressed:
    """Elastic circles without gravity: the pressure on the walls, after a tenth of the time in which they mix."""
    rng, count = np.random.default_rng(0), SIDE * SIDE
    side = np.sqrt(np.pi * RADIUS**2 * count / fraction)
    world = World(
        gravity=(0, 0), boundary=Box((0, 0), (side, side), restitution=1.0), collisions=Collisions(restitution=1.0), substeps=1,
        dtype=np.float64, threads=1, contacts=True,
    )  # fmt: skip
    place = RADIUS + (np.arange(SIDE) + 0.5) * (side - 2 * RADIUS) / SIDE
    velocity = rng.normal(0, 1, (count, 2))
    velocity *= SPEED / np.sqrt((velocity**2).sum(axis=1).mean())
    world.add(position=np.stack(np.meshgrid(place, place), -1).reshape(-1, 2), velocity=velocity, radius=RADIUS)
    frames, overlap, pushed, dt = round(seconds * SPEED / (step * RADIUS)), 0.0, 0.0, step * RADIUS / SPEED
    for frame in range(frames):
        world.step(dt)
        if frame >= frames // 10:
            pushed += world.pressure()
        if frame % 16 == 0:
            overlap = max(overlap, world.overlap().max)
    inner = side - 2 * RADIUS
    pressure = pushed / (frames - frames // 10) * side / inner  # centres push on a box that is smaller
    heat = 2 * world.energy().kinetic / (2 * count)  # k T = m <v^2> / 2
    return Pressed(fraction, step, pressure * inner**2 / (count * heat), overlap)


def table(*, seconds: float, progress: OnProgress | None = None) -> Table:
    """A row for each step: pressure over that at the finest, and the largest overlap, at several area fractions."""
    finest: dict[float, float] = {}

    def cell(step: float, fraction: float) -> tuple[str, dict[str, float]]:
        found = measure(fraction, step, seconds=seconds)
        lost = found.compressibility / finest.setdefault(fraction, found.compressibility) - 1
        text = f"Z = {found.compressibility:.2f}" if step == STEPS[0] else f"{100 * lost:+.1f} %, {100 * found.overlap:.0f} %"
        return text, asdict(found) | {"henderson": henderson(fraction)}

    columns = {f"area {fraction:g}": fraction for fraction in FRACTIONS}
    return measured("way / r", {f"{step:g}": step for step in STEPS}, columns, cell, progress)
