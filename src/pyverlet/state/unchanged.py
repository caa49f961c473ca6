"""Detects changes of arrays by checksums, without keeping copies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import KNOWN_FROM
from pyverlet.core import unit

ROWS: Final = 4096
"""Rows per checksum, and per flag of written blocks: `WRITTEN` of `core.rows`."""

_ALL, _NO_DIGESTS = np.empty(0, np.uint8), np.empty((0, 0), np.uint64)


def blocks_of(rows: int) -> int:
    """Number of blocks for so many rows."""
    return -(-rows // ROWS)


def columns_differ(given: Array, now: Array) -> bool:
    """Whether two columns differ anywhere; a single number stands for equal ones."""
    return len(given) not in (1, len(now)) or bool((given != now).any())


class Unchanged:
    """Remembers arrays by 64 bits per block of rows; a change is missed in one of 2^64 cases.

    Small arrays are not worth it, and always count as changed.
    """

    def __init__(self) -> None:
        self._digests = _NO_DIGESTS  # by array and block, at the last check
        self._known = False

    def remember(self, arrays: Sequence[Array], written: Array = _ALL, team: tuple[int, int] = (0, 1)) -> None:
        """Store the checksums of these arrays.

        written: (blocks,) 1 where rows were written since `recall` was called for the same arrays; empty: anywhere. team: address
        of a team of threads, and the number of its threads to use.
        """
        self._known = len(arrays[0]) >= KNOWN_FROM
        if self._known:
            shape = len(arrays), blocks_of(len(arrays[0]))
            if self._digests.shape != shape:
                self._digests, written = np.empty(shape, np.uint64), _ALL
            _digest(arrays, self._digests, written, team)

    def forget_blocks(self) -> None:
        """After rows were added or removed: checksums of blocks no longer apply."""
        self._digests = _NO_DIGESTS

    def recall(self, arrays: Sequence[Array], team: tuple[int, int] = (0, 1), *, touched: bool = True) -> bool:
        """Whether these arrays equal those remembered last; touched: whether they can have been changed."""
        if not self._known:
            self._digests = _NO_DIGESTS
            return False
        before, self._known = self._digests, False
        if not touched:
            return True
        if before.shape != (len(arrays), blocks_of(len(arrays[0]))):  # rows were added or moved
            return False
        self._digests = np.empty_like(before)
        _digest(arrays, self._digests, _ALL, team)
        return np.array_equal(before, self._digests)


def _digest(arrays: Sequence[Array], digests: Array, written: Array, team: tuple[int, int]) -> None:
    for array, row in zip(arrays, digests, strict=True):
        words = array.reshape(-1).view(np.uint64 if array.nbytes % 8 == 0 else np.uint32)
        block = ROWS * array.itemsize * (array.size // max(len(array), 1)) // words.itemsize
        unit("tools").checksums(words, block, row, written, *team)
