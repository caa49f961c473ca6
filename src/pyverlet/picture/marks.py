"""A mark on each disc that shows how far it has turned: a line from its centre to its rim."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.picture.palette import Packed
from pyverlet.picture.view import View

MARKED_PX = 4.0  # radius from which on a disc has a mark: in a smaller one it could not be told from its rim
MARK_PX = 1.4  # width of its line


def draw(
    pixels: Packed, position: NDArray[Any], radius: NDArray[Any], angle: NDArray[np.float64], colours: Packed, view: View
) -> None:
    """Mark discs (n, 2) and (n,) in m, turned by (n,) rad, in half of their own brightness; none until one has turned."""
    if not angle.any():
        return
    shown = np.flatnonzero(radius * view.scale >= MARKED_PX)
    if not len(shown):
        return
    centre, turned = position[shown].astype(np.float64), angle[shown]
    reach = radius[shown].astype(np.float64)[:, None]
    rim = centre + reach * np.column_stack((np.cos(turned), np.sin(turned)))
    half = np.asarray((colours[shown] >> np.uint32(1)) & np.uint32(0x7F7F7F), dtype=np.uint32)
    ends = np.stack((centre, rim), axis=1)
    unit("tools", np.float64).draw_lines(pixels, ends, half, view.left, view.top, view.scale, MARK_PX / 2)
