"""Where the time of a frame goes, by the names of its stages."""

from __future__ import annotations

from time import perf_counter

import numpy as np

_ROOM = 64
"""Stages that have a place at most, and one more."""


class Profile:
    """Milliseconds by stage, of the last frame (`stages`) and since the start (`total_ms`).

    `world.step` calls `begin`, then `mark(stage)` at the end of each stage, then `end`. Only seconds are summed meanwhile: frames
    of small worlds are not much longer than what it takes to make a table of them. What the core does between two marks,
    "contacts", is divided further in worlds of at least 256 particles.

    Attributes:
        frame_ms: the last frame. frames: how many there were.
        threads: by stage of the last frame, how many worked on it where it is not one.
    """

    def __init__(self) -> None:
        self.frame_ms = 0.0
        self.frames = 0
        self.threads: dict[str, int] = {}
        self._start = 0.0
        self._broken_off = False
        self._places: dict[str, int] = {}
        self._spent = np.zeros(_ROOM)  # s, of the frame that is under way, by place; the first is when the last stage ended
        self._complete = np.zeros(_ROOM)  # of the last complete frame
        self._total = np.zeros(_ROOM)  # of all of them

    def __repr__(self) -> str:
        stages = sorted(self.stages.items(), key=lambda stage: -stage[1])[:4]
        return f"Profile of {self.frames} frames, the last {self.frame_ms:.3g} ms" + "".join(f", {n} {t:.2g}" for n, t in stages)

    def begin(self) -> None:
        """A frame begins."""
        if self._broken_off:
            self._spent.fill(0.0)
        self._broken_off = True  # unless it comes to its end
        self._start = self._spent[0] = perf_counter()

    def mark(self, stage: str) -> None:
        """Charge the time since the last mark to `stage`."""
        now, spent = perf_counter(), self._spent
        spent[self._place(stage)] += now - spent[0]
        spent[0] = now

    def divide(self, stage: str, parts: dict[str, tuple[float, int]]) -> None:
        """Of what was charged to `stage` in this frame, these seconds were other ones, on so many threads."""
        self.threads = {name: threads for name, (_, threads) in parts.items() if threads > 1}
        for name, (seconds, _) in parts.items():
            self._spent[self._place(stage)] -= seconds
            self._spent[self._place(name)] += seconds

    def _place(self, stage: str) -> int:
        return self._places.get(stage) or self._places.setdefault(stage, len(self._places) + 1)

    def end(self) -> None:
        """The frame is complete."""
        self.frame_ms = (perf_counter() - self._start) * 1e3
        self.frames += 1
        self._broken_off = False
        self._total += self._spent
        self._complete, self._spent = self._spent, self._complete
        self._spent.fill(0.0)

    @property
    def stages(self) -> dict[str, float]:
        """Milliseconds of each stage that the last complete frame had."""
        return self._told(self._complete)

    @property
    def total_ms(self) -> dict[str, float]:
        """Milliseconds of each stage in all complete frames."""
        return self._told(self._total)

    def _told(self, seconds: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[str, float]:
        return {stage: 1e3 * float(seconds[place]) for stage, place in self._places.copy().items() if seconds[place] > 0}
