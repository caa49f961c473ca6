"""The step lock of a world: access from other threads blocks until the current frame ends."""

from __future__ import annotations

import functools
import os
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import get_ident
from typing import Any, Concatenate, ParamSpec, TypeVar

from pyverlet.common.errors import InputError
from pyverlet.common.interrupts import without_interrupts

P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S", bound="Shared")

_FORK_S = 10.0  # s that a fork waits for current frames to end


class StepLock:
    """A reentrant lock that waiting threads get before those that just had it, so that no loop starves others.

    Attributes:
        holder: the thread that has it now.
        in_frame: whether a frame is running; true only while the lock is held.
        page: context in which the live page that steps the world pauses between two frames; None without one.
    """

    def __init__(self) -> None:
        self.in_frame = False
        self.page: Callable[[], AbstractContextManager[None]] | None = None
        self.holder: int | None = None
        self._depth = 0
        self._renew()
        with _all_lock:
            _all.add(self)

    def _renew(self) -> None:
        self._queue, self._lock = threading.Lock(), threading.RLock()

    @property
    def mine(self) -> bool:
        """Whether this thread holds it."""
        return self.holder == get_ident()

    @property
    def taken(self) -> bool:
        """Whether another thread holds it."""
        return self.holder is not None and self.holder != get_ident()

    def __enter__(self) -> bool:
        """Acquire it. Returns whether another thread was within a frame."""
        me, stepped = get_ident(), False
        if self.holder != me:
            stepped = self.in_frame
            if self._queue.locked() or not self._lock.acquire(blocking=False):
                with self._queue:  # held while waiting, so that the holder cannot take it again before
                    self._lock.acquire()
            self.holder = me
        self._depth += 1
        return stepped

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if not self._depth:
            self.holder = None
            self._lock.release()

    def frame(self) -> _Frame:
        """The context of a frame of its holder; user functions called in it must not change the world."""
        return _Frame(self)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold it, with the page that steps the world, if any, paused between two frames."""
        with self.page() if self.page else nullcontext(), self:
            yield


class _Frame:
    """The context of a frame."""

    __slots__ = ("_lock",)

    def __init__(self, lock: StepLock) -> None:
        self._lock = lock

    def __enter__(self) -> None:
        self._lock.in_frame = True

    def __exit__(self, *_: object) -> None:
        self._lock.in_frame = False


class Shared:
    """Base class of objects that threads share; the lock is that of their state."""

    _state: Any


def exclusive(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """Decorator of methods that change a world: they wait for the lock and for the page; Ctrl-C is delayed to their end.

    Raises:
        InputError: called from within a frame of the same world, by a force or an observer.
    """

    @functools.wraps(method)
    def waiting(self: S, /, *arguments: P.args, **options: P.kwargs) -> R:
        lock: StepLock = self._state.lock
        if lock.in_frame and lock.mine:
            raise InputError(
                f"{method.__name__.strip('_')} is called in the middle of a frame of this world; "
                "allowed is between two frames, as actors do"
            )
        with without_interrupts, lock if lock.page is None else lock.held():
            return method(self, *arguments, **options)

    return waiting


def between_frames(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """Decorator of methods that read a world: they wait for the end of a frame in another thread."""

    @functools.wraps(method)
    def reading(self: S, /, *arguments: P.args, **options: P.kwargs) -> R:
        with self._state.lock:
            return method(self, *arguments, **options)

    return reading


# ---- forks -------------------------------------------------------------------------------------------------------------

_all: weakref.WeakSet[StepLock] = weakref.WeakSet()
_all_lock = threading.Lock()
_taken: list[StepLock] = []


def _before_fork() -> None:
    """Before a fork: wait until all worlds are between frames and locks are free, as the child has only the forking thread."""
    _all_lock.acquire()
    for lock in _all:
        if lock.mine:
            continue
        if lock._queue.acquire(timeout=_FORK_S):
            if lock._lock.acquire(timeout=_FORK_S):
                _taken.append(lock)
            lock._queue.release()


def _after_fork(*, child: bool) -> None:
    while _taken:
        _taken.pop()._lock.release()
    if child:
        for lock in _all:
            if not lock.mine:
                lock.holder, lock._depth, lock.in_frame = None, 0, False
                lock._renew()
            lock._queue = threading.Lock()
            lock.page = None
    _all_lock.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_before_fork,
        after_in_parent=functools.partial(_after_fork, child=False),
        after_in_child=functools.partial(_after_fork, child=True),
    )
