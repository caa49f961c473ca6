"""Heights over time of a running world, beside the solution on paper, as numbers and as a figure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pyverlet.ground.errors import InputError
from pyverlet.lab import figures
from pyverlet.scenes import Scene, Settings
from pyverlet.scenes._scene import Floats
from pyverlet.world.world import World

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_CURVES = 8
"""Circles a figure shows; more would hide each other."""


@dataclass(frozen=True)
class Heights:
    """Simulated and exact heights (m, n) of the same circles in metres, at times (m,) in seconds."""

    time: Floats
    simulated: Floats
    exact: Floats

    @property
    def largest_error(self) -> float:
        """Largest distance from the exact solution, m."""
        return float(np.abs(self.simulated - self.exact).max())


class HeightRecorder:
    """Keeps the heights of a world's circles: call it with the world at the start and after every frame."""

    def __init__(self) -> None:
        self._time: list[float] = []
        self._height: list[Floats] = []

    def __call__(self, world: World) -> None:
        """Record the present frame."""
        self._time.append(float(world.time))
        self._height.append(np.array(world.position[:, 1], dtype=np.float64))

    def against(self, scene: Scene, settings: Settings) -> Heights:
        """What was recorded, beside the closed form of `scene`; InputError if it has none."""
        if scene.closed_form is None:
            raise InputError(f"scene is {scene.name!r}; allowed is one that has a closed form")
        time = np.array(self._time)
        return Heights(time, np.array(self._height), scene.closed_form(settings, time))


def figure(heights: Heights, title: str) -> Figure:
    """A figure of two panels: y(t) with the closed form on top, the error below. Needs the extra `plot`."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(7.0, 6.0), dpi=150, layout="constrained")
    top, bottom = picture.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    shown = np.unique(np.linspace(0, heights.exact.shape[1] - 1, MOST_CURVES).astype(int))
    # Blue circles on an orange line: told apart by shape as well as by colour, also by the colour-blind.
    every = max(1, len(heights.time) // 40)
    for i in shown:
        first = i == shown[0]
        top.plot(heights.time, heights.exact[:, i], color="#E69F00", lw=2.0, label="closed form" if first else None)
        top.plot(
            heights.time[::every],
            heights.simulated[::every, i],
            "o",
            color="#0072B2",
            ms=4,
            mfc="none",
            label="pyverlet" if first else None,
        )
        bottom.plot(heights.time, heights.simulated[:, i] - heights.exact[:, i], color="#0072B2", lw=1.0)
    top.set(ylabel="height y (m)", title=title)
    top.legend(frameon=False)
    bottom.set(xlabel="time t (s)", ylabel="error in y (m)")
    bottom.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    for axes in (top, bottom):
        figures.tidy(axes)
    return picture


def plot(heights: Heights, path: Path, title: str) -> None:
    """Write `figure` to `path`; raises InputError as `figures.save`."""
    figures.save(figure(heights, title), path)
