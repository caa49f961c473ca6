"""Contacts that begin and end, and hits, as arrays."""

import copy
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import worlds

import pyverlet as pv

METHODS: list[Any] = [pv.Fast(), pv.BruteForce()]


def touching(world: pv.World) -> set[tuple[int, int]]:
    """Pairs that overlap, by brute force."""
    distance = np.hypot(*(world.position[:, None] - world.position[None]).transpose(2, 0, 1))
    i, j = np.nonzero(np.triu(distance < world.radius[:, None] + world.radius[None], 1))
    return set(zip(i.tolist(), j.tolist(), strict=True))


def news(world: pv.World, frames: int, *names: str) -> list[Any]:
    """All that begins, and all that ends, or what else is named."""
    told = []
    for _ in range(frames):
        world.step(1 / 60)
        told.append([getattr(world.events, name) for name in names or ("begin", "end")])
    return [np.concatenate(records) for records in zip(*told, strict=True)]


def follow(world: pv.World, frames: int) -> list[tuple[str, int, int]]:
    """What begins and ends, frame by frame."""
    told = []
    for _ in range(frames):
        world.step(1 / 60)
        told += [(name, a, b) for name in ("begin", "end") for a, b in getattr(world.events, name)[["a", "b"]].tolist()]
    return told


@pytest.mark.parametrize(
    ("which", "ended"),
    [
        ([0], [(-1, 0)]), ([1], [(0, -1), (-1, 1)]), ([2], [(1, -1)]), ([0, 1], [(-1, -1), (-1, 0)]),
        ([0, 1, 2], [(-1, -1)] * 2),
    ],
)  # fmt: skip
@pytest.mark.parametrize("room", [pv.Open(), pv.Circle(center=(1, 0), radius=30)])
def test_removal_ends_contacts(which: list[int], ended: list[tuple[int, int]], room: pv.Boundary) -> None:
    # Three in a row touch; some are removed: one end for each of their contacts, in the next frame, with -1 for the removed,
    # whose numbers are told. A world of one or none looks at no pairs, and those of the frame before are about others.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(), boundary=room, events=True)
    world.add(position=(9, 9))
    group = world.add(position=[(0, 0), (0.999, 0), (1.998, 0)], radius=0.5)
    world.remove(0)
    world.step(1 / 60)
    assert world.events.begin[["a", "b"]].tolist() == [(0, 1), (1, 2)]
    world.position[:, 0] = (0, 0.999, 1.998)  # touching still
    group.remove(which)
    world.step(1 / 60)
    assert len(world.events.begin) == 0
    assert sorted(world.events.end[["a", "b"]].tolist()) == sorted(ended)
    expected = [numbers for numbers in ([1, 2], [2, 3]) if {number - 1 for number in numbers} & set(which)]
    assert sorted(world.events.end["number"].tolist()) == expected
    world.step(1 / 60)
    assert (world.events.end["a"] >= 0).all()


ROOMS: dict[str, Any] = {"open": pv.Open(), "periodic": pv.Periodic((-5, -20), (25, 20)), "cage": pv.Circle(radius=40)}


def collided(room: str, what: str) -> tuple[pv.World, Any]:
    """Four pairs and a disc at a post, and one by itself, with numbers from 1 on; and what the last frame has recorded."""
    world = pv.World(gravity=(0, 0), boundary=ROOMS[room], events=True, contacts=True)
    world.obstacles.append(pv.Segment((-3, 3), (-1, 3)))
    world.add(position=(0, 12))
    places = [(5.0 * k + dx, -4.0) for k in range(4) for dx in (0, 0.98)]
    world.add(position=[*places, (-2, 2.51)], velocity=[(2, 0), (-2, 0)] * 4 + [(0, 2)], mass=np.arange(1, 10))
    world.add(position=(0, 0), mass=10)
    world.remove(0)
    world.step(1 / 60)
    assert len(world.events.hit) == len(world.contacts) == 5
    if what == "end":
        world.position[1:8:2, 1] = 4
        world.position[8, 1] = 0
        world.step(1 / 60)
    return world, world.contacts if what == "contacts" else getattr(world.events, what)


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("what", ["begin", "hit", "contacts", "end"])
def test_records_stay_valid_while_a_loop_removes_particles(room: str, what: str) -> None:
    # Of each the first is removed, in a loop over records of the last frame; numbers, in a copy of them too, outlive that.
    world, records = collided(room, what)
    assert len(records) == 5
    kept, copied, numbers = list(records), copy.copy(records), [[1, 2], [3, 4], [5, 6], [7, 8], [9, -1]]
    for k, record in enumerate(records):
        if k == 1:
            world.add(position=(0, 8), mass=11)
        world.remove(int(record["a"]))
    assert world.mass.tolist() == [2, 4, 6, 8, 10, 11]
    assert records[["a", "b"]].tolist() == [(-1, 0), (-1, 1), (-1, 2), (-1, 3), (-1, -1)]
    assert [int(record["b"]) for record in kept] == [0, 1, 2, 3, -1]
    for those in (records, copied):
        assert those["number"].tolist() == numbers
        assert world.index_of(those["number"]).tolist() == [[-1, 0], [-1, 1], [-1, 2], [-1, 3], [-1, -1]]
        assert world.group_of(those["number"]).tolist() == [[1, 1]] * 4 + [[1, -1]]
    world.remove([int(kept[1]["b"]), int(kept[3]["b"])])
    assert records["b"].tolist() == [0, -1, 1, -1, -1]
    assert len(world.contacts) == 0  # of those that are left none has touched another
    worlds.refused("which has -1; allowed are whole numbers from 0 to 3", world.remove, int(kept[0]["a"]))
    world.step(1 / 60)
    assert len(world.events.end) == (0 if what == "end" else 5)


@pytest.mark.parametrize("way", worlds.WAYS)
def test_numbers_in_records_are_kept(way: str, tmp_path: Path) -> None:
    world, begun = collided("open", "begin")
    world.remove(world.index_of(begun["number"][0, 0]))
    again = worlds.WAYS[way](world, tmp_path)
    for name in ("begin", "hit", "end"):
        assert getattr(again.events, name).tobytes() == getattr(world.events, name).tobytes()


def test_saved_records_are_those_of_then() -> None:
    world = pv.World(gravity=(0, 0), events=True)
    world.add(position=[(0, 0), (0.99, 0), (5, 0), (5.99, 0)], velocity=[(2, 0), (-2, 0)] * 2)
    world.step(1 / 60)
    saved, told = world.save(), world.events.begin[["a", "b"]].tolist()
    world.remove([0, 3])
    world.restore(saved)
    assert world.events.begin[["a", "b"]].tolist() == told == [(0, 1), (2, 3)]


@pytest.mark.parametrize("method", METHODS)
def test_a_bounce_begins_hits_and_ends(method: Any) -> None:
    # Approach at 3 m/s along the normal: the speed of the hit, to rounding.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=method), dtype=np.float64, events=True)
    world.add(position=[(2, 0), (-2, 0)], velocity=[(-1, 0), (2, 0)])
    hits, told = [], []
    for _ in range(90):
        world.step(1 / 60)
        hits += world.events.hit.tolist()
        told += [name for name in ("begin", "end") if len(getattr(world.events, name))]
    assert told == ["begin", "end"]
    assert [hit[:3] for hit in hits] == [(0, 1, pytest.approx(3.0, rel=1e-12))]


@pytest.mark.parametrize("substeps", [1, 8, 32])
@pytest.mark.parametrize("mass", [0.1, 1.0, 10.0])
def test_the_speed_of_a_hit_is_that_at_which_they_came(substeps: int, mass: float) -> None:
    # At 7 m/s onto one that lies on the floor, with e = 0: what the floor holds takes more of an impulse, and met no faster.
    world = pv.World(gravity=(0, 0), boundary=pv.Box((-5, 0), (5, 9)), events=True, dtype=np.float64, substeps=substeps)
    world.add(position=[(0, 0.5), (0, 4)], velocity=[(0, 0), (0, -7)], mass=[1.0, mass])
    begun = news(world, 40, "begin")[0]
    assert begun["speed"][begun["b"] == 1][0] == pytest.approx(7, rel=1e-9)
    assert begun["speed"].max() < 7.001


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.2])
def test_in_a_row_each_is_hit_by_what_has_been_hit(gap: float) -> None:
    # With e = 0 k of one mass go on at v / k: so fast the next is met, unless its turn has come while they still slowed down.
    world = pv.World(gravity=(0, 0), events=True, dtype=np.float64)
    world.add(position=[(k * (1 + gap), 0) for k in range(4)] + [(-3, 0)], velocity=[(0, 0)] * 4 + [(7, 0)])
    begun = news(world, 60, "begin")[0]
    speed = {(int(hit["a"]), int(hit["b"])): float(hit["speed"]) for hit in begun}
    expected = {(0, 4): 7.0, (0, 1): 3.5, (1, 2): 7 / 3, (2, 3): 1.75}
    assert speed.keys() == expected.keys()
    for pair, most in expected.items():
        assert speed[pair] <= most * 1.01
        assert speed[pair] == pytest.approx(most, rel=1e-3 if pair == (0, 4) else 0.02 if gap > 0.1 else 0.4)


def test_two_that_are_met_at_once_are_met_at_one_speed() -> None:
    # 7 m/s between two at rest, 30 degrees to either side.
    for e in (0.0, 1.0):
        world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=e), events=True, dtype=np.float64)
        world.add(position=[(0, 0.5), (0, -0.5), (-4, 0)], velocity=[(0, 0), (0, 0), (7, 0)], radius=0.499)
        begun = news(world, 40, "begin")[0]
        assert begun["speed"][begun["b"] == 2] == pytest.approx([7 * np.cos(np.arcsin(0.5 / 0.998))] * 2, rel=0.01)


def test_slow_contacts_are_no_hits() -> None:
    world = pv.World(gravity=(0, 0), events=True)
    world.add(position=[(1, 0), (-1, 0)], velocity=[(-0.4, 0), (0.4, 0)])
    begun, hits = news(world, 120, "begin", "hit")
    assert len(begun) > 0
    assert len(hits) == 0
    world.events.hit_speed = 0.5
    world.position[:] = [(1, 0), (-1, 0)]
    world.velocity[:] = [(-0.4, 0), (0.4, 0)]
    assert len(news(world, 120, "hit")[0]) == 1


def test_what_a_wall_pushes_along_begins_to_touch_it_once() -> None:
    # Without gravity and restitution nothing presses it to the wall once it is as fast: it stays where the wall is, to rounding.
    world = pv.World(gravity=(0, 0), events=True, dtype=np.float64)
    world.obstacles.append(pv.Segment((-2.5, -5), (0.5, 5), velocity=(0.1, 0)))
    world.add(position=(0.5, 0.2), radius=0.3)
    begun = ended = 0
    for _ in range(1200):
        world.step(1 / 60)
        begun, ended = begun + len(world.events.begin), ended + len(world.events.end)
    assert (begun, ended) == (1, 0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_begun_and_not_ended_are_those_that_touch(method: Any, restitution: float) -> None:
    # Counted up, begins and ends say who touches; through rebuilds, reordering, and particles that come and go.
    rng = np.random.default_rng(0)
    world = pv.World(
        boundary=pv.Circle(radius=12), collisions=pv.Collisions(restitution=restitution, method=method), events=True, substeps=1
    )
    world.add(position=rng.uniform(-8, 8, (120, 2)), velocity=rng.normal(0, 4, (120, 2)), radius=rng.uniform(0.2, 0.6, 120))
    alive: set[tuple[int, int]] = set()
    for frame in range(240):
        if frame == 100:
            world.remove([3, 50])
            left = {(a - (a > 3) - (a > 50), b if b < 0 else b - (b > 3) - (b > 50)) for a, b in alive if not {a, b} & {3, 50}}
            removed, alive = len(alive) - len(left), left
            world.add(position=(0, 11), radius=0.4)
        world.step(1 / 60)
        told = (world.events.begin[["a", "b"]], world.events.end[["a", "b"]])
        begun, ended = (Counter((int(a), int(b)) for a, b in pairs.tolist()) for pairs in told)
        if frame == 100:
            assert sum(n for pair, n in ended.items() if pair[0] < 0 or (pair[1] < 0 and not alive & {pair})) <= removed
            ended = Counter({pair: n for pair, n in ended.items() if pair in alive or pair in begun})
        for pair in begun.keys() | ended.keys():
            touches = (pair in alive) + begun[pair] - ended[pair]
            assert touches in (0, 1)
            alive = alive | {pair} if touches else alive - {pair}
        assert all(a < b or b == -1 for a, b in alive)
    # Contacts push apart and into third ones after events are noted, so at the end of the frame some others overlap: a few.
    overlapping = touching(world)
    assert len(overlapping) > 60
    assert len(overlapping & alive) > 0.8 * len(overlapping)


def test_both_methods_tell_the_same() -> None:
    told = []
    for method in METHODS:
        world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=method), dtype=np.float64, events=True)
        world.boundary = pv.Box((-6, -6), (6, 6), restitution=1)
        speed = np.random.default_rng(2).normal(0, 2, (49, 2))
        world.add(position=worlds.grid(7, 7, 1.5, (-4.5, -4.5), loose=0), velocity=speed)
        told.append(follow(world, 20))  # before a circle meets two at once, and the order of the list makes another gas of it
    assert told[0] == told[1]
    assert len(told[0]) > 50


def test_a_hit_says_where_how_and_on_what() -> None:
    # J = (1 + e) m v at walls and obstacles, (1 + e) v m1 m2 / (m1 + m2) between circles; the larger e of two counts.
    world = pv.World(
        gravity=(0, 0), boundary=pv.Box((-9, -9), (9, 9), restitution=0.5), collisions=pv.Collisions(restitution=0.25),
        events=True,
    )  # fmt: skip
    world.obstacles += [pv.Disc((5, -5), 1), pv.Segment((-5, -8), (0, -8), restitution=1.0)]
    world.add(
        position=[(8.4, 5), (0, 0), (1.1, 0), (-3, -7.4), (-8.4, 3)],
        velocity=[(6, 0), (6, 0), (0, 0), (0, -6), (-6, 0)],
        mass=[3.0, 1.0, 3.0, 2.0, 1.0],
        restitution=[0.0, 0.0, 0.75, 0.0, 0.8],
    )
    hits = sorted(news(world, 6, "hit")[0].tolist(), key=lambda hit: hit[0])
    assert [hit[:5] for hit in hits] == [
        (0, -1, pytest.approx(6), 1, -1), (1, 2, pytest.approx(6), -1, -1), (3, -1, pytest.approx(6), -1, 1),
        (4, -1, pytest.approx(6), 0, -1),
    ]  # fmt: skip
    points = np.array([(9, 5), (0.55, 0), (-3, -8), (-9, 3)])
    assert np.array([hit[5] for hit in hits]) == pytest.approx(points, abs=6 / 60)  # as of the end of the frame
    assert np.array([hit[6] for hit in hits]) == pytest.approx(np.array([(1, 0), (1, 0), (0, -1), (-1, 0)]), abs=1e-6)
    assert [hit[7] for hit in hits] == pytest.approx([1.5 * 18, 1.75 * 6 * 0.75, 2 * 12, 1.8 * 6])


def test_a_loop_over_broken_links_may_remove_particles() -> None:
    world = pv.World(gravity=(0, 0))
    group = world.add(position=[(0, 0), (2, 0), (9, 0), (11, 0)], velocity=[(-9, 0), (9, 0)] * 2, mass=[1, 2, 3, 4])
    world.links.append(pv.Stick(group, [0, 2], [1, 3], breaking_force=1.0))
    world.step(1 / 60)
    records = world.links.broken
    assert len(records) == 2
    for record in records:
        world.remove(int(record["i"]))
    assert world.mass.tolist() == [2, 4]
    assert records[["i", "j"]].tolist() == [(-1, 0), (-1, 1)]


def where(told: Any) -> list[tuple[int, int]]:
    """(wall, obstacle) of each."""
    return [(int(wall), int(obstacle)) for wall, obstacle in told[["wall", "obstacle"]].tolist()]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_each_wall_and_each_obstacle_begins_and_ends(dtype: str, restitution: float) -> None:
    # Along the floor into the side wall, or a post; on a shelf until it is removed, while others are.
    world = pv.World(boundary=pv.Box((0, 0), (10, 10), restitution=restitution), events=True, dtype=dtype)
    world.obstacles += [
        pv.Segment((3, 8), (4, 8)), pv.Segment((6, 0), (6, 3), restitution=restitution), pv.Segment((1, 5), (2, 5))
    ]  # fmt: skip
    world.add(position=[(4, 0.5), (8, 0.5), (1.5, 5.5)], velocity=[(4, 0), (4, 0), (0, 0)])
    begun, ended = news(world, 60)
    first, second, third = (where(begun[begun["a"] == k]) for k in range(3))
    assert first == [(2, -1), (-1, 1)]
    assert second == [(2, -1), (1, -1)]
    assert third == [(-1, 2)]
    assert set(where(ended)) <= {(-1, 1), (1, -1)}
    assert len(ended) == 2 or not restitution
    del world.obstacles[0]  # the shelf becomes obstacle 1
    begun, ended = news(world, 3)
    assert len(begun) == len(ended) == 0
    del world.obstacles[1]
    begun, ended = news(world, 3)
    assert begun.tolist() == []
    assert ended[["a", "b", "wall", "obstacle"]].tolist() == [(2, -1, -1, -1)]
    world.gravity = (0, 0)
    world.position[1], world.velocity[1] = (9.5, 9.45), (4, 4)
    begun, ended = news(world, 1)
    assert (3, -1) in where(begun)  # the corner: it may have been at the side wall all the time
    assert where(ended[ended["a"] == 1]) == [(2, -1)]
    world.velocity[1] = (-6, -6)
    begun, ended = news(world, 4)
    assert where(ended[ended["a"] == 1]) == [(1, -1), (3, -1)]


def test_a_cage_and_an_obstacle_in_it_are_two() -> None:
    world = pv.World(boundary=pv.Circle(radius=5), events=True)
    world.obstacles.append(pv.Segment((-3, -6), (-3, 0)))
    world.add(position=(0, -4.5), velocity=(-4, 0))
    begun, _ = news(world, 120)
    assert {(0, -1), (-1, 0)} <= set(where(begun))
    np.testing.assert_allclose(begun["normal"][begun["obstacle"] == 0][0], (-1, 0), atol=1e-6)
    assert begun["normal"][0] == pytest.approx((0, -1), abs=0.1)


PLACES: dict[str, Any] = {
    "floor": (pv.Box((-5, 0), (5, 5), restitution=1), [], []),
    "cage": (pv.Circle(center=(0, 5), radius=5, restitution=1), [], []),
    "segment": (pv.Open(), [pv.Segment((-1, 0), (1, 0), restitution=1)], []),
    "image": (pv.Periodic((-5, -5), (5, 15)), [pv.Segment((-4.9, 0), (4.9, 0), restitution=1)], []),
    "pinned": (pv.Open(), [], [(0, -0.5)]),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("height", "substeps"), [(1e-3, 8), (4e-4, 16)])
def test_every_bounce_begins(place: str, height: float, substeps: int) -> None:
    # An elastic ball falls 1 mm or 0.4 mm onto something: it bounces 35 and 55 times a second.
    room, obstacles, pinned = PLACES[place]
    world = pv.World(boundary=room, events=True, dtype=np.float64, substeps=substeps, collisions=pv.Collisions(restitution=1))
    world.obstacles += obstacles
    world.add(position=(0, 0.5 + height))
    for at in pinned:
        world.add(position=at, mass=np.inf)
    begun, ended = news(world, 120)
    expected = 2 / np.sqrt(8 * height / 9.81)
    assert len(begun) == pytest.approx(expected, abs=0.02 * expected + 2)
    assert len(begun) - len(ended) in (0, 1)
    assert np.median(begun["speed"]) == pytest.approx(np.sqrt(2 * 9.81 * height), rel=0.02)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_what_rests_begins_once(restitution: float) -> None:
    # A ball falls 1 m and bounces until it rests: as many beginnings as bounces, and then none.
    world = pv.World(boundary=pv.Box((-5, 0), (5, 5), restitution=restitution), events=True)
    world.add(position=(0, 1.5))
    news(world, 600)
    begun, ended = news(world, 60)
    assert len(begun) == len(ended) == 0


@pytest.mark.parametrize("wall", ["obstacle", "wall"])
def test_several_bounces_in_one_frame(wall: str) -> None:
    # 60 m/s between walls that leave 0.25 m: four bounces in a frame, two at each side.
    room: Any = pv.Box((0, 0), (1.25, 9), restitution=1) if wall == "wall" else pv.Open()
    world = pv.World(gravity=(0, 0), boundary=room, events=True, dtype=np.float64)
    if wall == "obstacle":
        world.obstacles += [pv.Segment((0, 0), (0, 9), restitution=1), pv.Segment((1.25, 0), (1.25, 9), restitution=1)]
    world.add(position=(0.6, 4), velocity=(60, 0))
    begun, ended = news(world, 10)
    sides = Counter(where(begun))
    assert list(sides.values()) == pytest.approx([20, 20], abs=1)
    assert len(begun) - len(ended) in (1, 2)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("place", [0.0, 3.3, 17.7])
@pytest.mark.parametrize("what", ["wall", "segment", "disc", "pinned", "free"])
def test_contacts_without_load_begin_once_and_go_on(what: str, place: float, dtype: type) -> None:
    # In nine of ten pairs rounding ended them in the frame after they began.
    room = pv.Box((place - 5, place), (place + 5, place + 9)) if what == "wall" else None
    world = pv.World(gravity=(0, 0), events=True, dtype=dtype, boundary=room)
    if what in ("segment", "disc"):
        disc = pv.Disc((place, place - 1), 1.0)
        world.obstacles.append(pv.Segment((place - 3, place), (place + 3, place)) if what == "segment" else disc)
    elif not room:
        world.add(position=(place, place - 0.5), radius=0.5, mass=np.inf if what == "pinned" else 1.0)
    ball = world.add(position=(place, place + 0.7), radius=0.5, velocity=(0, -1.7))
    begin, end = news(world, 120)
    assert (len(begin), len(end)) == (1, 0)
    ball.mask = 0
    begin, end = news(world, 2)
    assert (len(begin), len(end)) == (0, 1)


def test_a_contact_with_a_pinned_circle_goes_on_in_sleep() -> None:
    world = pv.World(events=True, sleep=True)
    world.add(position=[(0, 0), (0, 1.3)], radius=0.5, mass=[np.inf, 1.0])
    begin, end = news(world, 240)
    assert world.asleep[1]
    assert (len(begin), len(end)) == (1, 0)
