"""A gas of hard discs in a periodic room: speeds become Maxwell-Boltzmann's, and the pressure follows an equation of state."""

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.laws.boundaries import Periodic
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Graph, Scene, Settings, Show
from pyverlet.world.world import World

RADIUS = 0.5  # root mean square radius of the circles, m
AREA_FRACTION = 0.3  # fraction of the area that circles cover
SPEED = 3.0  # initial speed of circles of 1 kg, m/s
BARS, CURVE, MOST = 24, 73, 3.0  # of the graph: number of bars, points of the curve, and largest speed over sqrt(2 k T / m)
MEMORY_S = 4.0  # averaging time of the graph


def build(settings: Settings) -> World:
    """1,000 elastic circles without gravity in a periodic room, initially equally fast.

    They cover 30 % of the area. Within a second impacts have made the speeds Maxwell-Boltzmann's: in two dimensions,
    f(u) = 2 u exp(-u^2) with u = v / sqrt(2 k T / m). The pressure, from the virial of the impacts, is compared with Henderson's
    equation of state. Masses are proportional to the area, 1 kg at a radius of 0.5 m.
    """
    rng, radii = settings.draw_radii(RADIUS)
    side = max(float(np.sqrt(np.pi * (radii @ radii) / AREA_FRACTION)), 4.2 * float(radii.max()))
    while (centres := _start.in_box(rng, radii, side, side)) is None:
        side *= 1.05
    half = side / 2
    world = settings.empty_world(Periodic((-half, -half), (half, half), **settings.surface), contacts=True)
    angle, mass = rng.uniform(0, 2 * np.pi, settings.particles), (radii / RADIUS) ** 2
    velocity = SPEED / np.sqrt(mass)[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
    if settings.particles > 1:  # total momentum 0
        velocity -= (mass @ velocity) / mass.sum()
    world.add(position=centres - (0, half), velocity=velocity, radius=radii, mass=mass)
    return world


def henderson(fraction: float) -> float:
    """Z = P A / (N k T) of hard discs by Henderson (1975), accurate to one per cent below an area fraction of 0.6."""
    return (1 + fraction**2 / 8) / (1 - fraction) ** 2


def state(fraction: float, radii: Floats) -> float:
    """Z of a mixture of discs, from that of equal ones: Santos, Yuste and Lopez de Haro (1999), Molecular Physics 96, 1.

    Z = (1 - x) / (1 - f) + x Z_equal(f) with x = <r>^2 / <r^2>: exact up to the second virial coefficient; x = 1 for equal ones.
    """
    x = float(radii.mean() ** 2 / (radii**2).mean())
    return (1 - x) / (1 - fraction) + x * henderson(fraction)


class Thermometer:
    """Speeds over sqrt(2 k T / m), and Z, averaged over `MEMORY_S`."""

    def __init__(self) -> None:
        self._time, self._bars, self._z, self._weight = 0.0, np.zeros(BARS), 0.0, 0.0
        x = np.linspace(0.0, MOST, CURVE)
        self._curve = tuple((2 * x * np.exp(-(x**2))).tolist())

    def __call__(self, world: World) -> Graph:
        if world.time < self._time:
            self._time, self._bars, self._z, self._weight = 0.0, np.zeros(BARS), 0.0, 0.0
        if world.time > self._time or not self._weight:
            self._look(world)
        radii = world.radius.astype(np.float64)
        fraction = float(np.pi * (radii @ radii) / np.prod(world.boundary.periodic.period))
        measured, theory = self._z / max(self._weight, 1e-300), state(fraction, radii)
        note = f"pressure P A / N k T = {measured:.2f}; equation of state {theory:.2f}"
        bars = tuple((self._bars / max(self._weight, 1e-300)).tolist())
        return Graph("Speeds, and Maxwell-Boltzmann", "v / √(2 k T / m)", MOST, bars, self._curve, note)

    def _look(self, world: World) -> None:
        passed, self._time = world.time - self._time, world.time
        keep, share = np.exp(-passed / MEMORY_S), passed or 1e-9
        mass, square = world.mass.astype(np.float64), (world.velocity.astype(np.float64) ** 2).sum(axis=1)
        heat = 0.5 * float((mass * square).mean())  # k T
        speed = np.sqrt(mass * square / (2 * max(heat, 1e-300)))
        count, _ = np.histogram(speed, BARS, (0.0, MOST))
        bars = count / (len(world) * MOST / BARS)
        area = float(np.prod(world.boundary.periodic.period))
        z = world.pressure() * area / (len(world) * max(heat, 1e-300)) if world.time else 1.0
        self._bars, self._z = keep * self._bars + share * bars, keep * self._z + share * z
        self._weight = keep * self._weight + share


SCENE = Scene(
    "gas", "1,000 elastic discs in a room without an end, their speeds beside Maxwell's curve", build,
    Settings(particles=1_000, restitution=1.0, gravity=(0.0, 0.0)), show=Show(graph=lambda settings: Thermometer()),
)  # fmt: skip
