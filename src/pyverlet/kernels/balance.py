"""What circles with borrowed inertia owe to momentum, given to them as a whole.

Contacts solved with m' in place of m keep the sum of m' v, but it is the sum of m v that must be kept. Over a substep they differ
by the sum of (m' - m) dv, with the dv of everything but links, and gravity's. A cluster are circles that hang together by
contacts. To each that sum is given as a velocity that all its circles share, and what angular momentum lacks by turning it as a
whole. No contact notices: nothing in the cluster moves against anything else in it by that.

Where a wall, an obstacle or a pinned circle pushes back, momentum is not kept, and what is lacking is theirs to give: what stands
on a floor gets what is lacking along it, and what walls hold in several directions nothing. Given it all the same, light circles
between a wall and a heavy one have their own small inertia against it, and contacts as stiff as for a large one: piles exploded.
"""

from __future__ import annotations

from pyverlet.compile.bits import lowest_bit
from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import ANY, LANES, larger, load, load_rows, spread, store, where_set, which_above, which_set
from pyverlet.compile.rows import store_rows
from pyverlet.kernels.clusters import join, settle
from pyverlet.kernels.loans import PINNED
from pyverlet.kernels.motion import IN_PILE

# Of the squared pushes of walls: what of it is across their main direction, at least, if they push in several.
_ACROSS = 1e-6

# Where the sums of a cluster have what walls have done.
_XX, _XY, _YY = 7, 8, 9


@kernel
def set_out(velocity, acceleration, spin, held, h, before, spin_before):
    """Note the velocities from which contacts begin; of those that are held without gravity's share, which counts as theirs."""
    zero, all_of_it, packed = spread(h - h), spread(h), len(spin) - len(spin) % LANES
    for k in range(0, packed, LANES):
        share = where_set(which_set(held, k, ANY), all_of_it, zero)
        vx, vy = load_rows(velocity, k)
        ax, ay = load_rows(acceleration, k)
        store_rows(before, k, vx - share * ax, vy - share * ay)
        store(spin_before, k, load(spin, k))
    for i in range(packed, len(spin)):
        part = h if held[i] else h - h
        before[i, 0] = velocity[i, 0] - part * acceleration[i, 0]
        before[i, 1] = velocity[i, 1] - part * acceleration[i, 1]
        spin_before[i] = spin[i]


@kernel
def _any_pinned(inverse_mass):
    found = False
    for i in range(inverse_mass.shape[0]):
        found |= inverse_mass[i] == 0
    return found


@kernel
def cluster(begin, lanes, lane_i, lane_j, normal, inverse_mass, root):
    """root[i]: the lowest member of the cluster of i, by the pairs that touch and have not bounced."""
    none = normal.dtype.type(0)
    zero, pins = spread(none), _any_pinned(inverse_mass)
    for i in range(root.shape[0]):
        root[i] = i
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s], LANES):
            nx, ny = load(normal[0], k), load(normal[1], k)
            touches = which_above(nx * nx + ny * ny, zero)
            while touches != 0:
                lane = lowest_bit(touches)
                touches &= touches - 1
                i, j = lane_i[k + lane], lane_j[k + lane]
                if not pins or (inverse_mass[i] > none and inverse_mass[j] > none):
                    join(root, i, j)
    settle(root)


@kernel
def _lent(mass, inverse_mass, lighter, i):
    """kg that circle i has had beyond its own in this substep."""
    return 1.0 / lighter[i] - mass[i] if lighter[i] != inverse_mass[i] else 0.0


@kernel
def _note_wall(i, velocity, unpushed, inverse_mass, touched, root, sums):
    dx, dy = velocity[i, 0] - unpushed[i, 0], velocity[i, 1] - unpushed[i, 1]
    if touched[i] and (dx != 0 or dy != 0 or touched[i] & PINNED) and inverse_mass[i] > 0:
        pinned = 1.0 if touched[i] & PINNED else 0.0
        r = root[i]
        sums[r, _XX] += dx * dx + pinned
        sums[r, _XY] += dx * dy
        sums[r, _YY] += dy * dy + pinned


@kernel
def note_walls(velocity, unpushed, inverse_mass, touched, root, sums, pushed, held):
    """Begin the sums of each cluster with how walls have pushed it: the squares and the product of what that did to velocities.

    velocity: (n, 2) m/s, now. unpushed: the same before walls. held[i] becomes 1 if walls have pushed the cluster of i, and so
    does pushed[i], whatever i itself is.
    """
    n = root.shape[0]
    zero, packed = spread(velocity.dtype.type(0)), n - n % LANES
    for i in range(n):
        if root[i] == i:
            sums[i, _XX], sums[i, _XY], sums[i, _YY] = 0.0, 0.0, 0.0
    for k in range(0, packed, LANES):
        vx, vy = load_rows(velocity, k)
        ux, uy = load_rows(unpushed, k)
        dx, dy = vx - ux, vy - uy
        some = which_above(larger(larger(dx, zero - dx), larger(dy, zero - dy)), zero) | which_set(touched, k, PINNED)
        while some != 0:  # in a heap hardly anybody
            _note_wall(k + lowest_bit(some), velocity, unpushed, inverse_mass, touched, root, sums)
            some &= some - 1
    for i in range(packed, n):
        _note_wall(i, velocity, unpushed, inverse_mass, touched, root, sums)
    for i in range(n):  # roots come before what they are the roots of
        pushed[i] = sums[i, _XX] + sums[i, _YY] > 0 if root[i] == i else pushed[root[i]]
    for i in range(n):
        held[i] = (touched[i] != 0) & (inverse_mass[i] > 0) & (pushed[i] != 0)


@kernel
def _begin(inverse_mass, touched, root, sums, open_to, among):
    """Clear the other sums; open_to[i]: in how many directions walls do not hold the cluster of i.

    Notes in `among` who has touched another in a cluster that is open, and returns how many: in a heap hardly anybody.
    """
    none, count = inverse_mass.dtype.type(0), 0
    for i in range(root.shape[0]):
        open_to[i] = 0
        if root[i] == i:
            xx, xy, yy = sums[i, _XX], sums[i, _XY], sums[i, _YY]
            if xx * yy - xy * xy <= _ACROSS * (xx + yy) * (xx + yy):
                open_to[i] = 1 if xx + yy > 0 else 2
                for k in range(_XX):
                    sums[i, k] = 0.0
        else:  # roots come before what they are the roots of
            open_to[i] = open_to[root[i]]
        among[count] = i
        count += open_to[i] > 0 and touched[i] != 0 and inverse_mass[i] > none
    return count


@kernel
def balance(
    position, velocity, spin, radius, mass, inverse_mass, lighter, touched, before, spin_before, root, rubs, sums, open_to, among
):  # fmt: skip
    """Give to each cluster what its momentum and its angular momentum lack.

    rubs: whether spins take part. sums: (n, 10) float64, for each root m, m x (2), what momentum lacks (2), I, what angular
    momentum about the centre lacks, and the three numbers of `note_walls`. open_to, among: (n,) scratch.
    """
    count = _begin(inverse_mass, touched, root, sums, open_to, among)
    for k in range(count):
        i = among[k]
        r, own, lent = root[i], float(mass[i]), _lent(mass, inverse_mass, lighter, i)
        sums[r, 0] += own
        sums[r, 1] += own * position[i, 0]
        sums[r, 2] += own * position[i, 1]
        sums[r, 3] += lent * (velocity[i, 0] - before[i, 0])
        sums[r, 4] += lent * (velocity[i, 1] - before[i, 1])
    for k in range(count):
        i = among[k]
        if open_to[i] == 2:
            r, own, lent = root[i], float(mass[i]), _lent(mass, inverse_mass, lighter, i)
            x, y = position[i, 0] - sums[r, 1] / sums[r, 0], position[i, 1] - sums[r, 2] / sums[r, 0]
            half = 0.5 * radius[i] * radius[i] if rubs else 0.0
            sums[r, 5] += own * (x * x + y * y + half)
            sums[r, 6] += lent * (x * (velocity[i, 1] - before[i, 1]) - y * (velocity[i, 0] - before[i, 0]))
            sums[r, 6] += lent * half * (spin[i] - spin_before[i])
    for k in range(count):
        i = among[k]
        to = sums[root[i]]
        vx, vy = to[3] / to[0], to[4] / to[0]
        pushed = to[_XX] + to[_YY]
        if pushed > 0:  # only what is along the wall
            vx, vy = (vx * to[_YY] - vy * to[_XY]) / pushed, (vy * to[_XX] - vx * to[_XY]) / pushed
        turn = to[6] / to[5] if to[5] > 0 else 0.0
        x, y = position[i, 0] - to[1] / to[0], position[i, 1] - to[2] / to[0]
        velocity[i, 0] += vx - turn * y
        velocity[i, 1] += vy + turn * x
        if rubs:
            spin[i] += turn


@kernel
def let_fall(resting, held):
    """Circles of a cluster that nothing pushed rest on nobody."""
    for i in range(resting.shape[0]):
        if resting[i] == IN_PILE and not held[i]:
            resting[i] = 0
