"""What a pair does is decided by the pair: a circle many times as large elsewhere in the world changes nothing of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("giant", [0.0, 0.3, 10.0, 900.0])
@pytest.mark.parametrize("offset", [0.0, 0.05, 0.12, 0.13])
def test_smooth_inelastic_circles_leave_along_the_tangent_of_where_they_touch(offset: float, giant: float, dtype: Any) -> None:
    # Two of equal mass that meet with speeds v and -v, e = 0: along the normal n both stop, across it each keeps its speed.
    # Pairs that begin a substep farther apart than a part of their radius are impacts; that part was one of the largest radius.
    world = pv.World(gravity=(0, 0), dtype=dtype)
    if giant:
        world.add(position=(1000, 0), radius=giant)
    pair = world.add(position=[(0, 0), (1.0, offset)], radius=0.1, velocity=[(4.0, 0), (-4.0, 0)])
    world.run(seconds=0.4)
    sine = offset / 0.2
    across = np.array((-sine, np.sqrt(1 - sine * sine)))
    kept = 4.0 * across[0] * across
    assert pair.velocity[0] == pytest.approx(kept, abs=1e-4 if dtype == np.float32 else 1e-12)
    assert pair.velocity[1] == pytest.approx(-kept, abs=1e-4 if dtype == np.float32 else 1e-12)


@pytest.mark.parametrize("seed", [0, 3, pytest.param(8, marks=pytest.mark.slow)])
def test_dolls_that_hang_on_bars_are_not_thrown(seed: int) -> None:
    # A stretched arm whose hand lies on a bar: the hand was taken to be held by it where the arm pulled it off, and the answer
    # threw it at 1e16 m/s. Nothing gives a doll more than its fall, sqrt(2 g 11 m) = 15 m/s, and its swing.
    world = pv.scenes.get("ragdoll").world(particles=120, seed=seed)
    for _ in range(240):
        world.step(1 / 60)
        assert np.hypot(*world.velocity.T).max() < 40
