"""Links in a world: the list, equal bits, saving, breaking, contacts of neighbours, and the mouse."""

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests import worlds
from tests.worlds import FRAME, refused

import pyverlet as pv
from pyverlet.viewers.commands import Drag
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.pointers import Pointers

DT = 1 / 60


def test_a_restored_world_has_the_links_that_it_had() -> None:
    world = worlds.linked()
    world.run(seconds=0.2)
    saved, links, expected = world.save(), list(world.links), worlds.bits_after(world, 0.5)
    world.links.remove(links[0])
    world.links.append(pv.Rope(world.groups[0], 0, 3))
    world.groups[0].remove([5, 6])
    world.restore(saved)
    assert list(world.links) == links
    assert worlds.bits_after(world, 0.5) == expected


def test_links_go_on_when_somebody_joins_the_world() -> None:
    ends = []
    for joined in (False, True):
        world = pv.World(collisions=None)
        group = world.add(position=np.column_stack((0.4 * np.arange(5), np.zeros(5))), radius=0.1, mass=0.2)
        group.pin([0])
        spring = world.links.append(pv.Spring(group, range(4), range(1, 5), stiffness=80.0, damping=0.1))
        world.run(seconds=0.5)
        if joined:  # nobody has asked for the forces since
            world.add(position=[(9.0, 9.0)], radius=0.1)
        world.step(DT)
        ends.append((spring.force.tobytes(), world.position[:5].tobytes()))
    assert ends[0] == ends[1]


def test_a_frame_that_is_refused_leaves_links_as_they_were() -> None:
    class Now:
        bad = False

        def apply(self, state: Any, t: float) -> None:
            state.force[4] += (np.nan, 0.0) if self.bad and t > 0.51 else (0.0, 0.0)

    ends = []
    for fails in (False, True):
        now, world = Now(), pv.World(collisions=None)
        group = world.add(position=np.column_stack((0.4 * np.arange(9), np.zeros(9))), radius=0.1, mass=0.2)
        group.pin([0])
        stick = world.links.append(pv.Stick(group, range(4), range(1, 5)))
        spring = world.links.append(pv.Spring(group, range(4, 8), range(5, 9), stiffness=80.0, damping=0.1))
        world.forces.append(now)
        world.run(seconds=0.5)
        if fails:
            before = stick.force.tolist(), spring.force.tolist()
            now.bad = True
            with pytest.raises(pv.NonFiniteError):
                world.step(DT)
            now.bad = False
            assert (stick.force.tolist(), spring.force.tolist()) == before
        world.run(seconds=0.3)
        ends.append((world.state_hash(), stick.force.tobytes(), spring.force.tobytes()))
    assert ends[0] == ends[1]


def test_the_energy_includes_what_links_store() -> None:
    world = pv.World(collisions=None, gravity=(0, 0), dtype=np.float64)
    group = world.add(position=[(0, 0), (1.5, 0), (3, 0), (3, 1)], radius=0.1, mass=2.0)
    world.links.append(pv.Spring(group, 0, 1, stiffness=8.0, length=1.0))  # 8 * 0.5^2 / 2 = 1
    world.links.append(pv.Rope(group, 1, 2, length=2.0, compliance=0.5))  # slack: 0
    world.links.append(pv.Rope(group, 2, 3, length=0.5, compliance=0.5))  # 0.5^2 / (2 * 0.5) = 0.25
    world.links.append(pv.Pin(group, 3, point=(3, 3), compliance=2.0))  # 2^2 / (2 * 2) = 1
    assert world.energy().links == pytest.approx(2.25)
    assert world.energy().total == pytest.approx(2.25)


@pytest.mark.parametrize("kind", [pv.Spring, pv.Angle, pv.Area, pv.Pin])
def test_mobility_is_that_of_the_energy(kind: Any) -> None:
    """E = k C^2 / 2, so that grad E = k C grad C, and sum(w |grad E|^2) = 2 k E sum(w |grad C|^2).

    By central differences, which are off by the square of their step and by what E is rounded by, over it: 1e-16 / 1e-6.
    """
    world = pv.World(collisions=None, gravity=(0, 0), dtype=np.float64)
    corners, mass = np.array([(0, 0), (1.3, 0.2), (1.1, 1.4), (-0.2, 0.9)]), np.array([1.0, 2.0, 4.0, 8.0])
    group = world.add(position=corners, radius=0.1, mass=mass)
    made: dict[Any, tuple[Any, dict[str, Any]]] = {
        pv.Spring: ((1, 2), {"stiffness": 4.0, "length": 1.0}),
        pv.Angle: ((0, 1, 2), {"angle": 1.0, "compliance": 0.25}),
        pv.Area: ((), {"area": 1.0, "compliance": 0.25}),
        pv.Pin: ((3,), {"point": (0.5, 2.0), "compliance": 0.25}),
    }
    ends, options = made[kind]
    world.links.append(kind(group, *ends, **options))
    pool, step, slope = world.links.pool, 1e-6, np.zeros((4, 2))
    for particle, axis in np.ndindex(4, 2):
        way = np.zeros((4, 2))
        way[particle, axis] = step
        slope[particle, axis] = (world.links.energy(corners + way) - world.links.energy(corners - way)) / (2 * step)
    expected = (slope**2).sum(axis=1) @ (1 / mass)
    assert expected > 0.01
    found = pool.mobility(corners, 1 / mass, world._state.periodic)
    assert 2 * 4.0 * world.links.energy() * found == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("collisions", [None, pv.Collisions()])
@pytest.mark.parametrize("substeps", [4, 8, 32])
def test_a_link_breaks_at_its_force_and_says_so(substeps: int, collisions: pv.Collisions | None) -> None:
    for share in (0.99, 1.01):  # of the weight, 9.81 N
        world = pv.World(collisions=collisions, substeps=substeps)
        group = world.add(position=[(0, 0), (0, -1), (0, -2)], radius=0.1, mass=(1.0, 0.5, 0.5))
        group.pin(0)
        world.links.append(pv.Stick(group, 1, 2))
        stick = world.links.append(pv.Stick(group, 0, 1, breaking_force=share * 9.81))
        records = []
        for _ in range(60):
            world.step(DT)
            records += world.links.broken[["link", "row", "i", "j", "force"]].tolist()
        assert stick.intact.tolist() == [share > 1]
        assert len(records) == (share < 1)
        for link, row, i, j, force in records:
            assert (link, row, i, j) == (1, 0, 0, 1)
            assert force == pytest.approx(9.81, rel=0.1)
            assert group.position[1, 1] < -3
            assert stick.force[0] == 0.0
            assert len(world.links.segments()[1]) == 1


def test_pins_break_too() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=[(0, 0), (2, 0)], radius=0.1, mass=(1.0, 3.0))
    pin = world.links.append(pv.Pin(group, [0, 1], breaking_force=20.0))
    world.run(seconds=0.5)
    assert pin.intact.tolist() == [True, False]
    assert group.position[0] == pytest.approx((0, 0), abs=1e-4)
    assert group.position[1, 1] < -0.3


@pytest.mark.parametrize("method", [pv.Fast(), pv.BruteForce()])
def test_linked_neighbours_need_not_collide(method: Any) -> None:
    for collide in (False, True):
        world = pv.World(gravity=(0, 0), collisions=pv.Collisions(method=method))
        group = world.add(position=[(0, 0), (0.5, 0), (1.55, 0)], radius=0.5, mass=1.0)
        stick = world.links.append(pv.Stick(group, 0, 1, length=0.5, collide=collide))
        world._state.acceleration[:] = 0.0
        world.run(seconds=0.5)
        assert np.hypot(*(group.position[1] - group.position[0])) == pytest.approx(0.5, abs=1e-3)
        if not collide:
            assert np.abs(group.velocity).max() < 1e-6
            assert world.links.apart().tolist() == [[0, 1]]
            world.links.remove(stick)
            assert world.links.apart().tolist() == []
            world.run(seconds=0.5)
            assert np.hypot(*(group.position[1] - group.position[0])) > 0.95


def test_links_are_a_list() -> None:
    world = pv.World(collisions=None, gravity=(0, 0))
    group = world.add(position=np.column_stack((np.arange(6), np.zeros(6))), radius=0.1)
    a, b, c = pv.Stick(group, 0, 1), pv.Rope(group, [1, 2], [2, 3]), pv.Stick((group, 4), (group, -1), length=2.0)
    links = world.links
    links.extend((a, b))
    world.links += [c]
    assert world.links is links
    assert list(world.links) == [a, b, c]
    assert c.particles.tolist() == [[4, 5]]
    world.links.remove(a)
    assert list(world.links) == [b, c]
    world.run(seconds=0.5)
    assert group.position[5, 0] - group.position[4, 0] == pytest.approx(2.0, abs=1e-5)
    c.length = 1.5
    world.run(seconds=0.5)
    assert group.position[5, 0] - group.position[4, 0] == pytest.approx(1.5, abs=1e-5)
    assert b.force.shape == (2,)
    assert [array.shape for array in world.links.segments()] == [(3, 2, 2), (3,)]
    assert world.links.append(a) is a
    assert (world.links.pop(), world.links.pop(0), list(world.links)) == (a, b, [c])
    with pytest.raises(IndexError):
        world.links.pop(1)
    world.links.clear()
    assert (len(world.links), list(world.links)) == (0, [])
    group.position[5, 0], group.velocity[:] = 9.0, 0.0
    before = group.position.copy()
    world.run(seconds=0.5)
    assert (group.position == before).all()  # nothing holds them together, and nothing parts them


def test_particles_that_go_take_their_links_along() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=np.column_stack((np.arange(5), np.zeros(5))), radius=0.1)
    chain = world.links.append(pv.Stick(group, [0, 1, 2, 3], [1, 2, 3, 4]))
    gone = [world.links.append(each) for each in (pv.Rope(group, 1, 2), pv.Motor(group, 2, speed=1.0, max_torque=4.0))]
    pin = world.links.append(pv.Pin(group, [0, 2, 4]))
    motor = world.links.append(pv.Motor(group, [1, 2, 4], 0, 3, speed=5.0, max_torque=[1.0, 2.0, 3.0]))
    world.step(DT)
    world.remove(2)
    assert list(world.links) == [chain, pin, motor]
    assert [len(each) for each in gone] == [0, 0]
    assert [each.particles.tolist() for each in (chain, pin)] == [[[0, 1], [2, 3]], [[0], [3]]]
    assert (motor.particles.tolist(), motor.max_torque.tolist()) == ([[1, 0, 2], [3, 0, 2]], [1.0, 3.0])
    world.step(DT)
    assert chain.force.shape == (2,)
    assert world.spin[3] > 0


def test_links_removed_between_frames_leave_all_at_once() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=np.column_stack((np.arange(6), np.zeros(6))), radius=0.1)
    links = [world.links.append(pv.Stick(group, i, i + 1, length=1 + 0.1 * i)) for i in range(4)]
    world.links.remove(links[0])
    world.links.remove(links[2])
    late = world.links.append(pv.Stick(group, 4, 5, length=2.0))
    links[3].length = 1.5
    again = world.links.append(links[0])  # while its rows of before may still be there
    assert sorted(map(tuple, world.links.joined().tolist())) == [(0, 1), (1, 2), (3, 4), (4, 5)]
    assert [link.length.tolist() for link in (links[1], links[3], late, again)] == [[1.1], [1.5], [2.0], [1.0]]
    saved = world.save()
    world.links.remove(late)
    world.restore(saved)
    assert len(world.links.joined()) == 4
    world.step(1 / 60)


def test_links_to_removed_particles_are_refused() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=np.column_stack((np.arange(5), np.zeros(5))), radius=0.1)
    early, late = pv.Stick(group, 0, 1), pv.Stick(group, 2, 3)
    world.remove(0)
    refused("Stick x 1 joins, in its row 0, a particle that was removed", world.links.append, early)
    assert world.links.append(late).particles.tolist() == [[1, 2]]
    group.remove()
    refused("group is one of 5 particles that were all removed", pv.Stick, group, 0, 1)


@pytest.mark.parametrize("count", [3, 70, 200])
def test_a_star_of_many_arms_keeps_its_lengths(count: int) -> None:
    # `count` arms of two links turn about a hub: more than may be solved at a time, for all share it.
    arm = np.arange(count)
    pairs = np.concatenate((np.column_stack((np.zeros(count, int), 1 + arm)), np.column_stack((1 + arm, 1 + count + arm))))
    world = pv.World(collisions=None, gravity=(0, 0))
    angle = 2 * np.pi * arm / count
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    group = world.add(position=np.concatenate((np.zeros((1, 2)), ring, 2 * ring)), radius=0.01)
    group.mass[0] = count
    world.links.append(pv.Stick(group, pairs[:, 0], pairs[:, 1]))
    group.velocity[1:] = 3 * np.concatenate((ring, 2 * ring)) @ np.array([[0, 1], [-1, 0]])
    world.run(seconds=1.0)
    ends, _ = world.links.segments()
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T) == pytest.approx(np.ones(2 * count), abs=0.02)


def test_the_mouse_pulls_what_is_linked() -> None:
    world = pv.World()
    group = world.add(position=np.column_stack((np.zeros(10), -0.5 * np.arange(10))), radius=0.2, mass=1.0)
    group.pin(0)
    world.links.append(pv.Stick(group, np.arange(9), np.arange(1, 10), collide=False))
    pointers, layout = Pointers(world), Layout((-10.0, -10.0, 10.0, 10.0), 1)
    for _ in range(180):
        pointers.use(Drag(1, 3.0, -2.5, 1.0) if pointers._held else Drag(1, 0.0, -4.5, 1.0), layout)
        pointers.move(20.0)
        world.step(DT)
    assert group.position[-1, 0] > 1.5
    assert np.hypot(*np.diff(group.position, axis=0).T) == pytest.approx(np.full(9, 0.5), abs=1e-4)
    pointers.release(1)
    world.run(seconds=0.5)
    assert np.isfinite(world.position).all()


# ---- What they give and break at may be set ----

GIVING: list[tuple[Callable[..., Any], str, float]] = [
    *((partial(kind, compliance=0.1), name, value)
      for kind in (pv.Stick, pv.Rope) for name, value in (("compliance", 0.02), ("damping", 3.0), ("breaking_force", 4.0))),
    *((partial(pv.Spring, stiffness=10.0), name, value)
      for name, value in (("stiffness", 50.0), ("damping", 3.0), ("breaking_force", 4.0))),
    *((lambda group, i, j, **gives: pv.Pin(group, j, **{"compliance": 0.1} | gives), name, value)
      for name, value in (("compliance", 0.02), ("damping", 3.0), ("breaking_force", 4.0))),
    *((lambda group, i, j, **gives: pv.Angle(group, 2, i, j, **{"compliance": 0.1} | gives), name, value)
      for name, value in (("compliance", 0.02), ("damping", 3.0), ("breaking_torque", 4.0))),
    *((lambda group, i, j, **gives: pv.Area(group, **{"compliance": 0.1} | gives), name, value)
      for name, value in (("compliance", 0.02), ("damping", 3.0))),
    (lambda group, i, j, **gives: pv.AngleLimit(group, 2, i, j, **{"least": -0.1, "most": 0.1} | gives), "breaking_torque", 2.0),
]  # fmt: skip


def hanging(make: Callable[..., Any], **gives: float) -> tuple[pv.World, Any]:
    """A particle beside one of two that are pinned."""
    world = pv.World(dtype=np.float64, collisions=None, gravity=(3, -9))
    group = world.add(position=[(0, 0), (1, 0), (0, 1)], radius=0.1)
    group.pin([0, 2])
    return world, world.links.append(make(group, 0, 1, **gives))


@pytest.mark.parametrize(("make", "name", "value"), GIVING)
def test_what_is_set_is_as_if_built_so(make: Callable[..., Any], name: str, value: float) -> None:
    world, link = hanging(make)
    setattr(link, name, value)
    assert getattr(link, name).tolist() == pytest.approx([value])
    built, _ = hanging(make, **{name: value})
    other, _ = hanging(make)
    for each in (world, built, other):
        each.run(seconds=0.5)
    assert world.state_hash() == built.state_hash() != other.state_hash()
    worlds.refused(f"{name} is -1; allowed", setattr, link, name, -1)
    assert getattr(link, name).tolist() == pytest.approx([value])


@pytest.mark.parametrize("make", [pv.Stick, pv.Rope, lambda group, i, j: pv.Pin(group, j)])
def test_links_give_and_break_as_set_in_flight(make: Callable[..., Any]) -> None:
    world = pv.World(dtype=np.float64, ledger=True)
    group = world.add(position=[(0, 0), (0, -1)], radius=0.1)
    group.pin(0)
    link = world.links.append(make(group, 0, 1))
    heights = []
    for compliance in (0.0, 0.01, 0.0):
        link.compliance, link.damping = compliance, 5.0
        world.run(seconds=4)
        heights.append(world.position[1, 1])
    assert heights == pytest.approx([-1, -1 - 0.01 * 9.81, -1], abs=1e-5)
    assert world.ledger.total == pytest.approx(world.energy().total)
    link.breaking_force = 5.0
    world.step(FRAME)
    assert not link.intact[0]


SHAPES: list[tuple[Any, tuple[str, ...]]] = [
    (pv.Disc((0, 0), 1), ("radius", "center", "points")),
    (pv.Segment((0, 0), (1, 0)), ("start", "end", "radius", "closed", "points")),
    (pv.Capsule((0, 0), (1, 0), radius=0.1), ("start", "end", "radius", "points")),
    (pv.Chain([(0, 0), (1, 0)]), ("radius", "closed", "points")),
    (pv.Polygon([(0, 0), (1, 0), (0, 1)]), ("radius", "points")),
]


@pytest.mark.parametrize(("thing", "names"), SHAPES)
def test_what_would_have_no_effect_is_refused(thing: Any, names: tuple[str, ...]) -> None:
    for name in names:
        for each in (thing, copy.deepcopy(thing)):
            worlds.refused(f"{name} of a {type(each).__name__} cannot be set; allowed .*in its place", setattr, each, name, 2)


def test_whether_linked_circles_collide_is_fixed() -> None:
    _, link = hanging(pv.Stick)
    worlds.refused("collide of a Stick cannot be set; allowed is a new one in its place", setattr, link, "collide", False)
