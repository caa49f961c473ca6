# mypy: ignore-errors
"""Questions about obstacles where they stand: which are near a point, and how far from one it is.

A segment is twelve numbers: start and direction, length, rounding, inner (who is inside its polygon is as near as this), its
body, the first and how many faces of its polygon, its category and mask. Segments stand in a grid of hashed cells, each in all
cells within reach of it.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import (
    const_doubles,
    const_indices,
    const_integers,
    const_small_integers,
    doubles,
    integers,
    small_integers,
)
from cython.cimports.libc.math import INFINITY, fabs, floor, hypot
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.segments import FARTHEST_LISTED, head_at, list_line

PLACED = cython.declare(cython.int, 12)
X = cython.declare(cython.int, 0)
Y = cython.declare(cython.int, 1)
COSINE = cython.declare(cython.int, 2)
SINE = cython.declare(cython.int, 3)
LENGTH = cython.declare(cython.int, 4)
ROUNDING = cython.declare(cython.int, 5)
INNER = cython.declare(cython.int, 6)
BODY = cython.declare(cython.int, 7)
FIRST = cython.declare(cython.int, 8)
FACES = cython.declare(cython.int, 9)
CATEGORY = cython.declare(cython.int, 10)
MASK = cython.declare(cython.int, 11)

Grid = cython.struct(
    segment=cython.pointer[cython.const[cython.double]],
    segments=cython.Py_ssize_t,
    cell=cython.double,
    head=cython.pointer[cython.const[int32_t]],
    heads=int64_t,
    link=cython.pointer[cython.const[int32_t]],
)
Gap = cython.struct(gap=cython.double, x=cython.double, y=cython.double)


def list_segments(segments, reach: cython.double, cell: cython.double, heads, links) -> int:
    """List segments in the cells within `reach` m of them; returns how many links that takes, or -1 where there is no room.

    heads: (2^k,) int32, becomes the first link of each, or -1. links: (room, 2) int32, become segment and next link.
    """
    s: cython.pointer[cython.const[cython.double]] = const_doubles(segments)
    head: cython.pointer(int32_t) = small_integers(heads)
    link: cython.pointer(int32_t) = small_integers(links)
    count: cython.Py_ssize_t = len(segments)
    table: int64_t = len(heads)
    room: cython.Py_ssize_t = len(links)
    used: cython.Py_ssize_t = 0
    with cython.nogil:
        for k in range(table):
            head[k] = -1
        for k in range(count):
            at: cython.Py_ssize_t = PLACED * k
            dx: cython.double = s[at + COSINE] * s[at + LENGTH]
            dy: cython.double = s[at + SINE] * s[at + LENGTH]
            far: cython.double = reach + s[at + ROUNDING] + s[at + INNER]
            if used >= 0:
                used = list_line(k, s[at + X], s[at + Y], dx, dy, far, cell, head, table, link, room, used)
    return used


@cython.cfunc
def grid_of(segments, cell: cython.double, heads, links) -> Grid:
    """As a struct."""
    g: Grid
    g.segment, g.segments, g.cell = const_doubles(segments), len(segments), cell
    g.head, g.heads, g.link = const_small_integers(heads), len(heads), const_small_integers(links)
    return g


@inlined
def first_link(g: cython.pointer(Grid), x: cython.double, y: cython.double) -> int32_t:
    """Of the cell at (x, y), or -1; nothing stands as far out as the cells that are not told apart."""
    if not fabs(x) + fabs(y) < FARTHEST_LISTED * g.cell:
        return -1
    return g.head[head_at(cython.cast(int64_t, floor(x / g.cell)), cython.cast(int64_t, floor(y / g.cell)), g.heads)]


@inlined
def gap_of(g: cython.pointer(Grid), k: cython.Py_ssize_t, x: cython.double, y: cython.double) -> Gap:
    """Distance of (x, y) from the surface of segment k, m, and the unit normal out of it."""
    at: cython.Py_ssize_t = PLACED * k
    found: Gap
    ox: cython.double = x - g.segment[at + X]
    oy: cython.double = y - g.segment[at + Y]
    along: cython.double = g.segment[at + COSINE] * ox + g.segment[at + SINE] * oy
    along = min(max(along, 0.0), g.segment[at + LENGTH])
    ox -= along * g.segment[at + COSINE]
    oy -= along * g.segment[at + SINE]
    far: cython.double = hypot(ox, oy)
    found.gap, found.x, found.y = far - g.segment[at + ROUNDING], ox / max(far, 1e-300), oy / max(far, 1e-300)
    return found


@kernel
def face_within(
    s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, x: cython.double, y: cython.double
) -> cython.Py_ssize_t:
    """The face that (x, y) is nearest to in the polygon of which segment k is one, or -1 outside; faces run counter-clockwise."""
    first: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, s[PLACED * k + FIRST])
    nearest: cython.Py_ssize_t = -1
    least: cython.double = INFINITY
    for n in range(first, first + cython.cast(cython.Py_ssize_t, s[PLACED * k + FACES])):
        at: cython.Py_ssize_t = PLACED * n
        depth: cython.double = s[at + COSINE] * (y - s[at + Y]) - s[at + SINE] * (x - s[at + X])
        if depth <= 0.0:
            return -1
        if depth < least:
            least, nearest = depth, n
    return nearest


def bodies_near(
    segments, bodies: int64_t, cell: cython.double, heads, links, position, limit, category, mask, row, body, gap
) -> int:
    """The bodies within `limit` (n,) m, at most a cell, of each of the points (n, 2), that collide with their category and mask.

    bodies: how many, without images. Who is inside a polygon has a gap of -inf to it.
    Fills row, body and gap, and returns how many there are, also beyond their room.
    """
    grid: Grid = grid_of(segments, cell, heads, links)
    g: cython.pointer(Grid) = cython.address(grid)
    place: cython.pointer[cython.const[cython.double]] = const_doubles(position)
    most: cython.pointer[cython.const[cython.double]] = const_doubles(limit)
    own: cython.pointer[cython.const[uint32_t]] = const_indices(category)
    takes: cython.pointer[cython.const[uint32_t]] = const_indices(mask)
    to_row: cython.pointer(int64_t) = integers(row)
    to_body: cython.pointer(int64_t) = integers(body)
    to_gap: cython.pointer(cython.double) = doubles(gap)
    room: cython.Py_ssize_t = len(row)
    count: cython.Py_ssize_t = len(position)
    found: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(count):
            x: cython.double = place[2 * i]
            y: cython.double = place[2 * i + 1]
            begun: cython.Py_ssize_t = found
            link: int32_t = first_link(g, x, y)
            while link >= 0:
                k: cython.Py_ssize_t = g.link[2 * link]
                link = g.link[2 * link + 1]
                category_of: uint32_t = cython.cast(uint32_t, g.segment[PLACED * k + CATEGORY])
                if (own[i] & cython.cast(uint32_t, g.segment[PLACED * k + MASK])) == 0 or (category_of & takes[i]) == 0:
                    continue
                gap_here: cython.double = -INFINITY if face_within(g.segment, k, x, y) >= 0 else gap_of(g, k, x, y).gap
                if not gap_here <= most[i]:
                    continue
                which: int64_t = cython.cast(int64_t, g.segment[PLACED * k + BODY]) % bodies
                at: cython.Py_ssize_t = begun
                while at < found and (at >= room or to_body[at] != which):
                    at += 1
                if at < room and (at == found or gap_here < to_gap[at]):
                    to_row[at], to_body[at], to_gap[at] = i, which, gap_here
                found += at == found
    return found


def gaps_to(
    segments, bodies: int64_t, reach: cython.double, cell: cython.double, heads, links, position, wanted, gap, normal
):  # fmt: skip
    """Lower gap (n,) to the distance of each point from the rim of the body wanted (n,), m, and write the unit normal out of it.

    reach: m, up to which a cell knows all segments near it; who is farther from the body is compared with each.
    """
    grid: Grid = grid_of(segments, cell, heads, links)
    g: cython.pointer(Grid) = cython.address(grid)
    place: cython.pointer[cython.const[cython.double]] = const_doubles(position)
    body: cython.pointer[cython.const[int64_t]] = const_integers(wanted)
    to_gap: cython.pointer(cython.double) = doubles(gap)
    to_normal: cython.pointer(cython.double) = doubles(normal)
    count: cython.Py_ssize_t = len(position)
    with cython.nogil:
        for i in range(count):
            x: cython.double = place[2 * i]
            y: cython.double = place[2 * i + 1]
            each: cython.bint = False
            while True:
                link: int64_t = 0 if each else first_link(g, x, y)
                while link >= 0 and link < (g.segments if each else link + 1):
                    k: cython.Py_ssize_t = link if each else g.link[2 * link]
                    link = link + 1 if each else g.link[2 * link + 1]
                    if cython.cast(int64_t, g.segment[PLACED * k + BODY]) % bodies == body[i]:
                        there: Gap = gap_of(g, k, x, y)
                        if there.gap < to_gap[i]:
                            to_gap[i], to_normal[2 * i], to_normal[2 * i + 1] = there.gap, there.x, there.y
                if each or to_gap[i] <= reach:
                    break
                each = True
