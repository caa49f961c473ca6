"""Who hangs together: sets of particles joined by pairs, by union-find. One thread: it is seldom asked."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest


@kernel
def find_root(root, i):
    """The lowest member of the set of i, as far as it is known; the way there becomes shorter."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@kernel
def join(root, i, j):
    """The sets of i and j become one; whether they were two."""
    if root[i] == root[j]:  # so it is for most, when most are joined
        return False
    a, b = find_root(root, np.int64(i)), find_root(root, np.int64(j))
    root[max(a, b)] = min(a, b)
    return a != b


@kernel
def join_met(position, moved, size, period_x, period_y, inverse_mass, first, count, pair_i, pair_j, near, root):
    """Join the listed pairs that may have touched while they moved by `moved` (n, 2), m, and both are free.

    That is: whose gap, beyond `near` times their contact distance, is no longer than what they have moved against each other.
    """
    zero = size.dtype.type(0)
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if inverse_mass[i] > zero and inverse_mass[j] > zero:
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                mx, my = moved[j, 0] - moved[i, 0], moved[j, 1] - moved[i, 1]
                reach = near * (size[i] + size[j]) + np.sqrt(mx * mx + my * my)
                if dx * dx + dy * dy < reach * reach:
                    join(root, i, j)


@kernel
def join_rows(rows, inverse_mass, root):
    """Join the two slots of each of the (k, 2) rows, unless one is pinned."""
    zero = inverse_mass.dtype.type(0)
    for k in range(rows.shape[0]):
        if inverse_mass[rows[k, 0]] > zero and inverse_mass[rows[k, 1]] > zero:
            join(root, rows[k, 0], rows[k, 1])


@kernel
def settle(root):
    """root[i] becomes the lowest member of the set of i: roots are below what they are the roots of."""
    for i in range(root.shape[0]):
        root[i] = root[root[i]]
