"""What of the frames of a small world is replayed (`_trace`) rather than gone through in Python, and what it depends on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Iterator
from functools import partial
from typing import Any

from pyverlet._trace import Trace
from pyverlet.collisions import ContactSolver
from pyverlet.constants import REPEAT_BELOW

OPENING, SUBSTEP, CLOSING = range(3)
"""Parts of a frame: gathering until the integrator has begun, a substep, who rests until the integrator has ended."""


class Repeats:
    """The parts of a frame of one world, recorded. Whatever may do more than call kernels has it gone through in Python instead.

    Replayed are: integrators and rooms that say so, gravity as the only force, smooth inelastic contacts. Not replayed: links,
    obstacles, events, sleep, a ledger, a look between substeps.
    """

    def __init__(self) -> None:
        self._traces = Trace(), Trace(), Trace()

    def frame(self, world: Any, h: float, contacts: ContactSolver | None, done: Callable[[str], None]) -> Frame:
        """A frame begins. `contacts`: those of the world, if it has more than one particle."""
        plain = not (world.forces or world.links or world.obstacles or world.onlooker) and done == world.profile.mark
        if not plain or len(world) >= REPEAT_BELOW or not world.integrator.repeats:
            return Frame(self._traces, None, _nothing)
        return Frame(self._traces, partial(_key, world, h, contacts), partial(_replayed, world, contacts))


class Frame:
    """One frame: which of its parts are left to Python.

    What they depend on is asked anew only after Python has been there.
    """

    def __init__(self, traces: tuple[Trace, ...], key: Callable[[], Hashable] | None, replayed: Callable[[int], None]) -> None:
        self._traces, self._key, self._replayed = traces, key, replayed
        self._known: Hashable = None

    def _ask(self) -> Hashable:
        if self._known is None and self._key is not None:
            self._known = self._key()
        return self._known

    def made(self, part: int) -> bool:
        """Replay the opening or the closing; False if Python has to make it, all of it."""
        return self._traces[part].once(self._ask())

    @contextlib.contextmanager
    def noted(self, part: int) -> Iterator[None]:
        """Python makes the opening or the closing: record that, if it may be."""
        with self._traces[part].recording(self._ask):
            yield
            self._known = None

    def substeps(self, count: int) -> Iterator[tuple[int, bool]]:
        """The substeps that are left to Python, each with whether the particles have moved already."""
        if self._key is None:
            yield from ((substep, False) for substep in range(count))
            return
        for substep in self._traces[SUBSTEP].rounds(count, self._ask, self._replayed):
            yield substep
            self._known = None


def _key(world: Any, h: float, contacts: ContactSolver | None) -> Hashable:
    """What a frame depends on; None if its parts may be other calls."""
    state, room = world._slots, world.boundary.repeats()
    pairs = contacts.repeats(state) if contacts else ()
    if room is None or pairs is None or world._h_last != h:
        return None
    arrays = id(state.position), id(state.acceleration), id(state.radius), id(state._given["radius"])
    return h, world.gravity, world.integrator, room, pairs, world._state.version, arrays


def _nothing(_: int) -> None:
    pass


def _replayed(world: Any, contacts: ContactSolver | None, substeps: int) -> None:
    if contacts:
        contacts.broad_phase.aged(substeps)
    world.profile.mark("repeats")
