"""Who touched whom in the last frame, where, and how hard: `Touches` notes what each stage gives to every circle.

What walls, obstacles and other circles have given a circle is what its momentum changed by in their stages: true whatever solves
them. Of one wall or obstacle that is all there is to know. Between several, and between circles, it is shared out along the
lines of contact: pushes only, the smallest that explain what each has got. A solver that knows the impulses of its pairs says so
(`hear`), and nothing has to be found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels.impulses import least
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
        ("normal", np.float64, (2,)), ("impulse", np.float64), ("rub", np.float64),
    ]
)  # fmt: skip
"""A contact: circle a and circle b, or b = -1 and the number of a wall or of an obstacle (the others are -1); where they touch,
m; the unit normal out of a; what pushes them apart along it and what rubs a along (-n_y, n_x), summed over the frame, N s."""

_NEAR = 0.02
"""Of its radius: walls that are farther than the nearest by more were not touched."""

_PARALLEL = 1e-10
"""Added to the squares of normals, so that walls that face each other are told apart."""

_FEW = 1e-7
"""Of the largest impulse: less is none."""

_STEPS, _PAIR_STEPS = 60, 250_000
"""Of conjugate gradients, all together: so many, and so many more divided by the number of contacts: less than a step takes."""

_LEFT = 1e-4
"""Part of the gradient that may be left."""

_FEW_PAIRS, _EXACT = 200, 1e-10
"""The same for so few pairs, where it costs next to nothing."""

_STAGES = {"contacts": 0, "velocities": 0, "bounds": 1, "obstacles": 2}
"""Whose doing it is when a stage has changed velocities: circles', the room's, obstacles'."""


class Noted(NamedTuple):
    """What is known of a frame, by the order of the user's particles in it."""

    number: Array
    """(n,) what each is called."""
    position: Floats
    """(n, 2) m."""
    radius: Floats
    """(n,) m."""
    free: NDArray[np.bool_]
    """(n,) not pinned."""
    got: Floats
    """(3, n, 2) N s, what circles, walls and obstacles have given to each."""
    pairs: Array
    """(k, 2) that may touch."""
    dt: float
    """s, of the frame."""


class Touches:
    """The contacts of the last frame. Indices are those of its end."""

    def __init__(self) -> None:
        none, nobody = np.zeros(0), np.zeros((0, 2))
        least(np.zeros(0, np.int64), np.zeros(0, np.int64), nobody, nobody, none, none, 0, 0.0)  # compiled before it is asked
        self._given = np.zeros((3, 0, 2))
        self._heard: list[tuple[Array, Array, Floats]] = []
        self._found: Array | None = None
        self._end: _End | None = None
        self._shown: list[Array] = []  # what `array` has returned of this frame; the last is that of now, if `_is_shown`
        self._is_shown = False
        self._virial = 0.0

    def frame(
        self, state: Slots, users: State, h: float, room: Boundary, course: Course,
        listed: Callable[[], tuple[Array, Array, Array, Array]] | None, virial: Callable[[], float] | None,
        done: Callable[[str], None],
    ) -> Callable[[str], None]:  # fmt: skip
        """A frame of substeps of h seconds, to be told of each stage; it passes on what it is told to `done`.

        Args:
            state, users: the engine's arrays, and the user's.
            h: s.
            room, course: walls and obstacles.
            listed: says which pairs may touch, as first, count, pair_i, pair_j; None if there are no collisions.
            virial: says what contacts between circles come to, N s m; None where that is not known.
            done: told of each stage.
        """
        before, steps = state.velocity, 0

        def told(stage: str) -> None:
            nonlocal before, steps
            done(stage)
            if stage == "gather":
                self.open(len(state))
                steps = 0
            elif stage in _STAGES:
                self._note(_STAGES[stage], state, before)
            elif stage == "integrate":
                steps += 1
            elif stage == "finish":
                pairs = np.empty((0, 2), np.int64) if listed is None else _rows(*listed(), state.particle)
                self.close(state, users, room, course, pairs, steps * h, virial() if virial else 0.0)
            before = state.velocity.copy()

        return told

    def open(self, count: int) -> None:
        """A frame of so many particles begins."""
        self._given, self._heard = np.zeros((3, count, 2)), []

    def give(self, whose: int, particle: Array, impulse: Floats) -> None:
        """Particles (k,), by the user's index, have got (k, 2) N s of circles (0), walls (1) or obstacles (2)."""
        for axis in range(2):
            self._given[whose, :, axis] += np.bincount(particle, impulse[:, axis], self._given.shape[1])

    def close(
        self, state: Slots, users: State, room: Boundary, course: Course, pairs: Array, dt: float, virial: float
    ) -> None:  # fmt: skip
        """The frame of dt seconds is over. pairs: (k, 2) that may have touched; virial: of contacts between circles, N s m."""
        self._end = _End(state, users.number.copy(), self._given, self._heard, room, course, pairs, dt)
        self._found, self._shown, self._is_shown = None, [], False
        self._virial = virial

    def _note(self, whose: int, state: Slots, before: Array) -> None:
        now = state.velocity
        moved = np.flatnonzero(((now[:, 0] != before[:, 0]) | (now[:, 1] != before[:, 1])) & (state.inverse_mass > 0))
        change = state.velocity[moved].astype(float) - before[moved]
        self._given[whose, state.particle[moved]] += state.mass[moved, None] * change

    def hear(self, state: Slots, i: Array, j: Array, impulse: Floats) -> None:
        """A contact solver's word, in any substep: what slots i (k,) have given slots j, (k, 2) N s; it need not come sorted."""
        self._heard.append((state.particle[i].astype(np.int64), state.particle[j].astype(np.int64), np.array(impulse, float)))

    def pairs_heard(self) -> Array:
        """(k, 2) user's indices, sorted, of those that have given each other something in this frame."""
        rows = [np.sort(np.column_stack((i, j)), axis=1) for i, j, _ in self._heard]
        return np.unique(np.concatenate([np.empty((0, 2), np.int64), *rows]), axis=0)

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

    def noted(self) -> Noted | None:
        """What was noted of the last frame, before anything is made of it; None if there was no frame."""
        end = self._end
        if end is None:
            return None
        return Noted(end._numbers, end._position, end._radius, end._free, end.given, end._pairs, end.dt)

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
        self, state: Slots, numbers: Array, given: Floats, heard: list[tuple[Array, Array, Floats]], room: Boundary,
        course: Course, pairs: Array, dt: float,
    ) -> None:  # fmt: skip
        count = len(state)
        self.given, self._heard, self._room, self.dt = given, heard, room, dt
        self._numbers, self._pairs = numbers, pairs
        self._position, self._velocity, self._radius = np.empty((count, 2)), np.empty((count, 2)), np.empty(count)
        self._free = np.empty(count, bool)
        order = state.particle
        self._position[order], self._velocity[order], self._radius[order] = state.position, state.velocity, state.size
        self._free[order] = state.inverse_mass > 0
        self._obstacles, self._found = course.seen(), dict[int, Array]()
        who = np.flatnonzero(given[2].any(axis=1))
        r = self._radius[who]
        within = (1 + 2 * _NEAR) * float(r.max(initial=0.0))
        self._beside = course.facing(self._position[who], _NEAR * r, within=within, ahead=dt)

    def number_of(self, obstacle: Any) -> int:
        """Among the obstacles of then; -2 if it was none."""
        return self._obstacles.index(obstacle) if obstacle in self._obstacles else -2

    def renumbered(self, found: Array, state: State) -> Array:
        """With the indices of now; `state` is as it was, but for removed particles and new ones at its end."""
        if np.array_equal(self._numbers, state.number[: len(self._numbers)]):
            return found.copy()
        where = np.searchsorted(state.number, self._numbers)
        lives = where < len(state)
        lives[lives] = state.number[where[lives]] == self._numbers[lives]
        kept: Array = found[lives[found["a"]] & ((found["b"] < 0) | lives[found["b"]])].copy()
        kept["a"] = where[kept["a"]]
        kept["b"] = np.where(kept["b"] < 0, WALL, where[kept["b"]])
        return kept

    def contacts(self) -> Array:
        """TOUCH, by the indices of then."""
        rows = [self._between_circles(), self.at(1), self.at(2)]
        both = np.concatenate(rows)
        return both[np.lexsort((both["obstacle"], both["wall"], both["b"], both["a"]))]

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
        pairs, impulse = self._told() if self._heard else self._solved()
        found = np.zeros(len(pairs), TOUCH)
        if len(pairs):
            a, b = pairs.T
            way = self._way(a, b)
            far = np.hypot(way[:, 0], way[:, 1])
            normal = way / np.maximum(far, 1e-300)[:, None]
            found["a"], found["b"], found["wall"], found["obstacle"], found["normal"] = a, b, NOBODY, NOBODY, normal
            half = self._radius[a] + 0.5 * (far - self._radius[a] - self._radius[b])
            found["point"] = self._room.seam.wrapped(self._position[a] + half[:, None] * normal)
            _write(found, -impulse)
        return found

    def _way(self, a: Array, b: Array) -> Floats:
        """(k, 2) from a to b, m."""
        return np.asarray(self._room.seam.nearest(self._position[b] - self._position[a]))

    def _told(self) -> tuple[Array, Floats]:
        """(k, 2) a < b, and (k, 2) what a has given b, as the solver says."""
        i, j, given = (np.concatenate(parts) for parts in zip(*self._heard, strict=True))
        swap = i > j
        low, high = np.where(swap, j, i), np.where(swap, i, j)
        given = np.where(swap[:, None], -given, given)
        key, where = np.unique(low * (len(self._radius) + 1) + high, return_inverse=True)
        total = np.column_stack([np.bincount(where, column, len(key)) for column in given.T])
        return np.column_stack(np.divmod(key, len(self._radius) + 1)), total.astype(float)

    def _solved(self) -> tuple[Array, Floats]:
        """The same from what each circle has got: pushes along the normals, the smallest that explain it."""
        got, free, (a, b) = self.given[0], self._free, np.ascontiguousarray(self._pairs.T)
        touched = (got[:, 0] != 0) | (got[:, 1] != 0) | ~free
        may = touched[a] & touched[b] & (free[a] | free[b])
        a, b = a[may], b[may]
        way, speed, reach = self._way(a, b), self._velocity[b] - self._velocity[a], self._radius[a] + self._radius[b]
        far = np.hypot(way[:, 0], way[:, 1])
        which = np.flatnonzero(far - reach <= self.dt * np.hypot(speed[:, 0], speed[:, 1]) + 0.01 * reach)
        which = which[np.argsort(a[which] % 7, kind="stable")]  # neighbours in the list have no circle in common
        a, b, normal = a[which], b[which], way[which] / np.maximum(far[which], 1e-300)[:, None]
        push, steps = np.zeros(len(a)), _STEPS + _PAIR_STEPS // max(len(a), 1)
        last, hold = _EXACT if len(a) <= _FEW_PAIRS else _LEFT, free.astype(float)
        tolerance = last if last == _EXACT else 10 * _LEFT  # good enough to see who would pull
        while len(a) and steps > 0:
            steps -= int(least(a, b, normal, got, hold, push, steps, tolerance))
            kept = push >= 0
            if kept.all():
                if tolerance == last:
                    break
                tolerance = last
            a, b, normal, push = a[kept], b[kept], normal[kept], push[kept]
        kept = push > _FEW * push.max(initial=0.0)
        a, b, normal, push = a[kept], b[kept], normal[kept], push[kept]
        return np.column_stack((a, b)), push[:, None] * normal


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


def _rows(first: Array, count: Array, pair_i: Array, pair_j: Array, order: Array) -> Array:
    """(k, 2) the user's a < b of each listed pair, once."""
    which = np.concatenate([np.zeros(0, np.int64), *(np.arange(f, f + c) for f, c in zip(first, count, strict=True))])
    i, j = order[pair_i[which]].astype(np.int64), order[pair_j[which]].astype(np.int64)
    keys = np.sort(np.minimum(i, j) * len(order) + np.maximum(i, j))
    once = np.ones(len(keys), bool)
    np.not_equal(keys[1:], keys[:-1], out=once[1:])
    return np.column_stack(np.divmod(keys[once], max(len(order), 1)))
