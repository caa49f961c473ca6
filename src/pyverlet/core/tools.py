# mypy: ignore-errors
"""The unit of the tools: kernels that Python calls by themselves, outside of a frame."""

from __future__ import annotations

from pyverlet.core.area_drawing import draw_convex, fill, stroke, tint
from pyverlet.core.checksum import checksum
from pyverlet.core.disc_drawing import draw_discs
from pyverlet.core.line_drawing import draw_lines
from pyverlet.core.page_arrays import copy_moving, put_rows, quantize
from pyverlet.core.queries import at_points, first_on_rays, in_regions, nearest_to
from pyverlet.core.sleepers import find_edited, find_islands, time_at_rest

__all__ = [
    "at_points",
    "checksum",
    "copy_moving",
    "draw_convex",
    "draw_discs",
    "draw_lines",
    "fill",
    "find_edited",
    "find_islands",
    "first_on_rays",
    "in_regions",
    "nearest_to",
    "put_rows",
    "quantize",
    "stroke",
    "time_at_rest",
    "tint",
]
