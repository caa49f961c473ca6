"""The grid in which obstacles are listed: its cell width, and the limit on distances from the origin."""

from __future__ import annotations

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import OBSTACLE_LINKS
from pyverlet.common.errors import InputError


def check_distance(farthest: Array, most: float, body: Array, count: int) -> None:
    """Refuse segments of these bodies, images of `count` obstacles included, at `most` m or more from the origin."""
    if not (farthest < most).all():
        number = int(body[np.nan_to_num(farthest, nan=np.inf).argmax()]) % count
        raise InputError(f"obstacles[{number}] is farther away than numbers reach; allowed are speeds that keep it at a place")


def cells_for(cell: float, length: Array, around: Array, beyond: float) -> tuple[float, Array, int]:
    """Choose cells of at least this width, so that there are not too many. Returns their width, m, empty heads, and room for
    links.

    length, around: (k,) m, of segments, and how far from them they are listed; beyond: cells farther than that.
    """
    while True:
        across = 2.0 * (around / cell + beyond) + 3.0
        links = int((length / cell * 2.0 * across + across * across).sum())
        if links <= OBSTACLE_LINKS + 64 * len(length):
            return cell, np.full(1 << max(links.bit_length(), 6), -1, np.int32), links
        cell *= 2.0
