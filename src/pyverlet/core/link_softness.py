# mypy: ignore-errors
"""Springs and dampers as implicit rows: C_next + soft J = target.

With kicks of K = (h + h') / 2, h' being the substep before, Newmark's method has

    J = -k (K C_now + beta (h (C_next - C_now) - h' (C_now - C_before))) - c (C_next - C_before) / 2,    C_next = C(x + u h).

With beta = 1/12 periods are right to fourth order (Fox and Goodwin 1949), with 1/4 it is stable and keeps energy at any k (the
implicit midpoint rule): beta goes from the one to the other. Where h is not h', force changes in the mean by (h^2 - h'^2) / 6 of
its rate: what beta leaves of that is told by the rate before. Where (omega h)^2 is so large that the swing cannot be followed, it
becomes

    J = -k K C_next - c K (C_next - C_now) / h.

A rigid row has soft = target = 0.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links

BLENDED = cython.declare(cython.double, 0.2)
"""(omega h)^2 at which a soft row is half midpoint, half backward."""

COARSE = cython.declare(cython.double, 0.12)
"""(omega h)^2 at which beta is halfway."""

LEAST = cython.declare(cython.double, 1e-25)
"""N. Less is none: the mean of a pull that has ended would become a denormal number, and stay one."""

Softness = cython.struct(soft=cython.double, target=cython.double)


@inlined
def backward_share(swing: cython.double) -> cython.double:
    """How much of a soft row is backward Euler, of (omega h)^2."""
    square: cython.double = swing * swing
    return square * square / (square * square + BLENDED * BLENDED * BLENDED * BLENDED)


@inlined
def fineness(swing: cython.double) -> cython.double:
    """From 1, where beta is 1/12, to 0, where it is 1/4: as late and as fast as lattices of springs bear it."""
    ratio: cython.double = swing * swing / (COARSE * COARSE)
    return 1 / (1 + ratio * ratio)


@inlined
def before_that(value: cython.double, before: cython.double, ahead: cython.double, rest: cython.double) -> cython.double:
    """What a row measured a substep ago; what it measures now if its particles have been put elsewhere, not moved there."""
    return before if fabs(value - ahead) <= fabs(value - before) / 10 + 1e-5 * (1 + fabs(rest)) else value


@kernel
def softness(
    k: cython.pointer(Links), stiffness: cython.double, damping: cython.double, mobility: cython.double, now: cython.double,
    before: cython.double,
) -> Softness:  # fmt: skip
    """Of a row that measures `now`, and `before` a substep ago."""
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
    if last <= 0:  # the velocity that is shown, of which a world begins, is not Newmark's: see `force_gained`
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
    """By how much the force of a row at the end of a frame is beyond that in the last substep, N, for velocities that are shown.

    Newmark's method keeps v^2 / 2 + U (1 + (beta - 1/4) (omega h)^2). Velocities are shown by that much smaller, so that
    the energy is kept: with u the mean velocity of a substep and a the acceleration at its end, they are
    u + h a / 2 - h^2 a' (1/8 + beta / 2). Beside what J holds of a change of a, that is 3/4 - beta of it.
    """
    if stiffness == INFINITY:
        return 0.0
    swing: cython.double = stiffness * mobility * k.h * k.h
    return -(1 - backward_share(swing)) * (0.5 + fineness(swing) / 6) * stiffness * (now - before)


@inlined
def kept_share(k: cython.pointer(Links), impulse: cython.double, load: cython.double, mobility: cython.double) -> cython.double:
    """How much of what the last substep gave is given again: an impact, of a rope that snaps taut, is not; load may double.

    load: what that substep began with.
    """
    most: cython.double = 2 * fabs(load) + (k.least / mobility if mobility > 0 else INFINITY)
    return most / fabs(impulse) if fabs(impulse) > most else 1.0


@inlined
def averaged(mean: cython.double, pull: cython.double, share: cython.double) -> cython.double:
    """The mean of a pull, of which this is the share of now."""
    after: cython.double = mean + share * (pull - mean)
    return after if fabs(after) > LEAST else 0.0
