"""Events of a frame: contacts that began or ended, and their impact speeds."""

from __future__ import annotations

from operator import is_
from typing import Any, NamedTuple

import numpy as np

from pyverlet.common import checks
from pyverlet.common.arrays import Array, Floats
from pyverlet.common.constants import FIRST_OBSTACLE
from pyverlet.core import unit
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.obstacles import Obstacle, ObstacleArrays
from pyverlet.state.periodicity import Periodicity
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State, may_collide

WALL = -1
"""Value of b for a wall of the room or an obstacle."""

CONTACT = np.dtype([("a", np.int64), ("b", np.int64), ("wall", np.int64), ("obstacle", np.int64), ("number", np.int64, (2,))])
"""Indices a < b of two particles; or a and WALL, and the number of the wall or obstacle, else -1; and the permanent numbers
(`world.number`) of both particles, -1 instead of b, which do not change when particles are removed."""

_LOWER, SURFACE, LOST = 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF
"""Bits of a key: the lower half is b + 1 for two particles a < b, or `SURFACE` and a surface number; the upper half is a. Surface
numbers from `FIRST_OBSTACLE` on are obstacles, lower ones walls, and `LOST` stands for removed obstacles."""

HIT = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("speed", np.float64), ("wall", np.int64), ("obstacle", np.int64),
        ("point", np.float64, (2,)), ("normal", np.float64, (2,)), ("impulse", np.float64), ("number", np.int64, (2,)),
    ]
)  # fmt: skip
"""CONTACT, and the largest normal approach speed, m/s; point of contact, m, and unit normal out of a, both at the end of the
frame; normal impulse in the frame, N s, divided equally if the contact began several times. NaN where a user-defined room gives
none."""


_NO_HITS, _NO_CONTACTS = np.empty(0, HIT), np.empty(0, CONTACT)

_AT, _SPACINGS, _ALIKE = 1e-6, 4.0, 1e-3
"""Contacts without load do not end while the gap is below the first, in radii, plus so many roundings of coordinates, or for two
particles that move alike, below the last."""


class RecordedEvents(NamedTuple):
    """Recorded contacts, in any order."""

    keys: Array
    """Keys of contacts, made of permanent particle numbers."""
    speeds: Array
    """Largest speed of approach, m/s."""
    bounces: Array
    """Number of bounces."""
    pushes: Array
    """Normal impulses over the reduced mass, or that of the particle, m/s."""

    @classmethod
    def of(cls, parts: list[RecordedEvents]) -> RecordedEvents:
        """Concatenate records."""
        return parts[0] if len(parts) == 1 else cls(*(np.concatenate([part[k] for part in parts]) for k in range(4)))


_NOTHING = RecordedEvents(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


class Events:
    """Contacts that began or ended in the last frame, as structured arrays sorted by a, then b.

    A contact in any substep counts for the frame. Each wall of the room, each obstacle and each other particle is a contact of
    its own. Every bounce ends a contact and begins it again, even if it existed in the frame before. Contacts without load
    continue while the gap is only rounding, 1e-6 radii; in a pile that is coming to rest gaps may be larger, and contacts begin
    again.

    `point` and `normal` are those at the end of the frame, after the two have moved on: for discs of 1 m that meet obliquely at
    10 m/s the normal is up to 5 degrees off in frames of 1/60 s, and 18 in frames of 1/20 s. Shorter frames are more accurate.

    A sensor that a particle crosses within a frame begins and ends in it. Its events have speed and impulse 0, and are no hits.

    Indices are valid until the next frame: when particles are removed, these arrays are renumbered in place, and a removed
    particle becomes -1. Copies are not renumbered. The field `number` never changes: `World.index_of` converts it to current
    indices.

    Attributes:
        begin: HIT, contacts that exist now and did not in the frame before, and bounces.
        end: CONTACT, contacts that no longer exist, and bounces; a removed particle or obstacle is -1.
        hit: HIT, those of `begin` whose speed is at least `hit_speed`.
    """

    def __init__(self) -> None:
        self._hit_speed = 1.0
        self.begin, self.hit, self.end = _NO_HITS, _NO_HITS, _NO_CONTACTS
        self._touching = np.empty(0, np.int64)  # keys, sorted
        self._obstacles: list[Obstacle] | None = None  # obstacles that the keys number; None: no keys yet
        self._recorded = _NOTHING
        self._slept = np.zeros(0, np.int64)  # contacts of particles that slept at the start of the frame and have woken in it
        self._sensed: list[Array] | None = None  # keys of contacts with sensors: in this frame, and at its end; None: unchanged
        self._sensed_at = -1  # `ObstacleArrays.version` when sensors were last evaluated; -1: never

    def __repr__(self) -> str:
        return f"Events of the last frame: {len(self.begin)} begin, {len(self.end)} end, {len(self.hit)} hit"

    @property
    def hit_speed(self) -> float:
        """Contacts that begin with a lower speed are not hits, m/s; 1 by default."""
        return self._hit_speed

    @hit_speed.setter
    def hit_speed(self, value: float) -> None:
        self._hit_speed = checks.number("hit_speed", value, least=0.0)

    def copy(self) -> Events:
        """An independent copy."""
        other = Events()
        other.take(self)
        return other

    def take(self, other: Events) -> None:
        """Copy the state of another object."""
        self._hit_speed, self._touching, self._obstacles = other._hit_speed, other._touching, other._obstacles
        self.begin, self.end, self.hit = other.begin.copy(), other.end.copy(), other.hit.copy()
        self._sensed_at = -1

    def renumber(self, now: Array) -> None:
        """Renumber particles in the records: now at `now` (n,), or removed (-1)."""
        self._sensed_at = -1  # removed particles have left sensors
        for records in (self.begin, self.end, self.hit):
            renumber(records, now)

    def name_after(self, obstacles: list[Obstacle]) -> None:
        """Renumber the keys to these obstacles; contacts with missing ones end in the next frame."""
        lost = self._number_obstacles(obstacles)
        self._touching = np.sort(np.concatenate((self._touching, lost)))

    # ---- what the engine tells ---------------------------------------------------------------------------------------

    def record(self, recorded: RecordedEvents) -> None:
        """Set the records of this frame, without those of user-defined walls."""
        self._recorded = recorded

    def wake(self, sorted_state: SortedState, state: State) -> None:
        """Before sleepers wake within a frame: keep their contacts, which existed until then."""
        self._slept = np.concatenate((self._slept, self._sleeping(sorted_state, state)))

    def forget(self) -> None:
        """Discard the records, as a frame begins or is repeated."""
        self._recorded, self._slept, self._sensed = _NOTHING, self._slept[:0], None

    def senses(self, obstacles: ObstacleArrays) -> bool:
        """Whether contacts with sensors may have changed although no remaining particle moves."""
        return bool(obstacles.sensors) and (obstacles.sensors_move or obstacles.version != self._sensed_at)

    def sense(self, obstacles: ObstacleArrays, touched: Array, inside: Array) -> None:
        """Set the sorted keys of contacts with sensors during this frame, and at its end."""
        self._sensed, self._sensed_at = [touched, inside], obstacles.version

    def close(self, sorted_state: SortedState, state: State, place: Place) -> None:
        """After a successful frame: convert its records to events; `place`: room and obstacles."""
        lost, sensors = self._number_obstacles(place.obstacles.seen), place.obstacles.sensors
        touched, inside = self._sensed or [self._touching[_of(self._touching, sensors)]] * 2
        recorded = RecordedEvents.of([self._recorded, *place.walls(sorted_state, state)])
        # Contacts of sleepers are not recorded, but continue, also for sensors. Sorting keys alone takes a third of the time of
        # an argsort.
        slept = np.concatenate((self._slept, self._sleeping(sorted_state, state)))
        now = np.sort(np.concatenate((recorded.keys, touched, slept[~_of(slept, sensors)] if sensors else slept)))
        now = now[: _tools().drop_repeated(now)]
        if len(silent := _absent(self._touching, now)):
            still = silent[place.touch(_contacts(silent, state), state)]
            now = np.insert(now, np.searchsorted(now, still), still)
        gone, new = _absent(self._touching, now), _absent(now, self._touching)
        left = _absent(touched, inside)  # sensors that were crossed
        if not (len(lost) or len(left) or len(gone) or len(new) or np.count_nonzero(recorded.bounces)):
            self.begin, self.hit, self.end = _NO_HITS, _NO_HITS, _NO_CONTACTS
            self.forget()
            return
        # Every bounce begins a contact, and all but the last one end it; the first also ends a contact of the frame before.
        again, bounces = _counted(recorded)
        begun = np.unique(np.concatenate((new, again)))
        times = np.ones(len(begun), np.int64)
        times[np.searchsorted(begun, again)] = bounces
        ended = np.concatenate((lost, gone, left, np.repeat(again, bounces - 1 + _among(again, self._touching))))
        speeds, pushes = _sums_of(begun, recorded)
        self._touching = _absent(now, left)
        self.end = _contacts(np.sort(ended ^ SURFACE) ^ SURFACE, state)  # walls and obstacles before particles
        order = np.argsort(begun ^ SURFACE)
        begun, speeds, pushes = (np.repeat(column[order], times[order]) for column in (begun, speeds, pushes / times))
        self.begin = place.hits(_contacts(begun, state), speeds, pushes, state)
        self.find_hits(place.obstacles)
        self.forget()

    def find_hits(self, obstacles: ObstacleArrays) -> None:
        """Select the hits among `begin`, without those of sensors."""
        self.hit = self.begin[(self.begin["speed"] >= self._hit_speed) & ~np.isin(self.begin["obstacle"], obstacles.sensors)]

    def _number_obstacles(self, obstacles: list[Obstacle]) -> Array:
        """Renumber the keys to these obstacles; returns the keys of contacts with removed ones."""
        before, self._obstacles = self._obstacles, obstacles
        known = (self._touching & _LOWER) != SURFACE + LOST
        gone: Array = self._touching[~known]
        if len(gone):
            self._touching = self._touching[known]
        if before is None or before is obstacles or (len(before) == len(obstacles) and all(map(is_, before, obstacles))):
            return gone
        numbers = {id(obstacle): k for k, obstacle in enumerate(obstacles)}
        now = np.array([*range(FIRST_OBSTACLE), *(FIRST_OBSTACLE + numbers.get(id(each), LOST) for each in before)])
        at_wall = (self._touching & SURFACE) != 0
        keys = self._touching[at_wall]
        which = now[keys & LOST]
        kept = which < LOST
        lost: Array = np.concatenate((gone, keys[~kept] | LOST))
        self._touching = np.sort(np.concatenate((self._touching[~at_wall], (keys[kept] & ~LOST) | which[kept])))
        return lost

    def _sleeping(self, sorted_state: SortedState, state: State) -> Array:
        """The contacts of the frame before in which both circles sleep, or one sleeps and the other is pinned."""
        if not len(sorted_state.asleep):
            return self._touching[:0]
        asleep = np.sort(state.number[sorted_state.particle[sorted_state.asleep]])
        pinned = np.sort(state.number[~np.isfinite(state.shown["mass"])])
        a, b = self._touching >> 32, (self._touching & _LOWER) - 1
        first, second = _among(a, asleep), (b >= SURFACE - 1) | _among(b, asleep)
        return self._touching[(first & second) | (first & _among(b, pinned)) | (_among(a, pinned) & second & (b < SURFACE - 1))]


class Place(NamedTuple):
    """The surroundings of particles: room, obstacles, and whether particles collide."""

    boundary: Boundary
    obstacles: ObstacleArrays
    collides: bool
    """Whether circles collide with each other."""

    def touch(self, met: Array, state: State) -> Array:
        """(n,) bool, which of these contacts, CONTACT, still touch up to rounding, though without load."""
        found = (met["a"] >= 0) & ((met["b"] >= 0) | (met["number"][:, 1] < 0))  # no particle was removed
        if not found.any():
            return np.asarray(found)
        met, at, pair = met[found], state.shown, met["b"][found] >= 0
        a, b = met["a"], np.where(pair, met["b"], met["a"])
        (x, y), (u, v), (r, s) = (
            (at[name][a].astype(float), at[name][b].astype(float)) for name in ("position", "velocity", "radius")
        )
        category, mask, rounded = at["category"], at["mask"], _SPACINGS * float(np.finfo(state.dtype).eps)
        meets = self.boundary.holds(category[a], mask[a])
        meets[pair] = self.collides & may_collide(category[a], mask[a], category[b], mask[b])[pair]
        for k in np.flatnonzero(met["obstacle"] >= 0):
            obstacle = self.obstacles.seen[met["obstacle"][k]]
            meets[k] = not obstacle.sensor and may_collide(category[a[k]], mask[a[k]], obstacle.category, obstacle.mask)
        gap = np.hypot(*self.boundary.periodic.nearest(y - x).T) - r - s
        gap[~pair] = self._facing(x[~pair], met["wall"][~pair], met["obstacle"][~pair])[0] - r[~pair]
        # Two particles that move alike are each rounded by their own coordinates.
        alike = pair & (np.hypot(*(v - u).T) <= rounded * np.hypot(*u.T))
        near = np.where(alike, _ALIKE, _AT) * np.minimum(r, s) + rounded * np.abs((x, y)).max(axis=(0, 2))
        found[found] = meets & (np.abs(gap) <= near)
        return np.asarray(found)

    def hits(self, met: Array, speed: Array, push: Array, state: State) -> Array:
        """HIT records from CONTACT, speeds and `RecordedEvents.pushes`, at the current positions."""
        found, at = np.zeros(len(met), HIT), state.shown
        for name in CONTACT.names or ():
            found[name] = met[name]
        found["speed"] = speed
        pair, single = np.flatnonzero(met["b"] != WALL), np.flatnonzero(met["b"] == WALL)

        def of(values: Array, which: Array) -> Array:
            return values[which].astype(float)

        weight = 1 / of(at["mass"], met["a"])
        if len(pair):
            a, b = met["a"][pair], met["b"][pair]
            x, y, r, s = of(at["position"], a), of(at["position"], b), of(at["radius"], a), of(at["radius"], b)
            found["point"][pair], found["normal"][pair] = between(self.boundary.periodic, x, y, r, s)
            weight[pair] += 1 / of(at["mass"], b)
        if len(single):
            x = of(at["position"], met["a"][single])
            gap, into = self._facing(x, met["wall"][single], met["obstacle"][single])
            found["point"][single], found["normal"][single] = self.boundary.periodic.wrapped(x - gap[:, None] * into), -into
        found["impulse"] = push / np.where(weight > 0, weight, np.inf)
        return found

    def walls(self, sorted_state: SortedState, state: State) -> list[RecordedEvents]:
        """Records of a user-defined room in this frame, each for the nearest of its walls."""
        if not sorted_state.own_walls:
            return []
        at = np.flatnonzero(sorted_state.wall_hits[:, 0] >= 0)
        facing = self.boundary.facing(sorted_state.position[at]) if len(at) else None
        nearest = np.zeros(len(at), np.int64) if facing is None else np.argmin(facing[0], axis=1)
        keys = (state.number[sorted_state.particle[at]] << 32) + SURFACE + nearest
        speeds, pushes = sorted_state.wall_hits[at].T.astype(float)
        return [RecordedEvents(keys, speeds, np.zeros(len(at), np.int64), pushes)]

    def _facing(self, x: Array, wall: Array, obstacle: Array) -> tuple[Array, Array]:
        """Distances of walls or obstacles from centres x, m, and their normals; NaN where unknown."""
        gap, into = np.full(len(x), np.nan), np.full((len(x), 2), np.nan)
        rows = np.flatnonzero(wall >= 0)
        if len(rows) and (found := self.boundary.facing(x[rows])) is not None:
            gap[rows], into[rows] = (each[np.arange(len(rows)), wall[rows]] for each in found)
        rows = np.flatnonzero(obstacle >= 0)
        if len(rows):
            gap[rows], into[rows] = self.obstacles.facing(x[rows], obstacle[rows])
        return gap, into


def between(periodic: Periodicity, x: Floats, y: Floats, r: Floats, s: Floats) -> tuple[Floats, Floats]:
    """(k, 2) m, contact points of circles at x and y (k, 2) with radii r and s (k,), and unit normals from first to second."""
    way = periodic.nearest(y - x)
    far = np.hypot(*way.T)
    normal = way / np.maximum(far, 1e-300)[:, None]
    return periodic.wrapped(x + (r + 0.5 * (far - r - s))[:, None] * normal), normal


def key_of_surface(a: Array, number: Array, obstacle: Array) -> Array:
    """Keys of contacts of particles with walls of these numbers, or with obstacles (`obstacle`)."""
    return np.asarray((a << 32) + SURFACE + np.where(obstacle, FIRST_OBSTACLE + number, number))


def _of(keys: Array, obstacles: list[int]) -> Array:
    """(n,) bool, which keys are contacts with these obstacles."""
    if not obstacles:
        return np.zeros(len(keys), bool)
    lower = keys & _LOWER
    return np.asarray(((lower & SURFACE) != 0) & np.isin((lower & LOST) - FIRST_OBSTACLE, obstacles))


def _counted(recorded: RecordedEvents) -> tuple[Array, Array]:
    """Sorted keys of contacts that bounced, and the number of bounces."""
    bounced = np.flatnonzero(recorded.bounces)
    keys, where = np.unique(recorded.keys[bounced], return_inverse=True)
    return keys, np.bincount(where, recorded.bounces[bounced], len(keys)).astype(np.int64)


def renumber(records: Array, now: Array) -> None:
    """Renumber particles in `records`, now at `now` (n,) or removed (-1), in place, so that loops over them see it."""
    for name in ("a", "b"):
        before = records[name]
        records[name] = np.where(before >= 0, now[before], -1) if len(now) else -1


def _absent(keys: Array, others: Array) -> Array:
    """The keys that are not among the others; both are sorted."""
    absent = np.empty(len(keys), bool)
    return keys[absent] if _tools().mark_absent(keys, others, absent) else keys[:0]


def _tools() -> Any:
    return unit("tools", np.float64)


def _among(keys: Array, others: Array) -> Array:
    """Which of the keys are among the others, which are sorted."""
    if not len(others):
        return np.zeros(len(keys), bool)
    where = np.searchsorted(others, keys).clip(max=len(others) - 1)
    return np.asarray(others[where] == keys)


def _sums_of(keys: Array, recorded: RecordedEvents) -> tuple[Array, Array]:
    """The largest speed and the sum of pushes of each of the sorted keys; 0 without records."""
    speeds, pushes = np.zeros((2, len(keys)))
    if len(keys):
        asked = np.zeros(int(max(recorded.keys.max(initial=0), keys[-1]) >> 32) + 1, bool)
        asked[keys >> 32] = True
        which = np.flatnonzero(asked[recorded.keys >> 32])  # usually few of many contacts begin
        which = which[_among(recorded.keys[which], keys)]
        where = np.searchsorted(keys, recorded.keys[which])
        np.maximum.at(speeds, where, recorded.speeds[which])
        np.add.at(pushes, where, recorded.pushes[which])
    return speeds, pushes


def _contacts(keys: Array, state: State) -> Array:
    """CONTACT from keys, with current indices; removed particles are -1."""
    found, lower = np.empty(len(keys), CONTACT), keys & _LOWER
    at_wall = (lower & SURFACE) != 0
    number = np.where(at_wall, lower & LOST, LOST)
    found["number"] = np.column_stack((keys >> 32, np.where(at_wall, WALL, lower - 1)))
    found["a"], found["b"] = state.index_of(found["number"]).T
    found["wall"] = np.where(number < FIRST_OBSTACLE, number, -1)
    found["obstacle"] = np.where((number >= FIRST_OBSTACLE) & (number < LOST), number - FIRST_OBSTACLE, -1)
    return found
