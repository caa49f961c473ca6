"""What is printed of public objects is one line that states the essentials."""

import inspect
import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from tests.data.test_copies import things

import pyverlet as pv


@cache
def objects() -> dict[str, Any]:
    """One of each kind, and more."""
    world = pv.World(boundary=pv.Box((-9, -9), (9, 9)), ledger=True)
    balls = world.add(position=[(0, 0), (2, 0), (4, 0)])
    rope = pv.rope(world, (-5, 5), (-3, 5))
    world.obstacles.extend(pv.Disc((x, -5), 0.2) for x in range(5))
    world.forces += [pv.Drag(linear=1), pv.PointSpring(stiffness=1)]
    water = pv.Fluid(balls[1:], rest_density=1.0, stiffness=1.0, viscosity=0.1)
    world.actors.append(pv.Sink(pv.Box((0, 0), (1, 1))))
    none = np.empty(0, int)
    scene = pv.scenes.get("cage")
    found = [
        world.overlap_area((0, 0), 0.1), water, world, balls, balls[0], balls[1:], balls[[0, 2]], rope,
        pv.cloth(world, (4, 4), width=1, height=1, columns=3, rows=3),
        pv.fill(world.boundary, radius=0.5, count=4), world.save(), world.ledger, world.obstacles, world.forces, world.links,
        pv.Panels([pv.Panel("left", world), pv.Panel("right", world)]), pv.Panel("one", world), scene, scene.show, scene.defaults,
        pv.scenes.get("bounce-order").variants[0], pv.InputError("x is 1; allowed is 2"), pv.errors.NonFiniteError(1, "x", 0.0),
        pv.picture.BySpeed(), pv.picture.Pen(), pv.picture.Raster((32, 32)), pv.picture.DARK, pv.draw.fit(world, (32, 32)),
        pv.CoarseCoordinatesWarning("coarse"), pv.CoarseStepsWarning("coarse"), pv.PyverletError("x"),
        pv.Worlds("cage", 1, processes=1, particles=10),
        pv.contact_rule(lambda world, new: None), pv.NewContacts(none, none, none == 1, none, none, none),
        pv.lab.solve(lambda t, x, v: -x, x0=np.ones(9), until=1, h=0.01),
    ]  # fmt: skip
    with TemporaryDirectory() as folder, pv.Trajectory(Path(folder, "x.xyz")) as trajectory:
        found.append(trajectory)
    return things() | {f"{type(thing).__name__}-{number}": thing for number, thing in enumerate(found)}


def test_each_public_object_is_one_line() -> None:
    for name, thing in objects().items():
        said = repr(thing)
        assert "\n" not in said, name
        assert not re.search(r" at 0x[0-9a-f]+", said), (name, said)
        assert len(said) <= 200, (name, said)


def test_each_public_class_is_among_them() -> None:
    public = [
        thing for thing in (getattr(pv, name) for name in pv.__all__) if inspect.isclass(thing) and not inspect.isabstract(thing)
    ]
    assert [cls.__name__ for cls in public if not any(type(thing) is cls for thing in objects().values())] == []


@pytest.mark.parametrize(
    ("which", "says"),
    [
        ("World", r"World of 3\d particles.*, \d+ links, 2 forces, 5 obstacles, 1 actor in Box\(.*\), float32, 0 s"),
        ("Obstacles", r"5 obstacles: Disc at \(0, -5\) m, Disc at \(1, -5\) m, Disc at \(2, -5\) m, \.\.\."),
        ("ForceList", r"2 forces: Drag\(linear=1, quadratic=0\), PointSpring\(center=\(0, 0\), stiffness=1\)"),
        ("Links", r"\d links: Rope x 20, .*"), ("Group", r"Group of 3 particles, 0 to 2"),
        ("Particle", r"Particle 0 at \(0, 0\) m"), ("Saved", r"Saved\(particles=\d+, time=0, frames=0\)"),
        ("Events", r"Events of the last frame: 0 begin, 0 end, 0 hit"),
        ("Fluid", r"Fluid\(group=Group of 2 particles, 1 to 2, .*\)"),
        ("Overlaps", "Overlaps with 1 particle, 0 obstacles, 0 walls"),
        ("RayHits", r"RayHits of 1 ray, 1 of which hit"), ("Scene", r"Scene\(name='cage', summary='.*'\)"),
    ],
)  # fmt: skip
def test_the_essentials_are_stated(which: str, says: str) -> None:
    said = [repr(thing) for thing in objects().values() if type(thing).__name__ == which]
    assert any(re.fullmatch(says, text) for text in said), said


def test_contacts_are_one_line_and_an_array() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (5, 5)), contacts=True)
    world.add(position=[(1, 0.5), (3, 0.5)])
    world.run(seconds=0.2)
    assert repr(world.contacts) == "2 records of (a, b, wall, obstacle, point, normal, impulse, rub, number)"
    assert world.contacts["a"].tolist() == [0, 1]
    assert repr(world.contacts["a"]) == "array([0, 1])"


def test_a_broken_link_says_so() -> None:
    world = pv.World()
    pair = world.add(position=[(0, 5), (0, 3)])
    pair.pin(0)
    link = world.links.append(pv.Rope(pair, 0, 1, breaking_force=0.1))
    world.run(seconds=0.1)
    assert repr(link) == "Rope x 1, 1 broken"
