"""Gas: elastic circles conserve energy and, in a cage without gravity, angular momentum; their speeds become Maxwellian.

In a periodic room they conserve momentum, and their pressure follows an equation of state.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.lab.physics._check import RADIUS, Result, circles, directions, frames, in_disc
from pyverlet.laws.boundaries import Box, Circle, Periodic
from pyverlet.scenes.gas import henderson
from pyverlet.world.world import World

AREA_FRACTION = 0.3
SPEED = 5.0  # initial m/s. The mean free path is about 1 m, so each circle collides with five others per second


@dataclass(frozen=True)
class Kept:
    """Changes of a gas since its start."""

    energy: float  # largest relative change in any frame
    turning: float  # largest change of the angular momentum about the centre, over its typical size
    before: NDArray[Any]  # (n,) speeds, m/s
    after: NDArray[Any]  # likewise


@lru_cache(maxsize=2)
def observe(particles: int, seconds: float) -> Kept:
    """Run a gas with equal speeds in random directions, far from Maxwell's distribution."""
    rng = np.random.default_rng(0)
    size = RADIUS * np.sqrt(particles / AREA_FRACTION)
    angle = rng.uniform(0, 2 * np.pi, particles)
    boundary = Circle(radius=size, restitution=1.0)
    world = circles(in_disc(particles, size, 1.5), boundary, velocity=SPEED * directions(angle), e=1.0, gravity=(0, 0))
    before = np.hypot(*world.velocity.T)
    # L is a sum of n terms of either sign and may start near 0, so changes relative to L itself are meaningless. The scale is its
    # standard deviation over random directions, sqrt(sum (m |x| |v|)^2 / 2), the typical L of such a gas.
    scale = float(np.sqrt(0.5 * ((np.hypot(*world.position.T) * before) ** 2).sum()))
    energy, turning = world.energy().total, world.angular_momentum()
    worst_energy = worst_turning = 0.0
    for _ in frames(world, seconds):
        worst_energy = max(worst_energy, abs(world.energy().total / energy - 1))
        worst_turning = max(worst_turning, abs(world.angular_momentum() - turning) / scale)
    return Kept(worst_energy, worst_turning, before, np.hypot(*world.velocity.T))


def kolmogorov_smirnov(speed: NDArray[Any], mean_square: float) -> tuple[float, float]:
    """(D, p) of the hypothesis that these speeds follow the Maxwell-Boltzmann distribution in two dimensions.

    Its distribution function is 1 - exp(-v^2 / <v^2>) (Rayleigh). <v^2> follows from the energy, without a fit. p is Kolmogorov's
    asymptotic series, accurate to 1 % from 100 samples on. The samples are the circles at one instant, each counted once.
    """
    n = len(speed)
    law = 1 - np.exp(-(np.sort(speed.astype(float)) ** 2) / mean_square)
    steps = np.arange(n + 1) / n
    distance = float(max((steps[1:] - law).max(), (law - steps[:-1]).max()))
    k = np.arange(1, 101)
    p = 2 * float(((-1.0) ** (k - 1) * np.exp(-2 * (k * distance) ** 2 * n)).sum())
    return distance, min(max(p, 0.0), 1.0)


def _such(particles: int, seconds: float) -> str:
    return f"{particles:,} elastic circles, area fraction {AREA_FRACTION:g}, {seconds:g} s"


def falling(particles: int, seconds: float) -> Result:
    """Elastic circles falling in a box with an elastic floor conserve m v^2 / 2 + m g y, also where they hit resting ones.

    Relative to the energy above the floor. Bounces slower than 4 g h end, each at a loss of m (4 g h)^2 / 2.
    """
    side, rng = RADIUS * np.sqrt(4 * np.pi * particles), np.random.default_rng(0)
    column = int(side / (2.4 * RADIUS))
    k = np.arange(particles)
    place = 2.4 * RADIUS * np.column_stack((k % column + 0.6, k // column + 2.0))
    boundary = Box((0, 0), (side, 2 * side), restitution=1.0)
    world = circles(place, boundary, velocity=rng.normal(0, 1, (particles, 2)), e=1.0)
    start, above = world.energy().total, float((world.mass * 9.81 * (world.position[:, 1] - RADIUS)).sum())
    worst = max(abs(world.energy().total - start) for _ in frames(world, seconds)) / (world.energy().kinetic + above)
    return Result(
        f"{particles} elastic circles under gravity: energy within 1e-3 of that above the floor",
        f"{worst:.1e} in {seconds:g} s",
        bool(worst <= 1e-3),
        {"worst": worst},
    )


def energy(particles: int, seconds: float, within: float = 1e-4) -> Result:
    """An elastic gas conserves the sum of m v^2 / 2."""
    found = observe(particles, seconds).energy
    asked = f"{_such(particles, seconds)}: energy within {within:g}"
    return Result(asked, f"{found:.1e}", found <= within, {"error": found})


def angular_momentum(particles: int, seconds: float, within: float = 1e-4) -> Result:
    """An elastic gas in a smooth round cage conserves L = sum m x cross v about the centre: every impulse is central."""
    found = observe(particles, seconds).turning
    asked = f"{_such(particles, seconds)}: angular momentum within {within:g} of what such a gas has"
    return Result(asked, f"{found:.1e}", found <= within, {"error": found})


def speeds(particles: int, seconds: float, least: float = 0.01) -> Result:
    """Equal speeds become Maxwell-Boltzmann's: a fraction 1 - exp(-v^2 / <v^2>) is below v."""
    gas = observe(particles, seconds)
    mean_square = float((gas.before**2).mean())
    start, _ = kolmogorov_smirnov(gas.before, mean_square)
    distance, p = kolmogorov_smirnov(gas.after, mean_square)
    return Result(
        f"{_such(particles, seconds)}: speeds Maxwell-Boltzmann, Kolmogorov-Smirnov p >= {least:g}",
        f"p {p:.2f}, D {distance:.3f} (at the start D {start:.3f})",
        p >= least,
        {"p": p, "distance": distance, "distance_at_start": start},
    )


# ---- in a room without an end: energy and momentum are kept, and it presses as an equation of state says ----

PERIODIC_SPEED = 3.0  # standard deviation of each component of the velocities, m/s
PRESSURE_FRAME_S = 1 / 240  # of a frame in which pressure is measured: circles move by 0.02 radii per substep


def periodic_gas(particles: int, fraction: float, *, contacts: bool = False) -> World:
    """Elastic circles on a lattice, with total momentum 0."""
    rng, side = np.random.default_rng(1), int(np.ceil(np.sqrt(particles)))
    size = RADIUS * float(np.sqrt(np.pi * particles / fraction))
    boundary = Periodic((0, 0), (size, size))
    velocity = rng.normal(0, PERIODIC_SPEED, (particles, 2))
    place = np.column_stack(np.divmod(np.arange(particles), side)) * (size / side)
    return circles(place, boundary, velocity=velocity - velocity.mean(axis=0), e=1.0, gravity=(0, 0), contacts=contacts)


def periodic_kept(particles: int, seconds: float, fraction: float, within: float = 1e-4) -> Result:
    """Every impact conserves the energy, the sum of m v^2 / 2, and the momentum, that of m v, also across the boundary."""
    world = periodic_gas(particles, fraction)
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
    world, total, count = periodic_gas(particles, fraction, contacts=True), 0.0, round(seconds / PRESSURE_FRAME_S)
    for frame in range(-count // 8, count):
        world.step(PRESSURE_FRAME_S)
        if frame >= 0:
            total += world.pressure() / world.energy().kinetic
    found = total / count * float(np.prod(world.boundary.periodic.period))
    theory = henderson(fraction)
    return Result(
        f"{particles:,} elastic circles in a periodic room: P A / N k T at area fraction {fraction:g} within {100 * within:g} %",
        f"{found:.3f}, Henderson {theory:.3f}",
        abs(found / theory - 1) <= within,
        {"measured": found, "theory": theory},
    )
