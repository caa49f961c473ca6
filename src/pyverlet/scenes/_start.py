"""Initial positions of circles: drawn radii, and a slightly shaken lattice of rows that fills a shape without overlap."""

from bisect import bisect_right
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.arrays import Floats

Row = tuple[float, float, list[NDArray[np.intp]]]
"""Height of the centres, available width between the first and the last, and indices of the members per size class."""

_SIZE_CLASSES = 6  # rows alternate between this many size classes, so that large and small circles start mixed
_SHAKE = 0.4  # largest shift of a circle along each axis, in gaps; below 0.5 it stays in its own cell
_CLEARANCE = 0.6  # distance of a cell's circle from the wall before shaking, in gaps: more than the diagonal shift, sqrt(2) * 0.4

_HALVINGS = 20


def draw_radii(rng: np.random.Generator, count: int, spread: float, rms: float) -> Floats:
    """Draw `count` radii (m), uniform with largest / smallest <= `spread`, scaled to the root mean square `rms` (m).

    The scaling keeps the total area at count * pi * rms**2 for any spread.
    """
    radii = rng.uniform(1.0, spread, count) if spread > 1.0 else np.ones(count)
    scaled: Floats = radii * (rms / np.sqrt(np.mean(radii**2)))
    return scaled


def in_circle(rng: np.random.Generator, radii: Floats, cage_radius: float) -> Floats | None:
    """Centres (n, 2) in metres, about (0, 0), that fill a cage of `cage_radius` (m); None if they do not fit."""

    def half_width(y: float, margin: float) -> float:
        room = cage_radius - margin
        return float(np.sqrt(room * room - y * y)) if room >= abs(y) else -1.0

    return in_rows(rng, radii, -cage_radius, cage_radius, half_width)


def in_box(rng: np.random.Generator, radii: Floats, width: float, height: float) -> Floats | None:
    """Centres (n, 2) in metres that fill the box (-width/2, 0) to (width/2, height); None if they do not fit."""
    return in_rows(rng, radii, 0.0, height, lambda _y, margin: width / 2 - margin)


def in_rows(
    rng: np.random.Generator, radii: Floats, bottom: float, top: float, half_width: Callable[[float, float], float]
) -> Floats | None:
    """Fill a shape with rows of circles, as far apart as possible, then shake each inside its own cell.

    Args:
        rng: random generator for shaking and the order inside a row.
        radii: (n,) in metres.
        bottom, top: extent of the shape in metres.
        half_width: of (y, margin): how far from x = 0 a centre at height y may be so that a circle of radius `margin` is inside
            the shape; negative if there is no room. The shape is symmetric about x = 0.

    Returns:
    (n, 2) centres in metres in the order of `radii`, or None if the circles do not fit.
    """
    descending = np.argsort(-radii, kind="stable")
    count = len(radii)
    equal = radii[descending[0]] == radii[descending[-1]]
    classes = [part for part in np.array_split(descending, 1 if equal or count < 200 else _SIZE_CLASSES) if len(part)]

    def attempt(gap: float) -> list[Row] | None:
        # The height of the first row matters only if there are few rows.
        for lift in np.linspace(0.0, 1.0, 9 if count < 200 else 2)[:-1]:
            start = bottom + 0.1 * gap + float(lift) * radii[descending[0]]
            if rows := _stack(radii, classes, gap, start, top, half_width):
                return rows
        return None

    tight = 0.02 * float(radii.mean())
    best = attempt(tight)
    if best is None:
        return None
    low, high = tight, 2.0 * (top - bottom) / np.sqrt(count)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if rows := attempt(middle):
            best, low = rows, middle
        else:
            high = middle

    centres = np.empty((count, 2))
    for y, width, members in best:
        row = rng.permutation(np.concatenate(members))
        cells = 2 * radii[row] + low
        x = np.cumsum(cells) - cells / 2
        x += np.linspace(0.0, width - (x[-1] - x[0]), len(row))
        centres[row, 0] = x - (x[0] + x[-1]) / 2
        centres[row, 1] = y
    return centres + rng.uniform(-_SHAKE * low, _SHAKE * low, (count, 2))


def _stack(
    radii: Floats,
    classes: list[NDArray[np.intp]],
    gap: float,
    bottom: float,
    top: float,
    half_width: Callable[[float, float], float],
) -> list[Row] | None:
    """Rows from the bottom up, every cell `gap` wider than its circle; None if they do not fit."""
    # starts[k][i]: left edge of the i-th cell of class k if the class stood in one infinite row.
    starts = [np.concatenate(([0.0], np.cumsum(2 * radii[part] + gap))) for part in classes]
    taken = [0] * len(classes)
    rows: list[Row] = []
    y = bottom
    while True:
        left = [1.0 - taken[k] / len(classes[k]) for k in range(len(classes))]
        k = left.index(max(left))
        if left[k] == 0.0:
            return rows
        tallest = float(radii[classes[k][taken[k]]])
        middle = y + tallest + gap / 2
        if middle + tallest + _CLEARANCE * gap > top:
            return None
        width = 2 * half_width(middle, tallest + _CLEARANCE * gap)
        row: list[NDArray[np.intp]] = []
        used = 0.0
        # A row is full when the next cell's left edge exceeds the width: the first circle is the largest, so the centres of first
        # and last are at most the width apart, in any order of the row.
        while width >= used and k < len(classes):  # an exhausted class is followed by the next smaller one
            first, start = taken[k], float(starts[k][taken[k]])
            n = bisect_right(starts[k], start + width - used, first, len(classes[k])) - first
            row.append(classes[k][first : first + n])
            taken[k] += n
            used += float(starts[k][taken[k]]) - start
            k += 1
        if row:
            rows.append((middle, width, row))
        y += 2 * tallest + gap
