"""What of the frames of a plain world is replayed (`_trace`) rather than gone through in Python, and what it depends on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any

from pyverlet.compile.entry import go_on, pause
from pyverlet.compile.jit import threads_in_use
from pyverlet.compile.trace import Trace
from pyverlet.ground.constants import STAGES_FROM
from pyverlet.laws.contacts.collisions import ContactSolver

OPENING, ALIKE, FIRST, NEXT, LAST, CLOSING = range(6)
"""Parts of a frame: gathering until the integrator has begun; substeps, of one kind or three; who rests until the integrator has
ended."""


class Repeats:
    """The parts of a frame of one world, recorded. Whatever may do more than call kernels has it gone through in Python instead.

    Replayed are: integrators and rooms that say so, gravity as the only force, smooth inelastic contacts. Not replayed: links,
    obstacles, events, sleep, a ledger, a look between substeps, substeps strip by strip.
    """

    def __init__(self) -> None:
        self._traces = tuple(Trace() for _ in range(6))

    def frame(self, world: Any, h: float, contacts: ContactSolver | None, done: Callable[[str], None]) -> Frame:
        """A frame begins. `contacts`: those of the world, if it has more than one particle."""
        plain = not (world.forces or world.links or world.obstacles) and done == world.profile.mark
        return Frame(self._traces, plain, world, h, contacts, done)


class Frame:
    """One frame: which of its parts are left to Python.

    What they depend on is asked anew only after Python has been there.

    Attributes:
        plain: whether nothing acts but gravity, contacts and the room, and nobody but the profile is told of stages.
        leans: whether its substeps then differ: in those but the first accelerations are known, the last has more to do.
        done: to be told of the end of the stages of substeps. In a small world that is not recorded: to see what time it is would
            take longer than to call a kernel, and what is replayed there is one stage, `repeats`.
    """

    def __init__(
        self,
        traces: tuple[Trace, ...],
        plain: bool,
        world: Any,
        h: float,
        contacts: ContactSolver | None,
        done: Callable[[str], None],
    ) -> None:
        self.plain = plain
        self._repeats = plain and not world.onlooker and world.integrator.repeats
        self._traces, self._world, self._h, self._contacts = traces, world, h, contacts
        self._known: Hashable = None
        small = len(world) < STAGES_FROM
        self.leans = plain and not small and world.substeps > 1
        self._mark, self._whole = done, self._repeats and small
        self.done = self._done_aside if self._whole else done

    def _done_aside(self, stage: str) -> None:
        recorded = pause()
        self._mark(stage)
        if recorded:
            go_on()

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

    def substeps(self, count: int) -> Iterable[tuple[int, int, bool]]:
        """The substeps that are left to Python, each with its kind and whether the particles have moved already."""
        if self._repeats:
            return self._left(count)
        return ((substep, self._kind(substep, count), False) for substep in range(count))

    def _kind(self, substep: int, count: int) -> int:
        if not self.leans:
            return ALIKE
        return FIRST if substep == 0 else LAST if substep == count - 1 else NEXT

    def _left(self, count: int) -> Iterator[tuple[int, int, bool]]:
        substep = 0
        while substep < count:
            kind = self._kind(substep, count)
            same = count - substep if kind == ALIKE else count - 1 - substep if kind == NEXT else 1
            rounds, begun = self._traces[kind].ahead(same, self._ask())
            if (rounds or begun) and self._whole:
                self._mark("repeats")
            substep += rounds
            if rounds and self._contacts:
                self._contacts.broad_phase.aged(rounds)
            if rounds == same:
                continue
            for trace in self._traces:  # what they are about may be replaced now, and need not be held meanwhile
                trace.forget(but=None if begun else self._ask())
            if begun or self._ask() is None:
                yield substep, kind, begun
                self._known = None
            else:
                with self.noted(kind):
                    yield substep, kind, False
            substep += 1


def _key(world: Any, h: float, contacts: ContactSolver | None) -> Hashable:
    """What a frame depends on; None if its parts may be other calls."""
    state, room = world._slots, world.boundary.repeats()
    pairs = contacts.repeats(state) if contacts else ()
    if room is None or pairs is None or world._h_last != h:
        return None
    arrays = id(state.position), id(state.acceleration), id(state.radius), id(state._given["radius"])
    return h, world.substeps, world.gravity, world.integrator, room, pairs, world._state.version, arrays, threads_in_use()
