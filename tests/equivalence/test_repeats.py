"""Substeps that are replayed give the bits of those that Python goes through, whatever happens between the frames."""

from __future__ import annotations

import copy
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from unittest import mock

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import trace
from pyverlet.laws.contacts.collisions import ContactSolver
from pyverlet.laws.integrators import BY_NAME
from pyverlet.state.group import Group
from pyverlet.world import repeats

ROOMS = {
    "cage": lambda: pv.Circle(radius=8),
    "bouncy cage": lambda: pv.Circle(center=(1, 0), radius=8, restitution=0.7),
    "box": lambda: pv.Box((-6, -7), (6, 7)),
    "rubbing box": lambda: pv.Box((-6, -7), (6, 7), restitution=0.5, friction=0.5),
    "open": pv.Open,
}


def pour(count: int = 40, **options: Any) -> pv.World:
    made = pv.World(**options)
    random = np.random.default_rng(5)
    place = np.stack(np.meshgrid(np.arange(-3, 4), np.arange(-3, 4)), axis=-1).reshape(-1, 2)[:count] * 1.3
    group = made.add(position=place + 0.1 * random.random(place.shape), radius=random.uniform(0.3, 0.5, len(place)))
    group.velocity[:] = random.normal(0, 3, place.shape)
    return made


def told(w: pv.World) -> list[Any]:
    """All that a frame leaves behind, as bytes."""
    arrays = [array.tobytes() for _, array in w._state.arrays()]
    return [w.time, *arrays, w._slots.resting.tobytes(), w._slots.hits.tobytes(), w.energy()]


def take_the_long_way(patch: pytest.MonkeyPatch) -> None:
    """Nothing is replayed, no substep leans on another."""
    patch.setattr(repeats, "_key", lambda *arguments: None)
    patch.setattr(ContactSolver, "packs", lambda contacts, state: None)


@pytest.fixture(params=["alike", "of three kinds"])
def both(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Do the same to two worlds, one of which Python goes through, and compare after every frame. Returns replayed substeps."""
    monkeypatch.setattr(repeats, "STAGES_FROM", 10_000 if request.param == "alike" else 0)
    number = 0
    ahead = trace.Trace.ahead

    def count(trace: trace.Trace, substeps: int, key: Any) -> tuple[int, bool]:
        nonlocal number
        rounds, begun = ahead(trace, substeps, key)
        number += rounds
        return rounds, begun

    monkeypatch.setattr(trace.Trace, "ahead", count)

    def go(make: Any, frames: int, meanwhile: Any = lambda w, frame: None) -> int:
        nonlocal number
        replayed, plain = make(), make()
        number = 0
        for frame in range(frames):
            meanwhile(replayed, frame)
            replayed.step(1 / 60)
            with pytest.MonkeyPatch.context() as patch:
                take_the_long_way(patch)
                meanwhile(plain, frame)
                plain.step(1 / 60)
            assert told(replayed) == told(plain), frame
            if replayed._contacts:
                assert replayed.save().contacts[0][1:] == plain.save().contacts[0][1:]
        return number

    return go


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("integrator", BY_NAME)
def test_replayed_substeps_have_the_same_bits(both: Any, room: str, integrator: str) -> None:
    number = both(lambda: pour(boundary=ROOMS[room](), integrator=BY_NAME[integrator]()), 120)
    assert (number > 0) == (BY_NAME[integrator].repeats and room != "open")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("collisions", [None, pv.Collisions(), pv.Collisions(friction=0.3), pv.Collisions(restitution=0.5)])
def test_they_have_with_any_contacts(both: Any, dtype: Any, collisions: Any) -> None:
    number = both(lambda: pour(boundary=ROOMS["cage"](), dtype=dtype, collisions=collisions), 120)
    assert (number > 0) == (collisions in (None, pv.Collisions()))


def test_a_settled_world_is_nearly_all_replayed(both: Any) -> None:
    def settled() -> pv.World:
        w = pour(boundary=ROOMS["cage"]())
        w.run(seconds=10)
        return w

    assert both(settled, 30) > 0.9 * 30 * 8


def a_push(w: Any) -> None:
    w.velocity[3] += (5, 2)


def a_move(w: Any) -> None:
    w.position[3:6] += 0.25


EDITS: dict[str, Any] = {
    "gravity": lambda w: setattr(w, "gravity", (3, -2)),
    "substeps": lambda w: setattr(w, "substeps", 5),
    "integrator": lambda w: setattr(w, "integrator", pv.SemiImplicitEuler()),
    "cage": lambda w: setattr(w, "boundary", pv.Circle(radius=6.5)),
    "cage in place": lambda w: setattr(w.boundary, "radius", 6.5),
    "bounce of the cage": lambda w: setattr(w.boundary, "restitution", 0.9),
    "friction of the cage": lambda w: setattr(w.boundary, "friction", 0.9),
    "collisions": lambda w: setattr(w, "collisions", pv.Collisions(friction=0.4)),
    "no collisions": lambda w: setattr(w, "collisions", None),
    "push": a_push,
    "move": a_move,
    "radius": lambda w: w.radius.__setitem__(slice(2, 9), 0.3),
    "mass": lambda w: w.mass.__setitem__(4, 3.0),
    "pinned": lambda w: w.mass.__setitem__(4, np.inf),
    "category": lambda w: (w.category.__setitem__(4, 2), w.mask.__setitem__(slice(5), 2)),
    "restitution": lambda w: w.restitution.__setitem__(4, 0.8),
    "friction": lambda w: w.friction.__setitem__(4, 0.8),
    "one more": lambda w: w.add(position=(0.3, 0.2), radius=0.4),
    "one less": lambda w: w.remove(np.array([7])),
    "force": lambda w: w.forces.append(pv.Drag(linear=0.5)),
    "stick": lambda w: w.links.append(pv.Stick(Group(w._state, slice(0, 5), w.remove), 0, 1)),
    "segment": lambda w: w.obstacles.append(pv.Segment((-2, -5), (2, -5))),
    "saved": lambda w: w.restore(w.save()),
    "watched": lambda w: setattr(w, "onlooker", lambda moment: None),
}


@pytest.mark.parametrize("first", EDITS)
def test_whatever_changes_between_frames_is_seen(both: Any, first: str) -> None:
    others = list(EDITS)
    random = np.random.default_rng(others.index(first))

    def meanwhile(w: pv.World, frame: int) -> None:
        nonlocal random
        if frame == 20:
            EDITS[first](w)
        elif frame in (30, 31, 45):
            EDITS[others[(others.index(first) + frame) % len(others)]](w)

    assert both(lambda: pour(boundary=ROOMS["cage"]()), 60, meanwhile) > 0


def test_shorter_frames_of_the_same_substeps_are_not_taken_for_the_longer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    # What a frame looks back on is as long as the frame.
    def stepped() -> list[Any]:
        world = pour(boundary=ROOMS["cage"]())
        for _ in range(90):
            world.step(1 / 60)
        world.substeps = 2
        seen = []
        for _ in range(60):
            world.step(1 / 240)
            seen.append(told(world))
        return seen

    replayed = stepped()
    take_the_long_way(monkeypatch)
    assert replayed == stepped()


def test_a_copy_has_calls_of_its_own() -> None:
    one = pour(boundary=ROOMS["cage"]())
    one.run(seconds=5)
    other = copy.deepcopy(one)
    before = one.position.copy()
    other.run(seconds=0.5)
    assert np.array_equal(one.position, before)
    one.run(seconds=0.5)
    assert np.array_equal(one.position, other.position)


def test_too_many_calls_for_the_room_are_not_recorded(monkeypatch: pytest.MonkeyPatch, both: Any) -> None:
    monkeypatch.setattr(trace, "_ROOM", 100)
    assert both(lambda: pour(boundary=ROOMS["cage"]()), 10) == 0


def test_calls_the_long_way_are_not_left_out(both: Any) -> None:
    def strange() -> pv.World:
        w = pour(boundary=ROOMS["cage"]())
        w.run(seconds=2)
        w._slots.radius.dtype = np.dtype(np.float32, copy=True)  # type: ignore[misc]  # an entry does not know that object
        w._slots.size = w._slots.radius
        w.gravity = (0, -5)  # what is recorded already is not good for that
        return w

    assert both(strange, 10) == 0


def test_worlds_of_several_python_threads_record_their_own_calls() -> None:
    worlds = [pour(boundary=pv.Circle(radius=8), gravity=(0, -g)) for g in (3, 5, 7, 9)]
    alone = [copy.deepcopy(w) for w in worlds]
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(len(worlds)) as pool:
            list(pool.map(lambda w: w.run(seconds=1.5), worlds))
    finally:
        sys.setswitchinterval(before)
    for w, other in zip(worlds, alone, strict=True):
        other.run(seconds=1.5)
        assert told(w) == told(other)


def test_a_substep_that_was_broken_off_is_not_replayed(both: Any) -> None:
    # Ctrl-C before the walls: a substep without them must not be what the next frames are made of.
    def interrupt(w: pv.World, frame: int) -> None:
        if frame == 5:
            w.gravity = (0, -5)
            room = w.boundary
            room.held = mock.Mock(side_effect=KeyboardInterrupt)  # type: ignore[method-assign]
            with pytest.raises(KeyboardInterrupt):
                w.step(1 / 60)
            del room.held

    assert both(lambda: pour(boundary=ROOMS["cage"]()), 60, interrupt) > 0


def test_a_world_that_turns_not_a_number_says_who_and_where() -> None:
    w = pour(boundary=ROOMS["cage"]())
    w.run(seconds=3)
    w.velocity[5, 1] = np.nan
    with pytest.raises(pv.NonFiniteError, match="5"):
        w.step(1 / 60)
    w.velocity[5, 1] = 0
    w.step(1 / 60)
