"""Substeps under gravity with smooth inelastic contacts only: loops are fused, so that threads meet less and memory is read less.

Worlds too large for the processor's caches go strip by strip (`kernels.fused`). In others the stages remain, but circles arrive
where contacts have moved them when the wall holds them, and from the second substep on are integrated and set out all at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile import jit
from pyverlet.ground.constants import FUSED_FROM, REST_ACCELERATIONS
from pyverlet.kernels import fused as kernels
from pyverlet.laws.contacts.broadphase import Strips
from pyverlet.laws.contacts.collisions import ContactSolver
from pyverlet.laws.contacts.wide import Wide
from pyverlet.laws.rooms import hold
from pyverlet.state.moves import leap
from pyverlet.state.state import Slots

Array = NDArray[Any]

ALIKE, FIRST, NEXT, LAST = range(4)
"""Kinds of substeps: where something acts beside gravity, contacts and the room all are alike. Elsewhere accelerations are known
in all but the first, and the last has more to do."""

_APART = 2 * kernels.BEHIND + 2
"""Strips between two borders at least, so that what is left to be done at one has nothing to do with the other."""

_KEPT = 8
"""Strips whose normals a thread keeps at a time: those between the first stage and the last, and one more, in pairs."""


def kind_of(substep: int, count: int) -> int:
    """What kind a substep is of, where nothing acts but gravity, contacts and the room."""
    if count == 1:
        return ALIKE
    return FIRST if substep == 0 else LAST if substep == count - 1 else NEXT


class Fused:
    """Contacts, bounds and velocities of smooth inelastic circles, and the integration of a substep that is not the first.

    Attributes:
        leapt: whether the integration of the next substep has been done already.
    """

    def __init__(self) -> None:
        self.leapt = False
        self._gravity: tuple[float, float] | None = None  # what accelerates in all substeps of the frame; None: not the same
        self._out: Array | None = None  # `moved` of the packs that has been set out for this substep
        self._held: Array | None = None
        self._cut = self._place = np.zeros(0, np.int64)
        self._normal = np.empty((2, 0))

    def begin(self, gravity: tuple[float, float], contacts: ContactSolver | None) -> Fused:
        """A frame begins. That before may have been broken off, and the user may have changed everything since."""
        self.leapt, self._gravity, self._out = False, gravity, None
        if contacts:
            contacts.broad_phase.strayed = None
        return self

    def leap(self, world: Any, contacts: ContactSolver | None, h: float, kind: int) -> bool:
        """Integrate a substep of this kind, and set out for its contacts; False if that cannot be done in one loop."""
        if world.gravity != self._gravity:  # who looks on has turned it
            self._gravity = None
        if kind not in (NEXT, LAST) or not (self._gravity and world.integrator.leaps and contacts):
            return False
        if not (pairs := contacts.packs(world._slots)):
            return False
        packs, strips = pairs
        where = strips.checked, strips.allowed, packs.origin, packs.moved
        contacts.broad_phase.strayed, self._out = leap(world._slots, h, *where), packs.moved
        return True

    def substep(self, world: Any, contacts: ContactSolver, h: float, lag: float, done: Callable[[str], None], kind: int) -> bool:
        """After the broad phase of a substep of a plain frame; False if nothing has been done: there is more to it."""
        out, self._out, self.leapt = self._out, None, False
        state = world._slots
        pairs = contacts.packs(state)
        if not pairs:
            return False
        wide, strips = contacts.set_up(state, h, lag, world._force_sum.strongest), pairs[1]
        rest_speed = REST_ACCELERATIONS * world._force_sum.strongest * h
        room = world.boundary.held(state, h, lag, rest_speed)
        if len(state) >= FUSED_FROM and strips.in_order and room:
            self.leapt = kind in (FIRST, NEXT) and world.integrator.leaps and not world.onlooker  # who looks on may turn gravity
            strayed = self._strip_by_strip(state, wide, strips, room, leaps=self.leapt, marks=kind == LAST)
            contacts.broad_phase.strayed = strayed if self.leapt else None
            done("fused")
            return True
        wide.push(state, sets_out=out is not wide.moved, arrives=not room)  # another after a new list
        done("contacts")
        if room:
            hold(state, room, (wide.origin, wide.moved, wide.law.feed))
        else:
            world.boundary.confine(state, h, lag, rest_speed)
        done("bounds")
        wide.relax(state, marks=kind == LAST)
        done("velocities")
        return True

    def _strip_by_strip(
        self, state: Slots, wide: Wide, strips: Strips, room: tuple[Any, ...], *, leaps: bool, marks: bool
    ) -> bool:
        """All of it at once. Returns whether anyone has strayed."""
        self._share_out(strips, wide.lanes, state.dtype)
        (x0, y0, size, _, _, rest_speed), far = room, state.real(strips.allowed * strips.allowed)
        strayed = kernels.substep(
            self._cut,
            *wide.fused(self._normal, marks=marks),
            kernels.Room(x0, y0, size, rest_speed, state.radius, state.hits),
            kernels.Strips(strips.held, self._place, int(leaps), int(marks), strips.checked, far),
        )
        return bool(strayed)

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
            near = slice(border - kernels.BEHIND, border + kernels.BEHIND)
            slot[near] = np.arange(near.stop - near.start) + slot.max() + 1
        self._place = slot * widest
        self._normal = np.empty((2, int(self._place.max(initial=0)) + widest), dtype)
