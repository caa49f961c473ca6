"""What circles with borrowed inertia owe to momentum, given to them as a whole.

Contacts and links solved with m' in place of m keep the sum of m' v, but it is the sum of m v that must be kept. Over a
substep they differ by the sum of (m' - m) dv, with the dv of everything but gravity. A cluster are circles that hang together by
contacts, or by links (`kernels.hanging`). To each that sum is given as a velocity that all its circles share, and what angular
momentum lacks by turning it as a whole. No contact notices: nothing in the cluster moves against anything else in it by that.

Where a wall, an obstacle, a pin or a pinned circle pushes back, momentum is not kept, and what is lacking is theirs to give: what
stands on a floor gets what is lacking along it, and what walls hold in several directions nothing. Given it all the same, light
circles between a wall and a heavy one have their own small inertia against it, and contacts as stiff as for a large one: piles
exploded.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.bits import lowest_bit, store_bits, which_are
from pyverlet.compile.jit import FALSE, kernel, parallel_kernel, prange
from pyverlet.compile.lanes import ALL, ANY, LANES, larger, load, load_rows, spread, which_above, which_set
from pyverlet.kernels.loans import CHUNK
from pyverlet.kernels.motion import IN_PILE

# Of the squared pushes of walls: what of it is across their main direction, at least, if they push in several.
_ACROSS = 1e-6

# Where the sums of a cluster have what walls have done.
_XX, _XY, _YY = 7, 8, 9

# What is so of a cluster: walls push it; what is lacking is given along the wall, or whatever its direction.
_HELD, _ALONG, _FREE = 1, 2, 4


@kernel
def _look(c, a, b, circles, lending):
    """Note in `among` who is pinned, or has been pushed by walls, of the circles from a up to b, and in `found[c]` how many: in a
    heap hardly anybody.
    """
    velocity, inverse_mass, unpushed, among = circles.velocity, circles.inverse_mass, lending.unpushed, lending.among
    zero, packed, count = spread(velocity.dtype.type(0)), b - (b - a) % LANES, 0
    for k in range(a, packed, LANES):
        vx, vy = load_rows(velocity, k)
        ux, uy = load_rows(unpushed, k)
        dx, dy = vx - ux, vy - uy
        some = which_above(larger(larger(dx, zero - dx), larger(dy, zero - dy)), zero)
        some |= ALL & ~which_above(load(inverse_mass, k), zero)
        while some != 0:
            among[a + count] = k + lowest_bit(some)
            count += 1
            some &= some - 1
    for i in range(packed, b):
        among[a + count] = i
        count += velocity[i, 0] != unpushed[i, 0] or velocity[i, 1] != unpushed[i, 1] or inverse_mass[i] == 0
    lending.found[c] = count


@kernel
def _note_wall(i, circles, lending, root):
    """Add to the sums of the cluster of i what a wall has done to it."""
    r, velocity, unpushed = root[i], circles.velocity, lending.unpushed
    to = lending.sums[r]
    if circles.inverse_mass[i] == 0:  # whoever it touches is held in all directions, however hard walls push in one
        lending.what[r] = _HELD
    elif lending.touched[i] or lending.linked[i]:
        dx, dy = float(velocity[i, 0] - unpushed[i, 0]), float(velocity[i, 1] - unpushed[i, 1])
        to[_XX] += dx * dx
        to[_XY] += dx * dy
        to[_YY] += dy * dy


@kernel
def _sum_up(circles, lending, root, heads, count):
    """How walls push each cluster, and what follows from it."""
    sums, what = lending.sums, lending.what
    for k in range(count):
        r = heads[k]
        sums[r, _XX], sums[r, _XY], sums[r, _YY] = 0.0, 0.0, 0.0
        what[r] = 0
    for c in range(lending.found.shape[0]):
        for k in range(c * CHUNK, c * CHUNK + lending.found[c]):
            _note_wall(lending.among[k], circles, lending, root)
    for k in range(count):
        r = heads[k]
        xx, xy, yy = sums[r, _XX], sums[r, _XY], sums[r, _YY]
        if what[r] == _HELD:
            continue
        what[r] = _HELD if xx + yy > 0 else 0
        if xx * yy - xy * xy <= _ACROSS * (xx + yy) * (xx + yy):
            what[r] |= _ALONG if xx + yy > 0 else _FREE


@kernel
def _tell(c, a, b, lending, root):
    """held[i] becomes 1 for who has touched another, or is linked, in a cluster that walls push. Notes in `among` who is in one
    that is given what is lacking, and in `found[c]` how many: in a heap hardly anybody.
    """
    touched, linked, what, held, among, count = lending.touched, lending.linked, lending.what, lending.held, lending.among, 0
    for k in range(a, b, LANES):
        one = root[k]
        if k + LANES <= b and which_are(root, k, np.int64(one)) == ALL and what[one] <= _HELD:  # in a heap nearly always
            store_bits(held, k, which_set(touched, k, ANY) | which_set(linked, k, ANY) if what[one] == _HELD else 0)
            continue
        for i in range(k, min(k + LANES, b)):
            is_so = np.int64(what[root[i]]) * (touched[i] | linked[i])
            held[i] = is_so & _HELD
            among[a + count] = i
            count += is_so > _HELD
    lending.found[c] = count


@parallel_kernel
def note_walls(circles, lending, root, heads, count):
    """How walls push each of the clusters, whose roots are heads[:count]: their sums end with the squares and the product of what
    that did to velocities.
    """
    n = root.shape[0]
    for c in prange((n + CHUNK - 1) // CHUNK):
        _look(c, c * CHUNK, min((c + 1) * CHUNK, n), circles, lending)
    _sum_up(circles, lending, root, heads, count)


@kernel
def note_pins(lending, root, slot, tied, intact):
    """Who is tied to a point, as those in slot[tied] are where that is `intact`, is held as by one that is pinned."""
    for t in range(tied.shape[0]):
        if intact[t]:
            lending.what[root[slot[tied[t]]]] = _HELD


@parallel_kernel
def tell(lending, root):
    """Who is held by walls, through others, and who is to be given what momentum lacks."""
    n = root.shape[0]
    for c in prange((n + CHUNK - 1) // CHUNK):
        _tell(c, c * CHUNK, min((c + 1) * CHUNK, n), lending, root)


@kernel
def _lent(lending, inverse_mass, i):
    """kg that circle i has had beyond its own in this substep."""
    return 1.0 / lending.lighter[i] - lending.mass[i] if lending.lighter[i] != inverse_mass[i] else 0.0


@kernel
def _even(count, circles, lending, root, gains, now, before, rubs):
    """Of the `count` circles in `among`, cluster by cluster: what momentum lacks where `before` has become `now` by lent inertia,
    `gains` gains. All (n, 2); rubs: whether spins take part.

    `Lending.sums`, of each root: m, m x (2), what momentum lacks (2), I, what angular momentum about the centre lacks, and the
    three numbers of `note_walls`.
    """
    position, spin, radius, inverse_mass = circles.position, circles.spin, circles.radius, circles.inverse_mass
    mass, spin_before, sums, among = lending.mass, lending.spin_before, lending.sums, lending.among
    for k in range(count):
        for m in range(_XX):
            sums[root[among[k]], m] = 0.0
    for k in range(count):
        i = among[k]
        r, own, lent = root[i], float(mass[i]), _lent(lending, inverse_mass, i)
        sums[r, 0] += own
        sums[r, 1] += own * position[i, 0]
        sums[r, 2] += own * position[i, 1]
        sums[r, 3] += lent * (now[i, 0] - before[i, 0])
        sums[r, 4] += lent * (now[i, 1] - before[i, 1])
    for k in range(count):
        i = among[k]
        if lending.what[root[i]] == _FREE:
            r, own, lent = root[i], float(mass[i]), _lent(lending, inverse_mass, i)
            x, y = position[i, 0] - sums[r, 1] / sums[r, 0], position[i, 1] - sums[r, 2] / sums[r, 0]
            half = 0.5 * radius[i] * radius[i] if rubs else 0.0
            sums[r, 5] += own * (x * x + y * y + half)
            sums[r, 6] += lent * (x * (now[i, 1] - before[i, 1]) - y * (now[i, 0] - before[i, 0]))
            if rubs:
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
        gains[i, 0] += vx - turn * y
        gains[i, 1] += vy + turn * x
        if rubs:
            spin[i] += turn


@kernel
def balance(circles, lending, root, rubs):
    """Give to each cluster what its momentum and its angular momentum lack."""
    among, count = lending.among, np.int64(0)
    for c in range(lending.found.shape[0]):
        for k in range(c * CHUNK, c * CHUNK + lending.found[c]):
            among[count] = among[k]
            count += 1
    _even(count, circles, lending, root, circles.velocity, circles.velocity, lending.before, rubs)


@kernel
def balance_pull(circles, lending, root, slot, shift, rate):
    """After `balance`: likewise what links have added to accelerations (`kernels.links.add_pull`), for when the frame ends."""
    count, pull, none = np.int64(0), lending.unpushed, lending.before  # these two are of use no more in this substep
    for c in range(lending.found.shape[0]):
        count += lending.found[c]
    if count == 0:
        return
    for k in range(count):
        i = lending.among[k]
        for axis in range(2):
            pull[i, axis] = none[i, axis] = 0
    for k in range(slot.shape[0]):
        pull[slot[k], 0], pull[slot[k], 1] = rate * rate * shift[k, 0], rate * rate * shift[k, 1]
    _even(count, circles, lending, root, circles.acceleration, pull, none, FALSE)


@kernel
def let_fall(resting, held):
    """Circles of a cluster that nothing pushed rest on nobody."""
    for i in range(resting.shape[0]):
        if resting[i] == IN_PILE and not held[i]:
            resting[i] = 0
