"""Contacts, forces and pressure under the contact law: read from the impulses, not found afterwards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.touches import vectors

G, FRAME = 9.81, 1 / 60


def world(**more: Any) -> pv.World:
    law = {name: more.pop(name) for name in ("friction", "restitution") if name in more}
    return pv.World(collisions=pv.Collisions(**law), contacts=True, **more)


@pytest.mark.parametrize(("dtype", "within"), [(np.float32, 1e-6), (np.float64, 1e-12)])
@pytest.mark.parametrize("count", [1, 10])
def test_a_floor_under_discs_bears_their_weight(count: int, dtype: Any, within: float) -> None:
    # m g dt in each frame, whatever its length.
    discs = world(boundary=pv.Box((0, 0), (10, 3)), dtype=dtype)
    discs.add(position=[(k + 0.5, 0.5) for k in range(count)], radius=0.5, mass=2.0)
    for dt in np.random.default_rng(0).choice([1 / 240, FRAME, 1 / 30], 300):
        discs.step(float(dt))
    assert discs.force_on(discs.boundary) == pytest.approx([0, -2 * count * G], abs=within * 2 * count * G)
    floor = discs.contacts[discs.contacts["wall"] == 2]
    assert floor["impulse"] == pytest.approx(np.full(count, 2 * G * float(dt)), rel=5 * within)
    assert discs.pressure() == pytest.approx(2 * count * G / 26, rel=within)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_what_contacts_give_is_what_momenta_change_by(friction: float) -> None:
    # m dv = m g dt + the sum of what a disc's contacts gave: to rounding at rest, where the velocity shown is that of the end.
    chance = np.random.default_rng(2)
    heap = world(boundary=pv.Box((0, 0), (6, 20), friction=friction), friction=friction, dtype=np.float64)
    heap.add(position=np.stack(np.meshgrid(np.arange(5) + 0.6, np.arange(6) + 0.6), -1).reshape(-1, 2), radius=0.45, mass=2.0)
    heap.position[:] += chance.normal(0, 0.02, heap.position.shape)
    heap.run(seconds=8)
    heap.step(FRAME)
    contacts = heap.contacts
    given, pairs, got = vectors(contacts), contacts["b"] >= 0, np.zeros((30, 2))
    np.subtract.at(got, contacts["a"], given)
    np.add.at(got, contacts["b"][pairs], given[pairs])
    moving = 2.0 * np.hypot(*heap.velocity.T).max()
    assert got == pytest.approx(np.tile((0, 2 * G * FRAME), (30, 1)), abs=1e-9 + 2 * moving)
    assert (contacts["impulse"] > 0).all()
    assert (np.abs(contacts["rub"]) <= friction * contacts["impulse"] * (1 + 1e-9) + 1e-9 + 2 * moving).all()


def test_the_pressure_of_a_gas_without_walls_is_that_of_its_virial() -> None:
    # p A = N k T (1 + B N / A) for hard discs, B = pi d^2 / 2; k T is half the mean of m v^2. 2 % are 400 impacts a disc.
    side, count, radius = 20.0, 100, 0.25
    gas = world(gravity=(0, 0), boundary=pv.Periodic((0, 0), (side, side)), restitution=1.0, dtype=np.float64)
    grid = np.stack(np.meshgrid(np.arange(10) * 2 + 1.0, np.arange(10) * 2 + 1.0), -1).reshape(-1, 2)
    velocity = np.random.default_rng(1).normal(0, 3, (count, 2))
    gas.add(position=grid, velocity=velocity - velocity.mean(axis=0), radius=radius)
    gas.run(seconds=2)
    seen = []
    for _ in range(1000):
        gas.step(FRAME)
        seen.append(gas.pressure())
    kt = 0.5 * float((gas.mass[:, None] * gas.velocity**2).sum()) / count
    density = count / side**2
    second, third = 0.5 * np.pi * (2 * radius) ** 2 * density, 0.782 * (0.5 * np.pi * (2 * radius) ** 2 * density) ** 2
    assert np.mean(seen) == pytest.approx(density * kt * (1 + second + third), rel=0.02)
