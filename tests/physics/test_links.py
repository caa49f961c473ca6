"""Links against what is on paper: pendulums, the catenary, springs, and a light rope with a heavy ball."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipk
from tests.worlds import FRAME, G, each_frame, points

import pyverlet as pv
from pyverlet import scenes

Array = NDArray[Any]


def chain(world: pv.World, points: Array, mass: Any, kind: type[pv.Stick] | type[pv.Rope] = pv.Stick) -> Any:
    group = world.add(position=points, radius=0.02, mass=mass)
    k = np.arange(len(points) - 1)
    return group, world.links.append(kind(group, k, k + 1))


def downward_crossings(t: Array, x: Array) -> Array:
    """Times at which x falls through 0, between the samples by a straight line."""
    k = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    return np.asarray(t[k] + x[k] / (x[k] - x[k + 1]) * (t[1] - t[0]))


@pytest.mark.parametrize(
    ("amplitude", "dtype", "name"),
    [
        *((amplitude, dtype, None) for amplitude in (0.05, 3.0) for dtype in (np.float32, np.float64)),
        *(pytest.param(each, dtype, None, marks=pytest.mark.slow) for each in (1.0, 2.0) for dtype in (np.float32, np.float64)),
        *((1.0, np.float64, name) for name in pv.integrators.BY_NAME),
    ],
)
def test_pendulum_keeps_the_period_of_the_elliptic_integral(amplitude: float, dtype: Any, name: str | None) -> None:
    # T = 4 sqrt(L / g) K(sin^2(amplitude / 2)). The method's own error is (w h)^2 / 24 = 2e-6; crossings between frames add 1e-5,
    # and near the top, at 3 rad, rounding in float32 moves the start by 1e-7 of an unstable position. Projection along the old
    # direction makes every method Stormer's as far as the link goes.
    length, mass = 1.3, 0.7
    integrator = pv.integrators.BY_NAME[name]() if name else None
    world = pv.World(collisions=None, dtype=dtype, integrator=integrator)
    group, _ = chain(world, length * np.array([[0, 0], [np.sin(amplitude), -np.cos(amplitude)]]), mass)
    group.pin(0)
    start = world.energy().total
    period = 4 * np.sqrt(length / G) * ellipk(np.sin(amplitude / 2) ** 2)
    x, energy = [], []
    for _ in each_frame(world, int(4.5 * period / FRAME)):
        x.append(float(group.position[1, 0]))
        energy.append(world.energy().total)
    crossings = downward_crossings(FRAME * np.arange(1, len(x) + 1), np.array(x))
    assert np.diff(crossings).mean() == pytest.approx(period, rel=2e-4 if amplitude == 3.0 else 5e-5)
    assert np.hypot(*(group.position[1] - group.position[0])) == pytest.approx(length, rel=1e-6 if dtype == np.float32 else 1e-9)
    # Of m g L: the velocity shown is good to h^2; nothing accumulates. First order methods show a velocity half a substep away:
    # m g v h / 2 of energy.
    off = 1e-3 * mass * G * length
    if world.integrator.order < 2:
        off = 1.5 * mass * G * np.sqrt(2 * G * length * (1 - np.cos(amplitude))) * FRAME / 8 / 2
    assert np.abs(np.array(energy) - start).max() < off
    assert np.mean(energy[-10:]) == pytest.approx(np.mean(energy[:10]), abs=off)


@pytest.mark.parametrize("kind", [pv.Stick, pv.Rope])
def test_hanging_chain_is_a_catenary(kind: type[pv.Stick] | type[pv.Rope]) -> None:
    # y = a cosh(x / a) + c through both ends, its arc 2 a sinh(w / 2a) the length of the chain. 40 straight links cut the corners
    # of the curve: h^2 / 24 of its curvature, 1e-3 m here.
    links, width, length = 40, 3.0, 4.0
    a = brentq(lambda a: 2 * a * np.sinh(width / (2 * a)) - length, 0.1, 100)
    s = np.linspace(-length / 2, length / 2, links + 1)
    x = a * np.arcsinh(s / a)
    catenary = np.column_stack((x, a * np.cosh(x / a) - a * np.cosh(width / (2 * a))))
    away = np.linspace(-width / 2, width / 2, links + 1)
    zigzag = np.sqrt((length / links) ** 2 - (width / links) ** 2) * (np.arange(links + 1) % 2)
    world = pv.World(collisions=None)
    world.forces.append(pv.forces.Drag(linear=0.1))
    group, _ = chain(world, np.column_stack((away, zigzag)), 0.02, kind)
    group.pin([0, -1])
    world.run(seconds=8.0)
    assert np.hypot(*world.velocity.T).max() < 2e-3
    assert np.abs(group.position - catenary).max() < 4e-3


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("substeps", [4, 8, 32])
def test_spring_has_its_period_and_damping_ratio(substeps: int, ratio: float) -> None:
    # m x'' + c x' + k x = 0: x = A exp(-z w t) cos(sqrt(1 - z^2) w t + phase), z = c / (2 sqrt(k m)).
    m, k = 2.0, 80.0
    w = np.sqrt(k / m)
    world = pv.World(collisions=None, gravity=(0, 0), substeps=substeps, dtype=np.float64)
    group = world.add(position=[(0, 0), (1.2, 0)], radius=0.1, mass=m)
    group.pin(0)
    world.links.append(pv.Spring(group, 0, 1, stiffness=k, damping=2 * ratio * np.sqrt(k * m), length=1.0))
    x = [float(group.position[1, 0]) - 1 for _ in each_frame(world, 300)]
    t = FRAME * np.arange(1, 301)
    damped = w * np.sqrt(1 - ratio**2)
    exact = 0.2 * np.exp(-ratio * w * t) * (np.cos(damped * t) + ratio * w / damped * np.sin(damped * t))
    crossings = downward_crossings(t, np.array(x))[:3]
    assert np.diff(crossings).mean() == pytest.approx(2 * np.pi / damped, rel=1e-3)
    # The start takes the whole of the first pull, a phase of w h / 2: a second order method begun in first order.
    assert np.abs(np.array(x) - exact).max() < 0.2 * w * FRAME / substeps


@pytest.mark.parametrize("integrator", [pv.TimeCorrectedVerlet, pv.VelocityVerlet, pv.RK4])
@pytest.mark.parametrize("stiffness", [50.0, 200.0, 400.0])
def test_a_swinging_spring_shows_the_energy_it_keeps(stiffness: float, integrator: type[pv.Integrator]) -> None:
    # Shown as Newmark's velocities are, it would go up and down by s / 6 of itself with s = (omega h)^2, and rise by that in the
    # first frame. On purpose the method loses the part q = s^2 / (s^2 + 0.04) of what backward Euler does, s in a substep.
    world = pv.World(gravity=(0, 0), collisions=None, dtype="float64", integrator=integrator())
    balls = world.add(position=[(0, 0), (1.25, 0)], velocity=[(1, 0), (-1, 0)], radius=0.1, mass=1.0)
    world.links.append(pv.Spring(balls, 0, 1, stiffness=stiffness))
    energies = [world.energy().total, *(world.energy().total for _ in each_frame(world, 60))]
    s = 2 * stiffness / 480**2
    assert np.abs(np.array(energies) / energies[0] - 1).max() <= 2 * s**3 / 0.04 * 480 + s**2


@pytest.mark.parametrize(("stiffness", "substeps"), [(50.0, 4), (50.0, 32), (5e3, 8), (5e5, 4), (5e5, 32), (5e7, 8)])
def test_stiffness_is_that_of_the_argument_at_any_substeps(stiffness: float, substeps: int) -> None:
    # At rest k s = m g for the spring; the stick with compliance 1 / k gives way by as much. From soft to far beyond what a
    # substep resolves: w h = 0.015 to 15.
    world = pv.World(collisions=None, substeps=substeps, dtype=np.float64)
    group = world.add(position=[(0, 0), (0, -1), (1, 0), (1, -1)], radius=0.1, mass=1.0)
    group.pin([0, 2])
    world.links.append(pv.Spring(group, 0, 1, stiffness=stiffness))
    world.links.append(pv.Stick(group, 2, 3, compliance=1 / stiffness))
    world.forces.append(pv.forces.Drag(linear=4.0))
    world.run(seconds=3.0)
    assert -1 - group.position[[1, 3], 1] == pytest.approx(G / stiffness, rel=0.01)


def test_net_of_springs_is_as_stiff_at_any_substeps() -> None:
    # A chain of n springs has stiffness k / n: solved at once. Crosswise ones make it a net, solved colour by colour.
    sag = []
    for substeps in (4, 8, 32):
        world = pv.World(collisions=None, substeps=substeps, dtype=np.float64)
        group = world.add(position=points(np.arange(4.0), -np.arange(8.0)), radius=0.1, mass=0.1)
        group.pin(slice(0, 4))
        n = np.arange(32).reshape(8, 4)
        world.links.append(pv.Spring(group, n[:-1].ravel(), n[1:].ravel(), stiffness=200.0))
        world.links.append(pv.Spring(group, n[:, :-1].ravel(), n[:, 1:].ravel(), stiffness=200.0))
        world.links.append(pv.Spring(group, n[:-1, :-1].ravel(), n[1:, 1:].ravel(), stiffness=200.0))
        world.links.append(pv.Spring(group, n[:-1, 1:].ravel(), n[1:, :-1].ravel(), stiffness=200.0))
        world.forces.append(pv.forces.Drag(linear=0.5))
        world.run(seconds=4.0)
        sag.append(-7 - group.position[-4:, 1].mean())
    assert sag[0] > 0.01
    assert sag == pytest.approx([sag[-1]] * 3, rel=0.05)


def test_rope_is_slack_until_it_is_taut() -> None:
    world = pv.World(collisions=None, dtype=np.float64)
    group = world.add(position=[(0, 0), (0, -0.5)], radius=0.1, mass=1.0)
    group.pin(0)
    rope = world.links.append(pv.Rope(group, 0, 1, length=1.0))
    world.run(seconds=0.3)
    assert group.position[1, 1] == pytest.approx(-0.5 - G / 2 * world.time**2, abs=1e-9)  # free fall
    assert rope.force[0] == 0.0
    world.run(seconds=1.0)
    assert group.position[1, 1] == pytest.approx(-1.0, abs=1e-5)
    assert rope.force[0] == pytest.approx(G, rel=0.01)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_slack_rope_forgets_its_pull(dtype: type[np.float32]) -> None:
    # Averaged over 1/120 s, at h = 1/480 s, a pull of 10 N is 10 N 0.8^n after n substeps: below 1e-25 N after 270 of them, and
    # without an end to it a denormal number for ever, with which processors take a hundred times as long.
    world = pv.World(dtype=dtype)
    group = world.add(position=[(0, 0), (0, -1)], radius=0.05, mass=1.0)
    group.pin(0)
    rope = world.links.append(pv.Rope(group, 0, 1, length=1.0))
    world.run(seconds=1.0)
    assert rope.force[0] == pytest.approx(G, rel=0.01)
    group.position[1] = 0, -0.5
    group.velocity[1] = 0
    group.pin(1)
    world.run(seconds=1.0)
    assert rope.force[0] == 0.0


@pytest.mark.parametrize("compliance", [0.0, 1e-3])
def test_pin_holds_a_heavy_rope_by_a_light_particle(compliance: float) -> None:
    world = pv.World(collisions=None, dtype=np.float64)
    mass = np.full(11, 0.01)
    mass[-1] = 50.0
    group, _ = chain(world, np.column_stack((np.zeros(11), -0.1 * np.arange(11))), mass)
    pin = world.links.append(pv.Pin(group, 0, compliance=compliance, damping=400.0 if compliance else 0.0))
    world.run(seconds=4.0)
    weight = G * mass.sum()
    assert pin.force[0] == pytest.approx(weight, rel=0.01)
    assert -group.position[0, 1] == pytest.approx(compliance * weight, rel=0.01, abs=1e-5)
    pin.point = (0.0, 1.0)
    world.run(seconds=3.0)
    assert group.position[0, 1] == pytest.approx(1.0 - compliance * weight, abs=0.02)


@pytest.mark.parametrize("substeps", [1, 8, 32])
@pytest.mark.parametrize("speed", [0.2, 2.0, 20.0])
def test_what_a_rigid_pin_carries_moves_as_the_pin_does(speed: float, substeps: int) -> None:
    # Moved by v dt in each frame it has the speed v, is a wall to what it meets (v' = v for e = 0), and what it drags keeps v.
    world = pv.World(gravity=(0, 0), dtype=np.float64, substeps=substeps)
    group = world.add(position=[(0, 0), (1.2, 0), (0, 5), (-0.5, 5)], radius=[0.5, 0.5, 0.1, 0.1])
    world.links.append(pv.Stick(group, 2, 3))
    pin = world.links.append(pv.Pin(group, [0, 2]))
    start = pin.point
    for k in range(1, 31):
        pin.point = start + np.array((speed * k * FRAME, 0))
        world.step(FRAME)
        assert group.velocity[[0, 2, 3], 0] == pytest.approx(speed, rel=1e-6)
        assert group.position[[0, 2]] == pytest.approx(pin.point, abs=1e-9)
    assert group.velocity[1, 0] == pytest.approx(speed if speed * 30 * FRAME > 0.2 else 0, rel=0.01)
    state = world.save()
    world.links.remove(pin)
    world.step(FRAME)
    assert group.velocity[2:] == pytest.approx(np.array([(speed, 0)] * 2), rel=1e-6)
    world.restore(state)
    for _ in each_frame(world, 2):  # left where it is
        assert group.velocity[[0, 2]] == pytest.approx(0, abs=1e-9)
        assert group.position[[0, 2]] == pytest.approx(start + np.array((speed * 30 * FRAME, 0)), abs=1e-9)


def test_angle_swings_like_a_torsion_spring() -> None:
    # Two arms held at their joint: I = m L^2 for the free arm, w = sqrt(1 / (compliance I)).
    length, mass, compliance = 0.5, 0.4, 0.2
    world = pv.World(collisions=None, gravity=(0, 0), dtype=np.float64)
    group = world.add(position=[(-0.5, 0), (0, 0), (length, 0)], radius=0.05, mass=mass)
    group.pin([0, 1])
    world.links.append(pv.Stick(group, 1, 2))
    angle = world.links.append(pv.Angle(group, 0, 1, 2, compliance=compliance))
    assert abs(angle.angle[0]) == pytest.approx(np.pi)
    group.velocity[2] = (0.0, 0.2)
    start = world.energy().total
    y = []
    for _ in each_frame(world, 600):
        y.append(float(group.position[2, 1]))
        assert world.energy().total == pytest.approx(start, rel=0.01)
    period = 2 * np.pi * np.sqrt(compliance * mass * length**2)
    crossings = downward_crossings(FRAME * np.arange(1, 601), np.array(y))
    assert np.diff(crossings).mean() == pytest.approx(period, rel=2e-3)


@pytest.mark.parametrize("substeps", [4, 8, pytest.param(32, marks=pytest.mark.slow)])
def test_beam_bends_as_far_at_any_substeps(substeps: int) -> None:
    # A cantilever of rigid links, nearly straight: joint k turns by compliance times the torque of all weights beyond it, and
    # takes the end down by that times its arm.
    links, length, compliance, mass, g = 8, 0.1, 0.2, 0.02, 0.2
    world = pv.World(collisions=None, gravity=(0, -g), substeps=substeps, dtype=np.float64)
    group, _ = chain(world, np.column_stack((np.arange(-1, links + 1) * length, np.zeros(links + 2))), mass)
    group.pin([0, 1])
    k = np.arange(links)
    world.links.append(pv.Angle(group, k, k + 1, k + 2, compliance=compliance))
    world.links.iterations = 4
    world.forces.append(pv.forces.Drag(linear=0.05))
    world.run(seconds=8.0)
    x = length * np.arange(links + 1)
    torque = np.array([mass * g * np.sum(x[n + 1 :] - x[n]) for n in range(links)])
    assert -group.position[-1, 1] == pytest.approx(float(np.sum(compliance * torque * (x[-1] - x[:-1]))), rel=0.05)


@pytest.mark.parametrize("substeps", [4, 8, 32])
def test_area_is_kept_under_load_and_pressure_is_compliance(substeps: int) -> None:
    # Pumped up to 1.2 times its area, a ring of springs with stiffness k has the pressure p with p ds = tension dphi: T = p R.
    count, radius, k, compliance = 24, 1.0, 200.0, 1e-3
    phi = 2 * np.pi * np.arange(count) / count
    world = pv.World(collisions=None, gravity=(0, 0), substeps=substeps, dtype=np.float64)
    group = world.add(position=radius * np.column_stack((np.cos(phi), np.sin(phi))), radius=0.05, mass=0.1)
    n = np.arange(count)
    spring = world.links.append(pv.Spring(group, n, (n + 1) % count, stiffness=k))
    area = world.links.append(pv.Area(group, compliance=compliance))
    area.area = 1.2 * area.area
    world.forces.append(pv.forces.Drag(linear=1.0))
    world.run(seconds=4.0)
    x, y = group.position.T
    now = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    pressure = (float(area.area[0]) - now) / compliance
    side = np.hypot(*(np.roll(group.position, -1, axis=0) - group.position).T)
    # On a polygon the pressure pushes each corner with p side cos(pi / n); both its sides pull with 2 T sin(pi / n).
    tension = pressure * side.mean() / (2 * np.tan(np.pi / count))
    assert spring.force == pytest.approx(np.full(count, tension), rel=0.05)
    assert k * (side - spring.length) == pytest.approx(np.full(count, tension), rel=0.05)
    assert area.force[0] == pytest.approx(-pressure, rel=0.05)


def test_who_is_pulled_into_an_elastic_wall_keeps_its_energy() -> None:
    # The velocity of a substep is that of h / 2 ago: the pull lacks a h / 2, of which the wall sees 5 / 8 - 1 / 2 too much, twice
    # a bounce. At a = 101 m/s^2 and v = 10 m/s that is 2 * 2 / 8 a h / v = 1 % of the energy a bounce at most, up to 30 % in 30.
    # Without it the wall was wrong by 1 / 2, and half of the energy was lost.
    world = pv.World(gravity=(0, -1), boundary=pv.Box((-5, 0), (5, 10), restitution=1), dtype=np.float64)
    ball = world.add(position=[(0, 0.6), (3, 0.6)], radius=0.1, mass=1, restitution=1)
    world.links.append(pv.Pin(ball, 0, point=(0, -10), compliance=0.1))
    start, fall = world.energy().total, 0.5 * (10.6**2 - 10.1**2) / 0.1
    world.run(seconds=6)
    assert world.energy().total == pytest.approx(start, abs=0.3 * fall)


def test_newtons_cradle_passes_its_momentum_to_the_last_ball() -> None:
    # Equal masses and e = 1 exchange velocities: the middle balls stay, the last rises as high as the first was drawn aside.
    world = scenes.get("newton-cradle").world()
    balls = world.position[5:]
    lift = 4.0 * (1 - np.cos(0.9))
    start = world.energy().total
    highest = np.zeros(5)
    for _ in each_frame(
        world, 150
    ):  # down, through, and up on the other side: half a period of the large swing, 2.1 s, and a little
        highest = np.maximum(highest, balls[:, 1])
        assert world.energy().total == pytest.approx(start, rel=2e-3)
    assert highest[0] == pytest.approx(lift, rel=0.01)
    assert highest[4] == pytest.approx(lift, rel=0.01)
    assert highest[1:4].max() < 1e-3 * lift
    world = scenes.get("newton-cradle").world()
    while world.velocity[9, 0] < 1.0:
        world.step(FRAME / 4)
    before = np.sqrt(2 * G * lift)
    assert world.velocity[9, 0] == pytest.approx(before, rel=0.01)
    assert np.abs(world.velocity[5:9]).max() < 0.01 * before


# ---- under a load ------------------------------------------------------------------------------------------------------------


def loaded_pin(damping: float, **options: Any) -> tuple[pv.World, pv.Group, pv.Pin]:
    """A soft pin that carries ten circles beside its own, in a slot."""
    world = pv.World(boundary=pv.Box((-0.5, -5), (0.5, 30)), dtype=np.float64, threads=1, **options)
    column = world.add(position=[(0, 1.0001 * k) for k in range(11)], radius=0.499)
    return world, column, world.links.append(pv.Pin(column, 0, point=(0, 0), compliance=1e-5, damping=damping))


@pytest.mark.parametrize("substeps", [2, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("damping", [0.0, 200.0, 2000.0])
def test_a_soft_pin_under_a_pile_gives_what_its_compliance_says(damping: float, substeps: int) -> None:
    # At rest nothing moves: deflection = load * compliance, whatever the damping. Contacts carry the load by velocities that
    # move nobody, which are no motion to be damped.
    world, column, pin = loaded_pin(damping, substeps=substeps)
    world.run(seconds=12)
    load = 11 * 9.81
    assert float(np.sum(pin.force)) == pytest.approx(load, rel=1e-3)
    assert -float(column.position[0, 1]) == pytest.approx(load * 1e-5, rel=1e-3)


# ---- What stiff links hold is F^2 / 2 k, however coarse coordinates are ----


LINKS: dict[str, Any] = {
    "spring": lambda bob, k: pv.Spring(bob, 0, 1, stiffness=k),
    "damped": lambda bob, k: pv.Spring(bob, 0, 1, stiffness=k, damping=1e-4 * k),
    "stick": lambda bob, k: pv.Stick(bob, 0, 1, compliance=1 / k),
    "rope": lambda bob, k: pv.Rope(bob, 0, 1, compliance=1 / k),
}


@pytest.mark.parametrize("kind", LINKS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("away", "stiffness"), [(3.1, 1e10), (3.1, 1e7), (500.0, 1e8)])
def test_a_weight_that_hangs_stores_what_is_on_paper(kind: str, dtype: type[np.float32], away: float, stiffness: float) -> None:
    world = pv.World(dtype=dtype)
    bob = world.add(position=[(away, 7.3), (away, 6.3)], radius=0.1, mass=2.0)
    bob.pin(0)
    world.links.append(LINKS[kind](bob, stiffness))
    assert world.energy().links <= 1e-3
    world.run(seconds=1)
    expected = (2 * 9.81) ** 2 / (2 * stiffness)
    seen = [world.energy().links / expected for _ in each_frame(world, 10)]
    assert seen == pytest.approx([1] * 10, rel=0.03 if away > 100 else 0.01)


def test_a_stretch_that_can_be_seen_is_measured() -> None:
    world = pv.World(gravity=(0, 0))
    pair = world.add(position=[(3.0, 7.0), (4.0, 7.0)], radius=0.1)
    world.links.append(pv.Spring(pair, 0, 1, stiffness=1e6, length=0.99))
    assert world.energy().links == pytest.approx(0.5e6 * 1e-4, rel=1e-3)


def test_what_links_show_is_no_more_than_their_coordinates_hide() -> None:
    # An obstacle throws an angle about: its force is no measure of what it holds then. The ledger, by positions, closes.
    rng = np.random.default_rng(256)
    world = pv.World(ledger=True, threads=1)
    circles = world.add(position=rng.uniform(-6.36, 6.36, (6, 2)), radius=0.921)
    world.links.append(pv.Angle(circles, np.arange(4), np.arange(1, 5), np.arange(2, 6), compliance=0.00154))
    world.obstacles.append(pv.Capsule((8.92, -4.55), (-0.817, 5.79), radius=0.3))
    world.step(1 / 240)
    assert sum(vars(world.ledger).values()) == pytest.approx(world.energy().total, rel=1e-6)


def test_rigid_links_that_are_far_off_come_back_step_by_step() -> None:
    # What a chain is off falls by a sixteenth in a substep, as long as that is more than overlaps are pushed out by: 8 radii a
    # second. An angle comes back by 0.05 rad. Along the line of a stick, and in small steps of an angle, that is exact.
    world = pv.World(collisions=None, gravity=(0, 0), dtype=np.float64)
    pair = world.add(position=[(0, 0), (1, 0)], radius=0.1)
    stick = world.links.append(pv.Stick(pair, 0, 1))
    stick.length = 2.0
    corner = world.add(position=[(5, 0), (6, 0), (6, 1)], radius=0.1)
    angle = world.links.append(pv.Angle(corner, 0, 1, 2))
    before = float(angle.angle[0])
    angle.angle = before + 1.0
    world.step(1 / 60)
    assert pair.position[1, 0] - pair.position[0, 0] == pytest.approx(2.0 - (15 / 16) ** 8, rel=1e-9)
    a, b = corner.position[[0, 2]] - corner.position[1]
    turned = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) - before
    assert turned % (2 * np.pi) == pytest.approx(8 * 0.05, rel=0.05)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("law", [{"restitution": 1.0}, {"restitution": 0.5, "friction": 0.3}])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_sticks_whose_circles_touch_turn_freely(count: int, law: dict[str, Any], dtype: Any) -> None:
    # A stick holds them at that distance: if they collided, contact and stick would push for ever. Nothing acts from outside: L
    # stays, and E to the order of the method, (w h)^2 / 12.
    w = 3.0
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(**law), dtype=dtype, ledger=True)
    angle = 2 * np.pi * np.arange(count) / count
    place = 0.5 / np.sin(np.pi / count) * np.column_stack((np.cos(angle), np.sin(angle)))
    group = world.add(position=place, velocity=w * np.column_stack((-place[:, 1], place[:, 0])), radius=0.5)
    around = np.arange(count if count > 2 else 1)
    world.links.append(pv.Stick(group, around, (around + 1) % count))
    energy, turning = world.energy().total, world.angular_momentum()
    world.run(seconds=5)
    assert world.energy().total == pytest.approx(energy, rel=(w / 480) ** 2)
    assert world.angular_momentum() == pytest.approx(turning, rel=1e-5)
    assert world.ledger.limiter == 0
