"""Where the time of a frame goes, by the names of its stages."""

from __future__ import annotations

from collections import defaultdict
from time import perf_counter


class Profile:
    """Milliseconds by stage, of the last frame (`stages`) and since the start (`total_ms`).

    `world.step` calls `begin`, then `mark(stage)` at the end of each stage, then `end`. Only seconds are summed meanwhile: frames
    of small worlds are not much longer than what it takes to make a table of them.
    """

    def __init__(self) -> None:
        self.frame_ms = 0.0
        self.frames = 0
        self.rebuilds = 0
        self._start = self._last = 0.0
        self._now: dict[str, float] = {}  # s, of the frame that is under way
        self._complete: dict[str, float] = {}  # s, of the last complete frame
        self._total: defaultdict[str, float] = defaultdict(float)  # s, of all of them

    def begin(self) -> None:
        """A frame begins."""
        self._now = {}  # without what a frame that failed has left
        self._start = self._last = perf_counter()

    def mark(self, stage: str) -> None:
        """Charge the time since the last mark to `stage`."""
        now = perf_counter()
        self._now[stage] = self._now.get(stage, 0.0) + now - self._last
        self._last = now

    def end(self) -> None:
        """The frame is complete."""
        self.frame_ms = (perf_counter() - self._start) * 1e3
        self.frames += 1
        self._complete = self._now
        for stage, seconds in self._now.items():
            self._total[stage] += seconds

    @property
    def stages(self) -> dict[str, float]:
        """Milliseconds of each stage that the last complete frame had."""
        return {stage: seconds * 1e3 for stage, seconds in self._complete.items()}

    @property
    def total_ms(self) -> dict[str, float]:
        """Milliseconds of each stage in all complete frames."""
        return {stage: seconds * 1e3 for stage, seconds in list(self._total.items())}
