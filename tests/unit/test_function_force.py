"""`@pv.force`, called with arrays or particle by particle, and one sentence where the user's code is wrong."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import empty

import pyverlet as pv


@pv.force
def swirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -0.5 * y, 0.5 * x


def test_a_function_is_a_force() -> None:
    # m a = k (-y, x): the complex position z obeys m z'' = i k z, so z = exp(s t) with s^2 = i k / m, released from 1 at speed s.
    s = np.sqrt(0.5j / 2.0)
    world = empty(swirl, integrator=pv.RK4())
    ball = world.add(position=(1, 0), velocity=(s.real, s.imag), mass=2.0)
    world.run(seconds=1, dt=1 / 60)
    z = np.exp(s)
    assert ball.position[0] == pytest.approx([z.real, z.imag], abs=1e-10)
    assert swirl(1.0, 2.0, 0.0, 0.0, 1.0, 0.0) == (-1.0, 0.5)


@pytest.mark.filterwarnings("ignore::pyverlet.CoarseStepsWarning")  # Euler does not follow it in such steps, on purpose
def test_all_arguments_arrive() -> None:
    seen = pv.force(lambda x, y, vx, vy, mass, t: (mass * (x + 10 * y), mass * (vx + 10 * vy + 100 * t)))
    world = empty(seen, integrator=pv.ExplicitEuler(), substeps=1)
    ball = world.add(position=(1, 2), velocity=(3, 4), mass=5.0)
    world.step(0.5)
    assert ball.velocity[0].tolist() == [3 + 0.5 * 21, 4 + 0.5 * 43]
    world.step(0.5)  # from (2.5, 4), with t = 0.5
    assert ball.velocity[0, 1] == 25.5 + 0.5 * (13.5 + 255 + 50)


@pytest.mark.parametrize("arrays", [True, False])
def test_a_potential_enters_the_energy(arrays: bool) -> None:
    def energy(x: float, y: float, mass: float) -> float:
        return 0.5 * mass * (x * x + 4 * y * y)

    @pv.force(potential=energy if arrays else lambda x, y, mass: energy(x, y, mass) if x < 9 else 0.0)
    def well(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
        return -mass * x, -4 * mass * y

    assert not well.velocity_dependent
    world = empty(well)
    world.add(position=[(1, 2), (0, 1), (5, 5)], mass=[3.0, 1.0, np.inf])
    start = world.energy()
    assert start.potential == pytest.approx(0.5 * 3 * (1 + 16) + 0.5 * 4)
    world.run(seconds=3, dt=1 / 60)
    # Verlet's energy swings by (w h)^2 / 4 of it, w = 2.
    assert world.energy().total == pytest.approx(start.total, rel=(2 / 480) ** 2)
    assert world.position[2].tolist() == [5, 5]


def test_options() -> None:
    assert not swirl.velocity_dependent  # it does not name vx or vy
    assert pv.force(lambda x, y, u, v, mass, t: (-u, 0.0)).velocity_dependent
    assert pv.force(velocity_dependent=True)(lambda x, y, vx, vy, mass, t: (x, y)).velocity_dependent
    assert repr(swirl).startswith("force 'swirl' (")
    assert swirl.__name__ == "swirl"  # type: ignore[attr-defined]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_many_particles_give_the_same_bits_on_all_threads(dtype: Any) -> None:
    rng = np.random.default_rng(0)
    position, mass = rng.normal(0, 100, (40_001, 2)), np.where(np.arange(40_001) % 7, 2.0, np.inf)
    worlds = [pv.World(gravity=(0, 0), collisions=None, dtype=dtype, threads=threads) for threads in (1, None)]
    for world in worlds:
        world.forces.append(swirl)
        world.add(position=position, radius=0.01, mass=mass)
        world.step(1 / 60)
    assert worlds[0].state_hash() == worlds[1].state_hash()
    assert worlds[0].velocity[:, 0] == pytest.approx(-0.5 / 60 * position[:, 1] / mass, abs=2e-3)


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
def test_the_largest_acceleration_of_all_is_known(dtype: Any) -> None:
    # Walls and impacts ask for it: an approach slower than a few times |a| h is rest.
    rng = np.random.default_rng(0)
    world = pv.World(gravity=(3.0, -4.0), collisions=None, dtype=dtype)
    position, mass = rng.normal(0, 100, (10_001, 2)), rng.uniform(1, 2, 10_001)
    mass[::5] = np.inf
    world.add(position=position, radius=0.01, mass=mass)
    world.forces.append(swirl)
    world.step(1e-6)
    pull = np.where(np.isinf(mass)[:, None], 0, (3.0, -4.0) + 0.5 * position[:, ::-1] * (-1, 1) / mass[:, None])
    assert world._state.acceleration == pytest.approx(pull, rel=1e-5, abs=1e-4)
    assert world._force_sum.strongest == pytest.approx(np.hypot(*pull.T).max(), rel=1e-5)


def sometimes(x, y, vx, vy, mass, t):  # type: ignore[no-untyped-def]
    if x > 0:
        return x, y
    return None


def raising(x, y, vx, vy, mass, t):  # type: ignore[no-untyped-def]
    if x > 1:
        raise ValueError("too far")
    return x, y


NAME = "raised NameError (name 'nowhere' is not defined) for particle 0"
POLE = "returned (inf, 0.0) for particle 1 at x = 2, y = 0, t = 0; allowed are two finite numbers"
WRONG: dict[str, tuple[Callable[..., Any], type[pv.PyverletError], str]] = {
    "undefined": (lambda x, y, vx, vy, mass, t: (nowhere * x, y), pv.NonFiniteError, NAME),  # type: ignore[name-defined]  # noqa: F821
    "one number": (
        lambda x, y, vx, vy, mass, t: x, pv.InputError,
        "returns no tuple; allowed is numeric code that returns two numbers (fx, fy)",
    ),
    "three numbers": (lambda x, y, vx, vy, mass, t: (x, y, 0.0), pv.InputError, "returns 3 of them"),
    "sometimes": (sometimes, pv.InputError, "returns no tuple"),
    "array": (lambda x, y, vx, vy, mass, t: np.array([x, y]), pv.InputError, "returns no tuple"),
    "imaginary": (lambda x, y, vx, vy, mass, t: (1j * x, y), pv.InputError, "returns "),
    "pole": (lambda x, y, vx, vy, mass, t: (x / (x - 2), y), pv.NonFiniteError, POLE),
    "raising": (raising, pv.NonFiniteError, "raised ValueError (too far) for particle 1"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_function_is_named_with_its_file_and_line(case: str) -> None:
    function, kind, says = WRONG[case]
    world = empty(pv.force(function))
    world.add(position=[(0, 0), (2, 0)])
    with pytest.raises(kind) as caught:
        world.step(1 / 60)
    message = str(caught.value)
    assert f"force {function.__name__!r} ({__file__}, line {function.__code__.co_firstlineno})" in message
    assert says in message
    assert "\n" not in message
    assert world.position.tolist() == [[0, 0], [2, 0]]  # the last good frame
    world.forces.clear()
    world.step(1 / 60)


def late(x, y, vx, vy, mass, t):  # type: ignore[no-untyped-def]
    if t > 0.05 and x > 1:
        raise ValueError("too late")
    return 0.0, math.sqrt(0.06 - t) if x < -1 else 0.0


def test_a_function_that_fails_in_the_midst_of_a_frame_loses_nothing() -> None:
    # The frame is gone through again, one by one, to say where and when.
    world = pv.World(boundary=pv.Circle(radius=5))
    world.forces += [pv.Drag(linear=0.1), pv.force(late)]
    world.add(position=[(-2, 0), (0, 0), (2, 0)], radius=0.5)
    world.run(seconds=3 / 60)
    before = world.state_hash()
    with pytest.raises(
        pv.NonFiniteError, match=r"force 'late' \(.*\) raised ValueError \(too late\) for particle 2 .*t = 0\.052"
    ):
        world.step(1 / 60)
    assert world.state_hash() == before
    world.forces.clear()
    world.step(1 / 60)
    assert np.isfinite(world.position).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_with_arrays_or_one_by_one_the_same_bits(dtype: Any) -> None:
    # Sums and products are rounded alike everywhere; with functions such as sine that need not be so.
    hashes = set()
    for code in (
        lambda x, y, vx, vy, mass, t: (mass * (y - 0.25 * x) - vx, np.where(x > 0.0, x * y, -t)),
        lambda x, y, vx, vy, mass, t: (mass * (y - 0.25 * x) - vx, x * y if x > 0.0 else -t),
    ):
        world = pv.World(gravity=(0, -1), collisions=None, dtype=dtype)
        chance = np.random.default_rng(2)
        world.add(position=chance.normal(0, 1, (9, 2)), mass=[*chance.uniform(1, 2, 8), np.inf], radius=0.01)
        world.forces.append(pv.force(code))
        world.run(seconds=0.1)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


def test_a_function_is_called_once_for_all() -> None:
    shapes = []

    @pv.force
    def seen(x, y, vx, vy, mass, t):  # type: ignore[no-untyped-def]
        shapes.append((x.shape, mass.dtype, type(t)))
        return 0.0, mass

    world = empty(seen, integrator=pv.SemiImplicitEuler(), substeps=1)
    world.add(position=[(0, 0), (3, 0), (6, 0)], mass=[1.0, 2.0, np.inf])
    world.step(0.5)
    assert shapes == [((3,), np.float64, float)]
    assert world.velocity.tolist() == [[0, 0.5], [0, 0.5], [0, 0]]
