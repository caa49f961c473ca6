"""Columns of numbers that grow at the end."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.ground.arrays import Array


class Table:
    """Named columns of equal length. `table["name"]` is a view, good until rows are added or removed.

    Args:
        columns: names and what they hold: a dtype, or (dtype, shape of an entry).
    """

    def __init__(self, **columns: DTypeLike | tuple[DTypeLike, tuple[int, ...]]) -> None:
        self._length = 0
        self._store: dict[str, Array] = {}
        for name, kind in columns.items():
            dtype, shape = kind if isinstance(kind, tuple) else (kind, ())
            self._store[name] = np.empty((0, *shape), dtype)

    def __len__(self) -> int:
        return self._length

    def __contains__(self, name: str) -> bool:
        return name in self._store

    def __getitem__(self, name: str) -> Array:
        return self._store[name][: self._length]

    def append(self, count: int, **values: Any) -> slice:
        """Add `count` rows; a value is an entry for each, or one for all. Returns where they stand."""
        where = slice(self._length, self._length + count)
        for name, old in self._store.items():
            if where.stop > len(old):  # doubling: adding one by one costs O(1) each on average
                self._store[name] = np.empty((max(where.stop, 2 * len(old)), *old.shape[1:]), old.dtype)
                self._store[name][: where.start] = old[: where.start]
            self._store[name][where] = values[name]
        self._length = where.stop
        return where

    def __getstate__(self) -> dict[str, Array]:
        return {name: self[name] for name in self._store}

    def __setstate__(self, columns: dict[str, Array]) -> None:
        self.__init__()  # type: ignore[misc]
        self._store = columns
        self._length = len(next(iter(columns.values()), ()))

    def copy(self) -> Table:
        """Another one with the same rows."""
        other = Table()
        other._store = {name: self[name].copy() for name in self._store}
        other._length = self._length
        return other

    def keep(self, mask: Array) -> None:
        """Remove all other rows."""
        self._store = {name: self[name][mask] for name in self._store}
        self._length = int(np.count_nonzero(mask))
