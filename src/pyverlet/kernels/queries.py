"""Questions about circles in cells: `cell`, `columns`, `rows`, `start` as in kernels.grid, `member` whose slot it is.

A circle is in the cell of its centre; the layout covers all centres, so that nothing is clamped. Cells are found by a product
with 1 / cell, as when the particles were sorted: rounded alike, nobody is missed at the edge of one. All answers are float64.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel


@kernel
def _clamped(value, cells):
    if value >= cells - 1:
        return cells - 1
    return int(value) if value > 0 else 0


@kernel
def at_points(points, reach, x0, y0, cell, columns, rows, start, member, position, radius, found):
    """For each point (q, 2) the circle that covers it, the one of nearest centre; -1 for none. `reach`: the largest radius."""
    per = 1.0 / cell
    for q in range(points.shape[0]):
        x, y = points[q, 0], points[q, 1]
        found[q] = -1
        best = np.inf
        for row in range(_clamped((y - reach - y0) * per, rows), _clamped((y + reach - y0) * per, rows) + 1):
            low = start[row * columns + _clamped((x - reach - x0) * per, columns)]
            high = start[row * columns + _clamped((x + reach - x0) * per, columns) + 1]
            for k in range(low, high):
                i = member[k]
                dx, dy = position[i, 0] - x, position[i, 1] - y
                square = dx * dx + dy * dy
                if square <= np.float64(radius[i]) * radius[i] and (square < best or (square == best and i < found[q])):
                    best = square
                    found[q] = i


@kernel
def in_regions(lower, upper, center, size, x0, y0, cell, columns, rows, start, member, position, query, particle):
    """Centres in boxes lower to upper (q, 2) and, where `size` (q,) is finite, within that distance of `center` (q, 2).

    Writes pairs (query, particle); returns how many there are, also beyond the room.
    """
    found = 0
    per = 1.0 / cell
    for q in range(lower.shape[0]):
        for row in range(_clamped((lower[q, 1] - y0) * per, rows), _clamped((upper[q, 1] - y0) * per, rows) + 1):
            low = start[row * columns + _clamped((lower[q, 0] - x0) * per, columns)]
            high = start[row * columns + _clamped((upper[q, 0] - x0) * per, columns) + 1]
            for k in range(low, high):
                i = member[k]
                x, y = np.float64(position[i, 0]), np.float64(position[i, 1])
                dx, dy = x - center[q, 0], y - center[q, 1]
                inside = lower[q, 0] <= x <= upper[q, 0] and lower[q, 1] <= y <= upper[q, 1]
                if inside and (size[q] == np.inf or dx * dx + dy * dy <= size[q] * size[q]):
                    if found < query.shape[0]:
                        query[found], particle[found] = q, i
                    found += 1
    return found


@kernel
def _enters(x, y, dx, dy, px, py, r):
    """Distance along a ray from (x, y) in the unit direction (dx, dy) to a circle; 0 from inside, infinity for a miss."""
    ox, oy = px - x, py - y
    along, across = ox * dx + oy * dy, ox * dy - oy * dx
    if ox * ox + oy * oy <= r * r:
        return 0.0
    if along < 0.0 or across * across > r * r:
        return np.inf
    return along - np.sqrt(r * r - across * across)


@kernel
def rays(origin, direction, length, reach, x0, y0, cell, columns, rows, start, member, position, radius, index, distance):
    """The first circle on each ray, and how far away; -1 and infinity for none. `direction` (q, 2): of length 1.

    The ray is walked in steps of a cell. At each the cells within `reach`, the largest radius, of the piece are looked at, until
    no later one can be nearer.
    """
    per = 1.0 / cell
    for q in range(origin.shape[0]):
        x, y, dx, dy = origin[q, 0], origin[q, 1], direction[q, 0], direction[q, 1]
        index[q], distance[q] = -1, np.inf
        # The part of the ray that is within reach of the grid.
        begin, end = 0.0, length[q]
        for axis in range(2):
            p, d = (x - x0, dx) if axis == 0 else (y - y0, dy)
            size = cell * (columns if axis == 0 else rows)
            if d != 0.0:
                a, b = (-reach - p) / d, (size + reach - p) / d
                begin, end = max(begin, min(a, b)), min(end, max(a, b))
            elif not -reach <= p <= size + reach:
                end = -1.0
        s = begin
        while s <= end and s <= distance[q]:
            ax, ay, bx, by = x + s * dx, y + s * dy, x + (s + cell) * dx, y + (s + cell) * dy
            left = _clamped((min(ax, bx) - reach - x0) * per, columns)
            right = _clamped((max(ax, bx) + reach - x0) * per, columns)
            for row in range(
                _clamped((min(ay, by) - reach - y0) * per, rows), _clamped((max(ay, by) + reach - y0) * per, rows) + 1
            ):
                for k in range(start[row * columns + left], start[row * columns + right + 1]):
                    i = member[k]
                    far = _enters(x, y, dx, dy, np.float64(position[i, 0]), np.float64(position[i, 1]), np.float64(radius[i]))
                    if far <= length[q] and (far < distance[q] or (far == distance[q] and i < index[q])):
                        index[q], distance[q] = i, far
            s += cell


@kernel
def _offer(index, square, count, i, value):
    """Insert particle i into the nearest so far, ascending in square distance, then index; returns how many there are."""
    room = index.shape[0]
    if count == room and (value > square[room - 1] or (value == square[room - 1] and i > index[room - 1])):
        return count
    k = min(count, room - 1)
    while k > 0 and (square[k - 1] > value or (square[k - 1] == value and index[k - 1] > i)):
        square[k], index[k] = square[k - 1], index[k - 1]
        k -= 1
    square[k], index[k] = value, i
    return min(count + 1, room)


@kernel
def nearest(points, x0, y0, cell, columns, rows, start, member, position, index, square):
    """The centres nearest to each point (q, 2), in rows of `index` and `square` (q, k); what is left over stays as it was.

    Cells are looked at in square rings about the point's own, until the ring is farther away than what was found.
    """
    per = 1.0 / cell
    for q in range(points.shape[0]):
        x, y = points[q, 0], points[q, 1]
        # Outside of the grid the rings begin at the nearest cell, and all distances only grow by that.
        column, row = _clamped((x - x0) * per, columns), _clamped((y - y0) * per, rows)
        count = 0
        for ring in range(max(columns, rows)):
            gap = cell * (ring - 1) * (1.0 - 1e-12)  # the point is somewhere in its cell, at least this far from the ring
            if ring > 0 and count == index.shape[1] and gap > 0.0 and gap * gap > square[q, count - 1]:
                break
            for r in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
                step = 1 if abs(r - row) == ring else 2 * ring
                for c in range(column - ring, column + ring + 1, max(step, 1)):
                    if 0 <= c < columns:
                        for k in range(start[r * columns + c], start[r * columns + c + 1]):
                            i = member[k]
                            dx, dy = position[i, 0] - x, position[i, 1] - y
                            count = _offer(index[q], square[q], count, i, dx * dx + dy * dy)
