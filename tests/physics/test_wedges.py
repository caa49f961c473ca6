"""Surfaces that close in on a circle: however narrow the wedge is, it stays in the room and gets no faster than they make it."""

import itertools
import time
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, points

import pyverlet as pv

PUSH, DRAG, ROLL = 8, 9, 10
"""Columns, as in `core/surface_rows.py`."""


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.8])
@pytest.mark.parametrize(("room", "dtype"), [("box", "float32"), ("cage", "float64"), ("cage", "float32")])
def test_circles_between_a_wall_and_a_pinned_circle_that_moves_into_it(
    room: str, dtype: str, friction: float, restitution: float
) -> None:
    # Their normals become ever more opposite: to give way at speed s, a circle would have to leave at s / sin(angle).
    # It gets eight times s, and again in the next wedge; where that is not enough, it is overlapped. Elastic ones may get more:
    # between surfaces that close in on each other v d is kept.
    rng = np.random.default_rng(0)
    boundary = pv.Circle(radius=10) if room == "cage" else pv.Box((-10, -10), (10, 10))
    boundary.restitution, boundary.friction = restitution, friction
    law = pv.Collisions(restitution=restitution, friction=friction)
    world = pv.World(boundary=boundary, gravity=(0, 0), collisions=law, dtype=dtype)
    angle, speed = np.linspace(0, 2 * np.pi, 12, endpoint=False), 13.0
    out = np.column_stack((np.cos(angle), np.sin(angle)))
    pistons = world.add(position=5 * out, radius=1.0, velocity=speed * out, mass=np.inf)
    # The small ones do not meet each other: what one is given it keeps.
    world.add(position=rng.uniform(-6.5, 6.5, (400, 2)), radius=0.05, on_overlap="push", category=2, mask=1)
    small = np.arange(len(pistons), len(world))
    for _ in each_frame(world, 60):
        place, fast = world.position[small], np.hypot(*world.velocity[small].T)
        inside = np.hypot(*place.T) < 10 if room == "cage" else (np.abs(place) < 10).all(axis=1)
        assert inside.all()
        assert restitution == 1 or fast.max() < 8 * 2 * speed


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("friction", [0.8, 2.0])
def test_what_lets_go_of_a_wedge_takes_back_its_friction_and_its_roll(friction: float, restitution: float) -> None:
    # Where friction would hold a circle in a wedge that closes, surfaces are solved once more without it. What they gave along
    # the tangent and against rolling is not given, and not remembered: |j_t| <= mu j and |L| <= c r j.
    rough: dict[str, Any] = {"restitution": restitution, "friction": friction, "rolling_resistance": 0.3}
    law = pv.Collisions(restitution=restitution, friction=friction, rolling_resistance=0.3)
    world = pv.World(boundary=pv.Box((-10, -10), (10, 10), **rough), gravity=(0, 0), collisions=law, dtype="float64")
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    for x, y in zip(np.cos(angle), np.sin(angle), strict=True):
        world.obstacles.append(pv.Disc((5 * x, 5 * y), 1.0, velocity=(13 * x, 13 * y), angular_velocity=7.0, **rough))
    rng = np.random.default_rng(0)
    place, spin = rng.uniform(-6.5, 6.5, (400, 2)), rng.normal(0, 30, 400)
    world.add(position=place, radius=0.05, spin=spin, on_overlap="push", category=2, mask=1)
    most = 0.0
    for _ in each_frame(world, 60):
        arrays = world._frames.held.engine.arrays
        for side in "01":
            push, drag, roll = (arrays[f"contact{side}"][:, column] for column in (PUSH, DRAG, ROLL))
            assert (np.abs(drag) <= friction * push * (1 + 1e-9)).all()
            assert (np.abs(roll) <= 0.3 * 0.05 * push * (1 + 1e-9)).all()
            most = max(most, float(push.max(initial=0.0)))
    assert most > 1.0


# ---- Circles wider than the gap between two pinned ones do not pass it, at any speed that the list of pairs can follow ----


PEGS = [(-0.4, 0.0), (0.4, 0.0)]
PEG = 0.3
GAP = 0.8 - 2 * PEG
TOO_LARGE = 1.05 * GAP / 2


def corner(radius: float) -> float:
    """Height at which a circle touches both pegs: the distance to each is PEG + radius, and 0.4 of it along the line."""
    return float(np.sqrt((PEG + radius) ** 2 - 0.4**2))


def sieve(speed: float, *, above: float = 2.0, radius: float = TOO_LARGE, x: float = 0.0, **options: Any) -> tuple[pv.World, Any]:
    options = {"collisions": pv.Collisions(restitution=0.1, friction=0.2), "threads": 1, **options}
    world = pv.World(**options)
    world.add(position=PEGS, radius=PEG).pin()
    return world, world.add(position=(x, above), velocity=(0, -speed), radius=radius)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("speed", [1, 4, 8, 16, 32, 64])
@pytest.mark.parametrize("x", [0.0, 0.002])
def test_a_circle_too_large_does_not_pass_between_pegs(speed: float, x: float, dtype: Any) -> None:
    world, ball = sieve(speed, x=x, dtype=dtype)
    lowest = min(float(ball.position[0, 1]) for _ in each_frame(world, 90))
    assert lowest == pytest.approx(corner(TOO_LARGE), abs=1e-6)
    assert ball.position[0, 1] == pytest.approx(corner(TOO_LARGE), abs=1e-3)
    assert ball.velocity[0] == pytest.approx(0, abs=1e-6)


def test_nor_from_below_and_one_that_fits_falls_through() -> None:
    below: dict[str, Any] = {"above": -2.0, "gravity": (0, 0)}
    for speed, radius, passes, how in ((-16, TOO_LARGE, False, below), (8, 0.95 * GAP / 2, True, {})):
        world, ball = sieve(speed, radius=radius, **how)
        world.run(seconds=1.0)
        assert ball.position[0, 1] < -2 if passes else ball.position[0, 1] <= -0.99 * corner(TOO_LARGE)


@pytest.mark.parametrize(("mass", "friction"), [(1.0, 0.3), (20.0, 0.0)])
def test_nor_under_a_pile_of_twenty_layers(mass: float, friction: float) -> None:
    room = pv.Box((-0.7, -3), (0.7, 12))
    world, ball = sieve(0, above=0.075, boundary=room, collisions=pv.Collisions(friction=friction))
    x, y = np.meshgrid([-0.35, 0.0, 0.35], 0.5 + 0.42 * np.arange(20))
    pile = world.add(position=np.column_stack((x.ravel() + 0.03 * (np.arange(60) % 2), y.ravel())), radius=0.17, mass=mass)
    world.run(seconds=5)
    assert ball.position[0, 1] == pytest.approx(corner(TOO_LARGE), abs=1e-3)
    assert (pile.position[:, 1] > -0.17).all()


def test_pegs_that_move_push_nobody_through_a_wall() -> None:
    # Two of infinite mass on their way down, nearer to each other than what lies under them is wide: the room wins.
    world = pv.World(boundary=pv.Box((-3, 0), (3, 6)), dtype=np.float64, threads=1)
    world.add(position=[(-0.5, 1.6), (0.5, 1.6)], velocity=(0, -1.0), radius=0.3, mass=np.inf)
    disc = world.add(position=[(0, 0.5)], radius=0.5)
    for _ in each_frame(world, 90):
        assert disc.position[0, 1] > 0.5 * (1 - 1e-3)


# ---- What a pair does is decided by the pair: a circle many times as large elsewhere in the world changes nothing of it ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("giant", [0.0, 0.3, 10.0, 900.0])
@pytest.mark.parametrize("offset", [0.0, 0.05, 0.12, 0.13])
def test_smooth_inelastic_circles_leave_along_the_tangent_of_where_they_touch(offset: float, giant: float, dtype: Any) -> None:
    # Two of equal mass that meet with speeds v and -v, e = 0: along the normal n both stop, across it each keeps its speed.
    # Pairs that begin a substep farther apart than a part of their radius are impacts; that part was one of the largest radius.
    world = pv.World(gravity=(0, 0), dtype=dtype)
    if giant:
        world.add(position=(1000, 0), radius=giant)
    pair = world.add(position=[(0, 0), (1.0, offset)], radius=0.1, velocity=[(4.0, 0), (-4.0, 0)])
    world.run(seconds=0.4)
    sine = offset / 0.2
    across = np.array((-sine, np.sqrt(1 - sine * sine)))
    kept = 4.0 * across[0] * across
    assert pair.velocity[0] == pytest.approx(kept, abs=1e-4 if dtype == np.float32 else 1e-12)
    assert pair.velocity[1] == pytest.approx(-kept, abs=1e-4 if dtype == np.float32 else 1e-12)


# ---- Circles that come nearer by any part of their size in a substep, or many times it, meet where and when they should ----


FRAME, SUBSTEPS = 1 / 60, 8


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("way", [0.12, 0.3, 0.8, 1.5, 4.0, 12.0])
def test_two_meet_however_fast(way: float, restitution: float, dtype: str) -> None:
    # way: of r_i + r_j, in a substep. J = (1 + e) (v . n) / (1 / m_i + 1 / m_j) along n, the normal where they touch:
    # with the impact parameter b (r_i + r_j), n = (sqrt(1 - b^2), b).
    cases = itertools.product([0.0, 0.3, 0.9], [(0.2, 0.2, 2.0), (0.05, 0.3, 1000.0)], [0.0, 0.6])
    for b, (ri, rj, heavy), phase in cases:
        reach, masses = ri + rj, np.array([1.0, heavy])
        speed = way * reach / (FRAME / SUBSTEPS)
        world = pv.World(gravity=(0, 0), dtype=dtype, collisions=pv.Collisions(restitution=restitution))
        away = reach + (3.37 + phase) * way * reach
        world.add(position=[(0, 0), (away, b * reach)], radius=[ri, rj], mass=masses, velocity=[(speed, 0), (0, 0)])
        world.run(seconds=2 / 60)
        n = np.array([np.sqrt(1 - b * b), b])
        impulse = (1 + restitution) * speed * n[0] / (1 / masses).sum() * n
        after = np.array([(speed, 0) - impulse / masses[0], impulse / masses[1]])
        # Places are rounded to eps of the whole way, which turns the normal by that over reach sqrt(1 - b^2). Without restitution
        # and friction slow ones are stopped along the normal at the beginning of the substep.
        turned = 20 * np.finfo(dtype).eps * (away / reach + 1) / np.sqrt(1 - b * b)
        assert np.abs(world.velocity - after).max() < (way / 2 if restitution == 0 and way < 0.2 else turned) * speed


@pytest.mark.parametrize("restitution", [0.0, 0.7, 1.0])
def test_shots_go_through_no_row_of_a_crowd(restitution: float) -> None:
    # Few fast ones among many: these are listed by their ways, the others by the skin.
    world = pv.World(gravity=(0, 0), dtype="float64", collisions=pv.Collisions(restitution=restitution))
    world.add(position=points(np.arange(40) * 1.0, np.arange(40) * 1.0), radius=0.3)
    # Radii a substep. What has been hit without restitution and is hit again carries load, and is pushed by springs: not at once.
    way = np.array([5.0, 9.0, 20.0] if restitution else [1.0, 1.5, 2.0])
    rows, speed = np.array([4, 11, 23]), way * 0.3 * SUBSTEPS / FRAME
    shots = world.add(
        position=np.column_stack((np.full(3, -7.0), rows)), radius=0.3, velocity=np.column_stack((speed, np.zeros(3)))
    )
    world.run(seconds=4 / 60)
    for k, row in enumerate(rows):
        line = np.array([shots.index[k], *(40 * row + np.arange(40))])
        assert (np.diff(world.position[line, 0]) > 0.3).all()  # nobody has passed anybody
        assert world.velocity[line].sum(axis=0) == pytest.approx((speed[k], 0), rel=1e-12)
        if restitution == 1:  # each gives all it has to the next
            assert world.velocity[line, 0] == pytest.approx([0] * 40 + [speed[k]], abs=1e-9 * speed[k])
    others = np.setdiff1d(np.arange(1600), (40 * rows[:, None] + np.arange(40)).ravel())
    assert not world.velocity[others].any()


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_crowd_that_moves_by_many_radii_a_substep_ends_its_frame(restitution: float) -> None:
    # 1,900 circles that cover the room, 15 radii a substep: a frame once took ten seconds, and once ended with no numbers.
    rng = np.random.default_rng(0)
    law = pv.Collisions(restitution=restitution)
    crowd, calm = (pv.World(boundary=pv.Box((-10, -10), (10, 10)), substeps=1, collisions=law, threads=1) for _ in range(2))
    place = rng.uniform(-9.7, 9.7, (1900, 2))
    for world, speed in ((crowd, 15 * 0.2 * 60), (calm, 0.1)):
        world.add(position=place, radius=0.2, on_overlap="push", velocity=rng.normal(0, speed / 1.4, (1900, 2)))
    took = []
    for world in (calm, crowd):
        start, energy = time.process_time(), world.energy().kinetic
        world.run(seconds=8 / 60)
        took.append(time.process_time() - start)
        assert world.energy().kinetic < 1.01 * energy or world is calm
    assert took[1] < 100 * took[0]
    assert (np.abs(crowd.position) <= 10).all()
