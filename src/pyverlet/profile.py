"""Where the time of a frame goes, by the names of its stages."""

from __future__ import annotations

from collections import defaultdict
from time import perf_counter


class Profile:
    """Milliseconds by stage, of the last frame (`stages`) and since the start (`total_ms`).

    `world.step` calls `begin`, then `mark(stage)` at the end of each stage, then `end`.
    """

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}
        self.total_ms: dict[str, float] = {}
        self.frame_ms = 0.0
        self.frames = 0
        self.rebuilds = 0
        self._start = self._last = 0.0
        self._current: defaultdict[str, float] = defaultdict(float)  # s

    def begin(self) -> None:
        """A frame begins."""
        self._current = defaultdict(float)
        self._start = self._last = perf_counter()

    def mark(self, stage: str) -> None:
        """Charge the time since the last mark to `stage`."""
        now = perf_counter()
        self._current[stage] += now - self._last
        self._last = now

    def end(self) -> None:
        """The frame is complete."""
        self.frame_ms = (perf_counter() - self._start) * 1e3
        self.frames += 1
        self.stages = {stage: seconds * 1e3 for stage, seconds in self._current.items()}
        for stage, ms in self.stages.items():
            self.total_ms[stage] = self.total_ms.get(stage, 0.0) + ms
