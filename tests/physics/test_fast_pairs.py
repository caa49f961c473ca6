"""Circles that come nearer by any part of their size in a substep, or many times it, meet where and when they should."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

import pyverlet as pv

FRAME, SUBSTEPS = 1 / 60, 8


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("way", [0.12, 0.3, 0.8, 1.5, 4.0, 12.0])
def test_two_meet_however_fast(way: float, restitution: float, dtype: str) -> None:
    # way: of r_i + r_j, in a substep. J = (1 + e) (v . n) / (1 / m_i + 1 / m_j) along n, the normal where they touch:
    # with the impact parameter b (r_i + r_j), n = (sqrt(1 - b^2), b).
    for b, (ri, rj), phase in itertools.product([0.0, 0.3, 0.9], [(0.2, 0.2), (0.05, 0.3)], [0.0, 0.6]):
        reach, masses = ri + rj, np.array([1.0, 2.0])
        speed = way * reach / (FRAME / SUBSTEPS)
        world = pv.World(gravity=(0, 0), dtype=dtype, collisions=pv.Collisions(restitution=restitution))
        away = reach + (3.37 + phase) * way * reach
        world.add(position=[(0, 0), (away, b * reach)], radius=[ri, rj], mass=masses, velocity=[(speed, 0), (0, 0)])
        for _ in range(2):
            world.step(FRAME)
        n = np.array([np.sqrt(1 - b * b), b])
        impulse = (1 + restitution) * speed * n[0] / (1 / masses).sum() * n
        after = np.array([(speed, 0) - impulse / masses[0], impulse / masses[1]])
        # Places are rounded to eps of the whole way, which turns the normal by that over reach sqrt(1 - b^2). Without restitution
        # and friction slow ones are stopped along the normal at the beginning of the substep.
        turned = 20 * np.finfo(dtype).eps * (away / reach + 1) / np.sqrt(1 - b * b)
        assert np.abs(world.velocity - after).max() < (way / 2 if restitution == 0 and way < 0.2 else turned) * speed


@pytest.mark.parametrize("restitution", [0.0, 0.7, 1.0])
def test_shots_go_through_no_row_of_a_crowd(restitution: float) -> None:
    # Few fast ones among many: these are listed by their ways, the others by the skin.
    world = pv.World(gravity=(0, 0), dtype="float64", collisions=pv.Collisions(restitution=restitution))
    x, y = np.meshgrid(np.arange(40) * 1.0, np.arange(40) * 1.0)
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.3)
    # Radii a substep. What has been hit without restitution and is hit again carries load, and is pushed by springs: not at once.
    way = np.array([5.0, 9.0, 20.0] if restitution else [1.0, 1.5, 2.0])
    rows, speed = np.array([4, 11, 23]), way * 0.3 * SUBSTEPS / FRAME
    shots = world.add(
        position=np.column_stack((np.full(3, -7.0), rows)), radius=0.3, velocity=np.column_stack((speed, np.zeros(3)))
    )
    for _ in range(4):
        world.step(FRAME)
    for k, row in enumerate(rows):
        line = np.array([shots.index[k], *(40 * row + np.arange(40))])
        assert (np.diff(world.position[line, 0]) > 0.3).all()  # nobody has passed anybody
        assert world.velocity[line].sum(axis=0) == pytest.approx((speed[k], 0), rel=1e-12)
        if restitution == 1:  # each gives all it has to the next
            assert world.velocity[line, 0] == pytest.approx([0] * 40 + [speed[k]], abs=1e-9 * speed[k])
    others = np.setdiff1d(np.arange(1600), (40 * rows[:, None] + np.arange(40)).ravel())
    assert not world.velocity[others].any()


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_crowd_that_moves_by_many_radii_a_substep_ends_its_frame(restitution: float) -> None:
    # 1,900 circles that cover the room, 15 radii a substep: a frame once took ten seconds, and once ended with no numbers.
    rng = np.random.default_rng(0)
    law = pv.Collisions(restitution=restitution)
    crowd, calm = (pv.World(boundary=pv.Box((-10, -10), (10, 10)), substeps=1, collisions=law, threads=1) for _ in range(2))
    place = rng.uniform(-9.7, 9.7, (1900, 2))
    for world, speed in ((crowd, 15 * 0.2 * 60), (calm, 0.1)):
        world.add(position=place, radius=0.2, on_overlap="push", velocity=rng.normal(0, speed / 1.4, (1900, 2)))
    took = []
    for world in (calm, crowd):
        start, energy = time.process_time(), world.energy().kinetic
        for _ in range(8):
            world.step(FRAME)
        took.append(time.process_time() - start)
        assert world.energy().kinetic < 1.01 * energy or world is calm
    assert took[1] < 100 * took[0]
    assert (np.abs(crowd.position) <= 10).all()
