"""A bridge of planks that hangs between two points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.ground import checks
from pyverlet.world.builders._built import Built, Point
from pyverlet.world.builders.rope import rope

if TYPE_CHECKING:
    from pyverlet.world.world import World


def bridge(
    world: World,
    start: Point,
    end: Point,
    *,
    slack: float = 0.03,
    planks: int = 20,
    mass: float = 10.0,
    radius: float | None = None,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """A deck of circles on a rope whose ends are immovable: what falls on it stays on it.

    Args:
        world: gets the particles and the links.
        start: (x, y) where it is fixed, m.
        end: (x, y) of its other end, m.
        slack: part by which the deck is longer than the way, 0 or more. Without, the pull at its ends is enormous.
        planks: how many.
        mass: of all planks together, kg.
        radius: of each, m; by default they all but touch.
        breaking_force: at which the deck tears between two planks, N.
        particles: category, friction and all else that `World.add` takes.
    """
    checks.number("slack", slack, least=0.0)
    apart = float(np.hypot(*(np.subtract(checks.vector("end", end), checks.vector("start", start)))))
    built = rope(
        world, start, end, length=(1 + slack) * apart, links=checks.whole("planks", planks) + 1, mass=mass, radius=radius,
        breaking_force=breaking_force, **particles,
    )  # fmt: skip
    built.group.pin([0, -1])
    return built
