"""The declared order of every integrator, fitted: error = C h^p, so p is the slope of log(error) against log(h)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj

import pyverlet as pv
from pyverlet.lab import order
from pyverlet.lab.problems import ECCENTRICITY, PROBLEMS, Problem, jacobi, orbit

FEW = (80, 160, 320)
EVERY_PROBLEM = pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)


@EVERY_PROBLEM
def test_the_solutions_on_paper_solve_the_equations(problem: Problem) -> None:
    # Against a library's adaptive integration of the very force the world applies.
    world = problem.world(pv.VelocityVerlet())

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        world.position[0], world.velocity[0] = y[:2], y[2:]
        state = world._slots
        world._gather()
        world._force_sum(state, t)
        return np.concatenate((y[2:], state.acceleration[0]))

    start = np.concatenate(problem.exact(0.0))
    solution = solve_ivp(slope, (0, 3.0), start, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=[0.4, 1.0, 3.0])
    for t, y in zip(solution.t, solution.y.T, strict=True):
        assert np.concatenate(problem.exact(t)) == pytest.approx(y, abs=1e-9)


@pytest.mark.parametrize("k", [0.1, 0.5, 0.84, 0.999])
def test_jacobi_functions(k: float) -> None:
    for u in (0.0, 0.3, 1.0, 2.7, 11.0):
        assert jacobi(u, k) == pytest.approx(ellipj(u, k * k)[:3], abs=1e-12)


def test_the_orbit_is_an_ellipse() -> None:
    # x^2 + y^2 = (1 - e x - e^2)^2 about the focus: r = a (1 - e^2) / (1 + e cos phi).
    for t in np.linspace(0, 2 * np.pi, 13):
        (x, y), _ = orbit(t)
        assert np.hypot(x, y) == pytest.approx(1 - ECCENTRICITY**2 - ECCENTRICITY * x, rel=1e-12)
    assert np.concatenate(orbit(2 * np.pi)) == pytest.approx(np.concatenate(orbit(0.0)), abs=1e-12)


@EVERY_PROBLEM
@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_declared_order_is_measured(name: str, problem: Problem) -> None:
    cls = pv.integrators.BY_NAME[name]
    assert order.measure(cls(), problem, frames=FEW).order == pytest.approx(cls.order, abs=order.WITHIN)


class Derived(pv.PositionVerlet):
    pass


class Counted(pv.PositionVerlet):
    steps = 0

    def step(self, state: Any, forces: Any, t: float, h: float) -> None:
        super().step(state, forces, t, h)
        self.steps += 1


@pytest.mark.parametrize("problem", [PROBLEMS["oscillator"], PROBLEMS["fall with drag"]], ids=["oscillator", "fall with drag"])
def test_what_is_derived_from_a_method_has_its_order(problem: Problem) -> None:
    expected, counted = order.measure(pv.PositionVerlet(), problem, frames=FEW), Counted()
    assert order.measure(Derived(), problem, frames=FEW).error.tolist() == expected.error.tolist()
    assert order.measure(counted, problem, frames=FEW).order == pytest.approx(2, abs=order.WITHIN)
    assert counted.steps > 0


@EVERY_PROBLEM
def test_naive_start_of_verlet_drops_the_order_to_one(problem: Problem) -> None:
    # x_prev = x - v h errs by a h^2 / 2 at once, which travels on as a velocity error a h / 2: global order 1.
    assert order.measure(pv.PositionVerlet(naive_start=True), problem, frames=FEW).order == pytest.approx(1.0, abs=order.WITHIN)


@EVERY_PROBLEM
def test_time_correction_keeps_order_two_under_a_jittering_step(problem: Problem) -> None:
    found = order.measure(pv.TimeCorrectedVerlet(), problem, jitter=order.JITTER, frames=FEW)
    assert found.order == pytest.approx(2.0, abs=order.WITHIN)


@EVERY_PROBLEM
def test_plain_verlet_breaks_under_a_jittering_step(problem: Problem) -> None:
    # x - x_prev of a long step is walked again in a short one: the error hardly shrinks with the step, its order is below 1/2.
    found = order.measure(pv.PositionVerlet(), problem, jitter=order.JITTER)
    assert found.order is not None
    assert found.order < 0.5
    assert found.error[-1] > 0.01


def test_a_wrong_order_is_told() -> None:
    class Boaster(pv.SemiImplicitEuler):
        order = 2

    (found,) = order.table(order.methods([Boaster()]), [PROBLEMS["oscillator"]])
    assert not found.as_expected
    assert found.as_dict()["problems"]["oscillator"]["order"] == pytest.approx(1.0, abs=order.WITHIN)


def test_errors_at_rounding_are_no_order() -> None:
    # Ballistic flight is exact for order 2 and more: nothing to fit.
    def parabola(t: float) -> tuple[np.ndarray, np.ndarray]:
        return np.array([0, t - 9.81 / 2 * t * t]), np.array([0, 1 - 9.81 * t])

    ballistic = Problem("ballistic", "v' = g", pv.forces.Drag, parabola, gravity=(0.0, -9.81))
    assert order.measure(pv.RK4(), ballistic, frames=(4, 8)).order is None


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_symplectic_means_no_energy_drift(name: str) -> None:
    # 60 periods of the oscillator at w h = 0.3: the energy error of the second half must not exceed that of the
    # first if the method is symplectic; the others drift, RK4 by -(w h)^6 / 72 relative a step (Hairer et al., I.1).
    cls = pv.integrators.BY_NAME[name]
    w = 3.0
    frames = 2 * round(60 * 2 * np.pi / 0.3 / 2)
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
