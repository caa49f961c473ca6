"""What sleeps or is pinned costs next to nothing, and frames that leave it out have the bits of those that do not."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.ground.constants import KNOWN_FROM

DT = 1 / 60


def pegs(*, friction: float = 0.0, threads: int = 1, dtype: Any = np.float32) -> pv.World:
    """A grid of pinned discs, more than are copied in every frame, and some that fall among the first of them."""
    side = int(np.sqrt(KNOWN_FROM)) + 3
    y, x = np.mgrid[:side, :side]
    world = pv.World(
        boundary=pv.Box((-1, -1), (side, side)), collisions=pv.Collisions(friction=friction), threads=threads, dtype=dtype
    )
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.2, mass=np.inf)
    k = np.arange(20)
    world.add(position=np.column_stack((0.5 + k % 10, 3.5 + k // 10)), radius=0.2, velocity=(0.3, 0.0))
    return world


def meddle(world: pv.World, frame: int) -> None:
    """What users do to pinned discs now and then."""
    if frame % 5 == 3:
        world.position[10 * frame] += 0.05
    if frame == 8:
        world.velocity[200] = (0.2, -0.1)  # it moves from now on
    if frame == 9:
        world.spin[300] = 2.0
    if frame == 14:
        world.mass[400], world.radius[401] = 1.0, 0.25


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_frames_that_leave_out_what_is_still_have_the_same_bits(friction: float, dtype: Any) -> None:
    one, two, other = (
        pegs(friction=friction, dtype=dtype),
        pegs(friction=friction, threads=2, dtype=dtype),
        pegs(friction=friction, dtype=dtype),
    )
    for frame in range(25):
        for world in (one, two, other):
            meddle(world, frame)
            world.step(DT)
        other.restore(other.save())  # which knows of nothing that it is still
        assert one.state_hash() == two.state_hash() == other.state_hash()
    assert one.position[200] != pytest.approx(two.position[201], abs=0.01)
    still = one._frames.held.still()
    assert 0 < np.count_nonzero(still) < len(still)


def bed(sleepers: int) -> pv.World:
    """So many discs asleep on a floor, and a hundred that bounce beyond a wall without meeting each other."""
    room = pv.Box((-50, 0), (sleepers + 1, 50), restitution=1.0)
    world = pv.World(boundary=room, sleep=True, threads=1, dtype=np.float64)
    world.obstacles.append(pv.Segment((0, 0), (0, 50)))
    if sleepers:
        world.add(position=np.column_stack((0.5 + np.arange(sleepers), np.full(sleepers, 0.4))), radius=0.4)
        while not world.asleep.all():
            world.step(DT)
    world.add(position=np.column_stack((-0.4 * np.arange(2, 102), np.full(100, 1.0))), radius=0.1, restitution=1.0)
    for _ in range(10):
        world.step(DT)
    return world


def test_sleepers_cost_little_beside_those_that_are_awake() -> None:
    # 20,000 asleep take 1.2 times as long as the hundred alone, and all awake 50 times: a ratio of processor times, in turn.
    worlds = bed(0), bed(20_000)
    spent = np.empty((60, 2))
    for row in spent:
        for k, world in enumerate(worlds):
            start = process_time()
            world.step(DT)
            row[k] = process_time() - start
    assert worlds[1].asleep.sum() == 20_000
    alone, among = np.quantile(spent, 0.25, axis=0)
    assert among < 3 * alone


def test_a_sleeper_that_is_written_to_wakes_and_an_awake_one_wakes_those_it_meets() -> None:
    world = bed(5_000)
    world.position[700, 1] += 0.1  # an island each
    world.step(DT)
    assert world.asleep.sum() == 4_999
    assert world.velocity[700, 1] == pytest.approx(-9.81 * DT, rel=0.1)  # v = -g t, give or take a substep of eight
    world.add(position=(900.5, 1.4), radius=0.4, velocity=(0.0, -5.0))
    for _ in range(5):
        world.step(DT)
    assert not world.asleep[900]


WRITTEN: dict[str, Callable[[pv.World], Any]] = {  # views that are taken long before they are written to
    "column": lambda world: world.position[:, 1],
    "part": lambda world: world.position[600:][:, 1:].reshape(-1)[100:],
    "buffer": lambda world: np.asarray(world.position.data[:])[:, 1],
    "turned": lambda world: world.position.T[1].view(),
}


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_view_that_is_kept_may_be_written_to_at_any_time(kind: str) -> None:
    world = bed(5_000)
    view = WRITTEN[kind](world)
    at = 0 if kind == "part" else 700
    for _ in range(5):
        world.step(DT)
    assert not world._state.touched(["velocity"])
    view[at] += 0.1
    world.step(DT)
    assert (world.asleep.sum(), world.asleep[700]) == (4_999, False)
    del view
    world.step(DT)
    assert not world._state.touched(["position"])


def test_arrays_that_become_longer_are_looked_at_as_those_before() -> None:
    world = bed(5_000)
    short = world.position
    world.remove([5_050])
    world.add(position=(-45.0, 1.0), radius=0.1)  # in the same memory
    for _ in range(3):
        world.step(DT)
    short[700, 1] += 0.1
    world.step(DT)
    assert not world.asleep[700]
    world.add(position=np.column_stack((np.full(9_000, -20.0), 2.0 + np.arange(9_000) / 300)), radius=0.001)  # in other memory
    short[800, 1] += 0.1
    world.step(DT)
    assert world.asleep[800]
