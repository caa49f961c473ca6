"""What lies close together and falls as one: a blow on all at once gives no energy."""

import numpy as np
import pytest

import pyverlet as pv

G, RADIUS = 9.81, 0.5


@pytest.mark.xfail(strict=True, reason="known limit of the contact law: 5 % of m g H in a frame, which the limiter takes back")
def test_a_block_that_falls_gains_nothing() -> None:
    # Contacts without restitution only take energy: E of the next frame is no larger, but for the work of pushing out what the
    # blow has pressed into each other, 2e-4 of m g H.
    row, column = np.divmod(np.arange(200), 16)
    shaken = np.random.default_rng(0).uniform(-0.005, 0.005, (200, 2))
    world = pv.World(boundary=pv.Box((0, 0), (19, 40)), collisions=pv.Collisions(), ledger=True)
    world.add(position=1.01 * np.column_stack((column + 0.5, row + 10.5)) + shaken, radius=RADIUS)
    rise, scale = 0.0, 200 * G * 23
    for _ in range(150):
        before, taken = world.energy().total, world.ledger.limiter
        world.step(1 / 60)
        rise = max(rise, world.energy().total - before + taken - world.ledger.limiter)
    assert rise < 2e-4 * scale
