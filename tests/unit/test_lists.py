"""What a world has several of, forces, links, obstacles and actors, behaves as a list whose entries are checked."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from tests.worlds import refused

import pyverlet as pv


def world_of_six() -> pv.World:
    """Without forces, links, obstacles or actors."""
    world = pv.World(gravity=(0, 0))
    world.add(position=[(k, 0) for k in range(6)], radius=0.1)
    return world


NEW: dict[str, Callable[[pv.World], Any]] = {
    "forces": lambda world: pv.ConstantForce((5, 0)),
    "links": lambda world: pv.Pin(world.groups[0], 0),
    "obstacles": lambda world: pv.Disc((0, -5), 1),
    "actors": lambda world: pv.Emitter(pv.Box((0, 5), (9, 9)), rate=60),
}


@pytest.mark.parametrize("name", NEW)
def test_assigning_changes_what_is_in_the_list(name: str) -> None:
    world, make = world_of_six(), NEW[name]
    held, things = getattr(world, name), [make(world) for _ in range(3)]
    setattr(world, name, things[:2])
    assert getattr(world, name) is held
    assert list(held) == things[:2]
    setattr(world, name, iter([things[1], things[2]]))
    assert list(held) == things[1:]
    held[:] = [things[0]]
    assert list(held) == things[:1]
    setattr(world, name, held)
    assert list(held) == things[:1]
    world.run(seconds=0.1)
    twin = world_of_six()
    getattr(twin, name).append(make(twin))
    twin.run(seconds=0.1)
    assert world.state_hash() == twin.state_hash()
    setattr(world, name, [])
    assert len(held) == 0


@pytest.mark.parametrize("name", NEW)
def test_what_does_not_belong_is_refused_and_nothing_is_changed(name: str) -> None:
    world, make = world_of_six(), NEW[name]
    held = getattr(world, name)
    assert held.append(first := make(world)) is first
    for wrong in (3, None, pv.Disc, lambda world, dt: None):
        for bad in ([wrong], [make(world), wrong], wrong):
            refused("allowed", setattr, world, name, bad)
            refused("allowed", held.__setitem__, slice(None), bad)
            if name != "links":
                refused("allowed", held.__iadd__, bad)
        refused("allowed", held.append, wrong)
        refused("allowed", held.__setitem__, 0, wrong)
        if name != "links":
            refused("allowed", held.insert, 0, wrong)
    assert list(held) == [first]
    world.step(1 / 60)


@pytest.mark.parametrize("name", NEW)
def test_a_loop_may_remove(name: str) -> None:
    world, make = world_of_six(), NEW[name]
    held = getattr(world, name)
    for _ in range(4):
        held.append(make(world))
    world.step(1 / 60)
    for thing in held:
        held.remove(thing)
    assert len(held) == 0
    world.step(1 / 60)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda world: pickle.loads(pickle.dumps(world))])
@pytest.mark.parametrize("name", NEW)
def test_copies_have_lists_of_their_own(name: str, again: Callable[[pv.World], pv.World]) -> None:
    world, make = world_of_six(), NEW[name]
    getattr(world, name).append(make(world))
    twin = again(world)
    assert type(getattr(twin, name)) is type(getattr(world, name))
    for each in (world, twin):
        each.run(seconds=0.1)
    assert twin.state_hash() == world.state_hash()
    setattr(twin, name, [])
    assert len(getattr(world, name)) == 1
