"""Rays, moving circles and areas: against all things one by one, where distances are found by another way, and closed forms."""

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import Thing, thing_of

import pyverlet as pv
from pyverlet.state import neighbours

LOW, HIGH = np.array((-12.0, -9.0)), np.array((12.0, 9.0))
ROOMS: dict[str, Callable[[], pv.Boundary]] = {
    "open": pv.Open,
    "box": lambda: pv.Box(tuple(LOW), tuple(HIGH)),
    "cage": lambda: pv.Circle(center=(1.0, -0.5), radius=14.0),
    "naive": lambda: pv.ClampAndFlip(pv.Box(tuple(LOW), tuple(HIGH))),
    "xy": lambda: pv.Periodic(tuple(LOW), tuple(HIGH)),
    "x": lambda: pv.Periodic(tuple(LOW), tuple(HIGH), axes="x"),
    "y": lambda: pv.Periodic(tuple(LOW), tuple(HIGH), axes="y"),
}
NEAR = 1e-7
"""m. A distance s along a ray is off by b e / sqrt(r^2 - b^2) if it passes the centre at b, off by e = 1e-14 m here; of some 10^6
random ones the closest to a tangent has a root of about r / 1000."""


def world_of(room: str, dtype: Any, spread: float, seed: int) -> tuple[pv.World, np.random.Generator]:
    """Particles whose radii differ by a factor, and obstacles of every shape, rotated, rounded, and some that have moved."""
    rng = np.random.default_rng(seed)
    world = pv.World(boundary=ROOMS[room](), dtype=dtype, gravity=(0, 0))
    where = rng.uniform(0.6 * LOW, 0.6 * HIGH, (60, 2))
    radius = 1.0 / spread ** rng.uniform(0, 1, 60)
    bits: dict[str, Any] = {"category": rng.integers(1, 8, 60), "mask": rng.integers(0, 8, 60)}
    world.add(position=where, radius=radius, mass=np.inf, on_overlap="push", **bits)
    for k in range(15):
        at, turn = rng.uniform(0.8 * LOW, 0.8 * HIGH), rng.uniform(0, 6)
        corners = at + rng.uniform(0.3, 1.5) * np.column_stack((np.cos(turn + np.arange(5)), np.sin(turn + np.arange(5))))
        shape: pv.Obstacle = (
            pv.Segment(tuple(at), tuple(at + rng.normal(0, 1, 2))),
            pv.Chain(corners, radius=0.1 * (k % 2), closed=k > 6),
            pv.Capsule(tuple(at), tuple(corners[0]), radius=0.3),
            pv.Disc(tuple(at), rng.uniform(0.1, 0.8)),
            pv.Polygon(corners, radius=0.2 * (k % 2)),
        )[k % 5]
        shape.angle = turn
        if k % 3 == 0:
            shape.velocity, shape.angular_velocity = tuple(rng.normal(0, 3, 2)), 2.0
        world.obstacles.append(shape)
    world.run(seconds=0.1)
    return world, rng


def way_to(thing: Thing, start: Any, heading: Any, size: Any) -> Any:
    """(q,) m: of all places where the centre may touch a side or an end, the first at which it touches the whole."""
    tries, out = [], np.full(len(start), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for a, b in zip(thing.a, thing.b, strict=True):
            normal = np.array((a[1] - b[1], b[0] - a[0])) / max(np.hypot(*(b - a)), 1e-300)
            tries += [(sign * (thing.radius + size) - (start - a) @ normal) / (heading @ normal) for sign in (-1, 1)]
            for end in (a, b):
                along = ((end - start) * heading).sum(axis=1)
                root = (thing.radius + size) ** 2 - (((end - start) ** 2).sum(axis=1) - along**2)
                tries.append(along - np.sqrt(root))
        for each in tries:
            there = start + np.where(np.isfinite(each), each, 0)[:, None] * heading
            good = (each >= 0) & (np.abs(thing.gap(there) - size) < 1e-9)
            out = np.where(good & (each < out), each, out)
    return np.where(thing.gap(start) <= size, 0.0, out)


def all_things(world: pv.World) -> list[tuple[str, int, int, int, list[Thing]]]:
    """Kind, index, category, mask and images, up to one room away, of each."""
    shifts = world.boundary.periodic.images() if world.boundary.periodic else np.zeros((1, 2))
    found = [
        ("particle", i, int(world.category[i]), int(world.mask[i]), Thing(x[None], x[None], float(world.radius[i])))
        for i, x in enumerate(world.position.astype(float))
    ]
    found += [("obstacle", k, *kinds(each), thing_of(each)) for k, each in enumerate(world.obstacles)]
    return [(kind, index, own, mask, [thing.image(s) for s in shifts]) for kind, index, own, mask, thing in found]


def kinds(thing: Any) -> tuple[int, int]:
    return getattr(thing, "category", 1), getattr(thing, "mask", 0xFFFFFFFF)


def walls_of(world: pv.World, start: Any, heading: Any, size: Any) -> Any:
    """(q, w) m to each wall: half planes, or the outside of a circle."""
    room = getattr(world.boundary, "room", world.boundary)
    if isinstance(room, pv.Circle):
        o, r = start - room.center, room.radius - size
        b, left = (o * heading).sum(axis=1), r**2 - (o**2).sum(axis=1)
        return np.where(left > 0, -b + np.sqrt(np.maximum(b**2 + left, 0)), 0.0)[:, None]
    facing = room.facing(start)
    if facing is None:
        return np.full((len(start), 1), np.inf)
    gap, normal = facing
    closing = -(normal * heading[:, None]).sum(axis=2)
    gap = gap - np.broadcast_to(size, len(start))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(gap <= 0, 0.0, np.where((closing > 0) & np.isfinite(gap), gap / closing, np.inf))


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize(
    ("dtype", "spread", "moving", "filtered"),
    [(np.float32, 1.0, False, False), (np.float64, 50.0, True, True), (np.float64, 3.0, True, False)],
)
def test_first_hits_are_those_of_brute_force(room: str, dtype: Any, spread: float, moving: bool, filtered: bool) -> None:
    world, rng = world_of(room, dtype, spread, seed=len(room) + int(spread))
    count = 150
    start, angle = rng.uniform(LOW, HIGH, (count, 2)), rng.uniform(0, 2 * np.pi, count)
    if room == "open":  # from outside of all grids
        start = np.where(rng.random((count, 1)) < 0.5, 1.4 * start, start)
    start[:15] = world.position[:15] + 0.3 * world.radius[:15, None] * rng.normal(0, 1, (15, 2))
    heading = np.column_stack((np.cos(angle), np.sin(angle)))
    size = rng.uniform(0.0, 1.2, count) if moving else np.zeros(count)
    category, mask = (rng.integers(1, 8, (2, count)) if filtered else np.full((2, count), 7)).astype(np.uint32)
    length = np.where(rng.random(count) < 0.5, 8.0, 5.0)
    if filtered:
        world.boundary.category, world.boundary.mask = 2, 5  # type: ignore[attr-defined]
        for k, each in enumerate(world.obstacles):
            each.category, each.mask = 1 + k % 7, 1 + (k * 3) % 7
    found = world.circle_cast(start, heading, size, length, category=category, mask=mask)
    if not moving:
        again = world.ray(start, heading, length, category=category, mask=mask)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(again, found, strict=True))

    inside, things = world.boundary.periodic.wrapped(start), all_things(world)
    ways = [np.min([way_to(part, inside, heading, size) for part in parts], axis=0) for *_, parts in things]
    ways += list(walls_of(world, inside, heading, size).T)
    about = [each[:4] for each in things] + [("wall", k, *kinds(world.boundary)) for k in range(len(ways) - len(things))]
    far = np.column_stack(ways)
    own, other = np.array([each[2] for each in about], np.uint32), np.array([each[3] for each in about], np.uint32)
    far[((category[:, None] & other) == 0) | ((own & mask[:, None]) == 0)] = np.inf
    far[far > length[:, None]] = np.inf
    best = far.min(axis=1)
    assert found.distance == pytest.approx(best, abs=NEAR)
    assert np.isfinite(best).sum() > (10 if filtered else 50)
    fields = {"particle": found.particle, "obstacle": found.obstacle, "wall": found.wall}
    for q in range(count):
        named = [k for k, (kind, index, *_) in enumerate(about) if fields[kind][q] == index]
        assert len(named) == np.isfinite(best[q])
        if not named:
            assert (found.normal[q] == 0).all()
            assert np.isnan(found.position[q]).all()
            continue
        assert far[q, named[0]] == pytest.approx(best[q], abs=NEAR)
        assert np.hypot(*found.normal[q]) == pytest.approx(1.0)
        if best[q] == 0 and size[q] > 0:
            continue
        # The point is on the rim of the thing, and from there the normal leads straight away from it.
        place, step = found.position[q], 1e-5 * found.normal[q]
        moved = world.boundary.periodic.nearest(inside[q] + best[q] * heading[q] - size[q] * found.normal[q] - place)
        assert moved == pytest.approx(np.zeros(2), abs=NEAR)
        if best[q] > 0 and about[named[0]][0] != "wall":
            parts = things[named[0]][4]
            gap = [min(part.gap(at[None])[0] for part in parts) for at in (place, place + step)]
            assert gap == pytest.approx([0.0, 1e-5], abs=10 * NEAR)


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize(("dtype", "spread"), [(np.float32, 1.0), (np.float64, 50.0)])
def test_areas_and_free_places_are_those_of_brute_force(room: str, dtype: Any, spread: float) -> None:
    world, rng = world_of(room, dtype, spread, seed=3)
    center, size, mask = rng.uniform(LOW, HIGH, (200, 2)), rng.uniform(0.0, 1.5, 200), 5
    found = world.overlap_area(center, size, mask=mask)
    things = all_things(world)
    gap = np.column_stack([np.min([part.gap(center) for part in parts], axis=0) for *_, parts in things]) - size[:, None]
    seen = np.array([(each[2] & mask) != 0 and each[3] != 0 for each in things])
    count = len(world)
    assert found.particle.tolist() == np.argwhere((gap[:, :count] <= 0) & seen[:count]).tolist()
    assert found.obstacle.tolist() == np.argwhere((gap[:, count:] <= 0) & seen[count:]).tolist()
    walls = walls_of(world, center, np.tile((1.0, 0.0), (200, 1)), size) == 0
    assert found.wall.tolist() == np.argwhere(walls).tolist()
    touched = ((gap <= 0) & seen).any(axis=1) | walls.any(axis=1)
    assert world.is_free(center, size, mask=mask).tolist() == (~touched).tolist()
    assert 20 < touched.sum() < 190
    one = world.overlap_area(center[4], 1.5, mask=mask)
    many = world.overlap_area(center, 1.5, mask=mask)
    for alone, rows in zip(one, many, strict=True):
        assert alone.tolist() == rows[rows[:, 0] == 4, 1].tolist()


def test_few_rays_and_any_number_of_threads_give_the_same_bits() -> None:
    world, rng = world_of("box", np.float32, 10.0, seed=1)
    start, heading = rng.uniform(LOW, HIGH, (3000, 2)), rng.normal(0, 1, (3000, 2))
    many = world.ray(start, heading)
    for k in range(0, 3000, 100):
        one = world.ray(start[k], heading[k])
        assert all(np.array_equal(a[0], b[k], equal_nan=True) for a, b in zip(one, many, strict=True))
    for threads in (1, 2):
        world._threads = threads
        again = world.ray(start, heading)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(again, many, strict=True))


def test_what_questions_remember_stays_out_of_copies() -> None:
    world, rng = world_of("box", np.float32, 1.0, seed=1)
    before = len(pickle.dumps(world))
    world.ray(rng.uniform(LOW, HIGH, (100, 2)), (1, 0))
    world.nearest(rng.uniform(LOW, HIGH, (100, 2)))
    assert len(pickle.dumps(world)) == before


def hit(world: pv.World, *ray: Any, **options: Any) -> list[Any]:
    """What the only ray hits: particle, obstacle, wall, distance, normal and position."""
    found = world.ray(*ray, **options)
    return [int(found.particle[0]), int(found.obstacle[0]), int(found.wall[0]), *map(float, found.distance),
            *found.normal[0].round(12).tolist(), *found.position[0].round(12).tolist()]  # fmt: skip


def test_a_ray_hits_the_nearest_of_all_kinds() -> None:
    world = pv.World(boundary=pv.Box((-10, -5), (10, 5)), dtype=np.float64)
    world.add(position=(4, 0), radius=1.0)
    post = world.obstacles.append(pv.Capsule((-4, -1), (-4, 1), radius=0.5))
    assert hit(world, (0, 0), (2, 0)) == [0, -1, -1, 3.0, -1, 0, 3, 0]
    assert hit(world, (0, 0), (-1, 0)) == [-1, 0, -1, 3.5, 1, 0, -3.5, 0]
    assert hit(world, (0, 0), (0, -1)) == [-1, -1, 2, 5.0, 0, 1, 0, -5]
    assert [hit(world, (0, 4.9), way)[2] for way in ((-1, 0), (1, 0), (0, 1))] == [0, 1, 3]
    assert hit(world, (0, 0), (2, 0), particles=False) == [-1, -1, 1, 10.0, -1, 0, 10, 0]
    assert hit(world, (0, 0), (-1, 0), obstacles=False)[2:4] == [0, 10.0]
    assert world.ray((0, 0), (0, 1), walls=False).distance[0] == np.inf
    post.pivot = (-5, 0)  # where it is now
    assert hit(world, (0, 0), (-1, 0))[3] == 4.5


def test_a_circle_stops_where_it_touches() -> None:
    world = pv.World(boundary=pv.Box((-10, -5), (10, 5)), dtype=np.float64)
    world.add(position=(4, 0), radius=1.0)
    world.obstacles.append(pv.Polygon([(-6, -1), (-4, -1), (-4, 1), (-6, 1)]))
    found = world.circle_cast([(0, 0), (0, 0), (0, 0), (0, 1.5)], [(1, 0), (-1, 0), (0, 1), (-1, 0)], 1.0)
    # The last one passes the corner (-4, 1) at a height of 1/2: its centre stops sqrt(3/4) m before it.
    stop = 4 - np.sqrt(0.75)
    assert found.distance == pytest.approx([2, 3, 4, stop])
    assert found.position == pytest.approx(np.array([(3, 0), (-4, 0), (0, 5), (-4, 1)]))
    assert found.normal[3] == pytest.approx([np.sqrt(0.75), 0.5])


def test_from_inside_the_distance_is_0() -> None:
    world = pv.World(boundary=pv.Circle(radius=10), dtype=np.float64)
    world.add(position=(3, 0), radius=1.0)
    world.obstacles.append(pv.Polygon([(-8, -2), (-2, -2), (-2, 2), (-8, 2)]))
    assert hit(world, (3.5, 0), (0, 1)) == [0, -1, -1, 0.0, 1, 0, 3.5, 0]
    assert hit(world, (3.0, 0), (0, 1))[4:6] == [0, -1]  # from the very centre: against the ray
    assert hit(world, (-3, 0), (-1, 0)) == [-1, 0, -1, 0.0, 1, 0, -3, 0]
    assert hit(world, (-5, 1), (1, 0))[4:6] == [0, 1]
    assert hit(world, (0, -11), (0, 1)) == [-1, -1, 0, 0.0, 0, 1, 0, -11]
    assert hit(world, (0, 0), (0, -1)) == [-1, -1, 0, 10.0, 0, 1, 0, -10]


@pytest.mark.parametrize("closed", [False, True])
def test_no_ray_slips_through_a_joint(closed: bool) -> None:
    rng = np.random.default_rng(5)
    world = pv.World(dtype=np.float64)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    corners = np.array((3.3, -1.7)) + 7.1 * np.column_stack((np.cos(angle), np.sin(angle)))
    world.obstacles.append(pv.Chain(corners, closed=closed))
    aim = corners[rng.integers(1, 39, 2000)]
    start = np.array((3.3, -1.7)) + rng.uniform(-3, 3, (2000, 2))
    found = world.ray(start, aim - start)
    assert found.distance == pytest.approx(np.hypot(*(aim - start).T), rel=1e-9)
    assert ((found.normal * (aim - start)).sum(axis=1) < 0).all()


def test_rays_follow_what_moves_and_grows() -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    world.add(position=[(5, 0), (0, 9)], radius=1.0, velocity=[(1, 0), (0, 0)])
    world.obstacles.append(pv.Disc((-5, 0), 1.0, velocity=(-2, 0)))
    way = [(1, 0), (-1, 0)] * 10  # more than a few
    assert world.ray((0, 0), way).distance[:2] == pytest.approx([4, 4])
    world.run(seconds=1)
    assert world.ray((0, 0), way).distance[:2] == pytest.approx([5, 6])
    world.radius[0] = 2.0
    assert world.ray((0, 0), way).distance[:2] == pytest.approx([4, 6])
    assert world.circle_cast((0, 0), way, 0.5).distance[:2] == pytest.approx([3.5, 5.5])
    saved = world.save()
    world.position[0] = (20, 0)
    assert world.ray((0, 0), way).distance[:2] == pytest.approx([18, 6])
    world.add(position=np.tile((0.0, 30.0), (50, 1)), on_overlap="push")  # arrays are others
    world.restore(saved)
    assert world.ray((0, 0), way).distance[:2] == pytest.approx([4, 6])
    for radius in np.linspace(0.1, 0.9, 20):  # more than are remembered
        assert world.circle_cast((0, 0), way, radius).distance[0] == pytest.approx(4 - radius)
    assert len(world.ray(np.zeros((0, 2)), (1, 0)).position) == 0
    world.obstacles.clear()
    world.remove([0, 1])
    assert np.isinf(world.ray((0, 0), way).distance).all()


def test_rays_far_from_sparse_obstacles_cost_no_more_than_looking_at_each() -> None:
    """Walking over 10^8 cells would take seconds."""
    world = pv.World(dtype=np.float64)
    for k in range(40):
        world.obstacles.append(pv.Disc((1e8 * k, 1e7), 0.5))
    found = world.ray((-1e7, 1e7), [(1, 0), (0, 1)] * 500)
    assert found.distance[:2].tolist() == [1e7 - 0.5, np.inf]


def test_rays_from_outside_of_the_grid_enter_its_first_cell() -> None:
    """Rounding puts some of them beside it; whatever cells there are, each ray aims at a disc, and nothing is before that."""
    rng = np.random.default_rng(7)
    for _ in range(30):
        world = pv.World(dtype=np.float64)
        place = rng.uniform(0, 10, (60, 2))
        world.add(position=place, radius=rng.uniform(0.01, 0.3, 60), on_overlap="push")
        start = 5 + 10 * rng.uniform(1, 2) * (angle := rng.normal(0, 1, (200, 2))) / np.hypot(*angle.T)[:, None]
        aim = place[rng.integers(0, 60, 200)] - start
        far = np.hypot(*aim.T)
        along = ((place - start[:, None]) * (aim / far[:, None])[:, None]).sum(axis=2)
        root = world.radius**2 - (((place - start[:, None]) ** 2).sum(axis=2) - along**2)
        best = np.where(root >= 0, along - np.sqrt(np.maximum(root, 0)), np.inf).min(axis=1)
        assert world.ray(start, aim).distance == pytest.approx(best, abs=NEAR)


@pytest.mark.parametrize("away", [1e9, 1e13, 1e18, 1e100])
def test_rays_from_far_away_come_to_an_end(away: float) -> None:
    """Where a cell is less than a bit of the distance, no step would lead into the next one."""
    world = pv.World(dtype=np.float64)
    world.add(position=np.column_stack((np.arange(20.0), np.zeros(20))), radius=0.1)
    world.obstacles.extend(pv.Disc((k, 0), 0.1) for k in range(300))
    found = world.ray((-away, 0), [(1, 0), (1, 1e-300), (-1, 0), (0, 1)] * 5)
    assert found.distance[:4] == pytest.approx([away, away, np.inf, np.inf], rel=1e-9)


def test_a_crowd_of_large_discs_is_listed_in_larger_cells() -> None:
    world = pv.World(dtype=np.float64)
    rng = np.random.default_rng(0)
    world.add(position=rng.uniform(0, 1, (200, 2)), radius=50.0, on_overlap="push")
    *_, columns, rows, _, member = neighbours.cells_of(world.position, few=False, radius=world.radius)
    assert len(member) <= neighbours.LISTED * 4 * 200
    assert columns * rows < 200
    found = world.ray((-100, 0.5), np.tile((1.0, 0.0), (20, 1)))
    offset = world.position - (-100, 0.5)
    assert found.distance[0] == pytest.approx((offset[:, 0] - np.sqrt(50.0**2 - offset[:, 1] ** 2)).min())


def test_without_a_radius_only_the_room_and_obstacles_count() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
    world.add(position=(5, 5), radius=1.0)
    world.obstacles.append(pv.Disc((2, 2), 1.0))
    places = [(5, 5), (2, 2), (8, 8), (11, 5)]
    assert world.is_free(places).tolist() == [True, False, True, False]
    assert world.is_free(places, 0.0).tolist() == [False, False, True, False]
    assert world.is_free((8, 8), [1.5, 2.5]).tolist() == [True, False]
