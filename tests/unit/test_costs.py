"""What does not matter to a frame costs it nothing. Calls are counted, not milliseconds: those depend on the machine."""

import copy
import cProfile
import timeit
from collections.abc import Callable, Sequence
from functools import partial
from time import process_time
from typing import Any

import numpy as np
import pytest
from tests.worlds import grid

import pyverlet as pv
from pyverlet.common.constants import KNOWN_FROM
from pyverlet.laws.collisions import find_contacts
from pyverlet.state import neighbours
from pyverlet.world import queries

DT = 1 / 60


def calls(act: Callable[[], object]) -> int:
    """How many functions Python calls, its own and those of C, in `act`."""
    profile = cProfile.Profile()
    profile.runcall(act)
    return sum(entry.callcount for entry in profile.getstats())


def frames(world: pv.World, count: int = 6, act: Callable[[int], object] = lambda k: None) -> int:
    """Calls in a frame: the fewest of several, for lists are made anew now and then."""

    def frame(k: int) -> None:
        act(k)
        world.step(DT)

    return min(calls(lambda k=k: frame(k)) for k in range(count))  # type: ignore[misc]


def far(count: int) -> Any:
    return np.random.default_rng(0).uniform(100, 900, (count, 2))


OBSTACLES: dict[str, Callable[[int], list[pv.Obstacle]]] = {
    "pegs": lambda n: [pv.Disc(at, 0.3, restitution=0.5, friction=0.1) for at in far(n)],
    "tiles": lambda n: [pv.Segment(at, (at[0] + 1, at[1])) for at in far(n)],
    "boxes": lambda n: [pv.Polygon(at + np.array([(0, 0), (1, 0), (1, 1)])) for at in far(n)],
    "chain": lambda n: [pv.Chain(np.column_stack((np.arange(n + 1.0), 500 + np.sin(np.arange(n + 1)))))],
}


def world_of_discs(obstacles: list[pv.Obstacle], **options: Any) -> pv.World:
    world = pv.World(threads=1, **options)
    world.add(position=grid(5, 5, 1.0, (0, 0), loose=0), radius=0.4)
    world.obstacles.extend([pv.Segment((-9, -50), (9, -50)), *obstacles])  # one there is in any case
    world.run(seconds=3 / 60)
    return world


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        *((kind, {}) for kind in OBSTACLES),
        *(("pegs", how) for how in ({"sleep": True}, {"events": True}, {"contacts": True})),
        ("boxes", {"boundary": pv.Periodic((0, 0), (999, 999))}),
    ],
)
def test_obstacles_that_stand_still_cost_nothing(kind: str, options: dict[str, Any]) -> None:
    few, many = (world_of_discs(OBSTACLES[kind](count), **options) for count in (4, 1000))
    assert abs(frames(many) - frames(few)) <= 20


def test_changing_one_obstacle_costs_the_same_among_many() -> None:
    acts: dict[str, Callable[[pv.World, int], object]] = {
        "moved": lambda world, k: setattr(world.obstacles[k], "pivot", (10.0 + k, 70.0)),
        "added": lambda world, k: world.obstacles.append(pv.Disc((10.0 + k, 70.0), 0.3)),
        "removed": lambda world, k: world.obstacles.pop(5 + k),
        "deleted": lambda world, k: world.obstacles.__delitem__(3),
        "changed": lambda world, k: setattr(world.obstacles[k], "friction", 0.2),
        "spun": lambda world, k: setattr(world.obstacles[3], "angular_velocity", 1.0 + k),
    }
    for name, act in acts.items():
        few, many = (world_of_discs(OBSTACLES["pegs"](count)) for count in (20, 1000))
        assert abs(frames(many, act=partial(act, many)) - frames(few, act=partial(act, few))) <= 20, name


def edits(world: pv.World, k: int) -> None:
    """All that can happen to a list of obstacles, one after the other."""
    o = world.obstacles
    if k == 2:
        o.append(pv.Disc((2.0, -2.0), 0.8))
    elif k == 4:
        o.pop(0)
    elif k == 6:
        o.insert(1, pv.Segment((-3, -3), (9, -4), restitution=0.5))
    elif k == 8:
        o[2].pivot = (3.2, -1.6)
    elif k == 10:
        o.reverse()
    elif k == 12:
        o[0].velocity, o[1].angular_velocity = (0.4, 0.3), 2.0
    elif k == 14:
        o.append(pv.Disc((1.0, -6.0), 0.5))
        del o[1], o[-1]
        o.append(o[0])
        o.remove(o[3])
    elif k == 15:
        o.pop(0)
        o.append(pv.Disc((2.0, -6.0), 0.5))
        o.pop(2)
    elif k == 16:
        del o[1:3]
        o.extend([pv.Polygon([(0, -5), (3, -5), (1, -3.5)]), o[0]])
    elif k == 20:
        o[0].velocity = (0, 0)
    elif k == 24:
        world.radius[:3] = 0.9


@pytest.mark.parametrize("room", [pv.Open(), pv.Periodic((-6, -9), (8, 9))], ids=repr)
def test_a_grid_that_follows_gives_the_bits_of_one_made_anew(room: pv.Boundary) -> None:
    world = pv.World(boundary=room, events=True, dtype=np.float64)
    world.add(position=grid(5, 5, 1.0, (0, 0), loose=0), radius=np.resize([0.2, 0.3, 0.4], 25), restitution=0.3)
    world.obstacles.extend([pv.Disc((x, -1.5), 0.3) for x in range(6)])
    for k in range(40):
        edits(world, k)
        world._obstacle_arrays.begin()
        before = world.save()
        world.step(DT)
        after = world.position.copy()
        world.restore(before)
        world._frames.held.obstacles._seen = -1, None  # as if the list had just been made
        world.step(DT)
        assert np.array_equal(world.position, after), k


def test_far_and_long_obstacles_leave_the_others_to_their_cells() -> None:
    # A ground of 2000 km and a peg at the end of the world: a table of cells over all of that would have one for the pegs.
    world = world_of_discs(OBSTACLES["pegs"](200))
    world.obstacles.extend([pv.Segment((-1e6, -60), (1e6, -60)), pv.Disc((1e12, 1e12), 1.0)])
    ball = world.add(position=(0.0, -58.0), radius=0.4)
    world.step(DT)
    world._obstacle_arrays.covering(world.position)
    assert world._obstacle_arrays._cell < 400
    world.run(seconds=120 / 60)
    assert ball.position[0, 1] == pytest.approx(-59.6, abs=1e-3)


def test_who_crosses_a_thousand_cells_in_a_substep_is_stopped() -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    world.obstacles.extend([pv.Segment((5000, -1), (5000, 1)), pv.Disc((-3, 0), 1), pv.Disc((4, 9), 1)])
    ball = world.add(position=(0, 0), velocity=(3e6, 0), radius=0.1)
    world.step(DT)
    assert ball.position[0, 0] == pytest.approx(4999.9)


def test_an_obstacle_listed_twice_moves_twice_and_a_copy_of_a_world_has_its_own() -> None:
    world = world_of_discs([])
    peg = pv.Disc((0, -8), 1.0)
    world.obstacles.extend([peg, peg])
    world.step(DT)
    peg.pivot = (50, 0)
    world.step(DT)
    assert world._obstacle_arrays.covering(np.array([(50.0, 0.0), (0.0, -8.0)])).tolist() == [1, -1]
    other = copy.deepcopy(world._obstacle_arrays)
    peg.pivot = (60, 0)
    assert world._obstacle_arrays.covering(np.array([(60.0, 0.0)])).tolist() == [1]
    assert other.covering(np.array([(60.0, 0.0), (50.0, 0.0)])).tolist() == [-1, 1]


def fastest(act: Callable[[], object]) -> float:
    """Seconds, the least of several: what others do on the machine only adds to it."""
    return min(timeit.repeat(act, repeat=15, number=1))


def exclusive(*acts: Callable[[], object], turns: int = 40) -> list[float]:
    """Seconds that each takes, one after the other again and again: medians, for machines that are busy with something else."""
    took = [[timeit.timeit(act, number=1) for act in acts] for _ in range(turns)]
    return np.median(took, axis=0).tolist()  # type: ignore[no-any-return]


def heap(count: int, pegs: int = 0, **options: Any) -> pv.World:
    """So many discs that rest on a peg and the floor, and more pegs far away."""
    side = round(np.sqrt(count))
    world = pv.World(boundary=pv.Box((0, 0), (1.1 * side, 100)), threads=1, **options)
    world.obstacles.extend([pv.Disc((0.6, 0), 0.1), *OBSTACLES["pegs"](pegs)])
    world.add(position=grid(side, count // side, 1.02, (0.6, 0.6), loose=0), radius=0.5)
    world.run(seconds=1, dt=DT)
    return world


READINGS: dict[str, Callable[[pv.World], object]] = {
    "contacts": lambda world: world.contacts,
    "force on an obstacle": lambda world: world.force_on(world.obstacles[-1]),
    "force on the room": lambda world: world.force_on(world.boundary),
    "pressure": lambda world: world.pressure(),
    "energy": lambda world: world.energy(),
    "momentum": lambda world: world.momentum(),
    "overlap": lambda world: world.overlap(),
}


@pytest.mark.parametrize("options", [{}, {"pegs": 5000}, {"dtype": np.float64}, {"sleep": True}], ids=repr)
@pytest.mark.parametrize("count", [10, 100, 400, 1000])
def test_reading_a_world_costs_less_than_its_step(count: int, options: dict[str, Any]) -> None:
    # All in turn with steps, for the first after each step has to find out. They are about half of one; of ten discs, nearly one.
    world = heap(count, contacts=True, **options)
    for name, read in READINGS.items():
        step, reading = exclusive(lambda: world.step(DT), lambda read=read: read(world))  # type: ignore[misc]
        assert reading < (2 if count == 10 else 1) * step, name


def test_a_frame_that_notes_contacts_costs_little_more_than_one_that_does_not() -> None:
    # 1.1 times as much; it was 17 to 100 times, as each substep was a call.
    plain, records_contacts = heap(100), heap(100, contacts=True)
    without, with_it = exclusive(lambda: plain.step(DT), lambda: records_contacts.step(DT))
    assert with_it < 1.6 * without
    assert plain.state_hash() == records_contacts.state_hash()


@pytest.mark.parametrize(("room", "scale"), [(pv.Open(), 1.0), (pv.Open(), 1e-6), (pv.Periodic((-3, -3), (5, 4)), 1.0)])
@pytest.mark.parametrize("spread", [1, 30])
def test_overlaps_are_those_that_all_pairs_have(room: pv.Boundary, scale: float, spread: float) -> None:
    rng = np.random.default_rng(2)
    world = pv.World(boundary=room, dtype=np.float64)
    radius = rng.uniform(0.3 / spread, 0.3, 300) * scale
    group = world.add(position=rng.uniform((-3, -3), (5, 4), (300, 2)) * scale, radius=radius, on_overlap="push")
    group.mass[:20] = np.inf
    group.category[30:60], group.mask[60:90] = 2, 1
    world.links.append(pv.Stick(group, 0, 100, length=scale, collide=False))
    pairs = find_contacts(world._state)
    pairs = pairs[~((pairs == (0, 100)).all(axis=1))]
    way = world.boundary.periodic.nearest(world.position[pairs[:, 1]] - world.position[pairs[:, 0]])
    depth = 1 - np.hypot(*way.T) / world.radius[pairs].sum(axis=1)
    overlap = world.overlap()
    assert overlap.contacts == len(pairs) > 20
    assert (overlap.mean, overlap.max) == pytest.approx((depth.mean(), depth.max()), rel=1e-12)


def test_every_overlap_counts_and_what_is_far_away_costs_nothing() -> None:
    world = pv.World()
    row = world.add(position=np.arange(9001.0)[::-1, None] * (0.9, 0.0) + 0.5, radius=0.5, on_overlap="push")
    assert world.overlap().contacts == 9000
    one = fastest(world.overlap)
    row.position[0] = (-1e5, 1e6)
    assert fastest(world.overlap) < 5 * one


def test_questions_sort_particles_once_and_again_when_they_have_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (50, 50)))
    world.add(position=grid(20, 20, 1.0, (0.5, 0.5), loose=0), radius=0.4)
    made, real = [], neighbours.cells_of

    def sort(*about: Any, **how: Any) -> Any:
        made.append(about)
        return real(*about, **how)

    monkeypatch.setattr(queries, "cells_of", sort)
    before, points = world.rebuilds, world.position[:100] + 0.1
    for _ in range(3):
        assert world.at_point(points).tolist() == list(range(100))
        world.nearest(points, 3)
        world.in_box(points, points + 1)
        world.ray(points, (1, 0))
        assert world.at_point(points[5]).tolist() == [5]
    assert len(made) == 2  # their centres, and for rays their discs
    assert world.rebuilds == before
    world.position[7] = (40.0, 40.0)
    assert world.at_point(points)[7] == -1
    assert world.at_point((40.1, 40.0)).tolist() == [7]
    assert len(made) == 3


# ---- What sleeps or is pinned costs next to nothing, and frames that leave it out have the bits of those that do not ----


def pegs(*, friction: float = 0.0, threads: int = 1, dtype: Any = np.float32) -> pv.World:
    """A grid of pinned discs, more than are copied in every frame, and some that fall among the first of them."""
    side = int(np.sqrt(KNOWN_FROM)) + 3
    law, room = pv.Collisions(friction=friction), pv.Box((-1, -1), (side, side))
    world = pv.World(boundary=room, collisions=law, threads=threads, dtype=dtype)
    world.add(position=grid(side, side, 1.0, (0, 0), loose=0), radius=0.2, mass=np.inf)
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
    one, two, other = (pegs(friction=friction, threads=threads, dtype=dtype) for threads in (1, 2, 1))
    for frame in range(25):
        for world in (one, two, other):
            meddle(world, frame)
            world.step(DT)
        other.restore(other.save())  # which knows of nothing that it is still
        assert one.state_hash() == two.state_hash() == other.state_hash()
    assert one.position[200] != pytest.approx(two.position[201], abs=0.01)
    still = one._frames.held.still()
    assert 0 < np.count_nonzero(still) < len(still)


def bed(sleepers: int, actors: Sequence[pv.Actor] = ()) -> pv.World:
    """So many discs asleep on a floor, and a hundred that bounce beyond a wall without meeting each other."""
    room = pv.Box((-50, 0), (sleepers + 1, 50), restitution=1.0)
    world = pv.World(boundary=room, sleep=True, threads=1, dtype=np.float64)
    world.actors.extend(actors)
    world.obstacles.append(pv.Segment((0, 0), (0, 50)))
    if sleepers:
        world.add(position=np.column_stack((0.5 + np.arange(sleepers), np.full(sleepers, 0.4))), radius=0.4)
        while not world.asleep.all():
            world.step(DT)
    world.add(position=np.column_stack((-0.4 * np.arange(2, 102), np.full(100, 1.0))), radius=0.1, restitution=1.0)
    for _ in range(10):
        world.step(DT)
    return world


class Idle(pv.Actor):
    """Does nothing; worlds with actors have no frames of the core alone."""

    def act(self, world: pv.World, dt: float) -> None: ...


@pytest.mark.parametrize(("sleepers", "actors", "times"), [(20_000, [Idle()], 3), (800, [], 8)])
def test_sleepers_cost_little_beside_those_that_are_awake(sleepers: int, actors: list[pv.Actor], times: float) -> None:
    # 20,000 asleep take 1.2 times as long as the hundred alone, and all awake 50 times, where frames are not made in the core
    # alone; in the core the hundred take a tenth of that, and with 800 asleep a quarter: a ratio of processor times, in turn.
    worlds = bed(0, actors), bed(sleepers, actors)
    spent = np.empty((60, 2))
    for row in spent:
        for k, world in enumerate(worlds):
            start = process_time()
            world.step(DT)
            row[k] = process_time() - start
    assert worlds[1].asleep.sum() == sleepers
    alone, among = np.quantile(spent, 0.25, axis=0)
    assert among < times * alone


def test_who_has_flown_away_costs_a_tree_and_a_fluid_nothing() -> None:
    # All others were at one place of the curve, or in one cell, and each pair of them was looked at: 11 and 13 times as long.
    place = 0.1 * np.column_stack(np.divmod(np.arange(3000), 60)) + np.random.default_rng(1).uniform(-0.03, 0.03, (3000, 2))
    worlds = []
    for far in (1.0, 1e6):
        there = place.copy()
        there[-200:, 1] -= far * np.arange(200) / 20
        for force in (pv.Gravitation(strength=1e-3, softening=0.05), pv.Fluid(rest_density=1e3, stiffness=1e2)):
            world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=None, threads=1, dtype=np.float64)
            world.add(position=there, radius=0.05, mass=10.0)
            world.forces.append(force)
            worlds.append(world)
    tree, fluid, tree_far, fluid_far = exclusive(*(partial(world.step, DT) for world in worlds), turns=7)
    assert tree_far < 4 * tree
    assert fluid_far < 4 * fluid


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
    world.add(position=grid(100, 90, 0.25, (-49, 3), loose=0), radius=0.1)  # in other memory
    assert not np.shares_memory(short, world.position)
    short[800, 1] += 0.1
    world.step(DT)
    assert world.asleep[800]
