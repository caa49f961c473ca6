"""Motors: torque over moment of inertia, a speed that is held, stall, and what reacts."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import G, each_frame, slope

import pyverlet as pv

K = 0.5  # I / (m r^2) of a disc
DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])
STEPS = pytest.mark.parametrize(("dt", "substeps"), [(1 / 60, 8), (1 / 240, 4), (1 / 30, 16)])


def empty(**settings: Any) -> pv.World:
    return pv.World(**{"boundary": pv.Open(), "gravity": (0, 0), "dtype": np.float64, "ledger": True, **settings})


def arm_rate(group: pv.Group, j: int, k: int) -> float:
    """rad/s of the line from j to k."""
    way, speed = group.position[k] - group.position[j], group.velocity[k] - group.velocity[j]
    return float((way[0] * speed[1] - way[1] * speed[0]) / (way @ way))


@DTYPES
@STEPS
@pytest.mark.parametrize("inertia", [None, 0.8])
def test_a_wheel_is_spun_up_by_torque_over_inertia(inertia: float | None, dtype: Any, dt: float, substeps: int) -> None:
    """alpha = torque / I from the first frame on, to rounding, and the work of the motor is I w^2 / 2."""
    world, torque, m, r = empty(dtype=dtype, substeps=substeps), 0.7, 2.0, 0.3
    disc = world.add(position=(0, 0), radius=r, mass=m, inertia=inertia)
    motor = world.links.append(pv.Motor(disc, 0, speed=-500.0, max_torque=torque))
    inertia, eps = inertia or 0.5 * m * r * r, float(np.finfo(dtype).eps)
    for n in range(1, 41):
        world.step(dt)
        assert disc.spin[0] == pytest.approx(-torque / inertia * n * dt, rel=8 * substeps * eps * (n + 8))
    assert motor.force[0] == pytest.approx(-torque, rel=1e-3)  # a mean over 1/120 s
    assert world.ledger.motors == pytest.approx(0.5 * inertia * float(disc.spin[0]) ** 2, rel=2000 * eps)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=2000 * eps)


@DTYPES
def test_it_ends_at_its_speed(dtype: Any) -> None:
    world = empty(dtype=dtype)
    disc = world.add(position=[(0, 0), (3, 0)], radius=0.5, mass=1.0, spin=[0.0, 90.0])
    motor = world.links.append(pv.Motor(disc, [0, 1], speed=[4.0, 30.0], max_torque=[1.0, np.inf]))
    world.step(1 / 60)
    assert disc.spin[1] == pytest.approx(30.0, rel=1e-6)
    world.run(seconds=1.0)
    assert disc.spin == pytest.approx([4.0, 30.0], rel=1e-6)
    assert motor.force == pytest.approx([0.0, 0.0], abs=1e-5)
    motor.speed = [-2.0, 5.0]
    world.run(seconds=1.0)
    assert disc.spin == pytest.approx([-2.0, 5.0], rel=1e-6)
    motor.max_torque, motor.speed = 0.0, 100.0  # let go
    world.run(seconds=0.5)
    assert disc.spin == pytest.approx([-2.0, 5.0], rel=1e-6)


@DTYPES
@STEPS
def test_a_wheel_climbs_a_slope(dtype: Any, dt: float, substeps: int) -> None:
    """Rolling without slipping, m (1 + k) a = torque / r - m g sin(angle). The floor begins to push in the second substep."""
    angle, torque, m, r = 0.3, 3.0, 2.0, 0.25
    world = slope(-angle, dtype=dtype, substeps=substeps)
    wheel = world.add(position=(0, r), radius=r, mass=m)
    world.links.append(pv.Motor(wheel, 0, speed=-1000.0, max_torque=torque))
    world.run(seconds=1.0, dt=dt)
    a, h = (torque / r - m * G * np.sin(angle)) / (m * (1 + K)), dt / substeps
    assert wheel.velocity[0, 0] == pytest.approx(a, abs=(torque / (m * r) + G) * h + 1e-5)
    assert wheel.spin[0] * r == pytest.approx(-wheel.velocity[0, 0], abs=1e-5)
    # power is torque times spin: the way of the wheel over its radius, less the way of the first substeps
    way = float(wheel.position[0, 0]) / r
    assert world.ledger.motors == pytest.approx(torque * way, rel=2e-2 if dt > 0.02 else 5e-3)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-5)


@pytest.mark.parametrize(("share", "holds"), [(1.3, True), (1.02, True), (0.98, False), (0.5, False)])
def test_a_speed_is_held_up_to_the_largest_torque(share: float, holds: bool) -> None:
    """Up a slope at v the torque is m g r sin(angle); with less, the wheel slows down, and rolls back, by what is missing."""
    angle, m, r, v = 0.3, 2.0, 0.25, 1.0
    needed = m * G * r * np.sin(angle)
    world = slope(-angle)
    wheel = world.add(position=(0, r), velocity=(v, 0), spin=-v / r, radius=r, mass=m)
    motor = world.links.append(pv.Motor(wheel, 0, speed=-v / r, max_torque=share * needed))
    world.run(seconds=2.0)
    if holds:
        assert wheel.velocity[0, 0] == pytest.approx(v, abs=1e-9)
        assert motor.force[0] == pytest.approx(-needed, rel=1e-9)
    else:
        a = G * np.sin(angle) * (share - 1) / (1 + K)
        assert wheel.velocity[0, 0] == pytest.approx(v + 2.0 * a, abs=2 * G / 480)
        assert motor.force[0] == pytest.approx(-share * needed, rel=1e-9)


def test_a_wheel_slips_where_friction_is_less() -> None:
    """a = mu g, alpha = (torque - mu m g r) / I; friction takes mu m g times the way that it slips."""
    mu, torque, m, r, t = 0.2, 5.0, 2.0, 0.25, 1.0
    world = slope(0.0, friction=mu)
    wheel = world.add(position=(0, r), radius=r, mass=m)
    world.links.append(pv.Motor(wheel, 0, speed=-1e6, max_torque=torque))
    world.run(seconds=t)
    a, alpha = mu * G, (torque - mu * m * G * r) / (0.5 * m * r * r)
    assert wheel.velocity[0, 0] == pytest.approx(a * t, abs=2 * a / 480)
    assert -wheel.spin[0] == pytest.approx(alpha * t, abs=4 * mu * G / r / 480)
    assert world.ledger.friction == pytest.approx(-mu * m * G * (alpha * r - a) * t * t / 2, rel=1e-2)
    assert world.ledger.motors == pytest.approx(torque * alpha * t * t / 2, rel=1e-2)


@pytest.mark.parametrize("arm", [(1, 2), (1,)])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 30, None])
def test_disc_and_arm_keep_their_angular_momentum(arm: tuple[int, ...], dt: float | None) -> None:
    """Against an arm of its own the torque is internal: momenta stay zero to rounding, and the disc has the speed of that.

    Rounding: 2e-16 of 1.8 kg m^2/s, in up to 2,000 substeps.
    """
    world, rng = empty(collisions=None), np.random.default_rng(0)
    body = world.add(position=[(0, 0), (1, 0.2), (2, 0.5)], radius=0.3, mass=[2.0, 1.0, 3.0])
    world.links.append(pv.Stick(body, [1, 0], [2, 1]))
    world.links.append(pv.Motor(body, 0, *arm, speed=20.0, max_torque=2.5))
    for _ in range(120):
        world.step(dt or float(rng.uniform(1 / 240, 1 / 30)))
        assert abs(world.angular_momentum()) < 1e-12
        assert np.abs(world.momentum()).max() < 1e-12
    j, k = arm if len(arm) == 2 else (0, *arm)
    # Between frames velocities are those of the middle of a substep, carried on: off by h^2 of how fast the arm's rate changes.
    assert body.spin[0] - arm_rate(body, j, k) == pytest.approx(20.0, rel=1e-3)
    assert body.spin[0] > 5.0
    assert world.ledger.motors == pytest.approx(world.energy().total, rel=1e-5)


@DTYPES
def test_a_crank_lifts_a_weight_or_stalls(dtype: Any) -> None:
    """A pinned hub turns an arm. Stalled at angle A, the weight falls with m l^2 A'' = torque - m g l cos(A)."""
    m, length = 2.0, 0.5
    for share in (1.2, 0.6):
        world = empty(gravity=(0, -G), dtype=dtype)
        body = world.add(position=[(0, 0), (length, 0)], radius=0.05, mass=[1.0, m])
        body.pin(0)
        world.links.append(pv.Stick(body, 0, 1))
        motor = world.links.append(pv.Motor(body, 0, 1, speed=-0.5, max_torque=share * m * G * length))
        world.run(seconds=0.5 if share > 1.0 else 0.1)
        if share > 1.0:  # the hub stands still, so that the arm turns at +0.5 rad/s
            assert arm_rate(body, 0, 1) == pytest.approx(0.5, rel=1e-4)
            # `force` is on the hub. It is a mean over the last 1/120 s, in which the cosine changes by 0.05 / 240.
            angle = np.arctan2(*body.position[1, ::-1])
            assert -motor.force[0] == pytest.approx(m * G * length * np.cos(angle), rel=3e-3)
            assert world.ledger.motors == pytest.approx(world.energy().total, abs=1e-3)
        else:  # the cosine is 1 within A^2 / 2 = 8e-4
            fallen = 0.5 * (G / length) * (1 - share) * 0.1**2
            assert np.arctan2(*body.position[1, ::-1]) == pytest.approx(-fallen, rel=1e-3)


@DTYPES
def test_a_car_pitches_and_drives(dtype: Any) -> None:
    """Two driven wheels under a beam: (M + 2 k m_w) a = 2 torque / r. Its rear presses more than its front.

    Moments about the front contact: N_rear base = M g base / 2 + (m_beam z + 2 m_w r) a + 2 I a / r, with z the height of the
    beam. The pitch of the chassis against its two wheels is what carries the couple of the motors.
    """
    r, wheel, beam, torque, base, z = 0.3, 1.0, 4.0, 1.0, 3.0, 0.8
    world = pv.World(gravity=(0, -G), dtype=dtype, contacts=True, ledger=True)
    tracks = [world.obstacles.append(pv.Segment((x, 0), (x + 8, 0), friction=2.0)) for x in (-5.5, 2.5)]
    places, sizes = [(0, r), (base, r), (0, z), (base, z)], [r, r, 0.1, 0.1]
    car = world.add(position=places, radius=sizes, mass=[wheel, wheel, beam / 2, beam / 2], friction=2.0)
    world.links.append(pv.Stick(car, [0, 0, 1, 1, 2], [2, 3, 2, 3, 3], collide=False))
    world.links.append(pv.Motor(car, [0, 1], 2, 3, speed=-1000.0, max_torque=torque))
    world.run(seconds=0.5)
    before = float(car.velocity[:, 0].mean())
    world.run(seconds=1.0)
    whole = beam + 2 * wheel
    a = 2 * torque / r / (whole + 2 * K * wheel)
    assert car.velocity[:, 0].mean() - before == pytest.approx(a, rel=1e-3)
    more = (beam * z + 2 * wheel * r + 2 * K * wheel * r) * a / base
    rear, front = (-float(world.force_on(track)[1]) for track in tracks)
    assert rear == pytest.approx(whole * G / 2 + more, rel=1e-3)
    assert front == pytest.approx(whole * G / 2 - more, rel=1e-3)


@pytest.mark.parametrize("integrator", [pv.RK4(), pv.VelocityVerlet(), pv.SemiImplicitEuler(), pv.PositionVerlet()])
def test_any_integrator_spins_it_up(integrator: Any) -> None:
    """alpha = torque / I, and a frame of a quarter of a second."""
    world = empty(gravity=(0, -G), integrator=integrator, substeps=4)
    disc = world.add(position=[(0, 0), (5, 0)], radius=0.5, mass=2.0)
    world.links.append(pv.Motor(disc, 0, speed=100.0, max_torque=0.5))
    for dt in (1 / 60, 1 / 240, 0.25, 1 / 60):
        world.step(dt)
    alpha, h = 0.5 / 0.25, 0.25 / 32
    # Velocities of the one are those of the middle of a substep.
    lag = 0.5 * h if isinstance(integrator, pv.SemiImplicitEuler) else 1e-9
    assert disc.spin[0] == pytest.approx(alpha * world.time, abs=2 * alpha * lag)


# ---- Limits of angles: free within, a stop at the ends that carries what leans on it ----


M, LENGTH = 2.0, 1.0


def pendulum(least: float, most: float, *, heading: float = 0.0, **settings: Any) -> tuple[pv.World, pv.Group, pv.AngleLimit]:
    """A stick of LENGTH from a pivot, to the right at first. Angles are against a pinned particle in direction `heading`, rad."""
    world = pv.World(**{"boundary": pv.Open(), "dtype": np.float64, "ledger": True, **settings})
    far = (2 * np.cos(heading), 2 * np.sin(heading))
    group = world.add(position=[far, (0, 0), (LENGTH, 0)], radius=0.1, mass=[1.0, 1.0, M])
    group.pin([0, 1])
    world.links.append(pv.Stick(group, 1, 2))
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=least, most=most))
    return world, group, limit


def angle_of(group: pv.Group) -> float:
    return float(np.arctan2(group.position[2, 1], group.position[2, 0]))


@DTYPES
@pytest.mark.parametrize(("heading", "dt"), [(0.0, 1 / 60), (np.pi, 1 / 30), (2.0, 1 / 240), (2.0, None)])
def test_a_pendulum_stops_at_its_limit_and_rests_there(heading: float, dt: float | None, dtype: Any) -> None:
    """It falls as a free one does, stops at -30 degrees, and presses with the torque m g l cos(30 degrees)."""
    stop, rng = -np.pi / 6, np.random.default_rng(0)
    world, group, limit = pendulum(stop - heading, 2.0 - heading, heading=heading, dtype=dtype)
    free, other, _ = pendulum(-3.0 - heading, 3.0 - heading, heading=heading, dtype=dtype)
    eps, falls = float(np.finfo(dtype).eps), True
    while world.time < 2.0:
        step = dt or float(rng.uniform(1 / 240, 1 / 30))
        world.step(step)
        free.step(step)
        assert angle_of(group) > stop - 20 * eps
        falls &= angle_of(other) > stop + 0.2
        if falls:
            assert np.array_equal(group.position, other.position)
            assert limit.force[0] == 0.0
    assert angle_of(group) == pytest.approx(stop, abs=20 * eps)
    assert np.abs(group.velocity).max() < 40 * eps
    # `force` is what the link pulls with: negative where it pushes the angle up
    assert limit.force[0] == pytest.approx(-M * G * LENGTH * np.cos(stop), rel=1e-5 if dtype == np.float32 else 1e-9)
    assert world.ledger.restitution == pytest.approx(M * G * LENGTH * np.sin(stop), rel=1e-5)  # what it fell
    assert world.energy().total == pytest.approx(world.ledger.total, abs=1e-4 if dtype == np.float32 else 1e-12)


def test_both_ends_stop_and_let_go() -> None:
    """Thrown up it stops at the end of its range, and falls again at once: a limit does not hold."""
    world, group, limit = pendulum(-0.5, 0.7)
    group.velocity[2] = (0, 8.0)
    highest = max(angle_of(group) for _ in each_frame(world, 20))
    assert highest < 0.7 + 1e-12
    assert highest > 0.7 - 0.5 * G / LENGTH / 60**2  # within the frame it falls by less
    assert angle_of(group) < 0.65
    world.run(seconds=1.0)
    assert angle_of(group) == pytest.approx(-0.5, abs=1e-12)
    limit.limits(-0.45, 0.1)  # moved while it leans on it: it is lifted there at once
    assert (limit.least[0], limit.most[0]) == (-0.45, pytest.approx(0.1))
    world.step(1 / 60)
    assert angle_of(group) == pytest.approx(-0.45, abs=1e-12)


def test_an_angle_that_is_changed_is_a_muscle() -> None:
    """It lifts a weight in worlds whose particles collide, too: the limiter takes that for no gain of contacts."""
    world, group, _ = pendulum(-3.0, 3.0)
    angle = world.links.append(pv.Angle(group, 0, 1, 2))
    for n in range(1, 61):
        angle.angle = n / 60
        world.step(1 / 60)
        assert angle_of(group) == pytest.approx(n / 60, abs=1e-12)
    assert world.energy().potential == pytest.approx(M * G * LENGTH * np.sin(1.0), rel=1e-12)
    assert world.ledger.limiter == 0.0


def test_without_gravity_momenta_are_kept() -> None:
    """Two sticks that fold up until their limit stops them: they turn on as one. The torque of a limit is internal.

    Sticks and limit are solved in turn, and lengths and the angle are off by what that leaves: 1e-6.
    """
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), dtype=np.float64)
    group = world.add(position=[(-1, 0), (0, 0), (1, 0)], radius=0.1, mass=[1.0, 2.0, 3.0], velocity=[(0, 0), (0, 0), (0, 3.0)])
    world.links.append(pv.Stick(group, [0, 1], [1, 2]))
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=np.pi, most=np.pi + 1.0))
    before, whole = world.angular_momentum(), world.momentum()
    for _ in each_frame(world, 120):
        assert world.angular_momentum() == pytest.approx(before, rel=1e-5)
        assert world.momentum() == pytest.approx(whole, abs=1e-10)
        a, b = group.position[0] - group.position[1], group.position[2] - group.position[1]
        angle = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) % (2 * np.pi)
        assert np.pi - 1e-5 < angle < np.pi + 1.0 + 1e-5
    assert limit.intact[0]


def test_what_is_stronger_breaks_it() -> None:
    world, group, _ = pendulum(-0.5, 0.7)
    world.links.remove(world.links[1])
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=-0.5, most=0.7, breaking_torque=0.5 * M * G * LENGTH))
    world.run(seconds=1.0)
    assert not limit.intact[0]
    assert angle_of(group) < -0.6


@pytest.mark.parametrize("start", [0.02, 0.06, 0.3])
def test_a_limit_outside_its_range_is_reached_again(start: float) -> None:
    """What begins outside is brought to the nearer end, and is not thrown: the speed of that is taken in the same substep."""
    world, group, _ = pendulum(start, 1.5, gravity=(0, 0))
    world.step(1 / 60)
    assert angle_of(group) == pytest.approx(start, abs=0.05**2 / 2)  # steps along tangents, of 0.05 rad at most
    assert np.abs(group.velocity).max() < 1e-9 * 0.05 * 480  # of the speed at which it came
