"""Who touched whom in the last frame, where, and how hard: `Touches` keeps what the contact law says of it.

Of circles it tells what each pair has given each other. Of walls and obstacles it tells what all walls, and all obstacles, have
given each circle: between several it is shared out along the lines of contact.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.events import WALL, renumber
from pyverlet.laws.obstacles import Course, Facing
from pyverlet.laws.rooms import Boundary
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Array = NDArray[Any]
Floats = NDArray[np.float64]

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
"""Of its radius: walls that are farther than the nearest by more were not touched."""

_PARALLEL = 1e-10
"""Added to the squares of normals, so that walls that face each other are told apart."""


class Pushes(NamedTuple):
    """What pushes circles, on the average of a frame."""

    pairs: Array
    """(m, 2) numbers of the circles; twice the same where a circle leans on walls, or on obstacles."""
    force: Floats
    """(m,) N, what pushes them apart."""
    angle: Floats
    """(m,) rad, of the normal out of the first."""


class Touches:
    """The contacts of the last frame. Indices are those of its end."""

    def __init__(self) -> None:
        self._given = np.zeros((3, 0, 2))
        self._heard: list[tuple[Array, Array, Floats]] = []
        self._found: Array | None = None
        self._end: _End | None = None
        self._shown: list[Array] = []  # what `array` has returned of this frame; the last is that of now, if `_is_shown`
        self._is_shown = False
        self._virial = 0.0

    def open(self, count: int) -> None:
        """A frame of so many particles begins."""
        self._given, self._heard = np.zeros((3, count, 2)), []

    def give(self, whose: int, particle: Array, impulse: Floats) -> None:
        """Particles (k,), by the user's index, have got (k, 2) N s of circles (0), walls (1) or obstacles (2)."""
        for axis in range(2):
            self._given[whose, :, axis] += np.bincount(particle, impulse[:, axis], self._given.shape[1])

    def close(
        self, state: Slots, users: State, room: Boundary, course: Course, dt: float, virial: float
    ) -> None:  # fmt: skip
        """The frame of dt seconds is over. virial: of contacts between circles, N s m."""
        self._end = _End(state, users, self._given, self._heard, room, course, dt)
        self._found, self._shown, self._is_shown = None, [], False
        self._virial = virial

    def hear(self, state: Slots, i: Array, j: Array, impulse: Floats) -> None:
        """In any substep: what slots i (k,) have given slots j, (k, 2) N s; it need not come sorted."""
        self._heard.append((state.particle[i].astype(np.int64), state.particle[j].astype(np.int64), np.array(impulse, float)))

    def array(self, state: State) -> Array:
        """TOUCH, sorted by a, then b; without removed particles. It is renumbered when particles are removed later."""
        if self._end is None:
            return np.zeros(0, TOUCH)
        if not self._is_shown:
            if self._found is None:
                self._found = self._end.contacts()
            self._shown.append(self._end.renumbered(self._found, state))
            self._is_shown = True
        return self._shown[-1]

    def renumber(self, now: Array) -> None:
        """Particles are now at `now` (n,), or removed (-1): arrays of this frame that were returned say so."""
        for shown in self._shown:
            renumber(shown, now)
        self._is_shown = False

    def force_on(self, what: Any, room: Boundary) -> Floats:
        """(2,) N, by all circles, averaged over the frame."""
        if self._end is None:
            return np.zeros(2)
        if what is room:
            return np.asarray(-self._end.given[1].sum(axis=0) / self._end.dt)
        found = self._end.at(2)
        mine = found[found["obstacle"] == self._end.number_of(what)]
        return np.asarray(vectors(mine).sum(axis=0) / self._end.dt)

    def pushes(self) -> Pushes | None:
        """What circles were pushed with in the last frame; None if there was none."""
        return None if self._end is None else self._end.pushes()

    def pushed(self) -> float:
        """N, the sum of what walls of the room were pushed with along their normals, averaged over the frame."""
        if self._end is None:
            return 0.0
        return float(self._end.at(1)["impulse"].sum() / self._end.dt)

    def virial(self) -> float:
        """J, sum over contacts between circles of force times distance, averaged over the frame."""
        return 0.0 if self._end is None else self._virial / self._end.dt


class _End:
    """What is known when a frame is over."""

    def __init__(
        self, state: Slots, users: State, given: Floats, heard: list[tuple[Array, Array, Floats]], room: Boundary,
        course: Course, dt: float,
    ) -> None:  # fmt: skip
        count = len(state)
        self.given, self._heard, self._room, self.dt = given, heard, room, dt
        self._numbers = users.number.copy()
        self._position, self._radius = np.empty((count, 2)), np.empty(count)
        self._free = np.empty(count, bool)
        order = state.particle
        self._position[order], self._radius[order] = state.position, state.radius
        self._free[order] = state.inverse_mass > 0
        self._obstacles, self._found = course.seen(), dict[int, Array]()
        who = np.flatnonzero(given[2].any(axis=1))
        r = self._radius[who]
        within = (1 + 2 * _NEAR) * float(r.max(initial=0.0))
        marks = users.category[who], users.mask[who]
        self._beside = course.facing(self._position[who], _NEAR * r, within=within, ahead=dt, marks=marks)

    def number_of(self, obstacle: Any) -> int:
        """Among the obstacles of then; -2 if it was none."""
        return self._obstacles.index(obstacle) if obstacle in self._obstacles else -2

    def renumbered(self, found: Array, state: State) -> Array:
        """With the indices of now; `state` is as it was, but for removed particles and new ones at its end."""
        if np.array_equal(self._numbers, state.number[: len(self._numbers)]):
            return found.copy()
        where = state.index_of(self._numbers)
        lives = where >= 0
        kept: Array = found[lives[found["a"]] & ((found["b"] < 0) | lives[found["b"]])].copy()
        kept["a"] = where[kept["a"]]
        kept["b"] = np.where(kept["b"] < 0, WALL, where[kept["b"]])
        return kept

    def contacts(self) -> Array:
        """TOUCH, by the indices of then."""
        rows = [self._between_circles(), self.at(1), self.at(2)]
        both = np.concatenate(rows)
        number = np.append(self._numbers, NOBODY)  # of index -1, too
        both["number"] = np.column_stack((number[both["a"]], number[both["b"]]))
        return both[np.lexsort((both["obstacle"], both["wall"], both["b"], both["a"]))]

    def pushes(self) -> Pushes:
        """All contacts, those with walls and those with obstacles each as one."""
        between = self._between_circles()
        pairs, force = [np.column_stack((between["a"], between["b"]))], [between["impulse"]]
        angle = [np.arctan2(between["normal"][:, 1], between["normal"][:, 0])]
        for given in self.given[1:]:
            who = np.flatnonzero(given.any(axis=1) & self._free)
            x, y = -given[who].T  # out of the circle, against what pushes it
            pairs.append(np.column_stack((who, who)))
            force.append(np.hypot(x, y))
            angle.append(np.arctan2(y, x))
        return Pushes(self._numbers[np.concatenate(pairs)], np.concatenate(force) / self.dt, np.concatenate(angle))

    # ---- walls and obstacles -------------------------------------------------------------------------------------------

    def at(self, whose: int) -> Array:
        """TOUCH, of walls (1) or obstacles (2)."""
        if whose not in self._found:
            self._found[whose] = self._at(whose)
        return self._found[whose]

    def _at(self, whose: int) -> Array:
        given = self.given[whose]
        who = np.flatnonzero(given.any(axis=1))
        if not len(who):
            return np.zeros(0, TOUCH)
        x, r, push = self._position[who], self._radius[who], given[who]
        row, wall, gap, into = self._beside if whose == 2 else _nearest_walls(self._room, x, r, push)
        share = _shared(push, row, into)
        found = np.zeros(len(row), TOUCH)
        found["a"], found["b"] = who[row], WALL
        found["wall"], found["obstacle"] = (wall, NOBODY) if whose == 1 else (NOBODY, wall)
        found["normal"] = -into
        found["point"] = self._room.seam.wrapped(x[row] - gap[:, None] * into)
        _write(found, share)
        return np.asarray(found[(found["impulse"] != 0) | (found["rub"] != 0)])

    # ---- circles -------------------------------------------------------------------------------------------------------

    def _between_circles(self) -> Array:
        pairs, impulse = self._told()
        found = np.zeros(len(pairs), TOUCH)
        a, b = pairs.T
        way = self._room.seam.nearest(self._position[b] - self._position[a])
        far = np.hypot(way[:, 0], way[:, 1])
        normal = way / np.maximum(far, 1e-300)[:, None]
        found["a"], found["b"], found["wall"], found["obstacle"], found["normal"] = a, b, NOBODY, NOBODY, normal
        half = self._radius[a] + 0.5 * (far - self._radius[a] - self._radius[b])
        found["point"] = self._room.seam.wrapped(self._position[a] + half[:, None] * normal)
        _write(found, -impulse)
        return found

    def _told(self) -> tuple[Array, Floats]:
        """(k, 2) a < b, and (k, 2) what a has given b."""
        if not self._heard:
            return np.empty((0, 2), np.int64), np.empty((0, 2))
        i, j, given = (np.concatenate(parts) for parts in zip(*self._heard, strict=True))
        swap = i > j
        low, high = np.where(swap, j, i), np.where(swap, i, j)
        given = np.where(swap[:, None], -given, given)
        key, where = np.unique(low * (len(self._radius) + 1) + high, return_inverse=True)
        total = np.column_stack([np.bincount(where, column, len(key)) for column in given.T])
        return np.column_stack(np.divmod(key, len(self._radius) + 1)), total.astype(float)


def vectors(found: Array) -> Floats:
    """(k, 2) N s, what a has given the other."""
    n = found["normal"]
    return np.asarray(found["impulse"][:, None] * n - found["rub"][:, None] * np.column_stack((-n[:, 1], n[:, 0])))


def _write(found: Array, got: Floats) -> None:
    """Split what a has got (k, 2) into what pushes and what rubs."""
    n = found["normal"]
    found["impulse"] = -got[:, 0] * n[:, 0] - got[:, 1] * n[:, 1]
    found["rub"] = got[:, 1] * n[:, 0] - got[:, 0] * n[:, 1]


def _nearest_walls(room: Boundary, x: Floats, r: Floats, push: Floats) -> Facing:
    """The walls of a room at which circles are that have got `push` (k, 2) from it."""
    facing = room.facing(x)
    if facing is None:  # a room of the user's own: all that is known is where it pushes to
        return Facing(np.arange(len(x)), np.zeros(len(x), np.int64), r, push / np.hypot(*push.T)[:, None])
    gap, into = facing
    row, wall = np.nonzero(gap <= gap.min(axis=1, keepdims=True) + _NEAR * r[:, None])
    return Facing(row, wall, gap[row, wall], into[row, wall])


def _shared(push: Floats, row: Array, into: Floats) -> Floats:
    """(k, 2) what a circle, its row of `push`, has got from each wall or obstacle at which it is, whose normal is `into`.

    Of several, as in a corner, each has given a part along its normal (least squares), and of the rest as much as of that.
    """
    share, several = push[row], np.bincount(row, minlength=len(push))
    for number in np.unique(several[several > 1]):
        mine = np.flatnonzero(several[row] == number).reshape(-1, number)  # rows are sorted
        normal, got = into[mine], push[row[mine[:, 0]]]
        gram = normal @ normal.transpose(0, 2, 1) + _PARALLEL * np.eye(number)
        part = np.linalg.solve(gram, normal @ got[:, :, None])[:, :, 0].clip(min=0)
        along = part[:, :, None] * normal
        total = part.sum(axis=1, keepdims=True)
        weight = np.divide(part, total, out=np.full_like(part, 1 / number), where=total > 0)
        share[mine] = along + weight[:, :, None] * (got - along.sum(axis=1))[:, None]
    return share
