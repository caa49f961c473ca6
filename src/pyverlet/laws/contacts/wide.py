"""The contacts of circles, eight pairs at a time: the pairs of a list in packs, what they are made of, and the two sweeps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile import jit
from pyverlet.compile.bundle import hold
from pyverlet.compile.lanes import LANES
from pyverlet.compile.rows import WIDTH
from pyverlet.ground import memory
from pyverlet.ground.constants import CARRIED_WEIGHT, COLOURS, DEEP, DEEP_LENT, FED, LARGEST_PUSH, PUSHED
from pyverlet.kernels import frame, packs, sweeps, tables
from pyverlet.kernels.bounds import CARRIES
from pyverlet.kernels.kinds import BOUNCING, HEARD, ROUGH, SMOOTH
from pyverlet.kernels.seam import close_gaps
from pyverlet.laws.contacts._held import claims
from pyverlet.laws.contacts.broadphase import PairList, rows_of
from pyverlet.state.seam import NONE, Seam
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_ROWS = tables.TURN_J + 1
_ARRIVES = tables.Law._fields.index("arrives")
_CALM = -2
"""Where it is among what is noted."""

_NO_TIME = np.zeros(1)


class Wide:
    """The pairs of one list, packed each time the list is made anew.

    Args:
        restitution, friction: of circles that have no values of their own.
        listens: note in `closing` who meets how fast.

    Attributes:
        lane_i, lane_j: slots; those of strip s from begin[s] to begin[s] + lanes[s], the first apart[s] unlikely to touch soon.
        gap: (2, room) from i to j when the list was made, m.
        origin: (n, 2) where circles were then. moved: (n, 2) how far they have come since.
        reach, share, reduced: m, what part of a push moves i, kg; one for each lane, or (LANES,) if they are the same for all.
        made_of: (6, room) or (6, LANES) what each pair is made of: rows of `kernels.tables`.
        normal: (2, room) of pairs that touch, for others 0. depth: (room,) their overlap, m.
        slip: (room,) what contacts have slipped, m.
        closing: (room,) largest speed of approach since the last `collect`, m/s; negative: has not touched.
        bounced: (room,) how often they have bounced since then; of a pair that is listed twice, noted once.
        touched: (room,) bool, whether pairs have in the frame before, as events mark it.
        spent: (strips, 3) J that impacts, and friction, have taken in this frame, negative; and the virial of contacts: sum of
            what pushes each pair apart times their distance, N s m.
        circles, packed, law: what kernels of contacts take since `set_up`, as `kernels.tables` describes it.
        calm: (n,) m/s, up to which circles that lend inertia, or are linked, meet as contacts at rest do; (0,): none does.
        weighs: whether that is asked for.
        asks: whether any pair may bounce or rub, or the virial is asked for, or who carries weight. rubs: whether any may rub.
    """

    def __init__(self, dtype: np.dtype[Any], restitution: float = 0.0, friction: float = 0.0, *, listens: bool = False) -> None:
        self._dtype = dtype
        self._settings = restitution, friction
        self._listens, self._bears = listens, False
        self.asks = self.rubs = self.weighs = False
        self.begin = np.zeros(1, np.int64)
        self.lanes = self.apart = np.zeros(0, np.int64)
        self._make_room(0)
        self._cut = np.zeros((2, 2), np.int64)
        self.origin = self.moved = np.empty((0, 2), dtype)
        self._spare = COLOURS * LANES  # lanes of a strip beyond its pairs: twice as many as any needed in the last list
        self._known: Any = None  # what the tables were made from
        self._varied = self._sized = self._mixed = 0
        self._deeps = np.zeros(0, np.int64)  # packs of each strip that overlap deeply
        self._looks = True  # whether they are to be noted, once a frame
        self.spent = np.zeros((1, 3))
        self.calm = none = np.empty(0, dtype)
        rows = np.empty((0, 2), dtype)
        self._lent, self._empty, self._own_calm = False, (rows, none), none
        self.circles: Any = None
        self.packed: Any = None
        self._striped: Any = None
        self._hold_circles(0)

    @property
    def kind(self) -> str:
        """Which kernels it takes: of `kernels.kinds`."""
        return ROUGH if self.rubs else BOUNCING if self.asks else HEARD if self._listens else SMOOTH

    def _make_room(self, lanes: int) -> None:
        self.lane_i, self.lane_j = (memory.empty(lanes, np.uint32) for _ in range(2))
        self.gap, self.normal = memory.empty((2, lanes), self._dtype), np.empty((2, 0), self._dtype)
        self._deep = np.empty(lanes // LANES, np.int64)
        self.depth = self.slip = self.closing = np.empty(0, self._dtype)
        self.touched, self.bounced = np.zeros(0, bool), np.zeros(0, np.uint8)

    def _hold_circles(self, count: int) -> None:
        """Room for what contacts that may bounce or rub note of circles."""
        self._carries, self._lift, self._leans, self._turn = (np.zeros(count, self._dtype) for _ in range(4))
        self._rows = np.zeros((count, WIDTH), self._dtype)

    def take(self, pairs: PairList, origin: Array, radius: Array, seam: Seam = NONE) -> None:
        """Pack a new list; origin: (n, 2) positions it was made from; radius: (n,) m."""
        need = pairs.count + self._spare
        self.lanes, self.apart = (np.empty(len(pairs.count), np.int64) for _ in range(2))
        which = pairs.listed()
        while True:
            self.begin = np.concatenate(([0], np.cumsum(-(-need // LANES) * LANES)))
            if not self.begin[-1] <= len(self.lane_i) <= 1.1 * self.begin[-1]:
                self._make_room(int(self.begin[-1]))
            used = np.full(len(origin), -1, np.int64)
            packs.pack(origin, radius, *which, used, self.begin, self.lanes, self.apart, self.lane_i, self.lane_j, self.gap)
            if (self.lanes <= need).all():
                break
            need = np.maximum(need, self.lanes)
        if seam:
            period, packed = map(self._dtype.type, seam.period), (self.begin, self.lanes, self.lane_i, self.lane_j, radius)
            close_gaps(*packed, *period, self.gap, self.apart)
        self._spare = 2 * max(int((self.lanes - pairs.count).max(initial=0)), LANES)
        self._cut = np.empty((2, 0), np.int64)
        self.origin = origin
        self.moved = memory.empty(origin.shape, origin.dtype)
        self._known = None
        self._deeps, self._looks = np.zeros(len(pairs.count), np.int64), True
        spent, self.spent = self.spent.sum(axis=0), np.zeros((max(len(self.lanes), 1), 3))
        self.spent[0] = spent
        if self._listens:
            self.closing, self.touched = np.full(len(self.lane_i), -1, self._dtype), np.zeros(len(self.lane_i), bool)
            self.bounced = np.zeros(len(self.lane_i), np.uint8)

    def cut(self) -> Array:
        """(2, threads + 1): even and odd strips, each cut into as many parts of as nearly the same number of lanes as can be.

        By their number alone a round room's would not be: the short rows of strips at its ends hold fewer.
        """
        threads = jit.threads_in_use()
        if self._cut.shape[1] != threads + 1:
            strips = len(self.lanes)
            if threads == 1:
                self._cut = np.array([[0, (strips + 1) // 2], [0, strips // 2]])
                return self._cut
            self._cut = np.empty((2, threads + 1), np.int64)
            for parity in range(2):
                before = np.concatenate(([0], np.cumsum(self.lanes[parity::2])))
                middle = 0.5 * (before[1:] + before[:-1])
                self._cut[parity] = np.searchsorted(middle, np.linspace(0, before[-1], threads + 1))
        return self._cut

    def pairs(self) -> Array:
        """(k, 2) slots of the pairs in all lanes; a copy, for tests and measurements. The last pair of a pack may come twice."""
        return rows_of(*self.listed())

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """Where the pairs are: first, count, pair_i, pair_j. Some come twice, with the same notes."""
        return self.begin[:-1], self.lanes, self.lane_i, self.lane_j

    def hold_slips(self) -> None:
        """Room for what friction notes; the values are anything."""
        if len(self.slip) != len(self.lane_i):
            self.slip = np.empty(len(self.lane_i), self._dtype)

    def drop_slips(self) -> None:
        """Nobody rubs any more."""
        if len(self.slip):
            self.slip = self.slip[:0]

    def weigh(self, asked: bool) -> None:
        """Whether somebody asks for the virial."""
        if asked != self.weighs:
            self.weighs, self._known = asked, None

    def bear(self, asked: bool) -> None:
        """Whether somebody asks who carries weight, of circles that neither bounce nor rub."""
        if asked != self._bears:
            self._bears, self._known = asked, None

    # ---- what circles are made of ----------------------------------------------------------------------------------------

    def fits(self, state: Slots) -> bool:
        """Whether the tables are those of the circles of now."""
        return self._known is not None and self._known[0] is state.size and self._known[1] == state.given

    def fit(self, state: Slots) -> None:
        """Bring the tables up to date with the sizes, masses and materials of now."""
        self._known = state.size, state.given
        size, inverse_mass, (e, mu) = state.size, state.inverse_mass, self._settings
        columns = inverse_mass, size, state.radius, state.restitution, state.friction
        self._varied, self._sized, self._mixed = packs.vary(*columns)
        self.rubs = max(mu, state.most_friction) > 0.0
        self.asks = self.weighs or self._bears or self.rubs or max(e, state.most_restitution) > 0.0
        self.reach, self.share = np.full(LANES, size[0] + size[0]), np.full(LANES, self._dtype.type(0.5))
        if self._sized:
            self.reach = memory.empty(len(self.lane_i), self._dtype)
            packs.add_radii(*self._lanes(), size, self.reach)
        with np.errstate(divide="ignore"):
            self.reduced = np.full(LANES if self.asks else 0, 1 / (inverse_mass[0] + inverse_mass[0]))
        if self._varied:
            self.share = memory.empty(len(self.lane_i), self._dtype)
            self.reduced = memory.empty(len(self.lane_i) if self.asks else 0, self._dtype)
            packs.share_out(*self._lanes(), self.cut(), inverse_mass, self.share, self.reduced)
        if self.normal.shape != self.gap.shape:
            self.normal = memory.empty(self.gap.shape, self._dtype)
        if not self.asks:
            self.made_of = np.empty((_ROWS, 0), self._dtype)
            return
        self.made_of = memory.empty((_ROWS, len(self.lane_i) if self._mixed else LANES), self._dtype)
        lane = np.zeros(LANES, np.uint32)
        begin, lanes, i, j = self.listed() if self._mixed else (np.zeros(1, np.int64), np.full(1, LANES), lane, lane)
        materials = state.restitution, state.friction, state.real(e), state.real(mu)
        packs.compose(begin, lanes, i, j, state.radius, *materials, self.made_of)
        if len(self.depth) != len(self.lane_i):
            self.depth = np.empty(len(self.lane_i), self._dtype)
        if len(self._carries) != len(state):
            self._hold_circles(len(state))
        if self.rubs:
            # A circle at rest among others ends a substep with the velocity -leans a: see `lean` of Slots.
            own = np.where(state.friction >= 0, state.friction, mu) > 0
            self._rough = own.astype(self._dtype)

    # ---- a substep ---------------------------------------------------------------------------------------------------------

    def set_up(
        self, state: Slots, h: float, lag: float, strongest: float, rest_speed: float, accounts: bool,
        noted: tuple[Array, ...] | None, *, linked: bool = False,
    ) -> None:  # fmt: skip
        """Everything that the sweeps of this substep, and of those that follow it alike, need: `circles`, `packed` and `law`.

        noted: where circles lend inertia, where impacts note what they do: `Loans.begin`. linked: whether links pull at any.
        """
        if fresh := not self.fits(state) or (self._lent and noted is None):
            self.fit(state)
        self._lent = noted is not None
        if self.asks:
            np.bitwise_and(state.fed, CARRIES, out=self._carries, casting="unsafe")
            if fresh:  # each first sweep finds them as the second one before has left them: there may have been none
                self._rows[:, :3], self._rows[:, 3] = 0, self._carries
        if not noted:
            if len(self._own_calm) != (count := len(state) if linked and self.asks else 0):
                self._own_calm = np.empty(count, self._dtype)
            self._own_calm.fill(0)
            rows, none = self._empty
            noted = rows, none, none, none, self._own_calm, rows
        self.calm = noted[_CALM]
        turn = self._turn if self.rubs else self._empty[1]
        if self.rubs:
            np.multiply(self._rough, state.real((state.drop - PUSHED / FED) * h), out=self._leans)
            state.turn, state.lift = turn, self._lift
        circles = (
            state.position, state.velocity, state.acceleration, state.inverse_mass, self.origin, self.moved, state.resting,
            state.spin, self._carries, state.fed, self._rows, turn, self._lift, self._leans, state.start,
            state.radius, state.restitution, state.friction, state.hits, state.spent, state.impacts, *noted,
        )  # fmt: skip
        self.circles = hold(tables.Circles, circles, self.circles)
        carried = CARRIED_WEIGHT * strongest * h if strongest > 0 else np.inf
        deep, grazes = (DEEP_LENT, 0.0) if self._lent else (DEEP, 1.0)
        self.law = (
            self._varied, self._sized, self._mixed, int(self.rubs), int(self._listens), int(accounts or self.weighs),
            1, *state.reals(h, lag, FED / PUSHED / h, LARGEST_PUSH, deep, rest_speed, grazes), int(strongest > 0),
            state.real(carried),
        )  # fmt: skip
        pairs = (
            self.begin, self.lanes, self.apart, self.lane_i, self.lane_j, self.gap, self.reach, self.share, self.reduced,
            self.made_of, self.normal, self.depth, self.slip, self.closing, self._deep, self._deeps, self.spent,
            self.bounced,
        )  # fmt: skip
        self.packed = hold(tables.Pairs, pairs, self.packed)

    def striped(self, normal: Array) -> Any:
        """The same pairs, whose normals are kept elsewhere."""
        arrays = tuple(normal if array is self.normal else array for array in self.packed.arrays)
        self._striped = hold(tables.Pairs, arrays, self._striped)
        return self._striped

    def leave_arriving(self) -> None:
        """The room puts circles where pushes have moved them: one pass over the memory less."""
        self.law = (*self.law[:_ARRIVES], int(self.asks), *self.law[_ARRIVES + 1 :])

    def takes_looks(self) -> int:
        """Whether the next sweep is to note who overlaps deeply: once a frame, or always where circles lend inertia."""
        looks, self._looks = int(self._looks), self._lent
        return looks

    def look_anew(self) -> None:
        """The next sweep is to note who overlaps deeply."""
        self._looks = True

    def touching(self) -> tuple[Array, Array, Array, Array, Array]:
        """begin, lanes, lane_i, lane_j and normals of this substep: not 0 for pairs that touch and have not bounced."""
        return *self._lanes(), self.normal

    def _lanes(self) -> tuple[Array, Array, Array, Array]:
        return self.begin, self.lanes, self.lane_i, self.lane_j

    def do(self, part: np.int64, state: Slots, kind: str = "", beside: Any = (), services: tuple[Any, ...] = ()) -> None:
        """One part of a substep by itself, by the `kind` of `kernels.frame.frames`; beside, services: as it takes them.

        `TOUCHED`: impacts, overlaps and slips; circles are then where that has moved them. `STILLED`: touching circles neither
        approach nor slip.
        """
        looks = self.takes_looks() if part == frame.TOUCHED else 0
        nothing = state.reals(0, 0, 0, 0, 0, 0)
        frame.frames[kind][self.kind](
            0, 1, -1, self.circles, self.packed, self.law, (frame.OPEN, *nothing), beside, services, (), self.cut(),
            (looks, 1, 0, part, *nothing[:2]), self.origin, nothing[0], claims(state), _NO_TIME, (0, 0.0),
        )  # fmt: skip

    def mark_resting(self, state: Slots) -> None:
        """Note in `state.resting` who touches another."""
        sweeps.mark_touching(self.lanes, self.begin, self.lane_i, self.lane_j, self.normal, state.resting, self.cut())
        self.look_anew()
