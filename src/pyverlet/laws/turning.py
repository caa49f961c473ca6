"""A round wall that turns: kernels know walls at rest, so they are given the spins that circles have as seen from it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from pyverlet.state.slots import Slots


@contextmanager
def surface(state: Slots, speed: float, h: float) -> Iterator[None]:
    """Inside, who touches the wall rubs against a surface that runs at `speed`, m/s, counter-clockwise around the room.

    A disc of radius r slips on a wall at rest by s = v_t + r w. On one that runs at u it slips by v_t + r w - u, which is what a
    disc of spin w - u / r does on the wall at rest; the same goes for what it has slipped in a substep. Impulses change spins
    by as much as they would. Kernels therefore get spins less u / r, and circles what became of them. Where somebody keeps
    account, `state.worked` gains the work of the wall: an impulse J along it changes a spin by 2 J / (m r) and does the work J u.
    """
    less = (speed / state.radius.astype(np.float64)).astype(state.dtype)
    spin, turn = state.spin.copy(), state.turn.copy()
    state.spin -= less
    state.turn -= state.real(h) * less[: len(turn)]
    seen, seen_turn = state.spin.copy(), state.turn.copy()
    yield
    changed = np.flatnonzero(state.spin != seen)  # of all others not even the rounding may change
    gained = state.spin[changed].astype(np.float64) - seen[changed]
    turned = state.turn - seen_turn
    state.spin[:] = spin
    state.spin[changed] += gained.astype(state.dtype)
    state.turn[:] = turn + turned
    if len(state.spent):
        state.worked += float(np.sum(0.5 * state.mass[changed].astype(np.float64) * state.radius[changed] * gained) * speed)
