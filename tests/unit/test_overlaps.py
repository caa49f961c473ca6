"""What becomes of circles that are added on top of others: pushed apart, left out or refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

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
        way = world.boundary.seam.nearest(position[kept] - position[k])
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
    x, y = np.meshgrid(500 + 0.41 * np.arange(20), -300 + 0.41 * np.arange(20))
    places = np.column_stack((x.ravel(), y.ravel()))
    assert len(world.add(position=places, radius=0.205, on_overlap="error")) == 400
    assert len(world.add(position=places + np.array([0, 20 * 0.41]), radius=0.205, on_overlap="skip")) == 400
    assert len(world.add(position=places + np.array([0.01, 20 * 0.41]), radius=0.205, on_overlap="skip")) == 0


def test_circles_that_would_not_collide_are_not_on_top_of_each_other() -> None:
    world = pv.World()
    world.add(position=(0, 0), category=2, mask=2)
    world.add(position=(3, 0), mass=np.inf)
    world.add(position=[(0, 0.1), (6, 0)], on_overlap="error")
    world.add(position=(3, 0.1), mass=np.inf, on_overlap="error")  # nothing would part the two
    with pytest.raises(pv.InputError, match="on top of particle 1"):
        world.add(position=(3, 0.2), on_overlap="error")
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


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "on another": (
        {"position": [(9, 9), (0.3, 0)]},
        r"position\[1\] is \(0.3, 0\) m, on top of particle 0; allowed are free places",
    ),
    "on each other": (
        {"position": [(9, 9), (8.5, 9)]},
        r"position\[1\] is \(8.5, 9\) m, on top of position\[0\]; allowed are free",
    ),
    "obstacle": ({"position": (5, 5)}, r"position\[0\] is \(5, 5\) m, inside the Disc .*, and all with on_overlap='push'"),
    "outside": ({"position": (30, 5)}, r"position\[0\] is \(30, 5\) m, outside the room"),
    "unknown": (
        {"position": (9, 9), "on_overlap": "shove"},
        r"on_overlap is 'shove'; allowed are 'push', 'skip', 'error' and None",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_refused_adds_nothing(case: str) -> None:
    options, says = BAD[case]
    world = pv.World(boundary=pv.Box((-20, -20), (20, 20)))
    world.obstacles.append(pv.Disc((5, 5), 1.0))
    world.add(position=(0, 0))
    with pytest.raises(pv.InputError, match=says):
        world.add(**{"on_overlap": "error", **options})
    assert len(world) == 1
    if case != "unknown":
        assert len(world.add(**{**options, "on_overlap": "push"})) > 0


def test_the_name_of_before_still_works() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (4, 4)))
    with pytest.warns(DeprecationWarning, match="allow_overlap is deprecated; on_overlap='push' is allow_overlap=True") as told:
        world.add(position=(9, 9), allow_overlap=True)
    assert told[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="allow_overlap"), pytest.raises(pv.InputError, match="outside the room"):
        world.add(position=(9, 9), allow_overlap=False)
