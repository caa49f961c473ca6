# mypy: ignore-errors
"""Islands: sets of particles connected by pairs, by union-find. On one thread, as they are rarely needed.

root[i] is a member of the set of i that is at most i; the lowest member is its own root.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_indices, const_integers, const_reals, const_small_integers, integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import nearest_of


@inlined
def find_root(root: cython.pointer(int64_t), i: int64_t) -> int64_t:
    """The root of i; shortens the path to it."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@kernel
def join_sets(root: cython.pointer(int64_t), i: int64_t, j: int64_t) -> cython.void:
    """Merge the sets of i and j."""
    if root[i] != root[j]:  # most pairs are already in one set
        a: int64_t = find_root(root, i)
        b: int64_t = find_root(root, j)
        root[max(a, b)] = min(a, b)


@cython.cfunc
def join_listed(
    position, moved, radius, period_x: real, period_y: real, inverse_mass, pairs, near: real, root: cython.pointer(int64_t)
) -> cython.int:
    """Merge the listed pairs as `join_near_pairs` describes; moved: None if nothing has moved."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    moves: cython.bint = moved is not None
    way: cython.pointer[cython.const[real]] = const_reals(moved) if moves else x
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    first: cython.pointer[cython.const[int64_t]] = const_integers(pairs[0])
    count: cython.pointer[cython.const[int64_t]] = const_integers(pairs[1])
    pair_i: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[2])
    pair_j: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[3])
    rows: cython.Py_ssize_t = len(pairs[0])
    with cython.nogil:
        for s in range(rows):
            for k in range(first[s], first[s] + count[s]):
                i: int64_t = pair_i[k]
                j: int64_t = pair_j[k]
                if w[i] > 0 and w[j] > 0:
                    dx: real = nearest_of(x[2 * j] - x[2 * i], period_x)
                    dy: real = nearest_of(x[2 * j + 1] - x[2 * i + 1], period_y)
                    reach: real = near * (r[i] + r[j])
                    if moves:
                        mx: real = way[2 * j] - way[2 * i]
                        my: real = way[2 * j + 1] - way[2 * i + 1]
                        reach = reach + cython.cast(real, sqrt(mx * mx + my * my))
                    if dx * dx + dy * dy < reach * reach:
                        join_sets(root, i, j)
    return 0


def join_near_pairs(position, moved, radius, period_x: real, period_y: real, inverse_mass, pairs, near: real, root):
    """Merge the listed pairs of free particles that may have touched while they moved by `moved` (n, 2), m.

    That is, pairs whose gap beyond `near` times their contact distance is at most their relative displacement. pairs: those of
    cell row s are `count[s]` from `first[s]` on: (first, count, i, j).
    """
    join_listed(position, moved, radius, period_x, period_y, inverse_mass, pairs, near, integers(root))


def join_rows(rows, inverse_mass, root):
    """Merge the two particles of each of the rows (k, 2), int32, unless one is pinned."""
    pair: cython.pointer[cython.const[int32_t]] = const_small_integers(rows)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    to: cython.pointer(int64_t) = integers(root)
    count: cython.Py_ssize_t = len(rows)
    with cython.nogil:
        for k in range(count):
            if w[pair[2 * k]] > 0 and w[pair[2 * k + 1]] > 0:
                join_sets(to, pair[2 * k], pair[2 * k + 1])


def compress_paths(root):
    """Set root[i] to the lowest member of the set of i."""
    to: cython.pointer(int64_t) = integers(root)
    count: cython.Py_ssize_t = len(root)
    for i in range(count):
        to[i] = to[to[i]]
