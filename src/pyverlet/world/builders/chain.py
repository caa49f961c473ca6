"""A chain: rigid links in a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.ground import checks
from pyverlet.laws.links import Stick
from pyverlet.world.builders._built import Built, Point, add, ends

if TYPE_CHECKING:
    from pyverlet.world.world import World


def chain(
    world: World,
    start: Point,
    end: Point,
    *,
    links: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """Particles from `start` to `end`, joined by sticks; `chain.group.pin(0)` hangs it up.

    Args:
        world: gets the particles and the sticks.
        start: (x, y) of the first particle, m.
        end: (x, y) of the last one, m.
        links: how many sticks.
        mass: of all particles together, kg.
        radius: of each, m; by default they all but touch.
        compliance: of each stick, m/N.
        breaking_force: at which a stick breaks, N.
        particles: category, friction and all else that `World.add` takes.
    """
    count = checks.whole("links", links)
    a, b, apart = ends(start, end)
    group = add(world, a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a), apart / count, radius, mass, **particles)
    k = np.arange(count)
    stick = Stick(group, k, k + 1, compliance=compliance, breaking_force=breaking_force, collide=False)
    return Built(group, (world.links.append(stick),))
