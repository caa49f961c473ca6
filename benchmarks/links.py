"""What hangs together, beside others: `python -m benchmarks links`.

The same circles, masses, pegs and links for every engine: a cloth, ropes with heavy loads, a heap of soft bodies, contacts on.
All take turns in one process, on one thread, sleeping off. Beside the time a frame stands by how much what is rigid is stretched.
The others take smaller steps too, for what they stretch depends on that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT, GRAVITY, Array
from benchmarks.own import times_in_turn
from benchmarks.tables import write

SETTLE_FRAMES = 300
FRAMES = 20

SPACING = 0.25
RADIUS = 0.4 * SPACING


@dataclass(frozen=True)
class Linked:
    """Circles and what joins them. Sticks keep the length they have, springs (N/m) too, as far as they do."""

    name: str
    position: Array
    mass: Array
    pegs: Array
    sticks: Array
    springs: Array
    stiffness: float
    damping: float
    floor: float | None = None

    @property
    def links(self) -> int:
        """Of both kinds."""
        return len(self.sticks) + len(self.springs)

    def lengths(self, pairs: Array, position: Array | None = None) -> Array:
        """(k,) m, now or at first."""
        at = self.position if position is None else position
        return np.asarray(np.hypot(*(at[pairs[:, 1]] - at[pairs[:, 0]]).T))

    def stretch(self, position: Array) -> tuple[float, float]:
        """Mean and largest change of the sticks' lengths, of their length."""
        away = np.abs(self.lengths(self.sticks, position.astype(np.float64)) / self.lengths(self.sticks) - 1)
        return float(away.mean()), float(away.max())


def _pairs(a: Array, b: Array) -> Array:
    """(k, 2) of two arrays of indices."""
    return np.column_stack((a.ravel(), b.ravel()))


@dataclass(frozen=True)
class Row:
    """One engine with one of them."""

    world: str
    engine: str
    links: int
    ms_per_frame: float
    ratio: float
    ns_per_link_and_substep: float
    stretch_mean: float
    stretch_max: float


def cloth(columns: int = 50, rows: int = 30, pegs: int = 9) -> Linked:
    """Sticks across and down, springs on the diagonals, hanging from pegs. 1 kg: lighter, these springs explode in pymunk."""
    x, y = np.meshgrid(SPACING * np.arange(columns), -SPACING * np.arange(rows))
    n = np.arange(columns * rows).reshape(rows, columns)
    sticks = np.concatenate((_pairs(n[:, :-1], n[:, 1:]), _pairs(n[:-1].T, n[1:].T)))
    springs = np.concatenate((_pairs(n[:-1, :-1], n[1:, 1:]), _pairs(n[:-1, 1:], n[1:, :-1])))
    peg = np.unique(np.linspace(0, columns - 1, pegs).astype(int))
    return Linked("cloth", np.column_stack((x.ravel(), y.ravel())), np.full(n.size, 1.0), peg, sticks, springs, 600.0, 1.0)


def ropes(count: int = 100, links: int = 20) -> Linked:
    """Each with a load of 100 times its weight."""
    at = np.column_stack((np.zeros(links + 1), -SPACING * np.arange(links + 1)))
    position = np.concatenate([at + np.array((2 * SPACING * k, 0.0)) for k in range(count)])
    mass = np.full((count, links + 1), 0.01)
    mass[:, -1] = 100 * 0.01 * links
    first = (links + 1) * np.arange(count)
    sticks = (first[:, None] + np.arange(links)).ravel()
    return Linked("ropes", position, mass.ravel(), first, np.column_stack((sticks, sticks + 1)), np.zeros((0, 2), int), 0.0, 0.0)


def soft_bodies(count: int = 60, corners: int = 16) -> Linked:
    """Rings of sticks with springs across, one above the other on a floor, 6 beside each other."""
    size = RADIUS * 1.15 / np.sin(np.pi / corners)
    phi = 2 * np.pi * np.arange(corners) / corners
    ring = size * np.column_stack((np.cos(phi), np.sin(phi)))
    wide = 2 * size + 2.5 * RADIUS
    position = np.concatenate([ring + wide * np.array((k % 6, k // 6)) for k in range(count)])
    k, first = np.arange(corners), corners * np.arange(count)
    near, across = np.column_stack((k, (k + 1) % corners)), np.column_stack((k[: corners // 2], k[corners // 2 :]))
    sticks, springs = ((first[:, None, None] + pairs).reshape(-1, 2) for pairs in (near, across))
    none, mass = np.zeros(0, int), np.full(len(position), 0.05)
    return Linked("soft bodies", position, mass, none, sticks, springs, 60.0, 0.2, floor=-size - 2 * RADIUS)


class Peer(Protocol):
    """An engine with such a world."""

    def step(self) -> None:
        """One frame."""

    def position(self) -> Array:
        """(n, 2) m."""


class Pyverlet:
    """Ours."""

    def __init__(self, what: Linked, substeps: int = 8, threads: int = 1) -> None:
        room: pv.Boundary = pv.Open()
        if what.floor is not None:
            (x0, _), (x1, y1) = what.position.min(axis=0) - 1.0, what.position.max(axis=0) + 1.0
            room = pv.Box((x0, what.floor), (x1, 2 * y1))
        self.world = pv.World(boundary=room, substeps=substeps, threads=threads)
        group = self.world.add(position=what.position, radius=RADIUS, mass=what.mass)
        group.pin(what.pegs)
        self.world.links.append(pv.Stick(group, *what.sticks.T, collide=False))
        if len(what.springs):
            across = pv.Spring(group, *what.springs.T, stiffness=what.stiffness, damping=what.damping, collide=False)
            self.world.links.append(across)

    def step(self) -> None:
        self.world.step(DT)

    def position(self) -> Array:
        return self.world.position


class Pymunk:
    """Pin joints and damped springs."""

    def __init__(self, what: Linked, steps: int) -> None:
        import pymunk

        self._space, self._steps = pymunk.Space(), steps
        self._space.gravity = GRAVITY
        self._space.use_spatial_hash(2 * RADIUS, 10 * len(what.position))
        pinned, self._bodies = set(what.pegs.tolist()), []
        for k, ((x, y), mass) in enumerate(zip(what.position, what.mass, strict=True)):
            if k in pinned:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            else:
                body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, RADIUS))
            body.position = float(x), float(y)
            self._space.add(body, pymunk.Circle(body, RADIUS))
            self._bodies.append(body)
        for a, b in what.sticks:
            self._join(pymunk.PinJoint(self._bodies[a], self._bodies[b]))
        for (a, b), length in zip(what.springs, what.lengths(what.springs), strict=True):
            ends = (self._bodies[a], self._bodies[b], (0, 0), (0, 0))
            self._join(pymunk.DampedSpring(*ends, float(length), what.stiffness, what.damping))
        for a, b in _walls(what):
            self._space.add(pymunk.Segment(self._space.static_body, a, b, 0.01))

    def _join(self, joint: Any) -> None:
        joint.collide_bodies = False
        self._space.add(joint)

    def step(self) -> None:
        for _ in range(self._steps):
            self._space.step(DT / self._steps)

    def position(self) -> Array:
        return np.array([body.position for body in self._bodies])


class Box2D:
    """Distance joints; springs have the frequency that gives their stiffness."""

    def __init__(self, what: Linked, substeps: int) -> None:
        import pyb2d3

        self._world, self._substeps = pyb2d3.World(gravity=GRAVITY), substeps
        self._world.sleeping_enabled = False
        pinned, self._bodies = set(what.pegs.tolist()), pyb2d3.Bodies()
        disc, every = pyb2d3.circle(radius=RADIUS), []
        for k, ((x, y), mass) in enumerate(zip(what.position, what.mass, strict=True)):
            make = self._world.create_static_body if k in pinned else self._world.create_dynamic_body
            every.append(make(position=(float(x), float(y))))
            material = pyb2d3.surface_material(friction=0.0, restitution=0.0)
            every[-1].create_circle_shape(pyb2d3.shape_def(density=mass / (np.pi * RADIUS**2), material=material), disc)
            self._bodies.append(every[-1])
        weight = np.where(np.isin(np.arange(len(what.mass)), what.pegs), 0.0, 1.0 / what.mass)
        for pairs, soft in ((what.sticks, False), (what.springs, True)):
            for (a, b), length in zip(pairs, what.lengths(pairs), strict=True):
                options: dict[str, Any] = {}
                if soft:
                    w = max(float(weight[a] + weight[b]), 1e-9)
                    hertz = np.sqrt(what.stiffness * w) / (2 * np.pi)
                    options = {"enable_spring": True, "hertz": hertz}
                    options["damping_ratio"] = what.damping / (2 * np.sqrt(what.stiffness / w))
                self._world.create_distance_joint(every[a], every[b], length=float(length), collide_connected=False, **options)
        ground = self._world.create_static_body()
        for a, b in _walls(what):
            ground.create_segment_shape(pyb2d3.shape_def(), pyb2d3.segment(a, b))

    def step(self) -> None:
        self._world.step(DT, self._substeps)

    def position(self) -> Array:
        return np.asarray(self._bodies.get_positions())


def _walls(what: Linked) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The floor, and a wall on either side, if there is a floor."""
    if what.floor is None:
        return []
    (x0, _), (x1, y1) = what.position.min(axis=0) - 1.0, what.position.max(axis=0) + 1.0
    floor, top = what.floor, 2 * float(y1)
    x0, x1 = float(x0), float(x1)
    return [((x0, floor), (x1, floor)), ((x0, floor), (x0, top)), ((x1, floor), (x1, top))]


ENGINES: tuple[tuple[str, Callable[[Linked], Peer], int], ...] = (
    ("pyverlet, 8 substeps", lambda what: Pyverlet(what), 8),
    ("Box2D (pyb2d3), 4 substeps", lambda what: Box2D(what, 4), 4),
    ("Box2D (pyb2d3), 8 substeps", lambda what: Box2D(what, 8), 8),
    ("Box2D (pyb2d3), 32 substeps", lambda what: Box2D(what, 32), 32),
    ("pymunk, one step", lambda what: Pymunk(what, 1), 1),
    ("pymunk, 4 steps", lambda what: Pymunk(what, 4), 4),
    ("pymunk, 8 steps", lambda what: Pymunk(what, 8), 8),
)
"""Name, how it is built, substeps a frame."""


def compare(what: Linked) -> list[Row]:
    """All that are installed, in turn; ratios are to the first, ours."""
    worlds: list[tuple[str, Peer, int]] = []
    for name, build, substeps in ENGINES:
        try:
            worlds.append((name, build(what), substeps))
        except ImportError:
            continue
    for _, world, _ in worlds:
        for _ in range(SETTLE_FRAMES):
            world.step()
    found = [what.stretch(world.position()) for _, world, _ in worlds]  # all after the same time
    times = times_in_turn([world.step for _, world, _ in worlds], FRAMES)
    quick = [float(np.quantile(spent, 0.25)) for spent in times]
    return [
        Row(what.name, name, what.links, ms, ms / quick[0], 1e6 * ms / (what.links * substeps), *stretch)
        for (name, _, substeps), ms, stretch in zip(worlds, quick, found, strict=True)
    ]


def main(path: Path | None) -> None:
    """Print the tables; write them as CSV and JSON if asked to."""
    rows: list[Row] = []
    for what in (cloth(), ropes(), soft_bodies()):
        print(f"\n{what.name}: {len(what.position):,} circles, {what.links:,} links, one thread")
        print(f"{'engine':<30}{'ms a frame':>11}{'ratio':>8}{'ns a link, substep':>20}{'mean stretch':>14}{'max':>10}")
        for row in compare(what):
            print(
                f"{row.engine:<30}{row.ms_per_frame:>11.3f}{row.ratio:>8.2f}{row.ns_per_link_and_substep:>20.1f}"
                f"{row.stretch_mean:>14.4%}{row.stretch_max:>10.3%}"
            )
            rows.append(row)
    write(rows, path)
