"""Mass and size: piles of unequal circles settle, and heavy ones rest on light ones."""

from __future__ import annotations

import numpy as np

from pyverlet.lab.physics._check import DT, RADIUS, Result, agitation, columns, frames
from pyverlet.lab.physics.rest import STILL
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.rooms import Box
from pyverlet.world.world import World

MOST_OVERLAP = 0.10  # of the contact distance, in a pile of unequal circles


def pile(
    particles: int,
    seconds: float,
    radius_ratio: float,
    mass_ratio: float,
    independent: bool = False,
    seed: int = 1,
    most: float = MOST_OVERLAP,
) -> Result:
    """Unequal circles settle in one pile: radii and masses uniform in their logarithm.

    The larger is the heavier, unless they are drawn independently: then small heavy ones lie on large light ones.
    most: overlap, of the contact distance. One that is caught under another of a thousand times its mass is pressed in by as
    much as its load.
    """
    rng = np.random.default_rng(seed)
    size = rng.uniform(0, 1, particles)
    size[:2] = 0, 1  # both ends are there
    radius = RADIUS * radius_ratio ** (size - 1)
    mass = mass_ratio ** (rng.permutation(size) if independent else size)
    width = np.sqrt(2 * np.pi * float(radius @ radius))
    # Shaken: circles exactly above each other have no way past, and a column of them is no pile.
    start = columns(particles, max(width, 20 * RADIUS), 2.02 * RADIUS) + rng.uniform(-0.01, 0.01, (particles, 2)) * RADIUS
    world = World(boundary=Box((-width, 0), (width, 10 + 2 * start[:, 1].max())))
    world.add(position=start, radius=radius, mass=mass)
    world.run(seconds=seconds)
    moving, overlap, escaped = agitation(world), world.overlap(), world.escaped()
    return Result(
        f"{particles:,} circles, radii 1:{radius_ratio:g}, masses 1:{mass_ratio:g}{' of their own' if independent else ''}, "
        f"after {seconds:g} s: kinetic energy < {STILL:g} m g R, max overlap <= {most:.0%}",
        f"{moving:.1e}, mean {overlap.mean:.2%}, max {overlap.max:.1%}, {escaped} escaped",
        moving < STILL and overlap.max <= most and not escaped,
        {"kinetic": moving, "overlap_mean": overlap.mean, "overlap_max": overlap.max, "escaped": escaped},
    )


def heavy_on_column(seconds: float = 10, times: float = 1000, most: float = 0.1) -> Result:
    """A circle 1000 times as heavy stands on a column of ten light ones."""
    count = 10
    world = World(boundary=Box((0, 0), (2 * RADIUS, 30)))
    y = RADIUS + 2 * RADIUS * np.arange(count + 1)
    circles = world.add(
        position=np.column_stack((np.full(count + 1, RADIUS), y)), radius=RADIUS, mass=np.append(np.ones(count), times)
    )
    order = True
    for _ in frames(world, seconds):
        order &= bool((np.diff(circles.position[:, 1]) > 0).all())
    sunk, overlap, moving = 1 - float(circles.position[-1, 1]) / y[-1], world.overlap().max, agitation(world)
    return Result(
        f"a circle of {times:g} kg on {count} of 1 kg in a slot: stays on top, column <= {most:.0%} shorter, "
        f"kinetic energy < {STILL:g} m g R",
        f"{'on top' if order else 'sank through'}, {sunk:.1%} shorter, max overlap {overlap:.1%}, KE {moving:.0e}",
        order and sunk <= most and moving < STILL,
        {"shorter": sunk, "overlap_max": overlap, "kinetic": moving},
    )


def heavy_on_bed(
    friction: float, particles: int, seconds: float = 15, ratio: float = 31, most: float = 0.05, crushed: float = 0.30
) -> Result:
    """A circle 31 times as large, of equal density and so 961 times as heavy, on a bed of small ones.

    With friction the bed carries it once it has dug itself in: it comes to rest above the lowest third. Without, the bed is a
    liquid of about 0.85 of its density, and it may sink to the floor (Archimedes); but not into the floor, nor into the circles:
    `most` of overlap at the end, `crushed` while a small one is caught between it and the floor.
    """
    small = 0.1
    large = ratio * small
    rng = np.random.default_rng(2)
    half = 2.5 * large
    world = World(boundary=Box((-half, 0), (half, 40), friction=friction), collisions=Collisions(friction=friction))
    start = columns(particles, 2 * half - small, 2.2 * small) + rng.uniform(-0.05, 0.05, (particles, 2)) * small
    world.add(position=start, radius=small, mass=1.0)
    world.run(seconds=5)
    surface = float(world.position[:, 1].max()) + small
    heavy = world.add(position=(0, surface + large), radius=large, mass=ratio**2)
    deepest, late = 0.0, 0.0
    for frame in frames(world, seconds):
        deepest = max(deepest, world.overlap().max)
        if frame == round(0.7 * seconds / DT):
            late = float(heavy.position[0, 1])
    still_sinking = late - float(heavy.position[0, 1])
    rim = float(heavy.position[0, 1]) - large
    sunk = 1 - rim / surface
    holds = rim > surface / 3 and still_sinking < small if friction else rim > -0.01 * large
    wanted = "at rest above the lowest third" if friction else "not into the floor"
    return Result(
        f"a circle of 31 radii and 961 masses on {particles:,} small ones, friction {friction:g}: {wanted}, "
        f"overlap <= {most:.0%}, on the way <= {crushed:.0%}",
        f"sank by {sunk:.0%} of the bed of {surface:.2f} m, {still_sinking / small:.1f} small radii of it late, "
        f"rim at {rim:.2f} m, overlap {(last := world.overlap().max):.1%}, on the way {deepest:.1%}",
        holds and last <= most and deepest <= crushed,
        {"sunk": sunk, "rim": rim, "sunk_late": still_sinking, "overlap_max": last, "overlap_worst": deepest},
    )
