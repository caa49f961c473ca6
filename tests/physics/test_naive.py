"""Clamp-and-flip and pure projection: what exactly they do wrong, in closed form, where the real bounds are right."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

G, H, MASS, RADIUS = 9.81, 1 / 60, 2.0, 0.25
FLOOR = pv.Box((-5, 0), (5, 20), restitution=1.0)


def dropped(boundary: pv.Boundary, integrator: pv.Integrator, height: float = 2.0) -> tuple[pv.World, pv.Group]:
    world = pv.World(boundary=boundary, integrator=integrator, collisions=None, substeps=1, dtype=np.float64)
    return world, world.add(position=(0, RADIUS + height), radius=RADIUS, mass=MASS)


def one_bounce(integrator: pv.Integrator) -> tuple[float, float, float]:
    """Energy gained over the first bounce (J), and where an open fall would have been in that step: depth (m), speed w (m/s)."""
    world, ball = dropped(pv.ClampAndFlip(FLOOR), integrator)
    free, falling = dropped(pv.Open(), integrator)
    while True:
        before, above = world.energy().total, float(falling.position[0, 1])
        world.step(H)
        free.step(H)
        depth = RADIUS - float(falling.position[0, 1])
        if depth > 0:
            assert float(ball.position[0, 1]) == RADIUS
            return world.energy().total - before, depth, (above - float(falling.position[0, 1])) / H


def test_a_synchronous_velocity_gains_m_g_depth() -> None:
    # Lifted by d with the speed of d below the wall: m g d more than before. Velocity Verlet is exact in free fall.
    gain, depth, _ = one_bounce(pv.VelocityVerlet())
    assert gain == pytest.approx(MASS * G * depth, rel=1e-9)


def test_position_verlet_loses_m_g_times_what_is_left_of_the_step() -> None:
    # u = -w before and w after; at the time of x the speed is w + g h / 2 before and w - g h / 2 after: -m g h w + m g d.
    gain, depth, w = one_bounce(pv.PositionVerlet())
    assert gain == pytest.approx(-MASS * G * (w * H - depth), rel=1e-9)
    assert gain < 0


def test_semi_implicit_euler_loses_the_same_of_its_own_energy() -> None:
    # Its E' = E - (h/2) m g v is constant in free fall; the flip of v = -w to w changes it by -h m g w, the lift by m g d.
    gain, depth, w = one_bounce(pv.SemiImplicitEuler())
    lift = H * MASS * G * w  # E itself differs from E' by (h/2) m g v before the step (v = -(w - g h)) and after (v = w)
    own = gain - H / 2 * MASS * G * (w + (w - G * H))
    assert own == pytest.approx(MASS * G * depth - lift, rel=1e-9)


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


@pytest.mark.parametrize("height", [0.5, 2.0, 9.0])
def test_projection_alone_never_bounces(height: float) -> None:
    world, ball = dropped(pv.ProjectOnly(pv.Box((-5, 0), (5, 20))), pv.PositionVerlet(), height)
    top, landed = 0.0, False
    for _ in range(200):
        world.step(H)
        landed |= float(ball.position[0, 1]) == RADIUS
        if landed:
            top = max(top, float(ball.position[0, 1]) - RADIUS)
    assert landed
    assert top == pytest.approx(0.0, abs=1e-14)  # (x - x_prev) / h of a resting circle is 0 but for its rounding


def test_projection_turns_depth_into_speed() -> None:
    # A circle that starts d inside the floor, at rest: moved by d in one step of h, it leaves with d / h.
    world = pv.World(
        gravity=(0, 0), boundary=pv.ProjectOnly(pv.Box((-5, 0), (5, 20))), collisions=None, substeps=1, dtype=np.float64
    )
    ball = world.add(position=(0, RADIUS - 0.05), radius=RADIUS)
    world.step(H)
    assert ball.velocity[0, 1] == pytest.approx(0.05 / H, rel=1e-12)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(pv.InputError, match=r"room is Open\(\); allowed"):
        pv.ClampAndFlip(pv.Open())  # type: ignore[arg-type]
    with pytest.raises(pv.InputError, match=r"friction of the room is 0.1; allowed is 0"):
        pv.ClampAndFlip(pv.Box((0, 0), (1, 1), friction=0.1))
    with pytest.raises(pv.InputError, match=r"restitution of the room is 0.5; allowed is 0"):
        pv.ProjectOnly(pv.Circle(radius=1, restitution=0.5))
    world = pv.World(boundary=pv.ClampAndFlip(pv.Circle(radius=1)))
    with pytest.raises(pv.InputError, match=r"radius\[0\] is 2 m"):
        world.add(position=(0, 0), radius=2.0)
