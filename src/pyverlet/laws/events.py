"""What happened between particles in a frame: contacts that began or ended, and how hard they hit."""

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
"""In the place of b: a wall of the bounds, or an obstacle."""

CONTACT = np.dtype([("a", np.int64), ("b", np.int64), ("wall", np.int64), ("obstacle", np.int64), ("number", np.int64, (2,))])
"""Indices a < b of two particles; or a and WALL, and which wall of the room or which obstacle it is, else -1; and the numbers
(`world.number`) of both particles, -1 in the place of b, which stay what they are when particles are removed."""

_LOWER, SURFACE, LOST = 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF
"""Bits of a key that are b + 1, of two particles' a < b, or `SURFACE` and the number of one; the others are a. Numbers from
`FIRST_OBSTACLE` on are obstacles', lower ones are walls', and `LOST` is that of obstacles that have been removed."""

HIT = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("speed", np.float64), ("wall", np.int64), ("obstacle", np.int64),
        ("point", np.float64, (2,)), ("normal", np.float64, (2,)), ("impulse", np.float64), ("number", np.int64, (2,)),
    ]
)  # fmt: skip
"""The same, and the largest normal speed they met with, m/s; where they touch, m, and the unit normal out of a, both as of the
end of the frame; what the contact gave along its normal in the frame, N s, in equal parts if it began several times in it. NaN
where a room of the user's own does not say."""


_NO_HITS, _NO_CONTACTS = np.empty(0, HIT), np.empty(0, CONTACT)

_AT, _SPACINGS, _ALIKE = 1e-6, 4.0, 1e-3
"""Contacts without load may be apart without an end: by that part of the radius and so much of what numbers are rounded by, and
two that move alike by another part of it."""


class RecordedEvents(NamedTuple):
    """What was told of contacts, in any order."""

    keys: Array
    """Of contacts, as they are kept: from numbers, not from indices."""
    speeds: Array
    """Largest speed of approach, m/s."""
    bounces: Array
    """How often they bounced."""
    pushes: Array
    """What they gave along their normals, over the reduced mass, or that of the particle, m/s."""

    @classmethod
    def of(cls, parts: list[RecordedEvents]) -> RecordedEvents:
        """All of these."""
        return parts[0] if len(parts) == 1 else cls(*(np.concatenate([part[k] for part in parts]) for k in range(4)))


_NOTHING = RecordedEvents(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


class Events:
    """Contacts of the last frame, as structured arrays sorted by a, then b; a removed particle stays where it was.

    Those who touch in any substep touch in the frame.

    Contacts with each wall of the room, each obstacle and each other particle are told apart. A contact begins again with every
    bounce, after an end, even if it touched in the frame before. Contacts without load go on while the two are at each other to
    rounding, 1e-6 radii; in a pile that comes to rest they may come apart by more, and begin again.

    `point` and `normal` are those of the end of the frame, when the two have gone on: of discs of 1 m that met aslant at 10 m/s
    the normal is up to 5 degrees off in frames of 1/60 s, and 18 in frames of 1/20 s. Shorter frames are closer.

    A sensor that a particle crosses within a frame begins and ends in it. What it tells has speed and impulse 0, and is no hit.

    Indices stay valid until the next frame: when particles are removed, these arrays are renumbered in place, and a removed
    particle is -1 in them. Copies are not renumbered. The field `number` stays as it is, in copies too: `World.index_of` tells
    where those particles are now.

    Attributes:
        begin: HIT, contacts that touch now and did not in the frame before, and bounces.
        end: CONTACT, those that did and do not now, and those that bounce; a removed particle or obstacle is -1.
        hit: HIT, those of `begin` that met with at least `hit_speed`.
    """

    def __init__(self) -> None:
        self._hit_speed = 1.0
        self.begin, self.hit, self.end = _NO_HITS, _NO_HITS, _NO_CONTACTS
        self._touching = np.empty(0, np.int64)  # keys, sorted
        self._obstacles: list[Obstacle] | None = None  # that the keys number; None: there are no keys yet
        self._recorded = _NOTHING
        self._slept = np.zeros(0, np.int64)  # contacts of those who slept when the frame began, and have woken in it
        self._sensed: list[Array] | None = None  # keys of contacts with sensors: in this frame, and at its end; None: as before
        self._sensed_at = -1  # `ObstacleArrays.version` when sensors were asked last; -1: they are to be asked

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
        self._hit_speed, self._touching, self._obstacles = other._hit_speed, other._touching, other._obstacles
        self.begin, self.end, self.hit = other.begin.copy(), other.end.copy(), other.hit.copy()
        self._sensed_at = -1

    def renumber(self, now: Array) -> None:
        """Particles are now at `now` (n,), or removed (-1)."""
        self._sensed_at = -1  # those that were removed have left them
        for records in (self.begin, self.end, self.hit):
            renumber(records, now)

    def name_after(self, obstacles: list[Obstacle]) -> None:
        """Number obstacles in the keys as these are; contacts with others end in the next frame."""
        lost = self._number_obstacles(obstacles)
        self._touching = np.sort(np.concatenate((self._touching, lost)))

    # ---- what the engine tells ---------------------------------------------------------------------------------------

    def record(self, recorded: RecordedEvents) -> None:
        """What was noted of this frame, but for walls of a room of the user's own."""
        self._recorded = recorded

    def wake(self, sorted_state: SortedState, state: State) -> None:
        """Sleepers are about to wake in the middle of a frame: their contacts went on until then."""
        self._slept = np.concatenate((self._slept, self._sleeping(sorted_state, state)))

    def forget(self) -> None:
        """A frame begins, or begins again."""
        self._recorded, self._slept, self._sensed = _NOTHING, self._slept[:0], None

    def senses(self, obstacles: ObstacleArrays) -> bool:
        """Whether sensors may touch others than in the frame before although no particle that is left moves."""
        return bool(obstacles.sensors) and (obstacles.sensors_move or obstacles.version != self._sensed_at)

    def sense(self, obstacles: ObstacleArrays, touched: Array, inside: Array) -> None:
        """Keys, sorted, of contacts with sensors in this frame, and of those at its end."""
        self._sensed, self._sensed_at = [touched, inside], obstacles.version

    def close(self, sorted_state: SortedState, state: State, place: Place) -> None:
        """The frame has gone well: what was told is what happened; `place`: what circles met."""
        lost, sensors = self._number_obstacles(place.obstacles.seen), place.obstacles.sensors
        touched, inside = self._sensed or [self._touching[_of(self._touching, sensors)]] * 2
        recorded = RecordedEvents.of([self._recorded, *place.walls(sorted_state, state)])
        # Those who sleep are not listed, but go on; sensors look at them, too. To sort keys alone takes a third of what it takes
        # to know their order.
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
        # Bounces: each is a beginning, and but for the last an end; another one, if they touched before, ends what went on.
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
        """Which of `begin` are hits; those of sensors are none."""
        self.hit = self.begin[(self.begin["speed"] >= self._hit_speed) & ~np.isin(self.begin["obstacle"], obstacles.sensors)]

    def _number_obstacles(self, obstacles: list[Obstacle]) -> Array:
        """Number obstacles in the keys as they are numbered now; returns the keys of contacts with those that were removed."""
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
        """Those of the contacts of the frame before whose circles sleep, or one of them beside a pinned one."""
        if not len(sorted_state.asleep):
            return self._touching[:0]
        asleep = np.sort(state.number[sorted_state.particle[sorted_state.asleep]])
        pinned = np.sort(state.number[~np.isfinite(state.shown["mass"])])
        a, b = self._touching >> 32, (self._touching & _LOWER) - 1
        first, second = _among(a, asleep), (b >= SURFACE - 1) | _among(b, asleep)
        return self._touching[(first & second) | (first & _among(b, pinned)) | (_among(a, pinned) & second & (b < SURFACE - 1))]


class Place(NamedTuple):
    """What circles may meet beside each other."""

    boundary: Boundary
    obstacles: ObstacleArrays
    collides: bool
    """Whether circles meet each other."""

    def touch(self, met: Array, state: State) -> Array:
        """(n,) bool, which of these, CONTACT, are at each other to rounding, though they have told nothing: without load."""
        found = (met["a"] >= 0) & ((met["b"] >= 0) | (met["number"][:, 1] < 0))  # none was removed
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
        # Two that move alike are rounded on their way, each by its own coordinates.
        alike = pair & (np.hypot(*(v - u).T) <= rounded * np.hypot(*u.T))
        near = np.where(alike, _ALIKE, _AT) * np.minimum(r, s) + rounded * np.abs((x, y)).max(axis=(0, 2))
        found[found] = meets & (np.abs(gap) <= near)
        return np.asarray(found)

    def hits(self, met: Array, speed: Array, push: Array, state: State) -> Array:
        """HIT from CONTACT, speeds and `RecordedEvents.pushes`, of circles that are where they are now."""
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
        """What a room of the user's own has noted in this frame: who met the nearest of its walls."""
        if not sorted_state.own_walls:
            return []
        at = np.flatnonzero(sorted_state.wall_hits[:, 0] >= 0)
        facing = self.boundary.facing(sorted_state.position[at]) if len(at) else None
        nearest = np.zeros(len(at), np.int64) if facing is None else np.argmin(facing[0], axis=1)
        keys = (state.number[sorted_state.particle[at]] << 32) + SURFACE + nearest
        speeds, pushes = sorted_state.wall_hits[at].T.astype(float)
        return [RecordedEvents(keys, speeds, np.zeros(len(at), np.int64), pushes)]

    def _facing(self, x: Array, wall: Array, obstacle: Array) -> tuple[Array, Array]:
        """Distance of walls or obstacles from centres x, m, and their normals; NaN where that is not known."""
        gap, into = np.full(len(x), np.nan), np.full((len(x), 2), np.nan)
        rows = np.flatnonzero(wall >= 0)
        if len(rows) and (found := self.boundary.facing(x[rows])) is not None:
            gap[rows], into[rows] = (each[np.arange(len(rows)), wall[rows]] for each in found)
        rows = np.flatnonzero(obstacle >= 0)
        if len(rows):
            gap[rows], into[rows] = self.obstacles.facing(x[rows], obstacle[rows])
        return gap, into


def between(periodic: Periodicity, x: Floats, y: Floats, r: Floats, s: Floats) -> tuple[Floats, Floats]:
    """(k, 2) m, where circles at x and y (k, 2) of radii r and s (k,) touch, and unit normals from the first to the second."""
    way = periodic.nearest(y - x)
    far = np.hypot(*way.T)
    normal = way / np.maximum(far, 1e-300)[:, None]
    return periodic.wrapped(x + (r + 0.5 * (far - r - s))[:, None] * normal), normal


def key_of_surface(a: Array, number: Array, obstacle: Array) -> Array:
    """Of contacts of particles with walls of the room, or (`obstacle`) with obstacles, of these numbers."""
    return np.asarray((a << 32) + SURFACE + np.where(obstacle, FIRST_OBSTACLE + number, number))


def _of(keys: Array, obstacles: list[int]) -> Array:
    """(n,) bool, which keys are of contacts with these obstacles."""
    if not obstacles:
        return np.zeros(len(keys), bool)
    lower = keys & _LOWER
    return np.asarray(((lower & SURFACE) != 0) & np.isin((lower & LOST) - FIRST_OBSTACLE, obstacles))


def _counted(recorded: RecordedEvents) -> tuple[Array, Array]:
    """Keys, sorted, of those that have bounced, and how often."""
    bounced = np.flatnonzero(recorded.bounces)
    keys, where = np.unique(recorded.keys[bounced], return_inverse=True)
    return keys, np.bincount(where, recorded.bounces[bounced], len(keys)).astype(np.int64)


def renumber(records: Array, now: Array) -> None:
    """Particles are now at `now` (n,), or removed (-1): what `records` say of them, in place, so that loops over it see it."""
    for name in ("a", "b"):
        before = records[name]
        records[name] = np.where(before >= 0, now[before], -1) if len(now) else -1


def _absent(keys: Array, others: Array) -> Array:
    """Those of the keys that are not among the others; both are sorted."""
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
    """Of each of the keys, which are sorted, the largest of its speeds and the sum of its pushes; 0 if it was not told of."""
    speeds, pushes = np.zeros((2, len(keys)))
    if len(keys):
        asked = np.zeros(int(max(recorded.keys.max(initial=0), keys[-1]) >> 32) + 1, bool)
        asked[keys >> 32] = True
        which = np.flatnonzero(asked[recorded.keys >> 32])  # of many that touch few begin to
        which = which[_among(recorded.keys[which], keys)]
        where = np.searchsorted(keys, recorded.keys[which])
        np.maximum.at(speeds, where, recorded.speeds[which])
        np.add.at(pushes, where, recorded.pushes[which])
    return speeds, pushes


def _contacts(keys: Array, state: State) -> Array:
    """CONTACT from keys, by the indices of now; removed particles are -1."""
    found, lower = np.empty(len(keys), CONTACT), keys & _LOWER
    at_wall = (lower & SURFACE) != 0
    number = np.where(at_wall, lower & LOST, LOST)
    found["number"] = np.column_stack((keys >> 32, np.where(at_wall, WALL, lower - 1)))
    found["a"], found["b"] = state.index_of(found["number"]).T
    found["wall"] = np.where(number < FIRST_OBSTACLE, number, -1)
    found["obstacle"] = np.where((number >= FIRST_OBSTACLE) & (number < LOST), number - FIRST_OBSTACLE, -1)
    return found
