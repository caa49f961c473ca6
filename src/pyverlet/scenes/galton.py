"""A Galton board: balls fall past rows of pegs, left or right, and their counts follow the binomial law."""

from __future__ import annotations

import numpy as np

from pyverlet.bounds import Box
from pyverlet.forces import Drag
from pyverlet.obstacles import Capsule, Segment
from pyverlet.scenes._scene import Floats, Scene, Settings, Show
from pyverlet.state import Slots
from pyverlet.world import World

ROWS = 12
RADIUS = 0.22
"""Of balls and pegs, m. Between two pegs of a row, 1 m apart, a ball has 6 cm on either side."""

PEG = 0.55
"""Length of a peg, m: a gap that long, with restitution 0, takes the ball's sideways speed and with it all memory."""

DROP = 1.35
"""From row to row, m: a ball fits through between the foot of one peg and the head of the next."""

APART = 1.2
"""Between balls that follow each other, m: nearer ones meet on a peg."""

FALLING = 3.0
"""Speed at which the air lets balls fall, m/s."""

PUFF = 1.2
"""Speed to which a puff of air would bring a ball sideways in the end, m/s."""


class Puffs:
    """A puff of air at each row, left or right by the toss of a coin: pegs alone would send every ball the same way.

    Args:
        tosses: (rows, n) of -1 and 1, for the ball of each index.
        newtons: N.
    """

    velocity_dependent = False

    def __init__(self, tosses: Floats, newtons: float) -> None:
        self.tosses, self.newtons = tosses, newtons

    def apply(self, state: Slots, t: float) -> None:
        row = np.floor(0.45 - state.position[:, 1] / DROP).astype(int)  # from above its pegs to between them
        blows = (row >= 0) & (row < len(self.tosses))
        state.force[blows, 0] += self.newtons * self.tosses[row[blows], state.particle[blows]]


def build(settings: Settings) -> World:
    """Balls fall one by one past 12 rows of pegs into 13 bins.

    At each row a ball goes left or right with equal chances, whatever it did before: the numbers in the bins are those of 12
    tosses of a coin, n 12! / (k! (12 - k)! 2^12). The tosses are puffs of air; the pegs, between which the balls just fit, count.
    """
    half, floor = ROWS / 2 + 1, -(ROWS * DROP + 2.0 + 0.06 * settings.particles)
    surface = {"restitution": settings.restitution, "friction": settings.friction}
    world = settings.empty_world(Box((-half, floor), (half, APART * (settings.particles + 2)), **surface))
    for row in range(ROWS):
        for x in np.arange(-half, half + 1) + 0.5 * (row % 2):
            if abs(x) <= half:
                world.obstacles.append(Capsule((x, -row * DROP), (x, -row * DROP - PEG), radius=RADIUS, **surface))
    for x in np.arange(-half + 0.5, half):
        world.obstacles.append(Segment((x, -(ROWS - 1) * DROP - PEG), (x, floor), **surface))
    drag = float(np.hypot(*settings.gravity)) / FALLING
    tosses = np.random.default_rng(settings.seed).choice((-1.0, 1.0), (ROWS, settings.particles))
    world.forces += [Drag(linear=drag), Puffs(tosses, drag * PUFF)]
    y = APART * (1.0 + np.arange(settings.particles))
    world.add(position=np.column_stack((0 * y, y)), velocity=(0, -FALLING), radius=RADIUS)
    return world


def bins(world: World) -> Floats:
    """(13,) how many balls are in each bin."""
    x, y = world.position.T
    fallen = y < -(ROWS - 1) * DROP - PEG
    return np.bincount(np.clip(np.round(x[fallen] + ROWS / 2), 0, ROWS).astype(int), minlength=ROWS + 1).astype(float)


def view(settings: Settings) -> tuple[float, float, float, float]:
    """x0, y0, x1, y1 in metres: board and bins, not the balls above them."""
    return (-ROWS / 2 - 2, -(ROWS * DROP + 3.0 + 0.06 * settings.particles), ROWS / 2 + 2, 3.0)


def lasts(settings: Settings) -> float:
    """Seconds until the last ball is in its bin."""
    return (APART * settings.particles + 2 * ROWS * DROP) / FALLING + 15.0


SCENE = Scene(
    "galton",
    "balls fall past rows of pegs, and their counts follow the binomial law",
    build,
    Settings(particles=300),
    show=Show(view=view, seconds=lasts),
)
