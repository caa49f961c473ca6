"""Bounce, friction and spin of a disc with I = m r^2 / 2.

A dropped circle rises to e^2 of its drop, an elastic one conserves energy, and friction is Coulomb's.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import DTypeLike

from pyverlet import scenes
from pyverlet.lab.physics._check import DT, RADIUS, G, Result, frames
from pyverlet.laws.boundaries import Boundary, Box, Circle, Open
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import VelocityVerlet
from pyverlet.world.world import World

RESTITUTIONS = (0.0, 0.3, 0.5, 0.8, 0.95, 1.0)
DROPS = (0.5, 2.0, 10.0)  # metres

ROUNDING = 1e-4
"""Relative to the drop: smaller errors in float32 are rounding and need not decrease with more substeps. A position near 10 m is
rounded to 1e-6 m in each of some thousand substeps."""


def rebound_height(floor: str, e: float, drop: float, substeps: int, dtype: DTypeLike = np.float32) -> float:
    """Height in metres to which a circle dropped by `drop` (m) on a `floor` ("box", "cage" or "circle") rebounds.

    Computed from v^2 / 2 g at the first frame on the way up, since the apex is rarely at a frame.
    """
    boundaries: dict[str, Boundary] = {
        "box": Box((-20, 0), (20, 40), restitution=e),
        "cage": Circle(center=(0, 20), radius=20, restitution=e),
        "circle": Open(),
    }
    world = World(boundary=boundaries[floor], collisions=Collisions(restitution=e), substeps=substeps, dtype=dtype)
    rest = RADIUS
    if floor == "circle":
        world.add(position=(0, 0), radius=RADIUS, mass=np.inf)
        rest = 2 * RADIUS
    ball = world.add(position=(0, rest + drop), radius=RADIUS)
    for _ in range(round(2 * np.sqrt(2 * drop / G) / DT) + 2):
        before = float(ball.velocity[0, 1])
        world.step(DT)
        if before < 0 <= float(ball.velocity[0, 1]):
            break
    return float(ball.position[0, 1]) - rest + float(ball.velocity[0, 1]) ** 2 / (2 * G)


def worst_rebound(floor: str, substeps: int) -> tuple[float, float, float]:
    """(error over the drop, e, drop) of the worst rebound."""
    return max(
        (abs(rebound_height(floor, e, drop, substeps) - e * e * drop) / drop, e, drop) for e in RESTITUTIONS for drop in DROPS
    )


def rebound(floor: str, within: float = 0.01) -> Result:
    """The rebound is e^2 of the drop: v' = e v and H = v^2 / 2 g."""
    error, e, drop = worst_rebound(floor, 8)
    return Result(
        f"e^2 of the drop within {within:.0%}: e 0 to 1, drops 0.5 to 10 m, on {floor}, 8 substeps",
        f"worst {error:.2e} of the drop (e {e:g}, {drop:g} m)",
        error <= within,
        {"error": error},
    )


def rebound_substeps() -> Result:
    """The rebound's error decreases with more substeps, or is rounding."""
    counts = (1, 2, 4, 8, 16, 32)
    errors = [max(worst_rebound(floor, substeps)[0] for floor in ("box", "cage", "circle")) for substeps in counts]
    falls = all(after <= max(before, ROUNDING) for before, after in pairwise(errors))
    return Result(
        f"worst rebound improves with substeps, or is rounding (below {ROUNDING:g} of the drop)",
        ", ".join(f"{n}: {error:.1e}" for n, error in zip(counts, errors, strict=True)),
        falls,
        {f"error_{n}": error for n, error in zip(counts, errors, strict=True)},
    )


def ball_in_box(steps: int, within: float = 1e-9) -> Result:
    """An elastic ball in a box conserves m v^2 / 2 + m g y: second order is exact in flight, and so is a reflection in time."""
    world = World(
        boundary=Box((0, 0), (10, 10), restitution=1.0), integrator=VelocityVerlet(), collisions=None, substeps=10_000,
        dtype=np.float64,
    )  # fmt: skip
    world.add(position=(3, 7.1), velocity=(2.2, 1.1), radius=RADIUS)
    start, worst = world.energy().total, 0.0
    for _ in range(steps // world.substeps):
        world.step(world.substeps * DT / 8)
        worst = max(worst, abs(world.energy().total / start - 1))
    return Result(
        f"energy of one ball in a box for {steps:,} steps within {within:g}, float64, VelocityVerlet",
        f"{worst:.1e}",
        worst <= within,
        {"error": worst},
    )


def sliding_disc(within: float = 0.001) -> Result:
    """A disc that starts sliding at v0 ends rolling at 2/3 v0, since m v r + I w about the point of contact is conserved."""
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
            gravity=(G * np.sin(a), -G * np.cos(a)), boundary=Box((0, 0), (1000, 9), friction=mu), collisions=None,
            dtype=np.float64,
        )  # fmt: skip
        disc = world.add(position=(1, RADIUS), radius=RADIUS)
        world.run(seconds=seconds)
        rolls = np.tan(a) <= 3 * mu
        along = G * np.sin(a) / 1.5 if rolls else G * (np.sin(a) - mu * np.cos(a))
        turning = along if rolls else 2 * mu * G * np.cos(a)  # angular acceleration times r: m mu g cos(a) r / I r
        errors = (abs(disc.velocity[0, 0] / (along * seconds) - 1), abs(-disc.spin[0] * RADIUS / (turning * seconds) - 1))
        worst, at = max((worst, at), (float(max(errors)), degrees))
    return Result(
        f"a disc on a slope rolls with g sin(a) / 1.5 while tan(a) <= 3 mu, slides beyond: within {within:.0%}, 5 to 80 degrees",
        f"worst {worst:.1e} at {at} degrees (the limit is at {np.degrees(np.arctan(3 * mu)):.1f})",
        worst <= within,
        {"error": worst},
    )


def heap_angles(mu: float, heaps: int, particles: int) -> list[float]:
    """Angles of repose in degrees of heaps poured on plates of pinned circles, whose ends the rest falls off.

    Radii vary by 1:1.5, so that the heaps do not crystallise. A few circles at a time are released slightly above each top. The
    plates are far apart, so that the heaps are independent.
    """
    small, half, apart = 0.1, 4.0, 24.0
    middle = apart * np.arange(heaps)
    boundary = Box((-apart / 2, -8), (apart * (heaps - 0.5), 40), friction=mu)
    world = World(boundary=boundary, collisions=Collisions(friction=mu))
    x = np.add.outer(middle, np.arange(-half, half + small, 2 * small)).ravel()
    plates = len(world.add(position=np.column_stack((x, np.zeros(len(x)))), radius=small, mass=np.inf))
    chance = [np.random.default_rng(seed) for seed in range(heaps)]
    top = np.zeros(heaps)
    for _ in range(particles // 3):
        x = middle[:, None] + np.array([-0.5, 0.0, 0.5]) + [rng.uniform(-0.1, 0.1, 3) for rng in chance]
        start = np.stack((x, np.broadcast_to(top[:, None] + 0.5, x.shape)), axis=-1).reshape(-1, 2)
        radius = small * np.concatenate([rng.uniform(0.8, 1.2, 3) for rng in chance])
        world.add(position=start, velocity=(0, -1), radius=radius)
        world.run(seconds=0.1)
        held = np.abs(world.velocity[plates:, 1]) < 0.5
        height = np.where(held, world.position[plates:, 1], 0).reshape(-1, heaps, 3)
        top = np.maximum(height.max(axis=(0, 2)), 0)
    world.run(seconds=10)
    circles = world.position[plates:].astype(float).reshape(-1, heaps, 3, 2)
    angles = []
    for k in range(heaps):
        heap = circles[:, k].reshape(-1, 2) - (middle[k], 0)
        angles.append(surface_angle(heap[(heap[:, 1] > 0) & (np.abs(heap[:, 0]) < half)], half))
    return angles


def surface_angle(heap: np.ndarray[tuple[int, int], np.dtype[np.float64]], half: float, slices: int = 12) -> float:
    """Mean slope, in degrees, of straight lines through the highest circles of each slice, left and right of the middle.

    heap: (n, 2) centres on a plate from x = -half to half, m. The rounded top and the ends, a tenth of a side each, are excluded.
    """
    edges = np.linspace(0.1 * half, 0.9 * half, slices + 1)
    slopes = []
    for side in (-1, 1):
        x, y = side * heap[:, 0], heap[:, 1]
        highest = [np.flatnonzero((x >= a) & (x < b)) for a, b in pairwise(edges)]
        surface = np.array([members[y[members].argmax()] for members in highest if len(members)])
        slopes.append(-np.polyfit(x[surface], y[surface], 1)[0])
    return float(np.degrees(np.arctan(np.mean(slopes))))


def repose(heaps: int, particles: int = 450, frictions: tuple[float, ...] = (0.0, 0.2, 0.5, 0.8)) -> Result:
    """The angle of repose of a poured heap grows with friction; for discs free to roll it levels off beyond about mu = 0.5.

    Single heaps differ by a degree or two, so means with standard errors are compared.
    """
    angles = np.array([heap_angles(mu, heaps, particles) for mu in frictions])
    mean, error = angles.mean(axis=1), angles.std(axis=1, ddof=1) / np.sqrt(heaps)
    apart = np.hypot(error[1:], error[:-1])
    grows = bool((np.diff(mean)[:-1] > apart[:-1]).all() and np.diff(mean)[-1] > -2 * apart[-1])
    steps = " < ".join(f"{mu:g}" for mu in frictions[:-1])
    return Result(
        f"the angle of repose of {heaps} heaps of {particles} poured on a rough plate grows with mu: {steps}, by more "
        f"than the standard error, and is no lower at {frictions[-1]:g} by two",
        ", ".join(f"mu {mu:g}: {a:.1f} +- {s:.1f}" for mu, a, s in zip(frictions, mean, error, strict=True)) + " degrees",
        grows,
        {f"angle_{mu:g}": float(angle) for mu, angle in zip(frictions, mean, strict=True)},
    )


def free_spin(particles: int = 300, seconds: float = 3.0) -> Result:
    """Without friction no contact exerts a torque about a centre: spins keep every bit."""
    changed = 0
    for restitution in (0.0, 0.8):
        world = scenes.get("cage").world(particles=particles, restitution=restitution)
        spin = np.random.default_rng(0).normal(0, 5, particles).astype(world.dtype)
        world.spin[:] = spin
        for _ in frames(world, seconds):
            pass
        changed += int((world.spin != spin).sum())
    return Result("spin is free without friction: no bit of it changes in a pile", f"{changed} spins changed", changed == 0)
