"""Circles of unequal masses, linked or not: they come to rest, weigh what they weigh, and keep momentum."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import G, H, each_frame, linked_rows, points

import pyverlet as pv
from pyverlet.world.stiffness import STIFFNESS


def column(count: int, heavy: float, **options: Any) -> tuple[pv.World, pv.Group]:
    """A circle of `heavy` kg on `count` of 1 kg in a slot one diameter wide."""
    world = pv.World(boundary=pv.Box((0, 0), (1, 100)), **options)
    return world, world.add(position=points([0.5], 0.5 + np.arange(count + 1)), radius=0.5, mass=[1.0] * count + [heavy])


@pytest.mark.parametrize("times", [50.0, 1000.0])
@pytest.mark.parametrize("substeps", [4, 8, 16])
def test_a_heavy_circle_on_a_column_of_light_ones_soon_rests(times: float, substeps: int) -> None:
    # At rest a contact is a spring of frequency f = STIFFNESS / h on the reduced mass M: depth = F / (M (2 pi f)^2). The lowest
    # one between circles of 1 kg, M = 1/2, carries all above it.
    world, circles = column(10, times, substeps=substeps)
    world.run(seconds=12)
    h = 1 / 60 / substeps
    deepest = 2 * (times + 9) * G / (2 * np.pi * STIFFNESS / h) ** 2
    assert world.overlap().max == pytest.approx(deepest, rel=0.02)
    assert np.abs(circles.velocity).max() < (0.1 if substeps >= 8 else 1.0) * G * h


def test_who_rests_on_a_scale_weighs_what_it_weighs() -> None:
    # A pan of 200 kg on a spring, on it ten circles of 1 kg, and one of 1000 kg: k x = (sum of m) g, whoever has the inertia.
    world = pv.World(boundary=pv.Box((0, 0), (1, 100)), dtype=np.float64)
    pan = world.add(position=(0.5, 1.5), radius=0.5, mass=200.0)
    world.add(position=points([0.5], 2.5 + np.arange(11)), radius=0.5, mass=[1.0] * 10 + [1000.0])
    world.forces += [pv.PointSpring(pan, center=(0.5, 1.5), stiffness=1e5), pv.Drag(linear=400.0)]
    world.run(seconds=20)
    # At rest a substep begins with a velocity of up to g h, which the drag takes for one.
    assert 1.5 - pan.position[0, 1] == pytest.approx(1210 * G / 1e5, abs=4e3 * G * H / 1e5)


def test_unequal_circles_that_bounce_come_to_rest() -> None:
    # Beside the whole heap's swing in the smooth room, which nothing stops: a turn about the centre.
    def restless(seed: int) -> float:
        world = pv.scenes.get("cage").world(particles=150, threads=1)
        world.mass = np.where(np.random.default_rng(seed).random(150) < 0.5, 1.0, 100.0)
        world.collisions = pv.Collisions(restitution=0.3, friction=0.5)
        world.run(seconds=8)
        mass, left = world.mass.astype(float), []
        for _ in range(5):
            (x, y), (vx, vy) = world.position.T.astype(float), world.velocity.T.astype(float)
            turn = mass @ (x * vy - y * vx) / (mass @ (x * x + y * y))
            left.append(0.5 * mass @ ((vx + turn * y) ** 2 + (vy - turn * x) ** 2))
            world.run(seconds=0.5)
        return float(np.median(left) / (mass.sum() * G))

    # Here and there one slips a little farther: of 12 seeds one in four, by up to 2.5e-3; the others have 1e-6 to 1e-5.
    found = sorted(restless(seed) for seed in range(3))
    assert found[1] < 1e-4 * 0.5
    assert found[-1] < 3e-3


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_without_weight_they_bounce_however_slowly(speed: float) -> None:
    # In a fall together, above what is a contact at rest (4 g h = 0.08 m/s): they part with e times the speed they met with.
    world = pv.World(collisions=pv.Collisions(restitution=0.5))
    world.add(position=[(0, 0), (1.02, 0)], velocity=[(speed, 0), (0, 0)], radius=0.5, mass=[1.0, 100.0])
    world.run(seconds=0.2)
    # What places are rounded by, over h: 6e-8 m times 480/s.
    assert world.velocity[1, 0] - world.velocity[0, 0] == pytest.approx(0.5 * speed, abs=3e-5)


@pytest.mark.parametrize("which", [0, 10])
def test_who_is_let_go_falls_like_everybody(which: int) -> None:
    # Taken off the column, the heavy circle and a light one fall by g t^2 / 2 from the first substep on.
    world, circles = column(10, 1000.0, dtype=np.float64)
    world.run(seconds=2)
    circles.position[which] = 0.5, 90.0
    circles.velocity[which] = 0.0
    world.run(seconds=1)
    assert 90.0 - circles.position[which, 1] == pytest.approx(G / 2, rel=2 * H)


def two_heaps(side: int, seed: int, friction: float, gravity: tuple[float, float]) -> tuple[pv.World, pv.Group]:
    """Twice side x side touching circles of masses 1:1000 that run into each other."""
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(side * side), side)
    heap = np.column_stack((0.999 * column + 0.499 * (row % 2), 0.866 * row + 0.5))
    world = pv.World(gravity=gravity, collisions=pv.Collisions(friction=friction), dtype=np.float64)
    position = np.concatenate((heap, heap + np.array([side + 2, 0.3])))
    group = world.add(position=position, radius=0.5, mass=1000 ** rng.random(2 * side * side))
    world.run(seconds=0.5)
    group.velocity[:, 0] += np.repeat((1.5, -1.5), side * side)
    return world, group


LINKS: dict[str, Callable[[pv.Group, Any], Any]] = {
    "stick": lambda group, i: pv.Stick(group, i, i + 1), "rope": lambda group, i: pv.Rope(group, i, i + 1),
    "spring": lambda group, i: pv.Spring(group, i, i + 1, stiffness=2e4),
}  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("link", "gravity"), [(None, (0.0, -G)), (None, (3.0, -4.0)), *((link, (0.0, -G)) for link in LINKS)])
def test_struck_while_they_touch_unequal_circles_keep_momentum(link: str | None, gravity: tuple[float, float], seed: int) -> None:
    # Falling together, sum of m v grows by (sum of m) g t and by nothing else; a fiftieth to three quarters of it were lost once.
    # So it does if each heap is linked within itself.
    # Rounding: some 1e5 sums of products at 1e-16 of a scale 3 times the falling part's.
    world, group = two_heaps(4, seed, 0.0, gravity)
    if link:
        world.links.append(LINKS[link](group, np.arange(0, 31, 3)))
    mass, start = float(group.mass.sum()), np.array(world.momentum())
    since = world.time
    for _ in each_frame(world, 120):
        gained = np.array(world.momentum()) - start
        assert gained == pytest.approx(mass * np.array(gravity) * (world.time - since), abs=1e-11 * mass * 3)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("friction", [0.0, pytest.param(0.4, marks=pytest.mark.slow)])
def test_struck_while_they_touch_unequal_circles_keep_angular_momentum_and_energy(friction: float, seed: int) -> None:
    # About the centre of mass. Parting overlaps moves circles across their velocities: e = 0 parts what v h = 6 mm overlaps in
    # contacts 1 m long.
    world, group = two_heaps(4, seed, friction, (0.0, -G))
    mass = group.mass / group.mass.sum()

    def relative() -> tuple[float, float]:
        x, v = group.position - mass @ group.position, group.velocity - mass @ group.velocity
        disc = 0.5 * group.radius**2 * group.spin
        spinning = x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] + disc
        return float(mass @ spinning), float(mass @ ((v * v).sum(axis=1) + disc * group.spin) / 2)

    start, energy = relative()
    scale = 1.5 * float(mass @ np.hypot(*(group.position - mass @ group.position).T))
    world.run(seconds=2)
    turned, left = relative()
    assert turned == pytest.approx(start, abs=2e-3 * scale)
    assert left < energy


@pytest.mark.parametrize(
    ("friction", "seed"), [(0.0, 0), (0.0, 12), (0.0, 28), (0.0, 43), pytest.param(0.4, 0, marks=pytest.mark.slow)]
)
def test_sliding_on_a_floor_unequal_circles_keep_what_momentum_is_along_it(friction: float, seed: int) -> None:
    # The floor gives momentum only across it, also where energy is taken back of what moves as a whole: with three of these
    # seeds up to a twentieth of the sum of m v was lost in one frame.
    world, group = two_heaps(4, seed, friction, (0.0, -G))
    world.boundary = pv.Box((-100, float(group.position[:, 1].min()) - 5), (100, 100))
    start, scale = world.momentum()[0], 3 * float(group.mass.sum())
    for _ in each_frame(world, 180):
        assert world.momentum()[0] == pytest.approx(start, abs=(1e-3 if friction else 1e-11) * scale)


def test_a_heavy_circle_that_falls_with_its_column_does_not_bounce() -> None:
    world, circles = column(10, 1000.0)
    circles.velocity[:] = (0.0, -1.0)
    highest = max(float(circles.position[-1, 1]) for _ in each_frame(world, 600))
    assert highest < 10.6
    assert np.abs(circles.velocity).max() < 0.2 * G * H


def hammock(ball: float) -> tuple[pv.World, pv.Stick]:
    """A rope of 41 circles of 1 kg between two pinned ones, and a ball of so many kg that falls onto it."""
    world, count = pv.World(boundary=pv.Open()), 41
    rope = world.add(position=np.column_stack((0.22 * (np.arange(count) - 20), np.zeros(count))), radius=0.1, mass=1.0)
    rope.pin([0, count - 1])
    sticks = world.links.append(pv.Stick(rope, np.arange(count - 1), np.arange(1, count), length=0.23))
    world.add(position=(0, 0.7), radius=0.5, mass=ball)
    world.forces.append(pv.Drag(linear=2.0))
    return world, sticks


@pytest.mark.parametrize("ball", [300.0, pytest.param(15.0, marks=pytest.mark.slow)])
def test_a_rope_carries_what_lies_on_it(ball: float) -> None:
    # Statics: the pulls at both ends add up to the weight of all between them, (m + 39) g upwards. The mean over a
    # second differs by what the momentum changes in it: at most 0.05 m/s, 0.005 of g.
    world, sticks = hammock(ball)
    world.run(seconds=9)
    upwards = []
    for _ in each_frame(world, 60):
        first, second, *_, before, last = world.position[:41].astype(float)
        one, other = first - second, last - before
        upwards.append(sticks.force[0] * one[1] / np.hypot(*one) + sticks.force[-1] * other[1] / np.hypot(*other))
    assert np.mean(upwards) == pytest.approx((ball + 39) * G, rel=0.01)
    assert world.overlap().max < 0.03


@pytest.mark.parametrize(
    ("link", "friction"),
    [
        ("dumb-bells", 0.0),
        *(
            pytest.param(
                link, friction, marks=(pytest.mark.slow, pytest.mark.xfail(reason="not mended yet: 400 to 700 J are left"))
            )
            for link, friction in (("chains", 0.0), ("chains", 0.3), ("ropes", 0.3))
        ),
    ],
)
def test_linked_circles_of_unequal_masses_rest(link: str, friction: float) -> None:
    # 24 rows of 33, some of them linked. Light ones between heavy dumb-bells are pressed in farther than in heaps without links.
    rng, n = np.random.default_rng(0), np.arange(24 * 33).reshape(24, 33)
    place = points(0.88 * (np.arange(33) - 16), 0.5 + 0.88 * np.arange(24)) + rng.uniform(-0.03, 0.03, (n.size, 2))
    world = pv.World(boundary=pv.Box((-15, 0), (15, 60)), collisions=pv.Collisions(friction=friction))
    group = world.add(position=place, radius=0.392, mass=np.where(rng.random(n.size) < 0.5, 1.0, 100.0))
    linked_rows(group, n, link, 4 if link == "dumb-bells" else 6)
    world.run(seconds=8)
    weight = float(world.mass.sum()) * G
    assert world.energy().kinetic < 1e-3 * weight * 0.392
    assert world.overlap().mean < (0.006 if link == "dumb-bells" else 0.002)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("masses", [(1.0, 1.0), (1.0, 3.0), (1.0, 100.0)])
def test_a_heap_at_rest_stays_there_when_substeps_become_longer(masses: tuple[float, ...], friction: float) -> None:
    # Springs as stiff as short substeps bear are too stiff for long ones: heaps of masses 1:3 jumped at 4 m/s, 1:100 at 85. In
    # units of M g r the energy may rise by 1e-5 in a frame.
    world = pv.World(boundary=pv.Box((-2, 0), (2, 20), friction=friction), collisions=pv.Collisions(friction=friction))
    row, column = np.divmod(np.arange(72), 8)
    place = np.column_stack((-1.6 + 0.42 * column + 0.02 * np.sin(7 * row), 0.3 + 0.42 * row))
    world.add(position=place, radius=0.2, mass=np.resize(masses, 72))
    world.run(seconds=20)
    rested, unit = world.save(), float(world.mass.sum()) * G * 0.2
    rolls = float(np.hypot(*world.velocity.T).max())  # one that the fall has left alone on the floor goes on rolling
    assert rolls < 0.02
    for substeps, dt in ((8, 1 / 30), (4, 1 / 60), (2, 1 / 60), (1, 1 / 60), (1, 1 / 30)):
        world.restore(rested)
        world.substeps = substeps
        energy = world.energy().total
        for _ in each_frame(world, 60, dt):
            assert world.energy().total - energy < 1e-5 * unit
            energy = world.energy().total
            assert np.hypot(*world.velocity.T).max() < 5e-3 + rolls
