"""A Galton board: balls fall from a hopper through rows of pegs, left or right, and their counts follow the binomial law."""

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.laws.boundaries import Box
from pyverlet.laws.obstacles import Capsule, Disc, Segment
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

ROWS = 12

SPACING, DROP = 0.1, 0.08  # spacing of pegs and of rows, m: a ball that bounces off a peg does not get past the next one
PEG, BALL = 0.030, 0.014  # radii, m: a ball bounces about in a gap that it just fits through, and forgets where it came from

BRIM, MOUTH = 0.115, 0.034
"""Height of the hopper's lips above the first row, and their distance, m: single balls, so that few collide on the board."""

STIRRER, TURNING = 0.07, 1.0  # half length, m, and speed, rad/s: otherwise balls form an arch over the mouth
HALF = (ROWS + 1) * SPACING / 2  # half width, m, of 13 bins
LAST = -(ROWS - 1) * DROP  # height of the last row, m; that of the first is 0


def build(settings: Settings) -> World:
    """Balls fall from a hopper, almost one by one, onto 12 rows of round pegs, and from there into 13 bins.

    The only randomness is in the initial positions, which the pegs amplify. With a restitution of 0.75 a ball goes left or right
    at each row equally often whatever it did before, and the numbers in the bins are those of 12 coin tosses,
    n 12! / (k! (12 - k)! 2^12). That is not true for all boards: with --restitution 0.5 a ball tends to continue as before, with
    --friction 0.2 to turn back (for single balls, 4.3 and 0.75 times the variance of tosses); with 0, all go the same way.
    """
    radii = settings.draw_radii(BALL)[1]
    radii *= BALL / radii.max()
    centres, top = _in_hopper(settings, radii)
    floor = _floor(settings)
    world = settings.empty_world(Box((-HALF, floor), (HALF, top), friction=settings.friction))
    for row in range(-1, ROWS):  # the row above the first keeps balls from jumping over it
        edge = HALF if row % 2 else HALF - 1.5 * SPACING
        for x in np.arange(-edge, edge + SPACING / 2, SPACING):
            world.obstacles.append(Disc((x, -row * DROP), PEG, **settings.surface))
    for x in np.arange(SPACING - HALF, HALF - SPACING / 2, SPACING):
        world.obstacles.append(Segment((x, LAST), (x, floor), friction=settings.friction))
    for side in (-1, 1):
        lip, wall = (side * MOUTH / 2, BRIM), (side * HALF, BRIM + HALF - MOUTH / 2)
        world.obstacles.append(Segment(lip, wall, friction=settings.friction))
    axis = BRIM + STIRRER + 2 * BALL
    world.obstacles.append(Capsule((-STIRRER, axis), (STIRRER, axis), radius=BALL / 4, angular_velocity=TURNING))
    world.add(position=centres, radius=radii, mass=(radii / BALL) ** 2)
    return world


def _in_hopper(settings: Settings, radii: Floats) -> tuple[Floats, float]:
    """Centres (n, 2) above the stirrer, between walls at 45 degrees, and the height of the lid, m."""

    def half_width(y: float, margin: float) -> float:
        return min(HALF - margin, MOUTH / 2 + y - BRIM - 2**0.5 * margin)

    bottom, top = BRIM + 2 * STIRRER + 3 * BALL, BRIM + HALF
    while (centres := _start.in_rows(np.random.default_rng(settings.seed), radii, bottom, top, half_width)) is None:
        top *= 1.03
    return centres, top


def _floor(settings: Settings) -> float:
    """Height of the floor, m, so that the bins hold the balls with some room to spare."""
    return LAST - SPACING * (1.5 + 0.02 * settings.particles)


def bins(world: World) -> Floats:
    """(13,) number of balls in each bin."""
    x, y = world.position.T
    fallen = x[y < LAST - PEG] / SPACING
    return np.bincount(np.clip(np.round(fallen + ROWS / 2), 0, ROWS).astype(int), minlength=ROWS + 1).astype(float)


def view(settings: Settings) -> tuple[float, float, float, float]:
    """x0, y0, x1, y1 in metres: from the bins to the brim of the hopper."""
    return (-HALF - SPACING / 2, _floor(settings) - SPACING / 2, HALF + SPACING / 2, BRIM + HALF + SPACING)


def lasts(settings: Settings) -> float:
    """Seconds until the last ball is in its bin: 8 per second leave the hopper."""
    return settings.particles / 7 + 8.0


SCENE = Scene(
    "galton", "balls pour through rows of pegs, and their counts follow the binomial law", build,
    Settings(particles=400, substeps=16, restitution=0.75), show=Show(view=view, seconds=lasts),
)  # fmt: skip
