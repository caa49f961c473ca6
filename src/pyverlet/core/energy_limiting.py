# mypy: ignore-errors
"""Removes energy from clusters that have gained too much in a frame, in the order that `laws.limiter` describes.

Sums over a cluster run on one thread in the order of the rows.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import nearest_in_double

# Columns of a cluster. Momenta and positions are first sums, then means. WITHIN: J of internal motion; AS_ONE: J of the rest but
# for its drift across what has pushed it; ALONG: J of that drift. LEFT: J still to be removed.
COLUMNS_OF_CLUSTER = cython.declare(cython.int, 23)
COUNT = cython.declare(cython.int, 0)
GAIN = cython.declare(cython.int, 1)
MASS = cython.declare(cython.int, 2)
X = cython.declare(cython.int, 3)
Y = cython.declare(cython.int, 4)
PX = cython.declare(cython.int, 5)
PY = cython.declare(cython.int, 6)
PUSH_X = cython.declare(cython.int, 7)
PUSH_Y = cython.declare(cython.int, 8)
SCALE = cython.declare(cython.int, 9)
TURN = cython.declare(cython.int, 10)
INERTIA = cython.declare(cython.int, 11)
WITHIN = cython.declare(cython.int, 12)
AS_ONE = cython.declare(cython.int, 13)
ALONG = cython.declare(cython.int, 14)
LIFT = cython.declare(cython.int, 15)
DRIFT_X = cython.declare(cython.int, 16)
DRIFT_Y = cython.declare(cython.int, 17)
SLOW_WITHIN = cython.declare(cython.int, 18)
SLOWER = cython.declare(cython.int, 19)
ACROSS = cython.declare(cython.int, 20)
LEFT = cython.declare(cython.int, 21)
PUSHED = cython.declare(cython.int, 22)

Bodies = cython.struct(
    position=cython.pointer[cython.const[real]],
    velocity=cython.pointer(real),
    spin=cython.pointer(real),
    radius=cython.pointer[cython.const[real]],
    mass=cython.pointer[cython.const[real]],
)

# surplus: J to be removed; dt: s; gx, gy: gravity. forced: whether there are forces besides gravity; kept: with a potential.
# rounded: relative momentum that counts as a push; grain: 1/s, velocity of rounded positions over `rounded`.
Limits = cython.struct(
    surplus=cython.double,
    dt=cython.double,
    gx=cython.double,
    gy=cython.double,
    period_x=cython.double,
    period_y=cython.double,
    forced=cython.bint,
    kept=cython.bint,
    rounded=cython.double,
    grain=cython.double,
)


@cython.cfunc
def map_bodies(b: cython.pointer(Bodies), arrays) -> cython.int:
    """Set the addresses of position, velocity, spin, radius and mass."""
    b.position, b.velocity = const_reals(arrays[0]), reals(arrays[1])
    b.spin, b.radius, b.mass = reals(arrays[2]), const_reals(arrays[3]), const_reals(arrays[4])
    return 0


@cython.cfunc
def read_limits(to: cython.pointer(Limits), limits) -> cython.int:
    """Set the limits from an array."""
    to.surplus, to.dt, to.gx, to.gy, to.period_x, to.period_y = limits[:6]
    to.forced, to.kept, to.rounded, to.grain = limits[6:]
    return 0


@inlined
def speed_left(taken: cython.double, energy: cython.double) -> cython.double:
    """Factor of velocities to lose this much of their energy, or all."""
    one: cython.double = 1.0
    return sqrt(one - min(taken / energy, one)) if energy > 0 else one


@inlined
def free_mass(b: cython.pointer(Bodies), i: cython.Py_ssize_t) -> cython.double:
    """Mass, kg; 0 if pinned."""
    m: cython.double = b.mass[i]
    return m if m < INFINITY else 0


@inlined
def kinetic_energy(b: cython.pointer(Bodies), i: cython.Py_ssize_t, m: cython.double) -> cython.double:
    """Kinetic energy of a particle, J."""
    vx: cython.double = b.velocity[2 * i]
    vy: cython.double = b.velocity[2 * i + 1]
    rim: cython.double = cython.cast(cython.double, b.radius[i]) * b.spin[i]
    return 0.5 * m * (vx * vx + vy * vy) + 0.25 * m * rim * rim


def raise_of(then, now, order, before, pull, limits, lift, moved):
    """lift: (n,) J, work of each particle against gravity and forces in this frame, by the trapezoidal rule; moved: (n, 2) m.

    then: bodies in the user's order, now: by row; order: (n,) the user's index. before, pull: (n, 2) N, forces with a potential
    besides gravity at the start of the frame and now, or empty.
    """
    a: Bodies
    b: Bodies
    g: Limits
    map_bodies(cython.address(a), then)
    map_bodies(cython.address(b), now)
    read_limits(cython.address(g), limits)
    which: cython.pointer[cython.const[int32_t]] = const_small_integers(order)
    was: cython.pointer[cython.const[cython.double]] = const_doubles(before)
    pulled: cython.pointer[cython.const[cython.double]] = const_doubles(pull)
    pulls: cython.bint = len(pull) > 0
    work: cython.pointer(cython.double) = doubles(lift)
    way: cython.pointer(cython.double) = doubles(moved)
    count: cython.Py_ssize_t = len(lift)
    for k in range(count):
        i: cython.Py_ssize_t = which[k]
        m: cython.double = free_mass(cython.address(b), k)
        x: cython.double = b.position[2 * k]
        y: cython.double = b.position[2 * k + 1]
        way[2 * k] = nearest_in_double(x - a.position[2 * i], g.period_x)
        way[2 * k + 1] = nearest_in_double(y - a.position[2 * i + 1], g.period_y)
        ax: cython.double = m * g.gx
        ay: cython.double = m * g.gy
        bx: cython.double = ax
        by: cython.double = ay
        if pulls and m > 0:
            ax, ay = ax + was[2 * k], ay + was[2 * k + 1]
            bx, by = bx + pulled[2 * k], by + pulled[2 * k + 1]
        work[k] = -0.5 * ((ax + bx) * way[2 * k] + (ay + by) * way[2 * k + 1])


@kernel
def sum_clusters(
    then: cython.pointer(Bodies),
    now: cython.pointer(Bodies),
    g: cython.pointer(Limits),
    root: cython.pointer[cython.const[int64_t]],
    order: cython.pointer[cython.const[int32_t]],
    share: cython.pointer[cython.const[cython.double]],
    shared: cython.bint,
    cluster: cython.pointer[cython.const[int64_t]],
    count: cython.Py_ssize_t,
    lift: cython.pointer(cython.double),
    place: cython.pointer(cython.double),
    of: cython.pointer(cython.double),
) -> cython.void:
    """Sum gain, motion and pushes of each cluster. place: (n, 2) m, positions as images near the cluster's root."""
    for k in range(count):
        i: cython.Py_ssize_t = order[k]
        m: cython.double = free_mass(now, k)
        c: int64_t = COLUMNS_OF_CLUSTER * cluster[k]
        x: cython.double = now.position[2 * k]
        y: cython.double = now.position[2 * k + 1]
        x0: cython.double = now.position[2 * root[k]]
        y0: cython.double = now.position[2 * root[k] + 1]
        place[2 * k] = x0 + nearest_in_double(x - x0, g.period_x)
        place[2 * k + 1] = y0 + nearest_in_double(y - y0, g.period_y)
        of[c + COUNT] += 1
        of[c + GAIN] += kinetic_energy(now, k, m) - kinetic_energy(then, i, free_mass(then, i)) + lift[k]
        if shared:
            of[c + GAIN] += share[i]
        vx: cython.double = now.velocity[2 * k]
        vy: cython.double = now.velocity[2 * k + 1]
        gone_x: cython.double = m * (vx - then.velocity[2 * i])
        gone_y: cython.double = m * (vy - then.velocity[2 * i + 1])
        of[c + MASS] += m
        of[c + X] += m * place[2 * k]
        of[c + Y] += m * place[2 * k + 1]
        of[c + PX] += m * vx
        of[c + PY] += m * vy
        of[c + PUSH_X] += gone_x - g.dt * m * g.gx
        of[c + PUSH_Y] += gone_y - g.dt * m * g.gy
        of[c + SCALE] += m * sqrt(vx * vx + vy * vy) + sqrt(gone_x * gone_x + gone_y * gone_y)
        of[c + SCALE] += m * g.grain * max(fabs(x), fabs(y))


@kernel
def share_out(g: cython.pointer(Limits), of: cython.pointer(cython.double), clusters: cython.Py_ssize_t) -> cython.void:
    """Distribute the surplus over clusters in proportion to their gains, at most twice the gain."""
    total: cython.double = 0.0
    zero: cython.double = 0.0
    for c in range(0, COLUMNS_OF_CLUSTER * clusters, 23):
        of[c + GAIN] = max(of[c + GAIN], zero)
        if g.forced and of[c + COUNT] <= 1:
            of[c + GAIN] = 0  # gains of isolated particles come from the integrator
        total += of[c + GAIN]
        if of[c + MASS] > 0:
            of[c + X] /= of[c + MASS]
            of[c + Y] /= of[c + MASS]
            of[c + PX] /= of[c + MASS]
            of[c + PY] /= of[c + MASS]
    least: cython.double = 1e-300
    two: cython.double = 2.0
    # Potential energy of forces and links may never be released, so it alone does not raise the share.
    part: cython.double = min(g.surplus / max(total, least), two)
    for c in range(0, COLUMNS_OF_CLUSTER * clusters, 23):
        of[c + LEFT] = of[c + GAIN] * part


@kernel
def remove_within(
    now: cython.pointer(Bodies),
    cluster: cython.pointer[cython.const[int64_t]],
    count: cython.Py_ssize_t,
    place: cython.pointer(cython.double),
    velocity: cython.pointer(cython.double),
    of: cython.pointer(cython.double),
    clusters: cython.Py_ssize_t,
) -> cython.void:
    """1. Slow down the internal motion of clusters. velocity: (n, 2), the new velocities, m/s."""
    zero: cython.double = 0.0
    c: int64_t
    for k in range(count):
        c = COLUMNS_OF_CLUSTER * cluster[k]
        m: cython.double = free_mass(now, k)
        x: cython.double = place[2 * k] - of[c + X]
        y: cython.double = place[2 * k + 1] - of[c + Y]
        vx: cython.double = now.velocity[2 * k]
        vy: cython.double = now.velocity[2 * k + 1]
        of[c + TURN] += m * (x * (vy - of[c + PY]) - y * (vx - of[c + PX]))
        of[c + INERTIA] += m * (x * x + y * y)
    for k in range(clusters):
        c = COLUMNS_OF_CLUSTER * k
        of[c + TURN] = of[c + TURN] / of[c + INERTIA] if of[c + INERTIA] > 0 else zero
    for k in range(count):
        c = COLUMNS_OF_CLUSTER * cluster[k]
        vx = now.velocity[2 * k]
        vy = now.velocity[2 * k + 1]
        # Subtract the rigid motion with the cluster's momentum and angular momentum.
        velocity[2 * k] = vx - (of[c + PX] - of[c + TURN] * (place[2 * k + 1] - of[c + Y]))
        velocity[2 * k + 1] = vy - (of[c + PY] + of[c + TURN] * (place[2 * k] - of[c + X]))
        vx = velocity[2 * k]
        vy = velocity[2 * k + 1]
        of[c + WITHIN] += 0.5 * free_mass(now, k) * (vx * vx + vy * vy)
    for k in range(clusters):
        c = COLUMNS_OF_CLUSTER * k
        of[c + SLOW_WITHIN] = speed_left(of[c + LEFT], of[c + WITHIN])
        of[c + LEFT] = max(of[c + LEFT] - of[c + WITHIN], zero)
    for k in range(count):
        c = COLUMNS_OF_CLUSTER * cluster[k]
        x = place[2 * k] - of[c + X]
        y = place[2 * k + 1] - of[c + Y]
        velocity[2 * k] = of[c + PX] - of[c + TURN] * y + of[c + SLOW_WITHIN] * velocity[2 * k]
        velocity[2 * k + 1] = of[c + PY] + of[c + TURN] * x + of[c + SLOW_WITHIN] * velocity[2 * k + 1]
