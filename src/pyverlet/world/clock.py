"""Fixed time steps from a varying wall clock: an accumulator, a cap on catching up, and a budget for the physics of a frame."""

from __future__ import annotations

from collections import deque

import numpy as np

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.constants import FRAME_BUDGET_MS
from pyverlet.common.shown import Shown


class Clock(Shown):
    """Turns elapsed wall time into a whole number of frames of length dt (a fixed-step accumulator).

    The world moves at the same speed along the same trajectory, however often it is drawn. The remainder after the last whole
    frame is `alpha`, a fraction of a frame: draw (1 - alpha) of the previous frame and alpha of the last one.
    After a pause or on a slow machine at most `max_catch_up` frames are made up for at once. The rest is dropped and counted:
    making up for all of it would take ever longer (the spiral of death).

    Args:
        dt: length of a frame, s.
        max_catch_up: most frames that `advance` returns at once.
    """

    _shows = ("dt", "max_catch_up", "dropped")

    dt = Checked(checks.number, above=0.0)
    max_catch_up = Checked(checks.integer)

    def __init__(self, *, dt: float = 1 / 60, max_catch_up: int = 4) -> None:
        self.dt, self.max_catch_up = dt, max_catch_up
        self.dropped = 0
        self._left = 0.0

    def advance(self, elapsed: float) -> int:
        """The number of frames due after `elapsed` more seconds of wall time."""
        self._left += checks.number("elapsed", elapsed, least=0.0)
        # The tolerance of 1e-9 covers the rounding of sums such as 6 * (1/360) = 1/60.
        due = int(self._left / self.dt + 1e-9)
        self._left = max(self._left - due * self.dt, 0.0)
        late = max(due - self.max_catch_up, 0)
        self.dropped += late
        return due - late

    @property
    def alpha(self) -> float:
        """Fraction of a frame, 0 <= alpha < 1, by which wall time is ahead of the last whole frame."""
        return min(self._left / self.dt, 1.0 - 1e-9)


class FrameBudget(Shown):
    """Statistics of the time that the physics of each frame took, against a limit.

    Args:
        limit_ms: the budget of one frame, ms.
        window: number of last frames that the statistics cover.
    """

    _shows = ("limit_ms", "frames", "over")

    limit_ms = Checked(checks.number, above=0.0)

    def __init__(self, *, limit_ms: float = FRAME_BUDGET_MS, window: int = 120) -> None:
        self.limit_ms = limit_ms
        self.frames = 0
        self.over = 0
        self._recent: deque[float] = deque(maxlen=checks.integer("window", window, least=2))

    def record(self, ms: float) -> None:
        """Count one frame that took `ms` milliseconds of physics."""
        self.frames += 1
        self.over += ms > self.limit_ms
        self._recent.append(ms)

    @property
    def last_ms(self) -> float:
        """The last frame, ms; 0 before the first."""
        return self._recent[-1] if self._recent else 0.0

    @property
    def median_ms(self) -> float:
        """Median of the last frames, ms."""
        return float(np.median(self._recent)) if self._recent else 0.0

    @property
    def p95_ms(self) -> float:
        """95th percentile of the last frames, ms."""
        return float(np.percentile(self._recent, 95)) if self._recent else 0.0
