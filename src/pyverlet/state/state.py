"""`State`, the arrays of all particles in the order they were added.

They are valid between frames. A frame begins by gathering them into `SortedState`, and ends by scattering the result back.
"""

from __future__ import annotations

import uuid
import weakref
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks, memory
from pyverlet.common.arrays import Array
from pyverlet.common.renamed import Renamed
from pyverlet.common.step_lock import StepLock
from pyverlet.state.data import Columns
from pyverlet.state.periodicity import NONE, Periodicity

ROWS = ("position", "velocity", "acceleration")
SET = ("radius", "mass", "restitution", "friction", "rolling_resistance", "inertia")
COLUMNS = ("spin", *SET)
MOVING = (*ROWS, "spin")
MARKS = ("category", "mask", "material", "fixed_rotation")

EVERYONE = 0xFFFFFFFF  # a mask that accepts every category


def may_collide(category: ArrayLike, mask: ArrayLike, other_category: ArrayLike, other_mask: ArrayLike) -> NDArray[np.bool_]:
    """Whether each of two has a bit of its category in the other's mask."""
    bits = (np.asarray(each, np.int64) for each in (category, other_mask, other_category, mask))
    return np.asarray((next(bits) & next(bits) != 0) & (next(bits) & next(bits) != 0))


DEFAULTS: dict[str, Any] = {
    "angle": 0, "restitution": -1, "friction": -1, "rolling_resistance": -1, "inertia": 0, "category": 1, "mask": EVERYONE,
    "material": 0, "fixed_rotation": 0, "crossed": 0,
}  # fmt: skip


def check_set(columns: Mapping[str, Array]) -> None:
    """Check values that users set. Columns equal for all particles may have one row.

    Raises:
        InputError: a value is not allowed.
    """
    checks.positive("radius", columns["radius"])
    checks.positive("mass", columns["mass"], infinite_is="pinned")
    checks.at_most("restitution", columns["restitution"], 1.0)
    for name in ("friction", "rolling_resistance"):
        checks.at_most(name, columns[name], float(np.finfo(columns[name].dtype).max))
    checks.within("inertia", columns["inertia"], 0.0, np.inf)


def spin_radius(inertia: Array, radius: Array, mass: Array) -> Array:
    """(n,) m, radii of discs with the same masses and moments of inertia, for energies and momenta of spins."""
    own = np.count_nonzero(inertia)  # six times as fast as `any` for few particles
    found: Array = np.where(inertia > 0, np.sqrt(2 * inertia / mass), radius) if own else radius
    return found


class Arrays:
    """The columns that `State` and `SortedState` have in common; see `State`."""

    position: Array
    velocity: Array
    acceleration: Array
    spin: Array
    radius: Array
    mass: Array
    restitution: Array
    friction: Array
    rolling_resistance: Array
    inertia: Array
    category: Array
    mask: Array
    material: Array
    fixed_rotation: Array

    seam: Any = Renamed("periodic")


class State(Arrays):
    """Structure of arrays of n particles, in the order they were added. SI units.

    Attributes:
        position: (n, 2) centres, m.
        velocity: (n, 2) m/s.
        acceleration: (n, 2) m/s^2, of the last substep; the state of the Verlet methods, and the scale of rest. NaN: none yet.
        spin: (n,) angular velocity, rad/s, counter-clockwise. angle: (n,) orientation, rad; float64, as it grows without bound.
        radius, mass: (n,) m, and (n,) kg: infinity pins the particle.
        restitution, friction, rolling_resistance: (n,) of circles that have values of their own; negative: as `Collisions` and
            the bounds say.
        inertia: (n,) kg m^2, moments of inertia of circles that are not discs; 0: m r^2 / 2.
        category, mask: (n,) 32 bits each; two circles collide if each has a bit of its category in the other's mask.
        material: (n,) index in `materials`, the names of all materials so far; "" is none.
        fixed_rotation: (n,) 1 for particles that never rotate, else 0.
        crossed: (n, 2) m, float64: whole periods of a periodic room by which each particle has left it.
        number: (n,) permanent number of each particle, ascending and unique in the world.
        begun: number of the first particle of each `append`, ascending. numbers: how many particles there have ever been.
        version: how often particles were added or removed.
        data: user-defined arrays, in which the first row is the default of new particles; see `state.data`.
        turn: the lock of threads that step, change or read them.
        shown: the arrays by name, for reading, and for writing the results of a frame. An array obtained as an attribute
            may be written to as long as there is a view of it: see `touched`.
        shared: whether the arrays are also written to from elsewhere.
        let_go: whether supports of particles may have been removed since the last frame.
    """

    periodic: Periodicity = NONE
    boundary: Any = None  # of its world
    shared = let_go = False
    shown: dict[str, Array]
    _handed: dict[str, weakref.ref[Array]]  # the arrays that may be written to, see `touched`
    _key: str | None = None
    number: Array
    angle: NDArray[np.float64]
    crossed: NDArray[np.float64]

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.dtype, self.lock = dtype, StepLock()
        store: dict[str, Array] = {name: np.empty((0, 2), dtype) for name in ROWS}
        store |= {name: np.empty(0, dtype) for name in COLUMNS}
        for names, kind in ((MARKS, np.uint32), (("number",), np.int64), (("angle",), np.float64)):
            store |= {name: np.empty(0, kind) for name in names}
        self.live_in(store | {"crossed": np.empty((0, 2))}, 0)
        self.materials = [""]
        self.numbers, self.rewound = 0, np.zeros((0, 2), np.int64)
        self.begun: list[int] = []
        self.data: Columns = {}
        self.version = 0

    def __len__(self) -> int:
        return len(self.shown["radius"])

    def __getattr__(self, name: str) -> Array:
        """One of the arrays, as a view of an object that lives as long as views of it do."""
        shown = vars(self).get("shown", {}).get(name)
        if shown is None:
            raise AttributeError(f"State has no {name}")
        known = self._handed.get(name)
        whole = None if known is None else known()
        if whole is None:  # a buffer and not an array, or its views would be views of the store
            whole = np.asarray(self._store[name].data)
            self._handed[name] = weakref.ref(whole)
        array: Array = whole[: len(shown)]
        return array

    def touched(self, names: Iterable[str]) -> bool:
        """Whether any of these arrays may have been written to since the last call of `forget_released`."""
        return self.shared or not self._handed.keys().isdisjoint(names)

    def forget_released(self) -> None:
        """After a frame has read what was written: arrays without views cannot be written to until requested again."""
        for name, whole in [*self._handed.items()]:
            if whole() is None:
                self._handed.pop(name, None)

    @property
    def key(self) -> str:
        """An identifier shared by this state and its copies only."""
        self._key = self._key or uuid.uuid4().hex
        return self._key

    @property
    def unwrapped(self) -> NDArray[np.float64]:
        """(n, 2) m, positions without wrapping into a periodic room. A copy."""
        return self.position.astype(np.float64) + self.crossed

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: getattr(self, name) for name in ("dtype", "periodic", "boundary", "begun", "version", "materials")}
        kept["_key"] = self.key
        with self.lock:
            kept |= {"numbers": self.numbers, "data": {name: column.copy() for name, column in self.data.items()}}
            return kept | {"_store": {name: array.copy() for name, array in self.arrays()}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.lock = StepLock()
        self.live_in(self._store, len(self._store["number"]))

    def arrays(self) -> Iterator[tuple[str, Array]]:
        """Names and arrays, always in the same order."""
        for name in self._store:
            yield name, getattr(self, name)

    def material_numbers(self, names: Any, count: int) -> Array:
        """(count,) numbers of materials, from one name or (count,) of them; new names get the next numbers."""
        each = np.broadcast_to(np.asarray(names, dtype=np.str_), count)
        known, which = np.unique(each, return_inverse=True)
        self.materials += [name for name in known.tolist() if name not in self.materials]
        return np.array([self.materials.index(name) for name in known.tolist()], np.uint32)[which]

    def append(self, values: dict[str, Array], data: Columns | None = None) -> int:
        """Add particles; `values` holds an array for each name without a default. Returns the first permanent number.

        data: their rows in user-defined arrays.
        """
        start = len(self)
        stop = start + len(values["radius"])
        capacity = len(self._store["radius"])
        if stop > capacity:
            # Doubling: adding one by one costs O(1) each on average.
            capacity, store = max(stop, 2 * capacity), self._store
            self.live_in({name: memory.empty((capacity, *old.shape[1:]), old.dtype) for name, old in store.items()}, start)
            for name in store:  # mark as requested: earlier writes may not have been read yet
                getattr(self, name)[:] = store[name][:start]
        self._show(stop)
        for name, value in (DEFAULTS | values).items():
            memory.put(self.shown[name][start:], value)
        for name, column in self.data.items():
            self.data[name] = np.concatenate((column, (data or {}).get(name, np.repeat(column[:1], stop - start, axis=0))))
        self.begun.append(self.numbers)
        self.shown["number"][start:] = np.arange(self.numbers, self.numbers + stop - start)
        self.numbers += stop - start
        self.version += 1
        return self.begun[-1]

    def remove(self, gone: Array, alike: Collection[str] = ()) -> Array:
        """Remove these particles, in ascending order; others keep their order. Returns (n,) the new index of each old one, or -1.

        alike: arrays in which all rows are equal.
        """
        now = memory.places(gone, len(self))
        for name in self.shown.keys() - alike:
            memory.close_ranks(self.shown[name], gone)
        self.data = {name: np.delete(column, gone + 1, axis=0) for name, column in self.data.items()}
        self._show(len(self) - len(gone))
        self.version += 1
        return now

    def restore(self, arrays: dict[str, Array], data: Columns, *, own: bool = False) -> None:
        """Set arrays that `arrays` returned, for any number of particles; `own`: use these arrays themselves."""
        self.data = {name: column.copy() for name, column in data.items()}
        count = len(arrays["number"])
        if own or count > len(self._store["number"]):
            self.live_in({name: arrays[name] if own else np.empty_like(arrays[name]) for name in self._store}, count)
        self._show(count)
        for name in self._store:
            getattr(self, name)[:] = arrays[name]
        self.version += 1

    @property
    def births(self) -> NDArray[np.int64]:
        """(n,) numbers for random draws, as if nothing had been restored; `number` differs, as it is never reused."""
        if not len(self.rewound):
            return self.number
        shifts = np.append(self.rewound[:, 1], 0)  # the last entry is for those before all
        return np.asarray(self.number - shifts[np.searchsorted(self.rewound[:, 0], self.number, "right") - 1])

    @property
    def next_birth(self) -> int:
        """The next value of `births`."""
        return self.numbers - int(self.rewound[-1, 1]) if len(self.rewound) else self.numbers

    def rewind(self, births: int) -> None:
        """Let the next particle have this number in `births`."""
        if births == self.next_birth:
            return
        known = self.rewound[self.rewound[:, 0] < self.numbers]
        self.rewound = np.concatenate((known, [(self.numbers, self.numbers - births)])).astype(np.int64)

    def index_of(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of the particles with these numbers, of any shape; -1 where there is none."""
        known, count = self.number, len(self)
        if not count or known[-1] == count - 1:  # numbers are indices: only the last particles have been removed
            return np.where((numbers >= 0) & (numbers < count), numbers, -1)
        where = np.searchsorted(known, numbers).clip(max=count - 1)
        return np.where(known[where] == numbers, where, -1)

    def find(self, first: int, stop: int) -> slice:
        """Slice of the particles with numbers from `first` up to, not including, `stop`."""
        return slice(*map(int, np.searchsorted(self.number, (first, stop))))

    def live_in(self, store: dict[str, Array], count: int) -> None:
        """Use these arrays, by name, for `count` particles; views of the previous ones become stale."""
        self._store, self._handed = store, {}
        self._show(count)

    def _show(self, count: int) -> None:
        self.shown = {name: array[:count] for name, array in self._store.items()}


_moving_of: Callable[[Any], tuple[Array, ...]] = itemgetter(*MOVING)


def moving(of: Arrays) -> tuple[Array, ...]:
    """The columns that a frame changes."""
    return _moving_of(of.shown if isinstance(of, State) else vars(of))
