"""The links of a world: a list for the user, and measurements of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.lists import several
from pyverlet.common.shown import listed
from pyverlet.common.step_lock import Shared, between_frames, exclusive
from pyverlet.laws.links._link import Link
from pyverlet.laws.links._pool import DISTANCE, Pool
from pyverlet.state.periodicity import Periodicity
from pyverlet.state.state import State

AnyLink = TypeVar("AnyLink", bound=Link)

BROKEN = np.dtype(
    [("link", np.int64), ("row", np.int64), ("i", np.int64), ("j", np.int64), ("force", np.float64), ("number", np.int64, (2,))]
)
"""Number of the link in `world.links`, its row, indices of its first and last particle, its tension when it broke, N, and the
permanent numbers of these particles."""


class Links(Shared):
    """Sticks, ropes, springs, pins and so on, in the order they were appended: `world.links`.

    Attributes:
        broken: a structured array of BROKEN, the links that broke in the last frame; a particle removed since is -1.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self._links: dict[int, Link] = {}  # by the owner numbers of their rows, in the order appended
        self._listed: list[Link] | None = None
        self._pool = Pool()
        self._leaving: list[int] = []  # owners of rows to be removed
        self._next_owner, self._iterations = 0, 1
        self._apart, self._apart_stale = np.empty((0, 2), np.int64), False
        self._apart_among = 0  # number of particles then
        self.broken = np.empty(0, BROKEN)

    # ---- a list --------------------------------------------------------------------------------------------------------

    @exclusive
    def append(self, link: AnyLink) -> AnyLink:
        """Add a link, or the many that one object contains; returns it.

        Raises:
            InputError: it is not a link, is already in a world, or joins particles of another world.
        """
        if not isinstance(link, Link):
            raise InputError(f"link is {link!r}; allowed is an object such as pyverlet.Stick(group, 0, 1)")
        if link._state is not self._state:
            raise InputError(f"{link!r} joins particles of another world; allowed are links between this world's particles")
        if link._pool is not None:
            raise InputError(f"{link!r} is in a world already; allowed is a new one")
        link._find()
        link._check(self._state.periodic)
        link._pool, link._id = self._pool, self._next_owner
        link._pool.append(link._id, link.particles, link._rows())
        if link._moving:
            link._recall()
        self._next_owner += 1
        self._apart_stale = True
        self._links[link._id], self._listed = link, None
        return link

    def extend(self, links: Iterable[Link]) -> None:
        """Append each of these links."""
        for link in links:
            self.append(link)

    def __iadd__(self, links: Iterable[Link]) -> Links:
        self.extend(links)
        return self

    def check(self, periodic: Periodicity) -> None:
        """Raise InputError if a link does not fit into a room with this periodicity."""
        for link in self:
            link._check(periodic)

    @exclusive
    def remove(self, link: Link) -> None:
        """Remove a link.

        Raises:
            InputError: it is not in this world.
        """
        given: Any = link
        if not isinstance(given, Link) or link._pool is None or self._links.get(link._id) is not link:
            raise InputError(f"{link!r} is not among this world's links; allowed is one that was appended")
        self._leaving.append(link._id)
        del self._links[link._id]
        link._pool = self._listed = None
        self._apart_stale = self._state.let_go = True

    def pop(self, number: int = -1) -> Link:
        """Remove the link of this index, by default the last; returns it, and it may be appended again."""
        link = self[number]
        self.remove(link)
        return link

    def clear(self) -> None:
        """Remove all links."""
        for link in list(self):
            self.remove(link)

    @property
    def pool(self) -> Pool:
        """The rows of the links. Rows of removed links are deleted on access, many at once."""
        if self._leaving:
            self._pool.keep(~np.isin(self._pool.rows["owner"], self._leaving))
            self._leaving = []
        return self._pool

    def __len__(self) -> int:
        return len(self._links)

    def __repr__(self) -> str:
        return listed("link", self)

    def __iter__(self) -> Iterator[Link]:
        return iter([*self._links.values()])  # a snapshot: a loop may remove links

    def __getitem__(self, number: int) -> Link:
        if self._listed is None:
            self._listed = list(self._links.values())
        return self._listed[number]

    def __setitem__(self, where: slice, links: Iterable[Link]) -> None:
        """`links[:] = ...` replaces all links by these; links that stay keep their state.

        Raises:
            InputError: it is part of the list; or `append` refuses one of them, and nothing is changed.
        """
        if where != slice(None):
            raise InputError(f"links[{where}] cannot be set; allowed are links[:] = ..., append and remove")
        wanted, before, added = several(links), {id(link): link for link in self}, list[Link]()
        try:
            for link in wanted:
                if id(link) not in before:
                    added.append(self.append(link))
        except InputError:
            for link in added:
                self.remove(link)
            raise
        for gone in before.keys() - set(map(id, wanted)):
            self.remove(before[gone])

    def renumber(self, new: NDArray[np.int64]) -> None:
        """Renumber after particles were removed: index i is now new[i], or -1, which removes its links."""
        if len(pool := self.pool):
            pool.particle = new[pool.particle]
            pool.keep(np.minimum.reduceat(pool.particle, pool.first[:-1]) >= 0)
        for link in self:
            moved = new[link.particles]
            kept = np.asarray((moved >= 0).all(axis=1))
            link.particles = moved
            if not kept.all():
                link._keep(kept)
        for name in ("i", "j"):  # in place: a loop over it may remove particles
            self.broken[name] = np.where(self.broken[name] >= 0, new[self.broken[name]], -1)
        self._links, self._listed = {number: link for number, link in self._links.items() if len(link)}, None
        self._apart_stale = True

    @property
    def iterations(self) -> int:
        """Passes over all links per substep, forward and backward; 1 by default. Chains without shared particles need one."""
        return self._iterations

    @iterations.setter
    def iterations(self, value: int) -> None:
        self._iterations = checks.integer("iterations", value)

    # ---- a frame -------------------------------------------------------------------------------------------------------

    def known_apart(self) -> Array:
        """As `apart`; the same object as long as neither these pairs nor the number of particles have changed."""
        if self._apart_stale or (self._links and self._apart_among != len(self._state)):
            now = self.apart()
            if self._apart_among != len(self._state) or not np.array_equal(now, self._apart):
                self._apart = now
            self._apart_stale, self._apart_among = False, len(self._state)
        return self._apart

    def accept(self, broken_rows: list[tuple[int, float]]) -> None:
        """After a successful frame: remove the rows that broke in it, given with their tension, N."""
        if not broken_rows:
            self.broken = self.broken[:0]
            return
        self.broken, number = np.empty(len(broken_rows), BROKEN), {owner: k for k, owner in enumerate(self._links)}
        for k, (row, pull) in enumerate(broken_rows):
            link = self._links[owner := int(self._pool.rows["owner"][row])]
            ends = link.particles[within := row - link._where.start]
            self.broken[k] = (number[owner], within, ends[0], ends[-1], pull, link._number[within][[0, -1]])
        self._pool.edits, self._apart_stale = self._pool.edits + 1, True

    # ---- to look at ----------------------------------------------------------------------------------------------------

    def energy(self, where: Array | None = None) -> float:
        """Energy stored in links that yield, J, at the current positions, or at others (n, 2), m.

        At current positions, links too stiff for coordinates to resolve their stretch count F^2 / 2 k, by their tension F.
        """
        if where is None:
            return self.pool.energy_by_pull(self._state.shown["position"], self._state.periodic)
        return self.pool.energy(where, self._state.periodic)

    @between_frames
    def segments(self) -> tuple[Array, Array]:
        """Intact links as lines: ends (m, 2, 2) in m, and the tension (m,) of each in N, negative if it pushes.

        Across a periodic boundary a line leaves the room, to the nearest image of its second end.
        """
        pairs, force = self.pulls()
        ends = self._state.position[pairs]
        ends[:, 1] = ends[:, 0] + self._state.periodic.nearest(ends[:, 1] - ends[:, 0])
        return ends, force

    def pulls(self) -> tuple[Array, Array]:
        """As `segments`, with particle indices (m, 2) instead of ends."""
        pairs, row = self.pool.distances()
        return pairs, self._pool.rows["force"][row]

    def joined(self) -> Array:
        """(m, 2) indices of particles connected by links of any kind."""
        return self.pool.lines()[0]

    def hold(self, particle: int) -> bool:
        """Whether an intact link joins the particle of this index to anything."""
        return bool((self.joined() == particle).any())

    def apart(self) -> Array:
        """(k, 2) sorted pairs i < j of particles that do not collide: by the link's setting, or because it is a rigid stick.

        A rigid stick holds them at one distance: if they touched, contact and stick would push against each other for ever.
        """
        (pairs, row), rows = self.pool.lines(), self._pool.rows
        rigid = (rows["kind"] == DISTANCE) & np.isinf(rows["stiffness"]) & np.isinf(rows["upper"])
        low, high = np.sort(pairs[rigid[row] | (rows["collide"][row] == 0)], axis=1).T
        count = max(len(self._state), 1)
        number = np.unique(low * count + high)  # one number per pair sorts twenty times as fast
        return np.column_stack((number // count, number % count))

    # ---- save and restore ----------------------------------------------------------------------------------------------

    def __getstate__(self) -> dict[str, Any]:
        return {"state": self._state, "links": list(self), "iterations": self._iterations}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["state"])  # type: ignore[misc]
        self.extend(state["links"])
        self._iterations = state["iterations"]

    def save(self) -> Any:
        """A copy of the state of all links."""
        links = [(owner, link, link._arrays()) for owner, link in self._links.items()]
        return links, self.pool.save(), self.broken.copy()

    def restore(self, saved: Any) -> None:
        """Set the links and the state that `save` returned."""
        links, rows, broken = saved
        self.broken = broken.copy()
        for link in self:
            link._pool = None
        self._pool.restore(*rows)
        self._links, self._listed, self._leaving = {owner: link for owner, link, _ in links}, None, []
        for owner, link, arrays in links:
            vars(link).update(arrays, _id=owner, _pool=self._pool)
        self._apart_stale = True


def partners(pairs: Array, particles: int) -> tuple[Array, Array]:
    """(begin, partner): partner[begin[i] : begin[i + 1]] are the particles paired with i in (k, 2) pairs."""
    both = np.concatenate((pairs, pairs[:, ::-1]))
    begin = np.zeros(particles + 1, np.int64)
    np.cumsum(np.bincount(both[:, 0], minlength=particles), out=begin[1:])
    return begin, both[np.argsort(both[:, 0], kind="stable"), 1]
