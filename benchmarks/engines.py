"""The engines compared: each builds the same cage of equal discs and steps it by whole frames of 1/60 s.

Settings are each engine's documented defaults for quality, with sleeping switched off everywhere: a frame then costs what moving
one would. To add one: a class with `name`, `settings`, `most`, and the four methods; a line in ENGINES.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

import pyverlet as pv

Array = NDArray[Any]

DT = 1 / 60
RADIUS = 0.5
GRAVITY = (0.0, -9.81)
CAGE_SEGMENTS = 512


@dataclass(frozen=True)
class Heap:
    """Discs at (n, 2) positions in a smooth circular cage of this radius, m, or in a box from `-cage` to `cage`."""

    position: Array
    cage: float
    radius: Any = RADIUS
    mass: Any = 1.0
    box: bool = False
    velocity: Any = 0.0
    restitution: float = 0.0
    friction: float = 0.0
    gravity: tuple[float, float] = GRAVITY

    def discs(self) -> Iterator[tuple[Any, Any, float, float]]:
        """Place, velocity, radius and mass of each, as plain numbers."""
        count, velocity = len(self.position), np.broadcast_to(self.velocity, self.position.shape)
        numbers = (np.broadcast_to(each, count).tolist() for each in (self.radius, self.mass))
        return zip(map(tuple, self.position.tolist()), map(tuple, velocity.tolist()), *numbers, strict=True)

    def rim(self) -> Array:
        """Corners of what holds them, counter-clockwise."""
        if self.box:
            return self.cage * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        angle = np.linspace(0, 2 * np.pi, CAGE_SEGMENTS, endpoint=False)
        return self.cage * np.column_stack((np.cos(angle), np.sin(angle)))


def overlap(position: Array, radius: Any = RADIUS) -> pv.Overlap:
    """Overlap of discs at these positions, measured alike for every engine."""
    world = pv.World(dtype=np.float64)
    world.add(position=position, radius=radius)
    return world.overlap()


class Engine(ABC):
    """One world of one engine.

    Attributes:
        name: in the table.
        settings: what a reader must know to judge the time.
        most: largest number of discs it is asked for.
    """

    name: ClassVar[str]
    settings: ClassVar[str]
    most: ClassVar[int] = 10_000_000

    @abstractmethod
    def __init__(self, heap: Heap) -> None:
        """These discs."""

    @abstractmethod
    def step(self, dt: float = DT) -> None:
        """One frame, s."""

    @abstractmethod
    def position(self) -> Array:
        """(n, 2) centres, m."""

    @abstractmethod
    def velocity(self) -> Array:
        """(n, 2) m/s."""


class _Pyverlet(Engine):
    threads: ClassVar[int] = 1
    substeps: ClassVar[int] = 8
    method: ClassVar[pv.Fast | pv.BruteForce] = pv.Fast()

    def __init__(self, heap: Heap) -> None:
        law = pv.Collisions(restitution=heap.restitution, friction=heap.friction, method=self.method)
        lower, upper, e = (-heap.cage, -heap.cage), (heap.cage, heap.cage), heap.restitution
        room = pv.Box(lower, upper, restitution=e) if heap.box else pv.Circle(radius=heap.cage, restitution=e)
        self._world = pv.World(gravity=heap.gravity, boundary=room, collisions=law, substeps=self.substeps, threads=self.threads)
        self._world.add(position=heap.position, velocity=heap.velocity, radius=heap.radius, mass=heap.mass)

    def step(self, dt: float = DT) -> None:
        self._world.step(dt)

    def position(self) -> Array:
        return self._world.position

    def velocity(self) -> Array:
        return self._world.velocity


class PyverletOneThread(_Pyverlet):
    """Ours."""

    name = "pyverlet, 1 thread"
    settings = "8 substeps, float32"


class PyverletTwoThreads(_Pyverlet):
    """Ours, the same bits."""

    name = "pyverlet, 2 threads"
    settings = "8 substeps, float32"
    threads = 2


class PyverletFewSubsteps(PyverletTwoThreads):
    """Ours, with as many substeps as Box2D takes by default."""

    name = "pyverlet, 4 substeps"
    settings = "2 threads, 4 substeps, float32"
    substeps = 4


class PyverletBruteForce(_Pyverlet):
    """Ours, every pair tested in every substep: what the broad phase saves."""

    name = "pyverlet, brute force"
    settings = "8 substeps, float32, all pairs"
    method = pv.BruteForce()
    most = 5_000


class Pymunk(Engine):
    """Chipmunk in Python, https://www.pymunk.org."""

    name = "pymunk"
    settings = "10 iterations, spatial hash"
    steps: ClassVar[int] = 1
    slop: ClassVar[float] = 0.1

    def __init__(self, heap: Heap) -> None:
        import pymunk

        self._space = pymunk.Space()
        self._space.gravity = heap.gravity
        self._space.iterations = 10
        self._space.collision_slop = self.slop
        # Cells of a diameter, as its manual advises for many bodies of one size; a tenth faster here than the default tree.
        self._space.use_spatial_hash(2 * RADIUS, 10 * len(heap.position))
        rim = heap.rim()
        for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            wall = pymunk.Segment(self._space.static_body, tuple(a), tuple(b), 0.01)
            wall.friction = 0.0
            wall.elasticity = heap.restitution**0.5  # of two shapes it takes the product
            self._space.add(wall)
        self._bodies = []
        for position, velocity, radius, mass in heap.discs():
            body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
            body.position, body.velocity = position, velocity
            shape = pymunk.Circle(body, radius)
            shape.elasticity = heap.restitution**0.5
            shape.friction = heap.friction**0.5  # the product again; a smooth wall rubs nobody, as elsewhere
            self._space.add(body, shape)
            self._bodies.append(body)

    def step(self, dt: float = DT) -> None:
        for _ in range(self.steps):
            self._space.step(dt / self.steps)

    def position(self) -> Array:
        return np.array([body.position for body in self._bodies])

    def velocity(self) -> Array:
        return np.array([body.velocity for body in self._bodies])


class PymunkCareful(Pymunk):
    """Smaller steps and less slop, as its manual advises for accuracy."""

    name = "pymunk, careful"
    settings = "8 steps a frame, slop 0.01"
    steps = 8
    slop = 0.01


class Box2D(Engine):
    """Box2D 3.1 in Python, https://github.com/DerThorsten/pyb2d3."""

    name = "Box2D (pyb2d3), 2 threads"
    settings = "4 substeps, sleeping off"
    substeps: ClassVar[int] = 4
    threshold: ClassVar[float] = 1.0

    def __init__(self, heap: Heap) -> None:
        import pyb2d3

        self._world = pyb2d3.World(thread_pool=pyb2d3.ThreadPool(2), gravity=heap.gravity)
        self._world.sleeping_enabled = False
        self._world.restitution_threshold = self.threshold
        material = pyb2d3.surface_material(friction=0.0, restitution=heap.restitution)
        rough = pyb2d3.surface_material(friction=heap.friction, restitution=heap.restitution)
        ground = self._world.create_static_body()
        # Chains are solid on one side: clockwise, that is the inside.
        ground.create_chain(pyb2d3.chain_def(heap.rim()[::-1], material=material, is_loop=True))
        self._bodies = pyb2d3.Bodies()
        for position, velocity, radius, mass in heap.discs():
            body = self._world.create_dynamic_body(position=position, linear_velocity=velocity, enable_sleep=False)
            shape = pyb2d3.shape_def(density=mass / (np.pi * radius**2), material=rough)
            body.create_circle_shape(shape, pyb2d3.circle(radius=radius))
            self._bodies.append(body)

    def step(self, dt: float = DT) -> None:
        self._world.step(dt, self.substeps)

    def position(self) -> Array:
        return np.asarray(self._bodies.get_positions())

    def velocity(self) -> Array:
        return np.asarray(self._bodies.get_linear_velocities())


class Box2DCareful(Box2D):
    """More substeps, and impacts of any speed bounce."""

    name = "Box2D, careful"
    settings = "16 substeps, restitution threshold 0"
    substeps = 16
    threshold = 0.0


ENGINES: tuple[type[Engine], ...] = (
    PyverletOneThread, PyverletTwoThreads, PyverletFewSubsteps, Pymunk, Box2D, PyverletBruteForce,
)  # fmt: skip
"""Compared for speed."""

CAREFUL: tuple[type[Engine], ...] = (PyverletOneThread, Pymunk, PymunkCareful, Box2D, Box2DCareful)
"""Compared for physics: the others at their defaults, and at the most careful settings their manuals describe."""
