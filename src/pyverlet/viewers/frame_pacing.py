"""Frame pacing: when the next picture of a slow world is due."""

from __future__ import annotations

PICTURE_S = 1 / 60  # seconds between two pictures of a slow world, on the mean: what a screen shows


class FramePacing:
    """As many pictures a second as a screen shows, made at moments that do not fit that pace: between two substeps.

    Each is due so long after the last was due, not after it was made. With substeps of 6 ms every third would come after 18 ms
    otherwise, and of 8 ms every third too, after 24. What is missed is not made up for, but for one.
    """

    def __init__(self) -> None:
        self._next = 0.0

    def due(self, now: float) -> bool:
        """Whether a picture is due at this time, s."""
        return now >= self._next

    def made(self, now: float) -> None:
        """There is one."""
        self._next = max(self._next + PICTURE_S, now)
