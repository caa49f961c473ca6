# mypy: ignore-errors
"""Images of a fluid's particles: in walls and discs, mirrors along which it flows freely, and across periodic boundaries."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.periodic import nearest_in_double, wrapped

MIRROR = cython.declare(cython.Py_ssize_t, 8)
"""x and y of a point; radius, m, of a disc about it, negative if the fluid is inside, 0 of a line; normal of a line, into the
fluid; velocity, m/s; slot of a particle that it is, or -1."""

Images = cython.struct(
    owned=cython.Py_ssize_t,  # of particles, which come first
    count=cython.Py_ssize_t,  # with their images; these may be more than there is room for
    room=cython.Py_ssize_t,
    place=cython.pointer(real),  # (room, 2) m
    velocity=cython.pointer(real),  # (room, 2) m/s
    owner=cython.pointer(int32_t),  # (room,) whose image it is; particles are their own
    struck=cython.pointer(int32_t),  # (room,) slot of the disc that what presses on it presses on, or -1
    mirrors=cython.Py_ssize_t,
    mirror=cython.pointer[cython.const[cython.double]],  # (mirrors, MIRROR)
    reach=cython.double,  # m, how far from particles images are made
    periodic=cython.pointer[cython.const[cython.double]],  # lowest x and y, and periods, m
)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
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


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def add_image(
    c: cython.pointer(Images),
    k: cython.Py_ssize_t,
    x: cython.double,
    y: cython.double,
    vx: cython.double,
    vy: cython.double,
    struck: int32_t,
) -> cython.void:
    """One of particle k, if there is room."""
    if c.count < c.room:
        c.place[2 * c.count], c.place[2 * c.count + 1] = cython.cast(real, x), cython.cast(real, y)
        c.velocity[2 * c.count], c.velocity[2 * c.count + 1] = cython.cast(real, vx), cython.cast(real, vy)
        c.owner[c.count], c.struck[c.count] = cython.cast(int32_t, k), struck
    c.count += 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def mirror_all(c: cython.pointer(Images), m: cython.Py_ssize_t) -> cython.void:
    """Add the images of all particles in a mirror, and in it and another that it meets at a right angle."""
    row: cython.Py_ssize_t = MIRROR * m
    k: cython.Py_ssize_t
    other: cython.Py_ssize_t
    n: cython.double[2]
    o: cython.double[2]
    for k in range(c.owned):
        x: cython.double = c.place[2 * k]
        y: cython.double = c.place[2 * k + 1]
        gap: cython.double = distance_from(c, m, x, y, n)
        if not 0 < gap < c.reach:
            continue
        vx: cython.double = c.velocity[2 * k]
        vy: cython.double = c.velocity[2 * k + 1]
        closing: cython.double = 2 * ((vx - c.mirror[row + 5]) * n[0] + (vy - c.mirror[row + 6]) * n[1])
        vx, vy = vx - closing * n[0], vy - closing * n[1]
        px: cython.double = x - 2 * gap * n[0]
        py: cython.double = y - 2 * gap * n[1]
        add_image(c, k, px, py, vx, vy, cython.cast(int32_t, c.mirror[row + 7]))
        for other in range(m if c.mirror[row + 2] == 0 else 0):
            gap = distance_from(c, other, x, y, o)
            if 0 < gap < c.reach and c.mirror[MIRROR * other + 2] == 0 and fabs(n[0] * o[0] + n[1] * o[1]) < 0.5:
                closing = 2 * (vx * o[0] + vy * o[1])
                add_image(c, k, px - 2 * gap * o[0], py - 2 * gap * o[1], vx - closing * o[0], vy - closing * o[1], -1)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def add_images(
    c: cython.pointer(Images),
    at: cython.pointer[cython.const[real]],
    v: cython.pointer[cython.const[real]],
    slot: cython.pointer[cython.const[int32_t]],
) -> cython.void:
    """Particles, put inside a periodic room, their images in mirrors, and the periodic images of all these."""
    p: cython.pointer[cython.const[cython.double]] = c.periodic
    k: cython.Py_ssize_t
    i: cython.int
    j: cython.int
    c.count = 0
    for k in range(c.owned):
        s: cython.Py_ssize_t = 2 * slot[k]
        add_image(c, k, wrapped(at[s], p[0], p[2]), wrapped(at[s + 1], p[1], p[3]), v[s], v[s + 1], -1)
    for k in range(c.mirrors):
        mirror_all(c, k)
    there: cython.Py_ssize_t = min(c.count, c.room)
    for i in range(-1, 2):
        for j in range(-1, 2):
            if (i == 0 and j == 0) or (i and p[2] == 0) or (j and p[3] == 0):
                continue
            for k in range(there):
                px: cython.double = c.place[2 * k] + i * p[2]
                py: cython.double = c.place[2 * k + 1] + j * p[3]
                near: cython.bint = p[2] == 0 or p[0] - c.reach < px < p[0] + p[2] + c.reach
                if near and (p[3] == 0 or p[1] - c.reach < py < p[1] + p[3] + c.reach):
                    add_image(c, c.owner[k], px, py, c.velocity[2 * k], c.velocity[2 * k + 1], -1)
