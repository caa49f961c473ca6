"""What the mouse does to a world besides pushing: pin circles, and add some. Called on the physics thread only."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pyverlet.picture.view import nearest

if TYPE_CHECKING:
    from pyverlet.world.world import World

SPAWNED_RADIUS = 0.5
"""m, in a world that is empty."""


class Pins:
    """Circles of one world that were pinned by hand, by their numbers, and what they weighed before."""

    def __init__(self) -> None:
        self._mass: dict[int, float] = {}

    def pin(self, world: World, x: float, y: float, reach: float) -> bool:
        """Pin the circle whose rim is nearest to (x, y), if within `reach`, metres; a pinned one becomes free.

        Returns whether there was one.
        """
        i = nearest(world, np.array([x, y]), reach)
        if i is None:
            return False
        number = int(world.number[i])
        if np.isfinite(world.mass[i]):
            self._mass[number] = float(world.mass[i])
            world.mass[i] = np.inf
        else:
            world.mass[i] = self._mass.pop(number, None) or usual_density(world) * float(world.radius[i]) ** 2
        world.velocity[i] = 0.0
        world.spin[i] = 0.0
        return True


def spawn(world: World, x: float, y: float) -> None:
    """Add a circle of the usual radius and density at (x, y), metres, at rest. On top of another it starts small and grows.

    None is added outside the bounds or inside an obstacle.
    """
    if not world.is_free((x, y))[0]:
        return
    radius = float(np.median(world.radius)) if len(world) else SPAWNED_RADIUS
    world.add(position=(x, y), velocity=0.0, radius=radius, mass=usual_density(world) * radius**2)


def delete(world: World, x: float, y: float, reach: float) -> None:
    """Remove the circle whose rim is nearest to (x, y), if within `reach`, metres."""
    i = nearest(world, np.array([x, y]), reach)
    if i is not None:
        world.remove(i)


def usual_density(world: World) -> float:
    """Median of mass / radius^2 over the free circles, kg/m^2; 4 where there are none: 1 kg at 0.5 m."""
    free = np.isfinite(world.mass)
    return float(np.median(world.mass[free] / world.radius[free] ** 2)) if free.any() else 4.0
