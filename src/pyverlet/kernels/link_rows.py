"""Links that are one equation each, of any kind `kernels.shapes` can measure: rows, solved part by part in `linked`'s passes.

Those of a part share no particle and are solved beside each other. The law is that of `kernels.links`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.compile.bundle import bundle
from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.ground.constants import LINK_GIVE, LINK_LEAST_N, LINK_MEMORY_S
from pyverlet.kernels.links import blend, share_settled
from pyverlet.kernels.shapes import measure

REST, STIFFNESS, DAMPING, UPPER, STRENGTH, FORCE, LAST, GIVE, OFFSET, TURN, LAM = range(11)
NUMBERS = 11
"""Columns of `Rows.number`: those of the tables of links, and those a substep finds. See `prepare_row`."""


@bundle
class Rows:
    """Rows in the order they are solved, each with as many entries as it has particles.

    part: (parts + 1,) where the rows of each part begin. first: (rows + 1,) where the entries of each row begin. kind, intact:
    of rows; number: (rows, NUMBERS). particle: of entries, in the order of the linked; corner, gradient, along: (entries, 2),
    where each is, m, and what `measure` finds, and the direction it is moved in.
    """

    part: Any
    first: Any
    kind: Any
    intact: Any
    number: Any
    particle: Any
    corner: Any
    gradient: Any
    along: Any


@kernel
def _move(a, b, step, particle, weight, along, shift):
    """Move the particles of a row by w step along its gradient."""
    for e in range(a, b):
        w = weight[particle[e]] * step
        if w != 0.0:
            shift[particle[e], 0] += w * along[e, 0]
            shift[particle[e], 1] += w * along[e, 1]


@kernel
def prepare_row(a, b, kind, number, particle, corner, gradient, along, start, back, weight, period_x, period_y, h):
    """From where its particles start, and were a substep before: a row is to satisfy C+ + offset + give lam = 0.

    Its force acts along a direction that is the part `turn` of the way from the old gradient to the new. lam starts from the
    `last` pull, N, as far as the substep follows the motion.
    """
    earlier = 0.0
    soft = number[STIFFNESS] < np.inf
    if soft:
        for e in range(a, b):
            p = particle[e]
            corner[e, 0], corner[e, 1] = start[p, 0] - np.float64(back[p, 0]), start[p, 1] - np.float64(back[p, 1])
        earlier, _ = measure(kind, a, b, corner, period_x, period_y, number[REST], gradient)
    for e in range(a, b):
        corner[e, 0], corner[e, 1] = start[particle[e], 0], start[particle[e], 1]
    now, bend = measure(kind, a, b, corner, period_x, period_y, number[REST], along)
    ww = total = 0.0
    for e in range(a, b):
        w = np.float64(weight[particle[e]])
        total += w
        ww += w * (along[e, 0] * along[e, 0] + along[e, 1] * along[e, 1])
    number[GIVE] = LINK_GIVE * ww
    number[OFFSET] = number[LAM] = 0.0
    number[TURN] = share_settled(h * h * abs(number[FORCE]) * bend * total)  # of (frequency of swinging sideways * h)^2
    if soft:
        kp, k0, km = blend(number[STIFFNESS], number[DAMPING], ww, h)
        if number[UPPER] <= 0.0:  # a slack rope has no stretch to remember
            now, earlier = max(now, 0.0), max(earlier, 0.0)
        number[GIVE] += 1.0 / (h * h * max(kp, 1e-300))
        number[OFFSET] = (k0 * now + km * earlier) / max(kp, 1e-300)
        if number[UPPER] == np.inf:
            number[LAM] = -(1.0 - share_settled(h * h * number[STIFFNESS] * ww)) * number[LAST] * h * h


@kernel
def solve_row(a, b, kind, number, particle, corner, gradient, along, predicted, shift, weight, period_x, period_y):
    """Move the particles of a row to where it is content, as far as it gives; add to lam what it took."""
    for e in range(a, b):
        p = particle[e]
        corner[e, 0], corner[e, 1] = predicted[p, 0] + np.float64(shift[p, 0]), predicted[p, 1] + np.float64(shift[p, 1])
    value, _ = measure(kind, a, b, corner, period_x, period_y, number[REST], gradient)
    straight = turned = 0.0
    for e in range(a, b):
        w = np.float64(weight[particle[e]])
        along[e, 0] += number[TURN] * (gradient[e, 0] - along[e, 0])
        along[e, 1] += number[TURN] * (gradient[e, 1] - along[e, 1])
        straight += w * (gradient[e, 0] * gradient[e, 0] + gradient[e, 1] * gradient[e, 1])
        turned += w * (gradient[e, 0] * along[e, 0] + gradient[e, 1] * along[e, 1])
    if turned < 0.5 * straight:  # turned by more than 60 degrees in a substep: the old direction says nothing any more
        turned = straight
        for e in range(a, b):
            along[e, 0], along[e, 1] = gradient[e, 0], gradient[e, 1]
    if turned <= 0.0:
        return
    step = -(value + number[OFFSET] + number[GIVE] * number[LAM]) / (turned + number[GIVE])
    step = min(step, number[UPPER] - number[LAM])
    number[LAM] += step
    _move(a, b, step, particle, weight, along, shift)


@parallel_kernel
def _prepare(begin, end, first, kind, intact, number, particle, corner, gradient, along, linked, period_x, period_y, h):
    start, back, weight, shift = linked.start, linked.back, linked.weight, linked.shift
    for r in prange(begin, end):
        a, b = first[r], first[r + 1]
        prepare_row(
            a, b, kind[r], number[r], particle, corner, gradient, along, start, back, weight, period_x, period_y, h
        )  # fmt: skip
        if intact[r] and number[r, LAM] != 0.0:
            _move(a, b, number[r, LAM], particle, weight, along, shift)


@driver
def prepare_rows(rows, linked, period_x, period_y, h):
    """What all rows are to satisfy; their particles move by the lam they start from, in `linked.shift`."""
    for k in range(rows.part.shape[0] - 1):
        _prepare(
            rows.part[k], rows.part[k + 1], rows.first, rows.kind, rows.intact, rows.number, rows.particle, rows.corner,
            rows.gradient, rows.along, linked, period_x, period_y, h,
        )  # fmt: skip


@parallel_kernel
def _solve(begin, end, first, kind, intact, number, particle, corner, gradient, along, linked, period_x, period_y):
    predicted, shift, weight = linked.predicted, linked.shift, linked.weight
    for r in prange(begin, end):
        if intact[r]:
            solve_row(
                first[r], first[r + 1], kind[r], number[r], particle, corner, gradient, along, predicted, shift, weight, period_x,
                period_y,
            )  # fmt: skip


@driver
def sweep_rows(homeward, skip, rows, linked, period_x, period_y):
    """Solve one part after the other, or `homeward` from the last one, without the first part on the way if `skip`."""
    parts = rows.part.shape[0] - 1
    for n in range(1 if skip else 0, parts):
        k = parts - 1 - n if homeward else n
        _solve(
            rows.part[k], rows.part[k + 1], rows.first, rows.kind, rows.intact, rows.number, rows.particle, rows.corner,
            rows.gradient, rows.along, linked, period_x, period_y,
        )  # fmt: skip


@kernel
def note_rows(intact, number, h):
    """What each row pulls with, which for rigid links is noisy; let the force shown follow it. That of the broken stays what it
    was. Break those that pull or push harder than their strength.
    """
    part = h / (h + LINK_MEMORY_S)
    for r in range(number.shape[0]):
        row = number[r]
        row[LAST] = -row[LAM] / (h * h)
        if intact[r]:
            row[FORCE] += part * (row[LAST] - row[FORCE])
            if abs(row[FORCE]) < LINK_LEAST_N:
                row[FORCE] = 0.0
        if abs(row[FORCE]) > row[STRENGTH]:
            intact[r] = 0


@parallel_kernel
def measure_rows(first, kind, rest, corner, period_x, period_y, gradient, value):
    """value = C of every row."""
    for r in prange(value.shape[0]):
        value[r], _ = measure(kind[r], first[r], first[r + 1], corner, period_x, period_y, rest[r], gradient)
