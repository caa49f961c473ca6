"""Compares integrators and numbers of substeps on one scene: energy, heights and cost."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.progress import OnProgress
from pyverlet.laws.integrators import Integrator
from pyverlet.scenes import Scene, Settings


@dataclass(frozen=True)
class Run:
    """Results of one integrator on the scene, frame by frame; the first entry of each array is the start.

    Attributes:
        integrator: its label.
        substeps: steps per frame.
        time: (m,) s.
        energy: (m,) total, J.
        height: (m,) of the first particle, m.
        exact: (m,) the exact heights; None for scenes without a closed form.
        ms_per_frame: median wall time of a frame.
    """

    integrator: str
    substeps: int
    time: Floats
    energy: Floats
    height: Floats
    exact: Floats | None
    ms_per_frame: float

    @property
    def relative(self) -> Floats:
        """(m,) change of the energy, relative to its magnitude at the start."""
        return np.asarray((self.energy - self.energy[0]) / abs(self.energy[0]))

    @property
    def drift(self) -> float:
        """Relative change of energy from start to end."""
        return float(self.relative[-1])

    @property
    def slope(self) -> float:
        """Secular slope: that of a straight line fitted to the relative change, 1/s."""
        return float(np.polyfit(self.time, self.relative, 1)[0])

    @property
    def amplitude(self) -> float:
        """Half the spread of the relative change about that line."""
        rest = self.relative - np.polyval(np.polyfit(self.time, self.relative, 1), self.time)
        return float(np.ptp(rest) / 2)

    @property
    def apexes(self) -> tuple[Floats, Floats]:
        """Times (s) and heights (m) of the maxima of the first particle's path, by parabolas through three frames."""
        before, here, after = self.height[:-2], self.height[1:-1], self.height[2:]
        top = np.flatnonzero((here > before) & (here >= after))
        before, here, after = before[top], here[top], after[top]
        bend, tilt = before - 2 * here + after, (after - before) / 2
        shift = -tilt / bend
        return self.time[top + 1] + shift * (self.time[1] - self.time[0]), here + tilt * shift / 2

    @property
    def largest_error(self) -> float | None:
        """Largest deviation of the height from the closed form, m."""
        return None if self.exact is None else float(np.abs(self.height - self.exact).max())

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        values: dict[str, Any] = {
            "integrator": self.integrator,
            "substeps": self.substeps,
            "energy": {"start": float(self.energy[0]), "end": float(self.energy[-1])},
            "drift": self.drift,
            "slope_per_s": self.slope,
            "amplitude": self.amplitude,
            "apex_heights": self.apexes[1].tolist(),
            "ms_per_frame": self.ms_per_frame,
        }
        return values if self.exact is None else values | {"largest_error_m": self.largest_error}


def compare(
    scene: Scene,
    integrators: Sequence[Integrator],
    substeps: Sequence[int],
    *,
    frames: int,
    dt: float,
    progress: OnProgress | None = None,
    **overrides: Any,
) -> list[Run]:
    """Run `scene`, as one world in float64, with every integrator and every number of substeps.

    Args:
        scene: its variants are ignored.
        integrators: one or more.
        substeps: one or more.
        frames: number of frames.
        dt: length of a frame, s.
        progress: called as progress(frames done, frames in all).
        overrides: settings of the scene.

    Raises:
        InputError: the initial energy is 0, so that relative changes are undefined.
    """
    runs: list[Run] = []
    chosen = list(itertools.product(substeps, integrators))
    for count, integrator in chosen:
        settings = scene.settings(**{"dtype": np.float64, **overrides, "integrator": integrator, "substeps": count})
        runs.append(_run(scene, settings, frames, dt, len(runs) * frames, len(chosen) * frames, progress))
    return runs


def _run(scene: Scene, settings: Settings, frames: int, dt: float, before: int, total: int, progress: OnProgress | None) -> Run:
    world = scene.build(settings)
    start = world.energy().total
    if start == 0.0:
        raise InputError(f"scene is {scene.name!r}, which starts with an energy of 0 J; allowed is one whose drift has a measure")
    time, energy, height, ms = np.zeros(frames + 1), np.zeros(frames + 1), np.zeros(frames + 1), np.zeros(frames)
    energy[0], height[0] = start, world.position[0, 1]
    for frame in range(1, frames + 1):
        began = perf_counter()
        world.step(dt)
        ms[frame - 1] = 1e3 * (perf_counter() - began)
        time[frame], energy[frame], height[frame] = world.time, world.energy().total, world.position[0, 1]
        if progress:
            progress(before + frame, total)
    exact = scene.closed_form(settings, time)[:, 0] if scene.closed_form else None
    return Run(settings.integrator.label, settings.substeps, time, energy, height, exact, float(np.median(ms)))
