"""A trace: calls of kernels as Python made them once, to be made again without Python.

In a world of few particles nearly all of a substep is Python finding out what to call, and in the next it finds the same. So the
calls of one substep are recorded, with all they were given, and then replayed. A kernel that answers yes or no is a *guard*: when
it answers otherwise than it did, the rest of that substep is left to Python, which asks again. As in compilers that trace, what
the calls depend on must be known: the caller names it by a key, and what is recorded is good for that key only.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Hashable, Iterator
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.core import types

from pyverlet.compile import entry, jit
from pyverlet.compile.entry import ANSWER, CALL, CALLED, RELEASE, TAKEN

_ROOM = 1024
"""Words of 8 bytes for the calls of a substep; a smooth world in a cage takes 500."""

_release = types.ExternalFunction("Py_DecRef", types.void(types.int64))
_from_int = types.ExternalFunction("PyLong_FromLongLong", types.int64(types.int64))


def _replay(table_object: int, arguments: int, count: int) -> Any:
    """What Python calls, in C, with a number of times: make all calls so often, or until a guard answers otherwise; how many."""
    table = entry._word(table_object + entry._DATA)
    made = 0
    for _ in range(entry._as_int(entry._word(arguments))):
        at, end = entry._word(table), entry._word(table + 8)
        while at < end:
            result = entry._call(entry._word(at + CALLED), at + CALL, entry._word(at + RELEASE))
            if result == 0:
                return 0
            made += 1
            expected = entry._word(at + ANSWER)
            _release(result)
            if expected != 0 and result != expected:
                return _from_int(made)
            at += CALL + 8 * entry._word(at + TAKEN)
    return _from_int(made)


@cache
def _player() -> int:
    """Address of `_replay`, compiled."""
    with jit.caching("entry") as kept, jit.turn("replay"):
        kind = types.int64(types.int64, types.int64, types.int64)
        return int(numba.cfunc(kind, error_model="numpy", cache=kept)(_replay).address)


_one_at_a_time = threading.Lock()


def more_than_calls() -> None:
    """What this thread does now is not only calls of kernels: no trace has it."""
    entry.miss()


class Trace:
    """The calls of one round of a loop, and what they are good for."""

    def __init__(self) -> None:
        self._key: Hashable = None  # what the recorded calls are good for; None: there are none
        self._held: list[Any] = []  # what they were given
        self._number = 0  # how many
        self._words = np.empty(0, np.int64)
        self._where = np.zeros(2, np.int64)  # addresses: of the first call, and behind the last

    def __deepcopy__(self, memo: Any) -> Trace:
        return Trace()  # the calls are about the arrays of another

    def once(self, key: Hashable) -> bool:
        """Make the calls of one round. False if they are not known, or a guard has answered otherwise: all are left to Python."""
        if key is None or key != self._key:
            return False
        if self._play(1) == self._number:
            return True
        self._key = None  # what happens once a frame, and is not as it was, is to be recorded anew
        return False

    def ahead(self, count: int, key: Hashable) -> tuple[int, bool]:
        """Make the calls of `count` rounds, or until a guard answers otherwise.

        Returns how many rounds have gone by without Python, and whether the calls before the first guard of the next are made.
        """
        if key is None or key != self._key:
            return 0, False
        rounds, more = divmod(self._play(count), self._number)
        return rounds, more > 0

    def forget(self, *, but: Hashable) -> None:
        """Hold the calls no longer, but for those that are good for this."""
        if self._key != but or but is None:
            self._key, self._held = None, []

    @contextlib.contextmanager
    def recording(self, key: Callable[[], Hashable]) -> Iterator[None]:
        """Record the calls of a round, unless it is broken off, or what they depend on is not the same afterwards."""
        now = key()
        recording, whole = now is not None and self._begin(), False
        try:
            yield
            whole = True
        finally:
            if recording and self._end() and whole and key() == now:
                self._key = now

    def _begin(self) -> bool:
        """Record the kernels that this thread calls; False if another does."""
        if not entry.usable():
            return False
        if not len(self._words):
            self._words = np.empty(_ROOM, np.int64)
            self._where[0] = self._words.ctypes.data
            self._play = entry.built_in("replay", _player(), self._where)
        if not _one_at_a_time.acquire(blocking=False):
            return False
        self._key, self._held = None, []
        entry.record_calls(self._words, self._held)
        return True

    def _end(self) -> bool:
        """No more; False if they are not all."""
        self._number, self._where[1] = entry.recorded_calls()
        _one_at_a_time.release()
        return self._number > 0
