"""Helpers for all figures of the laboratory, and the figure of heights over time with the exact solution."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.outside import file_errors, require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Colours of Okabe and Ito, distinguishable by the colour-blind (2008), without their yellow, which is too pale for lines."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")  # for distinction in black and white


def style(number: int) -> dict[str, Any]:
    """Colour and marker of the curve with this number."""
    return {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}


def check_can_plot(path: Path) -> None:
    """Before a long run, refuse what would fail after it.

    Raises:
        InputError: matplotlib is missing, the folder does not exist, or the suffix is not that of a picture.
    """
    require("plot", "matplotlib", extra="plot")
    if not path.parent.is_dir():
        raise InputError(f"plot is '{path}'; allowed is a file in a folder that exists")
    if path.is_dir():
        raise InputError(f"plot is '{path}', a folder; allowed is the name of a file")
    known = (".pdf", ".png", ".svg")
    if path.suffix.lower() not in known:
        raise InputError(f"plot is '{path}'; allowed is a name that ends in {', '.join(known)}")


def legend(picture: Figure, axes: Axes, columns: int = 4) -> None:
    """A legend for the curves of these axes, below the whole figure."""
    picture.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)


def tidy(axes: Axes) -> None:
    """Draw a light grid, and remove the frame where there is no axis."""
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def save(picture: Figure, path: Path) -> None:
    """Write a figure to `path`; InputError as for `check_can_plot`, or if the file cannot be written."""
    check_can_plot(path)
    with file_errors("plot", path, "written"):
        picture.savefig(path)


MOST_CURVES = 8  # most circles in a figure; more would hide each other


def heights_figure(time: Floats, simulated: Floats, exact: Floats, title: str) -> Figure:
    """A figure of two panels: heights y(t), (m, n), with exact ones, and the error below. Needs the extra `plot`."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(7.0, 6.0), dpi=150, layout="constrained")
    top, bottom = picture.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    # Blue circles on an orange line differ in shape and colour, also for the colour-blind.
    every = max(1, len(time) // 40)
    for i in np.unique(np.linspace(0, exact.shape[1] - 1, MOST_CURVES).astype(int)):
        line, circles = ("closed form", "pyverlet") if i == 0 else (None, None)
        top.plot(time, exact[:, i], color="#E69F00", lw=2.0, label=line)
        top.plot(time[::every], simulated[::every, i], "o", color="#0072B2", ms=4, mfc="none", label=circles)
        bottom.plot(time, simulated[:, i] - exact[:, i], color="#0072B2", lw=1.0)
    top.set(ylabel="height y (m)", title=title)
    top.legend(frameon=False)
    bottom.set(xlabel="time t (s)", ylabel="error in y (m)")
    bottom.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    for axes in (top, bottom):
        tidy(axes)
    return picture
