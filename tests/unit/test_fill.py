"""`pyverlet.fill`: nothing overlaps, by brute force; obstacles stay free; as much of the area is covered as was asked for."""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.worlds import Thing, thing_of

import pyverlet as pv
from pyverlet import InputError
from pyverlet.laws.links.area import signed_area
from pyverlet.world.builders.outline import inside

Floats = NDArray[np.float64]

ROOMS: dict[str, Any] = {
    "box": pv.Box((-3, 1), (4, 6)),
    "cage": pv.Circle(center=(2, -1), radius=4),
    "polygon": pv.Polygon([(0, 0), (6, 0), (3, 6)]),
    "corners": [(0, 0), (8, 0), (8, 6), (5, 6), (5, 2), (0, 2)],  # an L, which is not convex
}
AREA = {"box": 35.0, "cage": 16 * math.pi, "polygon": 18.0, "corners": 28.0}
OBSTACLES = [
    pv.Disc((2, 2), 0.8), pv.Capsule((0, 0.5), (3, 3), radius=0.2), pv.Polygon([(3, 1), (4, 1), (4, 2)]),
    pv.Segment((0, 4), (4, 4)),
]  # fmt: skip


def gaps(position: Floats, radius: Floats) -> Floats:
    """Of every pair, by brute force: the distance of the rims, m."""
    i, j = np.triu_indices(len(position), 1)
    return np.asarray(np.hypot(*(position[i] - position[j]).T) - radius[i] - radius[j])


def to_walls(where: Any, points: Floats) -> Floats:
    """How far inside each point is, m, by formulas of our own."""
    if isinstance(where, pv.Box):
        return np.asarray(np.minimum(points - where.lower, np.asarray(where.upper) - points).min(axis=1))
    if isinstance(where, pv.Circle):
        return np.asarray(where.radius - np.hypot(*(points - where.center).T))
    corners = np.asarray(where.points if isinstance(where, pv.Polygon) else where, float)
    return np.asarray(Thing(corners, np.roll(corners, -1, axis=0), 0.0).gap(points))


@pytest.mark.parametrize("radius", [0.15, (0.1, 0.3)], ids=["equal", "mixed"])
@pytest.mark.parametrize("pattern", ["hex", "square", "random"])
@pytest.mark.parametrize("name", ROOMS)
def test_nothing_overlaps(name: str, pattern: str, radius: Any) -> None:
    where = ROOMS[name]
    found = pv.fill(where, radius=radius, pattern=pattern, fraction=0.3)
    assert len(found.position) > 20
    assert gaps(*found[:2]).min() >= -1e-12
    assert (to_walls(where, found.position) - found.radius).min() > -1e-12
    low, high = radius if isinstance(radius, tuple) else (radius, radius)
    assert found.radius.min() >= low
    assert found.radius.max() <= high


@pytest.mark.parametrize("pattern", ["hex", "square", "random"])
def test_obstacles_and_circles_are_left_free(pattern: str) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (6, 6)))
    world.obstacles += OBSTACLES
    world.add(position=[(5, 5), (1, 5)], radius=[0.9, 0.4])
    found = pv.fill(world.boundary, radius=0.1, pattern=pattern, avoid=world, fraction=0.3)
    before = (world.position.astype(float), world.radius.astype(float))
    everybody = np.concatenate((found.position, before[0])), np.concatenate((found.radius, before[1]))
    assert gaps(*everybody).min() > -1e-6
    assert min(thing_of(obstacle).gap(found.position).min() for obstacle in OBSTACLES) > 0.1 - 1e-9
    world.add(position=found.position, radius=found.radius)
    assert world.overlap().max < 1e-5


@pytest.mark.parametrize(("pattern", "fraction"), [("hex", 0.6), ("square", 0.5), ("random", 0.4)])
@pytest.mark.parametrize("name", ROOMS)
def test_so_much_is_covered(name: str, pattern: str, fraction: float) -> None:
    found = pv.fill(ROOMS[name], radius=0.06, pattern=pattern, fraction=fraction)
    # The area is counted on 400 x 400 points: its rim, a few sides of a cell long, is off by less than 1 %.
    assert math.pi * (found.radius**2).sum() / AREA[name] == pytest.approx(fraction, rel=0.01)


def test_a_number_is_that_number() -> None:
    for pattern in ("hex", "square", "random"):
        assert len(pv.fill(pv.Box((0, 0), (10, 10)), radius=0.1, pattern=pattern, count=777).position) == 777


def test_densest_is_near_the_densest_there_is() -> None:
    found = pv.fill(pv.Box((0, 0), (40, 40)), radius=0.1)
    # Hexagonal: pi / sqrt(12) = 0.9069. The walls cost about one radius of each side's 40 m, and the gap 0.2 %.
    assert 0.88 < math.pi * 0.1**2 * len(found.position) / 1600 < math.pi / math.sqrt(12)
    square = pv.fill(pv.Box((0, 0), (40, 40)), radius=0.1, pattern="square")
    assert 0.76 < math.pi * 0.1**2 * len(square.position) / 1600 < math.pi / 4


def test_the_same_seed_gives_the_same() -> None:
    one, same, other = (pv.fill(pv.Box((0, 0), (5, 5)), radius=(0.1, 0.2), pattern="random", seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.position, same.position)
    assert not np.array_equal(one.position[:5], other.position[:5])


def test_a_picture_is_filled_where_it_has_ink() -> None:
    picture = np.full((40, 80, 4), 255, np.uint8)
    picture[10:30, 10:30, :3] = (200, 30, 30)
    picture[10:30, 50:70, :3] = (30, 30, 200)
    picture[:5, :, 3] = 0
    found = pv.fill(pv.Box((0, 0), (16, 8)), radius=0.1, pattern="picture", picture=picture)
    assert found.colour is not None
    # 80 pixels are 16 m: two squares of 4 m, from x = 2 and 10, y = 2 to 6.
    x, y = found.position.T
    left = x < 8
    assert ((x[left] > 2) & (x[left] < 6)).all()
    assert ((x[~left] > 10) & (x[~left] < 14)).all()
    assert ((y > 2) & (y < 6)).all()
    assert (found.colour[left] == (200, 30, 30)).all()
    assert (found.colour[~left] == (30, 30, 200)).all()
    assert gaps(*found[:2]).min() >= 0


def test_many_in_the_time_of_a_blink() -> None:
    # Of two sizes the time goes with the number: no loop over pairs. Absolute times are nobody's promise on a busy machine.
    def took(side: float, pattern: str) -> float:
        began = time.process_time()  # by the clock others on the machine would count
        pv.fill(pv.Box((0, 0), (side, side)), radius=0.1, pattern=pattern, fraction=0.4)
        return time.process_time() - began

    for pattern in ("hex", "random"):
        took(5, pattern)
        few, many = (min(took(side, pattern) for _ in range(3)) for side in (14, 42))  # 2,500 and 22,500 circles
        assert many < 9 * 4 * few


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"where": pv.Open()}, "where is"), ({"where": [(0, 0), (1, 1), (1, 0), (0, 1)]}, "crosses itself"),
        ({"radius": -1.0}, "radius is -1"), ({"radius": (0.5, 0.1)}, "radius is 0.1"),
        ({"pattern": "hexagonal"}, "pattern is 'hexagonal'"), ({"fraction": 0.95}, "find room"),
        ({"fraction": 0.6, "pattern": "random"}, "were placed at random"),
        ({"fraction": 0.4, "count": 3}, "allowed is one of them"), ({"count": 0}, "count is 0"),
        ({"radius": 1e-6}, "more than 5,000,000"), ({"pattern": "picture"}, "picture is None"),
        ({"picture": "a.png"}, "picture is 'a.png'"),
        ({"pattern": "picture", "picture": "nowhere.png"}, "does not exist"),
        ({"pattern": "picture", "picture": np.full((4, 4, 3), 255, np.uint8)}, "white or transparent"),
        ({"avoid": [3]}, "avoid[0] is 3"),
    ],
)  # fmt: skip
def test_bad_input_is_told(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said.replace("[", r"\[")) as told:
        pv.fill(**{"where": pv.Box((0, 0), (4, 4)), "radius": 0.2, **arguments})
    assert "allowed" in str(told.value) or "picture is white" in str(told.value)


# ---- Builders: chains, ropes, nets, cloths, bridges and soft bodies, as asked for and as they then behave ----


DT = 1 / 60


def lengths(link: Any, world: pv.World) -> Any:
    a, b = world.position[link.particles[:, 0]], world.position[link.particles[:, 1]]
    return np.hypot(*(b - a).T)


@pytest.mark.parametrize("build", [pv.chain, pv.rope])
def test_chains_and_ropes_run_from_end_to_end(build: Callable[..., Any]) -> None:
    world = pv.World()
    built = build(world, (1, 2), (4, 6), links=10, mass=2.2)
    assert len(built.group) == 11
    assert built.group.position[[0, -1]].tolist() == [[1, 2], [4, 6]]
    assert built.group.mass.sum() == pytest.approx(2.2)
    assert lengths(built.links[0], world) == pytest.approx(np.full(10, 0.5), rel=1e-5)
    assert world.overlap().contacts == 0
    built.group.pin(0)
    world.run(seconds=2.0)
    assert built.links[0].length == pytest.approx(np.full(10, 0.5), rel=1e-6)
    assert lengths(built.links[0], world).max() < 0.5005


def test_a_rope_may_be_slack() -> None:
    world = pv.World(collisions=None)
    built = pv.rope(world, (0, 0), (2, 0), length=3.0)
    built.group.pin([0, -1])
    world.run(seconds=1.0)
    assert lengths(built.links[0], world).sum() == pytest.approx(3.0, rel=1e-3)
    assert built.group.position[:, 1].min() < -0.8


def test_nets_and_cloths_hang_by_their_upper_edge() -> None:
    world = pv.World()
    net = pv.net(world, (0, 0), width=2, height=1.5, columns=9, rows=7)
    cloth = pv.cloth(world, (5, 0), width=2, height=1.5, columns=9, rows=7)
    for sheet in (net, cloth):
        assert sheet.grid.shape == (7, 9)
        assert len(sheet.group) == 63
        assert [len(link) for link in sheet.links[:2]] == [56, 54]
        sheet.group.pin(sheet.grid[0])
    assert len(cloth.links) == 4
    assert world.overlap().contacts == 0
    world.run(seconds=2.0)
    for sheet in (net, cloth):
        assert sheet.group.position[sheet.grid[-1], 1] == pytest.approx(np.full(9, -1.5), abs=0.05)
        assert np.hypot(*sheet.group.velocity.T).max() < 0.05


def test_a_bridge_carries_what_falls_on_it() -> None:
    world = pv.World(boundary=pv.Box((-6, -8), (6, 6)), collisions=pv.Collisions(friction=0.5))
    bridge: Any = pv.bridge(world, (-5, 0), (5, 0), mass=20.0)
    stones = world.add(position=np.column_stack((np.linspace(-2, 2, 6), np.full(6, 2.0))), radius=0.3, mass=5.0)
    world.run(seconds=4.0)
    assert stones.position[:, 1].min() > -2.5
    assert bridge.group.position[[0, -1]].tolist() == [[-5, 0], [5, 0]]
    assert lengths(bridge.links[0], world).max() < bridge.links[0].length[0] * 1.01


@pytest.mark.parametrize("filled", [False, True])
@pytest.mark.parametrize("stiffness", [None, np.inf])
def test_soft_bodies_keep_their_size_and_their_distance(filled: bool, stiffness: float | None) -> None:
    world = pv.World(boundary=pv.Box((-3, 0), (3, 6)), collisions=pv.Collisions(friction=0.2))
    triangle = np.array([(-1.0, 4.2), (1.0, 4.2), (0.0, 5.8)])
    outlines = [pv.builders.disc((0, 1.5), 1.0), pv.builders.box((-1.2, 3), (1.2, 4)), triangle]
    bodies = [pv.soft_body(world, outline, spacing=0.2, filled=filled, stiffness=stiffness) for outline in outlines]
    for outline, body in zip(outlines, bodies, strict=True):
        assert (body.group.position - body.group.radius[:, None] >= outline.min(axis=0) - 1e-5).all()
    assert world.overlap().contacts == 0
    before = [signed_area(body.group.position.astype(float)) for body in bodies]
    start = world.energy().total
    for _ in range(120):
        world.step(DT)
        assert world.energy().total < start * 1.001
    assert world.escaped() == 0
    assert world.energy().kinetic < 0.3 * start
    if not filled:
        for body, area in zip(bodies, before, strict=True):
            ring = body.group.position.astype(float)
            assert signed_area(ring) == pytest.approx(area, rel=0.25)
            for other in bodies:
                assert other is body or not inside(ring, other.group.position.astype(float)).any()


@pytest.mark.parametrize("spacing", [0.09, 0.12, 0.15, 0.19])
@pytest.mark.parametrize("turned", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("shape", ["box", "tall", "disc", "triangle", "L"])
def test_no_part_of_a_filled_soft_body_swings_freely(shape: str, turned: float, spacing: float) -> None:
    # Rows of G are the rates of the links' lengths. Only motions of the whole leave them all alone: two ways and a turn.
    corner = [(0, 0), (1, 0), (1, 0.4), (0.4, 0.4), (0.4, 1), (0, 1)]
    outlines = {"box": pv.builders.box((0, 0), (1, 0.7)), "tall": pv.builders.box((0, 0), (0.4, 1)), "L": corner}
    outlines |= {"disc": pv.builders.disc((0, 0), 0.5), "triangle": [(0, 0), (1, 0), (0.5, 0.85)]}
    c, s = np.cos(turned), np.sin(turned)
    body = pv.soft_body(
        pv.World(), np.asarray(outlines[shape]) @ np.array([[c, s], [-s, c]]), spacing=spacing, filled=True, stiffness=np.inf
    )
    link: Any = body.links[0]
    n, (i, j) = len(body.group), link.particles.T
    along = (body.group.position[j] - body.group.position[i]).astype(float)
    along /= np.hypot(*along.T)[:, None]
    rates, row = np.zeros((len(i), n, 2)), np.arange(len(i))
    rates[row, i], rates[row, j] = -along, along
    assert np.linalg.matrix_rank(rates.reshape(len(i), 2 * n), tol=1e-3) == 2 * n - 3


def test_a_soft_body_lies_flat_by_as_much_as_it_is_soft() -> None:
    heights = []
    for bulk in (20.0, 2000.0):
        world = pv.World(boundary=pv.Box((-3, 0), (3, 4)))
        body = pv.soft_body(world, pv.builders.disc((0, 1.0), 1.0), spacing=0.15, bulk=bulk, damping=0.5)
        world.forces.append(pv.forces.Drag(linear=0.05))
        world.run(seconds=4.0)
        heights.append(float(body.group.position[:, 1].max()))
    assert heights[0] < heights[1] - 0.1
    assert heights[1] < 2.0
