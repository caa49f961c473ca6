"""Cohesion: circles that have touched hold on to each other until they are pulled apart."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, empty, refused

import pyverlet as pv


def pair(gap: float, **options: Any) -> tuple[pv.World, pv.Cohesion]:
    world = empty(glue := pv.Cohesion(strength=10.0, break_distance=0.5), substeps=8, **options)
    world.add(position=[(0, 0), (2 + gap, 0)], radius=1.0)
    return world, glue


def test_circles_pull_on_each_other_only_once_they_have_touched() -> None:
    world, glue = pair(0.2)
    world.step(0.01)
    assert len(glue.bonds) == 0
    assert not world.velocity.any()
    world.position[1, 0] = 2.0
    world.step(1e-4)
    assert glue.bonds.tolist() == [[0, 1]]
    # At a gap of 0.2: 10 (1 - 0.2 / 0.5) = 6 N.
    world.position[1, 0], world.velocity[:] = 2.2, 0
    before = world.velocity.copy()
    world.step(1e-4)
    assert (world.velocity - before)[0] == pytest.approx([6e-4 / world.mass[0], 0], rel=1e-4)


@pytest.mark.parametrize("parts", [False, True])
def test_a_bond_takes_its_energy_to_break(*, parts: bool) -> None:
    """strength break_distance / 2 = 2.5 J is mu v^2 / 2 at the relative speed v that just breaks it, with mu = 1/2 kg."""
    world, glue = pair(0.0, ledger=True)
    world.mass[:] = 1.0
    world.step(1e-4)
    assert glue.bonds.tolist() == [[0, 1]]
    assert world.energy().potential == pytest.approx(-2.5, rel=1e-6)
    relative = np.sqrt(2 * 2.5 / 0.5) * (1.05 if parts else 0.95)
    world.velocity[:] = (-relative / 2, 0), (relative / 2, 0)
    start = world.energy().total
    for _ in each_frame(world, 150, 0.002):
        if not parts and world.velocity[1, 0] < 0:
            break
    assert (len(glue.bonds) == 0) is parts
    # Order 2: force 10 N over 0.3 s in steps of 2.5e-4 s; the bond is let go up to a substep late, with no force left.
    assert world.energy().total == pytest.approx(start, abs=1e-4 * 2.5)
    assert world.ledger.total == pytest.approx(world.energy().total, abs=1e-12)
    assert abs(world.ledger.residual) < 1e-4 * 2.5


def test_a_frame_that_fails_makes_no_bonds() -> None:
    world, glue = pair(0.2)
    world.velocity[1] = -30.0, 0.0  # they meet in the second of eight substeps

    @pv.force
    def fails(x: Any, y: Any, vx: Any, vy: Any, mass: Any, t: Any) -> Any:
        return (0.0 if t < 0.015 else np.nan) * x, 0.0

    world.forces.append(fails)
    with pytest.raises(pv.NonFiniteError):
        world.step(0.02)
    assert len(glue.bonds) == 0
    world.forces.remove(fails)
    world.step(0.02)
    assert len(glue.bonds) == 1


def test_bonds_are_of_one_world() -> None:
    world, glue = pair(0.0)
    other, _ = pair(0.0)
    other.forces[:] = [glue]
    world.step(1e-4)
    for look in (lambda: other.step(1e-4), other.energy):
        refused(r"^Cohesion\(.*\) holds the bonds of another world; allowed is", look)
    assert glue.bonds.tolist() == [[0, 1]]
    twin = copy.deepcopy(world)
    for each in (world, twin, pickle.loads(pickle.dumps(world))):
        each.step(1e-4)
        assert each.energy().potential == pytest.approx(-2.5, rel=1e-4)


def test_bonds_pull_in_the_pressure_through_the_boundary() -> None:
    """P = (sum of force times distance) / 2 A at rest: -6 N at a gap of 0.2 m, 2.2 m between the centres."""
    world = empty(boundary=pv.Periodic((0, 0), (10, 10)), contacts=True)
    world.add(position=[(9.5, 5), (1.7, 5)], radius=1.0)
    glue = world.forces.append(pv.Cohesion(strength=10.0, break_distance=0.5))
    glue.bonds = np.array([(0, 1)])
    assert world.pressure() == pytest.approx(-6 * 2.2 / 200, rel=1e-12)
    assert world.energy().potential == pytest.approx(-10 * 0.3**2 / (2 * 0.5), rel=1e-12)


def test_removed_particles_take_their_bonds_with_them() -> None:
    world = empty()
    world.add(position=[(0, 0), (2, 0), (4, 0), (6, 0)], radius=1.0)
    glue = world.forces.append(pv.Cohesion(strength=1.0, break_distance=0.5))
    world.step(1e-4)
    assert glue.bonds.tolist() == [[0, 1], [1, 2], [2, 3]]
    saved = world.save()
    world.remove(1)
    assert glue.bonds.tolist() == [[1, 2]]
    world.step(1e-4)
    assert glue.bonds.tolist() == [[1, 2]]
    world.restore(saved)
    assert glue.bonds.tolist() == [[0, 1], [1, 2], [2, 3]]
