"""The declared order of every integrator, fitted: error = C h^p, so p is the slope of log(error) against log(h)."""

import copy
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj
from tests.worlds import FRAME, G, each_frame

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
        state = world._sorted
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


MEASURED: dict[str, tuple[pv.Integrator, float, float]] = {
    **{name: (cls(), 0.0, cls.order) for name, cls in pv.integrators.BY_NAME.items()},
    # x_prev = x - v h errs by a h^2 / 2 at once, which travels on as a velocity error a h / 2: global order 1.
    "naive start": (pv.PositionVerlet(naive_start=True), 0.0, 1),
    "time correction under a jittering step": (pv.TimeCorrectedVerlet(), order.JITTER, 2),
}


@EVERY_PROBLEM
@pytest.mark.parametrize("name", MEASURED)
def test_declared_order_is_measured(name: str, problem: Problem) -> None:
    integrator, jitter, expected = MEASURED[name]
    found = order.measure(integrator, problem, jitter=jitter, frames=FEW)
    assert found.order == pytest.approx(expected, abs=order.WITHIN)


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
    # 40 periods of the oscillator at w h = 0.3: the energy error of the second half must not exceed that of the
    # first if the method is symplectic; the others drift, RK4 by -(w h)^6 / 72 relative a step (Hairer et al., I.1).
    cls = pv.integrators.BY_NAME[name]
    w = 3.0
    frames = 2 * round(40 * 2 * np.pi / 0.3 / 2)
    world = pv.World(gravity=(0, 0), integrator=cls(), collisions=None, substeps=1, dtype=np.float64)
    world.add(position=(1, 0))
    world.forces.append(pv.forces.PointSpring(stiffness=w * w))
    start = world.energy().total
    energy = np.empty(frames)
    for k in each_frame(world, frames, 0.3 / w):
        energy[k] = world.energy().total / start - 1
    first, second = np.abs(energy[: frames // 2]).max(), np.abs(energy[frames // 2 :]).max()
    if cls.symplectic:
        assert second == pytest.approx(first, rel=0.05)
    else:
        assert second > 1.5 * first
    if name == "rk4":
        assert energy[-1] == pytest.approx(np.expm1(-frames * 0.3**6 / 72), rel=0.05)


# ---- One particle without bounds, against y = y0 + v0 t + g t^2 / 2 and against what each method conserves exactly ----


Y0, V0 = 3.0, 7.0


def test_substeps_are_n_steps_of_dt_over_n() -> None:
    coarse = pv.World(integrator=pv.SemiImplicitEuler(), collisions=None, substeps=5, dtype=np.float64)
    fine = pv.World(integrator=pv.SemiImplicitEuler(), collisions=None, substeps=1, dtype=np.float64)
    a, b = (world.add(position=(0, Y0), velocity=(1, V0)) for world in (coarse, fine))
    coarse.run(seconds=0.5, dt=0.05)
    fine.run(seconds=0.5, dt=0.01)
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


# ---- A free particle stays on its closed form while gravity, the length of frames or the number of substeps change ----


EXACT = [name for name, cls in pv.integrators.BY_NAME.items() if cls.order >= 2]
CLOCKS: dict[str, Any] = {
    "steady": [0.01] * 300, "other substeps": [0.01] * 300, "fine and coarse": np.tile([1 / 240, FRAME], 60),
    "rough": np.tile([FRAME, 1 / 30, 0.25], 20),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "clock"),
    [(name, clock) for name in EXACT for clock, steps in CLOCKS.items() if len(set(steps)) == 1 or name != "position-verlet"],
)
def test_a_throw_is_a_parabola_whatever_the_clock(name: str, clock: str) -> None:
    world = pv.World(dtype=np.float64, integrator=pv.integrators.BY_NAME[name](), substeps=8)
    ball = world.add(position=(0, Y0), velocity=(10, 20), mass=2.0)
    start = world.energy().total
    for k, each in enumerate(CLOCKS[clock]):
        world.substeps = 4 if k % 7 == 3 and clock != "steady" else 8
        world.step(float(each))
        assert clock != "steady" or world.energy().total == pytest.approx(start, rel=1e-12)
    t = world.time
    # y = v t - g t^2 / 2 is of degree 2: methods of order 2 have no error but rounding.
    assert ball.position[0] == pytest.approx((10 * t, Y0 + 20 * t - G * t**2 / 2), abs=1e-11 if clock == "steady" else 1e-9)
    assert ball.velocity[0] == pytest.approx((10, 20 - G * t), abs=1e-11 if clock == "steady" else 1e-10)


@pytest.mark.parametrize("name", EXACT)
def test_frames_that_a_world_cuts_by_itself_change_no_throw(name: str) -> None:
    # Of 0.1 s, in two parts, and in three and more when the discs are faster than a tenth of their radius in 1/30 s.
    world = pv.World(dtype=np.float64, integrator=pv.integrators.BY_NAME[name]())
    world.add(position=[(0, 0), (0, 50)], velocity=(3, 0), radius=10.0)
    for frame in range(30):
        if frame == 15:
            world = copy.deepcopy(world)
        world.step(0.1)
    assert world.velocity == pytest.approx(np.array([(3, -G * 3.0)] * 2), abs=1e-9)


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (3.0, 9.81), (0.0, -98.1)])
@pytest.mark.parametrize("seconds", [0.0, 0.5])
def test_gravity_changed_before_or_in_flight(name: str, gravity: tuple[float, float], seconds: float) -> None:
    world = pv.World(dtype=np.float64, integrator=pv.integrators.BY_NAME[name]())
    ball = world.add(position=(0, 0), velocity=(3, 5))
    world.run(seconds=seconds)
    start, speed = ball.position[0].copy(), ball.velocity[0].copy()
    world.gravity = gravity
    world.run(seconds=1.0)
    assert ball.position[0] == pytest.approx(start + speed + np.array(gravity) / 2, abs=1e-9)
    assert ball.velocity[0] == pytest.approx(speed + np.array(gravity), abs=1e-9)


# ---- Thousands of Kepler periods: what `symplectic` is worth ----


STEPS = 20
"""A period: coarse on purpose. Samples follow 10 periods and a step, so that they visit all of the orbit."""


def energy_errors(integrator: pv.Integrator, periods: int) -> np.ndarray:
    """(k,) relative energy errors, one every 10 periods and 1/STEPS, of an orbit of eccentricity 0.3."""
    world = PROBLEMS["kepler orbit"].world(integrator)
    world.substeps = 10 * STEPS + 1
    start = world.energy().total
    errors = [abs(world.energy().total / start - 1) for _ in each_frame(world, periods // 10, world.substeps * 2 * np.pi / STEPS)]
    return np.array(errors)


@pytest.mark.parametrize("periods", [1_000, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("integrator", [pv.VelocityVerlet(), pytest.param(pv.Yoshida4(), marks=pytest.mark.slow)], ids=repr)
def test_symplectic_energy_is_bounded_over_thousands_of_periods(integrator: pv.Integrator, periods: int) -> None:
    # A symplectic method conserves a modified energy H + O(h^p) but for exponentially small terms (Hairer, Lubich, Wanner, IX.8):
    # the error swings between the same bounds in the first thousand periods as in the last.
    errors = energy_errors(integrator, periods)
    assert errors[-100:].max() == pytest.approx(errors[:100].max(), rel=0.02)
    assert errors.max() < {2: 0.065, 4: 0.008}[integrator.order]
