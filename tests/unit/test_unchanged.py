"""Arrays are known again by a digest: whatever differs tells."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.ground.constants import KNOWN_FROM
from pyverlet.state.unchanged import Unchanged


def rows(dtype: type = np.float32, count: int = KNOWN_FROM + 7) -> Any:
    return np.random.default_rng(0).normal(size=(count, 2)).astype(dtype)


def flip(array: Any, *rows: int) -> None:
    array[list(rows), 1] *= -1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "change",
    [
        lambda a: a.__setitem__((0, 0), np.nextafter(a[0, 0], a.dtype.type(9))),
        lambda a: a.__setitem__((-1, 1), np.nextafter(a[-1, 1], a.dtype.type(9))),
        lambda a: a.__setitem__((5, 0), np.nan),
        lambda a: flip(a, 100),
        lambda a: flip(a, 100, 164),  # the same bit of two words that go into the same sum
        lambda a: flip(a, *range(len(a))),
        lambda a: a.__setitem__(slice(2), a[1::-1].copy()),
        lambda a: a.__imul__(2),
    ],
)
def test_whatever_differs_tells(change: Callable[[Any], object], dtype: type) -> None:
    array, known = rows(dtype), Unchanged()
    for _ in range(2):
        known.remember([array, array[:, 0].copy()])
        assert known.recall([array, array[:, 0].copy()])
        assert not known.recall([array, array[:, 0].copy()])  # once only
    known.remember([array])
    change(array)
    assert not known.recall([array])


def test_columns_of_an_odd_number_and_small_arrays() -> None:
    known, column = Unchanged(), rows()[:, 0].copy()
    assert len(column) % 2
    known.remember([column])
    column[-1] += 1
    assert not known.recall([column])
    known.remember([column[:10]])
    assert not known.recall([column[:10]])  # not worth it


@pytest.mark.parametrize("name", ["position", "velocity", "spin"])
def test_a_large_world_heeds_what_the_user_changes(name: str) -> None:
    side = 182  # more than KNOWN_FROM
    world = pv.World(gravity=(0, 0), collisions=None)
    y, x = np.mgrid[:side, :side]
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.4)
    assert len(world) > KNOWN_FROM
    for _ in range(3):
        world.step(0.1)
    assert not (getattr(world, name)[777] == 3.0).any()
    getattr(world, name)[777] = 3.0
    world.step(0.1)
    # Free flight: what was set moves the circle, or stays.
    expected = {"position": (3.0, 3.0), "velocity": (777 % side + 0.3, 777 // side + 0.3), "spin": (777 % side, 777 // side)}
    assert world.position[777] == pytest.approx(expected[name], abs=1e-4)  # float32, at 50 m
    assert name != "spin" or world.spin[777] == 3.0


def test_a_frame_that_failed_is_not_taken_for_the_truth() -> None:
    # The engine's arrays then hold what it failed with, the user's the last good frame.
    side = 182
    world = pv.World(gravity=(0, 0), collisions=None, boundary=pv.Box((-1, -1), (side, side)))
    y, x = np.mgrid[:side, :side]
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.4)
    world.step(0.1)
    before = world.position.copy()
    room, world.boundary = world.boundary, _Broken()
    with pytest.raises(pv.NonFiniteError):
        world.step(0.1)
    world.boundary = room
    world.step(0.1)
    assert np.array_equal(world.position, before)


class _Broken(pv.Open):
    def confine(self, state: Any, h: float, lag: float, rest_speed: float) -> None:
        state.position[:] = np.nan
