"""Emitters and sinks: how many, where, and the same again after a restore."""

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import go_on_alike, grid, refused

import pyverlet as pv

MOUTH = pv.Box((-5, 8), (5, 10))


def test_an_emitter_keeps_its_rate() -> None:
    world = pv.World()
    emitter = pv.Emitter(MOUTH, rate=100.0, radius=(0.05, 0.1), velocity=(0, -20), mass=2.0)
    world.actors.append(emitter)
    for frame in range(1, 121):
        world.step(1 / 60)
        assert len(world) == emitter.emitted == int(frame * 100 / 60 + 1e-9)
    assert (world.mass == 2.0).all()
    assert 0.05 <= world.radius.min() < world.radius.max() <= 0.1
    assert (np.abs(world.position[:, 0]) < 5).all()
    assert world.overlap().max < 0.02


def test_an_emitter_waits_while_there_is_no_room() -> None:
    world = pv.World(gravity=(0, 0))
    world.actors.append(pv.Emitter(pv.Circle(center=(3, 3), radius=2.0), rate=1200, radius=0.25))
    world.run(seconds=1)
    count = len(world)
    assert 15 < count < 64  # circles of 0.25 m cover 4/64 of it each, and random places leave gaps
    assert world.overlap().contacts == 0
    assert (np.hypot(*(world.position - 3).T) + 0.25 <= 2.0 + 1e-6).all()
    world.remove(np.arange(count))
    world.step(1 / 60)
    assert len(world) <= 21  # no burst: a frame's worth


def test_an_emitter_ends_at_most() -> None:
    world = pv.World()
    world.actors.append(pv.Emitter(MOUTH, rate=1000, radius=0.05, velocity=(0, -30), most=37))
    world.run(seconds=0.5)
    assert len(world) == 37


def test_a_sink_takes_those_inside_or_outside() -> None:
    world = pv.World(gravity=(0, 0))
    kept = world.add(position=[(0, 0), (2, 2)], radius=0.1)
    world.add(position=[(8, 8), (9, 9)], radius=0.1)
    sink = pv.Sink(pv.Box((7, 7), (10, 10)))
    world.actors.append(sink)
    world.step(1 / 60)
    assert (len(world), sink.removed) == (2, 2)
    world.actors.append(pv.Sink(pv.Circle(center=(0, 0), radius=1.0), outside=True))
    world.step(1 / 60)
    assert len(kept) == len(world) == 1


class Calls(pv.Actor):
    """Notes its turns, and then does what it was given."""

    def __init__(self, turns: list[tuple[str, int]], name: str, then: Callable[..., object] | None = None) -> None:
        self.turns, self.name, self.then = turns, name, then

    def act(self, world: pv.World, dt: float) -> None:
        self.turns.append((self.name, world.frames))
        if self.then is not None:
            self.then(self, world)


def acting(**then: Callable[[Calls, pv.World], object] | None) -> tuple[pv.World, list[tuple[str, int]], dict[str, Calls]]:
    """A world after three frames with an actor for each name, the turns they had, and the actors."""
    world, turns = pv.World(), list[tuple[str, int]]()
    named = {name: Calls(turns, name, what) for name, what in then.items()}
    world.actors.extend(named.values())
    world.run(seconds=3 / 60)
    return world, turns, named


def test_an_actor_that_removes_itself_leaves_the_others_their_turns() -> None:
    world, turns, named = acting(a=None, b=lambda self, world: world.actors.remove(self), c=None, d=None)
    assert turns == [("a", 0), ("b", 0), ("c", 0), ("d", 0), ("a", 1), ("c", 1), ("d", 1), ("a", 2), ("c", 2), ("d", 2)]
    assert world.actors == [named["a"], named["c"], named["d"]]


@pytest.mark.parametrize(
    ("then", "first"),
    [
        (lambda _, world: world.actors.clear(), "a"),
        (lambda _, world: world.actors.pop(1), "acd"),
        (lambda _, world: world.actors.reverse(), "abcd"),
        (lambda self, world: world.actors.insert(0, Calls(self.turns, "new")), "abcd"),
        (lambda self, world: setattr(world, "actors", [Calls(self.turns, "new")]), "a"),
    ],
)
def test_actors_that_are_there_when_a_frame_begins_act_once_in_it(then: Any, first: str) -> None:
    world, turns = pv.World(), list[tuple[str, int]]()
    world.actors += [Calls(turns, "a", then), *(Calls(turns, name) for name in "bcd")]
    world.step(1 / 60)
    assert [name for name, _ in turns] == [*first]
    world.step(1 / 60)
    assert all(frame == 1 for _, frame in turns[len(first) :])


def test_an_actor_that_is_listed_twice_acts_twice() -> None:
    world, turns = pv.World(), list[tuple[str, int]]()
    world.actors += [Calls(turns, "a")] * 2
    world.step(1 / 60)
    assert turns == [("a", 0)] * 2


class Ring(pv.Circle):
    """A room of the user's own."""


REGIONS = {"box": pv.Box((-9, -0.05), (9, 0.05)), "circle": pv.Circle(radius=0.2), "own": Ring(radius=0.2)}
WAYS = [((0.1, 3.0), (0.0, -150.0)), ((3.0, 0.04), (-150.0, 0.0)), ((-1.05, -1.0), (75.0, 75.0))]


@pytest.mark.parametrize("region", REGIONS)
@pytest.mark.parametrize("periodic", [False, True])
def test_a_sink_catches_what_crosses_it_within_a_frame(region: str, periodic: bool) -> None:
    # 2.5 m a frame, through a region of 0.1 to 0.4 m; beside them one that passes by, and one that is put on the other side.
    room: pv.Boundary = pv.Periodic((-4, -10), (4, 10)) if periodic else pv.Open()
    world = pv.World(gravity=(0, 0), boundary=room, collisions=None)
    world.actors.append(sink := pv.Sink(REGIONS[region]))
    position, velocity = zip(*WAYS, strict=True)
    world.add(position=position, velocity=velocity, mass=1)
    passing = world.add(position=(0.0, 0.3), velocity=(150, 0), mass=2)
    world.add(position=(0, 5), mass=3)
    for frame in range(3):
        world.position[world.mass == 3, 1] = 5 if frame % 2 else -5
        world.step(1 / 60)
        passing.position[0] = (0.0, 0.3)
    assert (sink.removed, world.mass.tolist()) == (3, [2, 3])


def test_a_sink_catches_what_crosses_the_seam_into_it() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Periodic((-4, -4), (4, 4)), collisions=None)
    world.actors.append(pv.Sink(pv.Box((-3.6, -1), (-3.4, 1))))
    world.add(position=[(3.5, 0), (3.5, 2)], velocity=(150, 0), mass=[1, 2])
    world.step(1 / 60)
    assert world.mass.tolist() == [2]


# ---- What becomes of circles that are added on top of others: pushed apart, left out or refused ----


ROOMS: dict[str, Any] = {
    "open": pv.Open(),
    "box": pv.Box((-4, -3), (5, 4)),
    "periodic": pv.Periodic((-4, -3), (5, 4)),
    "slope": pv.Periodic((-4, -3), (5, 4), axes="x"),
}


def brute(world: pv.World, position: Any, radius: Any, there: int) -> list[int]:
    """Which of these may be added one after the other, circle by circle; `there` of them are already."""
    kept = list(range(there))
    for k in range(there, len(position)):
        way = world.boundary.periodic.nearest(position[kept] - position[k])
        if (np.hypot(*way.T) >= radius[kept] + radius[k]).all() and world.is_free(position[k])[0]:
            kept.append(k)
    return kept


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("spread", [1.0, 20.0])
def test_skip_adds_those_that_are_free_in_order(room: str, dtype: Any, spread: float) -> None:
    world = pv.World(boundary=ROOMS[room], dtype=dtype)
    world.obstacles.append(pv.Disc((1, 1), 0.7))
    rng = np.random.default_rng(3)
    # Some start outside: they are left out by walls, and elsewhere have an image inside, or none to be in the way of.
    places = rng.uniform((-4.5, -3.5), (5.5, 4.5), (400, 2)).astype(dtype)
    radius = (0.3 * spread ** -rng.random(400)).astype(dtype)
    free = np.flatnonzero(world.is_free(places))[:40]
    # Those that are there may overlap each other.
    order = np.concatenate((free, np.setdiff1d(np.arange(400), free)))
    places, radius = places[order], radius[order]
    placed = world.boundary.put_in(places, radius)
    world.add(position=places[:40], radius=radius[:40])
    late = world.add(position=places[40:], radius=radius[40:], on_overlap="skip", data=None)
    wide = np.where(world.is_free(places)[:, None], placed, places).astype(float)
    kept = np.array(brute(world, wide, radius.astype(float), 40))
    assert 20 < len(late) < 300
    assert late.radius.tolist() == radius[kept[40:]].tolist()
    assert late.position.tolist() == placed[kept[40:]].tolist()


def test_columns_and_data_go_with_those_that_are_added() -> None:
    world = pv.World()
    world.data["name"] = ""
    world.add(position=(0, 0))
    places = [(0.5, 0), (2, 0), (2.9, 0), (4, 0)]
    group = world.add(position=places, mass=[1, 2, 3, 4], on_overlap="skip", data={"name": ["a", "b", "c", "d"]})
    assert group.mass.tolist() == [2, 4]
    assert group.data["name"].tolist() == ["b", "d"]
    assert len(world.add(position=places, on_overlap="skip")) == 0
    assert len(world) == 3


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_circles_that_just_touch_are_free(dtype: Any) -> None:
    """Places of a lattice, far from the origin, are rounded: no circle is on top of another by that."""
    world = pv.World(dtype=dtype)
    places = grid(20, 20, 0.41, (500, -300), loose=0)
    assert len(world.add(position=places, radius=0.205, on_overlap="error")) == 400
    assert len(world.add(position=places + np.array([0, 20 * 0.41]), radius=0.205, on_overlap="skip")) == 400
    assert len(world.add(position=places + np.array([0.01, 20 * 0.41]), radius=0.205, on_overlap="skip")) == 0


def test_circles_that_would_not_collide_are_not_on_top_of_each_other() -> None:
    world = pv.World()
    world.add(position=(0, 0), category=2, mask=2)
    world.add(position=(3, 0), mass=np.inf)
    world.add(position=[(0, 0.1), (6, 0)], on_overlap="error")
    world.add(position=(3, 0.1), mass=np.inf, on_overlap="error")  # nothing would part the two
    refused("on top of particle 1", world.add, position=(3, 0.2), on_overlap="error")
    world.collisions = None
    assert len(world.add(position=(3, 0.2), on_overlap="skip")) == 1


def test_pushed_circles_part_gently() -> None:
    """The ways they part, at no more speed than that of parting overlaps: it is bounded whatever they overlap by."""
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1.0))
    world.add(position=(0, 0), radius=0.5)
    world.add(position=(0.2, 0), radius=0.5, on_overlap="push")
    world.run(seconds=2.0)
    assert world.overlap().max < 0.01
    assert world.energy().kinetic < 1e-3
    assert world.momentum() == pytest.approx([0, 0], abs=1e-6)


@pytest.mark.parametrize("position", [[(9, 9), (0.3, 0)], [(9, 9), (8.5, 9)], (5, 5), (30, 5)])
def test_what_is_in_the_way_of_others_may_be_pushed(position: Any) -> None:
    world = pv.World(boundary=pv.Box((-20, -20), (20, 20)))
    world.obstacles.append(pv.Disc((5, 5), 1.0))
    world.add(position=(0, 0))
    assert len(world.add(position=position, on_overlap="push")) > 0


def test_the_name_of_before_still_works() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (4, 4)))
    with pytest.warns(DeprecationWarning, match="allow_overlap is deprecated; on_overlap='push' is allow_overlap=True") as told:
        world.add(position=(9, 9), allow_overlap=True)
    assert told[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="allow_overlap"), pytest.raises(pv.InputError, match="outside the room"):
        world.add(position=(9, 9), allow_overlap=False)


@pv.contact_rule
def sevens(world: pv.World, new: Any) -> Any:
    return (world.number[new.a] + world.number[new.b]) % 7 == 0


@pv.contact_rule
def fast(world: pv.World, new: Any) -> Any:
    return new.speed > 2


def swarm(seed: int, *rules: Any) -> pv.World:
    """A gas whose circles pass through each other where the rules say so."""
    chance = np.random.default_rng(seed)
    world = pv.World(boundary=pv.Box((0, 0), (9, 9)), collisions=pv.Collisions(restitution=1.0))
    world.add(position=chance.uniform(1, 8, (30, 2)), velocity=chance.normal(0, 3, (30, 2)), radius=0.3)
    world.actors += rules
    return world


def test_one_rule_in_several_worlds_remembers_each() -> None:
    # By rules of their own, one world after the other; the same rule in all, frame by frame in turn, also from a saved start.
    alone = [swarm(seed, pv.contact_rule(lambda world, new: sevens(world, new))) for seed in range(3)]
    for world in alone:
        world.run(seconds=1.0)
    shared = [swarm(seed, sevens) for seed in range(3)]
    starts = [world.save() for world in shared]
    for again in range(2):
        for _ in range(60):
            for world in shared:
                world.step(1 / 60)
        assert [world.state_hash() for world in shared] == [world.state_hash() for world in alone]
        for world, start in zip(shared, starts, strict=True) if not again else ():
            world.restore(start)
    for world in shared:
        world.actors.remove(sevens)
        assert sevens not in world.actors


def test_rules_of_a_module_are_pickled_and_found_by_name(tmp_path: Path) -> None:
    world = swarm(1, sevens, fast)
    world.run(seconds=0.5)

    assert pickle.loads(pickle.dumps(world)).actors == [sevens, fast]
    go_on_alike(world, tmp_path, count=30, objects=[fast, sevens])
