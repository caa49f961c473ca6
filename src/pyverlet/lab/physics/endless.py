"""Gas in a room without an end: energy and momentum are kept, and it presses as an equation of state says."""

from __future__ import annotations

import numpy as np

from pyverlet.lab.physics._check import RADIUS, Result, frames
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.rooms import Periodic
from pyverlet.scenes.gas import henderson
from pyverlet.world.world import World

SPEED = 3.0  # standard deviation of each component of the velocities, m/s
FRAME_S = 1 / 240  # of a frame in which the pressure is taken: circles move by 0.02 of their radius in a substep


def gas(particles: int, fraction: float, *, contacts: bool = False) -> World:
    """Elastic circles on a lattice, at rest as a whole."""
    rng, side = np.random.default_rng(1), int(np.ceil(np.sqrt(particles)))
    size = RADIUS * float(np.sqrt(np.pi * particles / fraction))
    room, bounce = Periodic((0, 0), (size, size)), Collisions(restitution=1.0)
    world = World(gravity=(0, 0), boundary=room, collisions=bounce, contacts=contacts)
    velocity = rng.normal(0, SPEED, (particles, 2))
    place = np.column_stack(np.divmod(np.arange(particles), side)) * (size / side)
    world.add(position=place, velocity=velocity - velocity.mean(axis=0), radius=RADIUS)
    return world


def kept(particles: int, seconds: float, fraction: float, within: float = 1e-4) -> Result:
    """Every impact keeps the energy, the sum of m v^2 / 2, and the momentum, that of m v: across the seam, too."""
    world = gas(particles, fraction)
    start, energy, momentum = world.energy().total, 0.0, 0.0
    scale = float((world.mass * np.hypot(*world.velocity.T)).sum())
    for _ in frames(world, seconds):
        energy = max(energy, abs(world.energy().total / start - 1))
        momentum = max(momentum, float(np.hypot(*world.momentum())) / scale)
    return Result(
        f"{particles:,} elastic circles in a periodic room, area fraction {fraction:g}, {seconds:g} s: energy within {within:g}, "
        "momentum within 1e-6 of the sum of m |v|",
        f"{energy:.1e}, {momentum:.0e}",
        energy <= within and momentum <= 1e-6,
        {"energy": energy, "momentum": momentum},
    )


def pressure(particles: int, seconds: float, fraction: float, within: float = 0.02) -> Result:
    """P A / (N k T), k T = m <v^2> / 2, by the virial of the impacts, is (1 + f^2 / 8) / (1 - f)^2 (Henderson 1975)."""
    world, total, count = gas(particles, fraction, contacts=True), 0.0, round(seconds / FRAME_S)
    for frame in range(-count // 8, count):
        world.step(FRAME_S)
        if frame >= 0:
            total += world.pressure() / world.energy().kinetic
    found = total / count * float(np.prod(world.boundary.seam.period))
    theory = henderson(fraction)
    return Result(
        f"{particles:,} elastic circles in a periodic room: P A / N k T at area fraction {fraction:g} within {100 * within:g} %",
        f"{found:.3f}, Henderson {theory:.3f}",
        abs(found / theory - 1) <= within,
        {"measured": found, "theory": theory},
    )
