"""Ray casts, circle casts and overlap queries among particles, obstacles and walls."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Floats, Indices
from pyverlet.common.errors import InputError
from pyverlet.common.shown import count
from pyverlet.common.step_lock import between_frames
from pyverlet.common.threads import max_threads
from pyverlet.core import unit
from pyverlet.laws.boundaries import Boundary, Box, Circle, Periodic
from pyverlet.laws.obstacles import ObstacleArrays, Obstacles
from pyverlet.laws.textbook import TextbookBoundary
from pyverlet.state.state import EVERYONE, may_collide
from pyverlet.world.queries import Queries, alike, circles

Kinds = tuple[NDArray[np.uint32], NDArray[np.uint32]]

RAYS_A_THREAD = 1024
"""Rays per extra thread: starting a thread costs as much as several hundred rays."""


class RayHits(NamedTuple):
    """First hits of rays or moving circles: a particle, an obstacle or a wall each."""

    particle: Indices
    """(q,) particle index; -1 for none."""
    distance: Floats
    """(q,) distance from the origin to the hit, or that the circle's centre travels, m; 0 from inside, infinity for no hit."""
    normal: Floats
    """(q, 2) unit normal out of the object hit, or from a wall into the room; 0 for none."""
    obstacle: Indices
    """(q,) index in `world.obstacles`; -1 for none."""
    wall: Indices
    """(q,) number of the room's side, as in events; -1 for none."""
    position: Floats
    """(q, 2) point of contact, m; NaN for none. In a periodic room it lies inside."""

    def __repr__(self) -> str:
        return f"RayHits of {count(len(self.particle), 'ray')}, {np.isfinite(self.distance).sum()} of which hit"


class Overlaps(NamedTuple):
    """Objects that circles overlap or touch, ascending: (k,) indices, or for many circles (k, 2) rows of circle and index."""

    particle: Indices
    obstacle: Indices
    """Indices in `world.obstacles`."""
    wall: Indices
    """Walls of the room, numbered as in events."""

    def __repr__(self) -> str:
        found = zip(("particle", "obstacle", "wall"), self, strict=True)
        return f"Overlaps with {', '.join(count(len(rows), name) for name, rows in found)}"


class Casts(Queries):
    """Ray and circle casts in a world.

    Rays and circles have 32 bits of `category` and `mask`, as particles have: a ray hits an object if each has a bit of its
    category in the other's mask. Walls are those of `Circle`, `Box` and `Periodic`; everything beyond them is solid.
    """

    boundary: Boundary
    obstacles: Obstacles
    _obstacle_arrays: ObstacleArrays
    _threads: int | None

    def ray(self, origin: ArrayLike, direction: ArrayLike, length: ArrayLike = np.inf, **among: Any) -> RayHits:
        """The first hit of each ray; keywords as for `circle_cast`.

        Args:
            origin: (q, 2) or (2,), m.
            direction: (q, 2) or (2,) direction; its length does not matter.
            length: range, m, or (q,). In a periodic room rays continue across the boundary, for at most 100 periods.
        """
        return self.circle_cast(origin, direction, 0.0, length, **among)

    @between_frames
    def circle_cast(
        self,
        origin: ArrayLike,
        direction: ArrayLike,
        radius: ArrayLike,
        length: ArrayLike = np.inf,
        *,
        category: ArrayLike = EVERYONE,
        mask: ArrayLike = EVERYONE,
        particles: bool = True,
        obstacles: bool = True,
        walls: bool = True,
    ) -> RayHits:
        """The first contact of each moving circle. In ties particles come before obstacles, these before walls, then lower
        indices.

        Args:
            origin: (q, 2) or (2,), m, initial centres.
            direction: (q, 2) or (2,) direction; its length does not matter.
            radius: m, at least 0, or (q,).
            length: range, m, or (q,). In a periodic room circles continue across the boundary, for at most 100 periods.
            category: 32 bits, the categories of the circles, or (q,).
            mask: 32 bits, the categories that they hit, or (q,).
            particles: whether they hit particles.
            obstacles: whether they hit obstacles.
            walls: whether they hit walls of the room.

        Raises:
            InputError: an argument is outside what is allowed.
        """
        start, heading = checks.rows("origin", origin, np.dtype(float)), checks.rows("direction", direction, np.dtype(float))
        start, heading = alike("origin", start, "direction", heading)
        if (wrong := np.flatnonzero((heading[:, 0] == 0) & (heading[:, 1] == 0))).size:
            raise InputError(f"direction[{wrong[0]}] is (0.0, 0.0); allowed is a direction other than 0")
        far = checks.column("length", length, np.dtype(float), len(start) if np.ndim(length) else 1)
        if (wrong := np.flatnonzero(~(far >= 0))).size:
            raise InputError(f"length[{wrong[0]}] is {far[wrong[0]]:g}; allowed is a number of at least 0")
        if np.ndim(radius):
            start, size = circles("origin", start, radius)
            start, heading = alike("radius", start, "direction", heading)
        else:
            size = circles("origin", (0.0, 0.0), radius)[1]
        for name, value in (("particles", particles), ("obstacles", obstacles), ("walls", walls)):
            checks.flag(name, value)
        s, largest, count = self._state, float(size.max(initial=0.0)), len(start)
        rays = s.periodic.wrapped(start), *map(np.ascontiguousarray, (heading, far, size, *_bits(category, mask, count)))
        seen = discs = None
        if particles and len(s):
            seen, cells = self._seen(count, float(s.radius.max()) + largest, largest)
            whose = slice(None) if seen.owner is None else seen.owner
            discs = *cells, seen.position, seen.radius, s.category[whose], s.mask[whose]
        bodies = self._obstacle_arrays.standing(1.01 * largest) if obstacles else None
        threads = min(self._threads or max_threads(), 1 + count // RAYS_A_THREAD)
        particle, obstacle, wall = (np.empty(count, np.int64) for _ in range(3))
        distance, normal, point = np.empty(count), np.empty((count, 2)), np.empty((count, 2))
        found = particle, obstacle, wall, distance, normal, point
        unit("tools", s.dtype).cast(rays, discs, bodies, _walls(self.boundary, walls), tuple(s.periodic), threads, *found)
        return RayHits(seen.named(particle) if seen else particle, distance, normal, obstacle, wall, s.periodic.wrapped(point))

    @between_frames
    def overlap_area(
        self, center: ArrayLike, radius: ArrayLike, *, category: ArrayLike = EVERYONE, mask: ArrayLike = EVERYONE
    ) -> Overlaps:
        """The particles, obstacles and walls that circles overlap or touch.

        Args:
            center: (2,) m, or (q, 2) of many circles.
            radius: m, at least 0, or (q,).
            category: 32 bits, the categories of the circles, or (q,).
            mask: 32 bits, the categories that they overlap, or (q,).
        """
        middle, size = circles("center", center, radius)
        own, s, many = _bits(category, mask, len(middle)), self._state, np.ndim(center) > 1 or np.ndim(radius) > 0
        q, i, _ = self._discs_at(middle, size)
        category, mask = (np.broadcast_to(each, len(middle)) for each in own)
        seen = may_collide(category[q], mask[q], s.category[i], s.mask[i])
        there = self._obstacle_arrays.near(middle, size, *own)
        boundary = self.boundary.room if isinstance(self.boundary, TextbookBoundary) else self.boundary
        facing = boundary.facing(s.periodic.wrapped(middle))
        near = np.zeros((len(middle), 0), bool) if facing is None else facing[0] <= size[:, None]
        side = np.argwhere(near & may_collide(*own, *_walls(self.boundary)[3:])[:, None])
        found = np.column_stack((q, i))[seen], np.column_stack((there.row, there.obstacle)), side
        return Overlaps(*(rows if many else np.ascontiguousarray(rows[:, 1]) for rows in found))

    @between_frames
    def is_free(
        self, position: ArrayLike, radius: ArrayLike | None = None, *, category: ArrayLike = EVERYONE, mask: ArrayLike = EVERYONE
    ) -> NDArray[np.bool_]:
        """(q,) bool, whether circles at these places would touch nothing and are inside the room.

        Args:
            position: (q, 2) or (2,), m.
            radius: m, at least 0, or (q,). None: whether the places are inside the room and in no obstacle, as `add` requires of
                centres; particles do not count then.
            category: 32 bits, the categories of the circles, or (q,).
            mask: 32 bits, the categories that they overlap, or (q,).
        """
        where = checks.rows("position", position, np.dtype(np.float64))
        if radius is None:
            marks = _bits(category, mask, len(where))
            outside = self.boundary.outside(where) & self.boundary.holds(*marks)
            return np.asarray(~outside & (self._obstacle_arrays.covering(where, *marks) < 0))
        hits = self.circle_cast(where, (1.0, 0.0), radius, 0.0, category=category, mask=mask)
        return np.asarray(np.isinf(hits.distance) & ~self.boundary.outside(where))


def _walls(boundary: Boundary, wanted: bool = True) -> tuple[int, int, Floats, int, int]:
    """Sides as `core.casting` takes them: first and end, box corners or centre and radius, m; category and mask.

    User-defined rooms have no sides and all bits.
    """
    shape = boundary.room if isinstance(boundary, TextbookBoundary) else boundary
    kinds = getattr(boundary, "category", EVERYONE), getattr(boundary, "mask", EVERYONE)
    if isinstance(shape, Circle) and wanted:
        return 4, 5, np.array((*shape.center, shape.radius)), *kinds
    if isinstance(shape, Box | Periodic) and wanted:
        return 0, 4, np.array(shape._box), *kinds
    return 0, 0, np.zeros(4), *kinds


def _bits(category: ArrayLike, mask: ArrayLike, count: int) -> Kinds:
    """(n,) arrays of each, or (1,) for a single number."""
    many = (count if np.ndim(value) else 1 for value in (category, mask))
    return checks.bits("category", category, next(many)), checks.bits("mask", mask, next(many))
