"""How many threads a world uses: as many as measurably gain.

Threads meet several times a substep, and each meeting waits for the slowest. Where another program has one of the cores, two
threads take longer than one. No figure of the system says so reliably; frames do, since any number of threads gives the same
bits: now and then a few are run with another number, and what was faster is kept.
"""

from __future__ import annotations

from collections import deque
from math import inf, sqrt

_RUN = 8
"""Frames of a trial. The slowest is left out: the first one finds nothing in its caches, and a machine has its moments."""

_KEPT = 24
"""Frames by which the number in use is judged."""

_GAIN = 0.95
"""More threads stay if they take less than this part of the time of fewer: others can use better what gains little."""

_TOO_SLOW = 1.6
"""Three of the last frames on more threads that took so many times as long as fewer do, and fewer it is: each such frame comes
late on a screen."""

_FAR_TOO_SLOW = 8.0
"""One is enough if it took so many times as long: where a core is kept busy by a program of low priority, it may be seconds."""

_CHANGED = 1.25
"""Frames that cost so many times what they did when fewer threads were last tried: what that has shown holds no longer."""

_OUTLIER = 6.0
"""Times the shortest: longer frames count as this, or one in which the machine stood still would say all."""

_SOONEST, _LATEST = 48, 6144
"""Frames between trials: twice as many after each that found nothing better, four times after a disaster."""


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
    """The threads of one world, told before each frame how long the last one took.

    Attributes:
        now: how many the frame under way uses.
    """

    def __init__(self) -> None:
        self._most, self.now = 0, 1
        self._now = self._other = 0  # places in `_steps`: of the number in use, and of one on trial, if another

    def gather(self, most: int, frame_ms: float) -> None:
        """Have the next frame use as many as seem best."""
        self.now = self.size(most, frame_ms)

    def size(self, most: int, frame_ms: float) -> int:
        """Threads for the next frame, `most` at most; frame_ms is what the last one took, 0 if there was none, or none
        to judge by: the energy limiter takes back on one thread, and long.
        """
        if most != self._most:
            self._begin(most)
        elif most > 1 and frame_ms > 0.0:
            self._learn(frame_ms)
        else:  # such frames come one after the other: what is on trial would be used as long
            self._other = self._now
            self._trial.clear()
        return self._steps[self._other]

    def _begin(self, most: int) -> None:
        """As many as there may be, until something is known."""
        self._most, self._steps = most, ladder(most)
        self._now = self._other = len(self._steps) - 1
        self._recent: deque[float] = deque(maxlen=_KEPT)
        self._trial: deque[float] = deque(maxlen=_RUN)
        self._fewer: float | None = None  # cost of the next smaller number, as of the last trial
        self._judged = inf  # least cost of the number in use since then
        self._down = self._up = _SOONEST  # pauses before the next trial
        self._wait = [2 * _RUN, _SOONEST]  # frames until a trial of fewer, and of more

    def _learn(self, ms: float) -> None:
        if self._other != self._now:
            self._trial.append(ms)
            (self._judge_fewer if self._other < self._now else self._judge_more)()
            return
        self._recent.append(ms)
        self._wait = [left - 1 for left in self._wait]
        if self._now > 0 and self._fewer is not None and self._too_slow(self._recent, self._fewer):
            self._put_off(2)
            self._settle(self._now - 1, deque())
        elif self._now > 0 and (self._wait[0] <= 0 or self._has_changed()):
            self._other = self._now - 1
        elif self._now < len(self._steps) - 1 and self._wait[1] <= 0:
            self._other = self._now + 1

    def _judge_fewer(self) -> None:
        if len(self._trial) < _RUN:
            return
        here, there = cost(self._recent), cost(self._trial)
        if there * _GAIN < here:
            self._settle(self._other, self._trial)
        else:
            self._fewer, self._judged = there, here
            self._down, self._up = min(2 * self._down, _LATEST), _SOONEST
            self._settle(self._now, self._recent)

    def _judge_more(self) -> None:
        here = cost(self._recent)
        far_too_slow, too_slow = self._trial[-1] > _FAR_TOO_SLOW * here, self._too_slow(self._trial, here)
        if not (far_too_slow or too_slow) and len(self._trial) < _RUN:
            return
        if far_too_slow or too_slow or cost(self._trial) >= _GAIN * here:
            self._put_off(4 if far_too_slow else 2)
            self._settle(self._now, self._recent)
        else:
            self._fewer, self._down = here, _SOONEST
            self._settle(self._other, self._trial)

    @staticmethod
    def _too_slow(frames: deque[float], fewer: float) -> bool:
        """Whether this is no number for a busy machine, `fewer` being what a smaller one costs."""
        return sum(ms > _TOO_SLOW * fewer for ms in [*frames][-_RUN:]) > 2

    def _has_changed(self) -> bool:
        """Whether the frames since it was last looked at cost more than they were judged to."""
        if self._wait[0] % _KEPT or len(self._recent) < _KEPT:
            return False
        now = cost(self._recent)
        changed, self._judged = now > _CHANGED * self._judged, min(now, self._judged)
        return changed

    def _put_off(self, times: int) -> None:
        """More threads have not been worth it: they are tried again later than last time."""
        self._up = min(times * self._up, _LATEST)

    def _settle(self, step: int, frames: deque[float]) -> None:
        """Go on with this number, which these frames were run with."""
        fell = step < self._now
        if step != self._now:
            self._down, self._judged = _SOONEST, inf
        if fell:
            self._fewer = None
        self._now = self._other = step
        self._recent = deque(frames, maxlen=_KEPT)
        self._trial.clear()
        self._wait = [self._down + fell * _SOONEST, self._up]  # who has gone down looks up first
