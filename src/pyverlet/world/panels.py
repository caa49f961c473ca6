"""Worlds side by side: time passes equally in each, and each is drawn under its name beside the others."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence

from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown, listed
from pyverlet.world.saved import Saved
from pyverlet.world.world import World

Pace = Callable[[World, int, float], None]
"""How a world follows the frames of a screen: called with the world, the frame number (from 1) and the frame length dt, s."""


def every_frame(world: World, frame: int, dt: float) -> None:
    """Step the world by one frame for each frame of the screen; the default pace."""
    world.step(dt)


class Panel(Shown):
    """A world with a name, drawn beside others.

    Args:
        name: shown above it.
        world: what it shows.
        pace: how the world follows the frames of the screen.
    """

    _shows = ("name", "world")

    def __init__(self, name: str, world: World, pace: Pace = every_frame) -> None:
        self.name = name
        self.world = world
        self.frames = 0
        self.pace = pace

    def step(self, dt: float) -> None:
        """Advance by one frame of the screen, dt seconds."""
        self.frames += 1
        self.pace(self.world, self.frames, dt)


class Panels:
    """One or more worlds that are shown side by side.

    Args:
        panels: from left to right.
        line: height y, m, of a line drawn across every panel, such as the initial height; None draws none.
    """

    def __init__(self, panels: Sequence[Panel], *, line: float | None = None) -> None:
        if not panels:
            raise InputError("panels is empty; allowed is one panel or more")
        self._panels = tuple(panels)
        self.line = line

    @classmethod
    def of(cls, world: World | Panels) -> Panels:
        """The `Panels` of a single world; panels are returned unchanged."""
        if not isinstance(world, Panels | World):
            raise InputError(f"world is {world!r}; allowed are a pyverlet.World and pyverlet.Panels")
        return world if isinstance(world, Panels) else cls([Panel("", world)])

    def __len__(self) -> int:
        return len(self._panels)

    def __iter__(self) -> Iterator[Panel]:
        return iter(self._panels)

    def __repr__(self) -> str:
        return listed("panel", (panel.name or panel.world for panel in self))

    @property
    def worlds(self) -> list[World]:
        """The worlds, from left to right."""
        return [panel.world for panel in self]

    @property
    def time(self) -> float:
        """The largest simulated time among the worlds, s."""
        return max(world.time for world in self.worlds)

    @property
    def frames(self) -> int:
        """The largest number of frames among the worlds."""
        return max(world.frames for world in self.worlds)

    def step(self, dt: float) -> None:
        """Advance every panel by one frame of the screen, dt seconds."""
        for panel in self:
            panel.step(dt)

    def save(self) -> list[tuple[int, Saved]]:
        """A copy of everything that moves, for `restore`."""
        return [(panel.frames, panel.world.save()) for panel in self]

    def restore(self, saved: list[tuple[int, Saved]]) -> None:
        """Go back to what `save` returned."""
        for panel, (frames, state) in zip(self, saved, strict=True):
            panel.frames = frames
            panel.world.restore(state)

    def state_hash(self) -> str:
        """16 hex digits: the world's own hash for one world, a joint hash for more."""
        hashes = [world.state_hash() for world in self.worlds]
        return hashes[0] if len(hashes) == 1 else hashlib.blake2b(" ".join(hashes).encode(), digest_size=8).hexdigest()
