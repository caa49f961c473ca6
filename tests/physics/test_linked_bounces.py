"""Linked particles that bounce: a blow acts on all that rigid links join, so that -e times the normal velocity of before is left.

Of a rigid body with mass M and moment of inertia I, a contact at r from its centre has the inverse mass along the normal n
1 / m_eff = 1 / M + (r x n)^2 / I, and the impulse is J = (1 + e) v_n m_eff. With e = 1 it changes no energy:
J (v_n' + v_n) / 2 = 0 for v_n' = -v_n. Off that the engine is of second order in the angle w h by which bodies turn in a substep:
(5/s / 480/s)^2 = 1e-4 of the energy of turning.
"""

from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G

import pyverlet as pv

SHAPES: dict[str, tuple[list[tuple[float, float]], list[tuple[int, int]]]] = {
    "dumb-bell": ([(-0.25, 0), (0.25, 0)], [(0, 1)]),
    "triangle": ([(-0.25, 0), (0.25, 0), (0, 0.4)], [(0, 1), (1, 2), (0, 2)]),
    "square": ([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)], [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]),
}
BOTH = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def add_body(world: pv.World, shape: str, centre: Any, angle: float, velocity: Any, turning: float) -> Any:
    """A rigid body of discs of 1 kg."""
    place, joined = SHAPES[shape]
    c, s = np.cos(angle), np.sin(angle)
    arm = np.array(place, float) @ np.array([[c, s], [-s, c]])
    speed = np.array(velocity) + turning * np.column_stack((-arm[:, 1], arm[:, 0]))
    group = world.add(position=arm + centre, velocity=speed, radius=0.1, mass=1.0)
    for i, j in joined:
        world.links.append(pv.Stick(group, i, j))
    return group


@BOTH
@pytest.mark.parametrize("restitution", [0.5, 1.0])
@pytest.mark.parametrize("angle", np.radians([25, 45, 65, 85]))
def test_a_dumb_bell_bounces_as_a_rigid_body(dtype: Any, restitution: float, angle: float) -> None:
    # Two of 1 kg, half a metre apart: M = 2, I = 2 (1/4)^2, and the lower one is at r = -(cos a, sin a) / 4 from the centre.
    world = pv.World(gravity=(0, 0), boundary=pv.Box((-9, 0), (9, 9), restitution=restitution), dtype=dtype)
    body = add_body(world, "dumb-bell", (0, 0.11 + 0.25 * np.sin(angle)), angle, (0, -3.0), 0.0)
    for _ in range(2):  # it meets the floor after 3 ms; the other one is too far from it
        world.step(FRAME / 2)
    arm = 0.25 * np.cos(angle)
    push = (1 + restitution) * 3.0 / (1 / 2 + arm**2 / 0.125)
    turning = -push * arm / 0.125
    seen = body.velocity.mean(axis=0)[1], world.angular_momentum() / 0.125
    assert seen[0] == pytest.approx(-3.0 + push / 2, rel=1e-3)  # of the angle that is left when it meets: w h at most
    assert abs(seen[1]) == pytest.approx(abs(turning), rel=1e-3)


@BOTH
@pytest.mark.parametrize("gravity", [0.0, -9.81])
@pytest.mark.parametrize("shape", SHAPES)
def test_elastic_bodies_keep_their_energy(dtype: Any, shape: str, gravity: float) -> None:
    # About 25 bounces, each off by 1e-4 at most, up or down. By the law for particles alone 99 % went.
    chance = np.random.default_rng(7)
    world = pv.World(gravity=(0, gravity), boundary=pv.Box((0, 0), (2, 2), restitution=1.0), dtype=dtype)
    add_body(world, shape, (1, 1), chance.uniform(0, 6), chance.normal(0, 4, 2), chance.normal(0, 3))
    lowest = 9.81 * world.mass.sum() * 0.1 if gravity else 0.0
    start = world.energy().total - lowest
    world.run(seconds=5, dt=FRAME)
    assert world.energy().total - lowest == pytest.approx(start, rel=1e-3)


@BOTH
def test_elastic_dumb_bells_that_collide_keep_their_energy(dtype: Any) -> None:
    # Where several blows strike one body within a substep, some is lost.
    chance = np.random.default_rng(7)
    law = pv.Collisions(restitution=1.0)
    world = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (4, 4), restitution=1.0), collisions=law, dtype=dtype)
    for centre in ((1, 1), (3, 1), (1, 3), (3, 3)):
        add_body(world, "dumb-bell", centre, chance.uniform(0, 6), chance.normal(0, 2, 2), chance.normal(0, 3))
    start = world.energy().total
    world.run(seconds=5, dt=FRAME)
    assert world.energy().total == pytest.approx(start, rel=1e-2)


@BOTH
def test_a_blow_keeps_momentum_and_angular_momentum(dtype: Any) -> None:
    # A disc hits a spinning square, off its centre. Impulses between two act along the line of their centres at that time, but
    # for c h^2 / 8, by which what links give with acceleration c bends paths: here 9 0.3 / 480^2 / 8 m of 0.2, 1e-5 of the blow.
    world = pv.World(gravity=(0, 0), boundary=None, collisions=pv.Collisions(restitution=1.0), dtype=dtype)
    add_body(world, "square", (0, 0), 0.4, (0, 0), 3.0)
    disc = world.add(position=[(1, 0.15)], velocity=(-4, 0), radius=0.1, mass=1.5)
    energy, turn = world.energy().total, world.angular_momentum()
    world.run(seconds=0.5, dt=FRAME)
    assert np.abs(disc.velocity - (-4, 0)).max() > 0.5  # it has been hit
    assert (world.mass[:, None] * world.velocity).sum(axis=0) == pytest.approx([-6, 0], abs=1e-4)
    assert world.angular_momentum() == pytest.approx(turn, rel=1e-3)
    assert world.energy().total == pytest.approx(energy, rel=1e-3)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_what_rests_goes_on_resting(restitution: float) -> None:
    world = pv.World(
        boundary=pv.Box((0, 0), (4, 4), restitution=restitution, friction=0.3),
        collisions=pv.Collisions(restitution=restitution, friction=0.3),
    )
    for x in (1.0, 2.0, 3.0):
        add_body(world, "square", (x, 0.3), 0.0, (0, 0), 0.0)
    world.run(seconds=2, dt=FRAME)
    assert np.abs(world.velocity).max() < 1e-4
    assert world.position[:, 1].min() == pytest.approx(0.1, abs=1e-3)


# ---- Circles, rooms and obstacles with e = 1 keep their energy under gravity, whatever rests or is thrown at what ----


PEGS = [pv.Disc((x, 0.5), 0.05, restitution=1.0) for x in (0.5, 1.5, 2.5, 3.3)]
SLOPES = [pv.Segment((0, 0.5), (2, 0), restitution=1.0), pv.Polygon([(2, 0), (4, 0), (4, 0.6)], restitution=1.0)]

CASES: dict[str, dict[str, Any]] = {
    "box": {}, "float32": {"dtype": np.float32}, "frames of 1/30 s": {"dt": 1 / 30}, "from rest": {"speed": 0.0},
    "cage": {"boundary": pv.Circle(center=(2, 2), radius=2.6, restitution=1.0)}, "masses": {"mass": 100.0},
    "radii": {"radius": 3.0}, "pegs": {"obstacles": PEGS}, "slopes": {"obstacles": SLOPES},
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_circles_that_bounce_without_loss_keep_their_energy(name: str) -> None:
    """sum(m v^2 / 2 + m g y) is kept but for bounces slower than 4 g h, which end: each costs m (4 g h)^2 / 2.

    With h = 1/480 s that is 3e-3 J/kg of the 20 J/kg that each has.
    """
    case = dict(CASES[name])
    rng, k = np.random.default_rng(1), np.arange(40)
    world = pv.World(
        boundary=case.get("boundary", pv.Box((0, 0), (4, 4), restitution=1.0)),
        dtype=case.get("dtype", np.float64),
        collisions=pv.Collisions(restitution=1.0),
    )
    world.obstacles.extend(case.get("obstacles", []))
    place = np.column_stack((0.35 + 0.37 * (k % 10), 1.0 + 0.32 * (k // 10))) + rng.uniform(-0.02, 0.02, (40, 2))
    world.add(
        position=place, velocity=case.get("speed", 1.0) * rng.normal(0, 1, (40, 2)),
        radius=0.1 * case.get("radius", 1.0) ** rng.uniform(-1, 0, 40), mass=case.get("mass", 1.0) ** rng.uniform(0, 1, 40),
    )  # fmt: skip
    start = world.energy().total
    moves = world.energy().kinetic + float((world.mass * G * (world.position[:, 1] - world.position[:, 1].min())).sum())
    world.run(seconds=8.0, dt=case.get("dt", FRAME))
    assert world.energy().total == pytest.approx(start, abs=1e-3 * moves)


@pytest.mark.parametrize("aside", [0.0, 0.05, 0.12])
@pytest.mark.parametrize("support", ["floor", "slab", "peg", "pinned", "cage"])
def test_a_blow_on_what_rests_bounces_back_from_below(support: str, aside: float) -> None:
    """A ball falls onto a disc that lies on something elastic: the disc is thrown at that, comes back, and nothing is lost.

    What the disc lies with is: at most the blow of m g h that it is held by in a substep, m v g h of energy for a speed v.
    """
    room: pv.Boundary | None = pv.Circle(center=(0, 3), radius=3.0, restitution=1.0) if support == "cage" else None
    room = pv.Box((-3, 0), (3, 6), restitution=1.0) if support == "floor" else room
    world = pv.World(boundary=room, dtype=np.float64, collisions=pv.Collisions(restitution=1.0))
    if support == "slab":
        world.obstacles.append(pv.Polygon([(-3, -1), (3, -1), (3, 0), (-3, 0)], restitution=1.0))
    elif support == "peg":
        world.obstacles.append(pv.Disc((0, -0.5), 0.5, restitution=1.0))
    elif support == "pinned":
        world.add(position=(0, -0.5), radius=0.5, mass=1.0).pin()
    rests = world.add(position=(0.0, 0.1), radius=0.1, mass=1.0)
    world.run(seconds=0.3, dt=FRAME)
    assert abs(rests.velocity[0, 1]) < 1e-3
    world.add(position=(aside, 0.6), velocity=(0.0, -3.0), radius=0.1, mass=1.0)
    start, speed = world.energy().total, np.hypot(3.0, np.sqrt(2 * G * 0.4))
    world.run(seconds=0.3, dt=FRAME)
    assert world.velocity[-1, 1] > -3.0 - G * 0.3 + 0.1, "it has struck"
    assert world.energy().total == pytest.approx(start, abs=2 * speed * G * FRAME / 8)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_blow_goes_down_a_stack_and_comes_back(count: int) -> None:
    """Equal elastic discs hand a blow on to the next, the floor gives it back: the last one leaves as fast as it came.

    At the height at which it began, v = -v_0, but for the time that the blow takes: g of a substep for each disc.
    """
    world = pv.World(
        boundary=pv.Box((-3, 0), (3, 9), restitution=1.0), dtype=np.float64, collisions=pv.Collisions(restitution=1.0)
    )
    for k in range(count):
        world.add(position=(0, 0.1 + 0.2 * k), radius=0.1, mass=1.0)
    world.run(seconds=0.5, dt=FRAME)
    top = 0.2 * count + 0.4
    ball = world.add(position=(0, top), velocity=(0, -3.0), radius=0.1, mass=1.0)
    while ball.velocity[0, 1] <= 0:
        world.step(FRAME)
        assert world.time < 1.0, "the blow does not come back"
    y, v = float(ball.position[0, 1]), float(ball.velocity[0, 1])
    assert np.sqrt(v**2 - 2 * G * (top - y)) == pytest.approx(3.0, abs=(count + 1) * G * FRAME / 8)
    np.testing.assert_allclose(world.velocity[:-1], 0.0, atol=(count + 1) * G * FRAME / 8)


def falls_of_linked_bodies(seed: int) -> pv.World:
    """Ropes, chains and trees of sticks, masses over three decades, fall over obstacles at 1 to 8 substeps."""
    rng = np.random.default_rng(seed)
    surface: Any = {"restitution": float(rng.choice([0, 0.6, 0.9])), "friction": float(rng.choice([0, 0.5]))}
    room = pv.Box((-6, 0), (6, 14), **surface)
    world = pv.World(boundary=room, collisions=pv.Collisions(**surface), substeps=int(rng.choice([1, 2, 4, 8])), ledger=True)
    for x in (-3.0, 0.0, 3.0):
        world.obstacles.append(pv.Capsule((x - 0.7, 3.0), (x + 0.7, 3.0 + float(rng.uniform(-0.4, 0.4))), radius=0.2, **surface))
    for x in (-4.0, -1.5, 1.5, 4.0):
        count = int(rng.integers(3, 12))
        joined = np.array([0, *(int(rng.integers(max(0, k - 1 - int(rng.integers(3))), k)) for k in range(1, count))])
        way, place = rng.uniform(0, 2 * np.pi, count), np.zeros((count, 2))
        for k in range(1, count):
            place[k] = place[joined[k]] + 0.3 * np.array([np.cos(way[k]), np.sin(way[k])])
        mass = 0.2 * 10 ** rng.uniform(0, 3, count)
        body = world.add(position=place + np.array([x, 9.0]), velocity=rng.normal(0, 5, 2), radius=0.08, mass=mass)
        kind = pv.Stick if rng.integers(2) == 0 else pv.Rope
        world.links.append(kind(body, joined[1:], np.arange(1, count)))
    return world


@pytest.mark.parametrize("seed", [7, 10, 19, 67])
def test_linked_bodies_of_any_masses_gain_no_energy_in_a_fall(seed: int) -> None:
    # What links and impacts do is no work where nothing drives them: the limiter has little to take, in 93 of 100 such worlds
    # less than a tenth of the energy.
    world = falls_of_linked_bodies(seed)
    start = world.energy().total
    world.run(seconds=2.5)
    assert -world.ledger.limiter < start  # it took 103, 996, 796 and 100 times as much as there was
