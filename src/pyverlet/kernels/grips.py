"""Coulomb friction between circles that do not bounce, eight pairs at a time: what `kernels.friction` says, on packs.

A pair that does not touch has depth 0, hence no impulse and no friction: lanes need no branches. Normals are those that
projection has found. Positions follow the velocities: of all that the grip adds to a velocity, PUSHED / FED h goes into the
position, so that a pass over all circles does it at the end.
"""

from __future__ import annotations

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    add_lanes,
    copy_row,
    larger,
    load,
    pick,
    place,
    put,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_above,
    which_above,
)
from pyverlet.ground.constants import FED, GRIP, PUSHED
from pyverlet.kernels.friction import NEW
from pyverlet.kernels.motion import set_out

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024


@kernel
def weigh(begin, lanes, lane_i, lane_j, radius, inverse_mass, body):
    """body (6, lanes): w_i, w_j, r_i, r_j, 2 w_i / r_i, 2 w_j / r_j of each pair. An impulse on the rim of a disc, I = m r^2 / 2,
    changes its spin by the latter.
    """
    two = body.dtype.type(2)
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            i, j = lane_i[k], lane_j[k]
            body[0, k], body[1, k], body[2, k], body[3, k] = inverse_mass[i], inverse_mass[j], radius[i], radius[j]
            body[4, k], body[5, k] = two * inverse_mass[i] / radius[i], two * inverse_mass[j] / radius[j]


@kernel
def _pair_friction(friction, lane_i, lane_j, k, mu):
    """The geometric mean of the circles' friction; mu stands for one that is negative, or for all if nobody has a value."""
    if friction.shape[0] == 0:
        return mu
    zero = mu - mu
    a, b = pick(friction, lane_i, k), pick(friction, lane_j, k)
    return square_root(where_above(zero, a, mu, a) * where_above(zero, b, mu, b))


@kernel
def _distinct(lane_i, k):
    """Lanes of a pack before it repeats its last pair to be full."""
    lanes = LANES
    while lanes > 1 and lane_i[k + lanes - 1] == lane_i[k + lanes - 2]:
        lanes -= 1
    return lanes


@kernel
def _grip_strip(
    velocity, spin, lift, friction, lane_i, lane_j, body, varied, normal_x, normal_y, depths, slip, held, fed, mu, feed, leaning
):  # fmt: skip
    zero, three, half3 = spread(fed - fed), spread(velocity.dtype.type(3)), spread(velocity.dtype.type(1.5))
    new, fed, feed, mu = spread(velocity.dtype.type(NEW)), spread(fed), spread(feed), spread(mu)
    taken = 0.0
    for k in range(0, lane_i.shape[0], LANES):
        depth = load(depths, k)
        touching = which_above(depth, zero)
        if touching == 0:
            store(held, k, zero)
            continue
        at = k * varied
        wi, wj, ri, rj = load(body[0], at), load(body[1], at), load(body[2], at), load(body[3], at)
        nx, ny, slipped = load(normal_x, k), load(normal_y, k), load(slip, k)
        most = _pair_friction(friction, lane_i, lane_j, k, mu) * (depth * fed / (wi + wj))
        # From the slip up to the end of the last substep: that of now still changes while neighbours are pushed.
        answer = (zero - where_above(new, slipped, slipped, zero)) * feed / (three * (wi + wj))
        rub = larger(smaller(answer, most), zero - most)
        store(held, k, rub)
        vxi, vyi = take(velocity, lane_i, k)
        vxj, vyj = take(velocity, lane_j, k)
        si, sj = pick(spin, lane_i, k), pick(spin, lane_j, k)
        speed = (vxj - vxi) * ny - (vyj - vyi) * nx + si * ri + sj * rj
        taken += add_lanes(rub * (speed + half3 * (wi + wj) * rub), _distinct(lane_i, k))
        px, py = rub * ny, zero - rub * nx
        put(velocity, lane_i, k, vxi - px * wi, vyi - py * wi)
        put(velocity, lane_j, k, vxj + px * wj, vyj + py * wj)
        place(spin, lane_i, k, si + rub * load(body[4], at))
        place(spin, lane_j, k, sj + rub * load(body[5], at))
        for lane in range(LANES):
            if (touching >> lane) & 1:
                lift[lane_i[k + lane]] = leaning
                lift[lane_j[k + lane]] = leaning
    return taken


@kernel
def _rub_strip(
    moved, velocity, spin, turn, friction, lane_i, lane_j, body, varied, normal_x, normal_y, depths, slip, held, fed, mu, memory
):  # fmt: skip
    zero, three, half3 = spread(fed - fed), spread(velocity.dtype.type(3)), spread(velocity.dtype.type(1.5))
    new, fed, mu, memory = spread(velocity.dtype.type(NEW)), spread(fed), spread(mu), spread(memory)
    taken = 0.0
    for k in range(0, lane_i.shape[0], LANES):
        depth = load(depths, k)
        if which_above(depth, zero) == 0:
            store(slip, k, new)
            continue
        at = k * varied
        wi, wj, ri, rj = load(body[0], at), load(body[1], at), load(body[2], at), load(body[3], at)
        nx, ny, before, given = load(normal_x, k), load(normal_y, k), load(slip, k), load(held, k)
        vxi, vyi = take(velocity, lane_i, k)
        vxj, vyj = take(velocity, lane_j, k)
        si, sj = pick(spin, lane_i, k), pick(spin, lane_j, k)
        vx, vy = vxj - vxi, vyj - vyi
        kick = (zero - (vx * nx + vy * ny)) / (wi + wj)
        speed = vx * ny - vy * nx + si * ri + sj * rj
        most = _pair_friction(friction, lane_i, lane_j, k, mu) * larger(depth * fed / (wi + wj) + smaller(kick, zero), zero)
        # Together with what the grip has given.
        rub = larger(smaller(given - speed / (three * (wi + wj)), most), zero - most) - given
        taken += add_lanes(rub * (speed + half3 * (wi + wj) * rub), _distinct(lane_i, k))
        px, py = kick * nx + rub * ny, kick * ny - rub * nx
        put(velocity, lane_i, k, vxi - px * wi, vyi - py * wi)
        put(velocity, lane_j, k, vxj + px * wj, vyj + py * wj)
        place(spin, lane_i, k, si + rub * load(body[4], at))
        place(spin, lane_j, k, sj + rub * load(body[5], at))
        # Measured from where the substep started; the velocity would count feeds that have moved nobody yet.
        xi, yi = take(moved, lane_i, k)
        xj, yj = take(moved, lane_j, k)
        slipped = before + (xj - xi) * ny - (yj - yi) * nx + pick(turn, lane_i, k) * ri + pick(turn, lane_j, k) * rj
        most = most * three * (wi + wj) * memory
        slipped = where_above(new, before, larger(smaller(slipped, most), zero - most), zero)
        store(slip, k, where_above(depth, zero, slipped, new))
    return taken


@kernel
def _follow(position, velocity, turn, spin, velocity_before, spin_before, share):
    """What the grip has added to velocities and spins, `share` seconds of it, goes into positions and angles."""
    x, v, was = position.reshape(-1), velocity.reshape(-1), velocity_before.reshape(-1)
    for k in range(x.shape[0]):
        x[k] = x[k] + share * (v[k] - was[k])
    for k in range(turn.shape[0]):
        turn[k] = turn[k] + share * (spin[k] - spin_before[k])


@parallel_kernel
def grip(
    position, velocity, spin, turn, lift, friction, velocity_before, spin_before, cut, begin, lanes, lane_i, lane_j,
    body, varied, normal, depths, slip, held, h, mu, leaning, spent,
):  # fmt: skip
    """Answer the slip that touching pairs remember.

    turn: (n,) rad by which each circle turns in this substep. lift: (n,) becomes `leaning` (s) for all that rest against another.
    friction: (n,), or (0,) if nobody has a value of its own. velocity_before, spin_before: scratch. body: of `weigh`, with one
    pack for all if not `varied`. depths, slip, held: (lanes,) m, m, and the impulse given, N s: a note for `rub`.
    spent[s, 1] gains the energy that friction in strip s has taken, J, negative.
    """
    count = spin.shape[0]
    real = velocity.dtype.type
    fed, feed, share = real(FED) / h, real(GRIP) / h, real(PUSHED / FED) * h
    for c in prange((count + _CHUNK - 1) // _CHUNK):
        a, b = c * _CHUNK, min((c + 1) * _CHUNK, count)
        for i in range(a, b):  # not slice by slice: NumPy's checks of shapes take seconds to compile
            copy_row(velocity_before, i, velocity, i)
            spin_before[i] = spin[i]
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                s = 2 * half + parity
                a, b = begin[s], begin[s] + lanes[s]
                spent[s, 1] += _grip_strip(
                    velocity, spin, lift, friction, lane_i[a:b], lane_j[a:b], body[:, a * varied :], varied, normal[0, a:b],
                    normal[1, a:b], depths[a:b], slip[a:b], held[a:b], fed, mu, feed, leaning,
                )  # fmt: skip
    for c in prange((count + _CHUNK - 1) // _CHUNK):
        a, b = c * _CHUNK, min((c + 1) * _CHUNK, count)
        _follow(position[a:b], velocity[a:b], turn[a:b], spin[a:b], velocity_before[a:b], spin_before[a:b], share)


@parallel_kernel
def rub(
    start, moved, position, velocity, spin, turn, friction, cut, begin, lanes, lane_i, lane_j, body, varied, normal,
    depths, slip, held, h, mu, spent,
):  # fmt: skip
    """Stop the slip, as far as mu times the normal impulse goes, and the approach of touching pairs; note what they have slipped.

    start: positions before the integration. moved: (n, 2) scratch. The others as for `grip`.
    """
    count = spin.shape[0]
    real = velocity.dtype.type
    for c in prange((count + _CHUNK - 1) // _CHUNK):
        a, b = c * _CHUNK, min((c + 1) * _CHUNK, count)
        set_out(position[a:b], start[a:b], moved[a:b])
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                s = 2 * half + parity
                a, b = begin[s], begin[s] + lanes[s]
                spent[s, 1] += _rub_strip(
                    moved, velocity, spin, turn, friction, lane_i[a:b], lane_j[a:b], body[:, a * varied :], varied,
                    normal[0, a:b], normal[1, a:b], depths[a:b], slip[a:b], held[a:b], real(FED) / h, mu, h / real(GRIP),
                )  # fmt: skip
