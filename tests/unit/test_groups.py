"""Groups are indexed and gone through as NumPy's arrays are."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import worlds

import pyverlet as pv
from pyverlet.picture.colour import LIGHT


def six() -> tuple[pv.World, pv.Group]:
    """A world of eight, and a group of six of them."""
    world = pv.World(gravity=(0, 0))
    world.add(position=[(-3, 0), (-1, 0)])
    group = world.add(position=[(2.0 * k, 5) for k in range(6)], mass=np.arange(1.0, 7.0))
    return world, group


def test_one_particle() -> None:
    world, group = six()
    ball = group[2]
    assert (ball.index, ball.mass, ball.position.tolist()) == (4, 3.0, [4, 5])
    ball.velocity = (1, 0)
    ball.position[0] = 4.5
    ball.mass *= 2
    ball.spin += 1
    assert world.velocity[4].tolist() == [1, 0]
    assert (world.position[4, 0], world.mass[4], world.spin[4]) == (4.5, 6.0, 1.0)
    assert ball == group[2] == group[-4]
    assert ball in group
    assert len({ball, group[2], group[3]}) == 2
    ball.pin()
    assert np.isinf(world.mass[4])
    world.step(1 / 60)
    assert ball.position.tolist() == [4.5, 5]


def test_particles_are_followed_while_others_go() -> None:
    world, group = six()
    last, second = group[-1], group[1]
    world.remove([0, 3])
    assert (last.index, last.position[0]) == (5, 10)
    assert not second.is_there
    assert repr(second) == "Particle 3, removed"
    worlds.refused("particle 3 was removed", getattr, second, "position")
    assert group[1].index == 2
    world.remove(last)
    assert len(group) == 4
    last_now = group[len(group) - 1]
    last_now.remove()
    assert len(group) == 3


@pytest.mark.parametrize("which", [slice(1, 5), slice(None), slice(-2, None), slice(3, 1), slice(2, 3)])
def test_a_slice_is_a_group_of_views(which: slice) -> None:
    world, group = six()
    world.remove(4)  # within
    part = group[which]
    assert part.index.tolist() == group.index[which].tolist()
    assert part.mass.tolist() == group.mass[which].tolist()
    assert len(part) == len(group.mass[which])
    if len(part):
        assert np.shares_memory(part.mass, world.mass)
        part.mass[0] = 9
        assert group.mass[which][0] == 9
        world.remove(part)
    assert len(group) == 5 - len(range(5)[which])


@pytest.mark.parametrize("which", [slice(None, None, 2), slice(None, None, -1), [0, 3], [3, -1, 0], np.array([False, True] * 3)])
def test_particles_picked_out(which: Any) -> None:
    world, group = six()
    part = group[which]
    assert part.index.tolist() == group.index[which].tolist()
    assert part.mass.tolist() == group.mass[which].tolist()
    assert [ball.index for ball in part] == part.index.tolist()
    with pytest.raises(ValueError, match="read-only"):
        part.mass[0] = 9
    part.mass = 9
    part.velocity = (0, 1)
    assert (group.mass[which] == 9).all()
    assert world.mass.sum() == group.mass.sum() + 2
    part.pin(0)
    assert np.isinf(world.mass[part.index[0]])
    force = world.forces.append(pv.ConstantForce((1, 0), group=part))
    link = world.links.append(pv.Stick(part, 0, 1))
    assert link.particles.tolist() == [part.index[:2].tolist()]
    world.step(1 / 60)
    assert force.potential(world._state) == pytest.approx(-part.position[1:, 0].sum(), rel=1e-5)
    part.remove(0)
    assert len(part) == len(np.arange(6)[which]) - 1
    part.remove()
    assert len(part) == 0
    worlds.refused("all removed", getattr, part, "mass")


def test_going_through_a_group() -> None:
    world, group = six()
    assert [ball.mass for ball in group] == [1, 2, 3, 4, 5, 6]
    for ball in group:
        ball.radius = 0.1 * ball.mass
    assert np.allclose(group.radius, 0.1 * np.arange(1, 7))
    for ball in group:  # even ones go, each with the one behind it
        if ball.mass % 2 == 0:
            group[[int(np.searchsorted(group.mass, ball.mass)) + k for k in (0, 1) if ball.mass + k <= 6]].remove()
    assert group.mass.tolist() == [1]
    assert len(world) == 3
    assert list(world.add(position=np.empty((0, 2)))) == []


@pytest.mark.parametrize("which", [6, -7, "a", 1.5, [[0, 1]], [9], np.ones(5, bool), None, (0, 1)])
def test_what_is_not_there_gets_a_sentence(which: Any) -> None:
    _, group = six()
    worlds.refused(r"index is .*", group.__getitem__, which)
    with pytest.raises(IndexError):
        group[which]


def test_handles_on_the_same_particles_are_equal() -> None:
    world, group = six()
    assert group in world.groups
    assert world.groups == world.groups
    assert group != world.groups[0]
    assert group[1:3] == group[1:3] != group[1:4]
    assert group[[0, 3]] == group[[0, 3]] != group[[3, 0]]
    assert group[2] != group[2:3]
    assert len({group, world.groups[1], group[1:3], group[1:3], group[2], group[2], group[[2]]}) == 4
    assert group != six()[1]
    group.remove()
    assert group in world.groups
    again = copy.deepcopy(group)
    assert again == again.world.groups[1] != group


ON_GROUPS: dict[str, Callable[[pv.Group], Any]] = {
    "constant": lambda group: pv.ConstantForce((0, 1), group=group),
    "spring": lambda group: pv.PointSpring(group, stiffness=1.0),
    "gravitation": lambda group: pv.Gravitation(group, strength=1.0),
    "fluid": lambda group: pv.Fluid(group, rest_density=1.0, stiffness=10.0),
}


@pytest.mark.parametrize("name", ON_GROUPS)
@pytest.mark.parametrize("which", [slice(None), slice(1, 3), [0, 2]])
def test_a_force_on_a_group_without_particles_acts_on_nobody(name: str, which: Any) -> None:
    world, group = six()
    part, (twin, _) = group[which], six()
    world.forces.append(ON_GROUPS[name](part))
    for each in (world, twin):
        each.remove(np.arange(2, 8))
        each.step(1 / 60)
    assert world.energy().potential == 0.0
    assert world.state_hash() == twin.state_hash()
    assert len(pv.picture.colour.Groups(part).colours(world, LIGHT)) == 2


@pytest.mark.parametrize("name", ON_GROUPS)
def test_a_force_on_a_group_of_another_world_is_refused(name: str, tmp_path: Path) -> None:
    world, group = six()[0], six()[1]
    world.forces.append(ON_GROUPS[name](group))
    before = world.state_hash()
    for ask in (lambda: world.step(1 / 60), world.energy, lambda: pv.save(world, tmp_path / "world.pvsnap")):
        worlds.refused(r"group of forces\[0\] is Group of 6 particles, 2 to 7 of another world; allowed are", ask)
    assert world.state_hash() == before


def test_particles_of_another_world_are_refused() -> None:
    world, group = six()[0], six()[1]
    for other in (group, group[1:3], group[[0, 2]], group[2]):
        worlds.refused("which is .* of another world; allowed are particles of this one", world.remove, other)
    assert len(world) == 8
    colours = pv.picture.colour.Groups(world.groups[1], group)
    worlds.refused(r"groups\[1\] is .* of another world", colours.colours, world, LIGHT)


# ---- Particles by their numbers, which they keep: in events, contacts and links, and back to indices and groups ----


def test_numbers_in_any_shape() -> None:
    world = pv.World()
    world.add(position=np.zeros((4, 2)))
    world.remove(1)
    assert world.index_of(3) == 2
    assert world.index_of([[0, 1], [2, 7]]).tolist() == [[0, -1], [1, -1]]
    assert world.index_of([]).tolist() == []


def linked() -> tuple[pv.World, pv.Rope]:
    world = pv.World(dtype=np.float64)
    balls = world.add(position=[(k, 0.0) for k in range(6)], radius=0.1)
    balls[[0, 2, 4]].mass = np.inf
    link = world.links.append(pv.Rope(balls, [0, 2, 4], [1, 3, 5], length=[1.0, 1.1, 1.2], breaking_force=[0.01, np.inf, 0.01]))
    return world, link


def test_links_and_what_breaks_tell_numbers() -> None:
    world, link = linked()
    assert link.numbers.tolist() == [[0, 1], [2, 3], [4, 5]]
    world.remove(0)
    assert link.numbers.tolist() == [[2, 3], [4, 5]]
    assert world.index_of(link.numbers).tolist() == link.particles.tolist() == [[1, 2], [3, 4]]
    while not len(world.links.broken):
        world.step(1 / 60)
    broken = world.links.broken
    assert broken["number"].tolist() == [[4, 5]]
    world.remove(world.index_of(broken["number"][0]))
    assert broken["number"].tolist() == [[4, 5]]
    assert broken[["i", "j"]].tolist() == [(-1, -1)]


def test_a_restored_link_has_all_of_its_rows_again() -> None:
    # Of a link that had lost a row, the numbers and lengths of those left stayed: it could not be copied any more.
    world, link = linked()
    kept = world.save()
    world.remove(3)
    link.length = [2.0, 3.0]
    world.restore(kept)
    assert link.numbers.tolist() == link.particles.tolist() == [[0, 1], [2, 3], [4, 5]]
    assert link.length.tolist() == [1.0, 1.1, 1.2]
    again = copy.deepcopy(world)
    for each in (world, again):
        each.run(seconds=0.2)
    assert again.state_hash() == world.state_hash()


@pytest.mark.parametrize("way", worlds.WAYS)
def test_numbers_of_links_are_kept(way: str, tmp_path: Path) -> None:
    world, _ = linked()
    while not len(world.links.broken):
        world.step(1 / 60)
    world.remove(0)
    again = worlds.WAYS[way](world, tmp_path)
    assert again.links.broken.tobytes() == world.links.broken.tobytes()
    assert again.links[0].numbers.tolist() == world.links[0].numbers.tolist()
