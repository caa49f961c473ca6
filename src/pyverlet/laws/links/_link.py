"""What all links share. A new type is a class like `Stick` or `Angle`: what it joins, what it measures, how it is drawn."""

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
"""Of `Link._columns`, those of what may give and break."""

REMEMBERED = "impulse", "load", "pull", "value", "next"
"""Of the contact law: accumulated impulse, N s, its mean as a force, N, what the row measured a substep ago, and what it
would measure next; two each, for x and y of pins.
"""

CHANGED = 2e300
"""What a rigid row would measure next once it has been given another length, angle or place: who changes it does work."""


class Numbers:
    """(k,) numbers of k links, copied when read. Setting one for all or (k,) changes a column of their pool, in a world.

    kept: what `Link._columns` calls it, if that is not its name; inverse: whether the inverse is kept.
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
    """Links are made in one turn: no other thread removes particles between looking them up and keeping their numbers."""

    @property
    def __signature__(cls) -> inspect.Signature:
        """What `inspect` and scene files see: the arguments of `__init__`."""
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
    """What the pool calls its numbers, `_length` and so on, by their names without the line; others are as in `_rows`."""
    _kind: int
    """One of those in `_pool.py`, by which the core knows what they measure."""
    _upper = np.inf
    """The largest push; 0 for what only pulls."""
    _collide = True
    _is_made = True
    """Whether all but its numbers is what it stays."""

    def __init__(self, state: State, particles: NDArray[np.int64]) -> None:
        self._state = state
        self.particles = particles
        self._pool: Pool | None = None  # where its numbers are once it is in a world
        self._id, self._version = -1, state.version
        self._moving: dict[str, Array] = {}  # of a copy, the columns `MOVING`
        self._number = state.number[particles]  # indices change when others are removed, numbers never do

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
        """Write what frames had changed when it was copied, into the pool that it has just come to."""
        if self._pool is not None:
            for name, column in self._moving.items():
                self._pool.rows[name][self._where] = column
        self._moving = {}

    def _arrays(self) -> dict[str, Array]:
        """What it says of each row, by the names of attributes; these arrays are replaced, never written to."""
        columns = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return {name: column for name, column in columns.items() if len(column) == len(self)}

    def _keep(self, mask: NDArray[np.bool_]) -> None:
        """Keep these rows."""
        vars(self).update({name: column[mask] for name, column in self._arrays().items()})

    def _set_give(self, **gives: ArrayLike) -> None:
        """How they give, by a stiffness or a compliance, their damping, and what they break at."""
        for name, value in gives.items():
            setattr(self, name, value)

    def _rows(self) -> dict[str, Any]:
        """What the pool takes for these links."""
        rows = {"kind": self._kind, "upper": self._upper, "collide": self._collide}
        return rows | {column: vars(self)[f"_{name}"] for name, column in self._columns.items()}

    def _find(self) -> None:
        """Bring the indices up to date before they go into a world.

        Raises:
            InputError: one of the particles has been removed.
        """
        if self._version == self._state.version:  # none has come or gone since
            return
        where = self._state.index_of(self._number)
        gone = where < 0
        if gone.any():
            row = int(np.flatnonzero(gone.any(axis=1))[0])
            raise InputError(f"{self!r} joins, in its row {row}, a particle that was removed; allowed are those of the world")
        self.particles = where

    def _check(self, periodic: Periodicity) -> None:
        """Raise InputError if these do not fit into a room of these periods."""

    @property
    def _where(self) -> slice:
        """Which rows of the pool are these: owners stand there in the order they were appended."""
        assert self._pool is not None
        first = int(np.searchsorted(self._pool.rows["owner"], self._id))
        return slice(first, first + len(self))

    def _change(self, column: str, value: Any) -> None:
        """Write a column of the pool, if these are in a world."""
        if self._pool is not None:
            rows, where = self._pool.rows, self._where
            rows[column][where] = value
            if column in ("rest", "slack", "point", "stiffness"):
                rows["next"][where] = np.where(np.isinf(rows["stiffness"][where])[:, None], CHANGED, rows["next"][where])
            self._pool.edits += 1

    @property
    def numbers(self) -> NDArray[np.int64]:
        """(k, p) `world.number` of what each joins, which stays what it is when other particles are removed; a copy."""
        return self._number.copy()

    @property
    def force(self) -> Floats:
        """(k,) what each pulls with, N (N m for angles and motors, N/m for areas), averaged over 1/120 s; negative: it pushes."""
        return np.zeros(len(self)) if self._pool is None else self._pool.rows["force"][self._where].copy()

    @property
    def intact(self) -> NDArray[np.bool_]:
        """(k,) False where a link has broken."""
        return np.ones(len(self), bool) if self._pool is None else self._pool.rows["intact"][self._where].astype(bool)


_LARGEST = float(np.finfo(float).max)


def several(kind: str, name: str, value: ArrayLike, count: int, *, above: float | None = None, infinite: bool = False) -> Floats:
    """(count,) floats from one for all or one each; at least 0, or greater than `above`; infinite only if said."""
    one: Any = value  # as most are, and links may come by the thousand
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
    """An attribute of what gives, the inverse of its stiffness."""
    return Numbers(several, f"(k,) {unit}; assign one number or (k,), while the world runs, too.", kept="stiffness", inverse=True)


def damping(unit: str) -> Numbers:
    """An attribute of what gives."""
    return Numbers(several, f"(k,) {unit}; assign one number or (k,), while the world runs, too.")


def strength(unit: str) -> Numbers:
    """An attribute of what breaks; infinity is never."""
    said = f"(k,) {unit}; assign one number or (k,), while the world runs, too."
    return Numbers(several, said, kept="strength", above=0.0, infinite=True)


def finite(kind: str, name: str, value: ArrayLike, count: int, *, unit: str) -> Floats:
    """(count,) floats from one for all or one each, of any sign."""
    array: Floats = np.array(checks.column(f"{kind}: {name}", value, np.dtype(np.float64), count))
    if not np.isfinite(array).all():
        raise InputError(f"{kind}: {name} is {array[~np.isfinite(array)][0]:g}; allowed is a finite number of {unit}")
    return array
