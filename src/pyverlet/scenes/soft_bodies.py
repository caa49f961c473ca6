"""Soft bodies among grains: skins of springs that keep their area, sinking into a heap of circles."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world import builders
from pyverlet.world.world import World

SKIN = 40  # particles of a soft body
SHARE = 11  # one particle in this many belongs to a soft body
BODY, GRAIN = 3.8, 0.4  # radius of the soft bodies, and root mean square of the grains', m
BULK = 2e4  # N/m, of the soft bodies: about ten times the pressure at the bottom of the heap
LAYERS = 4  # of grains, each with soft bodies on top
ASPECT = 2.4  # width of the room over the initial height of all grains


def build(settings: Settings) -> World:
    """Layers of grains and soft bodies fall into a heap; all collide with each other.

    A soft body is a ring of springs around a compressible area. It weighs as much as the grains that it displaces.
    """
    bodies = settings.particles // (SHARE * SKIN)
    rng, radii = settings.draw_radii(GRAIN, settings.particles - bodies * SKIN)
    width = max(float(np.sqrt(ASPECT * 5.0 * np.sum(radii**2))), 2.5 * BODY)
    grains, discs, top = [], [], 0.0
    for layer, members in enumerate(np.array_split(radii, LAYERS if bodies else 1)):
        height = max(5.0 * float(np.sum(members**2)) / width, 2.5 * float(radii.max()))
        while (centres := _start.in_box(rng, members, width, height)) is None:
            height *= 1.05
        grains.append(centres + np.array([0.0, top]))
        top += height
        count = (bodies * (layer + 1)) // LAYERS - (bodies * layer) // LAYERS
        for row in np.array_split(np.arange(count), max(1, -(-count // int(width / (2.1 * BODY))))):
            x = width * ((np.arange(len(row)) + 0.5) / max(len(row), 1) - 0.5)
            discs += [(float(here), top + BODY) for here in x]
            top += 2.0 * BODY if len(row) else 0.0
    world = settings.empty_world(Box((-width / 2, 0), (width / 2, top), **settings.surface))
    world.add(position=np.concatenate(grains), radius=radii, mass=(radii / GRAIN) ** 2)
    spacing = 2 * np.pi * BODY / (SKIN + np.pi)  # the ring lies inside by half of it
    for centre in discs:
        builders.soft_body(
            world, builders.disc(centre, BODY, corners=5 * SKIN), spacing=spacing, mass=(BODY / GRAIN) ** 2, bulk=BULK
        )
    return world


SCENE = Scene(
    "soft-bodies", "50 soft bodies of 40 particles among 20,000 grains", build,
    Settings(particles=22_000, friction=0.3, radius_spread=1.5),
)  # fmt: skip
