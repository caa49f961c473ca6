"""Rest: piles settle, also of unequal circles, carry their weight with little overlap, and stay at rest."""

from itertools import pairwise

import numpy as np

from pyverlet import scenes
from pyverlet.common.arrays import Array
from pyverlet.lab.physics._check import DT, RADIUS, G, Result, agitation, columns, frames
from pyverlet.laws.boundaries import Box
from pyverlet.laws.collisions import Collisions
from pyverlet.world.world import World

STILL = 1e-4  # kinetic energy per particle over m g R

MEAN_OVERLAP = 0.003
MOST_OVERLAP = 0.05  # over the contact distance


def cage(particles: int, seconds: float) -> Result:
    """The scene `cage` comes to rest: kinetic energy below 1e-4 m g R, small overlap.

    Apart from the pendulum motion of the whole: nothing stops a smooth pile in a smooth round room. Its amplitude, up to 4e-3 m g
    R, is random.
    """
    world = scenes.get("cage").world(particles=particles, substeps=8)
    world.run(seconds=seconds)
    swings, overlap, escaped = swinging(world), world.overlap(), world.escaped()
    moving = agitation(world) - swings
    return Result(
        f"cage of {particles:,} after {seconds:g} s: kinetic energy apart from the swing of the whole < {STILL:g} m g R, overlap "
        f"mean <= {MEAN_OVERLAP:.1%}, max <= {MOST_OVERLAP:.0%}",
        f"{moving:.1e}, the swing {swings:.1e}, mean {overlap.mean:.2%}, max {overlap.max:.1%}, {escaped} escaped",
        moving < STILL and overlap.mean <= MEAN_OVERLAP and overlap.max <= MOST_OVERLAP and not escaped,
        {"kinetic": moving, "swing": swings, "overlap_mean": overlap.mean, "overlap_max": overlap.max, "escaped": escaped},
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
    """A column in a slot one diameter wide carries its weight: the lowest contact holds (n - 1) m g.

    Released without any overlap it oscillates, as a spring of its own weight would. Contacts damp relative motion of neighbours,
    which is small in a wave as long as the column: of 100, the energy falls by a factor e in 7 s.
    """
    world = World(boundary=Box((0, 0), (2 * RADIUS, 4 * RADIUS * particles)))
    height = RADIUS + 2 * RADIUS * np.arange(particles)
    circles = world.add(position=np.column_stack((np.full(particles, RADIUS), height)), radius=RADIUS)
    lowest, floor, order = 0.0, 0.0, True
    for frame in frames(world, seconds):
        y = circles.position[:, 1].astype(float)
        order &= bool((np.diff(y) > 0).all())
        if frame * 2 > seconds * 60:  # the first half is for settling
            lowest = max(lowest, float(1 - (y[1] - y[0]) / (2 * RADIUS)))
            floor = max(floor, float(1 - y[0] / RADIUS))
    moving = agitation(world)
    return Result(
        f"a column of {particles} in a slot stands for {seconds:g} s, its bottom overlap <= {most:.0%}, "
        f"kinetic energy then < {STILL:g} m g R",
        f"{'stands' if order else 'fell over'}, lowest pair {lowest:.1%}, into the floor {floor:.1%}, {moving:.1e}",
        order and max(lowest, floor) <= most and moving < STILL,
        {"overlap_bottom": lowest, "overlap_floor": floor, "kinetic": moving},
    )


def swing(start: Array, now: Array) -> float:
    """Angle in rad by which points have rotated about the origin, by least squares."""
    return float(np.arctan2((start[:, 0] * now[:, 1] - start[:, 1] * now[:, 0]).sum(), (start * now).sum()))


def turned_back(points: Array, angle: float) -> Array:
    """(n, 2) points rotated about the origin by -angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[c, -s], [s, c]]))


def swinging(world: World) -> float:
    """Kinetic energy over m g R of the rotation about the origin: L^2 / 2 I, with the angular momentum L and the inertia I."""
    x, v, m = world.position.astype(float), world.velocity.astype(float), world.mass.astype(float)
    momentum = float((m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])).sum())
    return momentum**2 / (2 * float(m @ (x * x).sum(axis=1))) / float((m * G * world.radius).sum())


def left_alone(particles: int, seconds: float, friction: float, creep: float = 0.1, turn: float = 0.1) -> Result:
    """A pile left alone neither creeps, boils nor spins.

    Without friction a pile in a round cage may swing as a whole, like a pendulum, about the centre of the cage. That is not
    creep, so creep and kinetic energy are measured in the rotating frame; and as the swing rearranges single circles now and
    then, the mean of the kinetic energy is used, not its maximum.

    With friction the circles may turn by `turn` per minute. In float32 a position of 14 m is rounded by up to 5e-7 m in each
    substep, 480 times a second: to friction that is a speed of 2e-4 m/s, which causes a spin of about 5e-4 rad/s; in float64 it
    does not. A circle that lies loose at the bottom of the cage rolls to and fro without damping, by 0.06 rad in one pile. So
    less than a minute is too short to distinguish a turn from an oscillation.
    """
    world = scenes.get("cage").world(particles=particles, friction=friction)
    world.run(seconds=30)
    swings = friction == 0
    start, kinetic, angle, turned = world.position.astype(float), [], [0.0], np.zeros(particles)
    for _ in frames(world, seconds):
        kinetic.append(agitation(world) - (swinging(world) if swings else 0.0))
        angle.append(swing(start, world.position.astype(float)) if swings else 0.0)
        turned += world.spin / 60
    moved = np.hypot(*(turned_back(world.position.astype(float), angle[-1]) - start).T) / RADIUS
    mean, most = float(np.mean(kinetic)), max(kinetic)
    moving = mean if swings else most
    apart = "apart from the swing of the whole, " if swings else ""
    return Result(
        f"a pile of {particles}, friction {friction:g}, left alone for {seconds:g} s after 30: {apart}no circle moves by "
        f"{creep:g} R or turns by {turn:g} rad a minute, kinetic energy {'on average' if swings else 'always'} < {STILL:g} m g R",
        f"moved {moved.max():.2g} R (median {np.median(moved):.2g}), turned {np.abs(turned).max():.2g} rad, mean {mean:.1e}, "
        f"worst {most:.1e}" + (f", swing {np.ptp(angle):.2g} rad" if swings else ""),
        bool(moved.max() < creep and np.abs(turned).max() < turn * seconds / 60 and moving < STILL),
        {
            "moved": float(moved.max()), "turned": float(np.abs(turned).max()), "kinetic": moving, "kinetic_worst": most,
            "swing": float(np.ptp(angle)),
        },
    )  # fmt: skip


MOST_OVERLAP_UNEQUAL = 0.10  # over the contact distance, in a pile of unequal circles


def pile(
    particles: int,
    seconds: float,
    radius_ratio: float,
    mass_ratio: float,
    independent: bool = False,
    seed: int = 1,
    most: float = MOST_OVERLAP_UNEQUAL,
) -> Result:
    """Unequal circles settle in one pile: radii and masses are uniform in their logarithm.

    The larger is the heavier, unless they are drawn independently: then small heavy ones lie on large light ones. most: overlap
    over the contact distance. A circle caught under another of a thousand times its mass is pressed in by its load.
    """
    rng = np.random.default_rng(seed)
    size = rng.uniform(0, 1, particles)
    size[:2] = 0, 1  # include both extremes
    radius = RADIUS * radius_ratio ** (size - 1)
    mass = mass_ratio ** (rng.permutation(size) if independent else size)
    width = np.sqrt(2 * np.pi * float(radius @ radius))
    # Shaken: circles exactly above each other cannot pass, and a column of them is not a pile.
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

    With friction the bed carries it after it has dug itself in: it comes to rest above the lowest third. Without, the bed is a
    liquid of about 0.85 of its density, and it may sink to the floor (Archimedes); but not into the floor, nor into the circles:
    at most `most` of overlap at the end, `crushed` while a small one is caught between it and the floor.
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
