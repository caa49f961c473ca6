"""Removing particles: groups keep theirs, the dead say so, the others go on; save and restore bring them back."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.worlds import grid, refused

import pyverlet as pv


def grid_world(count: int = 30, **options: Any) -> tuple[pv.World, list[pv.Group]]:
    world = pv.World(**{"boundary": pv.Box((0, 0), (40, 40)), "dtype": np.float64, **options})
    groups = [world.add(position=np.column_stack((1.0 + np.arange(count), np.full(count, 1.0 + 3 * k)))) for k in range(3)]
    return world, groups


def test_groups_keep_the_particles_that_are_left() -> None:
    world, (a, b, c) = grid_world()
    b.remove([0, 5, 29])
    a.remove(3)
    assert b.position[:, 0].tolist() == [1 + k for k in range(30) if k not in (0, 5, 29)]
    assert c.index.tolist() == list(range(56, 86))
    assert np.shares_memory(c.position, world.position)
    world.remove(world.position[:, 0] > 15)
    assert (len(a), len(b), len(c)) == (14, 13, 15)
    assert repr(c) == "Group of 15 particles, 27 to 41"
    b.remove()
    world.add(position=(20, 20))
    assert world.group_number.tolist() == [0] * 14 + [2] * 15 + [3]  # they keep it, and nobody gets it again


def test_a_dead_group_says_so() -> None:
    world, (a, b, _) = grid_world()
    a.remove()
    world.remove(b)
    assert (len(a), len(b), len(world)) == (0, 0, 30)
    assert repr(a) == "Group of 30 particles, all removed"
    for act in (lambda: a.position, lambda: b.index, lambda: a.remove(), lambda: world.remove(a), lambda: setattr(b, "mass", 2)):
        refused("group is one of 30 particles that were all removed", act)
    assert len(world.add(position=np.zeros((0, 2))).position) == 0  # one that never had any is another matter


@settings(max_examples=40, deadline=None)
@given(st.lists(st.one_of(st.integers(0, 6), st.lists(st.integers(0, 30), min_size=1, max_size=9)), min_size=1, max_size=12))
def test_any_order_of_adding_and_removing(acts: list[Any]) -> None:
    # The model: numbers of those that are there, and which group brought each. The radius is the number and one; every other
    # group has arrays of its own, with its number.
    world, groups, there, brought = pv.World(), list[pv.Group](), list[int](), list[int]()
    world.data["age"], world.data["pair"] = -1.0, np.zeros((0, 2), np.int32)
    for act in acts:
        if isinstance(act, int):
            k, new = len(groups), np.arange(len(brought), len(brought) + act)
            own: dict[str, Any] | None = {"age": k, "pair": [k, -k]} if k % 2 else None
            groups.append(world.add(position=np.zeros((act, 2)), radius=1.0 + new, data=own))
            there, brought = there + new.tolist(), brought + [k] * act
            assert len(groups[k].data["age"]) == act
        else:
            gone = sorted({k for k in act if k < len(there)})
            world.remove(np.array(gone, int))
            there = [number for k, number in enumerate(there) if k not in gone]
        assert world.number.tolist() == there
        assert world.radius.tolist() == [1.0 + number for number in there]
        assert world.group_number.tolist() == (group_of := [brought[number] for number in there])
        for k, group in enumerate(groups):
            names = [number for number in there if brought[number] == k]
            assert len(group) == len(names)
            assert not names or group.radius.tolist() == [1.0 + number for number in names]
    every = np.arange(-2, len(brought) + 3)
    assert world.index_of(every).tolist() == [there.index(n) if n in there else -1 for n in every.tolist()]
    assert world.group_of(every).tolist() == [brought[n] if 0 <= n < len(brought) else -1 for n in every]
    assert world.data["age"].tolist() == [k if k % 2 else -1.0 for k in group_of]
    assert world.data["pair"].tolist() == [[k, -k] if k % 2 else [0, 0] for k in group_of]
    assert world.data["age"].dtype == np.float64
    assert world.data["pair"].dtype == np.int32


def test_those_who_stay_move_on_as_if_nothing_had_happened() -> None:
    # Without contacts nobody feels the others: the paths are the same, to the bit.
    def run(remove: bool, integrator: pv.Integrator) -> Any:
        world = pv.World(collisions=None, dtype=np.float64, integrator=integrator)
        world.forces.append(pv.Drag(linear=0.1))
        rng = np.random.default_rng(0)
        balls = world.add(position=rng.uniform(0, 9, (20, 2)), velocity=rng.normal(0, 3, (20, 2)))
        world.run(seconds=0.5)
        if remove:
            balls.remove(np.arange(20) % 3 == 1)
        world.run(seconds=0.5)
        return world.position if remove else world.position[np.arange(20) % 3 != 1]

    for integrator in (pv.PositionVerlet(), pv.VelocityVerlet(), pv.RK4()):
        assert run(True, integrator).tolist() == run(False, integrator).tolist()


def test_as_many_added_as_removed_is_noticed() -> None:
    world, (a, _, _) = grid_world()
    world.run(seconds=0.2)
    a.remove([0])
    ball = world.add(position=(35, 30), radius=1.0, mass=2.0)
    world.step(1 / 60)
    assert ball.position[0] == pytest.approx([35, 30 - 9.81 / 2 / 3600])


def test_a_grip_follows_its_particle_or_lets_go() -> None:
    world, (a, b, _) = grid_world(gravity=(0, 0), collisions=None)
    grip = pv.forces.Grip(int(b.index[4]), target=(5, 20))
    world.forces.append(grip)
    a.remove([1, 2])
    assert grip.particle == b.index[4]
    world.run(seconds=2)
    assert b.position[4] == pytest.approx([5, 20], abs=1e-3)
    b.remove(4)
    assert grip.particle == -1
    world.run(seconds=0.1)


def test_save_and_restore_across_adding_and_removing() -> None:
    world, (a, b, c) = grid_world()
    grip = pv.forces.Grip(int(c.index[2]), target=(5, 20))
    world.run(seconds=0.3)
    saved = world.save()
    world.run(seconds=0.3)
    expected = world.state_hash()
    b.remove([1, 2, 3])
    late = world.add(position=np.random.default_rng(0).uniform(10, 30, (50, 2)), radius=0.2)
    a.remove()
    world.run(seconds=0.3)
    world.forces.append(grip)
    grip.particle = int(late.index[7])
    world.restore(saved)
    assert (len(world), len(a), len(b), len(late)) == (90, 30, 30, 0)
    assert grip.particle == -1
    world.forces.clear()
    world.run(seconds=0.3)
    assert world.state_hash() == expected
    refused("all removed", getattr, late, "position")
    # Who comes next is nobody's namesake.
    world.add(position=np.full((50, 2), 20.0), radius=0.1)
    assert len(late) == 0


def test_removing_twice_before_a_frame_is_as_removing_at_once() -> None:
    # What contacts remember is by particle; one that has gone already must not be taken for the last that is left.
    def heap(mass: float) -> pv.World:
        world = pv.World(boundary=pv.Box((0, 0), (5, 20)), collisions=pv.Collisions(friction=0.5))
        # The last at the bottom, where most rests on it.
        world.add(position=grid(5, 6, 1.0, (0.5, 0.5), loose=0)[::-1], radius=0.5, mass=np.linspace(mass, 1, 30))
        world.run(seconds=0.5)
        return world

    for mass in (1.0, 1000.0):  # alike, and so uneven that they lend each other inertia
        one, two = heap(mass), heap(mass)
        one.remove([8, 13, 14, 17, 18])
        two.remove([8, 13, 14, 17])
        two.remove([14])
        for world in (one, two):
            world.run(seconds=0.2)
        assert one.state_hash() == two.state_hash()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_restored_world_takes_and_loses_particles_before_its_first_frame(dtype: type) -> None:
    # What is saved then goes on with the same bits, and all that is as near stays on the list of pairs: nobody falls through.
    world = pv.World(boundary=pv.Box((-20, 0), (20, 30)), dtype=dtype)
    world.add(position=pv.fill(world.boundary, radius=0.5, count=300).position)
    world.run(seconds=0.5)
    world.restore(world.save())
    world.add(position=(0, 28.0), radius=0.3)
    world.remove([3, 7])
    world.add(position=(5, 28.0), radius=0.3)
    world.remove([100])
    saved, ends = world.save(), set()
    for _ in range(2):
        world.run(seconds=0.5)
        ends.add(world.state_hash())
        world.restore(saved)
    assert len(ends) == 1
    assert world.overlap().max < 0.05
