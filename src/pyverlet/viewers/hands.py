"""The mice in the world: each hand drags one particle or pokes a hole, until it lets go."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pyverlet.laws.forces import Grip, Push
from pyverlet.picture.view import nearest
from pyverlet.viewers.tools import Pins, delete, spawn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pyverlet.viewers.layout import Layout
    from pyverlet.world.world import World

GRIP_FREQUENCY = 4.0
"""Hz of the spring between mouse and particle: it follows a hand within a quarter of a second."""

LINKED_STRENGTH = 8.0
"""How much harder a particle is pulled that is linked to others: enough to tear a cloth, and w h sqrt(8) stays
below 2, where it would become unstable, at one substep of 1/60 s."""

LEASH = 0.08
"""The spring stretches to this part of the view at most: a flick of the mouse shoots no particle through a pile."""

POKE_RADIUS = 0.08
"""Of the view."""

POKE_TIME_S = 0.09
"""Seconds a particle at rest near the middle of a poke takes to its rim; the acceleration follows. Opens a heap to the ground."""


class Hands:
    """What every hand holds. Called on the physics thread only.

    Args:
        world: its `forces` gain one entry for every hand that holds something.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._held: dict[int, Grip | Push | None] = {}
        self._aim: dict[int, tuple[float, float]] = {}

    def drag(self, hand: int, x: float, y: float, reach: float) -> bool:
        """Aim this hand at (x, y), metres; whether it holds anything.

        An unused hand first takes the particle whose rim is nearest, if within `reach` metres.
        """
        if hand not in self._held:
            particle = nearest(self._world, np.array([x, y]), reach)
            self._hold(hand, None if particle is None else self._grip(particle, x, y))
        self._aim[hand] = (x, y)
        return self._held[hand] is not None

    def poke(self, hand: int, x: float, y: float, view_size: float) -> None:
        """Push everything around (x, y), metres, away from it. `view_size`, metres, sets how wide."""
        if hand not in self._held:
            radius = POKE_RADIUS * view_size
            self._hold(hand, Push(center=(x, y), radius=radius, acceleration=2.0 * radius / POKE_TIME_S**2))
        self._aim[hand] = (x, y)

    def release(self, hand: int) -> None:
        """Let go. A hand that holds nothing is none the worse."""
        force = self._held.pop(hand, None)
        self._aim.pop(hand, None)
        if force is not None and force in self._world.forces:
            self._world.forces.remove(force)

    def release_all(self) -> None:
        """Every hand lets go."""
        for hand in list(self._held):
            self.release(hand)

    def move(self, view_size: float) -> None:
        """Bring the forces to where the hands aim; before every frame."""
        for hand, force in self._held.items():
            if isinstance(force, Push):
                force.center = self._aim[hand]
            elif isinstance(force, Grip) and force.particle >= 0:
                force.target = self._leashed(force.particle, self._aim[hand], LEASH * view_size)

    def _leashed(self, particle: int, aim: tuple[float, float], leash: float) -> tuple[float, float]:
        x, y = (float(value) for value in self._world.position[particle])
        dx, dy = self._world.boundary.seam.nearest(np.array(aim) - (x, y))
        shorten = min(1.0, leash / max(float(np.hypot(dx, dy)), 1e-30))
        return (x + dx * shorten, y + dy * shorten)

    def _grip(self, particle: int, x: float, y: float) -> Grip:
        strength = LINKED_STRENGTH if self._world.links.hold(particle) else 1.0
        return Grip(particle, target=(x, y), frequency=GRIP_FREQUENCY, strength=strength)

    def _hold(self, hand: int, force: Grip | Push | None) -> None:
        self._held[hand] = force
        if force is not None:
            self._world.forces.append(force)


class HandsOnPanels:
    """Hands over a picture of one or more worlds: each works in the panel it first came down on, until it lets go.

    Points are given in the picture's coordinates, metres. Called on the physics thread only.
    """

    def __init__(self, worlds: Sequence[World]) -> None:
        self._worlds = worlds
        self._hands = [Hands(world) for world in worlds]
        self._pins = [Pins() for _ in worlds]
        self._panel: dict[int, int] = {}

    def drag(self, hand: int, x: float, y: float, reach: float, layout: Layout) -> bool:
        """As `Hands.drag`."""
        panel, x, y = self._take(hand, x, y, layout)
        return self._hands[panel].drag(hand, x, y, reach)

    def poke(self, hand: int, x: float, y: float, view_size: float, layout: Layout) -> None:
        """As `Hands.poke`."""
        panel, x, y = self._take(hand, x, y, layout)
        self._hands[panel].poke(hand, x, y, view_size)

    @property
    def busy(self) -> bool:
        """Whether any hand has come down."""
        return bool(self._panel)

    def hold(self, hand: int) -> bool:
        """Whether this hand has come down already: then it only aims anew."""
        return hand in self._panel

    def pin(self, x: float, y: float, reach: float, layout: Layout) -> bool:
        """As `Pins.pin`."""
        panel, x, y = _within(x, y, layout)
        return self._pins[panel].pin(self._worlds[panel], x, y, reach)

    def spawn(self, x: float, y: float, layout: Layout) -> None:
        """Add a circle; see `tools.spawn`."""
        panel, x, y = _within(x, y, layout)
        spawn(self._worlds[panel], x, y)

    def delete(self, x: float, y: float, reach: float, layout: Layout) -> None:
        """Remove a circle; see `tools.delete`."""
        panel, x, y = _within(x, y, layout)
        delete(self._worlds[panel], x, y, reach)

    def _take(self, hand: int, x: float, y: float, layout: Layout) -> tuple[int, float, float]:
        panel = self._panel.setdefault(hand, layout.at(x, y))
        dx, dy = layout.offset(panel)
        return panel, x - dx, y - dy

    def release(self, hand: int) -> None:
        """Let go."""
        self._hands[self._panel.pop(hand, 0)].release(hand)

    def release_all(self) -> None:
        """Every hand lets go. Pins stay."""
        self._panel.clear()
        for hands in self._hands:
            hands.release_all()

    def move(self, view_size: float) -> None:
        """As `Hands.move`, before every frame."""
        for hands in self._hands:
            hands.move(view_size)


def _within(x: float, y: float, layout: Layout) -> tuple[int, float, float]:
    """The panel at a point of the picture, and the point in its own coordinates."""
    panel = layout.at(x, y)
    dx, dy = layout.offset(panel)
    return panel, x - dx, y - dy
