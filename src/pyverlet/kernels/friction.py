"""Coulomb friction between circles, with a memory: what a contact has slipped while it lasts.

Friction at rest is a spring (Cundall and Strack 1979, A discrete numerical model for granular assemblies): the slip of the
point of contact is added up while the pair touches, and answered like an overlap, by an impulse in the velocities and PUSHED /
FED of it in the positions. So it carries its share of the weight from one substep to the next. No impulse is larger than mu
times the normal one, and no slip is remembered beyond what that impulse answers: a contact that slides goes on sliding.

For circles i and j: normal n from i to j, tangent (ny, -nx), w = 1 / m. A disc has I = m r^2 / 2, so that the point of contact
has the inverse mass 3 (w_i + w_j).
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import FED, GRIP, PUSHED

# The slip of a pair that did not touch in the substep before. What it slips in its first one, it may have slipped before it met.
NEW = np.inf

# m: added to a distance that is 0 for coincident centres.
_TINY = 1e-30


@kernel
def _pair_friction(a, b, mu):
    """The geometric mean of two circles' friction; mu, that of all, stands for one that is negative: not given."""
    zero = mu - mu
    if a < zero and b < zero:
        return mu
    return np.sqrt((a if a >= zero else mu) * (b if b >= zero else mu))


@kernel
def _grip_strip(
    position, velocity, spin, turn, lift, radius, inverse_mass, friction, pair_i, pair_j, h, mu, leaning,
    touching, impulse, slip, before, held, spent,
):  # fmt: skip
    zero = h - h
    two = position.dtype.type(2)
    three = position.dtype.type(3)
    tiny = position.dtype.type(_TINY)
    feed = position.dtype.type(GRIP) / h
    share = position.dtype.type(PUSHED / FED) * h
    for t in range(touching.shape[0]):
        k = touching[t]
        i, j = pair_i[k], pair_j[k]
        before[t] = slip[k]
        held[t] = zero
        if impulse[t] < zero:
            continue
        lift[i] = leaning
        lift[j] = leaning
        if not slip[k] < NEW:
            continue
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        distance = np.sqrt(dx * dx + dy * dy) + tiny
        nx, ny = dx / distance, dy / distance
        most = _pair_friction(friction[i], friction[j], mu) * impulse[t]
        # From the slip up to the end of the last substep: that of now still changes while neighbours are pushed.
        rub = max(min(-slip[k] * feed / (three * (wi + wj)), most), -most)
        vx = velocity[j, 0] - velocity[i, 0]
        vy = velocity[j, 1] - velocity[i, 1]
        speed = vx * ny - vy * nx + spin[i] * radius[i] + spin[j] * radius[j]
        spent[1] += np.float64(rub) * (speed + 1.5 * (wi + wj) * rub)
        held[t] = rub
        px, py = rub * ny, -rub * nx
        velocity[i, 0] -= px * wi
        velocity[i, 1] -= py * wi
        velocity[j, 0] += px * wj
        velocity[j, 1] += py * wj
        spin[i] += two * rub * wi / radius[i]
        spin[j] += two * rub * wj / radius[j]
        position[i, 0] -= share * px * wi
        position[i, 1] -= share * py * wi
        position[j, 0] += share * px * wj
        position[j, 1] += share * py * wj
        turn[i] += share * two * rub * wi / radius[i]
        turn[j] += share * two * rub * wj / radius[j]
    for k in range(slip.shape[0]):
        slip[k] = NEW


@kernel
def _rub_strip(
    start, position, velocity, spin, turn, radius, inverse_mass, friction, pair_i, pair_j, h, mu,
    touching, impulse, slip, before, held, spent,
):  # fmt: skip
    zero = h - h
    two = position.dtype.type(2)
    three = position.dtype.type(3)
    tiny = position.dtype.type(_TINY)
    for t in range(touching.shape[0]):
        k = touching[t]
        i, j = pair_i[k], pair_j[k]
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        distance = np.sqrt(dx * dx + dy * dy) + tiny
        nx, ny = dx / distance, dy / distance
        vx = velocity[j, 0] - velocity[i, 0]
        vy = velocity[j, 1] - velocity[i, 1]
        bounced = impulse[t] < zero
        kick = zero if bounced else -(vx * nx + vy * ny) / (wi + wj)
        speed = vx * ny - vy * nx + spin[i] * radius[i] + spin[j] * radius[j]
        most = _pair_friction(friction[i], friction[j], mu) * max(abs(impulse[t]) + min(kick, zero), zero)
        # Together with what the grip has given.
        rub = max(min(held[t] - speed / (three * (wi + wj)), most), -most) - held[t]
        spent[1] += np.float64(rub) * (speed + 1.5 * (wi + wj) * rub)
        px = kick * nx + rub * ny
        py = kick * ny - rub * nx
        velocity[i, 0] -= px * wi
        velocity[i, 1] -= py * wi
        velocity[j, 0] += px * wj
        velocity[j, 1] += py * wj
        spin[i] += two * rub * wi / radius[i]
        spin[j] += two * rub * wj / radius[j]
        if bounced:
            continue
        if not before[t] < NEW:
            slip[k] = zero
            continue
        # Measured from where the substep started; the velocity would count feeds that have moved nobody yet.
        sx = (position[j, 0] - start[j, 0]) - (position[i, 0] - start[i, 0])
        sy = (position[j, 1] - start[j, 1]) - (position[i, 1] - start[i, 1])
        slipped = before[t] + sx * ny - sy * nx + turn[i] * radius[i] + turn[j] * radius[j]
        most *= three * (wi + wj) * h / position.dtype.type(GRIP)
        slip[k] = max(min(slipped, most), -most)


@parallel_kernel
def grip(
    position, velocity, spin, turn, lift, radius, inverse_mass, friction, first, count, pair_i, pair_j, h, mu, leaning,
    touching, impulse, touches, slip, before, held, spent,
):  # fmt: skip
    """Answer the slip that touching pairs remember, but for those that have bounced (impulse < 0).

    turn: (n,) rad by which each circle turns in this substep. lift: (n,) becomes `leaning` (s) for all that rest against another.
    slip: (pairs,) m, of all candidates, comes back as NEW; before, held: (pairs,) by touching pair, the slip so far, m, and the
    impulse given, N s: notes for `rub`. spent[s, 1] gains the energy that friction in strip s has taken, J, negative.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _grip_strip(
                position, velocity, spin, turn, lift, radius, inverse_mass, friction, pair_i[a:b], pair_j[a:b], h, mu, leaning,
                touching[a:t], impulse[a:t], slip[a:b], before[a:t], held[a:t], spent[s],
            )  # fmt: skip


@parallel_kernel
def rub(
    start, position, velocity, spin, turn, radius, inverse_mass, friction, first, count, pair_i, pair_j, h, mu,
    touching, impulse, touches, slip, before, held, spent,
):  # fmt: skip
    """Stop the slip, as far as mu times the normal impulse goes, and note in `slip` (pairs,) m what the next grip is to answer.

    Impacts rub too. Also does what `still_resting` does: sets the normal velocity of pairs that have not bounced to 0.
    start: positions before the integration; the others as for `grip`.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _rub_strip(
                start, position, velocity, spin, turn, radius, inverse_mass, friction, pair_i[a:b], pair_j[a:b], h, mu,
                touching[a:t], impulse[a:t], slip[a:b], before[a:t], held[a:t], spent[s],
            )  # fmt: skip


@kernel
def _again(k, begin, pair_i, pair_j):
    """Whether pair k is the one before once more: packs repeat their last pair to be full."""
    return k > begin and pair_i[k] == pair_i[k - 1] and pair_j[k] == pair_j[k - 1]


@kernel
def take_slips(first, count, pair_i, pair_j, slip, owner, begin, low, high, value):
    """List the slips that are not NEW, by the lower of their two particles; owner (slots,): who they are, -1 if no more.

    begin: (particles + 1,) scratch. Returns how many there are.
    """
    begin[:] = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            if slip[k] < NEW and min(p, q) >= 0 and not _again(k, first[s], pair_i, pair_j):
                begin[min(p, q) + 1] += 1
    for p in range(begin.shape[0] - 1):
        begin[p + 1] += begin[p]
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            if slip[k] < NEW and min(p, q) >= 0 and not _again(k, first[s], pair_i, pair_j):
                place = begin[min(p, q)]
                begin[min(p, q)] += 1
                low[place], high[place], value[place] = min(p, q), max(p, q), slip[k]
    return begin[-1]


@kernel
def give_slips(first, count, pair_i, pair_j, slip, owner, begin, high, value):
    """Find them again for the pairs of another list; those of the lower particle p are begin[p] to begin[p + 1]."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            slip[k] = NEW
            for place in range(begin[min(p, q)], begin[min(p, q) + 1]):
                if high[place] == max(p, q):
                    slip[k] = value[place]
