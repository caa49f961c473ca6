"""Thousands of Kepler periods: what `symplectic` is worth."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.lab.problems import PROBLEMS

STEPS = 20
"""A period: coarse on purpose. Samples follow 10 periods and a step, so that they visit all of the orbit."""


def energy_errors(integrator: pv.Integrator, periods: int) -> np.ndarray:
    """(k,) relative energy errors, one every 10 periods and 1/STEPS, of an orbit of eccentricity 0.3."""
    world = PROBLEMS["kepler orbit"].world(integrator)
    world.substeps = 10 * STEPS + 1
    start = world.energy().total
    errors = []
    for _ in range(periods // 10):
        world.step(world.substeps * 2 * np.pi / STEPS)
        errors.append(abs(world.energy().total / start - 1))
    return np.array(errors)


@pytest.mark.parametrize("periods", [1_000, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("integrator", [pv.VelocityVerlet(), pytest.param(pv.Yoshida4(), marks=pytest.mark.slow)], ids=repr)
def test_symplectic_energy_is_bounded_over_thousands_of_periods(integrator: pv.Integrator, periods: int) -> None:
    # A symplectic method conserves a modified energy H + O(h^p) but for exponentially small terms (Hairer, Lubich, Wanner, IX.8):
    # the error swings between the same bounds in the first thousand periods as in the last.
    errors = energy_errors(integrator, periods)
    assert errors[-100:].max() == pytest.approx(errors[:100].max(), rel=0.02)
    assert errors.max() < {2: 0.065, 4: 0.008}[integrator.order]


def test_rk4_drifts() -> None:
    # At the same step its error grows without end, although its order is 4: in 10 periods by what velocity Verlet's stays below
    # for ever, and after 50 the orbit is no orbit any more.
    errors = energy_errors(pv.RK4(), 400)
    assert (np.diff(errors[:5]) > 0.9 * errors[0]).all()
    assert errors[-1] > 1
