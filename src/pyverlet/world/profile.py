"""Where the time of a frame goes, by the names of its stages."""

from __future__ import annotations

from time import perf_counter

import numpy as np

_PLAIN = ("contacts", "lists", "integrate", "surfaces", "pairs", "relax", "links", "notes", "gather", "finish", "scatter")
"""Stages of plain frames, of which the core keeps account: see `core.plain_frames`."""


class Profile:
    """Milliseconds by stage, of the last frame (`stages`) and since the start (`total_ms`).

    `world.step` calls `begin`, then `mark(stage)` at the end of each stage, then `end`. Only seconds are summed meanwhile: frames
    of small worlds are not much longer than what it takes to make a table of them. What the core does between two marks,
    "contacts", is divided further in worlds of at least 256 particles.

    Attributes:
        plain: (2, stages and 1) s of the last frame, if it was plain, and of all that were, and how many.
        threads: by stage of the last frame, how many worked on it where it is not one.
    """

    def __init__(self) -> None:
        self.plain = np.zeros((2, len(_PLAIN) + 1))
        self._frame_ms, self._frames = 0.0, 0
        self.threads: dict[str, int] = {}
        self._start = 0.0
        self._last = 0.0  # when the last stage ended
        self._spent: dict[str, float] = {}  # s, of the frame that is under way
        self._complete: dict[str, float] = {}  # of the last complete frame
        self._total: dict[str, float] = {}  # of all of them

    def __repr__(self) -> str:
        stages = sorted(self.stages.items(), key=lambda stage: -stage[1])[:4]
        return f"Profile of {self.frames} frames, the last {self.frame_ms:.3g} ms" + "".join(f", {n} {t:.2g}" for n, t in stages)

    @property
    def frames(self) -> int:
        """How many there were."""
        return self._frames + int(self.plain[1, -1])

    @property
    def frame_ms(self) -> float:
        """The last frame."""
        return 1e3 * float(self.plain[0, :-1].sum()) if self.plain[0, -1] else self._frame_ms

    def begin(self) -> None:
        """A frame begins."""
        self._spent = {}
        self._start = self._last = perf_counter()

    def mark(self, stage: str) -> None:
        """Charge the time since the last mark to `stage`."""
        now, spent = perf_counter(), self._spent
        spent[stage] = spent.get(stage, 0.0) + now - self._last
        self._last = now

    def divide(self, stage: str, parts: dict[str, tuple[float, int]]) -> None:
        """Of what was charged to `stage` in this frame, these seconds were other ones, on so many threads."""
        self.threads = {name: threads for name, (_, threads) in parts.items() if threads > 1}
        for name, (seconds, _) in parts.items():
            self._spent[stage] = self._spent.get(stage, 0.0) - seconds
            self._spent[name] = self._spent.get(name, 0.0) + seconds

    def end(self) -> None:
        """The frame is complete."""
        self._frame_ms = (perf_counter() - self._start) * 1e3
        self._frames += 1
        self.plain[0] = 0.0
        self._complete, total = self._spent, self._total
        for stage, seconds in self._spent.items():
            total[stage] = total.get(stage, 0.0) + seconds

    @property
    def stages(self) -> dict[str, float]:
        """Milliseconds of each stage that the last complete frame had."""
        return _named(self.plain[0]) if self.plain[0, -1] else _by_stage(self._complete)

    @property
    def total_ms(self) -> dict[str, float]:
        """Milliseconds of each stage in all complete frames."""
        plain, others = _named(self.plain[1]), _by_stage(self._total.copy())
        return {stage: plain.get(stage, 0.0) + others.get(stage, 0.0) for stage in others | plain}


def _by_stage(spent: dict[str, float]) -> dict[str, float]:
    """Milliseconds, by stage."""
    return {stage: 1e3 * seconds for stage, seconds in spent.items() if seconds > 0}


def _named(seconds: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[str, float]:
    """Milliseconds of each stage of plain frames."""
    return {stage: 1e3 * spent for stage, spent in zip(_PLAIN, seconds[:-1].tolist(), strict=True) if spent > 0}
