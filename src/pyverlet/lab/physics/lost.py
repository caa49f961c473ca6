"""Completeness: coincident circles separate, no contact is missed, nothing leaves a closed room or passes through another."""

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.lab.physics._check import DT, RADIUS, Result, circles, directions, fastest, frames
from pyverlet.laws.boundaries import Boundary, Box, Circle
from pyverlet.laws.collisions import Collisions
from pyverlet.world.world import World

SPEEDS = (1, 3, 10, 30, 100, 300, 1000, 3000, 10_000)  # radii per substep


def coincident(particles: int = 300, seconds: float = 10) -> Result:
    """Circles at one point separate, without 0 / 0."""
    world = circles(np.zeros((particles, 2)), Circle(radius=30))
    speed, finite = 0.0, True
    for _ in frames(world, seconds):
        speed = max(speed, fastest(world))
        finite &= bool(np.isfinite(world.position).all() and np.isfinite(world.velocity).all())
    overlap, escaped = world.overlap().max, world.escaped()
    return Result(
        f"{particles} coincident circles separate: finite, none escaped, max overlap <= 5 % after {seconds:g} s",
        f"{'finite' if finite else 'non-finite'}, {escaped} escaped, max overlap {overlap:.1%}, top speed {speed:.1f} m/s",
        finite and not escaped and overlap <= 0.05,
        {"overlap_max": overlap, "escaped": escaped, "top_speed": speed},
    )


def contacts_by_hand(position: Array, radius: Array) -> int:
    """Overlapping pairs, counted by brute force."""
    x, r = position.astype(float), radius.astype(float)
    distance = np.hypot(*(x[:, None] - x[None, :]).transpose(2, 0, 1))
    return int(np.count_nonzero(np.triu(distance < r[:, None] + r[None, :], k=1)))


def crowded(particles: int = 1500) -> Result:
    """One big circle full of small ones, all in a few cells: every contact is found, as by brute force."""
    rng = np.random.default_rng(6)
    world = World(boundary=Box((-6, -6), (6, 6)))
    world.add(position=(0, 0), radius=5.0, mass=1000.0)
    angle, out = rng.uniform(0, 2 * np.pi, particles), 5 * np.sqrt(rng.uniform(0, 1, particles))
    world.add(position=out[:, None] * directions(angle), radius=0.05, mass=0.1)
    wrong, most = 0, 0
    for frame in range(31):
        if frame % 10 == 0:
            by_hand = contacts_by_hand(world.position, world.radius)
            wrong += abs(world.overlap().contacts - by_hand)
            most = max(most, by_hand)
        world.step(DT)
    return Result(
        f"a circle with {particles:,} small ones inside it: no contact is dropped beside brute force",
        f"{wrong} dropped of {most:,}",
        wrong == 0,
        {"dropped": wrong, "contacts": most},
    )


def _leaves(boundary: Boundary, radii_a_substep: float) -> bool:
    """Whether one of a dozen fast circles, thrown in all directions from irregular places, is ever outside after a frame."""
    substeps, radius = 8, 0.1
    speed = radii_a_substep * radius * substeps / DT
    way = directions(np.linspace(0.1, 2 * np.pi, 12))
    world = World(boundary=boundary, collisions=None, substeps=substeps)
    world.add(position=np.roll(way, 5, axis=0) * np.linspace(0.2, 4.6, 12)[:, None], velocity=speed * way, radius=radius)
    return any(world.escaped() for _ in frames(world, 1.0))


def leaves_no_room(least: float = 100) -> Result:
    """Nothing leaves a closed room at any speed: the wall acts at the position of the circle, not at that before."""
    holds = np.inf
    for e in (0.0, 0.5, 1.0):
        for boundary in (Box((-5, -5), (5, 5), restitution=e), Circle(radius=5, restitution=e)):
            slow = [speed for speed in SPEEDS if not _leaves(boundary, speed)]
            first_bad = min((speed for speed in SPEEDS if speed not in slow), default=np.inf)
            holds = min(holds, max((speed for speed in slow if speed < first_bad), default=0))
    return Result(
        f"nothing leaves a box or a cage at {least:g} radii a substep, e 0, 0.5, 1",
        f"holds at {holds:,.0f} radii a substep" + (" (the fastest tried)" if holds == SPEEDS[-1] else ""),
        holds >= least,
        {"radii_a_substep": holds},
    )


def _pass_through(steps: float, e: float) -> float:
    """Fraction of head-on pairs that pass through each other, at a relative speed of `steps` (r_i + r_j) / h."""
    tries, substeps = 200, 8
    speed = steps * 2 * RADIUS * substeps / DT
    world = World(gravity=(0, 0), collisions=Collisions(restitution=e), substeps=substeps, dtype=np.float64)
    lane = 3 * RADIUS * np.arange(tries)
    # They meet in the middle of the frame, at every phase of a substep.
    apart = 2 * RADIUS + speed * DT * (0.4 + np.linspace(0, 1, tries, endpoint=False) / substeps)
    left = world.add(position=np.column_stack((-apart / 2, lane)), velocity=(speed / 2, 0), radius=RADIUS)
    right = world.add(position=np.column_stack((apart / 2, lane)), velocity=(-speed / 2, 0), radius=RADIUS)
    world.step(DT)
    return float((left.position[:, 0] >= right.position[:, 0]).mean())


def passing(least: float = 8.0) -> Result:
    """Two circles that meet head-on do not pass through each other, at up to eight times a relative speed of (r_i + r_j) / h."""
    tried = (0.1, 0.5, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0, 3.0, 4.0, 8.0)
    holds = np.inf
    for e in (0.0, 0.5, 1.0):
        shares = [_pass_through(steps, e) for steps in tried]
        bad = next((k for k, share in enumerate(shares) if share > 0), len(tried))
        holds = min(holds, tried[bad - 1] if bad else 0.0)
    speed = holds * 2 * RADIUS * 8 / DT
    return Result(
        f"head-on circles do not pass through each other at {least:g} (r_i + r_j) / h, e 0, 0.5, 1",
        f"holds at {holds:g} (r_i + r_j) / h: {speed:.0f} m/s for a diameter of 1 m at 8 substeps",
        holds >= least,
        {"steps": holds},
    )
