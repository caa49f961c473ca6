"""The engines compared: each builds the same cage of equal discs and steps it by whole frames of 1/60 s.

Settings are each engine's documented defaults for quality, with sleeping switched off everywhere: a frame then costs what moving
one would. To add one: a class with `name`, `settings`, `most`, and the three methods; a line in ENGINES.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

import pyverlet as pv

Array = NDArray[Any]

DT = 1 / 60
RADIUS = 0.5
GRAVITY = (0.0, -9.81)
CAGE_SEGMENTS = 512


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
    def __init__(self, position: Array, cage: float) -> None:
        """Discs of radius 0.5 m and mass 1 kg at (n, 2) positions in a circular cage of this radius, m; no friction, e = 0."""

    @abstractmethod
    def step(self) -> None:
        """One frame."""

    @abstractmethod
    def position(self) -> Array:
        """(n, 2) centres, m."""


class _Pyverlet(Engine):
    threads: ClassVar[int] = 1
    method: ClassVar[pv.Fast | pv.BruteForce] = pv.Fast()

    def __init__(self, position: Array, cage: float) -> None:
        self._world = pv.World(
            gravity=GRAVITY,
            boundary=pv.Circle(radius=cage),
            collisions=pv.Collisions(method=self.method),
            substeps=8,
            threads=self.threads,
        )
        self._world.add(position=position, radius=RADIUS, mass=1.0)

    def step(self) -> None:
        self._world.step(DT)

    def position(self) -> Array:
        return self._world.position


class PyverletOneThread(_Pyverlet):
    """Ours."""

    name = "pyverlet, 1 thread"
    settings = "8 substeps, float32"


class PyverletTwoThreads(_Pyverlet):
    """Ours, the same bits."""

    name = "pyverlet, 2 threads"
    settings = "8 substeps, float32"
    threads = 2


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

    def __init__(self, position: Array, cage: float) -> None:
        import pymunk

        self._space = pymunk.Space()
        self._space.gravity = GRAVITY
        self._space.iterations = 10
        # Cells of a diameter, as its manual advises for many bodies of one size; a tenth faster here than the default tree.
        self._space.use_spatial_hash(2 * RADIUS, 10 * len(position))
        rim = _rim(cage)
        for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            self._space.add(pymunk.Segment(self._space.static_body, tuple(a), tuple(b), 0.01))
        self._bodies = []
        for x, y in position:
            body = pymunk.Body(1.0, pymunk.moment_for_circle(1.0, 0, RADIUS))
            body.position = float(x), float(y)
            self._space.add(body, pymunk.Circle(body, RADIUS))
            self._bodies.append(body)

    def step(self) -> None:
        self._space.step(DT)

    def position(self) -> Array:
        return np.array([body.position for body in self._bodies])


class Box2D(Engine):
    """Box2D 3.1 in Python, https://github.com/DerThorsten/pyb2d3."""

    name = "Box2D (pyb2d3), 2 threads"
    settings = "4 substeps, sleeping off"

    def __init__(self, position: Array, cage: float) -> None:
        import pyb2d3

        self._world = pyb2d3.World(thread_pool=pyb2d3.ThreadPool(2), gravity=GRAVITY)
        self._world.sleeping_enabled = False
        material = pyb2d3.surface_material(friction=0.0, restitution=0.0)
        ground = self._world.create_static_body()
        # Chains are solid on one side: clockwise, that is the inside.
        ground.create_chain(pyb2d3.chain_def(_rim(cage)[::-1], material=material, is_loop=True))
        shape = pyb2d3.shape_def(density=1.0 / (np.pi * RADIUS**2), material=material)
        disc = pyb2d3.circle(radius=RADIUS)
        self._bodies = pyb2d3.Bodies()
        for x, y in position:
            body = self._world.create_dynamic_body(position=(float(x), float(y)), enable_sleep=False)
            body.create_circle_shape(shape, disc)
            self._bodies.append(body)

    def step(self) -> None:
        self._world.step(DT, 4)

    def position(self) -> Array:
        return np.asarray(self._bodies.get_positions())


def _rim(cage: float) -> Array:
    angle = np.linspace(0, 2 * np.pi, CAGE_SEGMENTS, endpoint=False)
    return cage * np.column_stack((np.cos(angle), np.sin(angle)))


ENGINES: tuple[type[Engine], ...] = (PyverletOneThread, PyverletTwoThreads, Pymunk, Box2D, PyverletBruteForce)
