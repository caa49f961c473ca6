"""Energies in vectors against those one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pyverlet import core


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 100, 10_000])
@pytest.mark.parametrize("lag", [0.0, 0.01])
def test_mechanical_energy_is_the_sum_of_all_three(dtype: Any, count: int, lag: float) -> None:
    rng = np.random.default_rng(count)
    position, velocity, acceleration = rng.normal(0, 10, (3, count, 2)).astype(dtype)
    spin, radius, mass = rng.uniform(0.5, 2, (3, count)).astype(dtype)
    mass[rng.random(count) < 0.1] = np.inf
    total = core.unit("motion", dtype).total_energy(position, velocity, acceleration, lag, spin, radius, mass, 1.0, -9.81)
    moved = velocity.astype(float) + lag * acceleration.astype(float)
    arrays = (array.astype(float) for array in (position, moved, spin, radius, mass))
    parts = core.unit("engine", float).energies(*arrays, 1.0, -9.81)
    # 10,000 terms of up to some 1e3 J, which cancel in part, each rounded in float64.
    assert total == pytest.approx(sum(parts), rel=1e-12, abs=1e-9)
