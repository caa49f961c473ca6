"""Substeps of one call into the core give the bits of a call each, whatever happens between the frames."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME
from pyverlet.state.group import Group

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
    return [w.time, *arrays, w._slots.wall_hits.tobytes(), w.energy()]


def take_the_long_way(w: pv.World) -> None:
    """A call for each substep: somebody looks at the world between them."""
    w.onlooker = lambda moment: None


def both(make: Any, frames: int, meanwhile: Any = lambda w, frame: None) -> None:
    """Do the same to two worlds, one of which goes the long way, and compare after every frame."""
    one, plain = make(), make()
    take_the_long_way(plain)
    for frame in range(frames):
        for w in (one, plain):
            meanwhile(w, frame)
            w.step(1 / 60)
        assert told(one) == told(plain), frame
        mine, theirs = one.save().impulses, plain.save().impulses
        assert mine.skin == theirs.skin
        assert np.array_equal(mine.values, theirs.values)


@pytest.mark.parametrize(
    ("room", "integrator"),
    [
        *(("cage", name) for name in BY_NAME),
        *((room, name) for room in ROOMS if room != "cage" for name in ("position-verlet", "rk4")),
    ],
)
def test_any_integrator_in_any_room(room: str, integrator: str) -> None:
    both(lambda: pour(boundary=ROOMS[room](), integrator=BY_NAME[integrator]()), 60)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("collisions", [None, pv.Collisions(), pv.Collisions(friction=0.3), pv.Collisions(restitution=0.5)])
def test_any_contacts(dtype: Any, collisions: Any) -> None:
    both(lambda: pour(boundary=ROOMS["cage"](), dtype=dtype, collisions=collisions), 60)


def test_friction_comes_among_circles_that_bounce_and_carry_weight() -> None:
    # What friction reads of each circle begins then; who carries weight has been known for long.
    def rub(w: pv.World, frame: int) -> None:
        if frame == 170:
            w.friction[:] = 0.5

    both(lambda: pour(boundary=ROOMS["cage"](), collisions=pv.Collisions(restitution=0.3)), 180, rub)


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
}


@pytest.mark.parametrize("first", EDITS)
def test_whatever_changes_between_frames_is_seen(first: str) -> None:
    others = list(EDITS)

    def meanwhile(w: pv.World, frame: int) -> None:
        if frame == 20:
            EDITS[first](w)
        elif frame in (30, 31, 45):
            EDITS[others[(others.index(first) + frame) % len(others)]](w)

    both(lambda: pour(boundary=ROOMS["cage"]()), 60, meanwhile)


def test_shorter_frames_of_the_same_substeps_are_not_taken_for_the_longer_ones() -> None:
    # What a frame looks back on is as long as the frame.
    def stepped(prepare: Any) -> list[Any]:
        world = pour(boundary=ROOMS["cage"]())
        prepare(world)
        for _ in range(90):
            world.step(1 / 60)
        world.substeps = 2
        seen = []
        for _ in range(60):
            world.step(1 / 240)
            seen.append(told(world))
        return seen

    assert stepped(lambda world: None) == stepped(take_the_long_way)


def test_a_frame_that_was_broken_off_leaves_the_one_before() -> None:
    # Somebody who looks fails between two substeps: the world holds the frame before, and a heap at rest stays at rest.
    def fail(moment: Any) -> None:
        raise ZeroDivisionError

    world = pour(boundary=pv.Circle(radius=8, friction=0.5), collisions=pv.Collisions(friction=0.5))
    world.run(seconds=20)
    for frame in range(60):
        before = told(world)
        if frame % 7 == 5:
            world.onlooker = fail
            with pytest.raises(ZeroDivisionError):
                world.step(1 / 60)
            world.onlooker = None
            assert told(world)[:-3] == before[:-3]
        world.step(1 / 60)
        assert np.abs(world.velocity).max() < 1e-3, frame
