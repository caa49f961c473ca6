"""Frame pacing: when the next picture of a slow world is due, and what viewers need of it."""

from __future__ import annotations

PICTURE_S = 1 / 60
"""Seconds between two pictures of a slow world, on the mean: what a screen shows."""

KEEN = 10
"""Pictures that have velocities of their own after a viewer has asked for some."""


KEEN_ON_FORCES = 60
"""The same for forces, which are worked out a few times a second."""


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


class Audience:
    """What viewers have taken, and what they look at. Called from any thread."""

    def __init__(self) -> None:
        self._newest = self._velocity_until = self._force_until = 0

    def take(self, seq: int, *, velocity: bool) -> None:
        """A viewer has this picture, and looks at velocities or does not."""
        self._newest = max(self._newest, seq)
        if velocity:
            self._velocity_until = max(self._velocity_until, seq + KEEN)

    def want_forces(self, seq: int) -> None:
        """A viewer that has this picture looks at forces."""
        self._force_until = max(self._force_until, seq + KEEN_ON_FORCES)

    def needs_force(self, seq: int) -> bool:
        """Whether this picture needs forces."""
        return seq <= self._force_until

    def has(self, seq: int) -> bool:
        """Whether a viewer has this picture."""
        return self._newest >= seq

    def needs_velocity(self, seq: int) -> bool:
        """Whether this picture needs velocities."""
        return seq <= self._velocity_until
