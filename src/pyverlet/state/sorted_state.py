"""`SortedState`, the engine's copy of the particles in its own order.

It is sorted so that neighbours in space are neighbours in memory; the order is not visible outside.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from pyverlet import core
from pyverlet.common import memory
from pyverlet.common.arrays import Array
from pyverlet.common.renamed import Renamed
from pyverlet.state.neighbours import Near, VerletLists
from pyverlet.state.periodicity import NONE, Periodicity
from pyverlet.state.state import COLUMNS, DEFAULTS, EVERYONE, MARKS, MOVING, ROWS, SET, Arrays, State, check_set, moving
from pyverlet.state.unchanged import Unchanged, blocks_of, columns_differ

_GIVEN, _LISTED, _NUMBERS = (*SET, *MARKS), ("radius", "mass", *MARKS), len(SET)
_RARE = SET[2:]  # columns of which few worlds have more than one value; a single one is then stored

# Sleep state beyond the user's arrays: dtype, and value for a new particle.
_REMEMBERED: dict[str, tuple[Any, Any]] = {"island": (np.int64, -1), "sleep_timer": (np.float32, 0)}

_OWN = (*ROWS, "spin", "radius", "mass", "inverse_mass", *_REMEMBERED)
"""Columns that every particle has here."""


class SortedState(Arrays):
    """The engine's working copy, in its own order: what forces, integrators, contacts and bounds use during a frame.

    Attributes:
        engine, motion: units of the core for this dtype.
        real: rounds a number to the dtype, with a cache, as rounding in NumPy takes longer than a kernel call.
        particle: (n,) the user's index of the particle of each row.
        position, velocity, acceleration, spin, radius, mass: as in State.
        restitution, friction, rolling_resistance, inertia: as in State, read-only.
        category, mask: as in State, or empty while all circles collide with each other.
        material, fixed_rotation: as in State, or empty while all are 0. materials: as in State.
        most_friction, most_rolling: largest values of their columns; negative if no circle has values of its own.
        unchecked: whether the user's values were read again and have not been checked.
        own_inertia: whether any has a moment of inertia other than a disc's. own_walls: whether the room is user-defined.
        revision: how often the user's values were read again, or sleepers changed.
        inverse_mass: (n,) 1/kg; 0 for pinned particles; `pins`: whether there are any. total_mass: of the others, kg.
        force: (n, 2) N, the sum of forces besides gravity in this evaluation.
        h: length of a substep of this frame, s. taken: J that the energy limiter has removed in it.
        thread_team: during a frame the address of the team of threads, and the number of threads in use.
        island, sleep_timer: (n,) number of a sleeper's island, -1 if awake, and s at rest; empty unless particles may sleep.
        others: whether particles were added or removed before this frame. fresh: the user's index of the first new one.
        placed: (n,) 1 for particles that the user moved or enlarged before this frame, else 0.
        copied: whether the user's positions, velocities, accelerations and spins were copied in for this frame.
        crossed: (n, 2) m, whole periods by which particles were wrapped into a periodic room in this frame; None elsewhere.

    Args:
        sleeps: whether particles may sleep.
    """

    def __init__(self, dtype: np.dtype[Any], *, sleeps: bool = False) -> None:
        self.dtype, self._sleeps = dtype, sleeps
        self.engine: Any = core.unit("engine", dtype)
        self.motion: Any = core.unit("motion", dtype)
        self.real = lru_cache(64)(dtype.type)
        self._given: dict[str, Any] = {name: np.zeros(0, np.uint32 if name in MARKS else dtype) for name in _GIVEN}
        self._void, self._known = True, False  # whether all lists are invalid; whether `_given` is up to date
        self._lists, self._given_back = VerletLists(), Unchanged()
        self.total_mass, self.pins, self.taken, self.revision, self.h = 0.0, False, 0.0, 0, 0.0
        self.particle = np.empty(0, np.int32)
        for name in (*_OWN, *_RARE):
            setattr(self, name, np.empty((0, 2) if name in ROWS else 0, _REMEMBERED.get(name, (dtype, 0))[0]))
        self.category = self.mask = self.material = self.fixed_rotation = np.empty(0, np.uint32)
        self.most_friction = self.most_rolling = -1.0
        self._resize(0)

    def __len__(self) -> int:
        return len(self.radius)

    def _resize(self, count: int) -> None:
        """Resize to `count` particles: those of `particle`, followed by new ones."""
        known = len(self.particle)
        self._given_back.forget_blocks()
        self.placed = np.ones(count, np.uint8)
        self._written = np.zeros(blocks_of(count), np.uint8)
        if count > known:
            self.particle = np.concatenate((self.particle, np.arange(known, count, dtype=np.int32)))
        for name in _OWN:
            rows = memory.resized(getattr(self, name), 0 if name in _REMEMBERED and not self._sleeps else count)
            setattr(self, name, rows)
            if name in _REMEMBERED:
                rows[known:] = _REMEMBERED[name][1]
        for scratch in {"force", "resistance", "strength", "solving"} & vars(self).keys():
            rows = memory.resized(getattr(self, scratch), count)
            rows.fill(0)
            setattr(self, scratch, rows)
        self._changed = True
        self.crossed = None
        self._scratch: list[Array] = []
        self._sorted_index = self._looked = self._asleep = self._free = None

    inverse_mass: Array
    particle: Array
    slots_of: Any = Renamed("sorted_index")
    thread_team = (0, 1)
    key = ""  # of the world's state
    boundary: Any = None
    periodic: Periodicity = NONE  # none, as in a periodic room positions move beyond it within a frame
    island: Array
    sleep_timer: Array
    crossed: Array | None
    others = copied = own_walls = True
    fresh, own_inertia, unchecked = 0, False, True
    _sorted_index: Array | None
    _looked: tuple[bool, bool, bool] | None
    _asleep: Array | None
    _free: Array | None

    @cached_property
    def force(self) -> Array:
        """(n, 2) N; allocated on first use."""
        return np.zeros_like(self.position)

    def near(self, cutoff: float, *, together: bool = False) -> Near:
        """Pairs of rows closer to each other than `reach` m, in arrays that the next call overwrites.

        together: include coincident ones, with a direction along x, from the lower user's index to the other.

        Raises:
            InputError: a periodic room is narrower than twice that.
        """
        pairs = self._lists.within(self.position, self.particle, self.periodic, cutoff, together=together)
        if together and len(alike := np.flatnonzero(pairs.distance == 0)):
            pairs.way[alike[self.particle[pairs.i[alike]] > self.particle[pairs.j[alike]]], 0] = -1
        return pairs

    @cached_property
    def wall_hits(self) -> Array:
        """(n, 2) m/s, in a user-defined room: the fastest arrival at a wall in this frame, or -1, and the impulse of walls."""
        return np.tile(np.array([-1, 0], self.dtype), (len(self), 1))

    @cached_property
    def resistance(self) -> Array:
        """(n,) N s/m, derivative of drag by speed, summed in an evaluation and 0 in between."""
        return np.zeros_like(self.radius)

    @cached_property
    def solving(self) -> Array:
        """(n, 10), memory of `core.velocity_solving` between evaluations."""
        return np.zeros((len(self.radius), 10))

    @cached_property
    def strength(self) -> Array:
        """(n,) m/s^2, acceleration by gravity and forces without drag in the last evaluation."""
        return np.zeros_like(self.radius)

    @property
    def asleep(self) -> Array:
        """Rows of sleeping particles."""
        if self._asleep is None:
            self._asleep = np.flatnonzero(self.island >= 0)
        return self._asleep

    @property
    def free(self) -> Array:
        """Rows of particles that are neither pinned nor asleep."""
        if self._free is None:
            self._free = np.flatnonzero(self.inverse_mass > 0)
        return self._free

    @property
    def is_new(self) -> bool:
        """Whether particles were added or removed since the last frame: only their order is known yet."""
        return self._changed

    def look(self, state: State) -> tuple[bool, bool, bool]:
        """Before `gather`: whether particles were added or removed, moved, or given other values since the last frame."""
        moved = not self._given_back.recall(moving(state), self.thread_team, touched=state.touched(MOVING))
        changed = not self._known
        if not changed and state.touched(_GIVEN):  # compared in the user's order, which needs no index
            given, now = tuple(self._given.values()), [state.shown[name][: len(self)] for name in _GIVEN]
            columns = given[:_NUMBERS], now[:_NUMBERS], given[_NUMBERS:], now[_NUMBERS:]
            changed = self.engine.any_differs(*columns, *self.thread_team)
        state.forget_released()
        self._looked = len(state) != len(self), moved, changed
        return self._looked

    def gather(self, state: State) -> bool:
        """Copy the user's arrays in. True if radii, masses or marks of known particles have changed: lists are then void."""
        (others, self.copied, changed), self._looked = self._looked or self.look(state), None
        self.fresh = known = len(self)
        self.others = others or self._changed
        if others:
            self._resize(len(state))
        self.key, self.periodic, self.boundary = state.key, state.periodic, state.boundary
        first = 0 if self.copied else known  # unchanged rows are not copied again
        if first < len(self):
            rows = [*moving(self), self.particle, self.placed]
            rows = [column[first:] for column in rows] if first else rows
            self.engine.take_motion(rows, moving(state), *rows[4:], *self.thread_team)
        if first or self.others:
            self.placed[:first], self.placed[known:] = 0, 1
        if changed:
            self.placed[:known] |= self._enlarged(state, known).take(self.particle[:known])
        return self._take_given(state, known, changed=changed) if changed or self.others else False

    def _enlarged(self, state: State, known: int) -> Array:
        """(known,) bool, by the user's index: particles whose radius has increased."""
        return np.asarray(state.shown["radius"][:known] > (self._given["radius"] if self._known else np.inf))

    def check(self) -> None:
        """Check the user's values.

        Raises:
            InputError: a value is not allowed.
        """
        check_set(self._given)

    def _take_given(self, state: State, known: int, *, changed: bool) -> bool:
        """Copy in values that users set and the engine does not change.

        known: previous number of particles; changed: whether any of these may have changed.
        """
        void, self._void, self._known, self.unchecked = self._void, False, True, True
        for name, given in self._given.items():
            now = state.shown[name]
            differs = changed and columns_differ(given, now[:known])
            void |= differs and name in _LISTED
            if differs or len(given) != 1 or (now[known:] != given).any():
                self._given[name] = (now[:1] if (now == now[:1]).all() else now).copy()
        self._take_rare(changed=changed)
        for name in ("radius", "mass"):
            if len(given := self._given[name]) == 1:  # equal for all
                memory.put(getattr(self, name)[0 if changed else known :], given[0])
            elif changed or known < len(self):
                memory.take(given, self.particle, getattr(self, name))
        self.update_inverse_mass(0 if changed else known)
        # Summed in the user's order: that of rows, and so the last bit, differs after a saved world is restored.
        mass, self.pins = state.shown["mass"], not np.isfinite(self._given["mass"]).all()
        self.total_mass = float((mass[np.isfinite(mass)] if self.pins else mass).sum(dtype=float))
        self.own_inertia = bool(self._given["inertia"].any())
        self.most_friction = float(self._given["friction"].max(initial=-1.0))
        self.most_rolling = float(self._given["rolling_resistance"].max(initial=-1.0))
        filters = (self._given["category"] != 1).any() or (self._given["mask"] != EVERYONE).any()
        order = self.particle if filters else self.particle[:0]
        self.category, self.mask = state.shown["category"][order], state.shown["mask"][order]
        self.materials = state.materials
        for name in ("material", "fixed_rotation"):
            marks = state.shown[name]
            setattr(self, name, marks[self.particle] if self._given[name].any() else marks[:0].copy())
        self._changed = False
        return void

    def _take_rare(self, *, changed: bool) -> None:
        for name, given in self._given.items():
            if name in _RARE and (changed or len(getattr(self, name)) != len(self)):
                alike = len(given) == 1
                setattr(self, name, np.broadcast_to(given, len(self)) if alike else memory.taken(given, self.particle))

    def _alike(self) -> set[str]:
        """Columns that are equal for all particles, so that their order does not matter."""
        alike = {name for name, given in self._given.items() if len(given) == 1}
        return alike | ({"inverse_mass"} if "mass" in alike and not len(self.island) else set())

    def alike_in(self, state: State) -> set[str]:
        """`_alike` for the user's columns that cannot have been written to since the last frame."""
        known = self._known and len(state) == len(self)
        return {name for name in self._alike() & set(_GIVEN) if known and not state.touched((name,))}

    def differ(self, name: str) -> bool:
        """Whether particles have different values in this column."""
        return len(self._given[name]) > 1

    def update_inverse_mass(self, first: int = 0) -> None:
        """Update `inverse_mass` from `mass` and sleep, from row `first` on."""
        with np.errstate(divide="ignore"):  # a mass of 0 is refused later, with a message
            np.divide(1, self.mass[first:], out=self.inverse_mass[first:])
        self._asleep = self._free = None
        self.inverse_mass[self.asleep] = 0
        self.revision += 1

    def clear_records(self) -> None:
        """Discard the records of walls, periodic boundary and energy limiter in the last frame."""
        vars(self).pop("wall_hits", None)
        self.taken, self.crossed = 0.0, None

    def forget(self, gone: Array, rows: Array, left: Array) -> None:
        """Remove the user's particles `gone`, which are in these rows; left: (n,) the user's index of each remaining row."""
        alike, self.particle = self._alike(), left
        for name in (*_OWN, *MARKS):
            if name not in alike and len(column := getattr(self, name)):
                memory.close_ranks(column, rows)
        for name, given in self._given.items():
            if len(given) != 1:
                self._given[name] = np.delete(given, gone[gone < len(given)])
        for name in MARKS:
            setattr(self, name, getattr(self, name)[: len(self.particle)])
        self._resize(len(self.particle))
        self._take_rare(changed=False)

    def edited(self, state: State) -> Array:
        """(n,) rows of particles that the user has moved or changed since they fell asleep."""
        known = len(self)
        rows = state.shown["velocity"][:known] != 0
        written = rows[:, 0] | rows[:, 1] | (state.shown["spin"][:known] != 0)
        for name, given in self._given.items():
            now = state.shown[name][:known]
            if columns_differ(given, now):
                written |= given != now
        moved = state.shown["position"].take(self.particle, axis=0) != self.position
        return np.asarray(written.take(self.particle) | moved[:, 0] | moved[:, 1])

    def scatter(self, state: State, dt: float, still: Array) -> None:
        """Copy the results of a frame of dt seconds back to the user's arrays; still: (blocks,) unchanged ones, or empty."""
        given, angle, written = moving(state), state.shown["angle"], self._written
        if len(still):
            written.fill(0)
        self.engine.put_motion(moving(self), given, angle, 0.5 * dt, self.particle, still, written, *self.thread_team)
        self._given_back.remember(given, written if len(still) else still, self.thread_team)
        if self.crossed is not None:
            row, axis = np.divmod(at := np.flatnonzero(self.crossed), 2)
            state.crossed[self.particle[row], axis] += self.crossed.reshape(-1)[at]
            self.crossed = None

    def where(self) -> Array:
        """(n, 2) current positions in the user's order, m."""
        position = np.empty_like(self.position)
        position[self.particle] = self.position
        return position

    def in_users_order(self) -> State:
        """A state with the current positions, velocities, spins, radii, masses, categories and masks."""
        state, names = State(self.dtype), (*ROWS, "spin", "radius", "mass", "inertia", "category", "mask")
        state._key, state.periodic, state.boundary = self.key, self.periodic, self.boundary
        order = self.sorted_index(np.arange(len(self)))
        for name, column in state.arrays():  # other columns are those of new particles
            value = np.asarray(DEFAULTS.get(name, 0), column.dtype)
            blank = np.broadcast_to(value, (len(self), *column.shape[1:]))
            held = getattr(self, name) if name in names else blank
            # Columns of bits are not stored while they have their default.
            state.shown[name] = held.take(order, axis=0) if held is not blank and len(held) == len(self) else blank
            setattr(state, name, state.shown[name])
        return state

    def reorder(self, order: Array) -> None:
        """Move the particle of row order[k] to row k."""
        spare = memory.empty(self.position.shape, self.dtype)
        for name in ROWS:
            old = getattr(self, name)
            np.take(old, order, axis=0, out=spare, mode="clip")  # mode="clip", as any other fills a copy
            setattr(self, name, spare)
            spare = old
        alike = self._alike()
        for name in (*COLUMNS, *MARKS, "inverse_mass", "particle", *_REMEMBERED, "placed"):
            if name not in alike and len(column := getattr(self, name)):
                setattr(self, name, memory.taken(column, order))
        self._sorted_index = self._asleep = self._free = None

    def save(self, state: State) -> dict[str, Array]:
        """State between frames that is not in the user's arrays: the order, sleep, and whether lists are invalid."""
        void = self._void or any(columns_differ(self._given[name], state.shown[name][: len(self)]) for name in _LISTED)
        columns = {name: getattr(self, name).copy() for name in ("particle", *_REMEMBERED)}
        placed = np.ones(len(state), bool)
        placed[self.particle] = (state.shown["position"].take(self.particle, axis=0) != self.position).any(axis=1)
        placed[: len(self)] |= self._enlarged(state, len(self))
        if len(rows := self.asleep):  # sleepers that the next frame is to wake
            placed[self.particle[rows]] |= self.edited(state)[rows]
        return columns | {"void": np.array([void])} | ({"placed": placed} if placed.any() else {})

    def restore(self, saved: dict[str, Array], state: State) -> None:
        """Set what `save` returned, and gather the state in that order."""
        for name in ("particle", *_REMEMBERED):
            setattr(self, name, saved[name].copy())
        self._known, self._given_back = False, Unchanged()
        self._resize(len(self.particle))
        self.gather(state)
        if "placed" in saved:  # as they are for the next frame
            self.position[saved["placed"][self.particle]] = np.nan
        if saved["void"][0]:  # the next frame finds that out itself
            self._changed = self._void = True

    def first_non_finite(self) -> int:
        """The user's index of a particle whose position or velocity is not finite; -1 if all are finite."""
        if self.motion.all_finite(self.position, self.velocity):
            return -1
        found = (int(self.motion.first_non_finite(array)) for array in (self.position, self.velocity))
        return next((int(self.particle[sorted_index]) for sorted_index in found if sorted_index >= 0), -1)

    def scratch(self, number: int) -> Array:
        """An (n, 2) scratch array for use within one substep; its contents are undefined."""
        while len(self._scratch) <= number:
            self._scratch.append(np.empty_like(self.position))
        return self._scratch[number]

    def sorted_index(self, particles: Any) -> Any:
        """(k,) rows of these user's particles."""
        if self._sorted_index is None:
            self._sorted_index = np.empty_like(self.particle)
            self._sorted_index[self.particle] = np.arange(len(self), dtype=self.particle.dtype)
        return self._sorted_index.take(particles)
