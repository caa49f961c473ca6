"""`pyverlet.lab.solve`: x'' = F(t, x, x') against closed forms, in one to five dimensions, with the order of every integrator."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.common.arrays import Floats
from pyverlet.lab import Equation, order, solve
from pyverlet.lab.problems import PROBLEMS

EVERY_INTEGRATOR = pytest.mark.parametrize("cls", pv.integrators.BY_NAME.values(), ids=pv.integrators.BY_NAME)

DAMPING, SQUARE = 0.5, 9.0
START = np.array([[1.0, -0.5], [0.25, 2.0], [0.0, 1.5]])


def damped(t: float) -> tuple[Floats, Floats]:
    """x'' = -w^2 x - c x' from x0, x'(0) = 1: exp(-c t / 2) (A cos q t + B sin q t), q^2 = w^2 - c^2 / 4, B q = 1 + c A / 2."""
    c, q = DAMPING, np.sqrt(SQUARE - DAMPING**2 / 4)
    a, b = START, (1.0 + DAMPING / 2 * START) / q
    fade, cos, sin = np.exp(-c * t / 2), np.cos(q * t), np.sin(q * t)
    x = fade * (a * cos + b * sin)
    return x, -c / 2 * x + fade * q * (b * cos - a * sin)


SPRING = Equation(lambda t, x, v: -SQUARE * x - DAMPING * v, x0=START, v0=1.0, exact=damped)


# theta'' = -9.81 sin theta + cos 2 t: a plain number that depends on the time, judged by many more steps, for it has no solution
# on paper.
SWING = Equation(lambda t, x, v: -9.81 * np.sin(x) + np.cos(2 * t), x0=1.0)


@EVERY_INTEGRATOR
@pytest.mark.parametrize("equation", [SPRING, SWING], ids=["six damped springs", "a driven swing"])
def test_equations_show_the_declared_order(equation: Equation, cls: Any) -> None:
    # All of a (3, 2) array at once, with a force that looks at the velocity.
    assert order.measure(cls(), equation, frames=(40, 80, 160)).order == pytest.approx(cls.order, abs=order.WITHIN)


def test_the_force_is_asked_at_the_time_of_each_slope() -> None:
    # x'' = 6 t has x = t^3: order 4 is exact for cubes, so that what is left is rounding.
    for integrator in (pv.RK4(), pv.Yoshida4()):
        times, x, v = solve(lambda t, x, v: 6 * t, x0=1.0, v0=-3.0, start=-1.0, until=2.0, h=0.25, integrator=integrator)
        assert x == pytest.approx(times**3 + 2.0 - 6.0 * (times + 1.0), abs=1e-12)
        assert v == pytest.approx(3 * times**2 - 6.0, abs=1e-12)


def test_it_does_what_a_world_does() -> None:
    # The same methods: a planet as a particle among the forces of a world, and as an equation.
    problem = PROBLEMS["kepler orbit"]
    x0, v0 = problem.exact(0.0)
    planet = Equation(lambda t, x, v: -x / np.hypot(*x) ** 3, x0=x0, v0=v0)
    steps = order.steps(60, 2.0, jitter=0.3)
    for cls in pv.integrators.BY_NAME.values():
        world, mine = problem.motion(cls(), steps), planet.motion(cls(), steps)
        assert mine.times == pytest.approx(world.times, abs=1e-12)
        assert mine.positions == pytest.approx(world.positions, abs=1e-9)
        assert mine.velocities == pytest.approx(world.velocities, abs=1e-9)


def test_three_bodies_in_space_keep_momentum() -> None:
    # Kinds of shapes: (3 bodies, 3 dimensions). Newton's third law: the sum of m v is what it was, to rounding.
    mass = np.array([3.0, 4.0, 5.0])[:, None]

    def pull(t: float, x: Floats, v: Floats) -> Floats:
        way = x[None] - x[:, None]
        cube = ((way**2).sum(axis=2) + 0.1) ** 1.5
        return np.asarray((mass[None] * way / cube[..., None]).sum(axis=1))

    x0 = np.array([[0.0, 0.0, 1.0], [2.0, 0.5, 0.0], [-1.0, 1.0, -1.0]])
    times, x, v = solve(pull, x0=x0, until=1.0, h=0.01, integrator=pv.VelocityVerlet())
    assert x.shape == v.shape == (101, 3, 3)
    assert np.abs((mass * v).sum(axis=1)).max() < 1e-11
    assert np.abs(x[-1] - x0).max() > 0.1
    assert times == pytest.approx(np.arange(101) / 100)


def test_steps_end_where_they_should() -> None:
    at_rest: dict[str, Any] = {"x0": 0.0}
    assert len(solve(lambda t, x, v: 0.0, **at_rest, until=1.0, h=0.1).times) == 11  # 1 / 0.1 is 10 but for rounding
    assert solve(lambda t, x, v: 0.0, **at_rest, until=1.0, h=0.3).times == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    assert solve(lambda t, x, v: 0.0, **at_rest, h=[0.5, 0.25], start=2.0).times == pytest.approx([2, 2.5, 2.75])


class Midpoint(pv.Integrator):
    order = 2
    symplectic = False

    def step(self, state: Any, forces: Any, t: float, h: float) -> None:
        x, v = state.position.copy(), state.velocity.copy()
        forces(state, t)
        state.position[:] = x + h / 2 * v
        state.velocity[:] = v + h / 2 * state.acceleration
        forces(state, t + h / 2)
        state.position[:] = x + h * state.velocity
        state.velocity[:] = v + h * state.acceleration


def test_steps_of_changing_length_keep_the_order() -> None:
    # x'' = -x, so x = cos t. The error of order 2 is (h^2 / 24) t, which makes 4e-5 at 10 s; PositionVerlet is 0.36 off.
    h = np.random.default_rng(0).choice([0.01, 0.005], 1300)
    found = solve(lambda t, x, v: -x, x0=1.0, h=h)
    assert np.abs(found.positions - np.cos(found.times)).max() < 1e-4


def test_an_integrator_of_ones_own_may_drive_it() -> None:
    assert order.measure(Midpoint(), SPRING, frames=(40, 80, 160)).order == pytest.approx(2.0, abs=order.WITHIN)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"F": 3}, "F is 3; allowed is a function"),
        ({"x0": [1.0, np.nan]}, "x0 is"),
        ({"x0": "here"}, "x0 is 'here'"),
        ({"v0": [1.0, 2.0, 3.0]}, r"v0 has shape \(3,\); allowed is that of x0, \(2,\)"),
        ({"h": 0.0}, "h is 0; allowed is a finite number greater than 0"),
        ({"h": 1e-12}, "h is 1e-12; allowed is at least 1e-09"),
        ({"h": [0.1, -0.1], "until": None}, r"h\[1\] is -0.1"),
        ({"h": [0.1]}, "until is 1.0 beside an array for h"),
        ({"until": None}, "until is None"),
        ({"until": -1.0}, "until is -1; allowed is a finite number greater than 0"),
        ({"integrator": pv.RK4}, "allowed is an object such as"),
        ({"F": lambda t, x, v: 1.0}, r"F returns an array of shape \(\) at time 0; allowed is the shape of x0, \(2,\)"),
        ({"F": lambda t, x, v: "down"}, "F returns 'down' at time 0"),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, Any], says: str) -> None:
    given: dict[str, Any] = {"F": lambda t, x, v: -x, "x0": [1.0, 0.0], "until": 1.0, "h": 0.1} | changes
    refused(says, solve, **given)


def test_who_runs_away_is_told() -> None:
    # x'' = x^3 from x = 1, x' = 1 ends at infinity in a second or so.
    with pytest.raises(pv.NonFiniteError, match="shorter ones may do"), np.errstate(all="ignore"):
        solve(lambda t, x, v: x**3 if abs(x) < 1e100 else x * np.inf, x0=1.0, v0=1.0, until=50.0, h=0.1)
