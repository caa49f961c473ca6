"""The base class of links. A new type is a class like `Stick` or `Angle`, with its ends, its value and how it is drawn."""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array, Floats
from pyverlet.common.errors import InputError
from pyverlet.state.group import Group
from pyverlet.state.periodicity import Periodicity
from pyverlet.state.state import State

if TYPE_CHECKING:
    from pyverlet.laws.links._pool import Pool


MOVING = ("intact", "force")
"""Columns that a frame changes."""

GIVES = {name: name for name in ("stiffness", "damping", "strength")}
"""The entries of `Link._columns` of links that yield and break."""

REMEMBERED = "impulse", "load", "pull", "value", "next"
"""State of the contact law: accumulated impulse, N s, its mean as a force, N, the row's value a substep ago, and the next value
expected; two each, for x and y, of pins."""

CHANGED = 2e300
"""Next value of a rigid row after its length, angle or place was set: such a change does work."""


class Numbers:
    """(k,) numbers of k links, copied when read. Setting one for all or (k,) changes a column of their pool, in a world.

    kept: its name in `Link._columns`, if different; inverse: whether the inverse is stored.
    """

    def __init__(self, check: Callable[..., Floats], doc: str, *, kept: str = "", inverse: bool = False, **limits: Any) -> None:
        self._check, self._limits, self.__doc__ = check, limits, doc
        self._kept, self._inverse = kept, inverse

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._kept = name, self._kept or name

    def _turned(self, numbers: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / numbers) if self._inverse else numbers

    def __get__(self, link: Any, owner: type) -> Floats:
        if link is None:
            return self  # type: ignore[return-value]  # for documentation tools
        value: Floats = vars(link)[f"_{self._kept}"]
        return self._turned(value.copy())

    def __set__(self, link: Any, value: ArrayLike) -> None:
        name, before = f"_{self._kept}", vars(link).get(f"_{self._kept}")
        numbers = self._turned(self._check(type(link).__name__, self._name, value, len(link), **self._limits))
        vars(link)[name] = numbers
        if link._pool is not None:
            try:
                link._check(link._state.periodic)
            except InputError:
                vars(link)[name] = before
                raise
            link._change(link._columns[self._kept], numbers)


class _Exclusive(ABCMeta):
    """Metaclass that creates links under a lock: no thread removes particles between looking them up and storing numbers."""

    @property
    def __signature__(cls) -> inspect.Signature:
        """The arguments of `__init__`, for `inspect` and scene files."""
        whole = inspect.signature(cls.__init__)  # type: ignore[misc]
        return whole.replace(parameters=list(whole.parameters.values())[1:])

    def __call__(cls, *ends: Any, **options: Any) -> Any:
        groups = (part for end in ends for part in (end if isinstance(end, tuple) else (end,)) if isinstance(part, Group))
        group = next(groups, None)
        with group._state.lock if group is not None else nullcontext():
            return super().__call__(*ends, **options)


class Link(metaclass=_Exclusive):
    """One or more links of a kind, added to a world by `world.links.append`.

    Attributes:
        particles: (k, p) indices, among all of the world's particles, of what each of the k links joins.
    """

    _columns: ClassVar[Mapping[str, str]]
    """Names of its numbers in the pool, by attribute names without the underscore; others are as in `_rows`."""
    _kind: int
    """Kind of its rows in `_pool.py`, which tells the core what they measure."""
    _upper = np.inf
    """The largest push; 0 for links that only pull."""
    _collide = True
    _is_made = True
    """Whether all but its numbers is final."""

    def __init__(self, state: State, particles: NDArray[np.int64]) -> None:
        self._state = state
        self.particles = particles
        self._pool: Pool | None = None  # where its numbers are once it is in a world
        self._id, self._version = -1, state.version
        self._moving: dict[str, Array] = {}  # for a copy, the columns `MOVING`
        self._number = state.number[particles]  # indices change when others are removed, permanent numbers do not

    def __len__(self) -> int:
        return len(self.particles)

    def __repr__(self) -> str:
        broken = len(self) - int(self.intact.sum())
        return f"{type(self).__name__} x {len(self)}" + f", {broken} broken" * bool(broken)

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in vars(self).items() if name not in ("_pool", "_id", "_moving")}
        if self._pool is not None:
            kept["_moving"] = {name: self._pool.rows[name][self._where].copy() for name in (*MOVING, *REMEMBERED)}
        return kept

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _pool=None, _id=-1)

    def _recall(self) -> None:
        """Write the columns that frames had changed before copying to the new pool."""
        if self._pool is not None:
            for name, column in self._moving.items():
                self._pool.rows[name][self._where] = column
        self._moving = {}

    def _arrays(self) -> dict[str, Array]:
        """Row data by attribute name; these arrays are replaced, never written to."""
        columns = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return {name: column for name, column in columns.items() if len(column) == len(self)}

    def _keep(self, mask: NDArray[np.bool_]) -> None:
        """Keep these rows."""
        vars(self).update({name: column[mask] for name, column in self._arrays().items()})

    def _set_give(self, **gives: ArrayLike) -> None:
        """Set stiffness or compliance, damping, and the breaking load."""
        for name, value in gives.items():
            setattr(self, name, value)

    def _rows(self) -> dict[str, Any]:
        """The columns for the pool."""
        rows = {"kind": self._kind, "upper": self._upper, "collide": self._collide}
        return rows | {column: vars(self)[f"_{name}"] for name, column in self._columns.items()}

    def _find(self) -> None:
        """Update the indices before adding to a world.

        Raises:
            InputError: one of the particles has been removed.
        """
        if self._version == self._state.version:  # no particle was added or removed since
            return
        where = self._state.index_of(self._number)
        gone = where < 0
        if gone.any():
            row = int(np.flatnonzero(gone.any(axis=1))[0])
            raise InputError(f"{self!r} joins, in its row {row}, a particle that was removed; allowed are those of the world")
        self.particles = where

    def _check(self, periodic: Periodicity) -> None:
        """Raise InputError if these do not fit into a room with this periodicity."""

    @property
    def _where(self) -> slice:
        """Rows of the pool that belong to this link: owners are in the order they were appended."""
        assert self._pool is not None
        first = int(np.searchsorted(self._pool.rows["owner"], self._id))
        return slice(first, first + len(self))

    def _change(self, column: str, value: Any) -> None:
        """Write a column of the pool, if this is in a world."""
        if self._pool is not None:
            rows, where = self._pool.rows, self._where
            rows[column][where] = value
            if column in ("rest", "slack", "point", "stiffness"):
                rows["next"][where] = np.where(np.isinf(rows["stiffness"][where])[:, None], CHANGED, rows["next"][where])
            self._pool.edits += 1

    @property
    def numbers(self) -> NDArray[np.int64]:
        """(k, p) permanent `world.number` of the joined particles; a copy."""
        return self._number.copy()

    @property
    def force(self) -> Floats:
        """(k,) tension, N (N m for angles and motors, N/m for areas), averaged over 1/120 s; negative if it pushes."""
        return np.zeros(len(self)) if self._pool is None else self._pool.rows["force"][self._where].copy()

    @property
    def intact(self) -> NDArray[np.bool_]:
        """(k,) False where a link has broken."""
        return np.ones(len(self), bool) if self._pool is None else self._pool.rows["intact"][self._where].astype(bool)


_LARGEST = float(np.finfo(float).max)


def several(kind: str, name: str, value: ArrayLike, count: int, *, above: float | None = None, infinite: bool = False) -> Floats:
    """(count,) floats from one for all or one each; at least 0, or greater than `above`; infinite only if allowed."""
    one: Any = value  # fast path for single numbers, as links may be added by the thousand
    fits = type(one) in (float, int) and (one <= _LARGEST or (infinite and one == np.inf))
    if fits and (one >= 0.0 if above is None else one > above):
        return np.full(count, float(one))
    array: Floats = np.array(checks.column(f"{kind}: {name}", value, np.dtype(np.float64), count))
    wrong = ~((array >= 0.0) if above is None else (array > above))
    if not infinite:
        wrong |= np.isinf(array)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        where = f"{name}[{row}]" if np.ndim(value) else name
        limit = "of at least 0" if above is None else f"greater than {above:g}"
        raise InputError(f"{kind}: {where} is {array[row]:g}; allowed is a {'' if infinite else 'finite '}number {limit}")
    return array


def compliance(unit: str) -> Numbers:
    """An attribute of links that yield, the inverse of stiffness."""
    return Numbers(several, f"(k,) {unit}; assign one number or (k,), while the world runs, too.", kept="stiffness", inverse=True)


def damping(unit: str) -> Numbers:
    """The damping attribute of links that yield."""
    return Numbers(several, f"(k,) {unit}; assign one number or (k,), while the world runs, too.")


def strength(unit: str) -> Numbers:
    """The breaking load of links; infinity for never."""
    said = f"(k,) {unit}; assign one number or (k,), while the world runs, too."
    return Numbers(several, said, kept="strength", above=0.0, infinite=True)


def finite(kind: str, name: str, value: ArrayLike, count: int, *, unit: str) -> Floats:
    """(count,) floats from one for all or one each, of any sign."""
    array: Floats = np.array(checks.column(f"{kind}: {name}", value, np.dtype(np.float64), count))
    if not np.isfinite(array).all():
        raise InputError(f"{kind}: {name} is {array[~np.isfinite(array)][0]:g}; allowed is a finite number of {unit}")
    return array
