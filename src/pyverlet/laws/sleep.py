"""Circles at rest sleep until something touches them: `World(sleep=True)`.

Circles connected by contacts are an island. An island that has been at rest for a while falls asleep as a whole: its circles stop
and count as pinned, so that pairs among them are not even listed. It wakes as a whole, in the same substep, when an awake
particle touches one of them; and before a frame in which the user has moved, changed or removed one of them. All wake when the
user has changed a law of the world, an obstacle or a pinned particle.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import SLEEP_AFTER_S, SLEEP_NEAR, SLEEP_SPEED
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.forces import Drag
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import MARKS, ROWS, SET, State

_OF_PINNED = ("number", *ROWS[:2], *SET, *MARKS)
_NONE_PINNED = (b"",) * len(_OF_PINNED)

OTHER_LAWS = ((), ())
"""Of a world whose laws have changed since the last frame."""


class Sleep:
    """Puts islands of one world to sleep and wakes them. `SortedState.island` has the number of a sleeper's island; -1: awake."""

    def __init__(self) -> None:
        self._next = 0  # number of the next island
        self._laws: Any = None
        self._pinned: Any = None  # pinned particles at the start of the last frame; None: unknown
        self._stands = False  # whether none of them moves
        self._members: dict[int, int] = {}  # size of each island when it fell asleep

    def copy(self, laws: Any) -> Sleep:
        """An independent copy; `laws` are the current ones. Where they are not those of the last frame all are to wake."""
        other = Sleep()
        other._next, other._pinned, other._members = self._next, self._pinned, dict(self._members)
        other._laws = self._laws if self._laws in (None, laws) else OTHER_LAWS
        return other

    def take(self, other: Sleep, laws: Any) -> None:
        """Copy the state of another object; `laws` are the current ones, with obstacles back at their saved places."""
        self._next, self._laws, self._pinned, self._members = other._next, other._laws, other._pinned, dict(other._members)
        self._stands = False
        if laws and other._laws and laws[:-1] == other._laws[:-1]:
            self._laws = laws

    def begin(self, sorted_state: SortedState, state: State, laws: Any) -> bool:
        """Prepare a new frame, before rows gather the state. Returns whether any particle woke."""
        changed, pinned = any(sorted_state.look(state)) or sorted_state.is_new, self._pinned
        if changed or not self._stands:
            pinned = _pinned(state)
            self._stands = not np.frombuffer(pinned[2], np.uint8).any()  # their velocities
        same = laws == self._laws and self._pinned in (None, pinned)
        self._laws, self._pinned = laws, pinned
        if not self._members:
            return False
        if not same:
            return self._wake(sorted_state, sorted_state.island >= 0)
        if not changed:
            return False
        edited = sorted_state.edited(state) & (sorted_state.island >= 0)
        if sorted_state.is_new:  # some have been removed
            number, left = np.unique(sorted_state.island, return_counts=True)
            fewer = [k for k, n in zip(number.tolist(), left.tolist(), strict=True) if n != self._members.get(k, n)]
            edited |= np.isin(sorted_state.island, fewer)
        return bool(edited.any()) and self.wake(sorted_state, edited)

    @property
    def anyone(self) -> bool:
        """Whether any particle sleeps."""
        return len(self._members) > 0

    def all_asleep(self, sorted_state: SortedState) -> bool:
        """Whether nothing can move."""
        return self.anyone and not len(sorted_state.free)

    def look_again(self, state: State, laws: Any) -> None:
        """After frames of the core alone, where no particle slept: save what `begin` saves of laws and pinned particles."""
        self._laws, self._pinned = laws, _pinned(state)

    @property
    def is_plain(self) -> bool:
        """Whether the core can make frames by itself: particles may sleep, and if any does, no pinned particle moves."""
        return self._laws is not None and (self._stands or not self.anyone)

    def wake(self, sorted_state: SortedState, touched: Array) -> bool:
        """Wake islands with a touched particle: (n,) 1. Returns whether there were any: then the list lacks pairs."""
        return self._wake(
            sorted_state, np.isin(sorted_state.island, sorted_state.island[(touched == 1) & (sorted_state.island >= 0)])
        )

    def end(self, sorted_state: SortedState, begun: Array, pairs: tuple[Array, ...], dt: float, gravity: float) -> bool:
        """At the end of a frame of dt seconds: put islands at rest long enough to sleep. Returns whether there were any.

        begun: (n, 2) m, the user's positions at its start: separating circles move, although their velocities are 0.
        pairs: (first, count, i, j), those closer than a skin; those of row s are count[s] from first[s] on.
        """
        awake = (sorted_state.velocity, sorted_state.spin, sorted_state.radius, sorted_state.free)
        long_at_rest = sorted_state.motion.time_at_rest(
            *awake, SLEEP_SPEED**2 * gravity, dt, SLEEP_AFTER_S, sorted_state.sleep_timer
        )
        if self._laws is None or not long_at_rest:
            return False
        way = sorted_state.periodic.nearest(sorted_state.position - begun[sorted_state.particle])
        sorted_state.sleep_timer[(way**2).sum(axis=1) > (0.4 * SLEEP_SPEED * dt) ** 2 * gravity * sorted_state.radius] = 0
        root = np.empty(len(sorted_state), np.int64)
        bodies = (
            sorted_state.position,
            sorted_state.radius,
            *sorted_state.periodic.period,
            sorted_state.inverse_mass,
            sorted_state.sleep_timer,
        )
        sorted_state.motion.find_islands(*bodies, pairs, SLEEP_NEAR, SLEEP_AFTER_S, root)
        sleeper = root >= 0
        if not sleeper.any():
            return False
        sorted_state.island[sleeper] = self._next + root[sleeper]
        self._next += len(sorted_state)
        number, members = np.unique(sorted_state.island[sleeper], return_counts=True)
        self._members |= dict(zip(number.tolist(), members.tolist(), strict=True))
        for array in (sorted_state.velocity, sorted_state.acceleration, sorted_state.spin):
            array[sleeper] = 0
        sorted_state.update_inverse_mass()
        return True

    def _wake(self, sorted_state: SortedState, which: Array) -> bool:
        if not which.any():
            return False
        for island in np.unique(sorted_state.island[which]):
            del self._members[int(island)]
        sorted_state.island[which] = -1
        sorted_state.sleep_timer[which] = 0
        sorted_state.update_inverse_mass()
        return True


def laws(world: Any) -> Any:
    """The state on which sleep depends: when it changes all wake. None if nothing may sleep.

    That is with links, moving obstacles, and forces that may change with time: all but gravity and drag.
    """
    world._obstacle_arrays.begin()
    moving = world.boundary.moves or world._obstacle_arrays.drives
    if world.links or moving or not all(type(force) is Drag for force in world.forces):
        return None
    rules = list(map(repr, world._rules))
    boundary, solids = world.boundary, world._obstacle_arrays.solid_version
    return world.gravity, _facts(boundary), boundary.extent(), world.collisions, rules, solids


def _facts(boundary: Boundary) -> tuple[type, str]:
    """The public attributes of a room, exactly."""
    return type(boundary), repr(sorted((name, value) for name, value in vars(boundary).items() if not name.startswith("_")))


def _pinned(state: State) -> tuple[bytes, ...]:
    """The properties of pinned particles on which sleep depends, bit by bit."""
    which = np.flatnonzero(np.isinf(state.shown["mass"]))
    if not len(which):
        return _NONE_PINNED
    return tuple(state.shown[name][which].tobytes() for name in _OF_PINNED)
