"""Friction and spin: Coulomb's law on a disc with I = m r^2 / 2."""

from __future__ import annotations

import itertools

import numpy as np

from pyverlet import scenes
from pyverlet.bounds import Box
from pyverlet.collisions import Collisions
from pyverlet.lab.physics._check import Result
from pyverlet.lab.physics._worlds import RADIUS, G, frames
from pyverlet.world import World


def sliding_disc(within: float = 0.001) -> Result:
    """A disc set sliding at v0 ends rolling at 2/3 v0, since m v r + I w about the point of contact is kept."""
    v0 = 5.0
    world = World(boundary=Box((0, 0), (1000, 10), friction=0.3), collisions=None)
    disc = world.add(position=(1, RADIUS), velocity=(v0, 0), radius=RADIUS)
    world.run(seconds=3)  # it slides for v0 / (3 mu g) = 0.57 s
    speed, rim = float(disc.velocity[0, 0]), -float(disc.spin[0]) * RADIUS
    error = max(abs(speed / v0 - 2 / 3), abs(rim / v0 - 2 / 3))
    return Result(
        f"a disc set sliding at v0 ends rolling at 2/3 v0 within {within:.1%}",
        f"{speed / v0:.5f} v0, rim {rim / v0:.5f} v0",
        error <= within,
        {"speed": speed / v0, "rim": rim / v0},
    )


def slope(mu: float = 0.3, seconds: float = 2.0, within: float = 0.01) -> Result:
    """A disc on a slope rolls with g sin(a) / 1.5 while tan(a) <= 3 mu, and slides with g (sin a - mu cos a) beyond."""
    angles = (5, 10, 20, 30, 40, 41, 43, 45, 60, 80)
    worst, at = 0.0, 0
    for degrees in angles:
        a = np.radians(degrees)
        world = World(
            gravity=(G * np.sin(a), -G * np.cos(a)),
            boundary=Box((0, 0), (1000, 9), friction=mu),
            collisions=None,
            dtype=np.float64,
        )
        disc = world.add(position=(1, RADIUS), radius=RADIUS)
        world.run(seconds=seconds)
        rolls = np.tan(a) <= 3 * mu
        along = G * np.sin(a) / 1.5 if rolls else G * (np.sin(a) - mu * np.cos(a))
        turning = along if rolls else 2 * mu * G * np.cos(a)  # of the rim: m mu g cos(a) r / I r
        errors = (abs(disc.velocity[0, 0] / (along * seconds) - 1), abs(-disc.spin[0] * RADIUS / (turning * seconds) - 1))
        worst, at = max((worst, at), (float(max(errors)), degrees))
    return Result(
        f"a disc on a slope rolls with g sin(a) / 1.5 while tan(a) <= 3 mu, slides beyond: within {within:.0%}, 5 to 80 degrees",
        f"worst {worst:.1e} at {at} degrees (the limit is at {np.degrees(np.arctan(3 * mu)):.1f})",
        worst <= within,
        {"error": worst},
    )


def heap_angle(mu: float, particles: int, seed: int = 0) -> float:
    """Angle of repose in degrees of a heap poured on a floor of pinned circles: the slope of its free surface.

    Radii vary by 1:1.5, so that the heap does not crystallise. A few circles at a time are let go above the top.
    """
    rng = np.random.default_rng(seed)
    small, half = 0.1, 0.1 * particles * 0.028 + 4
    world = World(boundary=Box((-half, -1), (half, 40), friction=mu), collisions=Collisions(friction=mu))
    floor = np.arange(-half + small, half, 2 * small)
    world.add(position=np.column_stack((floor, np.zeros(len(floor)))), radius=small, mass=np.inf)
    top, poured = small, 0
    while poured < particles:
        x = np.array([-0.5, 0.0, 0.5]) + rng.uniform(-0.1, 0.1, 3)
        world.add(position=np.column_stack((x, np.full(3, top + 0.5))), velocity=(0, -1), radius=small * rng.uniform(0.8, 1.2, 3))
        poured += 3
        world.run(seconds=0.1)
        heap = world.position[len(floor) :]
        settled = np.abs(world.velocity[len(floor) :, 1]) < 0.5
        top = max(float(heap[settled, 1].max(initial=small)), small)
    world.run(seconds=4)
    return surface_angle(world.position[len(floor) :].astype(float), 4 * small)


def surface_angle(heap: np.ndarray[tuple[int, int], np.dtype[np.float64]], width: float) -> float:
    """Degrees: mean slope of straight lines through the highest circles of slices of `width` (m), left and right of the middle.

    The top and the foot of a heap are rounded: only slices between 0.15 and 0.8 of its height count, and all of it if none is.
    """
    middle = float(np.median(heap[:, 0]))
    slices = np.floor((heap[:, 0] - middle) / width).astype(int)
    which = np.unique(slices)
    x = (which + 0.5) * width
    y = np.array([heap[slices == k, 1].max() for k in which])
    low, high = y.min(), y.max()
    counts = (y > low + 0.15 * (high - low)) & (y < low + 0.8 * (high - low))
    slopes = []
    for side in (x < 0, x > 0):
        chosen = side & counts
        if chosen.sum() < 3:
            chosen = side
        slopes.append(abs(np.polyfit(x[chosen], y[chosen], 1)[0]))
    return float(np.degrees(np.arctan(np.mean(slopes))))


def repose(particles: int, frictions: tuple[float, ...] = (0.0, 0.2, 0.5, 0.8)) -> Result:
    """The angle of repose of a poured heap grows with friction."""
    angles = [float(np.mean([heap_angle(mu, particles, seed) for seed in (0, 1)])) for mu in frictions]
    grows = all(b > a for a, b in itertools.pairwise(angles))
    return Result(
        f"the angle of repose of {particles} circles poured on a rough floor grows with friction: {frictions}",
        ", ".join(f"mu {mu:g}: {angle:.1f}" for mu, angle in zip(frictions, angles, strict=True)) + " degrees",
        grows,
        {f"angle_{mu:g}": angle for mu, angle in zip(frictions, angles, strict=True)},
    )


def free_spin(particles: int = 300, seconds: float = 3.0) -> Result:
    """Without friction no contact has a torque about a centre: spins keep every bit."""
    changed = 0
    for restitution in (0.0, 0.8):
        world = scenes.get("cage").world(particles=particles, restitution=restitution)
        spin = np.random.default_rng(0).normal(0, 5, particles).astype(world.dtype)
        world.spin[:] = spin
        for _ in frames(world, seconds):
            pass
        changed += int((world.spin != spin).sum())
    return Result("spin is free without friction: no bit of it changes in a pile", f"{changed} spins changed", changed == 0)
