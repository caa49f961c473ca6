"""What all figures of the laboratory share: refusing early what would fail late, distinct colours, saving."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pyverlet.ground.errors import InputError
from pyverlet.ground.outside import file_errors, require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Okabe and Ito, told apart by the colour-blind too (Color Universal Design, 2008); their yellow is too pale for lines."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")  # curves are told apart in black and white as well


def style(number: int) -> dict[str, Any]:
    """Colour and marker of the curve with this number."""
    return {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}


def check_can_plot(path: Path) -> None:
    """Refuse before a long run what would fail after it.

    Raises:
        InputError: matplotlib is missing, the folder does not exist, or the suffix is not one of a picture.
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
    """What the curves of these axes are called, below the whole figure."""
    picture.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)


def tidy(axes: Axes) -> None:
    """A light grid, and no frame where no axis is."""
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def save(picture: Figure, path: Path) -> None:
    """Write a figure to `path`; InputError as in `check_can_plot`, or if the file cannot be written."""
    check_can_plot(path)
    with file_errors("plot", path, "written"):
        picture.savefig(path)
