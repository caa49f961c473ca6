"""Circles whose rotation is fixed: as if their moment of inertia were infinite."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G = 9.81
DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@DTYPES
def test_it_slides_where_a_disc_would_roll(dtype: Any) -> None:
    """x' = v - mu g t until it stops; a disc would roll on at 2/3 of v."""
    world = pv.World(boundary=pv.Box((-90, 0), (90, 9), friction=0.2), dtype=dtype)
    world.add(position=[(0, 0.5), (5, 0.5)], radius=0.5, velocity=(3, 0), fixed_rotation=[True, False])
    world.run(seconds=1)
    assert world.velocity[0, 0] == pytest.approx(3 - 0.2 * G, rel=1e-4)
    world.run(seconds=1)
    assert world.velocity[:, 0] == pytest.approx([0, 2], abs=1e-5)
    assert world.spin[0] == 0


@DTYPES
@pytest.mark.parametrize("what", ["wall", "segment", "pinned", "pair"])
@pytest.mark.parametrize("mu", [0.1, 0.9])
def test_an_impact_rubs_within_the_cone(mu: float, what: str, dtype: Any) -> None:
    """J_n = m (1 + e) v_n and |J_t| = min(mu J_n, m v_t): all of the slip, where a disc loses a third."""
    e, v, u = 0.5, 2.0, 1.0
    laws = pv.Collisions(restitution=e, friction=mu)
    room = pv.Box((-90, 0), (90, 90), restitution=e, friction=mu)
    world = pv.World(gravity=(0, 0), boundary=room, collisions=laws, dtype=dtype)
    top = 0.0
    if what == "segment":
        top = 1.0
        world.obstacles.append(pv.Segment((-90, 1), (90, 1), restitution=e, friction=mu))
    elif what in ("pinned", "pair"):
        top = 5.0
        world.add(position=(0.3, 4), radius=1.0, mass=np.inf if what == "pinned" else 3.0, fixed_rotation=True)
    x = 0.3 - u * (0.2 / v)  # where it meets the other from straight above
    ball = world.add(position=(x, top + 0.5 + 0.2), radius=0.5, velocity=(u, -v), fixed_rotation=True)
    world.run(seconds=0.25)
    share = 0.75 if what == "pair" else 1.0  # of the reduced mass, 1 and 3 kg
    normal = share * (1 + e) * v
    assert ball.velocity[0, 1] == pytest.approx(-v + normal, rel=1e-5)
    assert ball.velocity[0, 0] == pytest.approx(u - min(mu * normal, share * u), abs=1e-5)
    assert (world.spin == 0).all()


@pytest.mark.parametrize(
    ("shape", "filled", "dtype"),
    [
        ("disc", False, np.float32),
        ("box", True, np.float64),
        pytest.param("disc", True, np.float32, marks=pytest.mark.slow),
        pytest.param("disc", False, np.float64, marks=pytest.mark.slow),
    ],
)
def test_soft_bodies_do_not_creep(shape: str, filled: bool, dtype: Any) -> None:
    """Their particles are no wheels: friction holds them. Round ones rock on their corners, less by a factor of e in 4 s."""
    world = pv.World(boundary=pv.Box((-9, 0), (9, 5), friction=0.5), collisions=pv.Collisions(friction=0.5), dtype=dtype)
    outline = pv.builders.disc((0.3, 0.55), 0.5) if shape == "disc" else pv.builders.box((-0.8, 0.1), (0.8, 1.1))
    group = pv.soft_body(world, outline, spacing=0.15, filled=filled).group
    world.run(seconds=25 if shape == "disc" else 8, dt=1 / 60)
    middle = float(group.position[:, 0].mean(dtype=float))
    world.run(seconds=5, dt=1 / 60)
    assert abs(float(group.position[:, 0].mean(dtype=float)) - middle) / 5 < 5e-5
    assert np.hypot(*world.velocity.T).max() < 2e-3


def test_it_is_kept_and_wakes() -> None:
    world = pv.World(boundary=pv.Box((-90, 0), (90, 9), friction=0.2), dtype=np.float64, sleep=True)
    world.add(position=[(0, 0.5), (5, 0.5)], radius=0.5, fixed_rotation=True)
    world.run(seconds=2)
    assert world.asleep.all()
    world.fixed_rotation[0] = 0
    world.step(1 / 60)
    assert not world.asleep[0]
    twin = copy.deepcopy(world)
    for each in (world, twin):
        each.velocity[:, 0] = 1
        each.run(seconds=1)
    assert world.state_hash() == twin.state_hash()
    assert world.spin[0] < 0 == world.spin[1]
