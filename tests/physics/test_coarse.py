"""A gas keeps its pressure however far its circles move in a substep."""

from __future__ import annotations

import pytest

from pyverlet.lab import pressure
from pyverlet.scenes.gas import henderson


@pytest.mark.parametrize("step", [0.1, 0.3, 1.0])
def test_a_gas_presses_as_henderson_says(step: float) -> None:
    # Some 3,000 impacts on the walls in 6 s, correlated over a few: 3 % of statistics. Walls add some more: an edge of r in 18 m.
    assert pressure.measure(0.6, step, seconds=6.0).compressibility == pytest.approx(henderson(0.6), rel=0.08)
