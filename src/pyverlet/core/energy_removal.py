# mypy: ignore-errors
"""Second half of the energy limiter: removes energy from the motion of clusters as a whole, and from raised particles."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_integers, const_small_integers, doubles, integers, octets
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t

from pyverlet.core.energy_limiting import (
    ACROSS,
    ALONG,
    AS_ONE,
    COLUMNS_OF_CLUSTER,
    DRIFT_X,
    DRIFT_Y,
    GAIN,
    LEFT,
    LIFT,
    PUSH_X,
    PUSH_Y,
    PUSHED,
    PX,
    PY,
    SCALE,
    SLOWER,
    Bodies,
    Limits,
    free_mass,
    map_bodies,
    read_limits,
    remove_within,
    share_out,
    speed_left,
    sum_clusters,
)
from pyverlet.core.kernels import kernel


@kernel
def find_drift(g: cython.pointer(Limits), of: cython.pointer(cython.double), clusters: cython.Py_ssize_t) -> cython.void:
    """Velocity of clusters across what has pushed them: it is slowed only if nothing else is left."""
    for k in range(clusters):
        c: int64_t = COLUMNS_OF_CLUSTER * k
        size: cython.double = sqrt(of[c + PUSH_X] * of[c + PUSH_X] + of[c + PUSH_Y] * of[c + PUSH_Y])
        of[c + DRIFT_X], of[c + DRIFT_Y] = of[c + PX], of[c + PY]
        if size > g.rounded * of[c + SCALE]:
            ax: cython.double = of[c + PUSH_X] / size
            ay: cython.double = of[c + PUSH_Y] / size
            along: cython.double = of[c + PX] * ax + of[c + PY] * ay
            of[c + PUSHED] = 1
            of[c + DRIFT_X], of[c + DRIFT_Y] = of[c + PX] - along * ax, of[c + PY] - along * ay
            if g.kept:
                of[c + DRIFT_X] = of[c + DRIFT_Y] = 0


@kernel
def remove_as_a_whole(
    now: cython.pointer(Bodies),
    g: cython.pointer(Limits),
    cluster: cython.pointer[cython.const[int64_t]],
    count: cython.Py_ssize_t,
    velocity: cython.pointer(cython.double),
    lift: cython.pointer(cython.double),
    of: cython.pointer(cython.double),
    clusters: cython.Py_ssize_t,
) -> cython.void:
    """2. Slow down the remaining motion; and drift, if that is not enough."""
    zero: cython.double = 0.0
    c: int64_t
    for k in range(count):
        c = COLUMNS_OF_CLUSTER * cluster[k]
        m: cython.double = free_mass(now, k)
        vx: cython.double = velocity[2 * k] - of[c + DRIFT_X]
        vy: cython.double = velocity[2 * k + 1] - of[c + DRIFT_Y]
        rim: cython.double = cython.cast(cython.double, now.radius[k]) * now.spin[k]
        of[c + AS_ONE] += 0.5 * m * (vx * vx + vy * vy) + 0.25 * m * rim * rim
        of[c + ALONG] += 0.5 * m * (of[c + DRIFT_X] * of[c + DRIFT_X] + of[c + DRIFT_Y] * of[c + DRIFT_Y])
        lift[k] = max(lift[k], zero)
        of[c + LIFT] += lift[k]
    falls: cython.bint = g.gx != 0 or g.gy != 0
    for k in range(clusters):
        c = COLUMNS_OF_CLUSTER * k
        of[c + SLOWER] = speed_left(of[c + LEFT], of[c + AS_ONE])
        of[c + LEFT] = max(of[c + LEFT] - of[c + AS_ONE], zero)
        rest: cython.double = max(of[c + LEFT] - of[c + LIFT], zero) if of[c + PUSHED] > 0 or falls else zero
        of[c + ACROSS] = speed_left(rest, of[c + ALONG])


def remove_energy(then, now, about, limits, lift, moved, lower):
    """Remove surplus energy from velocities and spins, and write by how much to lower particles, `lower` (n, 2) m. Returns (n,)
    bool: whether their motion had less than the surplus.

    about: root (n,) of each particle's cluster, pull as in `raise_of`, order; share (n,) in the user's order, increase of the
    energy of links, J, or empty.
    """
    a: Bodies
    b: Bodies
    g: Limits
    map_bodies(cython.address(a), then)
    map_bodies(cython.address(b), now)
    read_limits(cython.address(g), limits)
    root: cython.pointer[cython.const[int64_t]] = const_integers(about[0])
    pulled: cython.pointer[cython.const[cython.double]] = const_doubles(about[1])
    order: cython.pointer[cython.const[int32_t]] = const_small_integers(about[2])
    share: cython.pointer[cython.const[cython.double]] = const_doubles(about[3])
    pulls: cython.bint = len(about[1]) > 0
    work: cython.pointer(cython.double) = doubles(lift)
    way: cython.pointer(cython.double) = doubles(moved)
    place: cython.pointer(cython.double) = doubles(lower)
    count: cython.Py_ssize_t = len(lift)
    numbers, velocities, beyond = np.empty(count, np.int64), np.empty((count, 2)), np.zeros(count, np.bool_)
    cluster: cython.pointer(int64_t) = integers(numbers)
    velocity: cython.pointer(cython.double) = doubles(velocities)
    more: cython.pointer(uint8_t) = octets(beyond)
    clusters: cython.Py_ssize_t = 0
    for k in range(count):  # roots are the lowest indices of their clusters
        if root[k] == k:
            cluster[k] = clusters
            clusters += 1
        else:
            cluster[k] = cluster[root[k]]
    columns = np.zeros((clusters, 23))
    of: cython.pointer(cython.double) = doubles(columns)
    shared: cython.bint = len(about[3]) > 0
    sum_clusters(
        cython.address(a), cython.address(b), cython.address(g), root, order, share, shared, cluster, count, work, place, of
    )
    share_out(cython.address(g), of, clusters)
    remove_within(cython.address(b), cluster, count, place, velocity, of, clusters)
    find_drift(cython.address(g), of, clusters)
    remove_as_a_whole(cython.address(b), cython.address(g), cluster, count, velocity, work, of, clusters)
    one: cython.double = 1.0
    for k in range(count):
        c: int64_t = COLUMNS_OF_CLUSTER * cluster[k]
        m: cython.double = free_mass(cython.address(b), k)
        b.spin[k] *= cython.cast(real, of[c + SLOWER])
        if of[c + GAIN] > 0 and m > 0:
            dx: cython.double = of[c + DRIFT_X]
            dy: cython.double = of[c + DRIFT_Y]
            b.velocity[2 * k] = cython.cast(real, of[c + ACROSS] * dx + of[c + SLOWER] * (velocity[2 * k] - dx))
            b.velocity[2 * k + 1] = cython.cast(real, of[c + ACROSS] * dy + of[c + SLOWER] * (velocity[2 * k + 1] - dy))
        # 3. By how far they are lowered along what pulls at them.
        fx: cython.double = m * g.gx
        fy: cython.double = m * g.gy
        if pulls and m > 0:
            fx, fy = fx + pulled[2 * k], fy + pulled[2 * k + 1]
        strength: cython.double = sqrt(fx * fx + fy * fy)
        gone: cython.double = sqrt(way[2 * k] * way[2 * k] + way[2 * k + 1] * way[2 * k + 1])
        lowered: cython.double = min(of[c + LEFT] / of[c + LIFT], one) if of[c + LIFT] > 0 else 0
        # At most the whole way, near the centre of a spring.
        drop: cython.double = lowered * min(work[k] / strength, gone) / strength if strength > 0 else 0
        place[2 * k] = b.position[2 * k] + drop * fx
        place[2 * k + 1] = b.position[2 * k + 1] + drop * fy
        more[k] = of[c + LEFT] > 0 and m > 0 and strength > 0
    return beyond
