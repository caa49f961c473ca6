"""Stiffness of contact springs: the most that the substeps allow, changed slowly so that supported particles are not thrown."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

from pyverlet.core import unit

STIFFNESS = 0.3125
"""Frequency of the springs of contacts times the length of a substep. Above 0.375 columns of unequal masses become unstable."""

BORNE, UNEQUAL_BORNE = 0.375, 0.33
"""Largest value after substeps have become longer: frames above it are divided until the springs have softened. At 0.6, columns
of sixteen discs tremble at 0.3 m/s where frames of 1/60 s and 1/30 s alternate."""

STIFFEST = 1.3
"""Largest value in a frame in which sleepers wake, or that would be divided too often."""

STIFFENING, STIFFENING_AT_REST = 0.4, 0.1
"""Rate at which the frequency may rise, octaves/s: a jump would throw up particles on soft contacts."""

SOFTENING, UNEQUAL_SOFTENING = 4.0, 1.0
"""Rate at which it may fall, octaves/s, if particles move. At rest it stays, so that they do not sink deeper."""

MOVING = 0.1
"""Particles count as moving from this root mean square speed over sqrt(g r) on."""

MOST_PIECES = 16
"""Most parts of a substep: enough for a change from 8 substeps of 1/60 s to one of 1/30 s."""


def pieces_of(held: Any, h: float) -> int:
    """How many substeps replace one of h seconds because contact springs are too stiff for it."""
    most = UNEQUAL_BORNE if held.unequal else BORNE
    pieces: int = min(max(1, ceil(held.hertz * h / most * (1 - 1e-9))), MOST_PIECES)
    return pieces


def moves(state: Any, strongest: float, radius: float) -> bool:
    """Whether particles of this mean radius move, compared with the acceleration, m/s^2, that would keep them at rest."""
    engine = unit("engine", state.dtype)
    motion = engine.energies(state.position, state.velocity, state.spin, state.radius, state.mass, 0.0, 0.0)[0]
    return bool(motion > 0.5 * MOVING**2 * strongest * radius * state.total_mass)


def follow(held: Any, h: float, dt: float, pieces: int, moves: Callable[[], bool]) -> None:
    """Adapt the frequency to substeps of h seconds, each divided into `pieces`, in a frame of dt. moves: whether particles do."""
    best, hertz = STIFFNESS / h, held.hertz
    held.finer = held.finer + dt if best > hertz else 0.0
    if not hertz:
        held.hertz = best
    elif best < hertz:
        pace = (UNEQUAL_SOFTENING if held.unequal else SOFTENING) if moves() else 0.0
        held.hertz = min(max(best, hertz * 2.0 ** (-pace * dt)), STIFFEST * pieces / h)
    elif held.finer > 0.5:
        held.hertz = min(best, hertz * 2.0 ** ((STIFFENING if moves() else STIFFENING_AT_REST) * dt))
