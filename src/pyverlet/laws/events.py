"""What happened between particles in a frame: contacts that began or ended, and how hard they hit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.kernels import events as kernels
from pyverlet.laws.contacts.broadphase import PairList
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.state import Slots, State

Array = NDArray[Any]

WALL = -1
"""In the place of b: a wall of the bounds, or an obstacle."""

CONTACT = np.dtype([("a", np.int64), ("b", np.int64)])
"""Indices a < b of two particles; or a and WALL."""

_LOWER = 0xFFFFFFFF
"""Bits of a key that are b + 1, of two particles' a < b; 0 is a wall. The others are a."""

HIT = np.dtype([("a", np.int64), ("b", np.int64), ("speed", np.float64)])
"""The same, and the normal speed they met with, m/s."""


class Events:
    """Contacts of the last frame, as structured arrays sorted by a, then b. Those who touch in any substep touch in the frame.

    In a pile that comes to rest, contacts without weight may end and begin again.

    Attributes:
        begin: CONTACT, those who touch now and did not in the frame before.
        end: CONTACT, those who did and do not now; without those of removed particles.
        hit: HIT, those of `begin` who met with at least `hit_speed`.
    """

    def __init__(self) -> None:
        self._hit_speed = 1.0
        self.begin = self.end = np.empty(0, CONTACT)
        self.hit = np.empty(0, HIT)
        self._touching = np.empty(0, np.int64)  # keys, sorted
        self._keys: list[Array] = []
        self._speeds: list[Array] = []

    @property
    def hit_speed(self) -> float:
        """Slower contacts begin without being hits, m/s; 1 unless set."""
        return self._hit_speed

    @hit_speed.setter
    def hit_speed(self, value: float) -> None:
        self._hit_speed = checks.number("hit_speed", value, least=0.0)

    def copy(self) -> Events:
        """Another one with the same memory."""
        other = Events()
        other.take(self)
        return other

    def take(self, other: Events) -> None:
        """Remember what the other does."""
        self._hit_speed, self._touching = other._hit_speed, other._touching
        self.begin, self.end, self.hit = other.begin, other.end, other.hit

    # ---- what the engine tells ---------------------------------------------------------------------------------------

    def listen(self, state: Slots, pairs: PairList, lag: float) -> None:
        """After the broad phase, before contacts change a velocity: who overlaps, and how fast do they meet?"""
        which = pairs.listed()
        kernels.listen(
            state.position, state.velocity, state.acceleration, state.size, state.real(lag), *which, pairs.closing
        )  # fmt: skip

    def collect(self, state: Slots, pairs: PairList | Wide) -> None:
        """The list of pairs is about to change, or the frame ends: keep what was heard."""
        room = int(pairs.listed()[1].sum())
        keys, speeds = np.empty(room, np.int64), np.empty(room)
        which = pairs.listed()
        found = kernels.heard(*which, pairs.closing, state.particle, keys, speeds)
        self._keys.append(keys[:found])
        self._speeds.append(speeds[:found])

    def forget(self) -> None:
        """A frame begins, or begins again."""
        self._keys, self._speeds = [], []

    def close(self, slots: Slots, state: State) -> None:
        """The frame has gone well: what was heard is what happened."""
        at_wall = slots.hits >= 0
        self._keys.append(slots.particle[at_wall].astype(np.int64) << 32)
        self._speeds.append(slots.hits[at_wall].astype(np.float64))
        keys, speeds = _numbered(np.concatenate(self._keys), state), np.concatenate(self._speeds)
        asleep = self._sleeping(slots, state)  # their pairs are not listed, but go on
        keys, speeds = np.concatenate((keys, asleep)), np.concatenate((speeds, np.full(len(asleep), -1.0)))
        order = np.argsort(keys)
        keys, speeds = keys[order], speeds[order]
        first = np.flatnonzero(np.diff(keys, prepend=-1))
        keys, speeds = keys[first], np.maximum.reduceat(speeds, first) if len(first) else speeds
        new = ~_among(keys, self._touching)
        gone = self._touching[~_among(self._touching, keys)]
        self.begin, self.end = _contacts(keys[new], state), _contacts(gone, state)
        hard = new & (speeds >= self._hit_speed)
        self.hit = np.empty(np.count_nonzero(hard), HIT)
        struck = _contacts(keys[hard], state)
        self.hit["a"], self.hit["b"], self.hit["speed"] = struck["a"], struck["b"], speeds[hard]
        self._touching = keys
        self.forget()

    def _sleeping(self, slots: Slots, state: State) -> Array:
        """Those of the contacts of the frame before whose circles sleep."""
        numbers = np.sort(state.number[slots.particle[slots.asleep]])
        b = (self._touching & _LOWER) - 1
        return self._touching[_among(self._touching >> 32, numbers) & ((b < 0) | _among(b, numbers))]


def _numbered(keys: Array, state: State) -> Array:
    """Keys from numbers, which particles keep, in the place of keys from indices, which they do not."""
    b = (keys & _LOWER) - 1
    return np.asarray((state.number[keys >> 32] << 32) + np.where(b >= 0, state.number[b] + 1, 0))


def _among(keys: Array, others: Array) -> Array:
    """Which of the keys are among the others, which are sorted."""
    if not len(others):
        return np.zeros(len(keys), bool)
    where = np.searchsorted(others, keys).clip(max=len(others) - 1)
    return np.asarray(others[where] == keys)


def _contacts(keys: Array, state: State) -> Array:
    """CONTACT from keys, by the indices particles have now; without those that are no more."""
    a, alive = _index(keys >> 32, state)
    b, other = _index((keys & _LOWER) - 1, state)
    wall = (keys & _LOWER) == 0
    kept = alive & (other | wall)
    found = np.empty(np.count_nonzero(kept), CONTACT)
    found["a"], found["b"] = a[kept], np.where(wall, WALL, b)[kept]
    return found


def _index(number: Array, state: State) -> tuple[Array, Array]:
    """(index, whether there is one) of the particles with these numbers."""
    if not len(state):
        return np.zeros(len(number), np.int64), np.zeros(len(number), bool)
    where = np.searchsorted(state.number, number).clip(max=len(state) - 1)
    return where, np.asarray(state.number[where] == number)
