"""One particle without bounds, against y = y0 + v0 t + g t^2 / 2 and against what each method conserves exactly."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

G = 9.81
Y0, V0 = 3.0, 7.0


def falling(integrator: pv.Integrator, frames: int, h: float) -> tuple[float, float, list[float]]:
    world = pv.World(integrator=integrator, collisions=None, substeps=1, dtype=np.float64)
    ball = world.add(position=(0, Y0), velocity=(0, V0), mass=2.0)
    energy = [world.energy().total]
    for _ in range(frames):
        world.step(h)
        energy.append(world.energy().total)
    return float(ball.position[0, 1]), float(ball.velocity[0, 1]), energy


@pytest.mark.parametrize("name", [n for n, c in pv.integrators.BY_NAME.items() if c.order >= 2])
def test_second_order_methods_are_exact(name: str) -> None:
    # The solution is a polynomial of degree 2: methods of order 2 and more have no truncation error here.
    frames, h = 300, 0.01
    y, v, energy = falling(pv.integrators.BY_NAME[name](), frames, h)
    t = frames * h
    assert y == pytest.approx(Y0 + V0 * t - G * t * t / 2, abs=1e-11)
    assert v == pytest.approx(V0 - G * t, abs=1e-11)
    assert energy == pytest.approx([energy[0]] * len(energy), rel=1e-12)


def test_explicit_euler_gains_half_m_g2_h2_a_step() -> None:
    # E' - E = m/2 ((v - g h)^2 - v^2) + m g v h = m g^2 h^2 / 2, whatever v is.
    h = 0.01
    gain = np.diff(falling(pv.ExplicitEuler(), 200, h)[2])
    assert gain == pytest.approx(np.full(200, 2.0 * G**2 * h**2 / 2), rel=1e-9)


def test_semi_implicit_euler_conserves_its_own_energy() -> None:
    # v^2/2 + g y - (h/2) g v is constant to rounding (J1); its own energy is only off by the last term.
    h = 0.01
    world = pv.World(integrator=pv.SemiImplicitEuler(), collisions=None, substeps=1, dtype=np.float64)
    ball = world.add(position=(0, Y0), velocity=(0, V0))

    def modified() -> float:
        y, v = float(ball.position[0, 1]), float(ball.velocity[0, 1])
        return v * v / 2 + G * y - h / 2 * G * v

    start = modified()
    for _ in range(500):
        world.step(h)
        assert modified() == pytest.approx(start, rel=1e-12)


def test_substeps_are_n_steps_of_dt_over_n() -> None:
    coarse = pv.World(integrator=pv.SemiImplicitEuler(), collisions=None, substeps=5, dtype=np.float64)
    fine = pv.World(integrator=pv.SemiImplicitEuler(), collisions=None, substeps=1, dtype=np.float64)
    a, b = (world.add(position=(0, Y0), velocity=(1, V0)) for world in (coarse, fine))
    for _ in range(10):
        coarse.step(0.05)
    for _ in range(50):
        fine.step(0.01)
    assert a.position == pytest.approx(b.position, rel=1e-14)


@pytest.mark.parametrize("name", sorted(pv.integrators.BY_NAME))
def test_a_circle_pinned_in_its_fall_stays_to_the_last_bit(name: str) -> None:
    """Held from now on: no memory of the fall may move it, in whatever form a method keeps that memory."""
    world = pv.World(integrator=pv.integrators.BY_NAME[name]())
    world.add(position=[(0.0, 0.0), (3.0, 0.0)], radius=0.5)
    world.run(seconds=0.5)
    world.mass[0], world.velocity[0] = np.inf, 0.0
    held = world.position[0].tolist()
    world.run(seconds=1.0)
    assert world.position[0].tolist() == held
    assert world.position[1, 1] < -10.0
