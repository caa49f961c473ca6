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
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Array = NDArray[Any]
Told = tuple[Array, Array, Array]
"""Keys, sorted, of those who have parted in a frame, who have met, and who touch."""

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

    In a pile that comes to rest, contacts without weight may end and begin again. Indices stay valid until the next frame: when
    particles are removed, these arrays are renumbered in place, and a removed particle is -1 in them. Copies are not.

    Attributes:
        begin: HIT, those who touch now and did not in the frame before.
        end: CONTACT, those who did and do not now; a particle that has been removed is -1.
        hit: HIT, those of `begin` who met with at least `hit_speed`.
    """

    def __init__(self) -> None:
        self._hit_speed = 1.0
        self.begin = self.hit = np.empty(0, HIT)
        self.end = np.empty(0, CONTACT)
        self._touching = np.empty(0, np.int64)  # keys, sorted
        self._at_wall = self._touching  # those of them that are about walls; known where the next is
        self._known: Array | None = None  # `touched` of the list in which those of the frame before are marked
        self._keys: list[Array] = []
        self._speeds: list[Array] = []

    def __repr__(self) -> str:
        return f"Events of the last frame: {len(self.begin)} begin, {len(self.end)} end, {len(self.hit)} hit"

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
        self._hit_speed, self._touching, self._known = other._hit_speed, other._touching, None
        self.begin, self.end, self.hit = other.begin.copy(), other.end.copy(), other.hit.copy()

    def renumber(self, now: Array) -> None:
        """Particles are now at `now` (n,), or removed (-1)."""
        for records in (self.begin, self.end, self.hit):
            renumber(records, now)

    # ---- what the engine tells ---------------------------------------------------------------------------------------

    def collect(self, state: Slots, pairs: Wide) -> None:
        """The list of pairs is about to change, or the frame ends: keep what was heard."""
        room, which = len(pairs.closing), pairs.listed()
        keys, speeds = np.empty(room, np.int64), np.empty(room)
        found = kernels.heard(*which, pairs.closing, pairs.touched, state.particle, keys, speeds)
        self._keys.append(keys[:found])
        self._speeds.append(speeds[:found])

    def forget(self) -> None:
        """A frame begins, or begins again."""
        self._keys, self._speeds = [], []

    def close(self, slots: Slots, state: State, pairs: Wide | None, place: Place) -> None:
        """The frame has gone well: what was heard is what happened; `pairs`: the list of now; `place`: who and what they met."""
        at_wall = np.flatnonzero(slots.hits >= 0)
        walls, wall_speeds = slots.particle[at_wall].astype(np.int64) << 32, slots.hits[at_wall].astype(float)
        if pairs and pairs.touched is self._known and not (self._keys or (len(slots.island) and len(slots.asleep))):
            told, speeds = self._compare_pairs(slots, state, pairs, walls, wall_speeds)
        else:
            told, speeds = self._compare_keys(slots, state, pairs, walls, wall_speeds)
        gone, new, self._touching = told
        self.end, met = _contacts(np.concatenate((gone, new)), len(gone), state)
        self.begin = place.hits(met, speeds, state)
        self.hit = self.begin[speeds >= self._hit_speed]
        self.forget()

    def _compare_pairs(self, slots: Slots, state: State, pairs: Wide, walls: Array, wall_speeds: Array) -> tuple[Told, Array]:
        """The list is that of the frame before, where those who touched are marked: few have changed, and are sorted."""
        room = len(pairs.closing)
        new, speeds, gone = np.empty(room, np.int64), np.empty(room), np.empty(room, np.int64)
        which = pairs.listed()
        begun, ended = kernels.changed(*which, pairs.closing, pairs.touched, slots.particle, new, speeds, gone)
        told = _numbered(np.concatenate((new[:begun], walls)), state)
        walls, before = np.sort(told[begun:]), self._at_wall
        self._at_wall = walls
        left = np.unique(np.concatenate((_numbered(gone[:ended], state), before[kernels.absent(before, walls)])))
        come = np.unique(np.concatenate((told[:begun], walls[kernels.absent(walls, before)])))
        now = kernels.replaced(self._touching, left, come) if len(left) or len(come) else self._touching
        return (left, come, now), kernels.largest(come, told, np.concatenate((speeds[:begun], wall_speeds)))

    def _compare_keys(
        self, slots: Slots, state: State, pairs: Wide | None, walls: Array, wall_speeds: Array
    ) -> tuple[Told, Array]:
        """The list is another, or circles sleep, who are not in it: all that touch are sorted and compared with those before."""
        earlier = np.sort(np.concatenate(self._keys)) if self._keys else self._touching[:0]
        if pairs:
            self.collect(slots, pairs)
            if len(earlier):
                kernels.recall(*pairs.listed(), pairs.touched, slots.particle, earlier)
        self._known = pairs.touched if pairs and not len(slots.asleep) else None
        told = _numbered(np.concatenate((*self._keys, walls)), state)
        # Those who sleep are not listed, but go on. To sort keys alone takes a third of what it takes to know their order.
        now = np.sort(np.concatenate((told, self._sleeping(slots, state))))
        now = now[np.diff(now, prepend=-1) > 0]
        self._at_wall = now[(now & _LOWER) == 0]
        gone, new = self._touching[kernels.absent(self._touching, now)], now[kernels.absent(now, self._touching)]
        return (gone, new, now), kernels.largest(new, told, np.concatenate((*self._speeds, wall_speeds)))

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

        def of(values: Array, who: Array) -> Array:
            return values[who].astype(float)

        if len(pair):
            a, b = met["a"][pair], met["b"][pair]
            x, y, r, s = of(state.position, a), of(state.position, b), of(state.radius, a), of(state.radius, b)
            way = self.room.seam.nearest(y - x)
            far = np.hypot(*way.T)
            normal = way / np.maximum(far, 1e-300)[:, None]
            e, other = of(state.restitution, a), of(state.restitution, b)
            both = np.maximum(np.where(e >= 0, e, self.restitution), np.where(other >= 0, other, self.restitution))
            weight = 1 / of(state.mass, a) + 1 / of(state.mass, b)
            self._write(found, pair, x + (r + 0.5 * (far - r - s))[:, None] * normal, normal, both, weight)
        if len(single):
            a = met["a"][single]
            x, e = of(state.position, a), of(state.restitution, a)
            gap, into, surface = self._nearest(x, found, single)
            both = np.maximum(surface, np.where(e >= 0, e, 0.0))
            self._write(found, single, x - gap[:, None] * into, -into, both, 1 / of(state.mass, a))
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
        row, which, far, normal = self.course.facing(x)
        nearer = np.diff(row, prepend=-1) > 0  # of equally near ones the first
        nearer[nearer] = far[nearer] < gap[row[nearer]]
        row, which = row[nearer], which[nearer]
        found["obstacle"][rows[row]], found["wall"][rows[row]] = which, -1
        gap[row], into[row] = far[nearer], normal[nearer]
        obstacles = self.course.seen()
        surface[row] = [obstacles[k].restitution for k in which]
        return np.where(np.isfinite(gap), gap, np.nan), into, surface


def renumber(records: Array, now: Array) -> None:
    """Particles are now at `now` (n,), or removed (-1): what `records` say of them, in place, so that loops over it see it."""
    for name in ("a", "b"):
        before = records[name]
        records[name] = np.where(before >= 0, now[before], -1) if len(now) else -1


def _as_indices(state: State) -> bool:
    """Whether numbers are indices, for nobody has gone but the last that came."""
    return not len(state) or bool(state.number[-1] == len(state) - 1)


def _numbered(keys: Array, state: State) -> Array:
    """Keys from numbers, which particles keep, in the place of keys from indices, which they do not."""
    if _as_indices(state):
        return keys
    b = (keys & _LOWER) - 1
    return np.asarray((state.number[keys >> 32] << 32) + np.where(b >= 0, state.number[b] + 1, 0))


def _among(keys: Array, others: Array) -> Array:
    """Which of the keys are among the others, which are sorted."""
    if not len(others):
        return np.zeros(len(keys), bool)
    where = np.searchsorted(others, keys).clip(max=len(others) - 1)
    return np.asarray(others[where] == keys)


def _contacts(keys: Array, split: int, state: State) -> tuple[Array, Array]:
    """CONTACT from the first `split` keys, and from the others, by the indices of now; removed particles are -1."""
    found = np.empty(len(keys), CONTACT)
    found["a"], found["b"] = _index(keys >> 32, state), _index((keys & _LOWER) - 1, state)
    return found[:split], found[split:]


def _index(number: Array, state: State) -> Array:
    """Indices of the particles with these numbers; -1 where there is none."""
    if not len(state):
        return np.full(len(number), -1)
    if _as_indices(state):
        return np.where(number < len(state), number, -1)
    where = np.searchsorted(state.number, number).clip(max=len(state) - 1)
    return np.where(state.number[where] == number, where, -1)
