"""Broad phases keep a list of the pairs that may touch. `Fast` is the default, `BruteForce` the readable reference."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.lanes import LANES
from pyverlet.ground import memory
from pyverlet.ground.constants import (
    FUSED_FROM,
    REBUILD_CALL,
    REBUILD_PAIRS,
    SAMPLE,
    SKIN,
    SKIN_HOLD,
    SKIN_LEAST,
    SKIN_MOST,
    SKIN_STEP,
    UNSORTED,
    WORTH_LOOKING,
    WORTH_THINNING,
)
from pyverlet.kernels import pairs as kernels
from pyverlet.laws.contacts._held import strayed
from pyverlet.laws.contacts.crowd import Crowd, free_skin
from pyverlet.laws.contacts.grids import Grids
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.state.slots import Slots

Array = NDArray[Any]


class PairList:
    """Candidate pairs by strip: slots pair_i[k], pair_j[k] for k in first[s] to first[s] + count[s]."""

    def __init__(self) -> None:
        self.set_strips(0)
        self.make_room(0)

    def make_room(self, pairs: int) -> None:
        """Room for at least this many pairs."""
        self.pair_i, self.pair_j = np.empty(pairs, np.uint32), np.empty(pairs, np.uint32)

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """first, count, pair_i, pair_j: where the pairs are, for kernels."""
        return self.first, self.count, self.pair_i, self.pair_j

    def set_strips(self, strips: int) -> None:
        """Begin a new list of this many strips."""
        self.first, self.count = np.zeros(strips, np.int64), np.zeros(strips, np.int64)

    def pairs(self) -> Array:
        """(k, 2) slots of all candidate pairs; a copy, for tests and measurements."""
        return rows_of(*self.listed())


def rows_of(first: Array, count: Array, pair_i: Array, pair_j: Array) -> Array:
    """(k, 2) slots of listed pairs, strip after strip; a copy."""
    parts = [slice(a, a + n) for a, n in zip(first, count, strict=True)]
    rows = [np.column_stack((pair_i[part], pair_j[part])) for part in parts]
    return np.concatenate([np.empty((0, 2), np.uint32), *rows]).astype(np.int64)


class Strips(NamedTuple):
    """If slots are in the order of the cells, those of strip s stand from held[s] to held[s + 1].

    The list is good as long as nobody is farther than `allowed`, m, from where `checked` (n, 2) says.
    """

    held: Array
    checked: Array
    allowed: float
    in_order: bool


class BroadPhase(ABC):
    """Keeps `list` good for the current positions."""

    list: PairList
    built: Array
    """(n, 2) positions the list was made from, m."""
    rebuilds: int = 0
    strayed: bool | None = None
    """Whether anyone has gone too far for the list, if whoever moved the particles has looked: the next `update` need not."""
    renewing: Callable[[Slots, PairList], None] | None = None
    """Called when the list is about to be made anew."""
    replacing: Callable[[], None] | None = None
    """The same, but also when the list was no longer valid: slots may hold other particles by now."""

    @abstractmethod
    def update(self, state: Slots) -> None:
        """Make the list good again if anyone may have moved too far since it was built. May reorder the slots."""

    def renew(self, state: Slots) -> None:
        """Make the list anew at once: in the middle of a frame somebody has turned out to be free."""
        if self.renewing:
            self.renewing(state, self.list)
        self.forget()
        self.update(state)

    @abstractmethod
    def forget(self) -> None:
        """The list is no longer valid (particles, radii or masses changed)."""

    def follow(self, state: Slots) -> None:
        """A frame begins in a periodic room: places are to be those images that the list is about."""

    def aged(self, substeps: int) -> None:
        """So many have gone by in which `update` would have done nothing."""

    def strips(self) -> Strips | None:
        """Where the particles of each strip of the list stand; None if there is no such list."""
        return None

    def release(self) -> None:
        """Nobody needs the pairs themselves until the list is made anew: their memory may go."""

    def save(self) -> Any:
        """What `restore` needs to bring the same list back."""
        return None

    def restore(self, saved: Any, state: Slots) -> None:
        """Bring back the list of the time of `save`; `state` already has the order and radii of then."""
        self.forget()


def start(method: Fast | BruteForce, dtype: np.dtype[Any]) -> BroadPhase:
    """The working part of one world."""
    return _SortedCells(dtype, method.skin) if isinstance(method, Fast) else _AllPairs(dtype)


class _AllPairs(BroadPhase):
    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.list = PairList()

    def update(self, state: Slots) -> None:
        if self.replacing:
            self.replacing()
        if self.renewing:
            self.renewing(state, self.list)
        found = self._fill(state)
        if found > len(self.list.pair_i):
            self.list.make_room(2 * found)
            self._fill(state)
        self.built = state.position.copy()
        self.rebuilds += 1

    def _fill(self, state: Slots) -> int:
        pairs = self.list
        period_x, period_y = state.reals(*state.seam.period)
        who = (state.inverse_mass, state.category, state.mask)
        found = int(kernels.list_all_pairs(state.position, state.radius, period_x, period_y, *who, pairs.pair_i, pairs.pair_j))
        pairs.set_strips(1)
        pairs.count[0] = found
        return found

    def forget(self) -> None:
        pass


class _SortedCells(BroadPhase):
    def __init__(self, dtype: np.dtype[Any], skin: float | None) -> None:
        self.list = PairList()
        self.skin_diameters = SKIN if skin is None else skin
        self._adapts = skin is None
        self._room = 4  # pairs kept free for each particle; six neighbours make three pairs
        self._age = 0  # substeps the list has lasted
        self._excess = 0.0  # pairs for each particle that a skin smaller by SKIN_STEP would not list
        self._hold = 0  # rebuilds before the skin may grow again
        self._outlived = False  # whether pairs listed for nothing have cost what a list costs: all have come to rest, say
        self._allowed = -1.0  # distance anyone may move from `_checked` before we look closer, m; negative: rebuild now
        self._mean_radius = 0.0  # m; 0: not known. Its last bit depends on the order of the slots, so it is saved, too
        self.built = self._checked = np.empty((0, 2), dtype)
        self._held = np.zeros(1, np.int64)  # circles in all strips before each
        self._worn: Grids | None = None
        self._spot, self._used = np.empty(0, dtype), np.empty(0, np.int32)  # scratch

    def update(self, state: Slots) -> None:
        self._age += 1
        known, self.strayed = self.strayed, None
        if self._allowed >= 0:
            if not self._outlived and self._still_good(state, known):
                return
            if self._adapts:
                self._adapt()
            if self.renewing:
                self.renewing(state, self.list)
        self.rebuild(state)

    def aged(self, substeps: int) -> None:
        self._age += substeps

    def strips(self) -> Strips | None:
        if self._allowed < 0 or self._outlived:
            return None
        in_order = not self._grids.falls and len(self._grids.levels.base) == 1
        return Strips(self._held, self._checked, self._allowed, in_order)

    def follow(self, state: Slots) -> None:
        # Looked at between frames only: within one they are gone through in different ways, which must give the same bits.
        self._outlived = self._adapts and self._excess > WORTH_THINNING and self._excess * self._age > self._worth()
        if not state.seam or self._allowed < 0:
            return
        state.seam.follow(state.position, self._checked)
        if state.seam.strays(state.position):  # the farther a crowd has drifted, the fewer digits are left
            state.seam.wrap(state.position)
            self._allowed = -1.0

    def forget(self) -> None:
        self._allowed = -1.0
        self._mean_radius = 0.0

    def release(self) -> None:
        self.list.count.fill(0)
        self.list.make_room(0)

    def save(self) -> tuple[Any, ...]:
        kept = (self.built.copy(), self._checked.copy(), self._allowed) if self._allowed >= 0 else None
        return kept, self.skin_diameters, self._age, self._hold, self._mean_radius

    def restore(self, saved: tuple[Any, ...], state: Slots) -> None:
        self.forget()
        kept, self.skin_diameters, age, self._hold, self._mean_radius = saved
        if kept is not None and len(kept[0]) == len(state):  # or particles had been added that it had not met yet
            # The list is a function of the positions it was built from and the order of the slots, which is that of then.
            built, checked, allowed = kept
            state.position[:] = built
            self.rebuild(state)
            self._checked, self._allowed = checked.copy(), allowed
        self._age = age

    def _still_good(self, state: Slots, known: bool | None) -> bool:
        """Whether no pair that is not listed can touch: nobody has strayed, as may be `known`, or not far at a closer look."""
        if not (strayed(state, self._checked, self._allowed) if known is None else known):
            return True
        slack = self._grids.slack(state.position, self.built, 2.0 * self._half_skin)
        if not slack > WORTH_LOOKING * self._half_skin:
            return False
        self._checked, self._allowed = memory.copy(state.position), 0.5 * slack
        return True

    def _worth(self) -> float:
        """Pairs for each particle that contacts solve in a substep in the time in which the list is built anew."""
        return REBUILD_PAIRS + REBUILD_CALL / max(len(self.built), 1)

    def _adapt(self) -> None:
        """Towards the skin where a substep pays as little as it can for rebuilding and for pairs that are listed for nothing."""
        # A list lives about as long as its skin is thick: a step up saves this much for each particle and substep.
        saved = self._worth() / self._age * (1.0 - 1.0 / SKIN_STEP)
        self._hold = max(self._hold - 1, 0)
        if self._excess > saved * SKIN_STEP:
            self.skin_diameters = max(self.skin_diameters / SKIN_STEP, SKIN_LEAST)
            self._hold = SKIN_HOLD
        elif saved > self._excess * SKIN_STEP and not self._hold:
            self.skin_diameters = min(self.skin_diameters * SKIN_STEP, SKIN_MOST)

    def rebuild(self, state: Slots) -> None:
        """Sort the particles by cell and list the pairs."""
        if self.replacing:
            self.replacing()
        self.rebuilds += 1
        self._age, self._outlived, self._allowed = 0, False, -1.0  # until it is done: somebody may break it off
        if not self._mean_radius:
            self._mean_radius = float(state.radius.mean(dtype=np.float64))
        crowd = self._sort(state)
        skin = 2.0 * self._half_skin
        self._fill(crowd, state.real(skin + crowd.rounding))
        self.built = self._checked = memory.copy(state.position)
        self._allowed = self._half_skin
        which = self.list.listed()
        looked, far = kernels.count_far(crowd.position, crowd.radius, *which, state.real(skin / SKIN_STEP), SAMPLE)
        self._excess = far / max(looked, 1) * int(self.list.count.sum()) / max(len(state), 1)
        crowd.bring_home(which, self._grids)

    def _sort(self, state: Slots) -> Crowd:
        """Stand the circles, and their copies across a seam, in cells; slots are reordered if many are out of order."""
        for _ in range(2):
            skin = min(self.skin_diameters * 2.0 * self._mean_radius, free_skin(state))
            self._half_skin = 0.5 * skin
            crowd = Crowd.of(state, skin)
            self._grids = self._worn = Grids(crowd.position, crowd.radius, skin, worn=self._worn, crowd=crowd)
            # Strip by strip all slots are gone through, and those of a strip must stand together.
            if not self._grids.falls > (UNSORTED * len(state) if len(state) < FUSED_FROM else 0):
                break
            state.reorder(crowd.originals(self._grids.order))
            if not crowd.copies:
                self._grids.renumber()
                return Crowd.of(state, skin)
        return crowd

    def _fill(self, crowd: Crowd, skin: Any) -> None:
        pairs, cells, count = self.list, self._grids, len(crowd.radius)
        rows, held = cells.strips()
        self._held = held
        picky = len(crowd.category) > 0 or not crowd.inverse_mass.all()
        pairs.set_strips(len(rows) - 1)
        if len(pairs.pair_i) != self._room * count:
            pairs.make_room(self._room * count)
        while True:
            first = held * self._room
            self._spot = memory.room(self._spot, size := 3 * (count + LANES))
            self._used = memory.room(self._used, count)
            spot, used = self._spot[:size].reshape(3, -1), self._used[:count]
            kernels.list_pairs(
                crowd.position, crowd.radius, cells.order, cells.levels, cells.start, rows, first, skin,
                picky, crowd.category, crowd.mask, crowd.inverse_mass,
                spot, used, pairs.pair_i, pairs.pair_j, pairs.count,
            )  # fmt: skip
            if (pairs.count <= np.diff(first)).all():
                pairs.first[:] = first[:-1]
                return
            self._room = int(np.ceil(1.25 * (pairs.count / np.maximum(np.diff(held), 1)).max()))
            pairs.make_room(self._room * count)
