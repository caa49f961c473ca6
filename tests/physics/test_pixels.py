"""A world in pixels is as good as one in metres: gravity 1,000 pixels/s^2, radii of 2 to 20.

All lengths times k are the same world if gravity is, too: times stay, speeds go with k, energies with k^2. So every promise is
asked of a world in metres and of the same one in units of 1/40 m, with g = 1,000 instead of 25.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

K = 40.0
"""Pixels a metre."""

G = 25.0
"""m/s^2: 1,000 pixels/s^2."""


def world(k: float, **options: Any) -> pv.World:
    return pv.World(gravity=(0, -G * k), boundary=pv.Box((0, 0), (20 * k, 15 * k), **options.pop("walls", {})), **options)


def rebound(k: float) -> float:
    """Part of its drop that a ball comes back to: e^2."""
    w = world(k, walls={"restitution": 0.8})
    ball = w.add(position=(5 * k, 6 * k), radius=0.2 * k)
    top = 0.0
    for _ in range(90):
        w.step(1 / 60)
        if ball.velocity[0, 1] > 0:
            top = max(top, float(ball.position[0, 1]) + float(ball.velocity[0, 1]) ** 2 / (2 * G * k))
    return (top - 0.2 * k) / (5.8 * k)


def gas(k: float) -> float:
    """Relative change of an elastic gas's energy in 2 s, without gravity."""
    rng = np.random.default_rng(0)
    w = world(k, walls={"restitution": 1.0}, collisions=pv.Collisions(restitution=1.0))
    w.gravity = (0, 0)
    place = np.stack(np.meshgrid(np.arange(12) + 1.0, np.arange(12) + 1.0), -1).reshape(-1, 2)
    w.add(position=place * k, velocity=rng.normal(0, 2, (144, 2)) * k, radius=rng.uniform(0.05, 0.45, 144) * k)
    start = w.energy().kinetic
    w.run(seconds=2)
    return w.energy().kinetic / start - 1


def rolling(k: float) -> float:
    """What is left of its speed when a sliding disc has come to roll: 2/3."""
    w = world(k, walls={"friction": 0.5})
    disc = w.add(position=(2 * k, 0.1 * k), velocity=(4 * k, 0), radius=0.1 * k)
    w.run(seconds=1.5)
    return float(disc.velocity[0, 0]) / (4 * k)


def slope(k: float) -> float:
    """Acceleration down a ramp of slope 1/2 over g: sin(a) / 1.5 of what rolls."""
    w = world(k)
    w.obstacles.append(pv.Segment((0, 10 * k), (20 * k, 0), friction=1.0))
    out = np.array((1.0, 2.0)) / np.sqrt(5)
    disc = w.add(position=(np.array((2.0, 9.0)) + 0.3 * out) * k, radius=0.3 * k)
    w.run(seconds=1)
    return float(np.hypot(*disc.velocity[0]) / (G * k) * 1.5 * np.sqrt(5))


def settled(k: float) -> tuple[float, float, float]:
    """Largest overlap of a pile of radii 2 to 20 pixels, its motion over m g r, and the most its energy has risen in a frame."""
    rng = np.random.default_rng(1)
    w = world(k, collisions=pv.Collisions(friction=0.4))
    place = np.stack(np.meshgrid(np.arange(18) + 1.0, np.arange(8) * 1.05 + 1.0), -1).reshape(-1, 2)
    w.add(position=place * k, radius=rng.uniform(0.05, 0.5, len(place)) * k, density=1.0)
    size = float(w.mass.sum()) * G * k * 15 * k
    before, rise = w.energy().total, 0.0
    for _ in range(420):
        w.step(1 / 60)
        now = w.energy().total
        rise, before = max(rise, (now - before) / size), now
    moves = w.energy().kinetic / float((w.mass.astype(float) * w.radius * G * k).sum())
    return w.overlap().max, moves, rise


def nobody_escapes(k: float) -> int:
    """Circles outside after a second of a room that they fill at 100 radii a substep."""
    rng = np.random.default_rng(2)
    w = world(k, walls={"restitution": 0.9}, collisions=None)
    w.add(position=rng.uniform(1, 14, (100, 2)) * k, velocity=rng.normal(0, 5e3, (100, 2)) * k, radius=0.1 * k)
    w.run(seconds=1)
    return w.escaped()


@pytest.mark.parametrize(
    ("promise", "paper", "within"),
    [(rebound, 0.64, 0.01), (gas, 0.0, 1e-4), (rolling, 2 / 3, 1e-3), (slope, 1.0, 5e-3), (nobody_escapes, 0, 0)],
)
@pytest.mark.parametrize("k", [1.0, K])
def test_promises_hold_in_pixels_as_in_metres(promise: Callable[[float], float], paper: float, within: float, k: float) -> None:
    assert promise(k) == pytest.approx(paper, abs=within)


@pytest.mark.parametrize("k", [1.0, K])
def test_a_pile_rests_in_pixels_as_in_metres(k: float) -> None:
    overlap, moves, rise = settled(k)
    assert overlap < 0.1
    assert moves < 1e-4
    assert rise <= 1e-4
