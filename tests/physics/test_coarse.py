"""A step too coarse for a gas is said once, by who and what would do."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.ground.constants import GAS_STEP
from pyverlet.lab import pressure
from pyverlet.scenes.gas import henderson


def gas(speed: float, *, count: int = 144, substeps: int = 8, gravity: float = 0.0, restitution: float = 1.0) -> pv.World:
    rng = np.random.default_rng(0)
    world = pv.World(
        gravity=(0, -gravity),
        boundary=pv.Box((0, 0), (20, 20), restitution=1),
        collisions=pv.Collisions(restitution=restitution),
        substeps=substeps,
    )
    angle, side = rng.uniform(0, 2 * np.pi, count), int(np.sqrt(count))
    place = (np.arange(side) + 0.5) * 20 / side
    where = np.stack(np.meshgrid(place, place), -1).reshape(-1, 2)
    world.add(position=where, velocity=speed * np.column_stack((np.cos(angle), np.sin(angle))), radius=0.5)
    return world


def test_a_coarse_step_is_said_once_with_what_would_do() -> None:
    # v h / r = 60 / 480 / 0.5 = 0.25: 2.5 times the step that is stated, so 20 substeps instead of 8.
    world = gas(60.0)
    fastest = int(np.hypot(*world.velocity.T).argmax())
    world.velocity[fastest] *= 1.01
    with pytest.warns(
        pv.CoarseStepWarning, match=r"particle \d+ moves by .* of its radius .* allowed are substeps of at least (20|21)"
    ) as said:
        world.run(seconds=0.5)
    assert len(said) == 1
    assert said[0].filename == __file__ or "convenience.py" in said[0].filename  # run() is one call further
    world.substeps = 21
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        world.run(seconds=0.2)


@pytest.mark.parametrize("options", [{"count": 81}, {"gravity": 9.81}, {"restitution": 0.0}])
def test_what_is_no_gas_is_let_be(options: dict[str, float]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gas(60.0, **options).run(seconds=0.3)  # type: ignore[arg-type]
        gas(0.9 * GAS_STEP * 0.5 * 480).run(seconds=0.3)


def test_a_gas_presses_as_henderson_says_at_the_stated_step_and_beyond() -> None:
    # Some 3,000 impacts on the walls in 6 s, correlated over a few: 3 % of statistics. Walls add some more: an edge of r in 18 m.
    fine = pressure.measure(0.6, GAS_STEP, seconds=6.0)
    coarse = pressure.measure(0.6, 3 * GAS_STEP, seconds=6.0)
    for measured in (fine, coarse):
        assert measured.compressibility == pytest.approx(henderson(0.6), rel=0.08)
    assert fine.overlap < coarse.overlap
