# mypy: ignore-errors
"""Queries on obstacles at their current places: distances from points, and how far circles, or rays as circles of radius 0,
travel until they touch a disc, an obstacle or a wall.

A circle of radius R touches an object when its centre reaches the object grown by R, so all distances are those of rays to grown
objects.

A segment is twelve numbers: start and direction, length, rounding, inner (distance that counts inside its polygon), its body,
the first and number of faces of its polygon, its category and mask. Segments are listed in a grid of hashed cells, each in all
cells within reach of it.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_integers, const_small_integers, doubles, integers, small_integers
from cython.cimports.libc.math import INFINITY, fabs, floor, hypot, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.segments import FARTHEST_LISTED, ROUNDED_OFF, head_at, list_line, way_to_line

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
CAGE = cython.declare(cython.int, 4)
"""Number of a cage's only side, after those of a box."""

Ray = cython.struct(
    x=cython.double, y=cython.double, dx=cython.double, dy=cython.double,  # origin and unit direction
    per_x=cython.double, per_y=cython.double,  # 1 / dx and 1 / dy, 1e300 for 0
    size=cython.double,  # radius R of the circle
    best=cython.double,  # least distance found so far
    kind=cython.int, index=int64_t, segment=cython.Py_ssize_t,  # object that stops it there
)  # fmt: skip
Normal = cython.struct(x=cython.double, y=cython.double)


def carry(bodies, moving, dt: cython.double):
    """Advance the bodies (n, 6) with these numbers by dt seconds at the velocities in their last three columns."""
    b: cython.pointer(cython.double) = doubles(bodies)
    which: cython.pointer[cython.const[int64_t]] = const_integers(moving)
    for k in range(len(moving)):
        for column in range(3):
            at: cython.Py_ssize_t = 6 * which[k] + column
            b[at] = b[at] + dt * b[at + 3]


def list_segments(segments, reach: cython.double, cell: cython.double, heads, links) -> int:
    """List segments in the cells within `reach` m of them; returns the number of links, or -1 if there is no room.

    heads: (2^k,) int32, set to the first link of each, or -1. links: (room, 2) int32, set to segment and next link.
    """
    s: cython.pointer[cython.const[cython.double]] = const_doubles(segments)
    head: cython.pointer(int32_t) = small_integers(heads)
    link: cython.pointer(int32_t) = small_integers(links)
    count: cython.Py_ssize_t = len(segments)
    table: int64_t = len(heads)
    capacity: cython.Py_ssize_t = len(links)
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
                used = list_line(k, s[at + X], s[at + Y], dx, dy, far, cell, head, table, link, capacity, used)
    return used


@cython.cfunc
def grid_of(segments, cell: cython.double, heads, links) -> Grid:
    """The grid as a struct."""
    g: Grid
    g.segment, g.segments, g.cell = const_doubles(segments), len(segments), cell
    g.head, g.heads, g.link = const_small_integers(heads), len(heads), const_small_integers(links)
    return g


@inlined
def first_link(g: cython.pointer(Grid), x: cython.double, y: cython.double) -> int32_t:
    """First link of the cell at (x, y), or -1; no segments are listed beyond the range of distinct cells."""
    if not fabs(x) + fabs(y) < FARTHEST_LISTED * g.cell:
        return -1
    return g.head[head_at(cython.cast(int64_t, floor(x / g.cell)), cython.cast(int64_t, floor(y / g.cell)), g.heads)]


@kernel
def face_within(
    s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, x: cython.double, y: cython.double
) -> cython.Py_ssize_t:
    """The face nearest to (x, y) in the polygon that segment k belongs to, or -1 outside; faces run counter-clockwise."""
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


def segments_near(
    segments, bodies: int64_t, cell: cython.double, heads, links, position, limit, wanted, row, segment, gap, normal, inside
) -> int:
    """Segments listed at points (n, 2) whose surface is within `limit` (n,) m of them, or whose polygon contains them.

    bodies: number without images; wanted: (n,) int64, the only body to consider for each point, of which the nearest segment is
    found, or empty. Fills row and segment (k,), the point and segment; gap, m, the distance from the surface; normal (k, 2), the
    unit normal out of it; inside, 1 in the polygon, else 0. Returns their number, even beyond the room; some occur twice.
    """
    grid: Grid = grid_of(segments, cell, heads, links)
    g: cython.pointer(Grid) = cython.address(grid)
    place: cython.pointer[cython.const[cython.double]] = const_doubles(position)
    most: cython.pointer[cython.const[cython.double]] = const_doubles(limit)
    body: cython.pointer[cython.const[int64_t]] = const_integers(wanted)
    to_row: cython.pointer(int64_t) = integers(row)
    to_segment: cython.pointer(int64_t) = integers(segment)
    to_gap: cython.pointer(cython.double) = doubles(gap)
    to_normal: cython.pointer(cython.double) = doubles(normal)
    to_inside: cython.pointer(int64_t) = integers(inside)
    capacity: cython.Py_ssize_t = len(row)
    count: cython.Py_ssize_t = len(position)
    all_count: cython.bint = len(wanted) == 0
    found: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(count):
            x: cython.double = place[2 * i]
            y: cython.double = place[2 * i + 1]
            begun: cython.Py_ssize_t = found
            link: int32_t = first_link(g, x, y)
            while link >= 0:
                k: cython.Py_ssize_t = g.link[2 * link]
                at: cython.Py_ssize_t = PLACED * k
                link = g.link[2 * link + 1]
                if not (all_count or cython.cast(int64_t, g.segment[at + BODY]) % bodies == body[i]):
                    continue
                ox: cython.double = x - g.segment[at + X]
                oy: cython.double = y - g.segment[at + Y]
                along: cython.double = g.segment[at + COSINE] * ox + g.segment[at + SINE] * oy
                along = min(max(along, 0.0), g.segment[at + LENGTH])
                ox -= along * g.segment[at + COSINE]
                oy -= along * g.segment[at + SINE]
                far: cython.double = hypot(ox, oy)
                away: cython.double = far - g.segment[at + ROUNDING]
                within: cython.bint = face_within(g.segment, k, x, y) >= 0
                if not (within or away <= most[i]):
                    continue
                n: cython.Py_ssize_t = found if all_count else begun
                if n < capacity and (n == found or away < to_gap[n]):
                    to_row[n], to_segment[n], to_inside[n], to_gap[n] = i, k, within, away
                    to_normal[2 * n], to_normal[2 * n + 1] = ox / max(far, 1e-300), oy / max(far, 1e-300)
                found = n + 1
    return found


@kernel
def to_segment(s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, r: cython.pointer(Ray)) -> cython.double:
    """Distance along a ray to segment k, m; 0 from inside of it or of its polygon, infinity for a miss."""
    at: cython.Py_ssize_t = PLACED * k
    c: cython.double = s[at + COSINE]
    d: cython.double = s[at + SINE]
    x: cython.double = c * (r.x - s[at + X]) + d * (r.y - s[at + Y])  # along the segment, from its start
    y: cython.double = c * (r.y - s[at + Y]) - d * (r.x - s[at + X])  # to its left
    if y > 0.0 and face_within(s, k, r.x, r.y) >= 0:
        return 0.0
    return way_to_line(x, y, c * r.dx + d * r.dy, c * r.dy - d * r.dx, s[at + LENGTH], s[at + ROUNDING] + r.size)


@inlined
def normal_to(x: cython.double, y: cython.double, r: cython.pointer(Ray)) -> Normal:
    """The unit normal along (x, y), or against the ray if that is 0, as in the centre of a disc."""
    n: Normal
    far: cython.double = sqrt(x * x + y * y)
    n.x = x / far if far > 0.0 else -r.dx
    n.y = y / far if far > 0.0 else -r.dy
    return n


@kernel
def normal_of_segment(s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, r: cython.pointer(Ray)) -> Normal:
    """The normal out of segment k where the ray touches it, after `r.best` m; of the nearest face from inside its polygon."""
    x: cython.double = r.x + r.best * r.dx
    y: cython.double = r.y + r.best * r.dy
    face: cython.Py_ssize_t = face_within(s, k, x, y) if r.best == 0.0 else -1
    at: cython.Py_ssize_t = PLACED * (face if face >= 0 else k)
    c: cython.double = s[at + COSINE]
    d: cython.double = s[at + SINE]
    u: cython.double = c * (x - s[at + X]) + d * (y - s[at + Y])
    # The origin decides on which side of a thin line the ray arrives; from a point on it, it is the side behind the ray.
    v: cython.double = c * (r.y - s[at + Y]) - d * (r.x - s[at + X])
    spare: cython.double = ROUNDED_OFF * (s[at + LENGTH] + fabs(u) + r.best)
    if face >= 0 or (s[at + LENGTH] > 0.0 and -spare <= u and u <= s[at + LENGTH] + spare and v != 0.0):
        side: cython.double = -1.0 if face >= 0 or v < 0.0 else 1.0
        return normal_to(-side * d, side * c, r)
    end: cython.double = min(max(u, 0.0), s[at + LENGTH])
    return normal_to(x - s[at + X] - end * c, y - s[at + Y] - end * d, r)


@kernel
def to_wall(w: cython.pointer[cython.const[cython.double]], k: cython.int, r: cython.pointer(Ray)) -> cython.double:
    """Distance along a ray to a side of the room, m; 0 from beyond it. w: corners of a box, or centre and radius of a cage.

    Sides of a box are the left, the right, the floor and the ceiling; those that are not there are infinitely far away.
    """
    if k < CAGE:
        into: cython.double = 1.0 if k % 2 == 0 else -1.0
        gap: cython.double = into * ((r.x if k < 2 else r.y) - w[2 * (k % 2) + k // 2]) - r.size
        closing: cython.double = -into * (r.dx if k < 2 else r.dy)
        if gap <= 0.0:
            return 0.0
        return gap / closing if closing > 0.0 and gap < INFINITY else INFINITY
    ox: cython.double = r.x - w[0]
    oy: cython.double = r.y - w[1]
    inside: cython.double = w[2] - r.size
    left: cython.double = inside * inside - ox * ox - oy * oy
    if inside <= 0.0 or left <= 0.0:
        return 0.0
    away: cython.double = ox * r.dx + oy * r.dy
    root: cython.double = sqrt(away * away + left)
    return left / (away + root) if away > 0.0 else root - away  # avoids the difference of two almost equal numbers


@kernel
def normal_of_wall(w: cython.pointer[cython.const[cython.double]], k: cython.int, r: cython.pointer(Ray)) -> Normal:
    """The normal into the room of a side that `to_wall` numbers."""
    if k == CAGE:
        return normal_to(w[0] - r.x - r.best * r.dx, w[1] - r.y - r.best * r.dy, r)
    side: cython.double = 1.0 if k % 2 == 0 else -1.0
    return normal_to(side if k < 2 else 0.0, 0.0 if k < 2 else side, r)


@inlined
def to_edge(p: cython.double, d: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """Distance from p until a ray leaves a periodic room along one axis, m; infinity if it does not."""
    if period == 0.0 or d == 0.0:
        return INFINITY
    return max(((low + period if d > 0.0 else low) - p) / d, 0.0)


@inlined
def comes_in(p: cython.double, d: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """A coordinate at the edge where d leads out of a periodic room is moved to the opposite edge."""
    if period > 0.0 and d > 0.0 and fabs(p - (low + period)) <= ROUNDED_OFF * period:
        return low
    return low + period if period > 0.0 and d < 0.0 and fabs(p - low) <= ROUNDED_OFF * period else p
