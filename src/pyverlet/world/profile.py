"""Time of a frame by stage."""

from __future__ import annotations

from time import perf_counter

import numpy as np

_PLAIN = ("contacts", "lists", "integrate", "surfaces", "pairs", "relax", "links", "notes", "gather", "finish", "scatter")
"""Stages of plain frames, which the core measures: see `core.plain_frames`."""


class Profile:
    """Milliseconds by stage, of the last frame (`stages`) and since the start (`total_ms`).

    `world.step` calls `begin`, then `mark(stage)` at the end of each stage, then `end`. Only seconds are summed meanwhile: in
    small worlds building a table takes almost as long as a frame. The time between two marks of the core, "contacts", is divided
    further in worlds of at least 256 particles.

    Attributes:
        plain: (2, stages + 1) s of the last frame, if it was plain, and of all plain frames; the last column counts them.
        threads: by stage of the last frame, the number of threads if more than one.
    """

    def __init__(self) -> None:
        self.plain = np.zeros((2, len(_PLAIN) + 1))
        self._frame_ms, self._frames = 0.0, 0
        self.threads: dict[str, int] = {}
        self._start = 0.0
        self._last = 0.0  # end of the last stage
        self._spent: dict[str, float] = {}  # s, of the current frame
        self._complete: dict[str, float] = {}  # of the last complete frame
        self._total: dict[str, float] = {}  # of all frames

    def __repr__(self) -> str:
        stages = sorted(self.stages.items(), key=lambda stage: -stage[1])[:4]
        return f"Profile of {self.frames} frames, the last {self.frame_ms:.3g} ms" + "".join(f", {n} {t:.2g}" for n, t in stages)

    @property
    def frames(self) -> int:
        """Number of complete frames."""
        return self._frames + int(self.plain[1, -1])

    @property
    def frame_ms(self) -> float:
        """Duration of the last frame, ms."""
        return 1e3 * float(self.plain[0, :-1].sum()) if self.plain[0, -1] else self._frame_ms

    def begin(self) -> None:
        """Start a frame."""
        self._spent = {}
        self._start = self._last = perf_counter()

    def mark(self, stage: str) -> None:
        """Charge the time since the last mark to `stage`."""
        now, spent = perf_counter(), self._spent
        spent[stage] = spent.get(stage, 0.0) + now - self._last
        self._last = now

    def divide(self, stage: str, parts: dict[str, tuple[float, int]]) -> None:
        """Move these seconds from `stage` to other stages of this frame, with the number of threads of each."""
        self.threads = {name: threads for name, (_, threads) in parts.items() if threads > 1}
        for name, (seconds, _) in parts.items():
            self._spent[stage] = self._spent.get(stage, 0.0) - seconds
            self._spent[name] = self._spent.get(name, 0.0) + seconds

    def end(self) -> None:
        """End the frame."""
        self._frame_ms = (perf_counter() - self._start) * 1e3
        self._frames += 1
        self.plain[0] = 0.0
        self._complete, total = self._spent, self._total
        for stage, seconds in self._spent.items():
            total[stage] = total.get(stage, 0.0) + seconds

    @property
    def stages(self) -> dict[str, float]:
        """Milliseconds by stage of the last complete frame."""
        return _named(self.plain[0]) if self.plain[0, -1] else _by_stage(self._complete)

    @property
    def total_ms(self) -> dict[str, float]:
        """Milliseconds by stage of all complete frames."""
        plain, others = _named(self.plain[1]), _by_stage(self._total.copy())
        return {stage: plain.get(stage, 0.0) + others.get(stage, 0.0) for stage in others | plain}


def _by_stage(spent: dict[str, float]) -> dict[str, float]:
    """Seconds to milliseconds, by stage."""
    return {stage: 1e3 * seconds for stage, seconds in spent.items() if seconds > 0}


def _named(seconds: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[str, float]:
    """Milliseconds by stage of plain frames."""
    return {stage: 1e3 * spent for stage, spent in zip(_PLAIN, seconds[:-1].tolist(), strict=True) if spent > 0}
