# mypy: ignore-errors
"""Links: implicit rows with accumulated impulses. Rows that follow each other are one block, a banded matrix solved directly.

A row measures C, of stiffness k and damping c, and gives the impulse J along its gradient g at the start of a substep. With kicks
of K = (h + h') / 2, h' being the substep before, the implicit midpoint rule has

    J = -k (h' (C_before + C_now) + h (C_now + C_next)) / 4 - c (C_next - C_before) / 2,    C_next = C(x + v h),

which is stable and keeps energy at any k. Where (omega h)^2 is so large that the swing cannot be followed, it goes over to
J = -k K C_next - c K (C_next - C_now) / h. Either is C_next + soft J = target; a rigid row has soft = target = 0 (SHAKE).
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs

from pyverlet.core.link_rows import PIN_X, coupling, measure_row, mobility, push_row, rate_of
from pyverlet.core.step import Step

BLENDED = cython.declare(cython.double, 0.04)
"""(omega h)^4 at which a soft row is half midpoint, half backward."""

AVERAGED = cython.declare(cython.double, 120.0)
"""1/s: rate of the mean of the pull that is shown, and that breaks."""

NEWTON = cython.declare(cython.int, 2)
MOST_RELEASES = cython.declare(cython.int, 8)
SINGULAR = cython.declare(cython.double, 1e-10)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def soften_row(w: cython.pointer(Step), r: cython.Py_ssize_t, now: cython.double, before: cython.double) -> cython.void:
    """The numbers of a row: `soft`, and its `target`."""
    h: cython.double = w.h
    kick: cython.double = w.kick if w.substep == w.first else w.h
    last: cython.double = 2 * kick - h
    k: cython.double = w.link_stiffness[r]
    c: cython.double = w.link_damping[r]
    if k == INFINITY:
        w.link_soft[r] = w.link_target[r] = 0
        return
    swing: cython.double = k * mobility(w, r) * h * h
    q: cython.double = swing * swing / (swing * swing + BLENDED)
    to_next: cython.double = (1 - q) * (k * h / 4 + c / 2) + q * (k * kick + c * kick / h)
    of_now: cython.double = (1 - q) * k * kick / 2 - q * c * kick / h
    of_before: cython.double = (1 - q) * (k * last / 4 - c / 2)
    if to_next > 0:
        w.link_soft[r] = 1 / to_next
        w.link_target[r] = -(of_now * now + of_before * before) / to_next
    else:
        w.link_soft[r] = INFINITY


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def begin_links(w: cython.pointer(Step), part: cython.int) -> cython.void:
    """What rows measure now, their numbers, and the impulses of the last substep along the gradients of now."""
    b: cython.Py_ssize_t
    r: cython.Py_ssize_t
    scale: cython.double = w.scale if w.substep == w.first else 1
    for b in range(w.link_cut[part], w.link_cut[part + 1]):
        for r in range(w.block_begin[b], w.block_begin[b + 1]):
            if w.link_intact[r] == 0:
                continue
            value: cython.double = measure_row(w, r, 0)
            before: cython.double = w.link_value[r]
            # A particle that has been put elsewhere has not moved there.
            if not fabs(value - w.link_next[r]) <= fabs(value - before) / 10 + 1e-5 * (1 + fabs(w.link_rest[r])):
                before = value
            soften_row(w, r, value, before)
            w.link_value[r] = value
            w.link_impulse[r] *= scale
            push_row(w, r, w.link_impulse[r])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def factor_block(w: cython.pointer(Step), b: cython.Py_ssize_t) -> cython.void:
    """L D L^T of the matrix h g W g^T + soft of those rows of a block that act; rows that repeat others are left out."""
    first: cython.Py_ssize_t = w.block_begin[b]
    band: cython.Py_ssize_t = w.block_band[b]
    width: cython.Py_ssize_t = w.link_band + 1
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    m: cython.Py_ssize_t
    h: cython.double = w.h
    matrix: cython.pointer(cython.double) = w.link_matrix
    for i in range(first, w.block_begin[b + 1]):
        low: cython.Py_ssize_t = max(first, i - band)
        whole: cython.double = h * mobility(w, i) + w.link_soft[i]
        pivot: cython.double = whole
        for j in range(low, i):
            at: cython.double = 0
            if w.link_acts[i] and w.link_acts[j]:
                at = h * coupling(w, i, j)
                for m in range(max(low, j - band), j):
                    at -= matrix[width * i + i - m] * w.link_pivot[m] * matrix[width * j + j - m]
                at *= w.link_inverse[j]
            matrix[width * i + i - j] = at
        for j in range(low, i):
            pivot -= matrix[width * i + i - j] * matrix[width * i + i - j] * w.link_pivot[j]
        good: cython.bint = w.link_acts[i] != 0 and pivot > SINGULAR * whole
        w.link_pivot[i] = pivot if good else 0
        w.link_inverse[i] = 1 / pivot if good else 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def solve_block(w: cython.pointer(Step), b: cython.Py_ssize_t) -> cython.bint:
    """Give the impulses that take away `link_rest_of` of the rows; True if ropes would push, and have been let go."""
    first: cython.Py_ssize_t = w.block_begin[b]
    end: cython.Py_ssize_t = w.block_begin[b + 1]
    band: cython.Py_ssize_t = w.block_band[b]
    width: cython.Py_ssize_t = w.link_band + 1
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    x: cython.pointer(cython.double) = w.link_left
    for i in range(first, end):
        for j in range(max(first, i - band), i):
            x[i] -= w.link_matrix[width * i + i - j] * x[j]
    pushes: cython.bint = False
    for i in range(end - 1, first - 1, -1):
        x[i] *= w.link_inverse[i]
        for j in range(i + 1, min(end, i + band + 1)):
            x[i] -= w.link_matrix[width * j + j - i] * x[j]
        if w.link_acts[i] == 0:
            x[i] = 0
        elif w.link_impulse[i] + x[i] > w.link_upper[i]:
            pushes = True
            w.link_acts[i] = 0
            push_row(w, i, -w.link_impulse[i])
            w.link_impulse[i] = 0
    if not pushes:
        for i in range(first, end):
            push_row(w, i, x[i])
            w.link_impulse[i] += x[i]
    return pushes


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def what_is_left(w: cython.pointer(Step), r: cython.Py_ssize_t, drifts: cython.bint) -> cython.double:
    """Of the equation of row r: of its place after the drift, or afterwards of its rate."""
    if drifts:
        return w.link_target[r] - w.link_soft[r] * w.link_impulse[r] - measure_row(w, r, w.h)
    return w.link_aim[r] - w.link_soft[r] * w.link_impulse[r] - w.h * rate_of(w, r)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def solve_rows(w: cython.pointer(Step), b: cython.Py_ssize_t, drifts: cython.bint) -> cython.void:
    """Solve a block: Newton's method for places, ropes by the set of those that pull."""
    first: cython.Py_ssize_t = w.block_begin[b]
    end: cython.Py_ssize_t = w.block_begin[b + 1]
    r: cython.Py_ssize_t
    _: cython.int
    for r in range(first, end):
        w.link_acts[r] = w.link_intact[r] != 0 and w.link_soft[r] < INFINITY
    releases: cython.int = 0
    times: cython.int = 0
    fresh: cython.bint = True
    while times < (NEWTON if drifts else 1):
        if fresh:
            factor_block(w, b)
        for r in range(first, end):
            w.link_left[r] = what_is_left(w, r, drifts) if w.link_acts[r] else 0
        fresh = solve_block(w, b)
        if fresh and releases < MOST_RELEASES:
            releases += 1
        else:
            times += 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def solve_links(w: cython.pointer(Step), part: cython.int, drifts: cython.bint) -> cython.void:
    """Before the drift: where rows are to be after it, there and back. Afterwards (not drifts): rates, as they should be."""
    first: cython.Py_ssize_t = w.link_cut[part]
    end: cython.Py_ssize_t = w.link_cut[part + 1]
    b: cython.Py_ssize_t
    r: cython.Py_ssize_t
    _: cython.int
    for _ in range(w.link_passes if drifts else 1):
        for b in range(first, end):
            solve_rows(w, b, drifts)
        for b in range(end - 1, first - 1, -1):
            if w.link_single[b] == 0:  # alone it is solved
                solve_rows(w, b, drifts)
    if not drifts:
        return
    for b in range(first, end):
        for r in range(w.block_begin[b], w.block_begin[b + 1]):
            if w.link_intact[r] == 0 or w.link_soft[r] == INFINITY:
                continue
            w.link_next[r] = measure_row(w, r, w.h)
            value: cython.double = w.link_value[r]
            curved: cython.double = w.link_next[r] - value - w.h * rate_of(w, r)
            pays: cython.bint = w.link_stiffness[r] == INFINITY and (value > 0 or w.link_upper[r] > 0)
            w.link_aim[r] = -curved if pays else w.link_target[r] - value - curved


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_links(w: cython.pointer(Step), part: cython.int) -> cython.void:
    """What rows pull with; those that pull too hard break."""
    kick: cython.double = w.kick if w.substep == w.first else w.h
    mean: cython.double = min(1.0, AVERAGED * kick)
    b: cython.Py_ssize_t
    r: cython.Py_ssize_t
    for b in range(w.link_cut[part], w.link_cut[part + 1]):
        for r in range(w.block_begin[b], w.block_begin[b + 1]):
            if w.link_intact[r] == 0:
                continue
            w.link_pull[r] += mean * (-w.link_impulse[r] / kick - w.link_pull[r])
            square: cython.double = w.link_pull[r] * w.link_pull[r]
            if w.link_kind[r] == PIN_X + 1:  # the other coordinate of the pin before
                square += w.link_pull[r - 1] * w.link_pull[r - 1]
            elif w.link_kind[r] == PIN_X:
                continue
            if square > w.link_strength[r] * w.link_strength[r]:
                w.link_intact[r] = 0
                if w.link_kind[r] == PIN_X + 1:
                    w.link_intact[r - 1] = 0
