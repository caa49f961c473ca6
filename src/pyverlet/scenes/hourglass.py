"""Sand runs through the neck of an hourglass."""

import numpy as np

from pyverlet.laws.boundaries import Open
from pyverlet.laws.obstacles import Chain
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

RADIUS = 0.5  # root mean square radius of the grains, m
NECK = 2.5  # half width of the neck, in largest diameters: flow through a narrower one may stop
STEEP = 1.2  # height of a cone over its half width
GROWTH = 1.03  # factor by which the glass grows until the grains fit into its upper half


def build(settings: Settings) -> World:
    """2,000 grains run from the upper bulb into the lower one.

    The glass is a closed chain of segments, 5 grains wide at the neck, without other bounds: no grain passes the corners. Sand
    with friction (--friction) runs more slowly, and heaps up below.
    """
    rng, radii = settings.draw_radii(RADIUS)
    neck, wide = 2 * NECK * float(radii.max()), 4 * NECK * float(radii.max())
    while True:
        cone = STEEP * (wide - neck)
        slant = np.hypot(wide - neck, cone) / cone

        def half_width(y: float, margin: float, wide: float = wide, cone: float = cone, slant: float = slant) -> float:
            return min(wide - margin, neck + y * (wide - neck) / cone - slant * margin)

        top = cone + wide
        if (centres := _start.in_rows(rng, radii, 0.0, top, half_width)) is not None:
            break
        wide *= GROWTH
    world = settings.empty_world(Open())
    right = np.array([(wide, -top), (wide, -cone), (neck, 0.0), (wide, cone), (wide, top)])
    glass = np.concatenate((right, right[::-1] * (-1, 1)))
    world.obstacles.append(Chain(glass, closed=True, **settings.surface))
    world.add(position=centres, radius=radii, mass=(radii / RADIUS) ** 2)
    return world


def view(settings: Settings) -> tuple[float, float, float, float]:
    """x0, y0, x1, y1 in metres: the glass."""
    low, high = (f(build(settings).obstacles[0].points, axis=0) for f in (np.min, np.max))
    margin = 0.03 * float(high[1] - low[1])
    return (float(low[0]) - margin, float(low[1]) - margin, float(high[0]) + margin, float(high[1]) + margin)


SCENE = Scene(
    "hourglass", "2,000 grains run through the neck of an hourglass", build, Settings(particles=2_000), show=Show(view=view)
)
