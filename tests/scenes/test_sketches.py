"""The bouncing sketches: each shows what its docstring says is true."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import scenes
from pyverlet.scenes import bounce
from pyverlet.scenes.bounce import GRAVITY

DT, G = 1 / 60, 9.81


def heights(name: str, seconds: float, **overrides: Any) -> Iterator[tuple[str, np.ndarray, pv.World]]:
    """(name, heights of the first ball frame by frame, the world at the end) of every panel."""
    panels = scenes.get(name).panels(**overrides)
    frames = []
    for _ in range(round(seconds / DT)):
        panels.step(DT)
        frames.append([float(world.position[0, 1]) for world in panels.worlds])
    yield from zip([panel.name for panel in panels], np.array(frames).T, panels.worlds, strict=True)


def apexes(y: np.ndarray) -> np.ndarray:
    """Local maxima of heights; of two equal neighbours one."""
    inner = y[1:-1]
    return inner[(inner > y[2:]) & (inner >= y[:-2])]


def test_bounce_euler_climbs() -> None:
    ((_, y, _),) = heights("bounce-euler", 30)
    tops = apexes(y)
    assert (np.diff(tops) > 0).all()
    assert tops[-1] > 1.5 * bounce.HEIGHT


def test_bounce_order_gains_on_the_left_and_loses_on_the_right() -> None:
    (_, first, _), (_, second, _) = heights("bounce-order", 30)
    assert apexes(first)[-1] > 1.5 * bounce.HEIGHT
    assert apexes(second)[-1] < 0.9 * bounce.HEIGHT


def test_bounce_rest_keeps_its_height_to_the_last_bit() -> None:
    ((_, y, _),) = heights("bounce-rest", 60)
    tops = apexes(y)
    assert len(tops) > 30
    assert set(tops) == {tops[0]}
    # The first bounce lands on the lattice: n (n + 1) / 2 of g h^2 above the wall.
    cells = (tops[0] - bounce.RADIUS) / (-GRAVITY * DT**2)
    n = round((np.sqrt(1 + 8 * cells) - 1) / 2)
    assert cells == pytest.approx(n * (n + 1) / 2, rel=1e-9)


def test_bounce_rest_is_a_coincidence() -> None:
    # The least change of gravity, and rounding or the lattice takes energy at some bounces.
    ((_, y, _),) = heights("bounce-rest", 60, gravity=(0.0, -9.81))
    assert apexes(y)[-1] < 0.8 * bounce.HEIGHT


def test_bounce_random_loses() -> None:
    (world,) = scenes.get("bounce-random").panels().worlds
    start = world.energy().total
    world.run(seconds=60, dt=DT)
    assert world.energy().total < 0.8 * start


def test_frame_rate_matters_raw_and_not_with_the_clock() -> None:
    raw, slow_raw, clock, slow_clock = (world for _, _, world in heights("frame-rate", 10))
    assert clock.frames == slow_clock.frames == 600
    assert slow_raw.frames == 100
    assert clock.state_hash() == slow_clock.state_hash() == raw.state_hash()
    assert slow_raw.time == pytest.approx(raw.time)
    assert abs(slow_raw.position[0, 1] - raw.position[0, 1]) > 0.1


def test_bounce_verlet() -> None:
    (_, flipped, _), (_, projected, _), (_, met, real) = heights("bounce-verlet", 20)
    assert apexes(flipped)[-1] < 0.95 * bounce.HEIGHT
    assert len(apexes(projected[60:])) == 0
    assert projected[-1] == pytest.approx(bounce.RADIUS)
    # A frame rarely falls on the apex: at most g dt^2 / 8 below it.
    assert apexes(met).min() == pytest.approx(bounce.HEIGHT, abs=G * DT**2 / 8 * 1.001)
    assert real.energy().total == pytest.approx(G * bounce.HEIGHT, rel=1e-9)


@pytest.mark.parametrize("name", ["energy-1-substep", "energy-10-substeps"])
def test_verlet_and_semi_implicit_euler_reach_the_same_heights(name: str) -> None:
    (_, verlet, a), (_, euler, b) = heights(name, 8)
    assert np.abs(verlet - euler).max() < 1e-10
    # Verlet's velocity is half a step further, v - g h / 2: the energies differ by (v^2 - (v - g h / 2)^2) / 2.
    h, v = DT / a.substeps, float(b.velocity[0, 1])
    difference = b.energy().total - a.energy().total
    assert difference == pytest.approx((v**2 - (v - G * h / 2) ** 2) / 2, rel=1e-6)


@pytest.mark.slow
def test_more_substeps_make_a_firmer_heap() -> None:
    # Overlap at rest goes with h^2: 6 substeps leave a 36th of 1, give or take what still moves. The largest of 400 is luck.
    overlaps = [world.overlap().mean for _, _, world in heights("cage-brute-force", 10)]
    assert overlaps[0] > 2 * overlaps[1] > 8 * overlaps[2]


def test_options_and_variants() -> None:
    order = scenes.get("bounce-order")
    assert [panel.name for panel in order.panels(particles=3)] == ["position first", "velocity first"]
    assert [len(world) for world in order.panels(particles=3).worlds] == [3, 3]
    assert [panel.name for panel in order.panels(integrators=[pv.RK4(), pv.Yoshida4()])] == ["rk4", "yoshida4"]
    # What the variants differ in, set by hand, leaves one world.
    (only,) = order.panels(integrators=[pv.RK4()])
    assert isinstance(only.world.integrator, pv.RK4)
    (only,) = scenes.get("cage-brute-force").panels(substeps=3, particles=20)
    assert only.world.substeps == 3


@pytest.mark.parametrize("name", ["bounce-euler", "bounce-order", "frame-rate"])
def test_the_sketches_have_no_friction(name: str) -> None:
    with pytest.raises(pv.InputError, match=r"friction of the room is 0\.1"):
        scenes.get(name).panels(friction=0.1)
