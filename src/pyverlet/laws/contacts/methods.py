"""How pairs that may touch are found: what a user sets."""

from __future__ import annotations

from dataclasses import dataclass

from pyverlet.ground import checks


@dataclass(frozen=True)
class BruteForce:
    """All pairs against all: O(n^2). The reference the fast way is tested against."""


@dataclass(frozen=True)
class Fast:
    """Nested grids, pairs in batches of eight, kept until neighbours have moved against each other by the skin.

    Args:
        skin: extra distance, in mean diameters, within which pairs are listed. None adapts it to the motion.
    """

    skin: float | None = None

    def __post_init__(self) -> None:
        if self.skin is not None:
            checks.number("skin", self.skin, least=0.0)
