"""The declared order of every integrator, fitted: error = C h^p, so p is the slope of log(error) against log(h)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

GRAVITY = -9.81

Closed = Callable[[float], tuple[float, float]]
Steps = np.ndarray[Any, np.dtype[np.float64]]


def oscillator(t: float) -> tuple[float, float]:
    # m = 1 kg, k = w^2 with w = 3 rad/s, x(0) = 1, v(0) = 0.5: x = cos(w t) + (0.5 / w) sin(w t)
    w = 3.0
    return np.cos(w * t) + 0.5 / w * np.sin(w * t), -w * np.sin(w * t) + 0.5 * np.cos(w * t)


def fall_with_drag(t: float) -> tuple[float, float]:
    # v' = g - c v with c = 1.5 /s, v(0) = 4, y(0) = 0: v = v_t + (v0 - v_t) exp(-c t), v_t = g / c
    c, v0 = 1.5, 4.0
    terminal = GRAVITY / c
    return terminal * t + (v0 - terminal) * (1 - np.exp(-c * t)) / c, terminal + (v0 - terminal) * np.exp(-c * t)


def largest_error(integrator: pv.Integrator, problem: Closed, dts: Steps) -> float:
    """Largest distance from the closed form, over position and velocity and over the whole second."""
    world = pv.World(
        gravity=(0, 0 if problem is oscillator else GRAVITY),
        integrator=integrator,
        collisions=None,
        substeps=1,
        dtype=np.float64,
    )
    y0, v0 = problem(0.0)
    ball = world.add(position=(0, y0), velocity=(0, v0))
    world.forces.append(pv.forces.PointSpring(stiffness=9.0) if problem is oscillator else pv.forces.Drag(linear=1.5))
    worst = 0.0
    for dt in dts:
        world.step(dt)
        y, v = problem(world.time)
        worst = max(worst, float(np.hypot(ball.position[0, 1] - y, ball.velocity[0, 1] - v)))
    return worst


def steps(frames: int, jitter: float = 0.0) -> Steps:
    """One second in so many frames, each longer or shorter by up to `jitter` of itself."""
    dts = 1 + jitter * np.random.default_rng(frames).uniform(-1, 1, frames)
    return np.asarray(dts / dts.sum())


def fitted_order(integrator: pv.Integrator, problem: Closed, jitter: float = 0.0) -> float:
    frames = np.array([80, 160, 320, 640])
    errors = [largest_error(integrator, problem, steps(n, jitter)) for n in frames]
    return float(-np.polyfit(np.log(frames), np.log(errors), 1)[0])


@pytest.mark.parametrize("problem", [oscillator, fall_with_drag])
@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_declared_order_is_measured(name: str, problem: Closed) -> None:
    cls = pv.integrators.BY_NAME[name]
    assert fitted_order(cls(), problem) == pytest.approx(cls.order, abs=0.1)


def test_naive_start_of_verlet_drops_the_order_to_one() -> None:
    # x_prev = x - v h errs by a h^2 / 2 at once, which travels on as a velocity error a h / 2: global order 1.
    assert fitted_order(pv.PositionVerlet(naive_start=True), oscillator) == pytest.approx(1.0, abs=0.1)
    assert fitted_order(pv.PositionVerlet(), oscillator) == pytest.approx(2.0, abs=0.1)


def test_time_correction_keeps_order_two_under_a_jittering_step() -> None:
    assert fitted_order(pv.TimeCorrectedVerlet(), oscillator, jitter=0.3) == pytest.approx(2.0, abs=0.1)
    assert fitted_order(pv.TimeCorrectedVerlet(), fall_with_drag, jitter=0.3) == pytest.approx(2.0, abs=0.1)


def test_plain_verlet_breaks_under_a_jittering_step() -> None:
    # x - x_prev of a long step is walked again in a short one: the error hardly shrinks with the step, its order is below 1/2.
    assert fitted_order(pv.PositionVerlet(), oscillator, jitter=0.3) < 0.5
    assert largest_error(pv.PositionVerlet(), oscillator, steps(640, 0.3)) > 0.01


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_symplectic_means_no_energy_drift(name: str) -> None:
    # 200 periods of the oscillator at w h = 0.3: the energy error of the second half must not exceed that of the
    # first if the method is symplectic; the others drift, RK4 by -(w h)^6 / 72 relative a step (Hairer et al., I.1).
    cls = pv.integrators.BY_NAME[name]
    w = 3.0
    frames = 2 * round(200 * 2 * np.pi / 0.3 / 2)
    world = pv.World(gravity=(0, 0), integrator=cls(), collisions=None, substeps=1, dtype=np.float64)
    world.add(position=(1, 0))
    world.forces.append(pv.forces.PointSpring(stiffness=w * w))
    start = world.energy().total
    energy = np.empty(frames)
    for k in range(frames):
        world.step(0.3 / w)
        energy[k] = world.energy().total / start - 1
    first, second = np.abs(energy[: frames // 2]).max(), np.abs(energy[frames // 2 :]).max()
    if cls.symplectic:
        assert second == pytest.approx(first, rel=0.05)
    else:
        assert second > 1.5 * first
    if name == "rk4":
        assert energy[-1] == pytest.approx(np.expm1(-frames * 0.3**6 / 72), rel=0.05)
