"""Whether arrays are still what they were, without a copy of them to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import KNOWN_FROM
from pyverlet.core import unit

ROWS: Final = 4096
"""That are digested together, and of which it is noted together whether one was written: `WRITTEN` of `core.rows`."""

_ALL, _NO_DIGESTS = np.empty(0, np.uint8), np.empty((0, 0), np.uint64)


def blocks_of(rows: int) -> int:
    """How many blocks there are of so many rows."""
    return -(-rows // ROWS)


def columns_differ(given: Array, now: Array) -> bool:
    """Whether two columns differ anywhere; one number stands for equal ones."""
    return len(given) not in (1, len(now)) or bool((given != now).any())


class Unchanged:
    """Remembers arrays of as many rows by 64 bits for each block of rows: others pass for those in one of 2^64 cases.

    Small ones are not worth it, and are never known again.
    """

    def __init__(self) -> None:
        self._digests = _NO_DIGESTS  # by array and block, as of the last look
        self._known = False

    def remember(self, arrays: Sequence[Array], written: Array = _ALL, team: tuple[int, int] = (0, 1)) -> None:
        """Know these arrays again once.

        written: (blocks,) 1 where rows were written since `recall` was asked for the same arrays; empty: anywhere. team: the
        address of a team of threads, and how many of it take part.
        """
        self._known = len(arrays[0]) >= KNOWN_FROM
        if self._known:
            shape = len(arrays), blocks_of(len(arrays[0]))
            if self._digests.shape != shape:
                self._digests, written = np.empty(shape, np.uint64), _ALL
            _digest(arrays, self._digests, written, team)

    def forget_blocks(self) -> None:
        """Rows have come or gone: others are where they were not, and known only as long as none is touched."""
        self._digests = _NO_DIGESTS

    def recall(self, arrays: Sequence[Array], team: tuple[int, int] = (0, 1), *, touched: bool = True) -> bool:
        """Whether these are what was remembered last, and not asked for since; touched: whether anyone can have changed them."""
        if not self._known:
            self._digests = _NO_DIGESTS
            return False
        before, self._known = self._digests, False
        if not touched:
            return True
        if before.shape != (len(arrays), blocks_of(len(arrays[0]))):  # others have come, or rows have moved
            return False
        self._digests = np.empty_like(before)
        _digest(arrays, self._digests, _ALL, team)
        return np.array_equal(before, self._digests)


def _digest(arrays: Sequence[Array], digests: Array, written: Array, team: tuple[int, int]) -> None:
    for array, row in zip(arrays, digests, strict=True):
        words = array.reshape(-1).view(np.uint64 if array.nbytes % 8 == 0 else np.uint32)
        block = ROWS * array.itemsize * (array.size // max(len(array), 1)) // words.itemsize
        unit("tools").checksums(words, block, row, written, *team)
