"""Spatial queries, vectorised: which particle covers a point, which are in a box or a circle, which are nearest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array, Floats, Indices
from pyverlet.common.errors import InputError
from pyverlet.common.shown import count
from pyverlet.common.step_lock import Shared, between_frames
from pyverlet.core import unit
from pyverlet.state.neighbours import FEW, Images, Near, cells_of, check_range, near, regions
from pyverlet.state.periodicity import Periodicity
from pyverlet.state.state import State, may_collide

ROUNDING = 1e-9
"""Tolerance of overlap tests: a circle that just fits is not refused for rounding."""

MOST_LISTS = 8
"""Most cell lists that are cached while nothing moves."""

DIGITS = 4
"""Units in the last place of the largest coordinate by which touching circles may overlap."""


class Nearest(NamedTuple):
    """The nearest centres, nearest first."""

    particle: Indices
    """(q, k) indices; -1 where the world has fewer than k."""
    distance: Floats
    """(q, k) from the point to the centre, m; infinity where there is none."""

    def __repr__(self) -> str:
        points, most = self.particle.shape
        return f"Nearest of {count(points, 'point')}, {count(most, 'particle')} each"


class Queries(Shared):
    """Spatial queries of a world. Indices are those of its arrays; ties are ordered by index."""

    _state: State
    _kept: tuple[Array, Array, dict[tuple[Any, ...], Any]] | None = None
    """Cache: positions and radii at the last query, and the results of `_seen` for them."""

    @between_frames
    def at_point(self, points: ArrayLike) -> Indices:
        """(q,) the particle whose disc covers each point (q, 2) or (2,), m; of several the nearest centre, -1 for none."""
        where = checks.rows("points", points, np.dtype(float))
        found = np.full(len(where), -1, np.int64)
        q, i, square = self._discs_at(where, np.zeros(len(where)))
        least = np.full(len(where), np.inf)
        np.minimum.at(least, q, square)
        best = np.flatnonzero(square == least[q])[::-1]  # the first of several is written last
        found[q[best]] = i[best]
        return found

    @between_frames
    def in_box(self, lower: ArrayLike, upper: ArrayLike) -> Indices:
        """The particles whose centre is in the box from `lower` to `upper`, rim included, ascending.

        Args:
            lower: (2,) the lower left corner, m, or (q, 2) of many boxes.
            upper: (2,) or (q, 2), the upper right corner.

        Returns:
            (k,) indices; for many boxes (k, 2), rows of box and particle.
        """
        low, high = (checks.rows(name, value, np.dtype(float)) for name, value in (("lower", lower), ("upper", upper)))
        low, high = alike("lower", low, "upper", high)
        if (wrong := np.flatnonzero((low > high).any(axis=1))).size:
            first, below = high[wrong[0]].tolist(), low[wrong[0]].tolist()
            raise InputError(
                f"upper[{wrong[0]}] is {tuple(first)}; allowed is a corner above and to the right of lower, {tuple(below)}"
            )
        return self._in(low, high, low, np.full(len(low), np.inf), many=np.ndim(lower) > 1 or np.ndim(upper) > 1)

    @between_frames
    def in_circle(self, center: ArrayLike, radius: ArrayLike) -> Indices:
        """The particles whose centre is no farther than `radius` from `center`, ascending.

        Args:
            center: (2,) m, or (q, 2) of many circles.
            radius: m, at least 0, or (q,).

        Returns:
            (k,) indices; for many circles (k, 2), rows of circle and particle.
        """
        middle, size = circles("center", center, radius)
        box = size[:, None]
        return self._in(middle - box, middle + box, middle, size, many=np.ndim(center) > 1 or np.ndim(radius) > 0)

    @between_frames
    def nearest(self, points: ArrayLike, k: int = 1) -> Nearest:
        """The k particles whose centres are nearest to each point (q, 2) or (2,), m."""
        where = checks.rows("points", points, np.dtype(float))
        count = checks.integer("k", k)
        periodic, found = self._state.periodic, []
        for shift in periodic.images():
            found.append((np.full((len(where), count), -1, np.int64), np.full((len(where), count), np.inf)))
            if len(self._state):
                (position, *_), cells = self._seen(len(where))
                unit("tools", position.dtype).nearest_to(periodic.wrapped(where) - shift, cells, position, *found[-1])
        index, square = (np.concatenate(columns, axis=1) for columns in zip(*found, strict=True))
        return _nearest(index, square, count)

    @between_frames
    def neighbours(self, range: float) -> Near:  # noqa: A002  (the word of pair_force, too)
        """All pairs of particles whose centres are nearer to each other than `range`, i < j, ascending by i, then j.

        Pairs at the very same place are left out: they have no direction. The time grows with the number of pairs, not with its
        square.

        Args:
            range: m; in a periodic room, where distances are those of the nearest images, at most half of its shortest period.

        Returns:
            i, j: (k,) int32 indices; distance: (k,) m; way: (k, 2), unit vectors from i to j; both float64.
        """
        return near(self._state.position, check_range(range, self._state.periodic), self._state.periodic)

    def _seen(self, questions: int, margin: float | None = None, reach: float | None = None) -> tuple[Images, tuple[Any, ...]]:
        """Particles and their images within `margin` m of a periodic room, and the result of `cells_of`.

        margin: None for no images. reach: of discs; None for centres. The result is cached while nothing moves.
        """
        s, few = self._state, questions <= FEW
        here = s.position, s.radius
        known = self._kept is not None and all(map(np.array_equal, self._kept[:2], here))
        if not known and not few:
            self._kept = s.position.copy(), s.radius.copy(), {}
        position, radius, lists = self._kept if self._kept and (known or not few) else (*here, {})
        key = margin if s.periodic else None, reach, s.periodic
        if key not in lists:
            if len(lists) == MOST_LISTS:
                lists.clear()
            seen = (
                Images(s.periodic.wrapped(position), radius, None)
                if key[0] is None
                else Images.of(position, radius, s.periodic, key[0])
            )
            lists[key] = seen, cells_of(seen.position, seen.radius if reach is not None else None, reach or 0.0, few=few)
        found: tuple[Images, tuple[Any, ...]] = lists[key]
        return found

    def _discs_at(self, middle: Floats, size: Floats) -> tuple[Indices, Indices, Floats]:
        """Particles that circles about `middle` (q, 2) of radii (q,) overlap or touch: circle (k,), particle (k,), ascending, and
        the squared distance (k,) of their centres, m^2.
        """
        s = self._state
        reach = size + float(s.radius.max(initial=0.0))
        q, i = self._in(middle - reach[:, None], middle + reach[:, None], middle, reach, many=True).T
        square = (s.periodic.nearest(s.position[i] - middle[q]) ** 2).sum(axis=1)
        touch = square <= (size[q] + s.radius[i]) ** 2
        return q[touch], i[touch], square[touch]

    def _in(self, low: Floats, high: Floats, middle: Floats, size: Floats, *, many: bool) -> Indices:
        pairs, periodic = np.zeros((0, 2), np.int64), self._state.periodic
        if len(self._state) and len(low):
            if periodic:
                low, high, middle = _in_first_period(low, high, middle, size, periodic)
            seen, cells = self._seen(len(low), float((high - low).max()) if periodic else None)
            region, particle = regions(low, high, middle, size, cells, seen.position)
            keys = np.sort(region * len(self._state) + seen.named(particle))
            keys = keys[np.diff(keys, prepend=-1) > 0] if periodic else keys  # a region may contain two images of a particle
            pairs = np.column_stack(np.divmod(keys, len(self._state)))
        return pairs if many else np.ascontiguousarray(pairs[:, 1])


def _in_first_period(
    low: Floats, high: Floats, middle: Floats, size: Floats, periodic: Periodicity
) -> tuple[Floats, Floats, Floats]:
    """Regions shifted by whole periods into the room; boxes are at most one period wide."""
    where = np.where(np.isfinite(size)[:, None], middle, low)
    move = periodic.wrapped(where) - where
    low, high, middle = low + move, high + move, middle + move
    for axis, (corner, period) in enumerate(((periodic.low_x, periodic.period_x), (periodic.low_y, periodic.period_y))):
        wide = (high[:, axis] - low[:, axis] >= period) & np.isinf(size) if period > 0 else np.zeros(len(low), bool)
        low[wide, axis], high[wide, axis] = corner, corner + period
    return low, high, middle


def _nearest(index: Indices, square: Floats, count: int) -> Nearest:
    """The nearest particles of each row (q, k), each once, by their squared distances."""
    order = np.lexsort((square, index), axis=1)
    index, square = np.take_along_axis(index, order, 1), np.take_along_axis(square, order, 1)
    again = np.diff(index, axis=1, prepend=-2) == 0  # a farther image of the same particle
    index[again], square[again] = -1, np.inf
    order = np.lexsort((index, square), axis=1)[:, :count]
    return Nearest(np.take_along_axis(index, order, 1), np.sqrt(np.take_along_axis(square, order, 1)))


def alike(first: str, a: Floats, second: str, b: Floats) -> tuple[Floats, Floats]:
    """Broadcast a single row to the length of the other array."""
    try:
        return tuple(map(np.ascontiguousarray, np.broadcast_arrays(a, b)))  # type: ignore[return-value]
    except ValueError:
        raise InputError(f"{second} has {len(b)} rows; allowed are 1 or {len(a)}, as many as {first}") from None


def circles(name: str, center: ArrayLike, radius: ArrayLike) -> tuple[Floats, Floats]:
    """Checked centres (q, 2) and radii (q,), m; a single one of either is broadcast."""
    middle, size = checks.rows(name, center, np.dtype(float)), checks.numeric("radius", radius, np.dtype(float))
    if size.ndim == 1 and len(middle) == 1:
        middle = np.broadcast_to(middle, (len(size), 2))
    size = checks.column("radius", size, np.dtype(float), len(middle))
    checks.within("radius", size, 0.0, np.inf)
    return np.ascontiguousarray(middle), np.ascontiguousarray(size)


# ---- which circles overlap others that are there, or that come with them ------------------------------------------------------


def overlapping(points: Floats, radius: Floats, position: Floats, size: Floats) -> NDArray[np.int64]:
    """(m, 2) rows (k, i): the circle about points[k] (k, 2) overlaps that about position[i] (n, 2); radii (k,) and (n,), m."""
    if not len(points) or not len(position):
        return np.zeros((0, 2), np.int64)
    reach = radius + float(size.max())
    far = reach[:, None]
    k, i = regions(points - far, points + far, points, reach, cells_of(position, few=len(points) <= FEW), position)
    between = np.hypot(*(points[k] - position[i]).T)
    return np.asarray(np.column_stack((k, i))[between < (radius[k] + size[i]) * (1 - ROUNDING)])


def on_others(state: State, new: Mapping[str, Array]) -> NDArray[np.int64]:
    """(m, 2) rows (k, i), sorted: new particle k overlaps particle i and would collide with it.

    Indices i after those of `state` are new particles before k. Pairs of pinned particles are left out.

    Args:
        state: the existing particles.
        new: arrays of the new particles by name, as for `State.append`.
    """
    position, radius, mass, category, mask = (
        np.concatenate((getattr(state, name), new[name])) for name in ("position", "radius", "mass", "category", "mask")
    )
    j, i = on_top(position, radius, len(state), state.periodic).T
    apart = may_collide(category[i], mask[i], category[j], mask[j]) & np.isfinite(np.minimum(mass[i], mass[j]))
    return np.column_stack((j[apart] - len(state), i[apart]))


def on_top(position: Array, radius: Array, there: int, periodic: Periodicity) -> NDArray[np.int64]:
    """(m, 2) rows (j, i), sorted: circle j >= `there` overlaps circle i < j. position: (n, 2), radius: (n,), m."""
    size = radius.astype(np.float64)
    first = periodic.wrapped(np.ascontiguousarray(position[there:])).astype(np.float64)
    seen = Images.of(position, size, periodic, 2 * float(size.max(initial=0.0)))
    places = seen.position.astype(np.float64)
    slack = DIGITS * float(np.finfo(position.dtype).eps) * float(np.abs(places).max(initial=0.0))
    k, image = overlapping(first, size[there:] - slack, places, seen.radius).T
    i, j = seen.named(image), there + k
    return np.unique(np.column_stack((j, i))[i < j], axis=0)


def free_in_order(pairs: NDArray[np.int64], there: int, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) which new particles to add in order: allowed ones that overlap no particle added before them.

    pairs: the result of `on_others`; there: number of existing particles.
    """
    free: NDArray[np.bool_] = allowed.copy()
    for k, i in pairs.tolist():
        free[k] &= i >= there and not free[i - there]
    return free
