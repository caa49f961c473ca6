# mypy: ignore-errors
"""Queries on particles listed in square cells of one size: which are in a region, which are nearest.

Cells: `x0`, `y0` is their lower left corner, `cell` their size, m; `columns`, `rows`; `start` (columns rows + 1,) is the offset
of each in `member`, which holds particle indices. A particle is in the cell of its centre, or in the nearest rim cell, and so are
query points. Cells are found by multiplication by 1 / cell, as when particles were sorted: equal rounding means that none is
missed at an edge. All results are float64.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, integers, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, isfinite
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined

Cells = cython.struct(
    x0=cython.double, y0=cython.double, cell=cython.double, per=cython.double, columns=int64_t, rows=int64_t,
    start=cython.pointer[cython.const[int32_t]], member=cython.pointer[cython.const[int32_t]],
)  # fmt: skip


def extent(position):
    """(min x, min y, max x, max y) of the particles with finite positions; zeros if there are none."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    count: cython.Py_ssize_t = len(position)
    x0: real = 0
    y0: real = 0
    x1: real = 0
    y1: real = 0
    found: cython.bint = False
    with cython.nogil:
        for i in range(count):
            if isfinite(x[2 * i]) and isfinite(x[2 * i + 1]):
                x0 = min(x0, x[2 * i]) if found else x[2 * i]
                x1 = max(x1, x[2 * i]) if found else x[2 * i]
                y0 = min(y0, x[2 * i + 1]) if found else x[2 * i + 1]
                y1 = max(y1, x[2 * i + 1]) if found else x[2 * i + 1]
                found = True
    return x0, y0, x1, y1


@inlined
def cell_at(value: cython.double, cells: int64_t) -> int64_t:
    """floor(value) clamped to 0 .. cells - 1: points outside use rim cells. NaN fails both comparisons: 0."""
    if value >= cells - 1:
        return cells - 1
    return cython.cast(int64_t, value) if value > 0 else 0


def list_discs(
    position, radius, reach: cython.double, x0: cython.double, y0: cython.double, cell: cython.double,
    columns: int64_t, rows: int64_t, begin, member,
) -> int:  # fmt: skip
    """Set member[begin[k] : begin[k + 1]] to the discs within `reach` m of cell k, row by row; returns their total.

    radius: (n,), or empty for points. begin: (columns rows + 2,) int32. member: int32; if it is too short, it is not written.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    first: cython.pointer(int32_t) = small_integers(begin)
    to: cython.pointer(int32_t) = small_integers(member)
    count: cython.Py_ssize_t = len(position)
    sized: cython.bint = len(radius) > 0
    capacity: int64_t = len(member)
    found: int64_t = 0
    per: cython.double = 1.0 / cell
    k: int64_t
    fill: cython.int
    with cython.nogil:
        for k in range(columns * rows + 2):
            first[k] = 0
        for fill in range(2):
            for i in range(count):
                if not (isfinite(x[2 * i]) and isfinite(x[2 * i + 1])):
                    continue
                far: cython.double = r[i] + reach if sized else reach
                left: int64_t = cell_at((x[2 * i] - far - x0) * per, columns)
                right: int64_t = left if far == 0 else cell_at((x[2 * i] + far - x0) * per, columns)
                low: int64_t = cell_at((x[2 * i + 1] - far - y0) * per, rows)
                high: int64_t = low if far == 0 else cell_at((x[2 * i + 1] + far - y0) * per, rows)
                if not fill:
                    found += (right - left + 1) * (high - low + 1)
                for row in range(low, high + 1):
                    for column in range(left, right + 1):
                        k = row * columns + column
                        if fill:
                            to[first[k + 1]] = cython.cast(int32_t, i)
                            first[k + 1] += 1
                        else:
                            first[k + 2] += 1
            if found > capacity:
                break
            if not fill:
                for k in range(columns * rows):
                    first[k + 2] += first[k + 1]
    return found


@cython.cfunc
def cells_of(cells) -> Cells:
    """A struct from the tuple (x0, y0, cell, columns, rows, start, member)."""
    c: Cells
    c.x0, c.y0, c.cell, c.columns, c.rows = cells[0], cells[1], cells[2], cells[3], cells[4]
    c.start, c.member = const_small_integers(cells[5]), const_small_integers(cells[6])
    c.per = 1.0 / c.cell
    return c


@inlined
def column_of(c: cython.pointer(Cells), x: cython.double) -> int64_t:
    """The column of cells at x, m."""
    return cell_at((x - c.x0) * c.per, c.columns)


@inlined
def row_of(c: cython.pointer(Cells), y: cython.double) -> int64_t:
    """The row of cells at y, m."""
    return cell_at((y - c.y0) * c.per, c.rows)


def in_regions(lower, upper, center, size, cells, position, query, particle, later: cython.bint):
    """Find centres in boxes lower to upper (q, 2) and, where `size` (q,) is finite, within that distance of `center` (q, 2).

    later: only particles with a higher index than the query's. Writes pairs (query, particle); returns their number, even beyond
    the room.
    """
    grid: Cells = cells_of(cells)
    c: cython.pointer(Cells) = cython.address(grid)
    low: cython.pointer[cython.const[cython.double]] = const_doubles(lower)
    high: cython.pointer[cython.const[cython.double]] = const_doubles(upper)
    middle: cython.pointer[cython.const[cython.double]] = const_doubles(center)
    far: cython.pointer[cython.const[cython.double]] = const_doubles(size)
    p: cython.pointer[cython.const[real]] = const_reals(position)
    of: cython.pointer[int64_t] = integers(query)
    which: cython.pointer[int64_t] = integers(particle)
    count: int64_t = len(lower)
    capacity: int64_t = len(query)
    found: int64_t = 0
    k: int64_t
    with cython.nogil:
        for q in range(count):
            left: int64_t = column_of(c, low[2 * q])
            right: int64_t = column_of(c, high[2 * q])
            for row in range(row_of(c, low[2 * q + 1]), row_of(c, high[2 * q + 1]) + 1):
                for k in range(c.start[row * c.columns + left], c.start[row * c.columns + right + 1]):
                    i: int64_t = c.member[k]
                    x: cython.double = p[2 * i]
                    y: cython.double = p[2 * i + 1]
                    if later and i <= q:
                        continue
                    if not (low[2 * q] <= x and x <= high[2 * q] and low[2 * q + 1] <= y and y <= high[2 * q + 1]):
                        continue
                    dx: cython.double = x - middle[2 * q]
                    dy: cython.double = y - middle[2 * q + 1]
                    if far[q] == INFINITY or dx * dx + dy * dy <= far[q] * far[q]:
                        if found < capacity:
                            of[found] = q
                            which[found] = i
                        found += 1
    return found


@inlined
def offer(
    index: cython.pointer[int64_t],
    square: cython.p_double,
    at: int64_t,
    capacity: int64_t,
    count: int64_t,
    i: int64_t,
    value: cython.double,
) -> int64_t:
    """Insert particle i into the nearest so far, ordered by square distance, then index; returns their number."""
    last: int64_t = at + capacity - 1
    if count == capacity and (value > square[last] or (value == square[last] and i > index[last])):
        return count
    k: int64_t = at + min(count, capacity - 1)
    while k > at and (square[k - 1] > value or (square[k - 1] == value and index[k - 1] > i)):
        square[k] = square[k - 1]
        index[k] = index[k - 1]
        k -= 1
    square[k] = value
    index[k] = i
    return min(count + 1, capacity)


def nearest_to(points, cells, position, index, square):
    """The centres nearest to each point (q, 2), in rows of `index` and `square` (q, k); unused entries stay unchanged.

    Cells are searched in squares about the point, each twice as wide as the one before, until one reaches beyond the farthest
    result.
    """
    grid: Cells = cells_of(cells)
    c: cython.pointer(Cells) = cython.address(grid)
    at: cython.pointer[cython.const[cython.double]] = const_doubles(points)
    p: cython.pointer[cython.const[real]] = const_reals(position)
    which: cython.pointer[int64_t] = integers(index)
    far: cython.p_double = doubles(square)
    capacity: int64_t = index.shape[1]
    questions: int64_t = len(points)
    k: int64_t
    with cython.nogil:
        for q in range(questions):
            x: cython.double = at[2 * q]
            y: cython.double = at[2 * q + 1]
            reach: cython.double = 0.5 * c.cell
            whole: cython.bint = False
            count: int64_t = 0
            while not whole and (count < capacity or far[q * capacity + capacity - 1] > reach * reach * (1.0 - 1e-12)):
                reach *= 2.0
                count = 0
                left: int64_t = column_of(c, x - reach)
                right: int64_t = column_of(c, x + reach)
                low: int64_t = row_of(c, y - reach)
                high: int64_t = row_of(c, y + reach)
                whole = left == 0 and low == 0 and right == c.columns - 1 and high == c.rows - 1
                for row in range(low, high + 1):
                    for k in range(c.start[row * c.columns + left], c.start[row * c.columns + right + 1]):
                        i: int64_t = c.member[k]
                        dx: cython.double = p[2 * i] - x
                        dy: cython.double = p[2 * i + 1] - y
                        count = offer(which, far, q * capacity, capacity, count, i, dx * dx + dy * dy)
