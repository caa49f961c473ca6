# mypy: ignore-errors
"""Formulas of contacts with surfaces, for one at a time and for eight at a time."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import fabs

from pyverlet.core.kernels import inlined

SMALL_ANGLE = cython.declare(cython.double, 1e-8)
"""Square of an angle whose fourth power is lost in rounding: resting particles need neither root nor division."""

SETTLED = cython.declare(cython.double, 1e-5)
"""Relative change of impulses below which sweeps stop."""


@inlined
def bend_excess(slip: cython.double, slide: cython.double) -> cython.double:
    """By how much a curved surface recedes from the tangent in a substep, m/s; slide: the angle turned by, a small one.

    1 - cos(s) = s^2 (1/2 + s^2 / 8) to fourth order, if s is the sine of the angle.
    """
    return slip * slide * (0.5 + 0.125 * (slide * slide))


@inlined
def bend_change(
    x: cython.double, y: cython.double, tangent: cython.double, h: cython.double, bend: cython.double
) -> cython.double:  # fmt: skip
    """Upper bound of the change of `bend_excess` by friction `tangent`, m/s; (x, y): velocity relative to the surface."""
    return (fabs(x) + fabs(y) + 0.5 * fabs(tangent)) * fabs(tangent) * h * fabs(bend)


@inlined
def dragged(had: cython.double, slip: cython.double, ease: cython.double, most: cython.double) -> cython.double:
    """The tangential impulse over the mass, of which it had a part, that stops the slip, at most `most`, m/s."""
    return min(max(had - slip * (1 / (1 + ease)), -most), most)
