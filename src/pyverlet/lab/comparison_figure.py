"""The figure of a comparison: energy and heights over time, drift and cost against substeps. Needs the extra `plot`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from pyverlet.lab import figures
from pyverlet.lab.compare import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_COLUMNS = 4  # most numbers of substeps with a column of their own: the first ones
SAMPLES = 900  # points of a curve: more than the resolution of a figure
LINEAR_BELOW = 1e-2  # relative changes are drawn linearly below, logarithmically above


def figure(runs: Sequence[Run], title: str, line: float | None = None) -> Figure:
    """A column per number of substeps, a curve per integrator; `line` is a height in m that the maxima should reach."""
    names = list(dict.fromkeys(run.integrator for run in runs))
    counts = list(dict.fromkeys(run.substeps for run in runs))
    shown = counts[:MOST_COLUMNS]
    picture = Figure(figsize=(max(4.2 * len(shown), 9.0), 10.5), dpi=150, layout="constrained")
    above, below = np.asarray(picture.subfigures(2, 1, height_ratios=(2.0, 1.0)))
    grid = above.subplots(2, len(shown), sharex=True, sharey="row", squeeze=False)
    for column, count in enumerate(shown):
        for run in runs:
            if run.substeps == count:
                _draw(grid[0, column], grid[1, column], run, names.index(run.integrator))
        if line is not None and runs[0].exact is None:
            grid[1, column].axhline(line, color="#666666", ls="--", lw=1.2, label="height of the start")
        grid[0, column].set_title(f"{count} substep{'' if count == 1 else 's'} a frame")
        if max(float(np.abs(run.relative).max()) for run in runs) > 10 * LINEAR_BELOW:
            grid[0, column].set_yscale("symlog", linthresh=LINEAR_BELOW)
        grid[0, column].axhline(0.0, color="#666666", ls="--", lw=1.2)
        grid[1, column].set_xlabel("time t (s)")
    grid[0, 0].set_ylabel("energy: (E - E₀) / |E₀|\n(dashed: conserved)")
    if runs[0].exact is not None:
        grid[1, 0].set_ylabel("error of the height (m)\n(dashed: the closed form)")
        for axes in grid[1]:
            axes.axhline(0.0, color="#666666", ls="--", lw=1.2)
    else:
        tops = any(len(run.apexes[1]) for run in runs)
        what = "tops of the path (m)" if tops else "height y (m)"
        grid[1, 0].set_ylabel(what if line is None else f"{what}\n(dashed: height of the start)")
    drift, cost = below.subplots(1, 2)
    for number, name in enumerate(names):
        own = [run for run in runs if run.integrator == name]
        x = [run.substeps for run in own]
        drift.plot(x, [max(abs(run.drift), 1e-16) for run in own], label=name, lw=_width(number), **figures.style(number))
        cost.plot(x, [run.ms_per_frame for run in own], label=name, lw=1.4, **figures.style(number))
    drift.set(xscale="log", yscale="log", xlabel="substeps a frame", ylabel="|relative drift| at the end")
    cost.set(xscale="log", yscale="log", xlabel="substeps a frame", ylabel="cost (ms a frame, median)")
    cost.yaxis.set_major_formatter("{x:g}")
    cost.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    cost.yaxis.set_minor_formatter("{x:g}")
    for axes in (drift, cost):
        axes.set_xticks(counts, [str(count) for count in counts])
        axes.set_xticks([], minor=True)
    for axes in (*grid.flat, drift, cost):
        figures.tidy(axes)
    figures.legend(picture, drift, min(len(names), 4))
    picture.suptitle(title)
    return picture


def _width(number: int) -> float:
    """Later curves are thinner, so that the rim of one below remains visible."""
    return max(3.2 - 0.45 * number, 0.8)


def _draw(energy: Axes, height: Axes, run: Run, number: int) -> None:
    part, look = slice(None, None, max(1, len(run.time) // SAMPLES)), figures.style(number)
    line: dict[str, Any] = {"lw": _width(number), "color": look["color"]}
    energy.plot(run.time[part], run.relative[part], **line)
    time, top = run.apexes
    if run.exact is not None:
        height.plot(run.time[part], (run.height - run.exact)[part], **line)
    elif len(top):
        height.plot(time, top, ls="none", ms=4, mfc="none", **look)
    else:
        height.plot(run.time[part], run.height[part], **line)
