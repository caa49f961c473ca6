"""What stiff links hold is F^2 / 2 k, however coarse coordinates are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

LINKS: dict[str, Any] = {
    "spring": lambda bob, k: pv.Spring(bob, 0, 1, stiffness=k),
    "damped": lambda bob, k: pv.Spring(bob, 0, 1, stiffness=k, damping=1e-4 * k),
    "stick": lambda bob, k: pv.Stick(bob, 0, 1, compliance=1 / k),
    "rope": lambda bob, k: pv.Rope(bob, 0, 1, compliance=1 / k),
}


@pytest.mark.parametrize("kind", LINKS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("away", "stiffness"), [(3.1, 1e10), (3.1, 1e7), (500.0, 1e8)])
def test_a_weight_that_hangs_stores_what_is_on_paper(kind: str, dtype: type[np.float32], away: float, stiffness: float) -> None:
    world = pv.World(dtype=dtype)
    bob = world.add(position=[(away, 7.3), (away, 6.3)], radius=0.1, mass=2.0)
    bob.pin(0)
    world.links.append(LINKS[kind](bob, stiffness))
    assert world.energy().links <= 1e-3
    world.run(seconds=1)
    expected = (2 * 9.81) ** 2 / (2 * stiffness)
    seen = []
    for _ in range(10):
        world.step(1 / 60)
        seen.append(world.energy().links / expected)
    assert seen == pytest.approx([1] * 10, rel=0.03 if away > 100 else 0.01)


def test_a_stretch_that_can_be_seen_is_measured() -> None:
    world = pv.World(gravity=(0, 0))
    pair = world.add(position=[(3.0, 7.0), (4.0, 7.0)], radius=0.1)
    world.links.append(pv.Spring(pair, 0, 1, stiffness=1e6, length=0.99))
    assert world.energy().links == pytest.approx(0.5e6 * 1e-4, rel=1e-3)


def test_what_links_show_is_no_more_than_their_coordinates_hide() -> None:
    # An obstacle throws an angle about: its force is no measure of what it holds then. The ledger, by positions, closes.
    rng = np.random.default_rng(256)
    world = pv.World(ledger=True, threads=1)
    circles = world.add(position=rng.uniform(-6.36, 6.36, (6, 2)), radius=0.921)
    world.links.append(pv.Angle(circles, np.arange(4), np.arange(1, 5), np.arange(2, 6), compliance=0.00154))
    world.obstacles.append(pv.Capsule((8.92, -4.55), (-0.817, 5.79), radius=0.3))
    world.step(1 / 240)
    assert sum(vars(world.ledger).values()) == pytest.approx(world.energy().total, rel=1e-6)
