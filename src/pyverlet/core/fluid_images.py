# mypy: ignore-errors
"""Images of a fluid's particles: reflected in walls and discs, along which it flows freely, and across periodic boundaries.

Particles and images are sorted by cells, as high as the support of the fluid and a fraction of it wide.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import LANES, above, any_lane, lanes, load, real, spread
from cython.cimports.libc.math import INFINITY, fabs, fmod, sqrt
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_stage, thread_team

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import nearest_in_double, wrapped

MIRROR = cython.declare(cython.Py_ssize_t, 8)
"""Columns of a mirror: point x and y; radius of a disc about it, m, negative if the fluid is inside, 0 for a line; normal of a
line, into the fluid; velocity, m/s; row of the particle that the mirror is, or -1."""

BLOCK_OF_FLUID = cython.declare(cython.Py_ssize_t, 256)
"""Particles per work item of a thread."""

SIDE = cython.declare(cython.Py_ssize_t, 4)
"""Columns of cells per support."""

Fluid = cython.struct(
    owned=cython.Py_ssize_t,  # number of particles, which come first
    count=cython.Py_ssize_t,  # with images; may exceed the room
    capacity=cython.Py_ssize_t,
    box=cython.pointer(real),  # (blocks, 4) lowest x and y, highest x and y of its particles, m
    position=cython.pointer[cython.const[real]],  # (n, 2) m
    velocity=cython.pointer[cython.const[real]],  # (n, 2) m/s
    force=cython.pointer(real),  # (n, 2) N
    sorted_index=cython.pointer[cython.const[int32_t]],  # (owned,)
    mass=cython.pointer[cython.const[real]],  # (owned,) kg
    x=cython.pointer(real),  # (capacity,) m
    y=cython.pointer(real),
    vx=cython.pointer(real),  # (capacity,) m/s
    vy=cython.pointer(real),
    m=cython.pointer(real),  # (capacity,) kg
    owner=cython.pointer(int32_t),  # (capacity,) particle whose image it is; itself for particles
    struck=cython.pointer(int32_t),  # (capacity,) row of the disc that receives the pressure on it, or -1
    mirrors=cython.Py_ssize_t,
    mirror=cython.pointer[cython.const[cython.double]],  # (mirrors, MIRROR)
    periodic=cython.pointer[cython.const[cython.double]],  # lowest x and y, and periods, m
    columns=cython.Py_ssize_t,
    rows=cython.Py_ssize_t,  # periodic: the first follows the last
    cell=cython.pointer(int32_t),  # (count,) cell of each place
    begin=cython.pointer(int32_t),  # (cells + 2,) first place of each cell
    cells=cython.Py_ssize_t,
    most_cells=cython.Py_ssize_t,  # for which there is room
    low_x=cython.double,  # corner of the occupied cells, m
    low_y=cython.double,
    per=cython.double,  # rows per metre
    place=cython.pointer(int32_t),  # (count,) place of each particle and image in cell order
    at=cython.pointer(int32_t),  # (count,) particle or image at each place; the arrays below are by place
    sx=cython.pointer(real),  # position over the support
    sy=cython.pointer(real),
    su=cython.pointer(real),  # velocity times 8 nu / (rho_0 R), for the viscous force
    sv=cython.pointer(real),
    sm=cython.pointer(real),
    share=cython.pointer(real),  # p / rho^2
    density=cython.pointer(cython.double),  # (owned,) kg/m^2
    pressure=cython.pointer(cython.double),  # (owned,) N/m
    forces=cython.bint,  # whether forces are wanted
    sorted=cython.bint,  # whether there was room
    support=real,  # m, range of the interaction; images are made within it
    rest=real,
    stiffness=real,
    viscosity=real,
    threads=cython.pointer(thread_team),
)


@inlined
def distance_from(
    f: cython.pointer(Fluid), m: cython.Py_ssize_t, x: cython.double, y: cython.double, normal: cython.pointer(cython.double)
) -> cython.double:
    """Distance of a point from a mirror, m, and the normal there."""
    row: cython.Py_ssize_t = MIRROR * m
    radius: cython.double = f.mirror[row + 2]
    dx: cython.double = nearest_in_double(x - f.mirror[row], f.periodic[2])
    dy: cython.double = nearest_in_double(y - f.mirror[row + 1], f.periodic[3])
    if radius == 0:
        normal[0], normal[1] = f.mirror[row + 3], f.mirror[row + 4]
        return dx * f.mirror[row + 3] + dy * f.mirror[row + 4]
    far: cython.double = sqrt(dx * dx + dy * dy)
    side: cython.double = 1.0 if radius > 0 else -1.0
    normal[0], normal[1] = side * dx / max(far, 1e-300), side * dy / max(far, 1e-300)
    return side * far - radius


@kernel
def add_images(
    f: cython.pointer(Fluid), k: cython.Py_ssize_t, x: cython.double, y: cython.double, vx: cython.double, vy: cython.double,
    part: cython.double, struck: cython.int, at: cython.Py_ssize_t,
) -> cython.Py_ssize_t:  # fmt: skip
    """Add image `at` of particle k, and its periodic images near the room; returns the end.

    part: fraction of its mass. struck: -2 for k itself.
    """
    p: cython.pointer[cython.const[cython.double]] = f.periodic
    i: cython.int
    j: cython.int
    for i in range(-1 if p[2] > 0 else 0, 2 if p[2] > 0 else 1):
        for j in range(-1 if p[3] > 0 else 0, 2 if p[3] > 0 else 1):
            px: cython.double = x + i * p[2]
            py: cython.double = y + j * p[3]
            here: cython.bint = i == 0 and j == 0
            near: cython.bint = p[2] == 0 or p[0] - f.support < px < p[0] + p[2] + f.support
            if struck == -2 if here else not (near and (p[3] == 0 or p[1] - f.support < py < p[1] + p[3] + f.support)):
                continue
            if at < f.capacity:
                f.x[at], f.y[at], f.vx[at], f.vy[at] = (
                    cython.cast(real, px), cython.cast(real, py), cython.cast(real, vx), cython.cast(real, vy),
                )  # fmt: skip
                f.owner[at], f.struck[at] = cython.cast(int32_t, k), struck if here else -1
                f.m[at] = cython.cast(real, part * f.mass[k])
            at += 1
    return at


@kernel
def mirror_one(f: cython.pointer(Fluid), m: cython.Py_ssize_t, k: cython.Py_ssize_t, at: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Add the images of a particle in a mirror, and in a corner with another mirror at a right angle; returns the end."""
    row: cython.Py_ssize_t = MIRROR * m
    other: cython.Py_ssize_t
    n: cython.double[2]
    o: cython.double[2]
    x: cython.double = f.x[k]
    y: cython.double = f.y[k]
    gap: cython.double = distance_from(f, m, x, y, n)
    # A layer as thick as the gap has less area inside a disc than outside; a smaller mass keeps the density of images.
    part: cython.double = (f.mirror[row + 2] - gap) / (f.mirror[row + 2] + gap) if f.mirror[row + 2] != 0 else 1
    if not (0 < gap < f.support and part > 0):
        return at
    vx: cython.double = f.vx[k]
    vy: cython.double = f.vy[k]
    closing: cython.double = 2 * ((vx - f.mirror[row + 5]) * n[0] + (vy - f.mirror[row + 6]) * n[1])
    vx, vy = vx - closing * n[0], vy - closing * n[1]
    px: cython.double = x - 2 * gap * n[0]
    py: cython.double = y - 2 * gap * n[1]
    at = add_images(f, k, px, py, vx, vy, part, cython.cast(cython.int, f.mirror[row + 7]), at)
    for other in range(m if f.mirror[row + 2] == 0 else 0):
        gap = distance_from(f, other, x, y, o)
        if 0 < gap < f.support and f.mirror[MIRROR * other + 2] == 0 and fabs(n[0] * o[0] + n[1] * o[1]) < 0.5:
            closing = 2 * (vx * o[0] + vy * o[1])
            qx: cython.double = px - 2 * gap * o[0]
            qy: cython.double = py - 2 * gap * o[1]
            at = add_images(f, k, qx, qy, vx - closing * o[0], vy - closing * o[1], 1, -1, at)
    return at


@kernel
def mirror_block(
    f: cython.pointer(Fluid), m: cython.Py_ssize_t, begin: cython.Py_ssize_t, end: cython.Py_ssize_t, at: cython.Py_ssize_t
) -> cython.Py_ssize_t:
    """Add the images in a mirror for a block, `begin` to `end`."""
    row: cython.Py_ssize_t = MIRROR * m
    box: cython.pointer(real) = f.box
    b: cython.Py_ssize_t = 4 * (begin // BLOCK_OF_FLUID)
    x: cython.double = f.mirror[row]
    y: cython.double = f.mirror[row + 1]
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    # Skip eight particles too far away: compare (x - x_m) n for a line, and plus or minus (x - x_m)^2 for a circle.
    edge: cython.double = f.mirror[row + 2] + 1.01 * f.support
    side: cython.double = 0 if f.mirror[row + 2] == 0 else 1 if f.mirror[row + 2] > 0 else -1
    most: lanes = spread(cython.cast(real, edge if side == 0 else edge * edge if side > 0 else -edge * edge if edge < 0 else 1))
    around: lanes = spread(cython.cast(real, side))
    folds: cython.bint = f.periodic[2] > 0 or f.periodic[3] > 0
    if side > 0 and not folds and (x - edge > box[b + 2] or x + edge < box[b] or y - edge > box[b + 3] or y + edge < box[b + 1]):
        return at
    for k in range(begin, end, 8):
        u: lanes = load(f.x, k) - spread(cython.cast(real, x))
        v: lanes = load(f.y, k) - spread(cython.cast(real, y))
        flat: lanes = u * spread(cython.cast(real, f.mirror[row + 3])) + v * spread(cython.cast(real, f.mirror[row + 4]))
        if folds or any_lane(above(most, flat + around * (u * u + v * v))):
            for i in range(k, min(k + 8, end)):
                at = mirror_one(f, m, i, at)
    return at


@kernel
def copy_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Copy a block of particles, wrapped into a periodic room."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    p: cython.pointer[cython.const[cython.double]] = f.periodic
    box: cython.Py_ssize_t = 4 * item
    low_x: real = INFINITY
    low_y: real = INFINITY
    high_x: real = -INFINITY
    high_y: real = -INFINITY
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), f.owned)):
        s: cython.Py_ssize_t = 2 * f.sorted_index[k]
        x: real = wrapped(f.position[s], p[0], p[2])
        y: real = wrapped(f.position[s + 1], p[1], p[3])
        f.x[k], f.y[k], f.vx[k], f.vy[k] = x, y, f.velocity[s], f.velocity[s + 1]
        f.m[k], f.owner[k], f.struck[k] = f.mass[k], cython.cast(int32_t, k), -1
        low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
    f.box[box], f.box[box + 1], f.box[box + 2], f.box[box + 3] = low_x, low_y, high_x, high_y


@kernel
def make_images(f: cython.pointer(Fluid)) -> cython.void:
    """Add images in all mirrors and across periodic boundaries; on one thread, as they are few."""
    k: cython.Py_ssize_t
    begin: cython.Py_ssize_t
    f.count = f.owned
    for k in range(f.mirrors):
        begin = 0
        while begin < f.owned:
            f.count = mirror_block(f, k, begin, min(begin + BLOCK_OF_FLUID, f.owned), f.count)
            begin += BLOCK_OF_FLUID
    for k in range(f.owned if f.periodic[2] > 0 or f.periodic[3] > 0 else 0):
        f.count = add_images(f, k, f.x[k], f.y[k], f.vx[k], f.vy[k], 1, -2, f.count)


@kernel
def cell_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the cells of a block of particles and images."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), f.count)):
        column: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (f.x[k] - f.low_x) * f.per * SIDE) + SIDE
        rise: cython.double = (f.y[k] - f.low_y) * f.per
        row: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, rise if rise < f.rows else fmod(rise, f.rows))
        f.place[k] = cython.cast(int32_t, row * f.columns + column)


@kernel
def lay_cells(f: cython.pointer(Fluid), blocks: cython.Py_ssize_t) -> cython.void:
    """Lay out cells over all particles and images."""
    k: cython.Py_ssize_t
    f.low_x, f.low_y = INFINITY, INFINITY
    high_x: cython.double = -INFINITY
    high_y: cython.double = -INFINITY
    for k in range(blocks):
        f.low_x, high_x = min(f.low_x, f.box[4 * k]), max(high_x, f.box[4 * k + 2])
        f.low_y, high_y = min(f.low_y, f.box[4 * k + 1]), max(high_y, f.box[4 * k + 3])
    for k in range(f.owned, f.count):
        f.low_x, high_x = min(f.low_x, f.x[k]), max(high_x, f.x[k])
        f.low_y, high_y = min(f.low_y, f.y[k]), max(high_y, f.y[k])
    wide: cython.double = high_x - f.low_x
    high: cython.double = high_y - f.low_y
    width: cython.double = max(f.support * 1.000001, wide / f.count)
    f.per = 1 / width
    f.columns = SIDE * cython.cast(cython.Py_ssize_t, wide / width) + 3 * SIDE + 1  # one support of empty columns on each side
    # Rows beyond about 20 cells per particle wrap around: particles that fall for ever share cells with others, without effect.
    f.rows = max(20 * f.count // f.columns, 3)
    f.rows = min(f.rows, cython.cast(cython.Py_ssize_t, min(high / width, cython.cast(cython.double, f.rows))) + 2)
    f.cells = f.rows * f.columns


@inlined
def cell_above(f: cython.pointer(Fluid), cell: cython.Py_ssize_t, row: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """The cell `row` rows above this one: -1, 0 or 1."""
    there: cython.Py_ssize_t = cell + row * f.columns
    return there + f.cells if there < 0 else there - f.cells if there >= f.cells else there


@kernel
def sort_fluid(f: cython.pointer(Fluid)) -> cython.bint:
    """Sort particles and their images by cell. Returns False if there is too little room for images or cells."""
    blocks: cython.int = cython.cast(cython.int, (f.owned + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    k: cython.Py_ssize_t
    team_stage(f.threads, copy_stage, f, blocks)
    make_images(f)
    if f.count > f.capacity:
        return False
    lay_cells(f, blocks)
    if f.cells > f.most_cells:
        return False
    blocks = cython.cast(cython.int, (f.count + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    team_stage(f.threads, cell_stage, f, blocks)
    for k in range(f.cells + 2):
        f.begin[k] = 0
    for k in range(f.count):
        f.begin[f.place[k] + 2] += 1
    for k in range(1, f.cells):
        f.begin[k + 1] += f.begin[k]
    for k in range(f.count):
        cell: int32_t = f.place[k]
        place: int32_t = f.begin[cell + 1]
        f.begin[cell + 1] = place + 1
        f.place[k], f.cell[place], f.at[place] = place, cell, cython.cast(int32_t, k)
    for k in range(f.count, f.count + LANES):  # padding of the last vector loads
        f.sx[k], f.sy[k], f.su[k], f.sv[k], f.sm[k], f.share[k] = 0, 0, 0, 0, 0, 0
    return True
