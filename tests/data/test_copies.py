"""Pickles and copies of worlds, groups, saved states and what is in worlds: independent, and with the same bits afterwards."""

import copy
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import worlds
from tests.data.test_describe import THINGS
from tests.worlds import FRAME, WORLDS, bits_after, refused, said

import pyverlet as pv


def pickled(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))


WAYS: tuple[Callable[[Any], Any], ...] = (pickled, copy.deepcopy, copy.copy)


def step(world: pv.World, frames: int) -> str:
    return bits_after(world, frames / 60)


def after(world: pv.World) -> dict[str, Any]:
    step(world, 12)
    return said(world)


def test_worlds_travel_to_a_spawned_process() -> None:
    worlds = [WORLDS[name](events=True) for name in ("machine", "linked", "crossing")]
    for world in worlds:
        step(world, 40)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map(after, worlds)
    assert there == [after(world) for world in worlds]


@pytest.mark.parametrize(
    "name", ["linked", "machine", *(pytest.param(name, marks=pytest.mark.slow) for name in ("sticky", "stream"))]
)
def test_a_saved_state_may_be_copied_and_taken_up_by_a_copy_of_its_world(name: str) -> None:
    world = WORLDS[name]()
    step(world, 20)
    saved = world.save()
    again, states = copy.deepcopy(world), [saved, *(way(saved) for way in WAYS)]
    expected = after(world)
    for each in (world, again):
        for state in states:
            each.restore(state)
            assert after(each) == expected
    refused("saved is the state of another world", WORLDS[name]().restore, states[-1])


@pytest.mark.parametrize("way", [pickled, copy.deepcopy])
def test_what_is_copied_together_stays_together(way: Callable[[Any], Any]) -> None:
    world = pv.World()
    balls, others = world.add(position=[(0, 5), (2, 5), (4, 5)]), world.add(position=(8, 5))
    balls.remove(1)
    link = world.links.append(pv.Stick(balls, 0, 1))
    force = world.forces.append(pv.ConstantForce((1, 0), group=others))
    saved = world.save()
    world_, balls_, link_, force_, saved_ = way((world, balls, link, force, saved))
    assert balls_.world is world_ is not world
    assert (world_.links[0], world_.forces[0]) == (link_, force_)
    assert force_.group.world is world_
    balls_.position[:] += 1
    assert world_.position[0, 0] == world.position[0, 0] + 1
    balls_.remove(0)
    assert (len(world_), len(world_.links), len(world)) == (2, 0, 3)
    world_.restore(saved_)
    assert (len(world_), world_.state_hash()) == (3, world.state_hash())
    # A group that is copied alone takes its world along; a second handle by copy.copy is on the same particles.
    alone = way(balls)
    assert (len(alone), len(alone.world)) == (2, 3)
    assert not np.shares_memory(alone.position, balls.position)
    assert np.shares_memory(copy.copy(balls).position, balls.position)


@pv.force
def swirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -y * mass, x * mass


def pull(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -x * mass, -y * mass


def well(x: float, y: float, mass: float) -> float:
    return 0.5 * mass * (x * x + y * y)


def breeze(x: Any, y: Any, t: float) -> tuple[Any, float]:
    return 0.1 * y, 0.0


class Counter(pv.Actor):
    """Has a friend in the world, and the world."""

    def __init__(self, group: pv.Group) -> None:
        self.group, self.seen = group, 0

    def act(self, world: pv.World, dt: float) -> None:
        self.seen += len(self.group)


class Own(pv.World):
    """A world of a user's own, whose constructor takes something else."""

    def __init__(self, count: int) -> None:
        super().__init__(gravity=(0, 0), events=True)
        self.score, self.balls = 7, self.add(position=np.random.default_rng(0).uniform(-4, 4, (count, 2)))
        self.actors.append(Counter(self.balls))
        self.forces += [swirl, pv.force(pull), pv.force(potential=well)(pull), pv.Wind(breeze, linear=0.1)]


@pytest.mark.parametrize("way", WAYS)
def test_a_world_of_a_users_own_with_functions_and_references(way: Callable[[Any], Any]) -> None:
    world = Own(12)
    world.watch("score", len)
    step(world, 3)
    again = way(world)
    assert (type(again), again.score, again.read_watched()) == (Own, 7, {"score": 12.0})
    assert again.balls.world is again
    assert again.actors[0].group is again.balls
    assert again.energy() == world.energy()
    assert step(again, 5) == step(world, 5)
    assert again.actors[0].seen == world.actors[0].seen == 8 * 12  # type: ignore[attr-defined]


def test_functions_that_no_other_process_can_import_get_a_sentence() -> None:
    class Inner(pv.Actor):
        def act(self, world: pv.World, dt: float) -> None: ...

    def heavy(world: pv.World) -> float:
        return 1.0

    cases: dict[str, Callable[[pv.World], object]] = {
        r"forces\[0\]": lambda w: w.forces.append(pv.force(lambda x, y, vx, vy, mass, t: (0.0, 1.0))),
        r"forces\[0\]\b|forces\[0\]": lambda w: w.forces.append(pv.Wind(lambda x, y, t: (x, y), linear=1)),
        r"actors\[0\]": lambda w: w.actors.append(Inner()),
        "what is watched as 'heavy'": lambda w: w.watch("heavy", heavy),
    }
    for what, use in cases.items():
        world = pv.World()
        world.add(position=(0, 5))
        use(world)
        refused(f"^{what} cannot be pickled, for no other process can import .*<l.*; allowed are", pickle.dumps, world)
        assert step(copy.deepcopy(world), 2) == step(world, 2)


@pv.pair_force(range=1.0)
def spread(distance: Any, i: Any, j: Any) -> Any:
    return 1.0 - distance


def things() -> dict[str, Any]:
    world = pv.World(events=True, contacts=True, boundary=pv.Box((-9, -9), (9, 9)))
    balls = world.add(position=[(0, 0), (0, 2), (2, 2), (2, 0)])
    found = [
        *THINGS, spread, swirl, pv.ConstantForce((1, 0), group=balls), pv.Stick(balls, 0, 1), pv.Rope(balls, 0, 1),
        pv.Spring(balls, 0, 1, stiffness=1), pv.Pin(balls, 0), pv.Angle(balls, 0, 1, 2), pv.Area(balls),
        pv.AngleLimit(balls, 0, 1, 2, least=0, most=1), pv.Motor(balls, 0, speed=1, max_torque=1), pv.Clock(dt=0.1),
        pv.FrameBudget(), pv.slider("test of copies", 0, 1, 0.5), pv.Panels.of(world), world.events, world.profile,
        world.energy(), world.overlap(), world.obstacles, world.forces, world.links, world.ray((0, 5), (0, -1)),
        world.nearest((0, 0), 2),
    ]  # fmt: skip
    return {f"{number}-{type(thing).__name__}": thing for number, thing in enumerate(found)}


def test_objects_can_be_copied() -> None:
    for name, thing in things().items():
        for way in WAYS:
            again = way(thing)
            assert type(again) is type(thing), name
            assert repr(again).split(" object at ")[0] == repr(thing).split(" object at ")[0], (name, way.__name__)


def test_a_copied_link_may_join_the_same_world() -> None:
    world = pv.World()
    balls = world.add(position=[(0, 0), (0, 2), (2, 2), (2, 0)])
    link = world.links.append(pv.Stick(balls, [0, 1, 2], [1, 2, 3], length=[1, 2, 3]))
    balls.remove(0)
    assert link.length.tolist() == [2, 3]
    other = world.links.append(copy.copy(link))
    assert other.particles.tolist() == [[0, 1], [1, 2]]
    world.links.remove(link)
    assert world.links.append(link).length.tolist() == [2, 3]  # was told to have three, and refused


def test_a_world_is_copied_between_two_frames_of_another_thread() -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=None)
    world.add(position=np.zeros((500, 2)), velocity=(3.0, 0.0))
    with ThreadPoolExecutor(1) as pool:
        stepping = pool.submit(world.run, seconds=1)
        copies = list[pv.World]()
        while not stepping.done() or len(copies) < 3:
            copies += [way(world) for way in WAYS]
        stepping.result()
    for again in copies:
        assert again.time == pytest.approx(again.frames / 60)
        assert np.allclose(again.position[:, 0], 3.0 * again.time, atol=1e-9)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_each_protocol_of_pickle_will_do(protocol: int) -> None:
    world = WORLDS["linked"]()
    balls, again = pickle.loads(pickle.dumps((world.groups[0], world), protocol))
    assert balls.world is again
    assert step(again, 3) == step(world, 3)


@pytest.mark.parametrize("way", worlds.WAYS)
@pytest.mark.parametrize("later", [False, True])
def test_copies_know_which_obstacles_their_contacts_are_with(way: str, later: bool, tmp_path: Path) -> None:
    # A ball that lies on the second and leans on the third, when the first goes: before the copy, or after it has gone back.
    def start() -> pv.World:
        world = pv.World(gravity=(3, -9.81), events=True, dtype=np.float64)
        world.obstacles += [pv.Disc((9, 9), 1), pv.Segment((-5, 0), (5, 0)), pv.Segment((0.5, 0), (0.5, 5))]
        world.add(position=(-0.01, 0.5), velocity=(1, 0))
        world.run(seconds=0.5)
        return world

    def change(world: pv.World) -> None:
        world.obstacles[:] = world.obstacles[1:2]

    def heard(world: pv.World) -> list[Any]:
        world.step(FRAME)
        return [world.events.begin.tobytes(), world.events.end[["a", "wall", "obstacle"]].tolist()]

    world = start()
    if not later:
        change(world)
    twin = worlds.WAYS[way](world, tmp_path)
    if later:
        change(world)
        saved = twin.save()
        twin.step(FRAME)
        twin.restore(saved)
        change(twin)
    assert heard(twin) == heard(world) == [b"", [(0, -1, -1)]]
    assert heard(twin) == heard(world) == [b"", []]
