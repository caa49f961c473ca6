"""Rebounds: a circle dropped from H rises to e^2 H; a bounce with e = 1 keeps the energy; friction turns sliding into rolling."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import G, each_frame, of_ones_own

import pyverlet as pv

RADIUS = 0.5


def rebound_height(world: pv.World, ball: pv.Group) -> float:
    """Height of the apex after the first bounce, from v^2 / 2 g on the way up (a frame rarely falls on the apex itself)."""
    for _ in range(600):
        before = float(ball.velocity[0, 1])
        world.step(1 / 60)
        if before < 0 <= float(ball.velocity[0, 1]):
            break
    return float(ball.position[0, 1]) - RADIUS + float(ball.velocity[0, 1]) ** 2 / (2 * G)


ROOMS: dict[str, Callable[[float], Any]] = {
    "box": lambda e: pv.Box((-20, 0), (20, 40), restitution=e),
    "channel": lambda e: pv.Periodic((-20, 0), (20, 40), axes="x", restitution=e),
    "cage": lambda e: pv.Circle(center=(0, 20), radius=20, restitution=e),
    "own box": lambda e: of_ones_own(ROOMS["box"](e)), "own cage": lambda e: of_ones_own(ROOMS["cage"](e)),
}  # fmt: skip
SHAPES: dict[str, Callable[[float], pv.Obstacle]] = {
    "segment": lambda e: pv.Segment((-1, 0), (1, 0), restitution=e),
    "segment from below": lambda e: pv.Segment((1, 0), (-1, 0), restitution=e),
    "chain": lambda e: pv.Chain([(-1, 2), (-1, 0), (1, 0), (1, 2)], restitution=e),
    "joint": lambda e: pv.Chain([(-1, 0), (0, 0), (1, 0)], restitution=e),
    "capsule": lambda e: pv.Capsule((-1, -0.2), (1, -0.2), radius=0.2, restitution=e),
    "disc": lambda e: pv.Disc((0, -0.7), 0.7, restitution=e),
    "polygon": lambda e: pv.Polygon([(-1, -1), (1, -1), (1, 0), (-1, 0)], restitution=e),
    "clockwise polygon": lambda e: pv.Polygon([(-1, 0), (1, 0), (0, -0.1)], restitution=e),
    "corner": lambda e: pv.Polygon([(-1, -1), (1, -1), (0, 0)], restitution=e),
    "end": lambda e: pv.Segment((0, -3), (0, 0), restitution=e),
}


def dropped_on(floor: str, e: float, drop: float, integrator: pv.Integrator, dtype: type) -> tuple[pv.World, pv.Group]:
    """A circle above the origin, which is the top of a floor."""
    room = ROOMS[floor](e) if floor in ROOMS else pv.Open()
    world = pv.World(boundary=room, integrator=integrator, collisions=pv.Collisions(restitution=e), dtype=dtype)
    if floor in SHAPES:
        world.obstacles.append(SHAPES[floor](e))
    elif floor == "circle":
        world.add(position=(0, -RADIUS), radius=RADIUS, mass=np.inf)
    return world, world.add(position=(0, RADIUS + drop), radius=RADIUS)


ORDERS = {name: kind.order for name, kind in pv.integrators.BY_NAME.items()}


REBOUNDS = [
    # v'^2 / 2g = e^2 v^2 / 2g = e^2 H. The impact is solved where it happened, so that only float32 rounding remains: the
    # position near 10 m is rounded to 1e-6 m in each of some hundred substeps.
    *((e, drop, "position-verlet", np.float32, 1e-4) for e in (0.0, 0.3, 0.8, 1.0) for drop in (0.5, 10.0)),
    # Ballistic flight is exact for methods of order 2 and more, and so is the impact.
    *((0.8, 2.0, name, np.float64, 1e-9) for name, order in ORDERS.items() if order >= 2),
    # Energies of others are off by up to m g v h / 2 at the impact: relative h g / v, 0.33 % of a drop of 2 m at 480 substeps a
    # second; explicit Euler gains g^2 h^2 / 2 a step besides, g h / v relative over the fall and as much again on the way up.
    *((1.0, 2.0, name, np.float64, 4 / 480 * G / np.sqrt(4 * G)) for name, order in ORDERS.items() if order < 2),
]


@pytest.mark.parametrize(
    ("floor", "e", "drop", "name", "dtype", "within"),
    [(floor, *case) for floor in ("box", "channel", "cage", "circle") for case in REBOUNDS]
    + [(floor, *case) for floor in ("own box", "own cage") for case in REBOUNDS if case[4] == 1e-9]
    + [(floor, e, 1.3, "position-verlet", np.float64, 1e-9) for floor in SHAPES for e in (0.0, 0.5, 1.0)],
)
def test_rebound_is_e_squared_of_the_drop(floor: str, e: float, drop: float, name: str, dtype: type, within: float) -> None:
    world, ball = dropped_on(floor, e, drop, pv.integrators.BY_NAME[name](), dtype)
    assert rebound_height(world, ball) == pytest.approx(e * e * drop, abs=within * drop)
    if floor in SHAPES:
        assert ball.position[0, 0] == pytest.approx(0, abs=1e-12)
        assert e < 1 or world.energy().total == pytest.approx(G * (RADIUS + drop), rel=1e-12)
        assert e > 0 or ball.position[0, 1] == pytest.approx(RADIUS, abs=1e-12)


def test_corner_reflects_both_axes() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (10, 10), restitution=1.0), collisions=None, dtype=np.float64)
    ball = world.add(position=(1, 1), velocity=(-3, -3), radius=RADIUS)
    world.run(seconds=1)
    assert ball.velocity[0] == pytest.approx([3, 3], rel=1e-12)
    # 0.5 m to the rim's contact, back again 3 - 0.5 m
    assert ball.position[0] == pytest.approx([3, 3], rel=1e-12)


@pytest.mark.parametrize(
    ("radius", "heavy", "skin"),
    [
        (0.4, 30.0, None), (0.4, 30.0, 3.0), pytest.param(0.4, 30.0, 1.0, marks=pytest.mark.slow),
        pytest.param(0.4, 1.0, None, marks=pytest.mark.slow), pytest.param(0.5, 1.0, None, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_an_elastic_gas_in_float32_is_neither_heated_nor_cooled(radius: float, heavy: float, skin: float | None) -> None:
    # An impact rounds four components of velocities, each by at most u |v|, u = 2^-24, evenly distributed: its energy is off by
    # sum m v d, with the variance m^2 u^2 sum v^4 / 3. In Maxwell's distribution m <v^2> = T for each component, and <v^4> =
    # 3 <v^2>^2: that is 4 u^2 T^2. Those who meet are faster than others, which makes at most twice as much of it. If the errors
    # prefer no sign, N impacts of n circles, whose energy is n T, change it by 3 u sqrt(N) / n of it, a random walk. Normals
    # that are rounded to float32 change it by some ten times as much, always one way. The farther circles go before the list is
    # made anew, the coarser it is rounded how far they have come. Where masses are unequal it loses up to five times as
    # much, always one way.
    n = 300
    cage = radius * np.sqrt(n / 0.3)
    axis = np.arange(-cage, cage, 2.6 * radius)
    position = np.array([(x, y) for x in axis for y in axis if np.hypot(x, y) < cage - 1.2 * radius])[:n]
    mass = np.where(np.arange(n) % 2, 1.0, heavy)
    law = pv.Collisions(restitution=1.0, method=pv.Fast(skin=skin))
    world = pv.World(gravity=(0, 0), boundary=pv.Circle(radius=cage, restitution=1.0), collisions=law, events=True)
    velocity = 4 * radius * np.random.default_rng(0).normal(0, 1, position.shape)
    world.add(position=position, velocity=velocity / np.sqrt(mass)[:, None], radius=radius, mass=mass)
    energy, impacts = world.energy().total, 0
    for _ in each_frame(world, 900):
        impacts += len(world.events.begin)
    assert impacts > 5_000
    sure = 4 if heavy == 1.0 else 20
    assert world.energy().total == pytest.approx(energy, rel=sure * 3 * 2.0**-24 * np.sqrt(impacts) / n)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("e", "mu"), [(0.0, 0.0), (0.5, 0.3), (1.0, 0.0)])
@pytest.mark.parametrize("room", [pv.Circle, pv.Box])
def test_no_rim_stands_out_of_the_room_at_the_end_of_a_frame(room: type, e: float, mu: float, dtype: type) -> None:
    # A round wall bends away from the tangent by s^2 / 2 R in a way s: at 20 m/s and 50 ms by 10 radii of 2 cm.
    rng = np.random.default_rng(1)
    count = 200
    radius, angle, heading = rng.uniform(0.02, 0.3, count), *rng.uniform(0, 2 * np.pi, (2, count))
    out = np.sqrt(rng.uniform(0, 1, count)) * (2 - radius)
    for h in (0.002, 0.008, 0.05):
        walls = {"radius": 2.0} if room is pv.Circle else {"lower": (-2, -2), "upper": (2, 2)}
        boundary = room(**walls, restitution=e, friction=mu)
        world = pv.World(boundary=boundary, substeps=1, dtype=dtype, collisions=None, threads=1)
        world.add(
            position=out[:, None] * np.column_stack((np.cos(angle), np.sin(angle))), radius=radius,
            velocity=20 * np.column_stack((np.cos(heading), np.sin(heading))),
        )  # fmt: skip
        energy = world.energy().total
        for _ in each_frame(world, 40, h):
            x = np.abs(world.position.astype(float))
            reach = np.hypot(*x.T) if room is pv.Circle else x.max(axis=1)
            assert ((reach + radius - 2) / radius).max() < 1e-3
        if room is pv.Circle and e == 1.0:
            # Each of several bounces in a substep happens where and when it does.
            assert world.energy().total == pytest.approx(energy, rel=1e-12 if dtype is np.float64 else 1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_disc_that_slows_down_for_ever_stays_finite(dtype: type) -> None:
    # Wedged between a rubbing obstacle and a rubbing cage, without gravity, it slows to 1e-24 m/s, whose square underflows.
    world = pv.World(gravity=(0, 0), boundary=pv.Circle(radius=3, restitution=1, friction=1), dtype=dtype, threads=1)
    world.obstacles.append(pv.Segment((-2.9, -2), (2.9, -2), restitution=0.6, friction=1))
    disc = world.add(position=(0.02, -2.5), velocity=(1, 0.1), radius=0.5)
    world.run(seconds=5, dt=1 / 60)
    assert np.isfinite(disc.position).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("e", [0.0, 1.0])
@pytest.mark.parametrize(
    "room", [pv.Circle(radius=3, restitution=0.5, friction=0.5), pv.Circle(radius=3), pv.Box((-3, -3), (3, 3))]
)
def test_speeds_whose_squares_underflow_harm_nothing(room: pv.Boundary, e: float, dtype: type) -> None:
    tiny = float(np.finfo(dtype).tiny)
    slow = np.array([tiny, np.sqrt(tiny), 1e3 * np.sqrt(tiny), 1e-6 * tiny])
    world = pv.World(gravity=(0, 0), boundary=room, collisions=pv.Collisions(restitution=e), dtype=dtype, threads=1)
    x = np.array([2.5, -2.5, 0.0, 0.0])
    y = np.array([0.0, 0.0, 2.5, -2.5])
    out = np.column_stack((np.sign(x), np.sign(y)))
    world.add(position=np.column_stack((x, y)) * (1 + 1e-6), velocity=slow[:, None] * (out + 0.3 * out[:, ::-1]), radius=0.5)
    world.run(seconds=0.2, dt=1 / 60)
    assert np.isfinite(world.velocity).all()
    assert np.abs(world.velocity).max() < 1e-4


# ---- Clamp-and-flip and pure projection: what exactly they do wrong, in closed form, where the real bounds are right ----


H, MASS, SMALL = 1 / 60, 2.0, 0.25
FLOOR = pv.Box((-5, 0), (5, 20), restitution=1.0)


def dropped(boundary: pv.Boundary, integrator: pv.Integrator, height: float = 2.0) -> tuple[pv.World, pv.Group]:
    world = pv.World(boundary=boundary, integrator=integrator, collisions=None, substeps=1, dtype=np.float64)
    return world, world.add(position=(0, SMALL + height), radius=SMALL, mass=MASS)


def one_bounce(integrator: pv.Integrator) -> tuple[float, float, float]:
    """Energy gained over the first bounce (J), and where an open fall would have been in that step: depth (m), speed w (m/s)."""
    world, ball = dropped(pv.ClampAndFlip(FLOOR), integrator)
    free, falling = dropped(pv.Open(), integrator)
    while True:
        before, above = world.energy().total, float(falling.position[0, 1])
        world.step(H)
        free.step(H)
        depth = SMALL - float(falling.position[0, 1])
        if depth > 0:
            assert float(ball.position[0, 1]) == SMALL
            return world.energy().total - before, depth, (above - float(falling.position[0, 1])) / H


@pytest.mark.parametrize("integrator", [pv.VelocityVerlet(), pv.PositionVerlet()])
def test_clamp_and_flip_changes_the_energy_of_methods_of_second_order(integrator: pv.Integrator) -> None:
    # Lifted by d with the speed of d below the wall: m g d more than before, for a velocity that is of the time of x. That of
    # position Verlet turns from u = -w to w, and at the time of x is w + g h / 2 before, w - g h / 2 after: -m g h w + m g d.
    gain, depth, w = one_bounce(integrator)
    expected = depth if isinstance(integrator, pv.VelocityVerlet) else depth - w * H
    assert gain == pytest.approx(MASS * G * expected, rel=1e-9)


@pytest.mark.parametrize("name", [n for n, c in pv.integrators.BY_NAME.items() if c.order >= 2])
def test_the_real_wall_keeps_what_the_naive_one_does_not(name: str) -> None:
    def change(boundary: pv.Boundary) -> float:
        world, _ = dropped(boundary, pv.integrators.BY_NAME[name]())
        start = world.energy().total
        world.run(seconds=8.0, dt=H)
        return abs(world.energy().total / start - 1)

    assert change(FLOOR) < 1e-9
    assert change(pv.ClampAndFlip(FLOOR)) > 0.01


def test_restitution_scales_the_flip() -> None:
    world = pv.World(
        gravity=(0, 0), boundary=pv.ClampAndFlip(pv.Box((0, 0), (4, 4), restitution=0.5)), collisions=None, dtype=np.float64
    )
    ball = world.add(position=(3.4, 2.0), velocity=(3.0, 1.0), radius=0.5)
    world.run(seconds=0.5)
    assert ball.velocity[0] == pytest.approx((-1.5, 1.0), rel=1e-12)


def test_a_cage_reflects_about_its_normal() -> None:
    # Into the wall at 45 degrees to the normal: radial speed turned round, tangential kept.
    cage = pv.ClampAndFlip(pv.Circle(radius=5, restitution=1.0))
    world = pv.World(gravity=(0, 0), boundary=cage, collisions=None, substeps=1, dtype=np.float64)
    ball = world.add(position=(4.4, 0), velocity=(2.0, 2.0), radius=0.5)
    world.step(0.1)
    assert np.hypot(*ball.position[0]) == pytest.approx(4.5, rel=1e-12)
    assert np.hypot(*ball.velocity[0]) == pytest.approx(np.hypot(2, 2), rel=1e-12)
    normal = ball.position[0] / 4.5
    assert ball.velocity[0] @ normal == pytest.approx(-(2.0 * normal[0] + 2.0 * normal[1]), rel=1e-12)
    assert world.escaped() == 0


def test_projection_turns_depth_into_speed() -> None:
    # A circle that starts d inside the floor, at rest: moved by d in one step of h, it leaves with d / h.
    world = pv.World(
        gravity=(0, 0), boundary=pv.ProjectOnly(pv.Box((-5, 0), (5, 20))), collisions=None, substeps=1, dtype=np.float64
    )
    ball = world.add(position=(0, SMALL - 0.05), radius=SMALL)
    world.step(H)
    assert ball.velocity[0, 1] == pytest.approx(0.05 / H, rel=1e-12)
