# mypy: ignore-errors
"""Springs and dampers as implicit rows: C_next + soft J = target.

With kicks of K = (h + h') / 2, h' being the substep before, Newmark's method has

    J = -k (K C_now + beta (h (C_next - C_now) - h' (C_now - C_before))) - c (C_next - C_before) / 2,    C_next = C(x + u h).

With beta = 1/12 periods are right to fourth order (Fox and Goodwin 1949); with 1/4 it is stable and conserves energy at any k
(the implicit midpoint rule): beta blends from one to the other. If h is not h', the force changes on average by (h^2 - h'^2) / 6
of its rate: what beta leaves of that follows from the previous rate. If (omega h)^2 is too large for the oscillation to be
resolved, it becomes

    J = -k K C_next - c K (C_next - C_now) / h.

A rigid row has soft = target = 0.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links

BLENDED = cython.declare(cython.double, 0.2)
"""(omega h)^2 at which a soft row is half midpoint, half backward Euler."""

COARSE = cython.declare(cython.double, 0.12)
"""(omega h)^2 at which beta is halfway between its limits."""

LEAST = cython.declare(cython.double, 1e-25)
"""N: smaller means become 0, so that the decaying mean of a tension never becomes a denormal number."""

Softness = cython.struct(soft=cython.double, target=cython.double)


@inlined
def backward_share(swing: cython.double) -> cython.double:
    """Weight of backward Euler in a soft row, as a function of (omega h)^2."""
    square: cython.double = swing * swing
    return square * square / (square * square + BLENDED * BLENDED * BLENDED * BLENDED)


@inlined
def fineness(swing: cython.double) -> cython.double:
    """From 1, where beta is 1/12, to 0, where it is 1/4; the transition is as late and steep as lattices of springs allow."""
    ratio: cython.double = swing * swing / (COARSE * COARSE)
    return 1 / (1 + ratio * ratio)


@inlined
def before_that(value: cython.double, before: cython.double, ahead: cython.double, rest: cython.double) -> cython.double:
    """The value of a row a substep ago; the current one if its particles were moved by the user."""
    return before if fabs(value - ahead) <= fabs(value - before) / 10 + 1e-5 * (1 + fabs(rest)) else value


@kernel
def softness(
    k: cython.pointer(Links), stiffness: cython.double, damping: cython.double, mobility: cython.double, now: cython.double,
    before: cython.double,
) -> Softness:  # fmt: skip
    """Coefficients of a row that measures `now`, and `before` a substep ago."""
    found: Softness
    found.soft = found.target = 0
    if stiffness == INFINITY:
        return found
    h: cython.double = k.h
    kick: cython.double = k.kick
    last: cython.double = 2 * kick - h
    swing: cython.double = stiffness * mobility * h * h
    q: cython.double = backward_share(swing)
    fine: cython.double = fineness(swing)
    beta: cython.double = 0.25 - fine / 6
    if last <= 0:  # the shown velocity, from which a world begins, is not Newmark's: see `force_gained`
        beta = 0.125 + beta / 2
    uneven: cython.double = fine * stiffness * (1.0 / 6 - beta) * (h * h - last * last) / last if last > 0 else 0.0
    to_next: cython.double = (1 - q) * (beta * stiffness * h + damping / 2) + q * (stiffness * kick + damping * kick / h)
    of_now: cython.double = (1 - q) * stiffness * kick * (1 - 2 * beta) - q * damping * kick / h + (1 - q) * uneven
    of_before: cython.double = (1 - q) * (beta * stiffness * last - damping / 2 - uneven)
    if to_next > 0:
        found.soft = 1 / to_next
        found.target = -(of_now * now + of_before * before) / to_next
    else:
        found.soft = INFINITY
    return found


@kernel
def force_gained(
    k: cython.pointer(Links), stiffness: cython.double, mobility: cython.double, before: cython.double, now: cython.double
) -> cython.double:
    """Force of a row at the end of a frame minus that in the last substep, N, for the velocities that are shown.

    Newmark's method conserves v^2 / 2 + U (1 + (beta - 1/4) (omega h)^2). Shown velocities are smaller by that much, so that the
    energy is conserved: with u the mean velocity of a substep and a the acceleration at its end, they are
    u + h a / 2 - h^2 a' (1/8 + beta / 2). Beyond the change of a that J contains, that is 3/4 - beta of it.
    """
    if stiffness == INFINITY:
        return 0.0
    swing: cython.double = stiffness * mobility * k.h * k.h
    return -(1 - backward_share(swing)) * (0.5 + fineness(swing) / 6) * stiffness * (now - before)


@inlined
def kept_share(k: cython.pointer(Links), impulse: cython.double, load: cython.double, mobility: cython.double) -> cython.double:
    """Fraction of the last impulse to repeat: not the jerk of a rope that snaps taut, but loads that at most double.

    load: impulse at the start of that substep.
    """
    most: cython.double = 2 * fabs(load) + (k.least / mobility if mobility > 0 else INFINITY)
    return most / fabs(impulse) if fabs(impulse) > most else 1.0


@inlined
def averaged(mean: cython.double, pull: cython.double, share: cython.double) -> cython.double:
    """Running mean of a tension; share: weight of the current value."""
    after: cython.double = mean + share * (pull - mean)
    return after if fabs(after) > LEAST else 0.0
