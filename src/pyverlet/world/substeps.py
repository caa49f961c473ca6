"""Substeps that need nothing of Python: gone through in one call (`kernels.frame`), until somebody wants to look.

Under gravity, forces that a few numbers describe, and functions that are compiled, a call goes on until the list of pairs may be
stale or the frame is over. Where other forces, or who looks on, are asked in every substep, it is what comes after the
integration of one. Smooth worlds too large for the processor's caches go strip by strip (`kernels.fused`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile import clock, jit
from pyverlet.compile.bundle import hold
from pyverlet.ground.constants import FUSED_FROM
from pyverlet.kernels import drive, frame, fused
from pyverlet.laws.contacts import _held_rooms
from pyverlet.laws.contacts._held import claims, first_leap
from pyverlet.laws.contacts._held_course import HeldCourse
from pyverlet.laws.contacts.broadphase import Strips
from pyverlet.laws.contacts.solver import ContactSolver
from pyverlet.laws.contacts.wide import Wide

Array = NDArray[Any]

_APART = 2 * fused.BEHIND + 2
"""Strips between two borders at least, so that what is left to be done at one has nothing to do with the other."""

_KEPT = 8
"""Strips whose normals a thread keeps at a time: those between the first stage and the last, and one more, in pairs."""


_OF_LENT_AND_LINKED = frame.JOINED, frame.PULLED
"""Parts in which contacts have nothing to do but for linked circles that borrow inertia."""


_UNLINKED = (), (), ()
"""What kernels are handed in place of `kernels.linked`'s."""


def _linked(world: Any) -> str:
    """Which kernels go through a world with links."""
    return "few_linked" if world.links.stand_back else "linked"


class Substeps:
    """The substeps of one frame of a world after another.

    Attributes:
        substep: the one that is next.
        leapt: whether its integration has been done already.
        marked: whether the last substep has marked who rests.
    """

    def __init__(self) -> None:
        self.substep, self.leapt, self.marked = 0, False, False
        self._out: Array | None = None  # `moved` of the pairs that has been set out for this substep
        self._held: Array | None = None
        self._cut = self._place = np.zeros(0, np.int64)
        self._normal = np.empty((2, 0))
        self._books: Any = None
        self._rows: Any = None  # forces, as numbers, and the dtype of the table made of them
        self._table: tuple[Array, ...] = ()
        self.parts: list[Any] = []  # what looks at particles before each substep
        self._forces: Any = None
        self._beside: Any = None
        self._course: HeldCourse | None = None

    def course(self, world: Any) -> HeldCourse:
        """The obstacles of a world as kernels have them."""
        if self._course is None or self._course.course is not world._course:
            self._course = HeldCourse(world._course)
        return self._course

    def begin(self, contacts: ContactSolver | None, course: Any) -> Substeps:
        """A frame begins. That before may have been broken off, and the user may have changed everything since."""
        self.substep, self.leapt, self.marked, self._out = 0, False, False, None
        self.parts = [part for part in (contacts, course) if part]
        if contacts:
            contacts.broad_phase.strayed = None
        return self

    def tells(self, done: Callable[[str], None], mark: Callable[[str], None]) -> bool:
        """Whether who is told of the stages of a frame can be told later: it is but the clock, `mark`, or sums of energies."""
        return done == mark

    def open(self, world: Any, contacts: ContactSolver | None, h: float, lag: float) -> bool:
        """Go from before the integration of `substep`, if there are contacts and that may be; else links note where it starts."""
        if contacts and self.go(world, contacts, h, lag, opens=True):
            return True
        if world.links:
            world.links.before(world._slots, h)
        return False

    def go(self, world: Any, contacts: ContactSolver, h: float, lag: float, *, opens: bool = False) -> bool:
        """From after the integration of `substep`, whose list is good, as far as it goes.

        opens: from before it, if the list was good so far. False: nothing has been done, for there is more to it than kernels.
        """
        state, forces, books, substep = world._slots, world._force_sum, self._books, self.substep
        # Who looks on may turn gravity, and see what a ledger sees.
        leaps = world.integrator.leaps and not (world.onlooker or forces.forces)
        if opens and not (leaps and contacts.keeps(state)):
            return False
        out, self._out, self.leapt = self._out, None, False
        strips, room = contacts.steady(state), world.boundary
        if strips is None or _held_rooms.compiled(room, state) is None or not (obstacles := self.course(world)).still:
            return False
        links: Any = world.links.compiled(state, h) if world.links else ()
        if opens:  # as far as is known now the list is good
            contacts.broad_phase.aged(1)
            world.profile.mark("broad phase")
        if course := obstacles if world._course else None:
            course.set_up(state, substep * h, h)
        if opens:
            forces.fall(state)
        wide = contacts.set_up(state, h, lag, forces.strongest, world.links if links else None)
        walls, shape = _held_rooms.compiled(room, state) or (frame.OPEN, _held_rooms.NOWHERE)  # that circles rub is known by now
        lends = contacts.lends
        if smooth := walls == frame.SMOOTH_CAGE and not (links or lends):
            wide.leave_arriving()
        last = world.substeps - 1
        kind = "served" * bool(course or books or lends)
        if links:
            kind = _linked(world)
        if smooth and not (kind or wide.asks) and len(state) >= FUSED_FROM and strips.in_order:
            self._strip_by_strip(world, contacts, wide, strips, shape, leaps=leaps, opens=opens)
            return True
        beside: Any = ()
        services: Any = ()
        if kind:
            about = obstacles.compiled(state, room), contacts.lent(), links
            beside, services = self._services(world, books, (), *about, h, lag)
        stop, sets_out = world.substeps if leaps else substep + 1, not opens and (lends or out is not wide.moved)
        begin = (wide.takes_looks(), int(sets_out), int(opens), frame.WHOLE, *state.reals(*forces.gravity))
        reached, self.leapt, _ = frame.frames[kind][wide.kind](
            substep, stop, last, wide.circles, wide.packed, wide.law, (walls, *state.reals(*shape)), beside, tuple(services),
            (), wide.cut(), begin, strips.checked, state.real(strips.allowed * strips.allowed),
            claims(state), world.profile.spent, (clock.address(), clock.tick()),
        )  # fmt: skip
        if books:
            books.read(services.energies, substep, reached, opens=opens)
        self.marked = reached > last
        if self.marked or reached == substep:
            wide.look_anew()
        if self.leapt:
            contacts.broad_phase.strayed, self._out = True, wide.moved
        contacts.broad_phase.aged(reached - substep - 1)
        self.substep = int(reached)
        return True

    # ---- stage by stage ------------------------------------------------------------------------------------------------------

    def touch(self, world: Any, contacts: ContactSolver, h: float, lag: float) -> None:
        """Impacts bounce, other overlapping circles are moved apart and grip each other."""
        contacts.pegs.before(world._slots, h)
        contacts.set_up(world._slots, h, lag, world._force_sum.strongest, world.links or None)
        self._do(frame.TOUCHED, world, contacts, h, lag)

    def solve(self, world: Any, contacts: ContactSolver | None, h: float, lag: float, done: Callable[[str], None]) -> None:
        """Links move their circles; after that it is walls that change velocities."""
        world.links.solve(world._slots, h)
        done("links")
        if contacts:
            world.links.lay_down(world._slots, h)
            self._do(frame.JOINED, world, contacts, h, lag)

    def still(self, world: Any, contacts: ContactSolver, h: float, lag: float) -> None:
        """Take from touching circles the velocity that `touch` has put in, rub them, and hold who is too large for a gap."""
        self._do(frame.STILLED, world, contacts, h, lag)
        contacts.pegs.hold(world._slots)

    def note_pull(self, world: Any, contacts: ContactSolver | None, h: float, lag: float) -> None:
        """What links pulled with is part of accelerations, and momentum is to be kept by that, too."""
        world.links.after(world._slots, h)
        if contacts:
            self._do(frame.PULLED, world, contacts, h, lag)

    def _do(self, part: np.int64, world: Any, contacts: ContactSolver, h: float, lag: float) -> None:
        """What contacts do in one part of a substep, as `kernels.frame` names them."""
        lends = contacts.lends
        if part in _OF_LENT_AND_LINKED and not lends:
            return
        state, links = world._slots, world.links.compiled(world._slots, h) if world.links else ()
        beside: Any = ()
        services: Any = ()
        if kind := _linked(world) if links else "served" * lends:
            about = self.course(world).nothing(state), contacts.lent(), links
            beside, services = self._services(world, None, (), *about, h, lag)
        contacts.wide.do(part, state, kind, beside, tuple(services))

    def _services(
        self, world: Any, books: Any, rows: Any, obstacles: Any, loans: Any, links: Any, h: float, lag: float
    ) -> tuple[Any, Any]:
        """What the world has beside circles, a room and gravity: `books`, `rows` of forces, obstacles, loans, links."""
        state, gravity = world._slots, world._force_sum.gravity
        if self._rows != (rows, state.dtype):
            self._rows = rows, state.dtype
            kind, vector, number = zip(*rows, strict=True) if rows else ((), (), ())
            self._table = (
                np.array(kind, np.int64), np.array(vector, state.dtype).reshape(-1, 2),
                np.array(number, state.dtype).reshape(-1, drive.NUMBERS),
            )  # fmt: skip
        self._forces = hold(drive.Forces, (*self._table, state.force, state.mass, state.resistance), self._forces)
        ahead = world.integrator.velocity_lag * h if world._force_sum.velocity_dependent else 0.0
        (course, cells), (*lent, terms), (*linked, linking) = obstacles, loans, links or _UNLINKED
        self._beside = hold(frame.Beside, (self._forces, course, *lent, *linked), self._beside)
        return self._beside, frame.Services(
            h, lag, gravity, state.reals(*state.seam.period), state.real(ahead), cells, state.drop, terms, linking,
            np.empty((world.substeps if books else 0, frame.LOOKS)), world.time,
        )  # fmt: skip

    def _strip_by_strip(
        self, world: Any, contacts: ContactSolver, wide: Wide, strips: Strips, room: Any, *, leaps: bool, opens: bool
    ) -> None:
        """One substep, with its integration if it `opens`, and that of the next if it `leaps`."""
        state, last = world._slots, world.substeps - 1
        far = state.real(strips.allowed * strips.allowed)
        if opens:
            self.leapt = first_leap(state, world.gravity, state.h, strips.checked, far, wide.origin, wide.moved)
            world.profile.mark("integrate")
            if self.leapt:
                contacts.broad_phase.strayed, self._out = True, wide.moved
                contacts.broad_phase.aged(-1)
                return
        self._share_out(strips, wide.lanes, state.dtype)
        self.leapt, self.marked = leaps and self.substep < last, self.substep == last
        about = (strips.held, self._place, wide.takes_looks(), int(self.leapt), int(self.marked), strips.checked, far)
        pairs, room = wide.striped(self._normal), tuple(map(state.real, room[:3]))
        strayed = fused.substep(self._cut, wide.circles, pairs, wide.law, room, about)
        contacts.broad_phase.strayed = bool(strayed) if self.leapt else None
        if self.marked:
            wide.look_anew()
        world.profile.mark("fused")
        self.substep += 1

    def _share_out(self, strips: Strips, lanes: Array, dtype: np.dtype[Any]) -> None:
        """Which strips each thread does, as nearly as many lanes as can be, and where each strip keeps its normals."""
        threads = min(jit.threads_in_use(), max(len(lanes) // (2 * _APART), 1))
        if self._held is strips.held and len(self._cut) == threads + 1:
            return
        self._held = strips.held
        before = np.cumsum(lanes)
        self._cut = np.searchsorted(before, np.linspace(0, before[-1], threads + 1)) // 2 * 2
        self._cut[[0, -1]] = 0, len(lanes)
        for part in range(1, threads):  # one strip may have most of the lanes
            self._cut[part] = max(self._cut[part], self._cut[part - 1] + _APART)
        for part in range(threads - 1, 0, -1):
            self._cut[part] = min(self._cut[part], (self._cut[part + 1] - _APART) // 2 * 2)
        strip, widest = np.arange(len(lanes)), int(lanes.max())
        slot = strip % _KEPT + _KEPT * (np.searchsorted(self._cut[1:-1], strip, side="right"))
        for border in self._cut[1:-1]:  # those that wait for it
            near = slice(border - fused.BEHIND, border + fused.BEHIND)
            slot[near] = np.arange(near.stop - near.start) + slot.max() + 1
        self._place = slot * widest
        self._normal = np.empty((2, int(self._place.max(initial=0)) + widest), dtype)
