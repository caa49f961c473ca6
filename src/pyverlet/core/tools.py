# mypy: ignore-errors
"""The tools unit: kernels that Python calls outside of frames."""

from __future__ import annotations

from pyverlet.core.area_drawing import draw_convex, fill, stroke, tint
from pyverlet.core.casting import cast
from pyverlet.core.checksum import checksums
from pyverlet.core.disc_drawing import draw_discs
from pyverlet.core.line_drawing import draw_lines
from pyverlet.core.link_pool import put_links
from pyverlet.core.obstacle_queries import carry, list_segments, segments_near
from pyverlet.core.page_arrays import copy_moving, put_rows, quantize
from pyverlet.core.queries import extent, in_regions, list_discs, nearest_to
from pyverlet.core.sorted_keys import drop_repeated, mark_absent
from pyverlet.core.touching import touching

__all__ = [
    "carry",
    "cast",
    "checksums",
    "copy_moving",
    "draw_convex",
    "draw_discs",
    "draw_lines",
    "drop_repeated",
    "extent",
    "fill",
    "in_regions",
    "list_discs",
    "list_segments",
    "mark_absent",
    "nearest_to",
    "put_links",
    "put_rows",
    "quantize",
    "segments_near",
    "stroke",
    "tint",
    "touching",
]
