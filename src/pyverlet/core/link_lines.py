# mypy: ignore-errors
"""Solves chains whose impulses have the fixed directions `along`: a tridiagonal system, one unknown per link.

These are the chains of nets, and all chains after the drift.
"""

from __future__ import annotations

import cython

from pyverlet.core.kernels import kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_holds import Mobility, moved_by

SINGULAR = cython.declare(cython.double, 1e-12)
"""Smallest pivot over a link's own share of it; below, other links already determine its length."""


@kernel
def eliminate_line(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, softly: cython.bint
) -> cython.void:
    """Forward elimination: `answer` of each row without what follows, and the coefficient of the next row, as `inverse`."""
    answer: cython.double = 0
    share: cython.double = 0
    before: Mobility = moved_by(k, k.node[k.first[first]])
    for r in range(first, end):
        after: Mobility = moved_by(k, k.node[k.first[r] + 1])
        if k.acts[r] == 0:
            answer = share = 0
        else:
            x: cython.double = k.along[2 * r]
            y: cython.double = k.along[2 * r + 1]
            back: cython.double = 0
            if r > first:  # h d_r W d_(r-1)
                px: cython.double = k.along[2 * r - 2]
                py: cython.double = k.along[2 * r - 1]
                back = k.h * (x * (before.xx * px + before.xy * py) + y * (before.xy * px + before.yy * py))
            xx: cython.double = before.xx + after.xx
            own: cython.double = k.h * (xx * x * x + 2 * (before.xy + after.xy) * x * y + (before.yy + after.yy) * y * y)
            pivot: cython.double = own + (k.soft[r] if softly else 0) - back * share
            if own <= 0 or pivot <= SINGULAR * own:
                k.acts[r] = 0
                answer = share = 0
            else:
                answer = (k.wanted[2 * r] + back * answer) / pivot
                share = 0
                if r + 1 < end:
                    nx: cython.double = k.along[2 * r + 2]
                    ny: cython.double = k.along[2 * r + 3]
                    share = k.h * (x * (after.xx * nx + after.xy * ny) + y * (after.xy * nx + after.yy * ny)) / pivot
        k.answer[2 * r], k.inverse[3 * r] = answer, share
        before = after


@kernel
def substitute_line(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.bint:
    """Back substitution, as `substitute`."""
    f: cython.double = 0
    pushes: cython.bint = False
    for r in range(end - 1, first - 1, -1):
        f = k.answer[2 * r] + k.inverse[3 * r] * f if k.acts[r] else 0.0
        k.answer[2 * r], k.answer[2 * r + 1] = f * k.along[2 * r], f * k.along[2 * r + 1]
        if k.acts[r] and k.upper[r] <= 0 and k.impulse[r] + f > 0:
            k.acts[r] = 0
            pushes = True
    return pushes
