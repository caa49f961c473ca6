"""How much the energy limiter has to do: in how many frames of every scene it acts, and what it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from pyverlet import scenes
from pyverlet.ground.progress import OnProgress
from pyverlet.lab.physics.energy import scale
from pyverlet.lab.table import Table, measured

SUBSTEPS = (2, 4, 8, 16)


@dataclass(frozen=True)
class Limited:
    """What the limiter did in a run of a scene's first world."""

    scene: str
    substeps: int
    frames: int  # how many ran
    acted: int  # in how many of them energy was taken back
    taken: float  # of all energy taken, over the scale of the world's energy, that of a fall through its room


def measure(scene: str, substeps: int, *, seconds: float, particles: int | None = None, dt: float = 1 / 60) -> Limited:
    """Run a scene as it is, or with another number of circles, and read its ledger after every frame."""
    panel = next(iter(scenes.get(scene).panels(substeps=substeps, particles=particles, ledger=True)))
    size, acted, before = scale(panel.world, seconds), 0, 0.0
    for _ in range(frames := max(1, round(seconds / dt))):
        panel.step(dt)
        taken = panel.world.ledger.limiter
        acted, before = acted + (taken != before), taken
    return Limited(scene, substeps, frames, acted, -before / size)


def table(names: Sequence[str], *, seconds: float, particles: int | None = None, progress: OnProgress | None = None) -> Table:
    """A row for each scene: frames in which it acts, and what it takes, at 2, 4, 8 and 16 substeps."""

    def cell(name: str, substeps: int) -> tuple[str, dict[str, Any]]:
        found = measure(name, substeps, seconds=seconds, particles=particles)
        return f"{found.acted}, {found.taken:.1e}" if found.acted else "0", asdict(found)

    return measured("scene", {name: name for name in names}, {f"{n} substeps": n for n in SUBSTEPS}, cell, progress)
