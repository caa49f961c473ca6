"""Who has been calm for how long, who hangs together, and who is touched while asleep. One thread: these are rare or short."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.clusters import find_root, join
from pyverlet.kernels.seam import nearest

_ONE = np.uint64(1)


@kernel
def count_calm(velocity, spin, radius, inverse_mass, island, limit, dt, after, calm):
    """calm[i] += dt for everyone awake whose speed, that of the rim included, is at most sqrt(limit * radius); else it is 0.

    Returns whether anyone who is awake, and not pinned, has been calm for `after` seconds.
    """
    v, zero, none, tired = velocity.reshape(-1), calm.dtype.type(0), spin.dtype.type(0), False
    for n in range(calm.shape[0]):
        i, k = np.uint64(n), np.uint64(2 * n)
        vx, vy, rim, awake = v[k], v[k + _ONE], spin[i] * radius[i], island[i] < 0
        longer = calm[i] + dt if vx * vx + vy * vy + rim * rim <= limit * radius[i] else zero
        calm[i] = longer if awake else calm[i]
        tired |= awake & (longer >= after) & (inverse_mass[i] > none)
    return tired


@kernel
def find_islands(position, size, period_x, period_y, inverse_mass, calm, first, count, pair_i, pair_j, near, after, root):
    """root[i]: the lowest slot of the island of i, if all of it has been calm for `after` seconds; else -1.

    An island is what hangs together by pairs nearer than `near` times their contact distance (union-find). Pinned circles and
    sleepers (inverse mass 0) belong to none.
    """
    zero = size.dtype.type(0)
    for i in range(root.shape[0]):
        root[i] = i
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if inverse_mass[i] > zero and inverse_mass[j] > zero:
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                reach = near * (size[i] + size[j])
                if dx * dx + dy * dy < reach * reach:
                    join(root, i, j)
    restless = np.zeros(root.shape[0], np.uint8)
    for i in range(root.shape[0]):
        if calm[i] < after or inverse_mass[i] <= zero:
            restless[find_root(root, i)] = 1
    for i in range(root.shape[0] - 1, -1, -1):  # from above: roots are below what they are the roots of
        r = find_root(root, i)
        root[i] = -1 if restless[r] else r


@kernel
def touch(position, size, period_x, period_y, island, first, count, pair_i, pair_j, touched):
    """Set touched[i] = 1 for sleepers that overlap somebody awake; returns how many such pairs there are."""
    found = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if (island[i] < 0) != (island[j] < 0):
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                reach = size[i] + size[j]
                if dx * dx + dy * dy < reach * reach:
                    touched[j if island[i] < 0 else i] = 1
                    found += 1
    return found


@kernel
def find_edited(given, held, particle, island, edited):
    """Set edited[k] = 1 for sleepers that the user has written to; returns how many there are.

    given: what the user has, in the user's order: position, velocity, spin, radius, mass, restitution, friction, category, mask.
    held: what the slots hold of it, without velocity and spin, which are 0; categories and masks are empty where all are default.
    """
    position, velocity, spin, radius, mass, restitution, friction, category, mask = given
    was_at, was_radius, was_mass, was_restitution, was_friction, was_category, was_mask = held
    one, every, found = np.uint32(1), np.uint32(0xFFFFFFFF), 0
    for k in range(island.shape[0]):
        if island[k] >= 0:
            i = particle[k]
            differs = (position[i, 0] != was_at[k, 0]) | (position[i, 1] != was_at[k, 1])
            differs |= (velocity[i, 0] != 0) | (velocity[i, 1] != 0) | (spin[i] != 0)
            differs |= (radius[i] != was_radius[k]) | (mass[i] != was_mass[k])
            differs |= (restitution[i] != was_restitution[k]) | (friction[i] != was_friction[k])
            differs |= category[i] != (was_category[k] if was_category.shape[0] > 0 else one)
            differs |= mask[i] != (was_mask[k] if was_mask.shape[0] > 0 else every)
            if differs:
                edited[k] = 1
                found += 1
    return found
