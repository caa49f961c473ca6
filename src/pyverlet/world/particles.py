"""What a world holds: its particles, how they are added and removed, and their arrays."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.ground.turns import Shared, in_turn, of_one_frame
from pyverlet.laws.events import Events
from pyverlet.laws.forces import ForceList, Numbered
from pyverlet.laws.links import Links
from pyverlet.laws.obstacles import Course, Obstacles
from pyverlet.laws.rooms import Boundary
from pyverlet.laws.touches import Touches
from pyverlet.state.group import Column, Group, Particle
from pyverlet.state.slots import Slots
from pyverlet.state.state import EVERYONE, State

Array = NDArray[Any]


class Particles(Shared):
    """The particles of a world. Its arrays are views, in the order the particles were added."""

    _state: State
    _slots: Slots
    _frames: Any
    _events: Events | None
    _touches: Touches | None
    forces: ForceList
    links: Links
    _where = slice(None)
    boundary: Boundary
    obstacles: Obstacles
    _course: Course

    def held(self) -> AbstractContextManager[None]:
        """Meanwhile no other thread steps or changes this world: `with world.held():` what is read belongs to one frame."""
        return self._state.turn.held()

    def held_by(self, page: Callable[[], AbstractContextManager[None]] | None) -> None:
        """A page steps this world, and pauses between two frames while the context that it makes is entered; None: no longer."""
        self._state.turn.page = page

    @property
    def has_page(self) -> bool:
        """Whether a page steps this world beside the program."""
        return self._state.turn.page is not None

    @in_turn
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
        category: ArrayLike = 1,
        mask: ArrayLike = EVERYONE,
        allow_overlap: bool = False,
    ) -> Group:
        """Add particles.

        Args:
            position: (n, 2) or (2,), centres, m. Circles of which a part would stand out of the room are put at its wall.
            velocity: (n, 2), (2,) or 0, m/s.
            radius: (n,) or one for all, m, greater than 0.
            mass: (n,) or one for all, kg, greater than 0; infinity pins the particle. 1 unless a density is given.
            density: (n,) or one for all, kg/m^2, in place of the mass: mass = density pi radius^2.
            spin: (n,) or one for all, rad/s, counter-clockwise.
            angle: (n,) or one for all, rad they have turned so far, counter-clockwise.
            restitution: (n,) or one for all, e from 0 to 1; None: as `Collisions` and the bounds say. The larger of two counts.
            friction: (n,) or one for all, mu, 0 or more; None: as for restitution. The geometric mean of two counts, as in Box2D.
            category: (n,) or one for all, 32 bits: what these circles are.
            mask: (n,) or one for all, 32 bits: two circles collide if each has a bit of its category in the other's mask.
            allow_overlap: leave circles where they are said to be, inside an obstacle and outside the room too: the first frame
                gets them out, or in. Circles on top of each other need no leave: they part slowly.

        Returns:
            A handle whose arrays are views on these particles, in the order given.

        Raises:
            InputError: shapes disagree, a value is not finite, a circle does not fit into the boundary, or a centre is inside an
                obstacle or outside the room, where only pinned ones may be; nothing is added.
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
            "restitution": checks.column("restitution", -1.0 if restitution is None else restitution, dtype, count),
            "friction": checks.column("friction", -1.0 if friction is None else friction, dtype, count),
            "category": checks.bits("category", category, count),
            "mask": checks.bits("mask", mask, count),
        }
        if restitution is not None:
            checks.within("restitution", values["restitution"], 0.0, 1.0)
        if friction is not None:
            checks.within("friction", values["friction"], 0.0, np.inf)
        for name in ("spin", "angle"):
            checks.rows(name, np.column_stack((values[name], values[name])), np.dtype(np.float64), count)
        checks.positive("radius", values["radius"])
        checks.positive("mass", values["mass"], infinite_is="pinned")
        self.boundary.check(values["radius"])
        if not allow_overlap:
            free = np.isfinite(values["mass"])
            held = free & self.boundary.holds(values["category"], values["mask"])
            inside = self._course.covering(where, values["category"], values["mask"])
            self._refuse_misplaced(where, held, np.where(free, inside, -1))
            values["position"] = np.where(held[:, None], self.boundary.put_in(where, values["radius"]), where)
        return Group(self._state, self._state.append(values), self.remove)

    @of_one_frame
    def is_free(self, position: ArrayLike, *, category: ArrayLike = 1, mask: ArrayLike = EVERYONE) -> NDArray[np.bool_]:
        """(n,) whether these places, (n, 2) or (2,), m, are inside the room and in no obstacle. Circles do not count.

        category, mask: (n,) or one for all; walls and obstacles that such particles do not collide with do not count either.
        """
        where = checks.rows("position", position, np.dtype(np.float64))
        marks = checks.bits("category", category, len(where)), checks.bits("mask", mask, len(where))
        outside = self.boundary.outside(where) & self.boundary.holds(*marks)
        return np.asarray(~outside & (self._course.covering(where, *marks) < 0))

    def _refuse_misplaced(self, position: Array, held: Array, inside: Array) -> None:
        """No particle may start outside the room that holds it, nor inside an obstacle, or -1."""
        outside = held & self.boundary.outside(position)
        wrong = np.flatnonzero(outside | (inside >= 0))
        if len(wrong):
            k = int(wrong[0])
            what = f"outside the room, {self.boundary}" if outside[k] else f"inside the {self.obstacles[inside[k]]}"
            x, y = position[k]
            raise InputError(
                f"position[{k}] is ({x:g}, {y:g}) m, {what}; allowed are free places, and all with allow_overlap=True"
            )

    @in_turn
    def remove(self, which: Group | Particle | ArrayLike) -> None:
        """Remove particles. Groups keep the others, whose indices close ranks.

        A loop over `contacts` or over the records of `events` may remove particles: the records are renumbered in place. There
        a removed particle is -1, which is refused here.

        Args:
            which: a group, a particle of one, an index, several, or (n,) bool. Many at once cost as much as one.

        Raises:
            InputError: there is no such particle; nothing is removed.
        """
        if isinstance(which, Group | Particle):
            which = which.index
        gone = checks.indices("which", which, len(self))
        if not len(gone):
            return
        kept = np.ones(len(self), bool)
        kept[gone] = False
        now = self._state.remove(kept)
        self._slots.forget(now)
        self._renumber(now)

    def _renumber(self, now: Array) -> None:
        """Tell those who hold a particle by its index where it is now, or that it is no more (-1)."""
        for holder in (self.links, self._frames, self._events, self._touches, *self.forces):
            if isinstance(holder, Numbered):
                holder.renumber(now)

    def __len__(self) -> int:
        return len(self._state)

    position = Column("(n, 2) centres of all particles in the order they were added, m; a view.")
    velocity = Column("(n, 2) m/s; a view.")
    spin = Column("(n,) angular velocity, rad/s, counter-clockwise; a view.")
    angle = Column("(n,) rad they have turned, counter-clockwise, float64 whatever the dtype: it grows and grows; a view.")
    radius = Column("(n,) m; a view.")
    mass = Column("(n,) kg, infinite where pinned; a view.")
    restitution = Column("(n,) e of circles that have their own, negative where `Collisions` and the bounds decide; a view.")
    friction = Column("(n,) mu of circles that have their own, negative where `Collisions` and the bounds decide; a view.")
    category = Column("(n,) uint32, the bits of what each circle is; a view.")
    mask = Column("(n,) uint32, the bits of the categories it collides with; a view.")

    @property
    @of_one_frame
    def number(self) -> Array:
        """(n,) a number for each particle, ascending, that it keeps while others come and go; a view, not to be written."""
        return self._state.number

    @property
    @of_one_frame
    def group_number(self) -> NDArray[np.int64]:
        """(n,) which call of `add` brought each particle, ascending from 0; it keeps that while others come and go."""
        return np.searchsorted(self._state.begun, self.number, side="right") - 1

    @property
    @of_one_frame
    def groups(self) -> list[Group]:
        """A handle on each group, in the order they were added; of those that were removed, too, with nobody in them."""
        state = self._state
        ends = [*state.begun[1:], state.numbers]
        return [
            Group.of(state, first, end - first, self.remove) for first, end in zip(state.begun, ends, strict=bool(state.begun))
        ]

    @property
    def version(self) -> int:
        """How often particles were added or removed."""
        return self._state.version


def _mass(mass: ArrayLike | None, density: ArrayLike | None, radius: Array) -> Array:
    """(n,) kg, from that or from the density of discs."""
    if density is None:
        return checks.column("mass", 1.0 if mass is None else mass, radius.dtype, len(radius))
    if mass is not None:
        raise InputError(f"density is {density!r} and mass is {mass!r}; allowed is one of them, not both")
    wide = checks.column("density", density, np.dtype(np.float64), len(radius))
    checks.positive("density", wide)
    return np.asarray(np.pi * wide * radius.astype(np.float64) ** 2, radius.dtype)
