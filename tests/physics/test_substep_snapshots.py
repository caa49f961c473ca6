"""A look between two substeps: true states at true times, and the same bits whether anybody looks or not."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.worlds import FRAME

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME
from pyverlet.world import core_arrays
from pyverlet.world.substep_snapshot import SubstepSnapshot


def in_users_order(rows: NDArray[Any], whose: NDArray[Any]) -> NDArray[Any]:
    result = np.empty_like(rows)
    result[whose] = rows
    return result


class Looks:
    """An observer that keeps what it sees: time, positions and velocities in the user's order."""

    def __init__(self) -> None:
        self.seen: list[tuple[float, NDArray[Any], NDArray[Any]]] = []

    def __call__(self, snapshot: SubstepSnapshot) -> None:
        position, velocity, whose = snapshot.look()
        assert len(snapshot) == len(whose)
        rows, same = snapshot.positions()
        assert (rows == position).all()
        assert same is whose
        assert not np.shares_memory(rows, position)
        self.seen.append((snapshot.time, in_users_order(position, whose), in_users_order(velocity, whose)))


@pytest.mark.parametrize("name", [name for name, kind in BY_NAME.items() if kind.order >= 2])
def test_circles_in_free_fall_are_where_the_closed_form_says(name: str) -> None:
    """x(t) = x0 + v0 t + g t^2 / 2 and v(t) = v0 + g t, which methods of order 2 and more meet exactly."""
    rng = np.random.default_rng(1)
    x0, v0 = rng.uniform(-50, 50, (300, 2)), rng.uniform(-5, 5, (300, 2))
    world = pv.World(integrator=BY_NAME[name](), collisions=None, dtype=np.float64)
    world.add(position=x0, radius=0.1).velocity[:] = v0
    world.observer = looks = Looks()
    world.run(seconds=3 * FRAME, dt=FRAME)
    assert [round(t / (FRAME / 8), 6) for t, _, _ in looks.seen] == [k for k in range(24) if k % 8]
    g = np.array(world.gravity)
    for t, position, velocity in looks.seen:
        # What was seen is float32: 2^-24 of coordinates up to 64.
        np.testing.assert_allclose(position, x0 + v0 * t + 0.5 * g * t * t, atol=64 * 2**-24)
        np.testing.assert_allclose(velocity, v0 + g * t, atol=8 * 2**-24)


def falling_heap(**options: Any) -> pv.World:
    rng = np.random.default_rng(2)
    world = pv.World(boundary=pv.Circle(radius=12), **options)
    world.add(position=rng.uniform(-7, 7, (400, 2)), radius=rng.uniform(0.1, 0.3, 400))
    return world


def test_a_look_is_what_a_shorter_frame_would_end_with() -> None:
    """After k of n substeps everybody is where a frame of k substeps of the same length leaves them, with contacts and walls."""
    world = falling_heap()
    world.run(seconds=0.5, dt=FRAME)
    saved = world.save()
    world.observer = looks = Looks()
    world.step(FRAME)
    world.observer = None
    for done, (time, position, _) in enumerate(looks.seen, start=1):
        world.restore(saved)
        world._substeps = done  # not as a user does it, which restarts the integrator
        world.step(FRAME * done / 8)
        world._substeps = 8
        assert world.time == pytest.approx(time)
        np.testing.assert_allclose(position, world.position, atol=1e-6)


def test_what_was_seen_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody writes later into what a look returned, though circles are sorted anew."""
    monkeypatch.setattr(core_arrays, "SORTED_FROM", 2)
    world = falling_heap()
    kept: list[tuple[tuple[NDArray[Any], ...], list[NDArray[Any]]]] = []

    def keep(snapshot: SubstepSnapshot) -> None:
        kept.append((snapshot.look(), [array.copy() for array in snapshot.look()]))

    world.observer = keep
    world.velocity[:] = np.random.default_rng(3).normal(0, 20, (len(world), 2))
    world.run(seconds=30 / 60)
    assert any((seen[2] != kept[0][0][2]).any() for seen, _ in kept)
    for seen, then in kept:
        assert all((a == b).all() for a, b in zip(seen, then, strict=True))
