"""Tables of series of runs for a terminal, a page or a program; the tables of the limiter and of gas pressure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from pyverlet import scenes
from pyverlet.common.progress import OnProgress
from pyverlet.lab.physics._check import RADIUS, circles
from pyverlet.lab.physics.energy import scale
from pyverlet.laws.boundaries import Box
from pyverlet.scenes.gas import henderson

T = TypeVar("T")
U = TypeVar("U")


@dataclass(frozen=True)
class Table:
    """A series of runs: head and rows of text, and a mapping of values for each run."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    values: Sequence[Mapping[str, Any]]

    def markdown(self) -> str:
        lines = [self.head, ["---"] * len(self.head), *self.rows]
        return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def measured(
    head: str,
    rows: Mapping[str, T],
    columns: Mapping[str, U],
    measure: Callable[[T, U], tuple[str, Mapping[str, Any]]],
    progress: OnProgress | None = None,
) -> Table:
    """A table of `measure(row, column)`, text and values of a cell; rows and columns by their headings."""
    cells: list[list[str]] = []
    values: list[Mapping[str, Any]] = []
    for name, row in rows.items():
        cells.append([name])
        for column in columns.values():
            if progress:
                progress(len(values) + 1, len(rows) * len(columns))
            text, found = measure(row, column)
            cells[-1].append(text)
            values.append(found)
    return Table((head, *columns), cells, values)


LIMITER_SUBSTEPS = (2, 4, 8, 16)


def limiter(names: Sequence[str], *, seconds: float, particles: int | None = None, progress: OnProgress | None = None) -> Table:
    """Activity of the energy limiter: for each scene, frames in which it acts and energy removed at 2, 4, 8, 16 substeps."""

    def cell(name: str, substeps: int) -> tuple[str, dict[str, Any]]:
        panel = next(iter(scenes.get(name).panels(substeps=substeps, particles=particles, ledger=True)))
        size, acted, before = scale(panel.world, seconds), 0, 0.0
        for _ in range(frames := max(1, round(seconds / (1 / 60)))):
            panel.step(1 / 60)
            taken = panel.world.ledger.limiter
            acted, before = acted + (taken != before), taken
        share = -before / size  # of all energy removed, over the world's energy scale, that of a fall through its room
        values = {"scene": name, "substeps": substeps, "frames": frames, "acted": acted, "taken": share}
        return f"{acted}, {share:.1e}" if acted else "0", values

    return measured("scene", {name: name for name in names}, {f"{n} substeps": n for n in LIMITER_SUBSTEPS}, cell, progress)


STEPS = (0.01, 0.03, 0.1, 0.2, 0.3)  # root mean square displacement per substep, over the radius
FRACTIONS = (0.1, 0.3, 0.6)  # area fractions of circles
SIDE = 20  # circles along a side of the room initially
SPEED = 3.0  # m/s, root mean square


def measure_pressure(fraction: float, step: float, *, seconds: float) -> dict[str, float]:
    """Elastic circles without gravity: the pressure on the walls, after a tenth of the time for mixing.

    Returns:
        fraction: of the area. step: root mean square displacement per substep, over the radius. compressibility: Z = P A / (N k
            T),
        where k T = m <v^2> / 2 and A is the area for centres. overlap: largest at the end of a frame, over the contact distance.
    """
    rng, count = np.random.default_rng(0), SIDE * SIDE
    side = np.sqrt(np.pi * RADIUS**2 * count / fraction)
    place = RADIUS + (np.arange(SIDE) + 0.5) * (side - 2 * RADIUS) / SIDE
    velocity = rng.normal(0, 1, (count, 2))
    velocity *= SPEED / np.sqrt((velocity**2).sum(axis=1).mean())
    boundary, place = Box((0, 0), (side, side), restitution=1.0), np.stack(np.meshgrid(place, place), -1).reshape(-1, 2)
    world = circles(
        place, boundary, velocity=velocity, e=1.0, gravity=(0, 0), substeps=1, dtype=np.float64, threads=1, contacts=True,
    )  # fmt: skip
    frames, overlap, pushed, dt = round(seconds * SPEED / (step * RADIUS)), 0.0, 0.0, step * RADIUS / SPEED
    for frame in range(frames):
        world.step(dt)
        if frame >= frames // 10:
            pushed += world.pressure()
        if frame % 16 == 0:
            overlap = max(overlap, world.overlap().max)
    inner = side - 2 * RADIUS
    pressure = pushed / (frames - frames // 10) * side / inner  # centres push on a smaller box
    heat = 2 * world.energy().kinetic / (2 * count)  # k T = m <v^2> / 2
    z = pressure * inner**2 / (count * heat)
    return {"fraction": fraction, "step": step, "compressibility": z, "overlap": overlap}


def pressure(*, seconds: float, progress: OnProgress | None = None) -> Table:
    """Pressure error of an elastic gas with coarse steps, in which circles collide late and deep.

    A row for each step: pressure over that at the finest one, and the largest overlap, at several area fractions.
    """
    finest: dict[float, float] = {}

    def cell(step: float, fraction: float) -> tuple[str, dict[str, float]]:
        found = measure_pressure(fraction, step, seconds=seconds)
        z = found["compressibility"]
        lost = z / finest.setdefault(fraction, z) - 1
        text = f"Z = {z:.2f}" if step == STEPS[0] else f"{100 * lost:+.1f} %, {100 * found['overlap']:.0f} %"
        return text, found | {"henderson": henderson(fraction)}

    columns = {f"area {fraction:g}": fraction for fraction in FRACTIONS}
    return measured("way / r", {f"{step:g}": step for step in STEPS}, columns, cell, progress)
