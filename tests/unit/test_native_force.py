"""Functions with `@pv.force` that Numba compiles come to what NumPy makes of them, and are left to it where they might not."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.forces.native import installed

pytestmark = [
    pytest.mark.numba,
    pytest.mark.skipif(not installed(), reason="Numba is not installed"),
]

strength = 0.5
TABLE = [0.5, 1.0]


def swirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -strength * mass * y, strength * x


def branches(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    if x > 0.2:
        return -math.sqrt(abs(y)), 0
    return 2, math.sin(t)


def raises(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    if x > 1e6:
        raise ValueError(x)
    return x, y


def of_a_slider(factor: list[float]) -> Callable[..., Any]:
    return lambda x, y, vx, vy, mass, t: (factor[0] * x, y)


COMPILED: dict[str, Callable[..., Any]] = {
    "of a global": swirl, "branches": branches, "magnetic": lambda x, y, vx, vy, mass, t: (-3.0 * vy, 3.0 * vx),
    "two sides": lambda x, y, vx, vy, mass, t: (np.where(x > 0.2, -mass, 2.0 * mass), np.hypot(x, y)),
}  # fmt: skip
LEFT_TO_NUMPY: dict[str, Callable[..., Any]] = {
    "about the mean": lambda x, y, vx, vy, mass, t: (np.mean(x) - x, 0.0 * y),
    "mean and where": lambda x, y, vx, vy, mass, t: (np.where(y > 0, x.mean() - x, 0.0), 0.0 * y),
    "from a list": lambda x, y, vx, vy, mass, t: (TABLE[0] * x, y),
    "raises": raises, "of a slider": of_a_slider([2.0]),
}  # fmt: skip


def gone_through(function: Any, frames: int = 30, **options: Any) -> tuple[np.ndarray[Any, Any], Any]:
    """Where 700 particles, one of them pinned, are after some frames, and the force."""
    rng, force = np.random.default_rng(4), pv.force(function)
    world = pv.World(gravity=(0, -1), collisions=None, **options)
    world.add(
        position=rng.uniform(-2, 2, (700, 2)), velocity=rng.uniform(-1, 1, (700, 2)), mass=np.r_[rng.uniform(1, 3, 699), np.inf]
    )
    world.forces.append(force)
    world.run(seconds=frames / 60, dt=1 / 60)
    return world.position.copy(), force


def is_compiled(force: Any) -> bool:
    native = force._code._native
    return native is not None and native.address != 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("function", COMPILED.values(), ids=COMPILED)
def test_compiled_functions_come_to_the_same(function: Any, dtype: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    position, force = gone_through(function, dtype=dtype)
    assert is_compiled(force)
    monkeypatch.setattr("pyverlet.laws.forces.native.installed", lambda: False)
    expected, called = gone_through(function, dtype=dtype)
    assert not is_compiled(called)
    # Only the last bits of roots and sines may differ: 30 frames of 8 substeps, rounded at 10 m.
    assert position == pytest.approx(expected, abs=2400 * float(np.finfo(dtype).eps))


@pytest.mark.parametrize("function", LEFT_TO_NUMPY.values(), ids=LEFT_TO_NUMPY)
def test_what_may_come_to_something_else_is_left_to_numpy(function: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    position, force = gone_through(function)
    assert not is_compiled(force)
    monkeypatch.setattr("pyverlet.laws.forces.native.installed", lambda: False)
    assert (position == gone_through(function)[0]).all()


def test_a_number_that_changes_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    # m a = F = k m y against gravity: with one substep the change of the velocity in a frame is a dt.
    world = pv.World(gravity=(0, 0), collisions=None, substeps=1, integrator=pv.SemiImplicitEuler(), dtype=np.float64)
    world.add(position=[(0, 1), (0, 1)], mass=2.0)
    world.forces.append(force := pv.force(swirl))
    world.step(0.01)
    world.step(0.01)
    assert is_compiled(force)
    monkeypatch.setitem(globals(), "strength", 7.0)
    before = world.velocity[0, 0]
    world.step(0.01)
    assert world.velocity[0, 0] - before == pytest.approx(-7.0 * 0.01, rel=1e-3)
    assert not is_compiled(force)


@pytest.mark.parametrize("function", [swirl, COMPILED["two sides"]])
def test_any_number_of_threads_has_the_same_bits(function: Any) -> None:
    assert (gone_through(function, threads=1)[0] == gone_through(function, threads=2)[0]).all()


def test_what_is_not_finite_is_told_as_by_numpy() -> None:
    @pv.force
    def beyond(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
        return math.sqrt(0.5 - t), 0.0

    world = pv.World(gravity=(0, 0), collisions=None)
    world.add(position=[(0, 1), (2, 1)])
    world.forces.append(beyond)
    with pytest.raises(pv.NonFiniteError, match=r"force 'beyond' .* raised ValueError .* for particle 0 at x = .*, t = 0\.5"):
        world.run(seconds=1, dt=1 / 60)
    assert is_compiled(beyond)
    assert world.time == pytest.approx(0.5)
