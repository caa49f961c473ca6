"""What lies close together and falls as one: a blow on all at once gives no energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G, RADIUS = 9.81, 0.5
H = 1 / 480


def block(
    world: pv.World, *, gap: float = 0.01, shaken: float = 0.005, high: float = 10.0, hexagonal: bool = False, left: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Places of 200 circles in rows of 16, and random numbers of 0 to 1 for each."""
    rng = np.random.default_rng(0)
    row, column = np.divmod(np.arange(200), 16)
    x = left + column + 0.5 + 0.5 * hexagonal * (row % 2)
    y = high + 0.5 + row * (np.sqrt(3) / 2 if hexagonal else 1)
    return (1 + gap) * np.column_stack((x, y)) + rng.uniform(-shaken, shaken, (200, 2)), rng.random(200)


@pytest.mark.parametrize(
    ("placed", "world", "times", "dt"),
    [
        ({}, {}, 1, 1 / 60),
        ({}, {"dtype": np.float64}, 1, 1 / 60),
        ({}, {"substeps": 16}, 1, 1 / 60),
        ({}, {}, 1, 1 / 240),
        ({"gap": 0.0, "shaken": 0.0}, {}, 1, 1 / 60),
        ({"gap": 0.02}, {}, 1, 1 / 60),
        ({"hexagonal": True}, {}, 1, 1 / 60),
        ({"high": 2.0}, {}, 1, 1 / 60),
        ({}, {"collisions": pv.Collisions(friction=0.3)}, 1, 1 / 60),
        ({}, {"collisions": pv.Collisions(restitution=0.3)}, 1, 1 / 60),
        ({}, {}, 100, 1 / 60),
    ],
)
def test_a_block_that_falls_gains_nothing(placed: dict[str, Any], world: dict[str, Any], times: float, dt: float) -> None:
    # Contacts without elastic bounces only take energy: E of the next frame is no larger, but for the work of pushing out what
    # the blow has pressed into each other. Jams whose blow was over gave 2 to 9 % of m g H in a frame.
    w = pv.World(boundary=pv.Box((0, 0), (19, 40)), ledger=True, **({"collisions": pv.Collisions()} | world))
    place, chance = block(w, **placed)
    w.add(position=place, radius=RADIUS, mass=times**chance)
    rise, scale = 0.0, float(w.mass.sum()) * G * place[:, 1].mean()
    for _ in range(round(2.5 / dt)):
        before, taken = w.energy().total, w.ledger.limiter
        w.step(dt)
        rise = max(rise, w.energy().total - before + taken - w.ledger.limiter)
    assert rise < 1e-2 * scale
    assert -w.ledger.limiter < 1e-2 * scale  # it took 0.02 to 0.2


def test_a_heap_next_to_a_jam_keeps_what_it_carries() -> None:
    # Contacts that forget are those that push: a heap at rest in the same rows of cells, 25 m aside, stays at rest. If it had to
    # carry its load anew, it would begin to fall: its speed would grow by g h in each substep of the jam, and there are twenty.
    w = pv.World(boundary=pv.Box((0, 0), (60, 40)), collisions=pv.Collisions(), dtype=np.float64)
    row, column = np.divmod(np.arange(60), 10)
    w.obstacles.append(pv.Segment((11.2, 0), (11.2, 9)))
    heap = w.add(position=np.column_stack((0.6 + 1.06 * column + 0.3 * (row % 2), 0.5 + 0.95 * row)), radius=RADIUS)
    w.run(seconds=15)
    assert np.abs(heap.velocity).max() < G * H
    place, _ = block(w, left=36.0)
    w.add(position=place, radius=RADIUS)
    fastest = 0.0
    for _ in range(120):
        w.step(1 / 60)
        fastest = max(fastest, float(np.abs(heap.velocity).max()))
    assert fastest < 2 * G * H
