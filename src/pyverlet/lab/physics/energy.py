"""Energy never rises: with e <= 1 and without drive the total energy of a world does not increase."""

from collections.abc import Callable
from functools import partial

import numpy as np

from pyverlet import scenes
from pyverlet.lab.physics._check import RADIUS, G, Result, circles, directions, fastest, frames, in_disc
from pyverlet.laws.boundaries import Box, Circle
from pyverlet.laws.forces import Conservative, PointSpring
from pyverlet.laws.links import Motor
from pyverlet.laws.textbook import TextbookBoundary
from pyverlet.world.world import World

MOST = 1e-4  # relative rise per frame

RISE, PARTING_S = 2.5, 1.0  # radii, s: see `to_part`

SUBSTEPS = (1, 2, 4, 8, 16)

Build = Callable[..., World]  # called with substeps=n


def scale(world: World, seconds: float) -> float:
    """Energy scale of a world, J: its kinetic energy now, plus that of a fall through its room, m g H.

    Without gravity it is kinetic energy plus that of forces and links; if circles start inside each other, g is 9.81 m/s^2
    nevertheless, as at rest the scale would be 0. Without walls H is the depth of a fall over the whole time, g t^2 / 2.
    """
    now = world.energy()
    if not any(world.gravity) and not world.overlap().contacts:
        return now.kinetic + abs(now.potential) + abs(now.links)
    mass = float(world.mass[np.isfinite(world.mass)].sum(dtype=float))
    gx, gy = world.gravity if any(world.gravity) else (0.0, G)
    extent = world.boundary.extent()
    if extent is None:
        fall = 0.5 * (gx * gx + gy * gy) * seconds**2
    else:
        fall = abs(gx) * (extent[2] - extent[0]) + abs(gy) * (extent[3] - extent[1])
    return now.kinetic + mass * fall


def to_part(world: World) -> float:
    """Most energy, J, that circles which start inside each other may gain: one that overlaps k others by more than a tenth may
    rise to the top of all, and by 2.5 radii sqrt(k).

    In a frame of dt they may gain the part 1 - exp(-dt / 1 s) of what is left.
    """
    position, radius, free = world.position.astype(float), world.radius.astype(float), np.isfinite(world.mass)
    apart = np.hypot(*(position[:, None] - position).transpose(2, 0, 1)) / (radius[:, None] + radius)
    overlapped, fallen = (apart < 0.9).sum(axis=1) - 1, position @ world.gravity
    lift = fallen - fallen.min() + np.hypot(*world.gravity) * RISE * radius * np.sqrt(overlapped)
    return float(world.mass[free] @ np.where(overlapped > 0, lift, 0.0)[free])


def worst_rise(world: World, seconds: float) -> tuple[float, float, float]:
    """(largest relative rise in one frame, beyond the separation of initial overlaps, largest relative rise above the start, top
    speed in m/s).
    """
    size, before, left = scale(world, seconds), world.energy().total, to_part(world)
    start, worst, above, speed, since = before, 0.0, 0.0, 0.0, world.time
    for _ in frames(world, seconds):
        now, dt = world.energy().total, world.time - since
        parts = left * -np.expm1(-dt / PARTING_S)
        worst, above = max(worst, (now - before - parts) / size), max(above, (now - start) / size)
        speed, before, left, since = max(speed, fastest(world)), now, left - parts, world.time
    return worst, above, speed


def undriven_scenes() -> dict[str, Build]:
    """The scenes without drive: symplectic integrator, forces with a potential, no textbook walls, no moving obstacles."""
    found: dict[str, Build] = {}
    for name, scene in scenes.SCENES.items():
        world = scene.world(particles=min(scene.defaults.particles, 46))  # a car has at least so many
        turns = isinstance(world.boundary, Circle) and world.boundary.angular_velocity != 0.0
        driven = turns or any(obstacle.moves or obstacle.surface_speed for obstacle in world.obstacles)
        driven |= bool(world.actors) or any(isinstance(link, Motor) for link in world.links)
        honest = not isinstance(world.boundary, TextbookBoundary) and world.integrator.symplectic
        if honest and not driven and all(isinstance(force, Conservative) for force in world.forces):
            found[name] = partial(scene.world, particles=min(scene.defaults.particles, 400))
    return found


def elastic_gas(substeps: int, particles: int = 300) -> World:
    """Elastic circles under gravity in a box."""
    velocity = np.random.default_rng(0).normal(0, 5, (particles, 2))
    boundary = Box((-20, -20), (20, 20), restitution=1.0)
    return circles(in_disc(particles, 15, 1.5), boundary, velocity=velocity, e=1.0, substeps=substeps)


def drawn_gas(substeps: int, particles: int = 200) -> World:
    """Circles without gravity that a spring attracts to a point, where they collect."""
    velocity = np.random.default_rng(0).normal(0, 1, (particles, 2))
    world = circles(in_disc(particles, 15, 1.5), Circle(radius=20), velocity=velocity, gravity=(0, 0), substeps=substeps)
    world.forces.append(PointSpring(stiffness=2.0))
    return world


def overlapped(substeps: int, *, gravity: float, restitution: float, friction: float = 0.0, particles: int = 300) -> World:
    """Circles at random places in a cage, covering 60 % of it, so that half of them start deep inside another."""
    rng = np.random.default_rng(4)
    size = RADIUS * np.sqrt(particles / 0.6)
    angle, out = rng.uniform(0, 2 * np.pi, particles), (size - RADIUS) * np.sqrt(rng.uniform(0, 1, particles))
    boundary = Circle(radius=size, restitution=restitution, friction=friction)
    return circles(
        out[:, None] * directions(angle), boundary, e=restitution, mu=friction, gravity=(0, -gravity), substeps=substeps
    )


def coincident(substeps: int, *, gravity: float, restitution: float = 0.0, particles: int = 100) -> World:
    """All circles at one point of a cage."""
    boundary = Circle(radius=20, restitution=restitution)
    return circles(np.zeros((particles, 2)), boundary, e=restitution, gravity=(0, -gravity), substeps=substeps)


def never_rises(worlds: dict[str, Build], seconds: float, counts: tuple[int, ...] = SUBSTEPS) -> Result:
    """The total energy rises by at most 1e-4 of its scale per frame, beyond the separation of initial overlaps."""
    runs = [(name, build, count) for name, build in worlds.items() for count in counts]
    found = [(*worst_rise(build(substeps=count), seconds), f"{name}, {count} substeps") for name, build, count in runs]
    worst, _, _, where = max(found)
    failing = sum(row[0] > MOST for row in found)
    above, speed = max(row[1] for row in found), max(row[2] for row in found)
    return Result(
        f"total energy rises by <= {MOST:g} of its scale in any frame, and what parts circles: {', '.join(worlds)}; "
        f"{min(counts)} to {max(counts)} substeps",
        f"worst {worst:.1e} ({where}); {failing} of {len(found)} runs fail; {above:.1e} above the start, {speed:.0f} m/s",
        worst <= MOST,
        {"rise": worst, "above_start": above, "top_speed": speed, "failing": failing},
    )


def in_scenes(seconds: float, counts: tuple[int, ...] = SUBSTEPS) -> Result:
    """Energy in the scenes: as they are, inelastic, bouncing and with friction."""
    worlds: dict[str, Build] = {}
    for name, build in undriven_scenes().items():
        worlds[name] = build
        if scenes.get(name).defaults.collisions is not None:
            worlds[f"{name} e 0.5 mu 0.5"] = partial(build, restitution=0.5, friction=0.5)
            worlds[f"{name} e 1"] = partial(build, restitution=1.0)
    return never_rises(worlds, seconds, counts)


# Elastic circles under gravity, and attracted by a spring; worlds that start overlapping, or at one point.
GASES: dict[str, Build] = {"elastic gas under gravity": elastic_gas, "drawn by a spring": drawn_gas}
OVERLAPPED: dict[str, Build] = {
    "random": partial(overlapped, gravity=G, restitution=0.0),
    "random e 0.5 mu 0.5": partial(overlapped, gravity=G, restitution=0.5, friction=0.5),
    "random e 1": partial(overlapped, gravity=G, restitution=1.0),
    "random g 0": partial(overlapped, gravity=0.0, restitution=0.0),
}
COINCIDENT: dict[str, Build] = {
    "coincident": partial(coincident, gravity=G),
    "coincident g 0": partial(coincident, gravity=0.0),
    "coincident e 1": partial(coincident, gravity=G, restitution=1.0),
}
