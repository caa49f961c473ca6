"""What articles say about bouncing balls, tried: balls let go 3 m above the floor, one step a frame, in float64."""

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
HEIGHT = 3.0  # of the centres at the start, m: where the line is drawn
SPACING = 3 * RADIUS  # between the centres of neighbours, m
LEAST_WIDTH, CEILING = 3.0, 8.0  # of the room, m: a ball that gains energy has space to climb
GRAVITY = -2857 / 2**20 * 3600  # 9.8087 m/s^2: g h^2 is whole numbers of 2^-20 m at 60 steps a second, so that nothing is rounded
SPEED = 2.0  # standard deviation of each component of a random starting velocity, m/s
SLOW = 6  # frames of a fast screen for one of a slow one: 60 and 10 a second at the usual dt


def settings(integrator: Integrator, **changes: Any) -> Settings:
    """Those of a sketch: one ball, one step a frame, no collisions, walls with e = 1."""
    base = Settings(particles=1, substeps=1, collisions=None, restitution=1.0, dtype=np.float64, integrator=integrator)
    return dataclasses.replace(base, **changes)


def room(settings: Settings) -> Box:
    """Wide enough for all balls side by side; the floor is at y = 0."""
    half = max(LEAST_WIDTH, SPACING * settings.particles) / 2
    return Box((-half, 0), (half, CEILING), **settings.surface)


def drop(settings: Settings, *, boundary: Boundary | None = None, velocity: Any = 0.0) -> World:
    """The balls in a row at the same height, under clamp-and-flip unless said; velocity (n, 2) in m/s."""
    world = settings.empty_world(ClampAndFlip(room(settings)) if boundary is None else boundary)
    x = SPACING * (np.arange(settings.particles) - (settings.particles - 1) / 2)
    world.add(position=np.column_stack((x, np.full_like(x, HEIGHT))), velocity=velocity, radius=RADIUS, mass=1.0)
    return world


def euler(settings: Settings) -> World:
    """One ball bounces on the floor with e = 1 and climbs higher and higher.

    The articles: explicit Euler gains energy. True, and how much is known: position first, with the old velocity, gains
    m g^2 h^2 / 2 in every step of free fall, whatever the ball does; 0.8 J a second and kilogram at 60 steps a second.
    """
    return drop(settings)


def order(settings: Settings) -> World:
    """Left: position, then velocity (explicit Euler). Right: velocity, then position (semi-implicit Euler).

    The articles: swapped, the lines lose energy instead of gaining it. Half true: explicit Euler gains, but semi-implicit
    Euler loses nothing in flight. It keeps v^2/2 + g y - (h/2) g v to rounding, and only the wall's clamp-and-flip takes from it.
    """
    return drop(settings)


def rest(settings: Settings) -> World:
    """A ball let go at rest returns to the same height after every bounce but the first.

    The articles: from rest the method conserves energy. It is a coincidence: from rest all speeds are whole multiples of g h,
    the first clamp puts the heights above the wall on whole multiples of g h^2, and from then on a fall touches the wall exactly
    at the end of a step. One step later, at the largest depth there is, clamp-and-flip takes nothing. The gravity here makes
    all of this exact; with 9.81 it is rounding that decides which bounce loses. See `bounce-random` for any other start.
    """
    return drop(settings)


def random(settings: Settings) -> World:
    """Balls thrown at random bounce lower and lower, although e = 1.

    The articles: semi-implicit Euler loses energy. The method does not, the wall does: found a depth d below it with speed w,
    a ball that is put back and turned round has lost m g (w h - d), and d is anything from 0 to w h.
    """
    velocity = np.random.default_rng(settings.seed).normal(0.0, SPEED, (settings.particles, 2))
    return drop(settings, velocity=velocity)


def frame_rate(settings: Settings) -> World:
    """One ball at 60 and at 10 frames a second: by raw frame time it moves differently, by the fixed clock the same.

    The articles: multiply by the frame time, and speed no longer depends on the frame rate. The speed does not, the motion
    does: a longer step is another error. With a fixed step behind an accumulator the two screens see the same bits.
    """
    return drop(settings)


@dataclass(frozen=True)
class Screen:
    """Draw every so many frames, and advance the world by the time since the last drawing.

    In one step, by raw frame time; or, with a `fixed` step, in as many frames as a `Clock` says are due.
    """

    every: int
    fixed: bool = False

    def __call__(self, world: World, frame: int, dt: float) -> None:
        """A frame of the fast screen has passed."""
        if frame % self.every:
            return
        if not self.fixed:
            world.step(self.every * dt)
            return
        for _ in range(Clock(dt=dt, max_catch_up=self.every).advance(self.every * dt)):
            world.step(dt)


def verlet(settings: Settings) -> World:
    """Position Verlet with the wall of the sketches, with projection alone, and with the real wall.

    The articles: Verlet takes the bouncing into account. It does not: putting the position back leaves x - x_prev = 0 a step
    later, a restitution of exactly 0. A bounce needs a stated coefficient: clamp-and-flip has one but errs by up to a step at
    the impact, the wall on the right finds the moment of the impact and keeps the height.
    """
    return drop(settings)


def _projected(settings: Settings) -> World:
    box = room(settings)
    return drop(settings, boundary=ProjectOnly(Box(box.lower, box.upper)))


def _reflected(settings: Settings) -> World:
    return drop(settings, boundary=room(settings))


def energy(settings: Settings) -> World:
    """Left: position Verlet. Right: semi-implicit Euler. Both start from x_prev = x - v h and meet clamp-and-flip walls.

    The articles: Verlet conserves energy much better. They are the same method: with V = (x - x_prev) / h the two balls move
    alike to rounding and reach the same heights. Only the energy is read differently: Verlet's velocity here belongs to the
    time of the position, semi-implicit Euler's lags half a step behind, which makes its curve swing by m g v h / 2 about the
    same level. More substeps make everything smaller by as much, for both.
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
