"""Claims of articles about bouncing balls: balls released 3 m above the floor, one step per frame, in float64."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pyverlet.laws.boundaries import Boundary, Box
from pyverlet.laws.integrators import ExplicitEuler, Integrator, PositionVerlet, SemiImplicitEuler
from pyverlet.laws.textbook import ClampAndFlip, ProjectOnly
from pyverlet.scenes._scene import Scene, Settings, Variant
from pyverlet.world.clock import Clock
from pyverlet.world.world import World

RADIUS = 0.25  # of every ball, m
HEIGHT = 3.0  # initial height of the centres, m; a line is drawn there
SPACING = 3 * RADIUS  # between the centres of neighbours, m
LEAST_WIDTH, CEILING = 3.0, 8.0  # of the room, m, with space for balls that gain energy
GRAVITY = -2857 / 2**20 * 3600  # 9.8087 m/s^2: at 60 steps per second g h^2 is a multiple of 2^-20 m, without rounding
SPEED = 2.0  # standard deviation of each component of a random starting velocity, m/s
SLOW = 6  # frames of the fast screen per frame of the slow one: 60 and 10 per second at the default dt


def settings(integrator: Integrator, **changes: Any) -> Settings:
    """Settings of the articles' sketches: one ball, one step per frame, no collisions, walls with e = 1."""
    base = Settings(particles=1, substeps=1, collisions=None, restitution=1.0, dtype=np.float64, integrator=integrator)
    return dataclasses.replace(base, **changes)


def room(settings: Settings) -> Box:
    """A room wide enough for all balls side by side; the floor is at y = 0."""
    half = max(LEAST_WIDTH, SPACING * settings.particles) / 2
    return Box((-half, 0), (half, CEILING), **settings.surface)


def drop(settings: Settings, *, boundary: Boundary | None = None, velocity: Any = 0.0) -> World:
    """Balls in a row at the same height, by default with clamp-and-flip walls; velocity (n, 2) in m/s."""
    world = settings.empty_world(ClampAndFlip(room(settings)) if boundary is None else boundary)
    x = SPACING * (np.arange(settings.particles) - (settings.particles - 1) / 2)
    world.add(position=np.column_stack((x, np.full_like(x, HEIGHT))), velocity=velocity, radius=RADIUS, mass=1.0)
    return world


def euler(settings: Settings) -> World:
    """One ball bounces on the floor with e = 1 and climbs higher and higher.

    Articles say that explicit Euler gains energy. That is true: with position first, using the old velocity, it gains
    m g^2 h^2 / 2 in every step of free fall, for any motion of the ball; 0.8 J per second and kilogram at 60 steps per second.
    """
    return drop(settings)


def order(settings: Settings) -> World:
    """Left: position, then velocity (explicit Euler). Right: velocity, then position (semi-implicit Euler).

    Articles say that with the lines swapped the method loses energy instead. That is half true: explicit Euler gains, but
    semi-implicit Euler loses nothing in flight. It conserves v^2/2 + g y - (h/2) g v up to rounding; only the clamp-and-flip
    wall takes energy.
    """
    return drop(settings)


def rest(settings: Settings) -> World:
    """A ball released at rest returns to the same height after every bounce but the first.

    Articles say that the method conserves energy from rest. That is a coincidence: from rest all speeds are multiples of g h, the
    first clamp puts the heights above the wall on multiples of g h^2, and from then on a fall touches the wall exactly at the end
    of a step. One step later, at the largest possible depth, clamp-and-flip takes nothing. The gravity here makes all of this
    exact; with 9.81 rounding decides which bounce loses energy. See `bounce-random` for any other start.
    """
    return drop(settings)


def random(settings: Settings) -> World:
    """Balls thrown at random bounce lower and lower, although e = 1.

    Articles say that semi-implicit Euler loses energy. The method does not, but the wall does: a ball found at depth d below it
    with speed w, and then put back and reversed, has lost m g (w h - d), with d anywhere from 0 to w h.
    """
    velocity = np.random.default_rng(settings.seed).normal(0.0, SPEED, (settings.particles, 2))
    return drop(settings, velocity=velocity)


def frame_rate(settings: Settings) -> World:
    """One ball at 60 and at 10 frames per second: with the raw frame time it moves differently, with the fixed clock alike.

    Articles say that multiplying by the frame time makes speed independent of the frame rate. The speed is, but not the motion:
    a longer step has another error. With a fixed step and an accumulator both screens show the same bits.
    """
    return drop(settings)


@dataclass(frozen=True)
class Screen:
    """Draws every so many frames, and advances the world by the time since the last drawing.

    It does so in one step, by raw frame time; or, with a `fixed` step, in as many frames as a `Clock` returns.
    """

    every: int
    fixed: bool = False

    def __call__(self, world: World, frame: int, dt: float) -> None:
        """Called for each frame of the fast screen."""
        if frame % self.every:
            return
        if not self.fixed:
            world.step(self.every * dt)
            return
        for _ in range(Clock(dt=dt, max_catch_up=self.every).advance(self.every * dt)):
            world.step(dt)


def verlet(settings: Settings) -> World:
    """Position Verlet with the wall of the sketches, with projection alone, and with the real wall.

    Articles say that Verlet takes bouncing into account. It does not: putting the position back leaves x - x_prev = 0 a step
    later, a restitution of exactly 0. A bounce needs an explicit coefficient: clamp-and-flip has one but errs by up to a step at
    the impact; the wall on the right finds the time of impact and conserves the height.
    """
    return drop(settings)


def _projected(settings: Settings) -> World:
    box = room(settings)
    return drop(settings, boundary=ProjectOnly(Box(box.lower, box.upper)))


def _reflected(settings: Settings) -> World:
    return drop(settings, boundary=room(settings))


def energy(settings: Settings) -> World:
    """Left: position Verlet. Right: semi-implicit Euler. Both start from x_prev = x - v h and have clamp-and-flip walls.

    Articles say that Verlet conserves energy much better. They are the same method: with V = (x - x_prev) / h both balls move
    alike up to rounding and reach the same heights. Only the energy is read differently: Verlet's velocity here belongs to the
    time of the position, semi-implicit Euler's is half a step older, so that its curve oscillates by m g v h / 2 about the same
    level. More substeps reduce everything equally for both.
    """
    return drop(settings)


def _scene(name: str, summary: str, build: Callable[[Settings], World], defaults: Settings, *variants: Variant) -> Scene:
    return Scene(name, summary, build, defaults, variants=variants, line=HEIGHT)


def _energy(count: str) -> Scene:
    naive = PositionVerlet(naive_start=True)
    return _scene(
        f"energy-{count.replace(' ', '-')}", f"Verlet beside semi-implicit Euler, {count} a frame", energy,
        settings(naive, substeps=int(count.split()[0])),
        Variant("position Verlet", {"integrator": naive}), Variant("semi-implicit Euler", {"integrator": SemiImplicitEuler()}),
    )  # fmt: skip


SCENES = (
    _scene("bounce-euler", "explicit Euler: one ball bounces higher and higher", euler, settings(ExplicitEuler())),
    _scene(
        "bounce-order", "the same two lines swapped: position or velocity first", order, settings(SemiImplicitEuler()),
        Variant("position first", {"integrator": ExplicitEuler()}),
        Variant("velocity first", {"integrator": SemiImplicitEuler()}),
    ),
    _scene(
        "bounce-rest", "from rest, clamp-and-flip seems to keep the energy", rest,
        settings(SemiImplicitEuler(), gravity=(0.0, GRAVITY)),
    ),
    _scene(
        "bounce-random", "thrown at random, balls lose energy at every clamp-and-flip", random,
        settings(SemiImplicitEuler(), particles=5),
    ),
    _scene(
        "frame-rate", "one ball at 60 and 10 frames a second, by raw frame time and by a fixed clock", frame_rate,
        settings(SemiImplicitEuler()),
        Variant("raw, 60 a second", pace=Screen(1)), Variant("raw, 10 a second", pace=Screen(SLOW)),
        Variant("clock, 60 a second", pace=Screen(1, fixed=True)), Variant("clock, 10 a second", pace=Screen(SLOW, fixed=True)),
    ),
    _scene(
        "bounce-verlet", "position Verlet: clamp-and-flip, projection alone, and a real wall", verlet, settings(PositionVerlet()),
        Variant("clamp and flip"), Variant("projection alone", build=_projected), Variant("moment of impact", build=_reflected),
    ),
    _energy("1 substep"),
    _energy("10 substeps"),
)  # fmt: skip
