"""Friction eight pairs at a time against one pair after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.contacts.collisions import ContactSolver

N = 203


def couples(dtype: Any, varied: bool) -> pv.World:
    """N pairs of spinning circles, each about to meet far from all others; `varied`: half with a friction of their own."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, N)
    to = np.column_stack((np.cos(angle), np.sin(angle)))
    radius = rng.uniform(0.4, 0.6, (N, 2)) if varied else np.full((N, 2), 0.5)
    middle = np.column_stack((4.0 * (np.arange(N) % 20), 4.0 * (np.arange(N) // 20)))
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(friction=0.3), dtype=dtype, threads=1, ledger=True)
    for side, sign in enumerate((-1, 1)):
        circles = world.add(
            position=middle + 1.001 * sign * radius[:, side, None] * to,
            velocity=rng.normal(0, 0.2, (N, 2)) - sign * to,
            radius=radius[:, side],
            mass=rng.uniform(1, 3, N) if varied else 1.0,
        )
        circles.spin = rng.normal(0, 2, N)
        if varied:
            circles.friction = np.where(rng.random(N) < 0.5, -1, rng.uniform(0, 1, N))
    return world


@pytest.mark.parametrize("varied", [False, True])
@pytest.mark.parametrize(("dtype", "rounding"), [(np.float32, 2e-5), (np.float64, 1e-12)])
def test_a_pair_alone_gets_the_same(dtype: Any, rounding: float, varied: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    eight, one = couples(dtype, varied), couples(dtype, varied)
    before = one._state.spin.copy()
    for _ in range(4):
        eight.step(1 / 60)
    monkeypatch.setattr(ContactSolver, "_eight", lambda self, state: False)
    for _ in range(4):
        one.step(1 / 60)
    assert (np.abs(one._state.spin - before) > 1e-3).mean() > 0.5  # they have met, and rubbed
    # Normals are those before the grip has moved the circles across: its shift is at most PUSHED / FED h times the change of
    # velocity, 0.4 / 480 s * 1 m/s, so that they differ by 1e-3 rad, and impulses of 1 m/s by no more than that.
    for name in ("position", "velocity", "spin"):
        assert getattr(eight._state, name) == pytest.approx(getattr(one._state, name), abs=2e-3), name
    assert eight.ledger.friction == pytest.approx(one.ledger.friction, rel=2e-3)
    # The momentum of each pair stays what it was, to rounding.
    start = couples(dtype, varied)
    for world in (eight, one):
        before, after = ((w._state.mass[:, None] * w._state.velocity).reshape(2, N, 2).sum(axis=0) for w in (start, world))
        assert after == pytest.approx(before, abs=10 * rounding)


def test_friction_may_change_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    # A heap that stands by its friction goes on standing when a bouncing circle far away sends contacts the other way, and back.
    world = pv.World(boundary=pv.Box((-20, 0), (20, 20), friction=0.3), collisions=pv.Collisions(friction=0.3))
    heap = world.add(position=[(-0.5, 0.5), (0.5, 0.5), (0, 0.5 + np.sqrt(0.75))], radius=0.5)
    world.run(seconds=2)
    start = heap.position.astype(float)
    for _ in range(5):
        bouncer = world.add(position=(10, 5), radius=0.5, restitution=0.9)
        world.run(seconds=0.5)
        world.remove(bouncer)
        world.run(seconds=0.5)
    # tan 15 degrees is 0.268: it stands by the slip that its contacts remember.
    assert np.abs(heap.position - start).max() < 1e-3
