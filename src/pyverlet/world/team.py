"""How many threads a world uses: as many as measurably help.

Threads synchronise several times per substep, and each time all wait for the slowest. If another program occupies a core, two
threads take longer than one. No system statistic shows this reliably, but frame times do: since any number of threads gives the
same bits, a few frames are run with another number now and then, and the faster number is kept.
"""

from __future__ import annotations

from collections import deque
from math import inf, sqrt

_RUN = 8
"""Frames of a trial. The slowest is ignored: the first one has cold caches, and any machine has outliers."""

_KEPT = 24
"""Frames by which the number in use is judged."""

_GAIN = 0.95
"""More threads are kept only if they take less than this fraction of the time: other programs can use the cores better."""

_TOO_SLOW = 1.6
"""If three of the last frames on more threads took so many times as long as on fewer, fewer are used: such frames are noticed."""

_FAR_TOO_SLOW = 8.0
"""One frame is enough if it took this many times as long: on a core shared with low-priority work it may take seconds."""

_CHANGED = 1.25
"""If frames cost this many times as much as at the last trial of fewer threads, its result no longer holds."""

_OUTLIER = 6.0
"""Frame times are capped at this multiple of the shortest, so that one stall of the machine does not decide."""

_SOONEST, _LATEST = 48, 6144
"""Frames between trials: doubled after each that found nothing better, quadrupled after a disaster."""


def cost(frames: deque[float]) -> float:
    """Root mean square without the largest: a frame twice as late is four times as bad, a single one is chance."""
    least = min(frames)
    squares = sorted(min(ms, _OUTLIER * least) ** 2 for ms in frames)
    kept = squares[:-1] or squares
    return sqrt(sum(kept) / len(kept))


def ladder(most: int) -> list[int]:
    """Numbers of threads to try: 1, 2, 4, ..., all, and all but one, in case one other program is busy."""
    powers = [1 << k for k in range(most.bit_length()) if 1 << k <= most]
    return sorted({*powers, max(most - 1, 1), most})


class Team:
    """Chooses the number of threads of one world from the duration of its frames.

    Attributes:
        now: number of threads of the current frame.
    """

    def __init__(self) -> None:
        self._most, self.now = 0, 1
        self._now = self._other = 0  # indices in `_steps`: of the number in use, and of the one on trial

    def gather(self, most: int, frame_ms: float) -> None:
        """Choose the number of threads of the next frame."""
        self.now = self.size(most, frame_ms)

    def size(self, most: int, frame_ms: float) -> int:
        """Number of threads of the next frame, at most `most`; frame_ms: duration of the last frame, 0 if it says nothing: there
        was none, or the energy limiter worked, which uses one thread.
        """
        if most != self._most:
            self._begin(most)
        elif most > 1 and frame_ms > 0.0:
            self._learn(frame_ms)
        else:  # such frames come in runs: a number on trial would be used for as long
            self._other = self._now
            self._trial.clear()
        return self._steps[self._other]

    def _begin(self, most: int) -> None:
        """Start with all threads."""
        self._most, self._steps = most, ladder(most)
        self._now = self._other = len(self._steps) - 1
        self._recent: deque[float] = deque(maxlen=_KEPT)
        self._trial: deque[float] = deque(maxlen=_RUN)
        self._fewer: float | None = None  # cost of the next smaller number at the last trial
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
        """Whether this number is too slow on a busy machine, if a smaller one costs `fewer`."""
        return sum(ms > _TOO_SLOW * fewer for ms in [*frames][-_RUN:]) > 2

    def _has_changed(self) -> bool:
        """Whether recent frames cost more than at the last judgement."""
        if self._wait[0] % _KEPT or len(self._recent) < _KEPT:
            return False
        now = cost(self._recent)
        changed, self._judged = now > _CHANGED * self._judged, min(now, self._judged)
        return changed

    def _put_off(self, times: int) -> None:
        """More threads did not help: wait longer before the next trial."""
        self._up = min(times * self._up, _LATEST)

    def _settle(self, step: int, frames: deque[float]) -> None:
        """Continue with this number of threads, which these frames were run with."""
        fell = step < self._now
        if step != self._now:
            self._down, self._judged = _SOONEST, inf
        if fell:
            self._fewer = None
        self._now = self._other = step
        self._recent = deque(frames, maxlen=_KEPT)
        self._trial.clear()
        self._wait = [self._down + fell * _SOONEST, self._up]  # after a reduction, trials of more come first
