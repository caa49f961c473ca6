"""Builders: chains, ropes, nets, cloths, bridges and soft bodies, as asked for and as they then behave."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.links.area import signed_area
from pyverlet.world.builders.outline import inside

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


REFUSED: list[tuple[Callable[[pv.World], Any], str]] = [
    (lambda w: pv.chain(w, (0, 0), (0, 0)), r"end is \(0.0, 0.0\), where start is; allowed is another point"),
    (lambda w: pv.chain(w, (0, 0), (1, np.nan)), r"end is \(1.0, nan\); allowed are two finite numbers"),
    (lambda w: pv.chain(w, (0, 0), (1, 0), links=0), r"links is 0; allowed is a whole number of at least 1"),
    (lambda w: pv.chain(w, (0, 0), (1, 0), mass=-1), r"mass is -1"),
    (lambda w: pv.rope(w, (0, 0), (5, 0), length=4), r"length is 4 m; allowed is at least the distance from start to end, 5 m"),
    (lambda w: pv.bridge(w, (0, 0), (5, 0), slack=-0.1), r"slack is -0.1"),
    (lambda w: pv.net(w, (0, 0), width=0, height=1), r"width is 0; allowed is a finite number greater than 0"),
    (lambda w: pv.cloth(w, (0, 0), width=1, height=1, rows=1), r"rows is 1; allowed is a whole number of at least 2"),
    (lambda w: pv.cloth(w, (0, 0), width=1, height=1, shear=-1), r"shear is -1"),
    (lambda w: pv.soft_body(w, [(0, 0), (1, 1), (1, 0), (0, 1)], spacing=0.1), r"outline crosses itself, its sides 0 and 2 meet"),
    (lambda w: pv.soft_body(w, [(0, 0), (1, 1)], spacing=0.1), r"outline has 2 corners; allowed are at least 3"),
    (lambda w: pv.soft_body(w, [(0, 0), (1, 1), (2, 2)], spacing=0.1), r"outline "),
    (lambda w: pv.soft_body(w, pv.builders.disc((0, 0), 1), spacing=3), r"spacing is 3 m; allowed is less"),
    (lambda w: pv.soft_body(w, pv.builders.disc((0, 0), 1), spacing=0.1, stiffness=-2), r"stiffness is -2"),
    (lambda w: pv.soft_body(w, pv.builders.disc((0, 0), 1), spacing=0.1, bulk=-2), r"bulk is -2"),
    (lambda w: pv.builders.box((1, 0), (0, 1)), r"upper is \(0.0, 1.0\); allowed is a corner above"),
]


@pytest.mark.parametrize(("make", "says"), REFUSED)
def test_bad_shapes_are_refused_and_nothing_is_added(make: Callable[[pv.World], Any], says: str) -> None:
    world = pv.World()
    with pytest.raises(pv.InputError, match=says):
        make(world)
    assert len(world) == 0
    assert len(world.links) == 0
