"""The particles of a world: adding and removing them, and their arrays."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.common.lists import Contents
from pyverlet.common.step_lock import Shared, between_frames, exclusive
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.contact_records import ContactRecords
from pyverlet.laws.events import Events
from pyverlet.laws.forces import ForceList, Numbered
from pyverlet.laws.links import Links
from pyverlet.laws.obstacles import ObstacleArrays, Obstacles
from pyverlet.state.data import known, rows
from pyverlet.state.group import Columns, Group, Particle, check_home
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import EVERYONE, check_set
from pyverlet.world.actors import Actors, Sink
from pyverlet.world.queries import free_in_order, on_others

OnOverlap = Literal["push", "skip", "error"]

_MET = ("mass", "category", "mask")
"""Columns that decide which walls and obstacles hold a particle."""

_ALLOWED = "free places, and all with on_overlap='push'"


class Particles(Columns, Shared):
    """The particles of a world. Its arrays are views, in the order the particles were added."""

    _sorted: SortedState
    _frames: Any
    _events: Events | None
    _contact_records: ContactRecords | None
    forces = Contents[ForceList]()
    links = Contents[Links]()
    _where, _whole = slice(None), True
    boundary: Boundary
    obstacles = Contents[Obstacles]()
    actors = Contents[Actors]()
    _obstacle_arrays: ObstacleArrays
    collisions: Collisions | None

    def held(self) -> AbstractContextManager[None]:
        """Context manager: no other thread steps or changes the world inside `with world.held():`, so reads see one frame."""
        return self._state.lock.held()

    def held_by(self, page: Callable[[], AbstractContextManager[None]] | None) -> None:
        """Register the page that steps this world; `page()` is a context in which it pauses between frames. None: unregister."""
        self._state.lock.page = page

    @property
    def has_page(self) -> bool:
        """Whether a page steps this world while the program runs."""
        return self._state.lock.page is not None

    @exclusive
    def add(
        self,
        *,
        position: ArrayLike,
        velocity: ArrayLike = 0.0,
        radius: ArrayLike = 0.5,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
        spin: ArrayLike = 0.0,
        angle: ArrayLike = 0.0,
        restitution: ArrayLike | None = None,
        friction: ArrayLike | None = None,
        rolling_resistance: ArrayLike | None = None,
        fixed_rotation: ArrayLike = False,
        inertia: ArrayLike | None = None,
        material: str | Sequence[str] = "",
        category: ArrayLike = 1,
        mask: ArrayLike = EVERYONE,
        on_overlap: OnOverlap | None = None,
        data: Mapping[str, ArrayLike] | None = None,
        allow_overlap: bool | None = None,
    ) -> Group:
        """Add particles.

        Args:
            position: (n, 2) or (2,), centres, m. Circles that would stick out of the room are placed at its wall.
            velocity: (n, 2), (2,) or 0, m/s.
            radius: (n,) or one for all, m, greater than 0.
            mass: (n,) or one for all, kg, greater than 0; infinity pins the particle. 1 unless a density is given.
            density: (n,) or one for all, kg/m^2, instead of the mass: mass = density pi radius^2.
            spin: (n,) or one for all, rad/s, counter-clockwise.
            angle: (n,) or one for all, initial orientation, rad, counter-clockwise.
            restitution: (n,) or one for all, e from 0 to 1; None: as `Collisions` and the bounds say. The larger of two is used.
            friction: (n,) or one for all, mu, 0 or more; None: as for restitution. The geometric mean is used, as in Box2D.
            rolling_resistance: (n,) or one for all, c, 0 or more; None: as for friction. See `Collisions`.
            fixed_rotation: (n,) or one for all: whether it never rotates, as if its moment of inertia were infinite.
            inertia: (n,) or one for all, kg m^2, greater than 0, moments of inertia; None: m r^2 / 2, those of discs. A ring has
                m r^2. It stays as it is when mass or radius are changed.
            material: (n,) names or one for all, of `Collisions(materials=...)`; "" is none.
            category: (n,) or one for all, 32 bits: the categories of these circles.
            mask: (n,) or one for all, 32 bits: two circles collide if each has a bit of its category in the other's mask.
            on_overlap: what to do with circles that overlap others (existing ones and earlier ones of this call), and with free
                ones whose centre is inside an obstacle or outside the room. "push": add all at their places; contacts separate
                overlapping circles slowly, and the first frame moves the rest out of obstacles or into the room. "skip": add only
                those that overlap nothing, in order. "error": refuse. None: refuse inside obstacles and outside the room, push
                overlapping ones. Circles that would not collide do not count as overlapping.
            data: by name, (n,) or (n, k) or one for all, for arrays of `world.data`; others get their default value.
            allow_overlap: deprecated; True is on_overlap="push", False is None.

        Returns:
            A handle whose arrays are views of the added particles, in the order given.

        Raises:
            InputError: shapes disagree, a value is not finite, a circle does not fit into the boundary, or `on_overlap` refuses
                a place; nothing is added.
        """
        dtype = self._state.dtype
        where = checks.rows("position", position, dtype)
        count = len(where)
        size = checks.column("radius", radius, dtype, count)
        values = {
            "position": where,
            "velocity": checks.rows("velocity", velocity, dtype, count),
            "acceleration": np.full((count, 2), np.nan, dtype),
            "spin": checks.column("spin", spin, dtype, count),
            "angle": checks.column("angle", angle, np.dtype(np.float64), count),
            "radius": size,
            "mass": _mass(mass, density, size),
            "category": checks.bits("category", category, count),
            "mask": checks.bits("mask", mask, count),
            "fixed_rotation": checks.bits("fixed_rotation", fixed_rotation, count),
            "material": self._material_numbers(material, count),
        }
        for name, value, most in (
            ("restitution", restitution, 1.0),
            ("friction", friction, np.inf),
            ("rolling_resistance", rolling_resistance, np.inf),
        ):
            values[name] = checks.column(name, -1.0 if value is None else value, dtype, count)
            if value is not None:
                checks.within(name, values[name], 0.0, most)
        values["inertia"] = checks.column("inertia", 0.0 if inertia is None else inertia, dtype, count)
        if inertia is not None:
            checks.positive("inertia", values["inertia"])
        for name in ("spin", "angle"):
            checks.rows(name, np.column_stack((values[name], values[name])), np.dtype(np.float64), count)
        check_set(values)
        self.boundary.check(values["radius"])
        columns, on_overlap = self._state.data, _on_overlap(on_overlap, allow_overlap)
        data = {} if data is None else data
        if not isinstance(data, Mapping):
            raise InputError(f"data is {data!r}; allowed is a dict of arrays, or of a value for all, by names of world.data")
        own = {name: rows(name, value, count, known(columns, name)) for name, value in data.items()}
        if on_overlap != "push" and not (kept := self._put_down(values, on_overlap)).all():
            values, own = ({name: column[kept] for name, column in columns.items()} for columns in (values, own))
        return Group(self._state, self._state.append(values, own), len(values["radius"]), self.remove)

    def _put_down(self, values: dict[str, Array], on_overlap: str | None) -> NDArray[np.bool_]:
        """(n,) which of these particles to add, after moving all of them inside the room."""
        where = values["position"]
        held, kept = self._places(where, *(values[name] for name in _MET), allowed=None if on_overlap == "skip" else _ALLOWED)
        values["position"] = np.where(held[:, None], self.boundary.put_in(where, values["radius"]), where)
        values["crossed"] = self._state.periodic.periods(where.astype(np.float64) - values["position"])
        if on_overlap is None or self.collisions is None:
            return kept
        pairs = on_others(self._state, values)
        if on_overlap == "error" and len(pairs):
            (k, i), there = pairs[0].tolist(), len(self)
            x, y = where[k]
            other = f"particle {i}" if i < there else f"position[{i - there}]"
            raise InputError(f"position[{k}] is ({x:g}, {y:g}) m, on top of {other}; allowed are {_ALLOWED}")
        return free_in_order(pairs, len(self), kept)

    def _material_numbers(self, names: Any, count: int) -> Array:
        """(count,) material numbers in the table of `collisions`."""
        known = {"", *(self.collisions.names if self.collisions else ())}
        given = np.asarray(names)
        if given.dtype.kind != "U" or given.shape not in ((), (count,)):
            raise InputError(f"material is {names!r}; allowed is a name, or {count} of them")
        if unknown := set(np.unique(given).tolist()) - known:
            allowed = ", ".join(map(repr, sorted(known - {""}))) or "none, since `collisions` has no materials"
            raise InputError(f"material is {min(unknown)!r}{did_you_mean(min(unknown), known)}; allowed: {allowed}")
        return self._state.material_numbers(given, count)

    def _places(
        self, position: Array, mass: Array, category: Array, mask: Array, *, allowed: str | None
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(n,) which of these particles the room would hold, and which would be neither outside it nor inside an obstacle.

        Raises:
            InputError: a particle is outside the room or inside an obstacle, unless `allowed` is None.
        """
        free = np.isfinite(mass)
        held, inside = free & self.boundary.holds(category, mask), self._obstacle_arrays.covering(position, category, mask)
        outside, within = held & self.boundary.outside(position), free & (inside >= 0)
        good: NDArray[np.bool_] = ~(outside | within)
        if allowed and not good.all():
            k = int(np.argmin(good))
            what = f"outside the room, {self.boundary}" if outside[k] else f"inside the {self.obstacles[inside[k]]}"
            x, y = position[k]
            raise InputError(f"position[{k}] is ({x:g}, {y:g}) m, {what}; allowed are {allowed}")
        return held, good

    @exclusive
    def remove(self, which: Group | Particle | ArrayLike) -> None:
        """Remove particles. Groups keep the remaining ones; indices are renumbered without gaps.

        A loop over `contacts` or over the records of `events` may remove particles: the records are renumbered in place. In them
        a removed particle becomes -1, which `remove` refuses.

        Args:
            which: a group, a particle of one, an index, several, or (n,) bool. Removing many at once costs as much as one.

        Raises:
            InputError: there is no such particle; nothing is removed.
        """
        check_home("which", which, self._state)
        if isinstance(which, Group | Particle):
            which = which.index
        gone = checks.indices("which", which, len(self))
        if not len(gone):
            return
        self._take_contacts()
        now = self._state.remove(gone, self._sorted.alike_in(self._state))
        self._renumber(now)
        self._frames.renumber(now, self._sorted)

    @exclusive
    def _move_to(self, which: Group | Particle, position: ArrayLike) -> None:
        """`Group.move_to`: place particles as if just added, but with their velocities."""
        state, index = self._state, np.atleast_1d(which.index)
        goal = checks.rows("position", position, np.dtype(np.float64))
        if not len(index):
            return
        if np.ndim(position) == 1:
            here = state.position[index].astype(np.float64)
            shape = state.periodic.nearest(here - here[0])  # also for a group across the periodic boundary
            goal = goal + shape - shape.mean(axis=0)
        elif len(goal) != len(index):
            raise InputError(f"position has shape {goal.shape}; allowed is (2,), for their centre, or ({len(index)}, 2)")
        where = np.ascontiguousarray(goal, state.dtype)
        self._places(where, *(getattr(state, name)[index] for name in _MET), allowed="free places, and any for pinned ones")
        inside = state.periodic.wrapped(where)
        state.crossed[index] = state.periodic.periods(where.astype(np.float64) - inside)
        index, inside = index[moved := (inside != state.position[index]).any(axis=1)], inside[moved]
        lone = ~np.isin(index, self.links.joined())
        self._take_contacts()
        state.position[index], state.acceleration[index[lone]] = inside, np.nan
        self._frames.held.leave(index, index[lone])
        for actor in self.actors:
            if isinstance(actor, Sink):
                actor.forget(state.number[index])

    def _take_contacts(self, sleepers: Any = None) -> None:
        """Read the contacts of the last frame before the engine discards them. sleepers: contacts of sleeping particles."""
        if self._contact_records is not None:
            self._contact_records.take(self._state.shown["number"], self._frames.held.obstacles.count, sleepers)

    def _renumber(self, now: Array) -> None:
        """Renumber particles in all objects that hold indices: new index, or -1 if removed."""
        for holder in (self.links, self._events, self._contact_records, *self.forces):
            if isinstance(holder, Numbered):
                holder.renumber(now)

    def __len__(self) -> int:
        return len(self._state)

    @property
    @between_frames
    def number(self) -> Array:
        """(n,) a permanent number of each particle, ascending; a read-only view."""
        return self._state.number

    @property
    @between_frames
    def group_number(self) -> NDArray[np.int64]:
        """(n,) the number of the `add` call that created each particle, from 0; it never changes."""
        return np.searchsorted(self._state.begun, self.number, side="right") - 1

    @between_frames
    def index_of(self, numbers: ArrayLike) -> NDArray[np.int64]:
        """Current indices of the particles with these permanent numbers, as in `number` and the records of events and contacts.

        Args:
            numbers: array of any shape.

        Returns:
            Array of the same shape: the index of each particle; -1 if it was removed or never existed.

        Raises:
            InputError: `numbers` are not integers.
        """
        return self._state.index_of(checks.numbers("numbers", numbers))

    @between_frames
    def group_of(self, numbers: ArrayLike) -> NDArray[np.int64]:
        """Indices in `groups` of the groups that contain the particles with these numbers, removed ones included; see `index_of`.

        -1 for numbers that never existed.
        """
        asked = checks.numbers("numbers", numbers)
        known = (asked >= 0) & (asked < self._state.numbers)
        return np.where(known, np.searchsorted(self._state.begun, asked, side="right") - 1, -1)

    @property
    @between_frames
    def groups(self) -> list[Group]:
        """A handle for each group, in the order they were added; groups whose particles were removed are empty."""
        state = self._state
        ends = [*state.begun[1:], state.numbers]
        return [Group(state, first, end - first, self.remove) for first, end in zip(state.begun, ends, strict=bool(state.begun))]

    @property
    def version(self) -> int:
        """How often particles have been added or removed."""
        return self._state.version


def _on_overlap(on_overlap: OnOverlap | None, allow_overlap: bool | None) -> OnOverlap | None:
    if allow_overlap is not None:
        warnings.warn("allow_overlap is deprecated; on_overlap='push' is allow_overlap=True", DeprecationWarning, stacklevel=4)
        on_overlap = on_overlap or ("push" if allow_overlap else None)
    if on_overlap is not None:
        checks.choice("on_overlap", on_overlap, get_args(OnOverlap))
    return on_overlap


def _mass(mass: ArrayLike | None, density: ArrayLike | None, radius: Array) -> Array:
    """(n,) masses, kg, given or computed from the density of discs."""
    if density is None:
        return checks.column("mass", 1.0 if mass is None else mass, radius.dtype, len(radius))
    if mass is not None:
        raise InputError(f"density is {density!r} and mass is {mass!r}; allowed is one of them, not both")
    wide = checks.column("density", density, np.dtype(np.float64), len(radius))
    checks.positive("density", wide)
    return np.asarray(np.pi * wide * radius.astype(np.float64) ** 2, radius.dtype)
