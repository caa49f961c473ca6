"""User-defined arrays with a value or a row for each particle: `world.data`, and a group's part of them."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError, KeyInputError
from pyverlet.common.guess import did_you_mean
from pyverlet.common.shown import count as counted

Columns = dict[str, Array]  # (n + 1,) or (n + 1, k) by name: the default of new particles, then a value or row for each


class Data(MutableMapping[str, Any]):
    """User-defined arrays by name: `world.data["age"] = 0.0` makes one, of (n,) values or (n, k) rows of any NumPy dtype.

    Reading gives views, as of `world.position`, or copies for picked particles, which are set as a whole. The arrays follow
    particles that are added, removed, saved and restored. New particles get the last value that was set for all, else zeros. An
    array keeps its shape, and adopts a dtype that holds what is set, until `del world.data["age"]`.

    `group.data["age"]` is the group's part; only a world makes and deletes arrays.

    Raises:
        InputError: there is no such array (also a KeyError), or a value does not fit.
    """

    def __init__(self, owner: Any) -> None:
        self._owner, self._whole = owner, owner._whole

    @property
    def _columns(self) -> Columns:
        columns: Columns = self._owner._state.data
        return columns

    def __getitem__(self, name: str) -> Array:
        with self._owner._state.lock:
            where = self._owner._where
            found: Array = known(self._columns, name)[1:][where]
            if isinstance(where, np.ndarray):
                found.flags.writeable = False
            return found

    def __setitem__(self, name: Any, value: ArrayLike) -> None:
        if not isinstance(name, str) or not name:
            raise InputError(f"name is {name!r}; allowed is a text")
        with self._owner._state.lock.held():
            columns = self._columns
            if self._whole and name not in columns:
                values = rows(name, value, len(self._owner), None)
                columns[name] = np.concatenate((np.zeros_like(values, shape=(1, *values.shape[1:])), values))
            column = known(columns, name)
            at = np.arange(1, len(column))[self._owner._where]
            values = rows(name, value, np.size(at), column)
            columns[name] = column = column.astype(values.dtype, copy=False)
            column[at] = values.reshape(np.shape(column[at]))
            if self._whole and np.ndim(value) < values.ndim:
                column[:1] = rows(name, value, 1, column)  # one for all, also for new particles

    def __delitem__(self, name: str) -> None:
        if not self._whole:
            raise InputError(f"data[{name!r}] is of all particles; allowed is del world.data[{name!r}]")
        with self._owner._state.lock.held():
            known(self._columns, name)
            del self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(list(self._columns))

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        arrays = (f"{name!r} {array.dtype} {array.shape}" for name, array in self.items())
        return f"Data of {counted(len(self), 'array')}{': ' if len(self) else ''}{', '.join(arrays)}"


def known(columns: Columns, name: Any) -> Array:
    """The column of this name; raises InputError if there is none."""
    if not isinstance(name, str) or name not in columns:
        hint = did_you_mean(name, columns) if isinstance(name, str) else ""
        names = ", ".join(map(repr, columns)) or "none"
        raise KeyInputError(f"data has no {name!r}{hint}; there are {names}, and world.data[{name!r}] = 0.0 makes one")
    return columns[name]


def rows(name: str, value: ArrayLike, count: int, like: Array | None) -> Array:
    """(count,) values or (count, k) rows from as many or one for all; like: the existing column, if any."""
    try:
        given = np.asarray(value)
    except ValueError:
        raise InputError(
            f"data[{name!r}] is no array; allowed is one value for all, or a value or row for each particle"
        ) from None
    row = given.shape[1:] if like is None else like.shape[1:]
    many = given.ndim > len(row)
    if len(row) > 1 or (many and given.shape != (count, *row)) or (not many and given.shape not in ((), row)):
        allowed = f"({count}, {row[0]})" if like is not None and row else f"({count},)" + " or (n, k)" * (like is None)
        raise InputError(
            f"data[{name!r}] has shape {given.shape}; allowed is one value for all, or {allowed}, one for each particle"
        )
    if like is not None:
        plain = (
            None if hasattr(value, "dtype") or given.dtype.kind not in "bifc" else given.dtype.type(0).item()
        )  # weak, as in NumPy's promotion
        try:
            dtype = np.result_type(like.dtype, given.dtype if plain is None else plain)
            if plain is not None and dtype.kind in "iu" and (given.astype(dtype) != given).any():
                dtype = np.result_type(like.dtype, given.dtype)
            fits = dtype.kind == "O" or (like.dtype.kind in "SU") == (given.dtype.kind in "SU")
        except TypeError:
            fits = False
        if not fits:
            raise InputError(f"data[{name!r}] is {given.dtype}; allowed is what goes together with {like.dtype}, that of before")
        given = given.astype(dtype)
    return np.broadcast_to(given, (count, *row))
