"""What happened between particles in a frame: contacts that began or ended, and how hard they hit."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.kernels import events as kernels
from pyverlet.laws.contacts.wide import Wide
from pyverlet.laws.obstacles import Course
from pyverlet.laws.rooms import Boundary
from pyverlet.state.state import Slots, State

Array = NDArray[Any]

WALL = -1
"""In the place of b: a wall of the bounds, or an obstacle."""

CONTACT = np.dtype([("a", np.int64), ("b", np.int64)])
"""Indices a < b of two particles; or a and WALL."""

_LOWER = 0xFFFFFFFF
"""Bits of a key that are b + 1, of two particles' a < b; 0 is a wall. The others are a."""

HIT = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("speed", np.float64), ("wall", np.int64), ("obstacle", np.int64),
        ("point", np.float64, (2,)), ("normal", np.float64, (2,)), ("impulse", np.float64),
    ]
)  # fmt: skip
"""The same, and the normal speed they met with, m/s; which wall of the room or which obstacle it was, else -1; where they touch,
m, and the unit normal out of a, both as of the end of the frame; what turned them, (1 + e) times the reduced mass times the
speed, N s. NaN where a room of the user's own does not say."""


class Events:
    """Contacts of the last frame, as structured arrays sorted by a, then b. Those who touch in any substep touch in the frame.

    In a pile that comes to rest, contacts without weight may end and begin again.

    Attributes:
        begin: HIT, those who touch now and did not in the frame before.
        end: CONTACT, those who did and do not now; without those of removed particles.
        hit: HIT, those of `begin` who met with at least `hit_speed`.
    """

    def __init__(self) -> None:
        self._hit_speed = 1.0
        self.begin = self.hit = np.empty(0, HIT)
        self.end = np.empty(0, CONTACT)
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

    def collect(self, state: Slots, pairs: Wide) -> None:
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

    def close(self, slots: Slots, state: State, place: Place) -> None:
        """The frame has gone well: what was heard is what happened; `place`: who and what they met."""
        at_wall = slots.hits >= 0
        self._keys.append(slots.particle[at_wall].astype(np.int64) << 32)
        self._speeds.append(slots.hits[at_wall].astype(np.float64))
        told, speeds = _numbered(np.concatenate(self._keys), state), np.concatenate(self._speeds)
        # Those who sleep are not listed, but go on. To sort keys alone takes a third of what it takes to know their order.
        keys = np.sort(np.concatenate((told, self._sleeping(slots, state))))
        keys = keys[np.diff(keys, prepend=-1) > 0]
        new, gone = keys[kernels.absent(keys, self._touching)], self._touching[kernels.absent(self._touching, keys)]
        self.end = _contacts(gone, state)
        met, speeds = _contacts(new, state), kernels.largest(new, told, speeds)
        self.begin = place.hits(met, speeds, state)
        self.hit = self.begin[speeds >= self._hit_speed]
        self._touching = keys
        self.forget()

    def _sleeping(self, slots: Slots, state: State) -> Array:
        """Those of the contacts of the frame before whose circles sleep."""
        numbers = np.sort(state.number[slots.particle[slots.asleep]])
        b = (self._touching & _LOWER) - 1
        return self._touching[_among(self._touching >> 32, numbers) & ((b < 0) | _among(b, numbers))]


class Place(NamedTuple):
    """What circles may meet, and by which laws."""

    room: Boundary
    course: Course
    restitution: float
    """Of circles that have none of their own, between each other."""

    def hits(self, met: Array, speed: Array, state: State) -> Array:
        """HIT from CONTACT and m/s, of circles that are where they are now."""
        found = np.zeros(len(met), HIT)
        for name, column in (("a", met["a"]), ("b", met["b"]), ("speed", speed), ("wall", -1), ("obstacle", -1)):
            found[name] = column
        at_wall = met["b"] == WALL
        pair, single = np.flatnonzero(~at_wall), np.flatnonzero(at_wall)
        x, r = state.position.astype(float), state.radius.astype(float)
        with np.errstate(divide="ignore"):
            inverse = 1 / state.mass.astype(float)
        e = state.restitution.astype(float)
        if len(pair):
            a, b = met["a"][pair], met["b"][pair]
            way = self.room.seam.nearest(x[b] - x[a])
            far = np.hypot(*way.T)
            normal = way / np.maximum(far, 1e-300)[:, None]
            both = np.maximum(*(np.where(e[k] >= 0, e[k], self.restitution) for k in (a, b)))
            weight = inverse[a] + inverse[b]
            self._write(found, pair, x[a] + (r[a] + 0.5 * (far - r[a] - r[b]))[:, None] * normal, normal, both, weight)
        if len(single):
            a = met["a"][single]
            gap, into, surface = self._nearest(x[a], found, single)
            both = np.maximum(surface, np.where(e[a] >= 0, e[a], 0.0))
            self._write(found, single, x[a] - gap[:, None] * into, -into, both, inverse[a])
        return found

    def _write(self, found: Array, rows: Array, point: Array, normal: Array, e: Array, weight: Array) -> None:
        found["point"][rows], found["normal"][rows] = self.room.seam.wrapped(point), normal
        found["impulse"][rows] = (1 + e) * found["speed"][rows] / np.where(weight > 0, weight, np.inf)

    def _nearest(self, x: Array, found: Array, rows: Array) -> tuple[Array, Array, Array]:
        """Which wall or obstacle it was; its distance from the centres x, m, its normal, and its restitution."""
        gap, into, surface = np.full(len(x), np.inf), np.full((len(x), 2), np.nan), np.zeros(len(x))
        facing = self.room.facing(x)
        if facing is not None:
            wall = np.argmin(facing[0], axis=1)
            found["wall"][rows], row = wall, np.arange(len(x))
            gap, into = facing[0][row, wall].copy(), np.array(facing[1][row, wall])
            surface[:] = getattr(self.room, "restitution", 0.0)
        elif self.room.extent() is not None:  # of the user's own: it may have been its wall
            found["wall"][rows] = 0
        obstacles = self.course.seen()
        if obstacles:
            far, normal = self.course.facing(x)
            which, row = np.argmin(far, axis=1), np.arange(len(x))
            nearer = far[row, which] < gap
            found["obstacle"][rows] = np.where(nearer, which, -1)
            found["wall"][rows] = np.where(nearer, -1, found["wall"][rows])
            gap, into = np.where(nearer, far[row, which], gap), np.where(nearer[:, None], normal[row, which], into)
            surface = np.where(nearer, np.array([obstacle.restitution for obstacle in obstacles])[which], surface)
        return np.where(np.isfinite(gap), gap, np.nan), into, surface


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
