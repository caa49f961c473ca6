"""What touching circles push each other with, as the page shows it, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.touches import Pushes

G = 9.81


def looked_at(world: pv.World) -> Pushes:
    """The contacts of a world at rest."""
    with world.noting_contacts() as touches:
        world.step(1 / 60)
    found = touches.pushes()
    assert found is not None
    return found


def test_a_column_carries_what_is_above() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (1, 8)), dtype=float)
    world.add(position=[(0.5, 0.5 + k) for k in range(5)], radius=0.5, mass=2.0)
    world.run(seconds=2)
    found = looked_at(world)
    force = {tuple(pair): value for pair, value in zip(found.pairs.tolist(), found.force, strict=True) if value > 1e-6}
    # Contact k, k + 1 carries the 4 - k circles above it: (4 - k) m g; the floor carries all five.
    expected = {(k, k + 1): (4 - k) * 2.0 * G for k in range(4)} | {(0, 0): 5 * 2.0 * G}
    assert force.keys() == expected.keys()
    assert [force[key] for key in expected] == pytest.approx(list(expected.values()), rel=1e-6)
    up = found.angle[(found.pairs[:, 0] != found.pairs[:, 1]) & (found.force > 0)]
    assert up == pytest.approx(np.full(len(up), math.pi / 2), abs=1e-3)


def test_one_on_two() -> None:
    # Without friction, a circle on two pinned ones that are 2 a apart: each pushes with m g / (2 cos b), sin b = a / 2r.
    world = pv.World(dtype=float)
    world.add(position=[(-0.6, 0), (0.6, 0)], radius=0.5).pin()
    world.add(position=(0, 0.8), radius=0.5, mass=3.0)
    world.run(seconds=2)
    found = looked_at(world)
    assert found.pairs[found.force > 1e-6].tolist() == [[0, 2], [1, 2]]
    assert found.force[found.force > 1e-6] == pytest.approx(3.0 * G / (2 * 0.8), rel=2e-3)


def test_looking_changes_no_bit() -> None:
    looked, alone = (pv.scenes.get("cage").world(particles=80) for _ in range(2))
    for _ in range(40):
        with looked.noting_contacts():
            looked.step(1 / 60)
        alone.step(1 / 60)
    assert looked.state_hash() == alone.state_hash()
    with pytest.raises(pv.InputError, match="contacts are off"):
        _ = looked.contacts
