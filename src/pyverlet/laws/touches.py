"""Who touched whom in the last frame, where, and how hard: `Touches` keeps what the contact law says of it.

What each contact has given is noted substep by substep; where it is, and its normal, are those of the end of the frame.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.ground.arrays import Array, Floats
from pyverlet.laws.events import WALL, between, renumber
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.laws.rooms import Boundary, Open
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

NOBODY = -1

TOUCH = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("wall", np.int64), ("obstacle", np.int64), ("point", np.float64, (2,)),
        ("normal", np.float64, (2,)), ("impulse", np.float64), ("rub", np.float64), ("number", np.int64, (2,)),
    ]
)  # fmt: skip
"""A contact: circle a and circle b, or b = -1 and the number of a wall or of an obstacle (the others are -1); where they touch,
m; the unit normal out of a; what pushes them apart along it and what rubs a along (-n_y, n_x), summed over the frame, N s; the
numbers (`world.number`) of both circles, -1 in the place of b."""

_NEAR = 0.02
"""Of its radius: obstacles whose rim is farther from a circle's when the frame is over are looked for among all."""


_NO_PAIRS = np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 2))


class Pushes(NamedTuple):
    """What pushes circles, on the average of a frame."""

    pairs: Array
    """(m, 2) numbers of the circles; twice the same where a circle leans on walls, or on obstacles."""
    force: Floats
    """(m,) N, what pushes them apart."""
    angle: Floats
    """(m,) rad, of the normal out of the first."""


class Met(NamedTuple):
    """What walls and obstacles have given circles, in any order."""

    who: Array
    """(k,) circles."""
    at_obstacle: Array
    """Whether by an obstacle, else by a wall."""
    number: Array
    """Of the obstacle or wall."""
    given: Floats
    """(k, 4) N s: the impulse (2), and what it was out of the surface and along (n_y, -n_x)."""


class Touches:
    """The contacts of the last frame. Indices are those of its end."""

    def __init__(self) -> None:
        self._hearing: list[tuple[Array, Array, Floats]] = []  # in the frame under way
        self._shown: list[Array] = []  # what `array` has returned of this frame; the last is that of now, if `_is_shown`
        self._is_shown = False
        # Of the last frame: its length, s; what was heard in it, and met with walls and obstacles; what circles were like then.
        self._dt, self._heard, self._virial = np.inf, self._hearing, 0.0
        none = Met(np.empty(0, np.int64), np.empty(0, bool), np.empty(0, np.int64), np.empty((0, 4)))
        self._given, self._obstacles = [none, none], list[Any]()
        self._numbers, self._position, self._radius = none.who, none.given[:, :2], none.given[:, 0]
        self._room: Boundary = Open()
        self._at_obstacles = none.given[:, 0], none.given[:, :2]

    def open(self) -> None:
        """A frame begins."""
        self._hearing = []

    def close(
        self, state: Slots, users: State, met: Met, room: Boundary, obstacles: ObstacleArrays, dt: float, virial: float
    ) -> None:  # fmt: skip
        """The frame of dt seconds is over. virial: of contacts between circles, N s m."""
        self._shown, self._is_shown = [], False
        self._dt, self._heard, self._virial = dt, self._hearing, virial
        self._given, self._obstacles = [_summed(met, at_obstacle) for at_obstacle in (False, True)], obstacles.seen
        self._room = room
        self._numbers, order = users.number.copy(), state.particle
        self._position, self._radius = np.empty((len(state), 2)), np.empty(len(state))
        self._position[order], self._radius[order] = state.position, state.radius
        met = self._given[1]
        within = (1 + _NEAR) * float(self._radius[met.who].max(initial=0.0))
        self._at_obstacles = obstacles.facing(self._position[met.who], met.number, within=within, ahead=dt)

    def hear(self, state: Slots, i: Array, j: Array, impulse: Floats) -> None:
        """In any substep: what slots i (k,) have given slots j, (k, 2) N s; it need not come sorted."""
        first, second, heard = state.particle[i].astype(np.int64), state.particle[j].astype(np.int64), self._hearing
        if heard and np.array_equal(heard[-1][0], first) and np.array_equal(heard[-1][1], second):
            heard[-1][2][:] += impulse  # at rest, pairs are those of the substep before: an eighth is left to be sorted
        else:
            heard.append((first, second, np.array(impulse, float)))

    def array(self, state: State) -> Array:
        """TOUCH, sorted by a, then b; without removed particles. It is renumbered when particles are removed later."""
        if not self._is_shown:
            self._shown.append(self._renumbered(self._contacts(), state))
            self._is_shown = True
        return self._shown[-1]

    def renumber(self, now: Array) -> None:
        """Particles are now at `now` (n,), or removed (-1): arrays of this frame that were returned say so."""
        for shown in self._shown:
            renumber(shown, now)
        self._is_shown = False

    def force_on(self, what: Any, room: Boundary) -> Floats:
        """(2,) N, by all circles, averaged over the frame."""
        met, given = self._given[1], self._given[0].given
        if what is not room:
            given = met.given[met.number == (self._obstacles.index(what) if what in self._obstacles else NOBODY)]
        return np.asarray(0 - given[:, :2].sum(axis=0) / self._dt)

    def pushed(self) -> float:
        """N, the sum of what walls of the room were pushed with along their normals, averaged over the frame."""
        return float(self._given[0].given[:, 2].sum() / self._dt)

    def virial(self) -> float:
        """J, sum over contacts between circles of force times distance, averaged over the frame."""
        return self._virial / self._dt

    def _renumbered(self, found: Array, state: State) -> Array:
        """With the indices of now; `state` is as it was, but for removed particles and new ones at its end."""
        if np.array_equal(self._numbers, state.shown["number"][: len(self._numbers)]):
            return found
        where = state.index_of(self._numbers)
        lives = where >= 0
        kept: Array = found[lives[found["a"]] & ((found["b"] < 0) | lives[found["b"]])]
        kept["a"] = where[kept["a"]]
        kept["b"] = np.where(kept["b"] < 0, WALL, where[kept["b"]])
        return kept

    def pushes(self) -> Pushes | None:
        """What circles were pushed with, walls and obstacles each as one; None if there was no frame."""
        if np.isinf(self._dt):
            return None
        between = self._between_circles()
        pairs, force = [np.column_stack((between["a"], between["b"]))], [between["impulse"]]
        angle = [np.arctan2(between["normal"][:, 1], between["normal"][:, 0])]
        for met in self._given:
            who, where = np.unique(met.who, return_inverse=True)
            x, y = (-np.bincount(where, column, len(who)) for column in met.given[:, :2].T)  # against what pushes it
            pairs.append(np.column_stack((who, who)))
            force.append(np.hypot(x, y))
            angle.append(np.arctan2(y, x))
        return Pushes(self._numbers[np.concatenate(pairs)], np.concatenate(force) / self._dt, np.concatenate(angle))

    def _contacts(self) -> Array:
        """TOUCH, by the indices of then."""
        parts = [self._at(True), self._at(False), self._between_circles()]  # each is sorted, and of one circle they come so
        order = np.argsort(np.concatenate([part["a"] for part in parts]), kind="stable")
        found, rank = np.empty(len(order), TOUCH), np.empty(len(order), np.int64)
        rank[order], begun = np.arange(len(order)), 0
        for part in parts:
            place = rank[begun : (begun := begun + len(part["a"]))]
            for name, column in part.items():
                found[name][place] = column
        number = np.append(self._numbers, NOBODY)  # of index -1, too
        found["number"] = np.column_stack((number[found["a"]], number[found["b"]]))
        return found

    def _at(self, obstacles: bool) -> dict[str, Any]:
        """The columns of TOUCH but for numbers, of walls or obstacles."""
        met = self._given[obstacles]
        x = self._position[met.who]
        if obstacles:
            gap, into = self._at_obstacles
        else:
            facing = self._room.facing(x) or (np.empty((0, 0)), np.empty((0, 0, 2)))
            gap, into = (each[np.arange(len(x)), met.number] for each in facing)
        columns = {
            "a": met.who,
            "b": np.full(len(x), WALL),
            "wall": np.full(len(x), NOBODY) if obstacles else met.number,
            "obstacle": met.number if obstacles else np.full(len(x), NOBODY),
            "normal": -into,
            "point": self._room.seam.wrapped(x - gap[:, None] * into),
            "impulse": met.given[:, 2],
            "rub": 0 - met.given[:, 3],
        }
        gave = (columns["impulse"] != 0) | (columns["rub"] != 0)
        return {name: column[gave] for name, column in columns.items()}

    def _between_circles(self) -> dict[str, Any]:
        """The columns of TOUCH but for numbers, of pairs of circles."""
        i, j, given = (np.concatenate(parts) for parts in zip(_NO_PAIRS, *self._heard, strict=True))
        swap, count = i > j, len(self._radius) + 1
        low, high = np.where(swap, j, i), np.where(swap, i, j)
        key, total = _sums(low * count + high, np.where(swap[:, None], -given, given))
        a, b, got = key // count, key % count, -total
        point, n = between(self._room.seam, self._position[a], self._position[b], self._radius[a], self._radius[b])
        return {
            "a": a,
            "b": b,
            "wall": NOBODY,
            "obstacle": NOBODY,
            "point": point,
            "normal": n,
            "impulse": -got[:, 0] * n[:, 0] - got[:, 1] * n[:, 1],
            "rub": got[:, 1] * n[:, 0] - got[:, 0] * n[:, 1],
        }


def _summed(met: Met, at_obstacle: bool) -> Met:
    """What was met with walls, or with obstacles, once for each of them and each circle."""
    mine = met.at_obstacle == at_obstacle
    number, given = met.number[mine], met.given[mine]
    most = int(number.max(initial=0)) + 1
    key, total = _sums(met.who[mine] * most + number, given)
    return Met(key // most, np.full(len(key), at_obstacle), key % most, total)


def _sums(key: Array, given: Array) -> tuple[Array, Floats]:
    """The keys, sorted, each once, and the sums of the rows of `given` that have it."""
    known, where = np.unique(key, return_inverse=True)
    return known, np.column_stack([np.bincount(where, column, len(known)).astype(float) for column in given.T])
