# mypy: ignore-errors
"""Islands: sets of particles joined by pairs, by union-find. On one thread: they are rarely asked for.

root[i] is a member of the set of i that is not above i; that of the lowest member is itself.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int64_t


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def find_root(root: cython.pointer(int64_t), i: int64_t) -> int64_t:
    """The lowest member of the set of i, as far as it is known; the way there becomes shorter."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def join_sets(root: cython.pointer(int64_t), i: int64_t, j: int64_t) -> cython.void:
    """The sets of i and j become one."""
    if root[i] != root[j]:  # equal for most, when most are joined
        a: int64_t = find_root(root, i)
        b: int64_t = find_root(root, j)
        root[max(a, b)] = min(a, b)
