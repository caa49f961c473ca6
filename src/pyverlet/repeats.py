"""Which substeps of a small world are replayed (`_trace`) rather than gone through in Python, and what they depend on."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from functools import partial
from typing import Any

from pyverlet._trace import Trace
from pyverlet.collisions import ContactSolver
from pyverlet.constants import REPEAT_BELOW


class Repeats:
    """The substep of one world, recorded. Whatever may do more than call kernels has it gone through in Python instead.

    Replayed are: integrators and rooms that say so, gravity as the only force, smooth inelastic contacts. Not replayed: links,
    obstacles, events, sleep, a ledger, a look between substeps.
    """

    def __init__(self) -> None:
        self._trace = Trace()

    def substeps(
        self, world: Any, h: float, contacts: ContactSolver | None, done: Callable[[str], None]
    ) -> Iterator[tuple[int, bool]]:
        """The substeps of a frame that are left to Python, each with whether the particles have moved already."""
        plain = not (world.forces or world.links or world.obstacles or world.onlooker) and done == world.profile.mark
        if not plain or len(world) >= REPEAT_BELOW or not world.integrator.repeats:
            return ((substep, False) for substep in range(world.substeps))
        return self._trace.rounds(world.substeps, partial(_key, world, h, contacts), partial(_replayed, world, contacts))


def _key(world: Any, h: float, contacts: ContactSolver | None) -> Hashable:
    """What a substep depends on; None if the next may be other calls."""
    state, room = world._slots, world.boundary.repeats()
    pairs = contacts.repeats(state) if contacts else ()
    if room is None or pairs is None:
        return None
    return h, world.gravity, world.integrator, room, pairs, id(state.position), id(state.acceleration), id(state.radius)


def _replayed(world: Any, contacts: ContactSolver | None, substeps: int) -> None:
    if contacts:
        contacts.broad_phase.aged(substeps)
    world.profile.mark("repeats")
