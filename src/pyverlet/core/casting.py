# mypy: ignore-errors
"""First hits of rays and moving circles: each walks through the cells of the discs, then of the obstacles, until it is stopped.

Discs are listed in a grid that covers all of them (`queries`), segments of obstacles in a hashed one (`segments`). Each is
listed in all cells that it reaches when grown by the radius of the circle, so the cells that the centre passes are sufficient.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_indices, const_reals, doubles, integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, NAN, fabs, floor, hypot
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t
from cython.cimports.team import team_free, team_new, thread_team

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacle_queries import (
    BODY,
    CAGE,
    CATEGORY,
    MASK,
    PLACED,
    Grid,
    Normal,
    Ray,
    comes_in,
    grid_of,
    normal_of_segment,
    normal_of_wall,
    normal_to,
    to_edge,
    to_segment,
    to_wall,
)
from pyverlet.core.queries import Cells, cells_of
from pyverlet.core.segments import head_at, way_to_disc
from pyverlet.core.sharing import by_team

PARTICLE = cython.declare(cython.int, 0)
OBSTACLE = cython.declare(cython.int, 1)
WALL = cython.declare(cython.int, 2)
NOTHING = cython.declare(cython.int, 3)

FARTHEST_WALKED = cython.declare(cython.double, 1099511627776.0)
"""Cells, 2^40: rays that begin or end farther from the origin are not walked. Up to there rounding is far below a cell."""

NO_WAY = cython.declare(cython.double, 1e-300)
"""Components of the direction below this count as 0: the ray never reaches other columns or rows."""

RAYS = cython.declare(cython.Py_ssize_t, 256)
"""Rays per work item of a thread."""

MOST_PERIODS = cython.declare(cython.int, 100)
"""Most periods that a ray passes through; in some directions it would go on for ever without a hit."""

Cast = cython.struct(
    count=cython.Py_ssize_t,
    origin=cython.pointer[cython.const[cython.double]], heading=cython.pointer[cython.const[cython.double]],
    length=cython.pointer[cython.const[cython.double]], size=cython.pointer[cython.const[cython.double]],
    category=cython.pointer[cython.const[uint32_t]], mask=cython.pointer[cython.const[uint32_t]],
    step_length=cython.Py_ssize_t, step_size=cython.Py_ssize_t,  # 0: one value for all
    step_category=cython.Py_ssize_t, step_mask=cython.Py_ssize_t,
    discs=cython.bint, cells=Cells,
    position=cython.pointer[cython.const[real]], radius=cython.pointer[cython.const[real]],
    disc_category=cython.pointer[cython.const[uint32_t]], disc_mask=cython.pointer[cython.const[uint32_t]],
    obstacles=cython.bint, grid=Grid, bodies=int64_t,
    extent=cython.pointer[cython.const[cython.double]],  # bounds of the obstacles, m: lowest x and y, highest x and y
    wall=cython.pointer[cython.const[cython.double]], first_wall=cython.int, walls_end=cython.int,
    wall_category=uint32_t, wall_mask=uint32_t,
    low_x=cython.double, low_y=cython.double, period_x=cython.double, period_y=cython.double,  # low corner; periods, m, 0: none
    particle=cython.pointer(int64_t), obstacle=cython.pointer(int64_t), side=cython.pointer(int64_t),
    distance=cython.p_double, normal=cython.p_double, point=cython.p_double,
)  # fmt: skip
Walk = cython.struct(
    begin=cython.double, end=cython.double,  # the part of the ray in a rectangle, m from its origin
    column=int64_t, row=int64_t, step_x=int64_t, step_y=int64_t,
    next_x=cython.double, next_y=cython.double,  # m from the origin to the next column and row
    per_x=cython.double, per_y=cython.double,  # m between two columns, and two rows
)  # fmt: skip


@inlined
def enter(
    w: cython.pointer(Walk), r: cython.pointer(Ray), low_x: cython.double, low_y: cython.double, high_x: cython.double,
    high_y: cython.double,
) -> cython.bint:  # fmt: skip
    """Clip a ray to a rectangle; returns whether any of it is inside."""
    to_low_x: cython.double = (low_x - r.x) * r.per_x
    to_low_y: cython.double = (low_y - r.y) * r.per_y
    to_high_x: cython.double = (high_x - r.x) * r.per_x
    to_high_y: cython.double = (high_y - r.y) * r.per_y
    w.begin = max(0.0, max(min(to_low_x, to_high_x), min(to_low_y, to_high_y)))
    w.end = min(r.best, min(max(to_low_x, to_high_x), max(to_low_y, to_high_y)))
    return w.begin <= w.end


@inlined
def stand(
    w: cython.pointer(Walk), r: cython.pointer(Ray), x0: cython.double, y0: cython.double, cell: cython.double,
    columns: int64_t, rows: int64_t,
) -> cython.void:  # fmt: skip
    """Start the walk in the cell where the clipped ray begins, within columns times rows. 0: unbounded."""
    w.column = cython.cast(int64_t, floor((r.x + w.begin * r.dx - x0) / cell))
    w.row = cython.cast(int64_t, floor((r.y + w.begin * r.dy - y0) / cell))
    if columns > 0:
        w.column = min(max(w.column, 0), columns - 1)
        w.row = min(max(w.row, 0), rows - 1)
    w.step_x = 1 if r.per_x > 0.0 else -1
    w.step_y = 1 if r.per_y > 0.0 else -1
    w.per_x, w.per_y = cell * fabs(r.per_x), cell * fabs(r.per_y)
    w.next_x = (x0 + (w.column + (1 if r.per_x > 0.0 else 0)) * cell - r.x) * r.per_x
    w.next_y = (y0 + (w.row + (1 if r.per_y > 0.0 else 0)) * cell - r.y) * r.per_y


@inlined
def go_on(w: cython.pointer(Walk), best: cython.double) -> cython.bint:
    """Step into the next cell; returns whether the ray, which is stopped after `best` m, reaches it."""
    if min(w.next_x, w.next_y) > min(w.end, best):
        return False
    if w.next_x < w.next_y:
        w.column += w.step_x
        w.next_x += w.per_x
    else:
        w.row += w.step_y
        w.next_y += w.per_y
    return True


@inlined
def stop(
    j: cython.pointer(Cast), q: cython.Py_ssize_t, r: cython.pointer(Ray), far: cython.double, kind: cython.int, index: int64_t,
    category: uint32_t, mask: uint32_t, segment: cython.Py_ssize_t,
) -> cython.void:  # fmt: skip
    """Let an object at distance `far` stop the ray, if their categories match and it is nearer, or as near and first in order."""
    nearer: cython.bint = far < r.best or (
        far == r.best and far < INFINITY and (kind < r.kind or (kind == r.kind and index < r.index))
    )
    if nearer and (j.category[q * j.step_category] & mask) and (j.mask[q * j.step_mask] & category):
        r.best, r.kind, r.index, r.segment = far, kind, index, segment


@kernel
def pass_discs(j: cython.pointer(Cast), q: cython.Py_ssize_t, r: cython.pointer(Ray)) -> cython.void:
    """Stop the ray at the first disc that it hits."""
    w: Walk
    n: cython.Py_ssize_t
    c: cython.pointer(Cells) = cython.address(j.cells)
    p: cython.pointer[cython.const[real]] = j.position
    if not enter(cython.address(w), r, c.x0, c.y0, c.x0 + c.columns * c.cell, c.y0 + c.rows * c.cell):
        return
    stand(cython.address(w), r, c.x0, c.y0, c.cell, c.columns, c.rows)
    while 0 <= w.column < c.columns and 0 <= w.row < c.rows:
        at: int64_t = w.row * c.columns + w.column
        for n in range(c.start[at], c.start[at + 1]):
            i: cython.Py_ssize_t = c.member[n]
            far: cython.double = way_to_disc(r.x - p[2 * i], r.y - p[2 * i + 1], r.dx, r.dy, j.radius[i] + r.size)
            if far <= r.best and far < INFINITY:
                stop(j, q, r, far, PARTICLE, i, j.disc_category[i], j.disc_mask[i], 0)
        if not go_on(cython.address(w), r.best):
            break


@inlined
def pass_segment(j: cython.pointer(Cast), q: cython.Py_ssize_t, r: cython.pointer(Ray), k: cython.Py_ssize_t) -> cython.void:
    """Stop the ray at segment k, or its polygon, if it hits it."""
    at: cython.Py_ssize_t = PLACED * k
    body: int64_t = cython.cast(int64_t, j.grid.segment[at + BODY]) % j.bodies
    category: uint32_t = cython.cast(uint32_t, j.grid.segment[at + CATEGORY])
    mask: uint32_t = cython.cast(uint32_t, j.grid.segment[at + MASK])
    stop(j, q, r, to_segment(j.grid.segment, k, r), OBSTACLE, body, category, mask, k)


@kernel
def pass_segments(j: cython.pointer(Cast), q: cython.Py_ssize_t, r: cython.pointer(Ray)) -> cython.void:
    """Stop the ray at the first obstacle that it hits."""
    w: Walk
    x: cython.pointer[cython.const[cython.double]] = j.extent
    if not enter(cython.address(w), r, x[0] - r.size, x[1] - r.size, x[2] + r.size, x[3] + r.size):
        return
    far: cython.bint = not fabs(r.x) + fabs(r.y) + w.end < FARTHEST_WALKED * j.grid.cell
    if far or (w.end - w.begin) * (fabs(r.dx) + fabs(r.dy)) > (j.grid.segments - 1) * j.grid.cell:
        # There are fewer segments than cells on the way, or rounding no longer separates cells.
        for k in range(j.grid.segments):
            pass_segment(j, q, r, k)
        return
    stand(cython.address(w), r, 0.0, 0.0, j.grid.cell, 0, 0)
    while True:
        link: int32_t = j.grid.head[head_at(w.column, w.row, j.grid.heads)]
        while link >= 0:
            pass_segment(j, q, r, j.grid.link[2 * link])
            link = j.grid.link[2 * link + 1]
        if not go_on(cython.address(w), r.best):
            break


@kernel
def cast_one(j: cython.pointer(Cast), q: cython.Py_ssize_t) -> cython.void:
    """Find and write the first hit of ray q."""
    r: Ray
    norm: cython.double = hypot(j.heading[2 * q], j.heading[2 * q + 1])
    length: cython.double = j.length[q * j.step_length]
    r.x, r.y, r.dx, r.dy = j.origin[2 * q], j.origin[2 * q + 1], j.heading[2 * q] / norm, j.heading[2 * q + 1] / norm
    r.per_x, r.per_y = 1.0 / r.dx if fabs(r.dx) > NO_WAY else 1.0 / NO_WAY, 1.0 / r.dy if fabs(r.dy) > NO_WAY else 1.0 / NO_WAY
    r.size, r.kind, r.index, r.segment = j.size[q * j.step_size], NOTHING, -1, 0
    gone: cython.double = 0.0  # distance in the periods before
    k: cython.int
    for _ in range(MOST_PERIODS):
        ahead: cython.double = min(to_edge(r.x, r.dx, j.low_x, j.period_x), to_edge(r.y, r.dy, j.low_y, j.period_y))
        ahead = r.best = min(ahead, length - gone)
        for k in range(j.first_wall, j.walls_end):
            stop(j, q, cython.address(r), to_wall(j.wall, k, cython.address(r)), WALL, k, j.wall_category, j.wall_mask, 0)
        if j.discs:
            pass_discs(j, q, cython.address(r))
        if j.obstacles:
            pass_segments(j, q, cython.address(r))
        if r.kind != NOTHING or not gone + ahead < length:
            break
        gone += ahead
        r.x = comes_in(r.x + ahead * r.dx, r.dx, j.low_x, j.period_x)
        r.y = comes_in(r.y + ahead * r.dy, r.dy, j.low_y, j.period_y)
    n: Normal
    n.x = n.y = 0.0
    x: cython.double = r.x + r.best * r.dx
    y: cython.double = r.y + r.best * r.dy
    if r.kind == PARTICLE:
        n = normal_to(x - j.position[2 * r.index], y - j.position[2 * r.index + 1], cython.address(r))
    elif r.kind == OBSTACLE:
        n = normal_of_segment(j.grid.segment, r.segment, cython.address(r))
    elif r.kind == WALL:
        n = normal_of_wall(j.wall, cython.cast(cython.int, r.index), cython.address(r))
    hit: cython.bint = r.kind != NOTHING
    j.particle[q] = r.index if r.kind == PARTICLE else -1
    j.obstacle[q] = r.index if r.kind == OBSTACLE else -1
    j.side[q] = r.index % CAGE if r.kind == WALL else -1
    j.distance[q] = gone + r.best if hit else INFINITY
    j.normal[2 * q], j.normal[2 * q + 1] = n.x, n.y
    j.point[2 * q] = x - r.size * n.x if hit else NAN
    j.point[2 * q + 1] = y - r.size * n.y if hit else NAN


@kernel
def cast_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Cast one work item of rays."""
    j: cython.pointer(Cast) = cython.cast(cython.pointer(Cast), what)
    for q in range(item * RAYS, min((item + 1) * RAYS, j.count)):
        cast_one(j, q)


def cast(rays, discs, obstacles, walls, periodic, threads: cython.int, particle, obstacle, wall, distance, normal, point):
    """First hits of q circles, or rays of radius 0.

    rays: origin (q, 2), direction (q, 2), not 0; length, radius, category and mask (uint32), (q,) each or (1,) for all. discs:
    None or (x0, y0, cell, columns, rows, begin, member, position, radius, categories, masks), from `list_discs` for radii as
    large as these; obstacles: from `list_segments`, (segments, cell, heads, links, extent (4,), bodies); walls: first and end of
    those that `to_wall` numbers, corners of a box or centre and radius of a cage, category and mask. periodic: lower corner and
    periods of a periodic room, m, 0 of others; rays begin inside it. threads: number of threads.
    Written: the index in one of particle, obstacle and wall (q,), -1 in the others; distance (q,) that the centre travels, m;
    normal (q, 2); point of contact (q, 2).
    """
    job: Cast
    j: cython.pointer(Cast) = cython.address(job)
    j.count, j.origin, j.heading = len(rays[0]), const_doubles(rays[0]), const_doubles(rays[1])
    j.length, j.size = const_doubles(rays[2]), const_doubles(rays[3])
    j.category, j.mask = const_indices(rays[4]), const_indices(rays[5])
    j.step_length, j.step_size = len(rays[2]) > 1, len(rays[3]) > 1
    j.step_category, j.step_mask = len(rays[4]) > 1, len(rays[5]) > 1
    j.discs, j.obstacles = discs is not None, obstacles is not None
    if discs is not None:
        j.cells = cells_of(discs[:7])
        j.position, j.radius = const_reals(discs[7]), const_reals(discs[8])
        j.disc_category, j.disc_mask = const_indices(discs[9]), const_indices(discs[10])
    if obstacles is not None:
        j.grid, j.extent = grid_of(obstacles[0], obstacles[1], obstacles[2], obstacles[3]), const_doubles(obstacles[4])
        j.bodies = obstacles[5]
    j.first_wall, j.walls_end, j.wall = walls[0], walls[1], const_doubles(walls[2])
    j.wall_category, j.wall_mask = walls[3:]
    j.low_x, j.low_y, j.period_x, j.period_y = periodic
    j.particle, j.obstacle, j.side = integers(particle), integers(obstacle), integers(wall)
    j.distance, j.normal, j.point = doubles(distance), doubles(normal), doubles(point)
    workers: cython.pointer(thread_team) = team_new(threads)
    items: cython.int = cython.cast(cython.int, (j.count + RAYS - 1) // RAYS)
    with cython.nogil:
        by_team(cython.cast(cython.size_t, workers), threads, cast_stage, j, items)
        team_free(workers)
