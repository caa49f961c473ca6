"""Angles: how far circles have turned."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_disc_that_rolls_turns_by_its_way_over_its_radius(dtype: type[np.float32]) -> None:
    # It slides at first: v = v0 - mu g t, w = -2 mu g t / r, until v = -w r at t1 = v0 / (3 mu g); then both stay. The angle is
    # -mu g t1^2 / r + w1 (t - t1) with w1 = -2 v0 / (3 r). In the frame of t1 the mean of two spins is off by 2 mu g / r dt^2 / 8
    # at most; that the floor begins to push after the first substep is worth w1 h.
    mu, v0, r, t, g, h = 0.5, 6.0, 0.5, 2.0, 9.81, 1 / 480
    world = pv.World(boundary=pv.Box((-50, 0), (50, 10), friction=mu), dtype=dtype)
    disc = world.add(position=(-40, r), velocity=(v0, 0), radius=r, angle=0.25)
    world.run(seconds=t)
    t1, w1 = v0 / (3 * mu * g), -2 * v0 / (3 * r)
    paper = 0.25 - mu * g * t1**2 / r + w1 * (t - t1)
    assert disc.angle[0] == pytest.approx(paper, abs=mu * g / r / 60**2 / 4 + abs(w1) * h)
    before, where = float(disc.angle[0]), float(disc.position[0, 0])
    world.run(seconds=1)
    assert disc.angle[0] - before == pytest.approx(-(disc.position[0, 0] - where) / r, rel=2e-5)


def test_a_free_spin_turns_evenly_and_for_long() -> None:
    # 0.05 rad/s beside 40,000 rad: a float32 angle would stand still.
    world = pv.World(gravity=(0, 0), collisions=None)
    group = world.add(position=[(0, 0), (2, 0)], spin=[0.05, -3.0], angle=[40_000.0, 0.0])
    world.run(seconds=2)
    assert world.angle.dtype == np.float64
    assert group.angle == pytest.approx([40_000.1, -6.0], abs=1e-6)


def test_angles_are_hashed_and_kept_in_order() -> None:
    world = pv.World(gravity=(0, 0))
    group = world.add(position=[(k, 0) for k in range(0, 30, 3)], spin=np.arange(10))
    world.run(seconds=0.5)
    later, hashed = world.angle.copy(), world.state_hash()
    assert (np.diff(later) > 0.4).all()
    world.angle[0] += 1e-9
    assert world.state_hash() != hashed
    group.remove([0, 1])
    assert world.angle.tolist() == later[2:].tolist()


def test_what_is_wrong_with_an_angle_or_a_density_is_said() -> None:
    world = pv.World()
    with pytest.raises(pv.InputError, match=r"angle\[0\]"):
        world.add(position=(0, 0), angle=np.nan)
    with pytest.raises(pv.InputError, match=r"density is 2.0 and mass is 1.0; allowed is one of them"):
        world.add(position=(0, 0), density=2.0, mass=1.0)
    with pytest.raises(pv.InputError, match=r"density\[1\] is -1; allowed is a finite number greater than 0"):
        world.add(position=[(0, 0), (3, 0)], density=[1, -1])
    assert len(world) == 0


def test_a_density_makes_masses() -> None:
    world = pv.World()
    group = world.add(position=[(0, 0), (3, 0)], radius=[0.5, 1.0], density=[2.0, 3.0])
    assert group.mass == pytest.approx([2 * np.pi * 0.25, 3 * np.pi])  # rho pi r^2
    world.actors.append(pv.Emitter(pv.Box((10, 0), (20, 10)), rate=600, radius=(0.1, 0.4), density=5.0))
    world.step(1 / 60)
    born = slice(2, None)
    assert len(world) > 2
    assert world.mass[born] == pytest.approx(5 * np.pi * world.radius[born].astype(float) ** 2, rel=1e-6)
    with pytest.raises(pv.InputError, match="density is 1 and mass is 2"):
        pv.Emitter(pv.Box((0, 0), (1, 1)), rate=1, density=1, mass=2)
