"""How stiff springs of contacts are: as stiff as substeps bear, and changed so slowly that what lies on them is not thrown."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

from pyverlet.core import unit

STIFFNESS = 0.3125
"""Frequency of the springs of contacts times the length of a substep. Above 0.375 columns of unequal masses become unstable."""

BORNE, UNEQUAL_BORNE = 0.375, 0.33
"""The most that it may be when substeps have become longer: frames in which it would be more are cut, until springs soften. At
0.6 columns of sixteen discs tremble at 0.3 m/s where frames of 1/60 s and 1/30 s follow each other."""

STIFFEST = 1.3
"""The most that it may be in a frame in which sleepers wake, or that would be cut too often."""

STIFFENING, STIFFENING_AT_REST = 0.4, 0.1
"""Octaves a second by which that frequency may rise: at once, what lies on soft contacts would be thrown up."""

SOFTENING, UNEQUAL_SOFTENING = 4.0, 1.0
"""The same of its fall, in motion. What rests keeps it, and sinks no deeper."""

MOVING = 0.1
"""Root mean square speed over sqrt(g r) from which on particles count as moving."""

MOST_PIECES = 16
"""Of a substep: a change from 8 substeps of 1/60 s to one of 1/30 s."""


def pieces_of(held: Any, h: float) -> int:
    """How many substeps one of h seconds is made as, because springs of contacts are too stiff for it."""
    most = UNEQUAL_BORNE if held.unequal else BORNE
    pieces: int = min(max(1, ceil(held.hertz * h / most * (1 - 1e-9))), MOST_PIECES)
    return pieces


def moves(state: Any, strongest: float, radius: float) -> bool:
    """Whether particles of a mean radius are on the way, and not at rest under an acceleration of so many m/s^2."""
    engine = unit("engine", state.dtype)
    motion = engine.energies(state.position, state.velocity, state.spin, state.radius, state.mass, 0.0, 0.0)[0]
    return bool(motion > 0.5 * MOVING**2 * strongest * radius * state.total_mass)


def follow(held: Any, h: float, dt: float, pieces: int, moves: Callable[[], bool]) -> None:
    """Let the frequency follow substeps of h seconds in a frame of dt, each made as so many. moves: whether particles move."""
    best, hertz = STIFFNESS / h, held.hertz
    held.finer = held.finer + dt if best > hertz else 0.0
    if not hertz:
        held.hertz = best
    elif best < hertz:
        pace = (UNEQUAL_SOFTENING if held.unequal else SOFTENING) if moves() else 0.0
        held.hertz = min(max(best, hertz * 2.0 ** (-pace * dt)), STIFFEST * pieces / h)
    elif held.finer > 0.5:
        held.hertz = min(best, hertz * 2.0 ** ((STIFFENING if moves() else STIFFENING_AT_REST) * dt))
