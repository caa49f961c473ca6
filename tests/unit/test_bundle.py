"""Many arrays under one name: what Python holds, and what kernels read in it."""

from __future__ import annotations

import copy
import gc
import pickle
import weakref
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

import pyverlet as pv
from pyverlet.kernels import bounds
from pyverlet.laws.contacts import _held
from pyverlet.state.slots import Slots


@pytest.fixture
def slots() -> Slots:
    world = pv.World()
    world.add(position=[(1, 2), (3, 4)], radius=0.5, mass=1.0)
    slots = Slots(np.dtype(np.float32))
    slots.gather(world._state)
    return slots


def test_a_bundle_is_made_anew_when_an_array_is_another(slots: Slots) -> None:
    first = _held.circles(slots)
    assert _held.circles(slots) is first
    slots.note_start()
    second = _held.circles(slots)
    assert second is not first
    assert second.arrays[0] is first.arrays[0] is slots.position


def test_what_is_written_into_an_array_is_read_in_its_bundle(slots: Slots) -> None:
    circles = _held.circles(slots)
    slots.position[1] = (7, 8)
    body = bounds.look(1, circles)
    assert (body.x, body.y) == (7, 8)
    bounds.put(0, body, circles)
    assert tuple(slots.position[0]) == (7, 8)


def test_a_bundle_outlives_whoever_made_its_arrays() -> None:
    def made() -> tuple[Any, Any]:
        world = pv.World()
        world.add(position=[(1, 2), (3, 4)], radius=0.5)
        slots = Slots(np.dtype(np.float32))
        slots.gather(world._state)
        return _held.circles(slots), weakref.ref(slots)

    circles, maker = made()
    gc.collect()
    assert maker() is None
    assert bounds.look(1, circles)[:2] == (3, 4)


def test_walls_and_contacts_are_handed_the_same_kind() -> None:
    # Of another kind all that deals with walls would be compiled once more for worlds that go stage by stage.
    world = pv.World(boundary=pv.Circle(radius=5), collisions=pv.Collisions(friction=0.5))
    world.add(position=[(0, 0), (0.3, 0)], radius=0.1)
    world.step(1 / 60)
    assert world._contacts
    assert numba.typeof(_held.circles(world._slots)) == numba.typeof(world._contacts.wide.circles)


@pytest.mark.parametrize("way", ["copy", "pickle"])
def test_a_copy_is_of_copies_of_the_arrays(slots: Slots, way: str) -> None:
    mine = _held.circles(slots)
    theirs = copy.deepcopy(mine) if way == "copy" else pickle.loads(pickle.dumps(mine))
    body = bounds.look(1, mine)
    bounds.put(0, body, theirs)
    assert tuple(theirs.arrays[0][0]) == (3, 4)
    assert tuple(slots.position[0]) == (1, 2)


def drag(world: pv.World) -> None:
    world.forces.append(pv.Drag(linear=0.01))


def segment(world: pv.World) -> None:
    world.obstacles.append(pv.Segment((-1, 1.5), (1, 1.5)))


def stick(world: pv.World) -> None:
    group = world.add(position=[(-0.5, 1), (0.5, 1)], radius=0.1)
    world.links.append(pv.Stick(group, 0, 1))
    world.links.append(pv.Pin(group, 0))


@pytest.mark.parametrize("change", [None, drag, segment, stick])
def test_as_long_as_nothing_changes_a_world_keeps_its_bundles(change: Callable[[pv.World], None] | None) -> None:
    # A bundle that is made in every frame takes as long as what it spares.
    world = pv.World(boundary=pv.Circle(radius=2))
    world.add(position=[(0, -1.9), (0.3, -1.8)], radius=0.1)
    if change:
        change(world)
    world.run(seconds=10)
    contacts = world._contacts
    assert contacts

    def bundles() -> list[object]:
        return [contacts.wide.circles, contacts.wide.packed, world._run._beside]

    assert (world._run._beside is not None) is (change not in (None, drag))
    kept = 0
    for _ in range(60):
        before, lists = bundles(), contacts.broad_phase.rebuilds
        world.step(1 / 60)
        if contacts.broad_phase.rebuilds == lists:  # else there are other pairs
            assert all(one is other for one, other in zip(bundles(), before, strict=True))
            kept += 1
    assert kept > 10


def test_copied_with_its_slots_it_is_still_theirs(slots: Slots) -> None:
    _held.circles(slots)
    other = copy.deepcopy(slots)
    assert _held.circles(other).arrays[0] is other.position
