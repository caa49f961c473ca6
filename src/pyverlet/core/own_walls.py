# mypy: ignore-errors
"""Walls that confine particles after a substep, for user-defined rooms that consist of a box or a circle.

The core's own walls (`surfaces`) are part of contact solving. Here, particles beyond a wall are put back: bounced in closed form
under their acceleration, at the time of impact, or held.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt

from pyverlet.core.kernels import kernel

# lag: seconds by which velocities are behind positions. e, mu: of the wall; belt: m/s of its surface, counter-clockwise. Slower
# arrivals than rest_speed do not bounce. hits (n, 2): largest speed at which each particle has met a wall, and the sum of
# impulses, m/s.
Walled = cython.struct(
    x=cython.pointer(real),
    v=cython.pointer(real),
    a=cython.pointer[cython.const[real]],
    spin=cython.pointer(real),
    radius=cython.pointer[cython.const[real]],
    own_restitution=cython.pointer[cython.const[real]],
    own_friction=cython.pointer[cython.const[real]],
    hits=cython.pointer(real),
    h=real,
    lag=real,
    e=real,
    mu=real,
    belt=real,
    rest_speed=real,
)


@kernel
def collide_with_wall(w: cython.pointer(Walled), i: cython.Py_ssize_t, nx: real, ny: real, depth: real) -> cython.void:
    """Put back particle i, which is `depth` > 0 beyond a wall of normal (nx, ny) into the room.

    The larger restitution of particle and wall is used, and the geometric mean of the frictions.
    """
    zero: real = 0
    two: real = 2
    three: real = 3
    e: real = max(w.e, w.own_restitution[i])
    mu: real = w.mu
    if w.own_friction[i] >= zero:
        mu = cython.cast(real, sqrt(mu * w.own_friction[i]))
    pull: real = w.a[2 * i] * nx + w.a[2 * i + 1] * ny
    before: real = w.v[2 * i] * nx + w.v[2 * i + 1] * ny
    now: real = before + w.lag * pull
    square: real = now * now + two * pull * depth
    hit: real = cython.cast(real, sqrt(square)) if square > zero else zero
    after: real = max(before, zero)
    shift: real = depth
    time: real = w.h
    if e * hit > w.rest_speed and now < zero:
        since: real = min(two * depth / (hit - now), w.h)  # time since the impact
        risen: real = e * hit * since + pull * since * since / two
        if risen >= zero:
            after = e * hit + pull * (since - w.lag)
            shift = depth + risen
            time = since
    w.x[2 * i] += shift * nx
    w.x[2 * i + 1] += shift * ny
    w.v[2 * i] += (after - before) * nx
    w.v[2 * i + 1] += (after - before) * ny
    w.hits[2 * i] = max(w.hits[2 * i], hit)
    w.hits[2 * i + 1] += after - before
    if mu > zero:
        # Along (ny, -nx), counter-clockwise around the room; the contact point of a disc has the inverse mass 3 / m.
        slip: real = w.v[2 * i] * ny - w.v[2 * i + 1] * nx + w.spin[i] * w.radius[i] - w.belt
        most: real = mu * (after - before)
        tangent: real = max(min(-slip / three, most), -most)
        w.v[2 * i] += tangent * ny
        w.v[2 * i + 1] -= tangent * nx
        w.x[2 * i] += time * tangent * ny
        w.x[2 * i + 1] -= time * tangent * nx
        w.spin[i] += two * tangent / w.radius[i]


@cython.cfunc
def fill_walled(w: cython.pointer(Walled), bodies, hits, law) -> cython.void:
    """bodies: position, velocity, acceleration (n, 2), spin, radius, own restitution, own friction (n,); law: h to rest_speed."""
    w.x, w.v, w.a, w.spin = reals(bodies[0]), reals(bodies[1]), const_reals(bodies[2]), reals(bodies[3])
    w.radius, w.own_restitution, w.own_friction = const_reals(bodies[4]), const_reals(bodies[5]), const_reals(bodies[6])
    w.hits = reals(hits)
    w.h, w.lag, w.e, w.mu, w.belt, w.rest_speed = law[0], law[1], law[2], law[3], law[4], law[5]


def confine_to_box(x0: real, y0: real, x1: real, y1: real, bodies, inverse_mass, hits, law):
    """Confine to four walls, one after the other; some may be infinitely far away. law: h, lag, e, mu, belt, rest_speed."""
    walled: Walled
    w: cython.pointer(Walled) = cython.address(walled)
    fill_walled(w, bodies, hits, law)
    free: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(inverse_mass)
    zero: real = 0
    one: real = 1
    with cython.nogil:
        for i in range(count):
            if free[i] > zero:
                if w.x[2 * i] - w.radius[i] < x0:
                    collide_with_wall(w, i, one, zero, x0 + w.radius[i] - w.x[2 * i])
                if w.x[2 * i] + w.radius[i] > x1:
                    collide_with_wall(w, i, -one, zero, w.x[2 * i] + w.radius[i] - x1)
                if w.x[2 * i + 1] - w.radius[i] < y0:
                    collide_with_wall(w, i, zero, one, y0 + w.radius[i] - w.x[2 * i + 1])
                if w.x[2 * i + 1] + w.radius[i] > y1:
                    collide_with_wall(w, i, zero, -one, w.x[2 * i + 1] + w.radius[i] - y1)


def confine_to_circle(x0: real, y0: real, size: real, bodies, inverse_mass, hits, law):
    """Confine to a round wall of radius `size` about (x0, y0), m; law as in `confine_to_box`."""
    walled: Walled
    w: cython.pointer(Walled) = cython.address(walled)
    fill_walled(w, bodies, hits, law)
    free: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(inverse_mass)
    zero: real = 0
    with cython.nogil:
        for i in range(count):
            dx: real = x0 - w.x[2 * i]
            dy: real = y0 - w.x[2 * i + 1]
            inside: real = max(size - w.radius[i], zero)
            distance: real = cython.cast(real, sqrt(dx * dx + dy * dy))
            if distance > inside and free[i] > zero:
                collide_with_wall(w, i, dx / distance, dy / distance, distance - inside)
