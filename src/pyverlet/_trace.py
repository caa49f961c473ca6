"""A trace: calls of kernels as Python made them once, to be made again without Python.

In a world of few particles nearly all of a substep is Python finding out what to call, and in the next it finds the same. So the
calls of one substep are recorded, with all they were given, and then replayed. A kernel that answers yes or no is a *guard*: when
it answers otherwise than it did, the rest of that substep is left to Python, which asks again. As in compilers that trace, what
the calls depend on must be known: the caller names it by a key, and what is recorded is good for that key only.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterator
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.core import types

from pyverlet import _entry, _jit
from pyverlet._entry import ANSWER, CALL, CALLED, RECORDER, TAKEN

_ROOM = 1024
"""Words of 8 bytes for the calls of a substep; a smooth world in a cage takes 500."""

_release = types.ExternalFunction("Py_DecRef", types.void(types.int64))
_from_int = types.ExternalFunction("PyLong_FromLongLong", types.int64(types.int64))


def _replay(table_object: int, arguments: int, count: int) -> Any:
    """What Python calls, in C, with a number of times: make all calls so often, or until a guard answers otherwise; how many."""
    table = _entry._word(table_object + _entry._DATA)
    made = 0
    for _ in range(_entry._as_int(_entry._word(arguments))):
        at, end = _entry._word(table), _entry._word(table + 8)
        while at < end:
            result = _entry._call(_entry._word(at + CALLED), at + CALL, 0)
            if result == 0:
                return 0
            made += 1
            expected = _entry._word(at + ANSWER)
            _release(result)
            if expected != 0 and result != expected:
                return _from_int(made)
            at += CALL + 8 * _entry._word(at + TAKEN)
    return _from_int(made)


@cache
def _player() -> int:
    """Address of `_replay`, compiled."""
    with _jit.caching("entry") as kept, _jit.turn("replay"):
        kind = types.int64(types.int64, types.int64, types.int64)
        return int(numba.cfunc(kind, error_model="numpy", cache=kept)(_replay).address)


_one_at_a_time = threading.Lock()


class Trace:
    """The calls of one turn of a loop, and what they are good for."""

    def __init__(self) -> None:
        self._key: Hashable = None  # what the recorded calls are good for; None: there are none
        self._held: list[Any] = []  # what they were given
        self._number = 0
        self._words = np.empty(0, np.int64)

    def __deepcopy__(self, memo: Any) -> Trace:
        return Trace()  # the calls are about the arrays of another

    def turns(self, count: int, key: Callable[[], Hashable], replayed: Callable[[int], None]) -> Iterator[tuple[int, bool]]:
        """Those of `count` turns that are left to Python, each with whether the calls before its first guard are made already.

        Args:
            key: asked before a turn what its calls depend on; None if they may not be recorded.
            replayed: told how many turns have gone by without Python.
        """
        turn = 0
        while turn < count:
            now, begun = key(), False
            if now is not None and now == self._key:
                done, more = divmod(self._play(count - turn), self._number)
                turn, begun = turn + done, more > 0
                replayed(done)
                if turn == count:
                    break
            recording = now is not None and not begun and self._begin()
            try:
                yield turn, begun
            finally:
                if recording and self._end() and key() == now:
                    self._key = now
            turn += 1

    def _begin(self) -> bool:
        """Record the kernels that this thread calls; False if another does."""
        if not _entry.usable() or not _one_at_a_time.acquire(blocking=False):
            return False
        if not len(self._words):
            self._words, self._table = np.empty(_ROOM, np.int64), np.zeros(2, np.int64)
            self._play = _entry.built_in("replay", _player(), self._table)
        self._key, self._held = None, []
        self._table[0] = start = self._words.ctypes.data
        RECORDER[:4] = threading.get_ident(), start, start + self._words.nbytes, id(self._held)
        return True

    def _end(self) -> bool:
        """No more; False if there was too much for the room, or calls were missed."""
        RECORDER[0] = 0
        self._table[1] = end = RECORDER[1]
        _one_at_a_time.release()
        at, number, begin = 0, 0, self._table[0]
        if end > begin + self._words.nbytes:
            return False
        while begin + 8 * at < end:
            at += (CALL + 8 * int(self._words[at + TAKEN // 8])) // 8
            number += 1
        self._number = number
        return number > 0
