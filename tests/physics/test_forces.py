"""Every force against its closed form, and every potential against its force."""

import warnings
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, empty, forces_of, pull_of, refused

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME
from pyverlet.state.state import State

DT, SUBSTEPS = 1 / 60, 8
H = DT / SUBSTEPS


WIND = pv.Wind((3, -1), linear=2.0, quadratic=0.5)


@pytest.mark.parametrize(
    ("force", "gravity", "start", "mass", "seconds", "end", "within"),
    [
        # What falls ends where m g = k v, m g = c v^2, c v^2 + k v = m g.
        (pv.Drag(linear=5.0), 9.81, (0, 0), 2.0, 12, (0, -2.0 * 9.81 / 5.0), 1e-9),
        (pv.Drag(quadratic=5.0), 9.81, (0, 0), 2.0, 12, (0, -np.sqrt(2.0 * 9.81 / 5.0)), 1e-9),
        (pv.Drag(linear=10.0, quadratic=5.0), 9.81, (0, 0), 2.0, 12, (0, 1 - np.sqrt(1 + 2.0 * 9.81 / 5.0)), 1e-9),
        # v = v0 exp(-k t / m), v0 / (1 + c v0 t / m). The method's order is 2: an error below (rate h)^2 of v0.
        (pv.Drag(linear=3.0), 0.0, (4, -3), 1.5, 1, np.array([4, -3]) * np.exp(-3.0 / 1.5), 5 * (2.0 * H) ** 2),
        (pv.Drag(quadratic=0.3), 0.0, (4, -3), 1.5, 1, np.array([4, -3]) / (1 + 0.3 * 5 / 1.5), 5 * H**2),
        # The wind takes everything along.
        (WIND, 0.0, (0, 0), 1.0, 22, (3, -1), 1e-9), (WIND, 0.0, (-9, 2), 2.0, 22, (3, -1), 1e-9),
    ],
)  # fmt: skip
def test_drag_and_wind_end_as_on_paper(
    force: Any, gravity: float, start: Any, mass: float, seconds: float, end: Any, within: float
) -> None:
    world = empty(force, gravity=(0, -gravity))
    ball = world.add(position=(0, 0), velocity=start, mass=mass)
    world.run(seconds=seconds, dt=DT)
    assert ball.velocity[0] == pytest.approx(end, abs=within)


@pytest.mark.parametrize("integrator", [pv.SemiImplicitEuler(), pv.PositionVerlet(), pv.VelocityVerlet()], ids=repr)
def test_resistance_stiffer_than_a_substep_turns_nobody_round(integrator: pv.Integrator) -> None:
    # c |v| h / m = 2 * 1000 * (1/120) / 1e-3 = 16,667: so many times as fast c v^2 for a whole substep would throw it back.
    world = pv.World(gravity=(0, 0), integrator=integrator, substeps=8)
    ball = world.add(position=(0, 0), velocity=(1000.0, 0.0), radius=0.1, mass=1e-3)
    world.forces.append(pv.Drag(quadratic=2.0))
    speed = 1000.0
    for _ in each_frame(world, 20, 1 / 15):
        assert -1e-3 <= ball.velocity[0, 0] <= speed
        speed = float(ball.velocity[0, 0])
    assert speed < 0.03  # where c v h / m = 1/2 the law itself takes over; by then v0 / (1 + c v0 t / m) = 4e-4


@pytest.mark.parametrize("joined", ["touching", "linked", "a soft body"])
def test_the_wind_takes_along_what_hangs_together(joined: str) -> None:
    # v = u (1 - exp(-c t / m)), for all alike. What the wind gave was taken for what contacts had put in too much.
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    if joined == "a soft body":
        pv.soft_body(world, [(-2, -1), (1, -1), (1, 2)], spacing=0.4, filled=True)
        world.mass = 0.5
    else:
        pair = world.add(position=[(0, 0), (0.999, 0)], radius=0.5 if joined == "touching" else 0.3, mass=0.5)
        if joined == "linked":
            world.links.append(pv.Stick(pair, 0, 1))
    world.forces.append(pv.Wind((2, 0), linear=0.05))
    centre = world.velocity.mean(axis=0)
    world.run(seconds=2, dt=DT)
    assert world.velocity.mean(axis=0) - centre == pytest.approx([2 * (1 - np.exp(-0.05 * 2 / 0.5)), 0], abs=2 * 0.1 * H)


def test_a_field_of_wind_has_a_velocity_at_each_place() -> None:
    # A shear flow, u = (y, 0): what drifts with it at its own height moves at that speed.
    world = empty(pv.Wind(lambda x, y, t: (y, 0.0), linear=50.0))
    balls = world.add(position=[(0, 0), (0, 1), (0, 2)], radius=0.1)
    world.run(seconds=1, dt=DT)
    assert balls.velocity[:, 0] == pytest.approx([0, 1, 2], abs=1e-6)
    late = empty(pv.Wind(lambda x, y, t: (np.where(t >= 0.5, 1.0, 0.0), 0.0), linear=50.0))
    ball = late.add(position=(0, 0))
    late.run(seconds=0.4, dt=DT)
    assert ball.velocity[0, 0] == 0
    late.run(seconds=0.4, dt=DT)
    assert ball.velocity[0, 0] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("axis", [1.0, 2.0, 4.0])
def test_keplers_third_law(axis: float) -> None:
    # T^2 = 4 pi^2 a^3 / (G M), for a = 1, 2, 4 and an eccentricity of 0.3. Yoshida's order 4 leaves (2 pi h / T)^4.
    strength, e = 10.0, 0.3
    world = empty(pv.Attractor(center=(1, 2), strength=strength), integrator=pv.Yoshida4())
    apart, speed = axis * (1 + e), np.sqrt(strength / axis * (1 - e) / (1 + e))
    planet = world.add(position=(1 + apart, 2), velocity=(0, speed), mass=3.0)
    before = world.energy().total
    assert before == pytest.approx(-3.0 * strength / (2 * axis))  # E = -G M m / 2a
    period = 2 * np.pi * np.sqrt(axis**3 / strength)
    frames = 200
    world.run(seconds=period, dt=period / frames)
    assert planet.position[0] == pytest.approx([1 + apart, 2], abs=1e-5 * apart)
    assert world.energy().total == pytest.approx(before, rel=1e-7)


def test_two_bodies_circle_their_common_centre_and_leave_strangers_alone() -> None:
    # T = 2 pi sqrt(d^3 / G (m1 + m2)) for the distance d. Momenta are kept to rounding.
    strength, masses, d = 2.0, np.array([3.0, 1.0]), 4.0
    period = 2 * np.pi * np.sqrt(d**3 / (strength * masses.sum()))
    x = d * np.array([-masses[1], masses[0]]) / masses.sum()
    world = pv.World(gravity=(0, 0), collisions=None, dtype=np.float64, integrator=pv.Yoshida4())
    stranger = world.add(position=(0, 1))
    stars = world.add(
        position=np.column_stack((x, 0 * x)), velocity=np.column_stack((0 * x, 2 * np.pi / period * x)), mass=masses
    )
    world.forces.append(pv.Gravitation(stars, strength=strength))
    start, energy, turning = stars.position.copy(), world.energy().total, world.angular_momentum()
    assert energy == pytest.approx(-strength * masses.prod() / (2 * d))
    for _ in each_frame(world, 200, period / 200):
        assert world.momentum() == pytest.approx((0, 0), abs=1e-12)
        assert world.angular_momentum() == pytest.approx(turning, rel=1e-11)
    assert stars.position == pytest.approx(start, abs=1e-6)
    assert stranger.position.tolist() == [[0, 1]]
    assert world.energy().total == pytest.approx(energy, rel=1e-9)


def test_forces_may_act_on_groups() -> None:
    # x = F t^2 / 2 m, and x'' = -k x / m: from rest x cos(sqrt(k / m) t), of the groups alone; the others stay.
    world = pv.World(gravity=(0, 0), collisions=None, dtype=np.float64, integrator=pv.RK4())
    others, pushed = world.add(position=(9, 9)), world.add(position=(0, 0), mass=2.0)
    drawn = world.add(position=[(2, 0), (0, 3)], mass=2.0)
    world.forces += [pv.ConstantForce((6, -2), group=pushed), pv.PointSpring(drawn, stiffness=8.0)]
    assert world.energy().potential == pytest.approx(8 * (4 + 9) / 2)
    world.run(seconds=1)
    assert pushed.position[0] == pytest.approx((1.5, -0.5), abs=1e-12)
    assert drawn.position == pytest.approx(np.array([(2, 0), (0, 3)]) * np.cos(2.0), abs=1e-9)
    assert others.position.tolist() == [[9, 9]]
    assert world.energy().total == pytest.approx(8 * (4 + 9) / 2, abs=1e-9)
    drawn.pin(1)
    world.forces.pop(0)
    assert world.energy().potential == pytest.approx(4 * float(drawn.position[0] @ drawn.position[0]))


@pytest.mark.parametrize(
    "law",
    [
        pv.Attractor(center=(0.3, -0.2), strength=2.0),
        pv.Attractor(center=(0.3, -0.2), strength=-2.0, softening=0.7),
        pv.PointSpring(center=(0.3, -0.2), stiffness=1.5),
        pv.ConstantForce((1, -2)),
        pv.Gravitation(strength=0.7, softening=0.1),
    ],
    ids=lambda law: type(law).__name__,
)
def test_a_force_is_minus_the_gradient_of_its_potential(law: Any) -> None:
    world = empty(law)
    world.add(position=np.random.default_rng(0).normal(0, 1, (5, 2)), mass=[1, 2, 3, 4, np.inf])
    for particle, force in enumerate(forces_of(law, world)[:4]):
        assert force == pytest.approx(pull_of(lambda: world.energy().potential, world, particle), abs=1e-7)


def test_who_is_at_the_centre_or_pinned_feels_nothing() -> None:
    for law in (pv.Attractor(strength=1.0), pv.Gravitation(strength=1.0)):
        world = empty(law)
        balls = world.add(position=[(0, 0), (0, 0), (1, 0)], mass=[1.0, np.inf, np.inf])
        world.run(seconds=0.5, dt=DT)
        assert balls.position.tolist() == [[0, 0], [0, 0], [1, 0]]
        assert np.isfinite(world.energy().total)
        assert isinstance(world._state, State)


def test_a_wind_of_the_wrong_shape_says_so() -> None:
    world = empty(pv.Wind(lambda x, y, t: np.zeros(3), linear=1.0))
    world.add(position=[(0, 0), (1, 1)])
    refused(r"velocity of the wind .* two components, each a number or an array of shape \(2,\)", world.step, DT)


@pytest.mark.parametrize("seed", [0, 3, *(pytest.param(each, marks=pytest.mark.slow) for each in (1, 2, 4, 5))])
def test_a_cloud_that_falls_together_does_not_begin_to_turn(seed: int) -> None:
    # Its angular momentum is 0, and forces and contacts act along lines of centres. Some begin on top of each other, up to 94 %:
    # they part, while all others go on falling. Contacts relax along the normals of after the drift where particles move by a
    # four hundredth of a radius in a substep; below it, along those of before, which turns the cloud to and fro.
    place = np.random.default_rng(seed).uniform(-4, 4, (150, 2))
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    cloud = world.add(position=place[np.hypot(*place.T) < 4], radius=0.15)
    world.forces.append(pv.Gravitation(cloud, strength=0.5, softening=0.1))
    turn = scale = 0.0
    for frame in each_frame(world, 200):
        turn = max(turn, abs(world.angular_momentum()))
        scale = max(scale, np.sqrt((world.position**2).sum(axis=1) @ (world.velocity**2).sum(axis=1) / 2))
        if frame == 59:  # without others in the way, the mass of all within r would draw one at the edge by g t^2 / 2 = 1.9 m
            assert np.hypot(*cloud.velocity.T).max() > 1
    assert turn < 1e-4 * scale
    assert world.overlap().max < 0.05


@pytest.mark.parametrize("masses", [1.0, 10.0, pytest.param(30.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("frames", [(1 / 60,), (1 / 240, 1 / 60, 1 / 30)])
def test_a_rough_cloud_does_not_begin_to_turn(masses: float, restitution: float, frames: tuple[float, ...]) -> None:
    # Friction turns two discs by their distance times its impulse, however deep they overlap. What is left is of order h: the
    # normal impulses of the last sweep act along the lines of centres of before or after the drift.
    rng = np.random.default_rng(1)
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=pv.Collisions(friction=0.5, restitution=restitution))
    place = np.random.default_rng(150).uniform(-5, 5, (150, 2))
    place = place[np.hypot(*place.T) < 5]
    radius, mass = 0.1 * rng.uniform(0.5, 1, len(place)), masses ** rng.uniform(0, 1, len(place))
    cloud = world.add(position=place, radius=radius, mass=mass, on_overlap="skip")
    world.forces.append(pv.Gravitation(cloud, strength=0.1, softening=0.1))
    turn = scale = 0.0
    for _ in range(400):
        world.step(float(rng.choice(frames)))
        turn, mass = max(turn, abs(world.angular_momentum())), world.mass
        scale = max(scale, np.sqrt((mass @ (world.position**2).sum(axis=1)) * (mass @ (world.velocity**2).sum(axis=1)) / 2))
    assert turn < 2e-4 * scale


# ---- Forces that depend on the velocity: terminal speeds however strong the drag is, and magnetic forces that do no work ----


def magnet(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return 20 * vy, -20 * vx


class Magnet:
    """The same as an object of the user's own."""

    velocity_dependent = True

    def apply(self, state: Any, t: float) -> None:
        state.force[:, 0] += 20 * state.velocity[:, 1]
        state.force[:, 1] -= 20 * state.velocity[:, 0]


@pytest.mark.parametrize("name", BY_NAME)
@pytest.mark.parametrize("substeps", [1, 8])
def test_a_fall_through_honey_ends_at_the_terminal_speed(name: str, substeps: int) -> None:
    # c h / m from 0.06 to 2e5, linear and quadratic, each alone and both, in wind; m g = (c + q u) u.
    world = pv.World(dtype=np.float64, integrator=BY_NAME[name](), substeps=substeps)
    world.add(position=[(3.0 * k, 0.0) for k in range(4)], mass=[0.1, 1.0, 10.0, 3.0])
    for c, q in [(60.0, 0.0), (4800.0, 0.0), (1e7, 0.0), (0.0, 30.0), (0.0, 1e6), (500.0, 4e4)]:
        world.velocity[:] = (3.0, 0.0)
        world.forces[:] = [pv.Drag(linear=c / 2, quadratic=q), pv.Wind((0.25, 0.5), linear=c / 2)]
        world.run(seconds=3 if c == 60 else 1 if c == 0 else 0.5)
        wind = np.array((0.25, 0.5)) * (0.5 if c else 0.0)
        speed = world.velocity.copy()
        if q == 0:
            assert speed - wind == pytest.approx(np.column_stack((np.zeros(4), -world.mass * 9.81 / c)), rel=0.01, abs=1e-6)
        elif c == 0:
            assert -speed[:, 1] == pytest.approx(np.sqrt(world.mass * 9.81 / q), rel=0.01)


@pytest.mark.parametrize(
    ("name", "own", "frames"),
    [
        *((name, False, 60) for name in ("position-verlet", "time-corrected-verlet", "velocity-verlet", "rk4", "yoshida4")),
        ("position-verlet", True, 60),
        ("rk4", True, 60),
        pytest.param("position-verlet", False, 3600, marks=pytest.mark.slow),
    ],
)
def test_a_magnetic_force_does_no_work(name: str, own: bool, frames: int) -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64, integrator=BY_NAME[name](), collisions=None)
    ball = world.add(position=(0, 0), velocity=(1, 0))
    world.forces.append(Magnet() if own else pv.force(magnet))
    speeds, places = [], []
    for _ in each_frame(world, frames):
        speeds.append(float(np.hypot(*ball.velocity[0])))
        places.append(ball.position[0].copy())
    assert np.abs(np.square(speeds) - 1).max() < 1e-3
    assert np.ptp(places, axis=0) == pytest.approx([2 / 20, 2 / 20], rel=0.03)  # the gyration radius m v / B


SOLVED = ["position-verlet", "time-corrected-verlet", "velocity-verlet", "yoshida4"]


def turning_and_dragging(c: float, *, turn: float = 0.0, along: float = 1.0, power: int = 0) -> pv.forces.FunctionForce:
    """A function that turns velocities by `turn` and slows them, across x by c m |v|^power, along it by `along` times that."""

    @pv.force
    def slows(x: Any, y: Any, vx: Any, vy: Any, mass: Any, t: float) -> Any:
        felt = c * mass * np.hypot(vx, vy) ** power
        return mass * turn * vy - along * felt * vx, -mass * turn * vx - felt * vy

    return slows


@pytest.mark.parametrize("name", SOLVED)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("share", [0.2, 1.0, 5.0, 100.0])
def test_functions_are_followed_however_strongly_they_change_with_the_velocity(share: float, dtype: type, name: str) -> None:
    # c h / m; without solving for the velocity, magnetic ones gained energy without bound from 0.2 on, and drag threw from 2 on.
    def told(force: Any, **more: Any) -> Any:
        world = pv.World(integrator=BY_NAME[name](), dtype=dtype, **more)
        world.add(position=[(0, 0), (5, 0)], velocity=(3, 1), mass=[1.0, 3.0])
        world.forces.append(force)
        world.run(seconds=2)
        return world.velocity.astype(float)

    c = share * 480
    magnetic = told(turning_and_dragging(0.0, turn=c), gravity=(0, 0))
    assert np.hypot(*magnetic.T) == pytest.approx(np.sqrt(10), rel=1e-3 if dtype == np.float32 else 1e-6)
    assert told(turning_and_dragging(c))[:, 1] == pytest.approx(-9.81 / c, rel=1e-3)
    keel = told(turning_and_dragging(c, along=0.3 / c), gravity=(0, 0))
    assert keel == pytest.approx(np.array([[3 * np.exp(-0.6), 0.0]] * 2), rel=1e-3, abs=1e-2)
    if share <= 1:
        assert told(turning_and_dragging(c, power=1))[:, 1] == pytest.approx(-np.sqrt(9.81 / c), rel=1e-3)


@pytest.mark.parametrize("name", BY_NAME)
def test_forces_that_an_integrator_does_not_follow_are_told_of_once(name: str) -> None:
    # Those of the library, such as the hand of the page, are not.
    limit = BY_NAME[name].follows
    for share in (0.5, 2.0):
        c = share * min(limit, 1.0) * 480
        world = pv.World(gravity=(0, 0), integrator=BY_NAME[name]())
        world.add(position=[(0, 0), (3, 0)], velocity=[(3, 0), (0, 1)], mass=[1.0, 5.0])
        world.forces += [pv.Drag(linear=100.0), pv.forces.Grip(0, target=(0, 0)), turning_and_dragging(0.0, turn=c)]
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            world.run(seconds=0.5)
        assert [each.category for each in told] == [pv.CoarseStepsWarning] * int(share > 1 and limit < 1)
        assert all(f"is {c / 480:.2g} in" in str(each.message) for each in told)


@pytest.mark.parametrize("dts", [(0.25,), (1 / 60, 0.25), (1 / 240, 1 / 20), (1 / 60, 1 / 30)])
@pytest.mark.parametrize("stiffness", [1e3, 1e4, 1e5, 1e6])
def test_a_spring_to_a_point_bears_any_frame_rate(stiffness: float, dts: tuple[float, ...]) -> None:
    # Verlet's method explodes from omega h = 2 on, which these are up to 30 times beyond. Frames are cut to omega h <= 1, where
    # the energy goes up and down by (omega h)^2 / 4 with equal steps, and by more where they vary: ten times, here.
    world, rng = pv.World(gravity=(0, 0), boundary=pv.Open(), dtype=np.float64), np.random.default_rng(0)
    ball = world.add(position=(1.0, 0.0), radius=0.1)
    world.forces.append(pv.PointSpring(ball, stiffness=stiffness))
    energies = []
    for _ in range(200):
        world.step(float(rng.choice(dts)))
        energies.append(world.energy().total / (0.5 * stiffness))
    assert max(energies) < (1.0 + 1e-9 if len(dts) == 1 else 10.0)
    assert min(energies) > (0.74 if len(dts) == 1 else 0.1)
