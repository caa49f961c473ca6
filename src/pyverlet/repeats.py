"""What of the frames of a small world is replayed (`_trace`) rather than gone through in Python, and what it depends on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Iterable, Iterator
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
        plain = not (world.forces or world.links or world.obstacles) and done == world.profile.mark
        return Frame(self._traces, plain, world, h, contacts)


class Frame:
    """One frame: which of its parts are left to Python.

    What they depend on is asked anew only after Python has been there.

    Attributes:
        plain: whether nothing acts but gravity, contacts and the room, and nobody but the profile is told of stages.
    """

    def __init__(self, traces: tuple[Trace, ...], plain: bool, world: Any, h: float, contacts: ContactSolver | None) -> None:
        self.plain = plain
        self._repeats = plain and not world.onlooker and len(world) < REPEAT_BELOW and world.integrator.repeats
        self._traces, self._world, self._h, self._contacts = traces, world, h, contacts
        self._known: Hashable = None

    def _ask(self) -> Hashable:
        if self._known is None and self._repeats:
            self._known = _key(self._world, self._h, self._contacts)
        return self._known

    def made(self, part: int) -> bool:
        """Replay the opening or the closing; False if Python has to make it, all of it."""
        return self._traces[part].once(self._ask())

    @contextlib.contextmanager
    def noted(self, part: int) -> Iterator[None]:
        """Python makes a part: record that, if it may be."""
        with self._traces[part].recording(self._ask):
            yield
            self._known = None

    def substeps(self, count: int) -> Iterable[tuple[int, bool]]:
        """The substeps that are left to Python, each with whether the particles have moved already."""
        if not self._repeats:
            return ((substep, False) for substep in range(count))
        done, begun = self._ahead(count)
        return self._left(done, begun, count) if done < count else ()

    def _left(self, done: int, begun: bool, count: int) -> Iterator[tuple[int, bool]]:
        while done < count:
            if begun or self._ask() is None:
                yield done, begun
                self._known = None
            else:
                with self.noted(SUBSTEP):
                    yield done, False
            rounds, begun = self._ahead(count - done - 1)
            done += 1 + rounds

    def _ahead(self, count: int) -> tuple[int, bool]:
        rounds, begun = self._traces[SUBSTEP].ahead(count, self._ask())
        if rounds or begun:
            self._replayed(rounds)
        return rounds, begun

    def _replayed(self, substeps: int) -> None:
        if self._contacts:
            self._contacts.broad_phase.aged(substeps)
        self._world.profile.mark("repeats")


def _key(world: Any, h: float, contacts: ContactSolver | None) -> Hashable:
    """What a frame depends on; None if its parts may be other calls."""
    state, room = world._slots, world.boundary.repeats()
    pairs = contacts.repeats(state) if contacts else ()
    if room is None or pairs is None or world._h_last != h:
        return None
    arrays = id(state.position), id(state.acceleration), id(state.radius), id(state._given["radius"])
    return h, world.substeps, world.gravity, world.integrator, room, pairs, world._state.version, arrays
