"""Time on the wall against time in the world: a fixed step, a cap on catching up, a budget for the physics of a frame."""

from __future__ import annotations

from collections import deque

import numpy as np

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.constants import FRAME_BUDGET_MS
from pyverlet.common.shown import Shown


class Clock(Shown):
    """Turns elapsed wall time into a whole number of frames of length dt (a fixed-step accumulator).

    The world then moves at the same speed, along the same trajectory, however often it is drawn. What is left over after the
    last whole frame is `alpha`, a fraction of a frame: draw (1 - alpha) of the frame before and alpha of the last.
    After a pause or on a slow machine at most `max_catch_up` frames are made up for at once; the rest is dropped and counted
    (soft real time), since making up for all of it takes longer still: the spiral of death.

    Args:
        dt: length of a frame, s.
        max_catch_up: most frames `advance` asks for at once.
    """

    _shows = ("dt", "max_catch_up", "dropped")

    dt = Checked(checks.number, above=0.0)
    max_catch_up = Checked(checks.integer)

    def __init__(self, *, dt: float = 1 / 60, max_catch_up: int = 4) -> None:
        self.dt, self.max_catch_up = dt, max_catch_up
        self.dropped = 0
        self._left = 0.0

    def advance(self, elapsed: float) -> int:
        """Frames due after `elapsed` more seconds of wall time."""
        self._left += checks.number("elapsed", elapsed, least=0.0)
        # A billionth of a frame forgives the rounding of sums like 6 * (1/360) = 1/60.
        due = int(self._left / self.dt + 1e-9)
        self._left = max(self._left - due * self.dt, 0.0)
        late = max(due - self.max_catch_up, 0)
        self.dropped += late
        return due - late

    @property
    def alpha(self) -> float:
        """Fraction of a frame, 0 <= alpha < 1, by which the wall is ahead of the last whole frame."""
        return min(self._left / self.dt, 1.0 - 1e-9)


class FrameBudget(Shown):
    """How long the physics of each frame took, against the time it may take.

    Args:
        limit_ms: the budget of one frame, ms.
        window: how many of the last frames the statistics cover.
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
        """The time that 95 % of the last frames kept, ms."""
        return float(np.percentile(self._recent, 95)) if self._recent else 0.0
