# mypy: ignore-errors
"""Images of a fluid's particles: in walls and discs, mirrors along which it flows freely, and across periodic boundaries.

Particles and images are put in the order of cells, as high as the support of the fluid and part of it wide.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import LANES, above, any_lane, lanes, load, real, spread
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_stage, thread_team

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import nearest_in_double, wrapped

MIRROR = cython.declare(cython.Py_ssize_t, 8)
"""x and y of a point; radius, m, of a disc about it, negative if the fluid is inside, 0 of a line; normal of a line, into the
fluid; velocity, m/s; slot of a particle that it is, or -1."""

BLOCK_OF_FLUID = cython.declare(cython.Py_ssize_t, 256)
"""Particles that one thread goes through at a time."""

SIDE = cython.declare(cython.Py_ssize_t, 4)
"""Columns that the support is wide."""

Images = cython.struct(
    owned=cython.Py_ssize_t,  # of particles, which come first
    count=cython.Py_ssize_t,  # with their images; these may be more than there is room for
    room=cython.Py_ssize_t,
    box=cython.pointer(real),  # (blocks, 4) lowest x and y, highest x and y of its particles, m
    at=cython.pointer[cython.const[real]],  # (slots, 2) m
    v=cython.pointer[cython.const[real]],  # (slots, 2) m/s
    slot=cython.pointer[cython.const[int32_t]],  # (owned,)
    mass=cython.pointer[cython.const[real]],  # (owned,) kg
    x=cython.pointer(real),  # (room,) m
    y=cython.pointer(real),
    vx=cython.pointer(real),  # (room,) m/s
    vy=cython.pointer(real),
    m=cython.pointer(real),  # (room,) kg
    owner=cython.pointer(int32_t),  # (room,) whose image it is; particles are their own
    struck=cython.pointer(int32_t),  # (room,) slot of the disc that what presses on it presses on, or -1
    mirrors=cython.Py_ssize_t,
    mirror=cython.pointer[cython.const[cython.double]],  # (mirrors, MIRROR)
    reach=cython.double,  # m, how far from particles images are made
    periodic=cython.pointer[cython.const[cython.double]],  # lowest x and y, and periods, m
)
Fluid = cython.struct(
    images=cython.pointer(Images),  # particles, and their images
    columns=cython.Py_ssize_t,
    cell=cython.pointer(int32_t),  # (count,) of each place
    begin=cython.pointer(int32_t),  # (cells + 2,) first place of each cell
    cells=cython.Py_ssize_t,
    most_cells=cython.Py_ssize_t,  # that there is room for
    low_x=cython.double,  # corner of the cells that are not empty, m
    low_y=cython.double,
    per=cython.double,  # rows a metre
    place=cython.pointer(int32_t),  # (count,) of each particle, and of the images after them, in the order of the cells
    x=cython.pointer(real),  # (count,) by place, as all below; in supports
    y=cython.pointer(real),
    vx=cython.pointer(real),  # times 8 nu / rho_0 R, so that they are a force where they meet
    vy=cython.pointer(real),
    m=cython.pointer(real),
    share=cython.pointer(real),  # p / rho^2
    at=cython.pointer(int32_t),  # (count,) which particle or image it is
    force=cython.pointer(real),  # (slots, 2) N
    slot=cython.pointer[cython.const[int32_t]],  # (owned,)
    density=cython.pointer(cython.double),  # (owned,) kg/m^2
    pressure=cython.pointer(cython.double),  # (owned,) N/m
    forces=cython.bint,  # whether they are asked for
    sorted=cython.bint,  # whether there was room enough
    support=real,
    rest=real,
    stiffness=real,
    viscosity=real,
    threads=cython.pointer(thread_team),
)


@inlined
def distance_from(
    c: cython.pointer(Images), m: cython.Py_ssize_t, x: cython.double, y: cython.double, normal: cython.pointer(cython.double)
) -> cython.double:
    """Of a place from a mirror, m, and the normal there."""
    row: cython.Py_ssize_t = MIRROR * m
    radius: cython.double = c.mirror[row + 2]
    dx: cython.double = nearest_in_double(x - c.mirror[row], c.periodic[2])
    dy: cython.double = nearest_in_double(y - c.mirror[row + 1], c.periodic[3])
    if radius == 0:
        normal[0], normal[1] = c.mirror[row + 3], c.mirror[row + 4]
        return dx * c.mirror[row + 3] + dy * c.mirror[row + 4]
    far: cython.double = sqrt(dx * dx + dy * dy)
    side: cython.double = 1.0 if radius > 0 else -1.0
    normal[0], normal[1] = side * dx / max(far, 1e-300), side * dy / max(far, 1e-300)
    return side * far - radius


@kernel
def add_images(
    c: cython.pointer(Images),
    k: cython.Py_ssize_t,
    x: cython.double,
    y: cython.double,
    vx: cython.double,
    vy: cython.double,
    part: cython.double,
    struck: cython.int,
    at: cython.Py_ssize_t,
) -> cython.Py_ssize_t:
    """Image `at` of particle k, and its periodic images near the room; returns where they end.

    part: of its mass. struck: -2 of k itself.
    """
    p: cython.pointer[cython.const[cython.double]] = c.periodic
    i: cython.int
    j: cython.int
    for i in range(-1 if p[2] > 0 else 0, 2 if p[2] > 0 else 1):
        for j in range(-1 if p[3] > 0 else 0, 2 if p[3] > 0 else 1):
            px: cython.double = x + i * p[2]
            py: cython.double = y + j * p[3]
            here: cython.bint = i == 0 and j == 0
            near: cython.bint = p[2] == 0 or p[0] - c.reach < px < p[0] + p[2] + c.reach
            if struck == -2 if here else not (near and (p[3] == 0 or p[1] - c.reach < py < p[1] + p[3] + c.reach)):
                continue
            if at < c.room:
                c.x[at], c.y[at], c.vx[at], c.vy[at] = (
                    cython.cast(real, px), cython.cast(real, py), cython.cast(real, vx), cython.cast(real, vy),
                )  # fmt: skip
                c.owner[at], c.struck[at] = cython.cast(int32_t, k), struck if here else -1
                c.m[at] = cython.cast(real, part * c.mass[k])
            at += 1
    return at


@kernel
def mirror_one(c: cython.pointer(Images), m: cython.Py_ssize_t, k: cython.Py_ssize_t, at: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Images of a particle in a mirror, and in it and another that it meets at a right angle; returns where they end."""
    row: cython.Py_ssize_t = MIRROR * m
    other: cython.Py_ssize_t
    n: cython.double[2]
    o: cython.double[2]
    x: cython.double = c.x[k]
    y: cython.double = c.y[k]
    gap: cython.double = distance_from(c, m, x, y, n)
    # What is as thick as the gap has less area inside a disc than outside: with less mass the density of images is the same.
    part: cython.double = (c.mirror[row + 2] - gap) / (c.mirror[row + 2] + gap) if c.mirror[row + 2] != 0 else 1
    if not (0 < gap < c.reach and part > 0):
        return at
    vx: cython.double = c.vx[k]
    vy: cython.double = c.vy[k]
    closing: cython.double = 2 * ((vx - c.mirror[row + 5]) * n[0] + (vy - c.mirror[row + 6]) * n[1])
    vx, vy = vx - closing * n[0], vy - closing * n[1]
    px: cython.double = x - 2 * gap * n[0]
    py: cython.double = y - 2 * gap * n[1]
    at = add_images(c, k, px, py, vx, vy, part, cython.cast(cython.int, c.mirror[row + 7]), at)
    for other in range(m if c.mirror[row + 2] == 0 else 0):
        gap = distance_from(c, other, x, y, o)
        if 0 < gap < c.reach and c.mirror[MIRROR * other + 2] == 0 and fabs(n[0] * o[0] + n[1] * o[1]) < 0.5:
            closing = 2 * (vx * o[0] + vy * o[1])
            qx: cython.double = px - 2 * gap * o[0]
            qy: cython.double = py - 2 * gap * o[1]
            at = add_images(c, k, qx, qy, vx - closing * o[0], vy - closing * o[1], 1, -1, at)
    return at


@kernel
def mirror_block(
    c: cython.pointer(Images), m: cython.Py_ssize_t, begin: cython.Py_ssize_t, end: cython.Py_ssize_t, at: cython.Py_ssize_t
) -> cython.Py_ssize_t:
    """The same of a block, all from `begin` to `end`."""
    row: cython.Py_ssize_t = MIRROR * m
    box: cython.pointer(real) = c.box
    b: cython.Py_ssize_t = 4 * (begin // BLOCK_OF_FLUID)
    x: cython.double = c.mirror[row]
    y: cython.double = c.mirror[row + 1]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    # Most are too far away, to more than rounding: (x - x_m) n of a line, and plus or minus (x - x_m)^2 of a circle, say so.
    edge: cython.double = c.mirror[row + 2] + 1.01 * c.reach
    side: cython.double = 0 if c.mirror[row + 2] == 0 else 1 if c.mirror[row + 2] > 0 else -1
    most: lanes = spread(cython.cast(real, edge if side == 0 else edge * edge if side > 0 else -edge * edge if edge < 0 else 1))
    around: lanes = spread(cython.cast(real, side))
    folds: cython.bint = c.periodic[2] > 0 or c.periodic[3] > 0
    if side > 0 and not folds and (x - edge > box[b + 2] or x + edge < box[b] or y - edge > box[b + 3] or y + edge < box[b + 1]):
        return at
    for k in range(begin, end, 8):
        u: lanes = load(c.x, k) - spread(cython.cast(real, x))
        v: lanes = load(c.y, k) - spread(cython.cast(real, y))
        flat: lanes = u * spread(cython.cast(real, c.mirror[row + 3])) + v * spread(cython.cast(real, c.mirror[row + 4]))
        if folds or any_lane(above(most, flat + around * (u * u + v * v))):
            for i in range(k, min(k + 8, end)):
                at = mirror_one(c, m, i, at)
    return at


@kernel
def copy_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Copy a block of particles, inside a periodic room."""
    c: cython.pointer(Images) = cython.cast(cython.pointer(Images), what)
    p: cython.pointer[cython.const[cython.double]] = c.periodic
    box: cython.Py_ssize_t = 4 * item
    low_x: real = INFINITY
    low_y: real = INFINITY
    high_x: real = -INFINITY
    high_y: real = -INFINITY
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), c.owned)):
        s: cython.Py_ssize_t = 2 * c.slot[k]
        x: real = wrapped(c.at[s], p[0], p[2])
        y: real = wrapped(c.at[s + 1], p[1], p[3])
        c.x[k], c.y[k], c.vx[k], c.vy[k] = x, y, c.v[s], c.v[s + 1]
        c.m[k], c.owner[k], c.struck[k] = c.mass[k], cython.cast(int32_t, k), -1
        low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
    c.box[box], c.box[box + 1], c.box[box + 2], c.box[box + 3] = low_x, low_y, high_x, high_y


@kernel
def make_images(c: cython.pointer(Images)) -> cython.void:
    """Images in all mirrors, and across periodic boundaries: few beside the particles, so that one thread makes them."""
    k: cython.Py_ssize_t
    begin: cython.Py_ssize_t
    c.count = c.owned
    for k in range(c.mirrors):
        begin = 0
        while begin < c.owned:
            c.count = mirror_block(c, k, begin, min(begin + BLOCK_OF_FLUID, c.owned), c.count)
            begin += BLOCK_OF_FLUID
    for k in range(c.owned if c.periodic[2] > 0 or c.periodic[3] > 0 else 0):
        c.count = add_images(c, k, c.x[k], c.y[k], c.vx[k], c.vy[k], 1, -2, c.count)


@kernel
def cell_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """The cells of a block of particles and images."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    c: cython.pointer(Images) = f.images
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), c.count)):
        column: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (c.x[k] - f.low_x) * f.per * SIDE) + SIDE
        row: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (c.y[k] - f.low_y) * f.per) + 1
        f.place[k] = cython.cast(int32_t, row * f.columns + column)


@kernel
def lay_cells(f: cython.pointer(Fluid), blocks: cython.Py_ssize_t) -> cython.void:
    """Cells over all particles and images."""
    c: cython.pointer(Images) = f.images
    k: cython.Py_ssize_t
    f.low_x, f.low_y = INFINITY, INFINITY
    high_x: cython.double = -INFINITY
    high_y: cython.double = -INFINITY
    for k in range(blocks):
        f.low_x, high_x = min(f.low_x, c.box[4 * k]), max(high_x, c.box[4 * k + 2])
        f.low_y, high_y = min(f.low_y, c.box[4 * k + 1]), max(high_y, c.box[4 * k + 3])
    for k in range(c.owned, c.count):
        f.low_x, high_x = min(f.low_x, c.x[k]), max(high_x, c.x[k])
        f.low_y, high_y = min(f.low_y, c.y[k]), max(high_y, c.y[k])
    wide: cython.double = high_x - f.low_x
    high: cython.double = high_y - f.low_y
    # Wider cells where particles are far between: there are at most about ten cells for each.
    width: cython.double = max(max(f.support * 1.000001, sqrt(wide * high / (4 * c.count))), max(wide, high) / (2 * c.count))
    f.per = 1 / width
    f.columns = SIDE * cython.cast(cython.Py_ssize_t, wide / width) + 3 * SIDE + 1  # with empty ones on each side
    f.cells = f.columns * (cython.cast(cython.Py_ssize_t, high / width) + 3)


@kernel
def sort_fluid(f: cython.pointer(Fluid)) -> cython.bint:
    """Put particles and their images in the order of the cells. False: there is not enough room for these, or for cells."""
    c: cython.pointer(Images) = f.images
    blocks: cython.int = cython.cast(cython.int, (c.owned + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    k: cython.Py_ssize_t
    team_stage(f.threads, copy_stage, c, blocks)
    make_images(c)
    if c.count > c.room:
        return False
    lay_cells(f, blocks)
    if f.cells > f.most_cells:
        return False
    blocks = cython.cast(cython.int, (c.count + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    team_stage(f.threads, cell_stage, f, blocks)
    for k in range(f.cells + 2):
        f.begin[k] = 0
    for k in range(c.count):
        f.begin[f.place[k] + 2] += 1
    for k in range(1, f.cells):
        f.begin[k + 1] += f.begin[k]
    for k in range(c.count):
        cell: int32_t = f.place[k]
        place: int32_t = f.begin[cell + 1]
        f.begin[cell + 1] = place + 1
        f.place[k], f.cell[place], f.at[place] = place, cell, cython.cast(int32_t, k)
    for k in range(c.count, c.count + LANES):  # loaded beside the last ones, and not used
        f.x[k], f.y[k], f.vx[k], f.vy[k], f.m[k], f.share[k] = 0, 0, 0, 0, 0, 0
    return True
