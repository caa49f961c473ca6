"""Moments of inertia of their own: rings, balls and flywheels that are circles."""

import copy
from typing import Any

import numpy as np
import pytest
from tests.worlds import G, on_ground, slope

import pyverlet as pv

RINGS = pytest.mark.parametrize("k", [1.0, 0.4, 0.5, 3.0])  # I / (m r^2) of a ring, a ball, a disc, a spool
STEPS = [(1 / 60, 8), (1 / 240, 4), (1 / 30, 16)]
DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])
M, R = 2.0, 0.3


@DTYPES
@pytest.mark.parametrize(
    ("k", "c", "angle"), [*((k, 0.0, 0.3) for k in (1.0, 0.4, 0.5, 3.0)), *((0.5, 0.1, angle) for angle in (0.05, 0.15, 0.4))]
)
def test_it_rolls_down_a_slope(k: float, c: float, angle: float, dtype: Any) -> None:
    """a = g (sin(angle) - c cos(angle)) / (1 + k), if tan(angle) > c; the floor begins to push, and to resist, in the second
    substep. Without rolling resistance energy is kept: it does not slip.
    """
    t = 2.0
    world = slope(angle, dtype=dtype, rolling_resistance=c)
    ring = world.add(position=(0, R), radius=R, mass=M, inertia=k * M * R * R)
    world.run(seconds=t)
    a = max(0.0, G * (np.sin(angle) - c * np.cos(angle)) / (1 + k))
    assert ring.velocity[0, 0] == pytest.approx(a * t, abs=G * np.sin(angle) / 480 + 1e-5 * a * t)
    assert ring.spin[0] * R == pytest.approx(-ring.velocity[0, 0], rel=1e-5, abs=1e-9)
    if c == 0:
        energy = world.energy()
        assert energy.spin == pytest.approx(0.5 * k * M * float(ring.velocity[0, 0]) ** 2, rel=1e-5)
        assert energy.total == pytest.approx(world.ledger.total, rel=1e-5)
        # what it slips in the first substep: m (g sin h)^2 / 2, and as much again
        assert abs(world.ledger.friction) < 2 * M * (G * np.sin(angle) / 480) ** 2


@pytest.mark.parametrize(
    ("k", "c", "r", "dt", "substeps"),
    [(k, 0.1, 0.3, 1 / 60, 8) for k in (1.0, 0.4, 0.5, 3.0)]
    + [(0.5, c, r, *step) for c, r in ((0.02, 0.1), (0.1, 0.5), (0.3, 1.0)) for step in STEPS],
)
@DTYPES
def test_rolling_resistance_stops_it(k: float, c: float, r: float, dt: float, substeps: int, dtype: Any) -> None:
    """m (1 + k) a = -c m g: after v0^2 (1 + k) / (2 c g); what it takes is all the energy, and no friction: it never slips.
    The way is off by that of a substep at c g h.
    """
    v0 = 2.0
    world = slope(0.0, rolling_resistance=c, dtype=dtype, substeps=substeps)
    ring = world.add(position=(0, r), velocity=(v0, 0), spin=-v0 / r, radius=r, mass=M, inertia=k * M * r * r)
    way, h, exact = v0**2 * (1 + k) / (2 * c * G), dt / substeps, 2e-4 if dtype == np.float32 else 1e-9
    world.run(seconds=1.05 * (1 + k) * v0 / (c * G) + 0.1, dt=dt)
    assert ring.position[0, 0] == pytest.approx(way, abs=c * G * h * h + way * exact)
    assert np.abs(ring.velocity).max() < 1e-6
    assert abs(ring.spin[0]) * r < 1e-6
    if dtype == np.float64:
        assert world.ledger.rolling == pytest.approx(-0.5 * M * (1 + k) * v0**2, rel=1e-6)
        assert abs(world.ledger.friction) < 1e-6
        assert abs(world.ledger.residual) < 1e-9
        assert world.ledger.total == pytest.approx(world.energy().total, abs=1e-9)


@DTYPES
@RINGS
def test_an_oblique_impact(k: float, dtype: Any) -> None:
    """A floor of enough friction stops the rim: J_t = -m s k / (1 + k), s = u + r w the slip (Walton and Braun 1986)."""
    world = slope(0.0, dtype=dtype, gravity=(0, 0))
    world.boundary = pv.Box((-100, 0), (100, 50), friction=5.0, restitution=0.8)
    ring = world.add(position=(0, 1), velocity=(3, -5), spin=2.0, radius=R, mass=M, inertia=k * M * R * R)
    world.run(seconds=0.3)
    slip = 3 + R * 2.0
    assert ring.velocity[0, 0] == pytest.approx(3 - slip * k / (1 + k), rel=1e-5)
    assert ring.spin[0] == pytest.approx(2.0 - slip / (1 + k) / R, rel=1e-4, abs=1e-5)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-5)


@pytest.mark.parametrize("dx", [0.0, 0.3])
@pytest.mark.parametrize("inertia", [(0.5, 0.05), (0.02, 1.0)])
def test_a_rough_impact_of_two_keeps_momenta(inertia: tuple[float, float], dx: float) -> None:
    """Momentum and angular momentum to rounding; friction takes m' s^2 / 2 with the slip s, if it stops the rims."""
    laws = pv.Collisions(friction=50.0, restitution=0.3)
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=laws, dtype=np.float64, ledger=True)
    mass, radius, spin = np.array([1.0, 2.0]), np.array([0.5, 0.3]), np.array([3.0, -8.0])
    places, speeds = [(0, 0), (2, dx)], [(1, 0.5), (-1.5, 0)]
    group = world.add(position=places, velocity=speeds, spin=spin, mass=mass, radius=radius, inertia=inertia)
    before, whole = world.angular_momentum(), world.momentum()
    world.run(seconds=0.2)
    way, apart = group.position[1] - group.position[0], group.velocity[1] - group.velocity[0]  # straight, until they meet
    square = apart @ apart
    time = (-(way @ apart) - np.sqrt((way @ apart) ** 2 - square * (way @ way - 0.64))) / square
    n = (way + apart * time) / 0.8
    slip = apart[0] * n[1] - apart[1] * n[0] + radius @ spin
    inverse = (1 / mass + radius**2 / np.array(inertia)).sum()
    world.run(seconds=1.8)
    assert world.angular_momentum() == pytest.approx(before, abs=1e-12)
    assert world.momentum() == pytest.approx(whole, abs=1e-12)
    assert world.ledger.friction == pytest.approx(-0.5 * slip**2 / inverse, rel=1e-9)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-12)


@DTYPES
@pytest.mark.parametrize(
    ("radius", "own", "turn"),
    [
        ([0.4, 0.1], {"inertia": 0.02}, [8.0, 0.5]),
        ([0.2, 0.2], {"inertia": [0.02, 0.001]}, [2.0, 40.0]),
        ([0.2, 0.2], {"fixed_rotation": [False, True]}, [2.0, 0.0]),
    ],
)
def test_a_rough_impact_of_equal_masses(radius: list[float], own: dict[str, Any], turn: list[float], dtype: Any) -> None:
    """J_t = s / (2 / m + r1^2 / I1 + r2^2 / I2) turns each by J_t r / I; m = 1 kg, `turn` is r^2 / I. Copies know that, too."""
    world = pv.World(gravity=(0, 0), dtype=dtype, collisions=pv.Collisions(friction=50.0), ledger=True)
    places = [(0, 0), (sum(radius) + 5e-4, 0), (0, 9), (sum(radius) + 1.5, 9)]
    speeds = [(5.0, 0), (0, 0)] * 2
    own = {name: value * 2 if isinstance(value, list) else value for name, value in own.items()}
    world.add(position=places, velocity=speeds, spin=[15.0, 0] * 2, radius=radius * 2, **own)
    world.run(seconds=0.1)  # the first two have met
    twin = copy.deepcopy(world)
    for each in (world, twin):
        each.run(seconds=0.4)  # the others, too
    blow = 15 * radius[0] / (2 + sum(turn))
    after = [15 - blow * turn[0] / radius[0], -blow * turn[1] / radius[1]]
    assert world.spin.tolist() == pytest.approx(after * 2, rel=1e-4, abs=1e-4)
    assert world.state_hash() == twin.state_hash()
    assert abs(world.ledger.limiter) < 1e-6 * world.energy().total


@pytest.mark.parametrize("c", [0.0, 0.3])
def test_the_ledger_of_a_rough_crowd_closes(c: float) -> None:
    """Rings, balls and discs that hit each other, rub and roll. They keep their turn: friction of an impact acts at the middle
    of the distance of centres, which is not r_i + r_j where several meet at about the same time.
    """
    rng = np.random.default_rng(0)
    laws = pv.Collisions(friction=0.7, restitution=0.3, rolling_resistance=c)
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=laws, dtype=np.float64, ledger=True)
    places = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    mass, radius = rng.uniform(1, 3, 25), rng.uniform(0.3, 0.45, 25)
    group = world.add(position=places, velocity=-1.5 * (places - 2), spin=rng.normal(0, 5, 25), mass=mass, radius=radius)
    group.inertia[:10] = mass[:10] * radius[:10] ** 2 * rng.uniform(0.2, 3, 10)
    before, whole = world.angular_momentum(), world.momentum()
    world.run(seconds=2.0)
    assert world.angular_momentum() == pytest.approx(before, rel=2e-5)
    assert world.momentum() == pytest.approx(whole, abs=1e-12)
    assert world.ledger.friction < -0.1
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-12)
    assert abs(world.ledger.residual) < 1e-6 * world.energy().total


def test_it_can_be_changed() -> None:
    world = slope(0.2)
    group = world.add(position=[(0, R), (1, R), (2, R)], radius=R, mass=M, inertia=[0.1, 0.2, 0.3])
    group.inertia[1] = 0.0  # a disc again
    other = slope(0.2)
    other.add(position=[(1, R)], radius=R, mass=M)
    for each in (world, other):
        each.run(seconds=0.5)
    assert np.array_equal(group.velocity[1], other.velocity[0])


# ---- Circles whose rotation is fixed: as if their moment of inertia were infinite ----


@DTYPES
def test_it_slides_where_a_disc_would_roll(dtype: Any) -> None:
    """x' = v - mu g t until it stops; a disc would roll on at 2/3 of v."""
    world = pv.World(boundary=pv.Box((-90, 0), (90, 9), friction=0.2), dtype=dtype)
    world.add(position=[(0, 0.5), (5, 0.5)], radius=0.5, velocity=(3, 0), fixed_rotation=[True, False])
    world.run(seconds=1)
    assert world.velocity[0, 0] == pytest.approx(3 - 0.2 * G, rel=1e-4)
    world.run(seconds=1)
    assert world.velocity[:, 0] == pytest.approx([0, 2], abs=1e-5)
    assert world.spin[0] == 0


@DTYPES
@pytest.mark.parametrize("what", ["wall", "segment", "pinned", "pair"])
@pytest.mark.parametrize("mu", [0.1, 0.9])
def test_an_impact_rubs_within_the_cone(mu: float, what: str, dtype: Any) -> None:
    """J_n = m (1 + e) v_n and |J_t| = min(mu J_n, m v_t): all of the slip, where a disc loses a third."""
    e, v, u = 0.5, 2.0, 1.0
    surface: dict[str, Any] = {"restitution": e, "friction": mu, "collisions": pv.Collisions(restitution=e, friction=mu)}
    world, top = on_ground("wall" if what == "pair" else what, gravity=(0, 0), dtype=dtype, **surface)
    x = -u * (0.2 / v)  # where it meets the other from straight above
    if what == "pair":
        top = 5.0
        world.add(position=(0, 4), radius=1.0, mass=3.0, fixed_rotation=True)
    ball = world.add(position=(x, top + 0.5 + 0.2), radius=0.5, velocity=(u, -v), fixed_rotation=True)
    world.run(seconds=0.25)
    share = 0.75 if what == "pair" else 1.0  # of the reduced mass, 1 and 3 kg
    normal = share * (1 + e) * v
    assert ball.velocity[0, 1] == pytest.approx(-v + normal, rel=1e-5)
    assert ball.velocity[0, 0] == pytest.approx(u - min(mu * normal, share * u), abs=1e-5)
    assert (world.spin == 0).all()


@pytest.mark.parametrize(
    ("shape", "filled", "dtype"),
    [
        ("box", True, np.float64),
        pytest.param("disc", False, np.float32, marks=pytest.mark.slow),
        pytest.param("disc", True, np.float32, marks=pytest.mark.slow),
        pytest.param("disc", False, np.float64, marks=pytest.mark.slow),
    ],
)
def test_soft_bodies_do_not_creep(shape: str, filled: bool, dtype: Any) -> None:
    """Their particles are no wheels: friction holds them. Round ones rock on their corners, less by a factor of e in 4 s."""
    world = pv.World(boundary=pv.Box((-9, 0), (9, 5), friction=0.5), collisions=pv.Collisions(friction=0.5), dtype=dtype)
    outline = pv.builders.disc((0.3, 0.55), 0.5) if shape == "disc" else pv.builders.box((-0.8, 0.1), (0.8, 1.1))
    group = pv.soft_body(world, outline, spacing=0.15, filled=filled).group
    world.run(seconds=20 if shape == "disc" else 8, dt=1 / 60)
    middle = float(group.position[:, 0].mean(dtype=float))
    world.run(seconds=5, dt=1 / 60)
    assert abs(float(group.position[:, 0].mean(dtype=float)) - middle) / 5 < 5e-5
    assert np.hypot(*world.velocity.T).max() < 2e-3


def test_it_is_kept_and_wakes() -> None:
    world = pv.World(boundary=pv.Box((-90, 0), (90, 9), friction=0.2), dtype=np.float64, sleep=True)
    world.add(position=[(0, 0.5), (5, 0.5)], radius=0.5, fixed_rotation=True)
    world.run(seconds=2)
    assert world.asleep.all()
    world.fixed_rotation[0] = 0
    world.step(1 / 60)
    assert not world.asleep[0]
    twin = copy.deepcopy(world)
    for each in (world, twin):
        each.velocity[:, 0] = 1
        each.run(seconds=1)
    assert world.state_hash() == twin.state_hash()
    assert world.spin[0] < 0 == world.spin[1]


# ---- Angles: how far circles have turned ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_disc_that_rolls_turns_by_its_way_over_its_radius(dtype: type[np.float32]) -> None:
    # It slides at first: v = v0 - mu g t, w = -2 mu g t / r, until v = -w r at t1 = v0 / (3 mu g); then both stay. The angle is
    # -mu g t1^2 / r + w1 (t - t1) with w1 = -2 v0 / (3 r). In the frame of t1 the mean of two spins is off by 2 mu g / r dt^2 / 8
    # at most; that the floor begins to push after the first substep is worth w1 h.
    mu, v0, r, t, g, h = 0.5, 6.0, 0.5, 2.0, 9.81, 1 / 480
    world = pv.World(boundary=pv.Box((-50, 0), (50, 10), friction=mu), dtype=dtype)
    disc = world.add(position=(-40, r), velocity=(v0, 0), radius=r, angle=0.25)
    world.run(seconds=t)
    t1, w1 = v0 / (3 * mu * g), -2 * v0 / (3 * r)
    paper = 0.25 - mu * g * t1**2 / r + w1 * (t - t1)
    assert disc.angle[0] == pytest.approx(paper, abs=mu * g / r / 60**2 / 4 + abs(w1) * h)
    before, where = float(disc.angle[0]), float(disc.position[0, 0])
    world.run(seconds=1)
    assert disc.angle[0] - before == pytest.approx(-(disc.position[0, 0] - where) / r, rel=2e-5)


def test_a_free_spin_turns_evenly_and_for_long() -> None:
    # 0.05 rad/s beside 40,000 rad: a float32 angle would stand still.
    world = pv.World(gravity=(0, 0), collisions=None)
    group = world.add(position=[(0, 0), (2, 0)], spin=[0.05, -3.0], angle=[40_000.0, 0.0])
    world.run(seconds=2)
    assert world.angle.dtype == np.float64
    assert group.angle == pytest.approx([40_000.1, -6.0], abs=1e-6)


def test_angles_are_hashed_and_kept_in_order() -> None:
    world = pv.World(gravity=(0, 0))
    group = world.add(position=[(k, 0) for k in range(0, 30, 3)], spin=np.arange(10))
    world.run(seconds=0.5)
    later, hashed = world.angle.copy(), world.state_hash()
    assert (np.diff(later) > 0.4).all()
    world.angle[0] += 1e-9
    assert world.state_hash() != hashed
    group.remove([0, 1])
    assert world.angle.tolist() == later[2:].tolist()


def test_a_density_makes_masses() -> None:
    world = pv.World()
    group = world.add(position=[(0, 0), (3, 0)], radius=[0.5, 1.0], density=[2.0, 3.0])
    assert group.mass == pytest.approx([2 * np.pi * 0.25, 3 * np.pi])  # rho pi r^2
    world.actors.append(pv.Emitter(pv.Box((10, 0), (20, 10)), rate=600, radius=(0.1, 0.4), density=5.0))
    world.step(1 / 60)
    born = slice(2, None)
    assert len(world) > 2
    assert world.mass[born] == pytest.approx(5 * np.pi * world.radius[born].astype(float) ** 2, rel=1e-6)


# ---- Rolling resistance: the torque of a contact is at most c r N ----


@pytest.mark.parametrize("what", ["wall", "segment", "polygon", "pinned", "own", "material"])
def test_all_surfaces_resist(what: str) -> None:
    c, v0, r = 0.1, 1.0, 0.25
    surface: dict[str, Any] = {"friction": 1.0, "rolling_resistance": c, "collisions": pv.Collisions(friction=1.0)}
    own: dict[str, Any] = {}
    if what == "own":  # the geometric mean of 0.4 and of 0.025
        surface["rolling_resistance"], own = 0.4, {"rolling_resistance": c * c / 0.4}
    elif what == "material":
        laws = pv.Collisions(friction=1.0, materials={("ball", "floor"): {"rolling_resistance": c}})
        surface, own = {"friction": 1.0, "material": "floor", "collisions": laws}, {"material": "ball"}
    elif what == "pinned":  # so large that its top is level
        surface |= {"large": 1e4, "boundary": None, "collisions": pv.Collisions(friction=1.0, rolling_resistance=c)}
    world, top = on_ground("wall" if what in ("own", "material") else what, **surface)
    disc = world.add(position=(0, top + r), velocity=(v0, 0), spin=-v0 / r, radius=r, **own)
    world.run(seconds=3)
    way = v0**2 * 1.5 / (2 * c * G)
    assert disc.position[0, 0] == pytest.approx(way, rel=3e-3 if what == "pinned" else 1e-4)  # the top falls away by x^2 / 2 R


def test_a_turning_drum_takes_along_what_resists_rolling() -> None:
    """The wall turns more slowly than the disc: it takes it up to where tan(angle) = c, by a torque c N r = m g sin(angle) r."""
    turns, radius, r, c = 0.5, 2.0, 0.2, 0.05
    room = pv.Circle(radius=radius, friction=1.0, rolling_resistance=c, angular_velocity=turns)
    world = pv.World(boundary=room, dtype=np.float64)
    angle, far = np.arctan(c), radius - r
    disc = world.add(position=(far * np.sin(angle), -far * np.cos(angle)), radius=r, spin=turns * radius / r)
    world.run(seconds=10)
    x, y = disc.position[0]
    assert np.arctan2(x, -y) == pytest.approx(angle, rel=1e-3)
    assert disc.spin[0] == pytest.approx(turns * radius / r, rel=1e-3)


@pytest.mark.parametrize(("mu", "error"), [(0.0, 1e-12), (1.0, 5e-4)])
def test_two_free_discs_keep_their_angular_momentum(mu: float, error: float) -> None:
    """Pressed together, one spinning: what one loses the other gains. Friction is along tangents of before the drift: order h."""
    laws = pv.Collisions(friction=mu, rolling_resistance=0.5)
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=laws)
    pair = world.add(position=[(-0.5, 0), (0.7, 0)], radius=[0.5, 0.7], mass=[1.0, 3.0], spin=[3.0, 0.0])
    world.forces.append(pv.Gravitation(strength=40.0))

    def turning() -> float:
        x, v, m, r = pair.position, pair.velocity, pair.mass, pair.radius
        return float((m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + 0.5 * m * r * r * pair.spin).sum())

    before = turning()
    world.run(seconds=6)
    assert turning() == pytest.approx(before, rel=error)
    assert pair.spin[0] == pytest.approx(pair.spin[1], rel=1e-3)
    if mu:  # they turn as one body: the centres turn around each other as fast as they turn
        way, speed = np.diff(pair.position, axis=0)[0], np.diff(pair.velocity, axis=0)[0]
        assert pair.spin[0] == pytest.approx((way[0] * speed[1] - way[1] * speed[0]) / (way @ way), rel=1e-2)


def heap(c: float) -> pv.World:
    """Poured through a narrow place, disc by disc."""
    world = pv.World(
        boundary=pv.Box((-30, 0), (30, 60), friction=0.8, rolling_resistance=c),
        collisions=pv.Collisions(friction=0.8, rolling_resistance=c),
    )
    rng = np.random.default_rng(3)
    for _ in range(100):
        world.add(position=(rng.uniform(-0.5, 0.5), 9.0), radius=rng.uniform(0.2, 0.3))
        world.run(seconds=0.1)
    world.run(seconds=20)  # after 9 m of fall and at c = 0.1 a disc rolls for up to 3 v / (2 c g) = 20 s
    return world


def test_a_heap_is_steeper_the_more_it_resists() -> None:
    worlds = [heap(c) for c in (0.0, 0.1, 0.3)]
    heights = [float(world.position[:, 1].mean()) for world in worlds]
    assert heights[0] < 0.8 * heights[1] < 0.8 * 0.95 * heights[2]
    # One without it rolls apart on a floor. With it a disc or two may still come down its side after six seconds: of twelve heaps
    # whose starts differ by 1e-6 m, two had one.
    for world in worlds[1:]:
        assert np.sort(np.hypot(*world.velocity.T))[-4] < 1e-3
