"""Worlds too large for the processor's caches go through a substep strip by strip rather than stage by stage: `kernels.fused`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet import _jit
from pyverlet.broadphase import Strips
from pyverlet.collisions import ContactSolver
from pyverlet.constants import FED_SMOOTH, FUSED_FROM, LARGEST_PUSH, PUSHED, REST_ACCELERATIONS
from pyverlet.kernels import fused as kernels
from pyverlet.state import Slots

Array = NDArray[Any]

_APART = 2 * kernels.BEHIND + 2
"""Strips between two borders at least, so that what is left to be done at one has nothing to do with the other."""

_KEPT = 8
"""Strips whose normals a thread keeps at a time: those between the first stage and the last, and one more, in pairs."""


class Fused:
    """Contacts, bounds and velocities of smooth inelastic circles in a smooth cage, and the integration of the next substep.

    Attributes:
        leapt: whether that has been done, too.
    """

    def __init__(self) -> None:
        self.leapt = False
        self._held: Array | None = None
        self._cut = self._place = np.zeros(0, np.int64)
        self._normal = np.empty((2, 0))

    def begin(self, contacts: ContactSolver | None) -> Fused:
        """A frame begins. That before may have been broken off, and the user may have changed everything since."""
        self.leapt = False
        if contacts:
            contacts.broad_phase.spared = False
        return self

    def substep(self, world: Any, contacts: ContactSolver, h: float, lag: float, *, last: bool) -> bool:
        """After the broad phase of a substep of a plain frame; False if nothing has been done: it must go stage by stage.

        last: there is none after it in this frame.
        """
        self.leapt = False
        state: Slots = world._slots
        if len(state) < FUSED_FROM:
            return False
        rest_speed, phase = REST_ACCELERATIONS * world._force_sum.strongest * h, contacts.broad_phase
        room, strips = world.boundary.held(state, h, lag, rest_speed), phase.strips()
        packs = contacts.packs(state) if room else None
        if not (packs and strips):
            return False
        leaps = world.integrator.leaps and not world.onlooker and not last  # who looks on may turn gravity
        self._share_out(strips, packs.lanes, state.dtype)
        pairs, looks = packs.for_fused(state, marks=last)
        moving = (state.position, state.velocity, state.acceleration, state.radius, state.inverse_mass, state.resting, state.hits)
        push = state.reals(FED_SMOOTH / PUSHED / h, LARGEST_PUSH)
        far = state.real(strips.allowed * strips.allowed)
        strayed = kernels.substep(
            self._cut,
            kernels.Bodies(strips.held, *moving, packs.origin, packs.moved, strips.checked),
            kernels.Pairs._make((*pairs, self._place, self._normal)),
            kernels.Rules._make((int(looks), int(leaps), int(last), *push, *room, far)),
        )
        self.leapt = leaps
        phase.spared = leaps and not strayed
        return True

    def _share_out(self, strips: Strips, lanes: Array, dtype: np.dtype[Any]) -> None:
        """Which strips each thread does, as nearly as many lanes as can be, and where each strip keeps its normals."""
        threads = min(_jit.threads_in_use(), max(len(lanes) // (2 * _APART), 1))
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
