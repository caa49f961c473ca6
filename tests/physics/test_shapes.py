"""Obstacles of every shape push what touches them, not before it does, and never take or give energy if they are elastic."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import G, each_frame, refused

import pyverlet as pv
from pyverlet.world.long_frames import parts_of

REACH, APART, DT = 0.3, 4.0, 1 / 60
"""Where a disc of radius 0.2 touches something round of radius 0.1, m; how far apart the round things are; a frame, s."""

OFFSETS = np.array([0.15, 0.5, 0.9, 0.999])
"""Of the reach: how far beside the centre the discs fall."""

GAPS = np.geomspace(1e-3, 2.0, 12)
"""Over where they would touch, m."""

ASIDE, ABOVE = (a.ravel() for a in np.meshgrid(OFFSETS, GAPS))
CENTRES = np.column_stack((APART * np.arange(len(ASIDE)), np.zeros(len(ASIDE))))


DOWN = np.array(((0.0, 0.0), (-0.02, -1.0), (0.02, -1.0)))  # flat parts begin at 0.9998 of the reach
PUT: dict[str, Callable[[pv.World], object]] = {
    "discs": lambda world: world.obstacles.extend([pv.Disc(centre, 0.1) for centre in CENTRES.tolist()]),
    "ends": lambda world: world.obstacles.extend([pv.Capsule((x, y - 1.0), (x, y), radius=0.1) for x, y in CENTRES.tolist()]),
    "corners": lambda world: world.obstacles.extend([pv.Polygon(centre + DOWN, radius=0.1) for centre in CENTRES]),
    "pinned": lambda world: world.add(position=CENTRES, radius=0.1).pin(),
    # Free ones, which a force holds against their weight.
    "carried": lambda world: world.forces.append(
        pv.ConstantForce((0, 9810.0), group=world.add(position=CENTRES, radius=0.1, mass=1000.0))
    ),
}


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("put", PUT)
def test_what_falls_past_something_round_is_not_pushed_before_it_is_there(put: str, friction: float) -> None:
    """y = y0 - g t^2 / 2 while (REACH offset)^2 + y^2 > REACH^2: the two discs touch where y = sqrt(1 - offset^2) REACH."""
    world = pv.World(collisions=pv.Collisions(restitution=0.9, friction=friction), dtype="float64")
    PUT[put](world)
    height = np.sqrt(1.0 - ASIDE**2) * REACH + ABOVE
    falling = world.add(position=CENTRES + np.column_stack((ASIDE * REACH, height)), radius=0.2, mass=1.0)
    lands = np.sqrt(2.0 * ABOVE / 9.81)
    for _ in each_frame(world, 40):
        free = world.time < lands - 1e-9
        np.testing.assert_allclose(falling.velocity[free, 0], 0.0, atol=1e-9)
        np.testing.assert_allclose(falling.velocity[free, 1], -9.81 * world.time, rtol=1e-9)
        touched = world.time > lands + 2 * DT
        assert (np.abs(falling.velocity[touched, 0]) > 1e-3).all(), "all have hit what is below them"


def test_what_turns_back_below_a_round_roof_does_not_bounce_there() -> None:
    """Thrown up inside a cage to heights h - gap below its roof: y = y0 + v t - g t^2 / 2 all the way."""
    for gap in GAPS[:8]:
        for x in (0.0, 1.5, 2.5):
            roof = np.sqrt(2.8**2 - x * x)
            world = pv.World(boundary=pv.Circle(center=(0, 0), radius=3.0), dtype="float64")
            up = np.sqrt(2 * 9.81 * (roof - gap))
            disc = world.add(position=(x, 0.0), velocity=(0.0, up), radius=0.2)
            while world.time < up / 9.81 + 0.2:
                world.step(DT)
                np.testing.assert_allclose(disc.velocity, [(0.0, up - 9.81 * world.time)], atol=1e-9)


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("angle", [5.0, 20.0, 60.0, 89.0, 91.0, 150.0])
def test_pointed_corners_are_as_round_as_blunt_ones(angle: float, radius: float) -> None:
    """A disc that falls onto a corner touches it where it is r + radius away from its point, on either side of the point.

    All that do so within the angle between the normals of the two faces, which is that of the corner less than 180 degrees.
    """
    half, reach = np.radians(angle) / 2, 0.2 + radius
    sides = 1.5 * np.array(((0.0, 0.0), (-np.sin(half), -np.cos(half)), (np.sin(half), -np.cos(half))))
    aside = np.linspace(-0.98, 0.98, 15) * np.cos(half) * reach
    speed = np.repeat((1.0, 30.0), len(aside))
    aside = np.tile(aside, 2)
    centres = np.column_stack((4.0 * np.arange(len(aside)), np.zeros(len(aside))))
    world = pv.World(gravity=(0, 0), dtype="float64", collisions=pv.Collisions(restitution=1.0))
    world.obstacles.extend([pv.Polygon(c + sides, radius=radius, restitution=1.0) for c in centres])
    # They touch after 0.123 s, and bounce as from a disc: the normal is (sin b, cos b) with sin b = aside / reach.
    above = np.sqrt(reach**2 - aside**2) + 0.123 * speed
    discs = world.add(position=centres + np.column_stack((aside, above)), velocity=-speed[:, None] * (0, 1), radius=0.2)
    world.run(seconds=0.15, dt=DT)
    turn = 2 * np.arcsin(aside / reach)
    np.testing.assert_allclose(discs.velocity, speed[:, None] * np.column_stack((np.sin(turn), np.cos(turn))), atol=1e-6 * 30)


def shape_of(rng: np.random.Generator) -> pv.Obstacle:
    """A disc, capsule, line or polygon about the origin, elastic."""
    centre, kind, radius = rng.uniform(-1, 1, 2), rng.integers(5), rng.choice([0.0, 0.1])
    if kind == 0:
        return pv.Disc(tuple(centre), rng.uniform(0.1, 1.0), restitution=1.0)
    if kind == 1:
        ends = centre + rng.uniform(-1, 1, (2, 2))
        return pv.Capsule(*ends, radius=rng.choice([0.01, 0.1, 0.3]), restitution=1.0)
    if kind == 2:
        return pv.Segment(*(centre + rng.uniform(-1, 1, (2, 2))), restitution=1.0)
    if kind == 3:
        corners = centre + np.cumsum(rng.uniform(-0.7, 0.7, (rng.integers(3, 6), 2)), axis=0)
        return pv.Chain(corners, closed=bool(rng.random() < 0.4), radius=radius, restitution=1.0)
    angle = 2 * np.pi / 3 * np.arange(3) + rng.uniform(-0.9, 0.9, 3)
    flat = rng.choice([0.1, 1.0])
    return pv.Polygon(centre + np.column_stack((np.cos(angle), flat * np.sin(angle))), radius=radius, restitution=1.0)


@pytest.mark.parametrize("moves", [False, True])
def test_elastic_obstacles_of_any_shape_take_and_give_no_energy(moves: bool) -> None:
    """|v - V| of each disc is kept by an obstacle with velocity V, whether it is met by a face, an end or a corner, and however
    fast: at 40 m/s a disc of radius 0.02 moves four radii in a substep.
    """
    rng = np.random.default_rng(7)
    for _ in range(15):
        obstacle = shape_of(rng)
        obstacle.velocity = drift = rng.normal(0, 2, 2) if moves else np.zeros(2)
        world = pv.World(gravity=(0, 0), dtype="float64", collisions=None)
        world.obstacles.append(obstacle)
        angle, speed = rng.uniform(0, 2 * np.pi, 300), rng.choice([0.3, 2.0, 10.0, 40.0], 300)
        out = np.column_stack((np.cos(angle), np.sin(angle)))
        velocity = speed[:, None] * (rng.normal(0, 0.2, (300, 2)) - out) + drift
        discs = world.add(position=6 * out, velocity=velocity, radius=rng.choice([0.02, 0.2, 0.5], 300))
        world.run(seconds=2.0, dt=DT)
        np.testing.assert_allclose(np.hypot(*(discs.velocity - drift).T), np.hypot(*(velocity - drift).T), rtol=1e-9)


# ---- Worlds of any size: what is scaled in length and mass is the same world, and slow worlds take long frames in few substeps
# ----


GRAVITATION = 6.674e-11


def built(length: float, mass: float, dtype: str, *, friction: float, linked: bool) -> pv.World:
    """Thrown discs, obstacles, links and drag; lengths and masses times these powers of two: all roundings are the same."""
    rng = np.random.default_rng(1)
    world = pv.World(
        gravity=(0, -9.75 * length), boundary=pv.Box((0, 0), (12 * length, 12 * length), restitution=0.5, friction=friction),
        collisions=pv.Collisions(restitution=0.5, friction=friction, rolling_resistance=friction / 8), dtype=dtype,
    )  # fmt: skip
    k = np.arange(36)
    place, speed, radius = (
        rng.integers(*span, (36, *shape)) / 256 for span, shape in (((0, 40), (2,)), ((-800, 800), (2,)), ((60, 140), ()))
    )
    place += np.column_stack((1.5 + 1.375 * (k % 7), 1.5 + 1.375 * (k // 7)))
    discs = world.add(position=place * length, velocity=speed * length, radius=radius * length, mass=(1 + k % 3) * mass)
    world.obstacles.append(pv.Segment((2 * length, 10 * length), (5 * length, 11 * length)))
    world.obstacles.append(pv.Disc((9 * length, 10.5 * length), 0.5 * length))
    world.forces.append(pv.Drag(linear=0.125 * mass))
    if linked:
        world.links.append(pv.Stick(discs, [0, 1], [1, 2]))
        world.links.append(pv.Spring(discs, 10, 11, stiffness=64.0 * mass, damping=0.5 * mass))
    return world


def grains(length: float, mass: float, dtype: str, *, elastic: bool) -> pv.World:
    """Discs of radii of 1:10, of densities too: a pile that has come to rest in the end, or a gas in a cage."""
    rng, k = np.random.default_rng(1), np.arange(144)
    room = pv.Circle(center=(9.5 * length, 4.5 * length), radius=12 * length, restitution=1.0)
    box = pv.Box((0, 0), (20 * length, 15 * length), friction=0.4)
    law = pv.Collisions(restitution=1.0) if elastic else pv.Collisions(friction=0.4)
    world = pv.World(gravity=(0, 0 if elastic else -10 * length), boundary=room if elastic else box, collisions=law, dtype=dtype)
    place, speed = 1.0 + np.column_stack((k % 18, k // 18)), np.round(128 * rng.normal(0, elastic, (144, 2))) / 64
    radius = np.round(256 * rng.uniform(0.05, 0.45, 144)) / 256
    world.add(position=place * length, velocity=speed * length, radius=radius * length, mass=(1 + k % 3) * mass)
    return world


KINDS: dict[str, tuple[Callable[..., pv.World], dict[str, Any], int]] = {
    "smooth": (built, {"friction": 0.0, "linked": False}, 32), "rough and linked": (built, {"friction": 0.5, "linked": True}, 32),
    "gas": (grains, {"elastic": True}, 120), "pile": (grains, {"elastic": False}, 300),
}  # fmt: skip


@pytest.mark.parametrize(("length", "mass"), [(2.0**10, 1.0), (2.0**-20, 2.0**-40), (1.0, 2.0**12)])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_lengths_and_masses_may_be_scaled(dtype: str, kind: str, length: float, mass: float) -> None:
    make, how, frames = KINDS[kind]
    plain, scaled = (make(*scale, dtype, **how) for scale in ((1.0, 1.0), (length, mass)))
    for world in (plain, scaled):
        world.run(seconds=frames / 64, dt=1 / 64)
    assert np.array_equal(scaled.position, plain.position * plain.dtype.type(length))
    assert np.array_equal(scaled.velocity, plain.velocity * plain.dtype.type(length))
    assert kind != "pile" or np.abs(plain.velocity).max() < 1e-3


@pytest.mark.parametrize("dt", [pytest.param(10.0, marks=pytest.mark.slow), 600.0])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_moons_collide_in_frames_of_minutes(restitution: float, dt: float) -> None:
    # From rest at a distance of 4 r two equal moons meet with v^2 = 2 G m (1 / 2 r - 1 / 4 r) each relative to both, and
    # separate to d with 1 / d = 1 / 2 r - e^2 / 4 r. The energy of the way there is that of the integrator: (v h / r)^2 of it.
    radius, mass = 1e6, 7e22
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=restitution), dtype="float64")
    moons = world.add(position=[(-2 * radius, 0), (2 * radius, 0)], radius=radius, mass=mass)
    world.forces.append(pv.Gravitation(strength=GRAVITATION))
    farthest, met, parts = 0.0, False, 0
    for _ in each_frame(world, round(12000 / dt), dt):
        parts = max(parts, parts_of(world, dt))
        apart = float(np.diff(moons.position[:, 0])[0]) / radius
        met = met or apart < 2.05 or float(np.diff(moons.velocity[:, 0])[0]) > 0
        farthest = max(farthest, apart if met else 0.0)
    assert parts <= 20  # of a frame of ten minutes: as thirtieths of a second they were 18,000
    assert farthest == pytest.approx(1 / (0.5 - 0.25 * restitution**2), rel=2e-3, abs=0.06 * (restitution < 1))
    assert world.energy().total <= -GRAVITATION * mass**2 / (4 * radius) * (1 - 1e-3)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("radius", [1e-2, 1e-3, 1e-4, 1e-6])
def test_piles_of_small_circles_bear_their_weight_at_sixty_frames_a_second(radius: float, dtype: Any) -> None:
    # A contact that bears a load F is F h^2 / (1.96^2 M) deep, with M = m / 2 of a pair. Nine rows stand in columns: the pair
    # below the uppermost row bears one circle, the lowest eight.
    world = pv.World(boundary=pv.Box((0, 0), (20 * radius, 100 * radius)), dtype=dtype)
    row, column = np.divmod(np.arange(72), 8)
    world.add(position=radius * np.column_stack((1.5 + 2.2 * column, 1.2 + 2.2 * row)), radius=0.95 * radius)
    world.run(seconds=3, dt=1 / 60)
    h = 1 / 60 / world.substeps / parts_of(world, 1 / 60)
    of_one = 2 * G * h * h / 1.96**2 / (2 * 0.95 * radius)
    overlap, fastest = world.overlap(), float(np.hypot(*world.velocity.T).max())
    assert fastest < 1e-3 * np.sqrt(G * radius)
    assert of_one < 0.013
    assert overlap.max == pytest.approx(8 * of_one, rel=0.05)
    assert overlap.mean == pytest.approx(4.5 * of_one, rel=0.05)


@pytest.mark.parametrize(
    ("radii", "dts", "parts"),
    [
        # ceil(sqrt(g h^2 / (r / 25))) with h = 1/480 s, and 32 at most; frames longer than a thirtieth of a second as ever.
        ((0.5, 2e-3, 1e-3, 1e-4, 1e-6, 1e-9), (1 / 60,), [1, 1, 2, 4, 32, 32]),
        ((0.5,), (1 / 60, 1 / 30, 0.05, 0.25), [1, 1, 2, 8]),
    ],
)
def test_frames_are_cut_where_contacts_would_not_bear_circles(radii: Any, dts: Any, parts: list[int]) -> None:
    found = []
    for radius in radii:
        world = pv.World(boundary=pv.Box((0, 0), (20 * radius, 20 * radius)))
        world.add(position=radius * np.array([(3, 1.5), (6, 1.5)]), radius=radius)
        world.step(1 / 60)
        found += [parts_of(world, dt) for dt in dts]
    assert found == parts


def test_where_nothing_moves_a_frame_may_be_of_any_length() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Circle(radius=10))
    world.add(position=[(0, 0), (3, 0)], radius=0.5)
    world.step(1e6)
    assert world.time == 1e6
    assert np.array_equal(world.position, [(0, 0), (3, 0)])


@pytest.mark.parametrize("collisions", [pv.Collisions(restitution=1), None])
@pytest.mark.parametrize("room", [pv.Open(), pv.Box((-5, 0), (5, 5), restitution=1)])
def test_long_frames_are_cut_for_a_single_circle_too(room: pv.Boundary, collisions: pv.Collisions | None) -> None:
    # Dropped by 5 cm it bounces every 0.2 s; its energy stays what it was.
    world = pv.World(boundary=room, collisions=collisions, dtype=np.float64)
    if isinstance(room, pv.Open):
        world.obstacles.append(pv.Segment((-5, 0), (5, 0), restitution=1))
    world.add(position=(0, 0.55), radius=0.5)
    energy = world.energy().total
    world.run(seconds=4, dt=0.25)
    assert world.energy().total == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("dt", [1e300, 1e9, 1e5])
def test_a_frame_that_would_never_end_is_refused(dt: float) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (9, 9)))
    world.add(position=(3, 3))
    before = world.state_hash()
    refused(f"dt is {dt:g}, which takes .* substeps here; allowed are 100,000".replace("+", r"\+"), world.step, dt)
    assert world.state_hash() == before
