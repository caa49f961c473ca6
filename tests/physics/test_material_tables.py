"""How the values of two that touch become one, and materials that have something together."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

A, B = 0.2, 0.6
RULES = {"geometric": np.sqrt(A * B), "mean": 0.5 * (A + B), "min": A, "max": B, "multiply": A * B}


def head_on(e: tuple[float, float], **laws: Any) -> float:
    """The restitution of two discs that meet at 1 m/s each."""
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=pv.Collisions(**laws))
    pair = world.add(position=[(0, 0), (1.3, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5, restitution=e)
    world.run(seconds=0.4)
    return float(pair.velocity[1, 0] - pair.velocity[0, 0]) / 2


@pytest.mark.parametrize("rule", RULES)
def test_restitutions_combine(rule: str) -> None:
    """Relative speed after an impact over that before it is e; with "geometric" it is the larger one, as in Box2D."""
    assert head_on((A, B), combine=rule) == pytest.approx(B if rule == "geometric" else RULES[rule], rel=1e-12)


def sliding(mu: float, own: float | None, surface: str, **laws: Any) -> float:
    """The friction at a floor, by what a disc loses that slides on it: mu g t."""
    room = pv.Box((-50, 0), (50, 9), friction=mu if surface == "wall" else 0.0)
    world = pv.World(boundary=room, dtype=np.float64, collisions=pv.Collisions(**laws))
    height = 0.0
    if surface == "segment":
        world.obstacles.append(pv.Segment((-50, 1), (50, 1), friction=mu))
        height = 1.0
    world.add(position=(0, height + 0.5), velocity=(20, 0), radius=0.5, friction=own)
    world.run(seconds=0.5)
    first = float(world.velocity[0, 0])
    world.run(seconds=0.5)
    return (first - float(world.velocity[0, 0])) / (9.81 * 0.5)


@pytest.mark.parametrize("surface", ["wall", "segment"])
@pytest.mark.parametrize("rule", RULES)
def test_frictions_combine(rule: str, surface: str) -> None:
    assert sliding(A, B, surface, combine=rule) == pytest.approx(RULES[rule], rel=1e-9)
    assert sliding(A, None, surface, combine=rule) == pytest.approx(A, rel=1e-9)  # the surface's alone


def test_the_table_counts_for_pairs() -> None:
    table = {("b", "a"): {"restitution": 1.0}, ("a", "a"): {"restitution": 0.5}}
    for names, e in ((("a", "b"), 1.0), (("b", "a"), 1.0), (("a", "a"), 0.5), (("b", "b"), 0.2), (("a", ""), 0.2)):
        world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=pv.Collisions(restitution=0.2, materials=table))
        pair = world.add(position=[(0, 0), (1.3, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5, material=list(names))
        world.run(seconds=0.4)
        assert (pair.velocity[1, 0] - pair.velocity[0, 0]) / 2 == pytest.approx(e, rel=1e-12), names


@pytest.mark.parametrize("what", ["wall", "segment", "disc", "pinned"])
def test_the_table_counts_for_surfaces(what: str) -> None:
    """A ball that is dropped from rest onto it bounces as high as e^2 of the height; the others do not bounce."""
    laws = pv.Collisions(materials={("ball", "trampoline"): {"restitution": 0.9}})
    room = pv.Box((-9, 0), (9, 20), material="trampoline" if what == "wall" else "")
    world = pv.World(boundary=room, dtype=np.float64, collisions=laws)
    top = 0.0
    if what == "segment":
        top = 1.0
        world.obstacles.append(pv.Segment((-9, 1), (9, 1), material="trampoline"))
    elif what == "disc":
        top = 2.0
        world.obstacles.append(pv.Disc((0, 1), radius=1.0, material="trampoline"))
    elif what == "pinned":
        top = 2.0
        world.add(position=(0, 1), radius=1.0, mass=np.inf, material="trampoline")
    ball = world.add(position=(0, top + 3), radius=0.5, material="ball")
    height, highest = 2.5, 0.0
    world.run(seconds=np.sqrt(2 * height / 9.81) + 0.02)
    assert ball.velocity[0, 1] > 0
    for _ in range(200):
        world.step(1 / 240)
        highest = max(highest, float(ball.position[0, 1]) - top - 0.5)
    assert highest == pytest.approx(0.81 * height, rel=1e-3)  # looked at 240 times a second: g / 8 / 240^2 of a metre


@pytest.mark.parametrize("what", ["wall", "segment", "pair"])
@pytest.mark.parametrize("rule", ["geometric", "multiply", "table"])
def test_events_tell_what_turned_them(rule: str, what: str) -> None:
    """The impulse of a hit is what it changes: m (1 + e) v at a surface, half of that for two alike."""
    table = {("a", "b"): {"restitution": 0.3}} if rule == "table" else {}
    laws = pv.Collisions(combine="geometric" if rule == "table" else rule, materials=table)
    own: dict[str, Any] = {"restitution": A} | ({"material": "a"} if table else {})
    other: dict[str, Any] = {"restitution": B} | ({"material": "b"} if table else {})
    room = pv.Box((-5, -5), (5, 5), **(other if what == "wall" else {}))
    world = pv.World(boundary=room, gravity=(0, 0), collisions=laws, dtype=np.float64, events=True)
    ball = world.add(position=(0, 0), velocity=(2, 0), radius=0.5, mass=3.0, **own)
    if what == "segment":
        world.obstacles.append(pv.Segment((2, -5), (2, 5), **other))
    elif what == "pair":
        world.add(position=(2, 0), velocity=(-2, 0), radius=0.5, mass=3.0, **other)
    while not len(world.events.begin):
        world.step(1 / 60)
    assert world.events.begin["impulse"][0] == pytest.approx(3.0 * (2.0 - ball.velocity[0, 0]), rel=1e-9)


def test_materials_change_in_flight_and_wake(tmp_path: Path) -> None:
    laws = pv.Collisions(friction=0.5, materials={("skate", "ice"): {"friction": 0.0}})
    slope = pv.Box((-50, 0), (50, 9), friction=0.5, material="ice")
    world = pv.World(boundary=slope, gravity=(2.0, -9.0), dtype=np.float64, collisions=laws, sleep=True)
    world.add(position=[(x, 0.5) for x in (0.0, 2.0)], radius=0.5, rolling_resistance=1.0, friction=0.5)
    room = slope
    room.rolling_resistance = 1.0
    world.run(seconds=5)
    assert world.asleep.all()
    group = world.add(position=(20, 0.5), radius=0.5)
    group.material = "skate"
    world.material = ["skate", "", "skate"]
    world.run(seconds=0.5)
    assert world.material.tolist() == ["skate", "", "skate"]
    assert world.velocity[0, 0] > 0.3
    assert abs(world.velocity[1, 0]) < 1e-6
    pv.save(world, tmp_path / "ice.pv")
    others = [copy.deepcopy(world), pickle.loads(pickle.dumps(world)), pv.load(tmp_path / "ice.pv", exact=True)]
    world.run(seconds=0.2)
    for other in others:
        assert other.material.tolist() == ["skate", "", "skate"]
        other.run(seconds=0.2)
        assert other.state_hash() == world.state_hash()


def test_a_table_alone_makes_a_world_rough() -> None:
    laws = pv.Collisions(materials={("a", "floor"): {"friction": 0.5}})
    world = pv.World(boundary=pv.Box((-50, 0), (50, 9), material="floor"), dtype=np.float64, collisions=laws)
    world.add(position=[(0, 0.5), (5, 0.5)], velocity=(9, 0), radius=0.5, material=["a", ""])
    world.run(seconds=3)
    assert world.velocity[:, 0] == pytest.approx([6.0, 9.0])


def test_unknown_materials_get_a_sentence() -> None:
    world = pv.World(collisions=pv.Collisions(materials={("rubber", "ice"): {"friction": 0.1}}))
    with pytest.raises(pv.InputError, match=r"material is 'rubbr' \(did you mean 'rubber'\?\); allowed: 'ice', 'rubber'"):
        world.add(position=(0, 0), material="rubbr")
    world.obstacles.append(pv.Segment((0, 0), (1, 0), material="wood"))
    world.add(position=(0, 5))
    with pytest.raises(pv.InputError, match=r"material of obstacles\[0\] is 'wood'; allowed: 'ice', 'rubber'"):
        world.step(1 / 60)
    with pytest.raises(pv.InputError, match="material is 'ice'; allowed: none, since `collisions` has no materials"):
        pv.World().add(position=(0, 0), material="ice")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_world_with_a_table_may_be_empty(dtype: Any) -> None:
    # Steps without particles ended the process: materials of a first particle were looked up.
    table = {("rubber", "rubber"): {"restitution": 0.5}}
    world = pv.World(gravity=(0, 0), dtype=dtype, collisions=pv.Collisions(materials=table))
    world.run(seconds=0.1)
    for _ in range(2):
        pair = world.add(position=[(0, 0), (1.3, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5, material="rubber")
        world.run(seconds=0.4)
        assert pair.velocity[:, 0] == pytest.approx([-0.5, 0.5], rel=1e-6)
        pair.remove()
        world.run(seconds=0.1)
