"""How many threads a world uses: as many as measurably gain.

Threads meet several times a substep, and each meeting waits for the slowest. Where another program has one of the cores, two
threads take longer than one. No figure of the system says so reliably; frames do, since any number of threads gives the same
bits: now and then a few are run with another number, and what was faster is kept.
"""

from __future__ import annotations

from collections import deque
from math import sqrt

from pyverlet.compile import jit

_RUN = 5
"""Frames of a trial. The slowest is left out: the first one finds nothing in its caches, and a machine has its moments."""

_KEPT = 12
"""Frames by which the number in use is judged."""

_GAIN = 0.95
"""More threads stay if they take less than this part of the time of fewer: what is hardly gained others can use better."""

_HOPELESS = 1.6
"""A trial ends early when it has twice taken so many times as long: each such frame comes late on somebody's screen."""

_WORSE = 1.25
"""So many times the time of before, and it is tried at once whether fewer threads do better."""

_OUTLIER = 6.0
"""Times the shortest: longer frames count as this, or one in which the machine stood still would say all."""

_SOONEST, _LATEST = 48, 1536
"""Frames between trials: twice as many after each that found nothing better, from the first to the second, half a minute."""


def cost(frames: deque[float]) -> float:
    """Root of the mean square, less the largest: a frame twice as late is four times as bad, one alone is chance."""
    least = min(frames)
    squares = sorted(min(ms, _OUTLIER * least) ** 2 for ms in frames)
    kept = squares[:-1] or squares
    return sqrt(sum(kept) / len(kept))


def ladder(most: int) -> list[int]:
    """Numbers of threads that are tried: 1, 2, 4, ..., and all, and all but one, for a single busy program beside."""
    powers = [1 << k for k in range(most.bit_length()) if 1 << k <= most]
    return sorted({*powers, max(most - 1, 1), most})


class Team:
    """The threads of one world, told before each frame how long the last one took."""

    def __init__(self) -> None:
        self._most = 0

    def _begin(self, most: int) -> None:
        """As many as there may be, until something is known."""
        self._most, self._steps = most, ladder(most)
        self._now = self._other = len(self._steps) - 1
        self._recent: deque[float] = deque(maxlen=_KEPT)
        self._trial: deque[float] = deque()
        self._usual: float | None = None
        self._down, self._pause, self._wait = True, _SOONEST, 2 * _RUN

    def gather(self, most: int, frame_ms: float) -> None:
        """Have the kernels of the next frame use as many as seem best."""
        jit.use_threads(self.size(most, frame_ms), most)

    def size(self, most: int, frame_ms: float) -> int:
        """Threads for the next frame, `most` at most; frame_ms is what the last one took, 0 if there was none."""
        if most != self._most:
            self._begin(most)
        elif most > 1 and frame_ms > 0.0:
            self._learn(frame_ms)
        return self._steps[self._other]

    def _learn(self, ms: float) -> None:
        if self._other != self._now:
            self._trial.append(ms)
            self._judge()
            return
        self._recent.append(ms)
        self._wait -= 1
        if self._wait <= 0 or (self._worse() and self._wait < self._pause - _RUN):
            self._try()

    def _worse(self) -> bool:
        """Whether frames take longer than they did when the number in use was chosen, and fewer threads could be why not."""
        if self._now == 0 or self._usual is None or len(self._recent) < _RUN:
            return False
        return cost(deque(list(self._recent)[-_RUN:])) > _WORSE * self._usual

    def _try(self) -> None:
        """Some frames with the next larger or smaller number, by turns."""
        if self._worse():
            self._down, self._pause = True, _SOONEST
        step = -1 if self._down else 1
        if not 0 <= self._now + step < len(self._steps):
            step = -step
        self._other = self._now + step
        self._trial.clear()

    def _judge(self) -> None:
        """Whether the trial is over, and what it says."""
        here, fewer = cost(self._recent), self._other < self._now
        hopeless = sorted(self._trial)[-2] > _HOPELESS * here if len(self._trial) > 1 else False
        if len(self._trial) < _RUN and not hopeless:
            return
        there = cost(self._trial)
        better = not hopeless and (there * _GAIN < here if fewer else there < _GAIN * here)
        if better:
            self._now, self._pause = self._other, _SOONEST
            self._recent = deque(self._trial, maxlen=_KEPT)
        else:
            self._other, self._pause = self._now, min(2 * self._pause, _LATEST)
            self._down = not self._down
        self._usual = there if better else here
        self._wait = self._pause
