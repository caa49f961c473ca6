"""Rest: piles settle, hold their weight with little overlap, and stay as they are."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pyverlet import scenes
from pyverlet.bounds import Box
from pyverlet.lab.physics._check import Result
from pyverlet.lab.physics._worlds import RADIUS, agitation, frames
from pyverlet.world import World

STILL = 1e-4
"""Kinetic energy per particle over m g R, at rest."""

MEAN_OVERLAP = 0.003
MOST_OVERLAP = 0.05
"""Of the contact distance."""


def cage(particles: int, seconds: float) -> Result:
    """The scene `cage` comes to rest: kinetic energy below 1e-4 m g R, small overlap."""
    world = scenes.get("cage").world(particles=particles, substeps=8)
    world.run(seconds=seconds)
    moving, overlap, escaped = agitation(world), world.overlap(), world.escaped()
    return Result(
        f"cage of {particles:,} after {seconds:g} s: kinetic energy < {STILL:g} m g R, overlap mean <= {MEAN_OVERLAP:.1%}, "
        f"max <= {MOST_OVERLAP:.0%}",
        f"{moving:.1e}, mean {overlap.mean:.2%}, max {overlap.max:.1%}, {escaped} escaped",
        moving < STILL and overlap.mean <= MEAN_OVERLAP and overlap.max <= MOST_OVERLAP and not escaped,
        {"kinetic": moving, "overlap_mean": overlap.mean, "overlap_max": overlap.max, "escaped": escaped},
    )


def substeps(particles: int, seconds: float) -> Result:
    """More substeps make piles stiffer: the overlap under n layers is of order n g h^2."""
    counts = (8, 16, 32)
    found = []
    for count in counts:
        world = scenes.get("cage").world(particles=particles, substeps=count)
        world.run(seconds=seconds)
        found.append((world.overlap(), agitation(world)))
    falls = all(b.mean < a.mean and b.max < a.max for (a, _), (b, _) in pairwise(found))
    return Result(
        f"cage of {particles:,}: mean and max overlap fall from 8 to 16 to 32 substeps",
        "; ".join(f"{n}: {o.mean:.3%}, {o.max:.2%}, KE {k:.0e}" for n, (o, k) in zip(counts, found, strict=True)),
        falls,
        {f"overlap_max_{n}": o.max for n, (o, _) in zip(counts, found, strict=True)}
        | {f"overlap_mean_{n}": o.mean for n, (o, _) in zip(counts, found, strict=True)},
    )


def column(particles: int, seconds: float, most: float = 0.03) -> Result:
    """A column in a slot one diameter wide carries its weight: the lowest contact holds (n - 1) m g."""
    world = World(boundary=Box((0, 0), (2 * RADIUS, 4 * RADIUS * particles)))
    height = RADIUS + 2 * RADIUS * np.arange(particles)
    circles = world.add(position=np.column_stack((np.full(particles, RADIUS), height)), radius=RADIUS)
    lowest, floor, order = 0.0, 0.0, True
    for frame in frames(world, seconds):
        y = circles.position[:, 1].astype(float)
        order &= bool((np.diff(y) > 0).all())
        if frame * 2 > seconds * 60:  # the first half is for coming to rest
            lowest = max(lowest, float(1 - (y[1] - y[0]) / (2 * RADIUS)))
            floor = max(floor, float(1 - y[0] / RADIUS))
    moving = agitation(world)
    return Result(
        f"a column of {particles} in a slot stands, its bottom overlap <= {most:.0%}, kinetic energy < {STILL:g} m g R",
        f"{'stands' if order else 'fell over'}, lowest pair {lowest:.1%}, into the floor {floor:.1%}, {moving:.1e}",
        order and max(lowest, floor) <= most and moving < STILL,
        {"overlap_bottom": lowest, "overlap_floor": floor, "kinetic": moving},
    )


def left_alone(particles: int, seconds: float, friction: float, creep: float = 0.1, turn: float = 0.1) -> Result:
    """A pile left alone neither creeps, boils nor spins: nothing moves it, so nothing moves."""
    world = scenes.get("cage").world(particles=particles, friction=friction)
    world.run(seconds=30)
    start, moving, turned = world.position.astype(float), 0.0, np.zeros(particles)
    for _ in frames(world, seconds):
        moving = max(moving, agitation(world))
        turned += world.spin / 60
    moved = np.hypot(*(world.position - start).T) / RADIUS
    return Result(
        f"a pile of {particles}, friction {friction:g}, left alone for {seconds:g} s after 30: nobody moves by {creep:g} R or "
        f"turns by {turn:g} rad, kinetic energy always < {STILL:g} m g R",
        f"moved {moved.max():.2g} R (median {np.median(moved):.2g}), turned {np.abs(turned).max():.2g} rad, worst {moving:.1e}",
        bool(moved.max() < creep and np.abs(turned).max() < turn and moving < STILL),
        {"moved": float(moved.max()), "turned": float(np.abs(turned).max()), "kinetic": moving},
    )
