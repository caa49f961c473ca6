"""Rooms of a user's own that are made of those of the library: their walls confine circles after each substep."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.state.slots import Slots

G, RADIUS = 9.81, 0.5


class MyBox(pv.Box):
    """A box that counts how often it is asked."""

    asked = 0

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        super().confine(state, h, lag, rest_speed)
        self.asked += 1


class MyCage(pv.Circle):
    """A cage with a method of its own."""

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        super().confine(state, h, lag, rest_speed)


def room(kind: str, **law: Any) -> Any:
    return MyBox((-20, 0), (20, 40), **law) if kind == "box" else MyCage(center=(0, 20), radius=20, **law)


@pytest.mark.parametrize("name", [n for n, c in pv.integrators.BY_NAME.items() if c.order >= 2])
@pytest.mark.parametrize("kind", ["box", "cage"])
def test_a_bounce_is_exact(kind: str, name: str) -> None:
    # Dropped from H: e^2 H is left. Flight is exact for methods of order 2 and more, and so is the impact in closed form.
    drop, e = 2.0, 0.8
    world = pv.World(boundary=room(kind, restitution=e), integrator=pv.integrators.BY_NAME[name](), dtype=np.float64)
    world.add(position=(0, RADIUS + drop), radius=RADIUS)
    world.run(seconds=1.0)  # it meets the floor after 0.64 s
    (_, y), (_, v) = world.position[0], world.velocity[0]
    assert y - RADIUS + v * v / (2 * G) == pytest.approx(e * e * drop, rel=1e-9)


@pytest.mark.parametrize("kind", ["box", "cage"])
def test_what_does_not_bounce_lies_on_the_wall(kind: str) -> None:
    world = pv.World(boundary=(mine := room(kind)), dtype=np.float64)
    world.add(position=(0, 1.0), radius=RADIUS)
    world.run(seconds=1.0)
    assert world.position[0] == pytest.approx([0, RADIUS], abs=1e-12)
    assert world.velocity[0] == pytest.approx([0, 0], abs=1e-12)
    assert kind == "cage" or mine.asked == 60 * world.substeps


def test_a_sliding_disc_comes_to_roll() -> None:
    # m r v + I w about the point of contact is kept: v = 2 v_0 / 3 for I = m r^2 / 2, once mu g t = v_0 / 3.
    world = pv.World(boundary=room("box", friction=0.5), dtype=np.float64)
    world.add(position=(-10, RADIUS), velocity=(3.0, 0), radius=RADIUS)
    world.run(seconds=1.0)
    assert world.velocity[0] == pytest.approx([2.0, 0], abs=1e-9)
    assert world.spin[0] == pytest.approx(-2.0 / RADIUS, abs=1e-9)


def test_a_drum_takes_a_disc_along() -> None:
    # The rim of the disc comes to run with the wall, v_t + r w = R W. Along a round wall a straight substep of length v h ends
    # with 1 - cos(v h / R), 4e-7, less speed, of which friction has given back all but the last.
    world = pv.World(gravity=(0, 0), boundary=room("cage", friction=0.9, angular_velocity=0.5), dtype=np.float64)
    world.add(position=(0, RADIUS), velocity=(8.0, 0), radius=RADIUS)
    world.run(seconds=2.0)
    x, y = world.position[0] - (0, 20)
    (vx, vy), spin = world.velocity[0], world.spin[0]
    assert np.hypot(x, y) == pytest.approx(20 - RADIUS, abs=1e-9)
    assert (x * vy - y * vx) / np.hypot(x, y) + RADIUS * spin == pytest.approx(10.0, abs=1e-5)


def test_own_numbers_of_circles_count() -> None:
    # The larger e, and the geometric mean of the frictions: sqrt(0.4 * 0.1) g = 0.2 g slows it down.
    world = pv.World(boundary=room("box", restitution=0.2, friction=0.4), dtype=np.float64)
    world.add(position=(-10, RADIUS), velocity=(5.0, 0), radius=RADIUS, friction=0.1)
    world.add(position=(10, RADIUS + 1.0), radius=RADIUS, restitution=0.7)
    world.run(seconds=0.5)
    assert world.velocity[0, 0] == pytest.approx(5.0 - 0.5 * 0.2 * G, abs=1e-9)
    (_, y), (_, v) = world.position[1], world.velocity[1]
    assert y - RADIUS + v * v / (2 * G) == pytest.approx(0.49, rel=1e-9)


def test_events_tell_who_meets_the_walls() -> None:
    # Dropped from 1 m it meets the floor with sqrt(2 g), and stays: one begin, no end.
    world = pv.World(boundary=room("box"), events=True, dtype=np.float64)
    world.add(position=(0, RADIUS + 1.0), radius=RADIUS)
    begun: list[tuple[Any, ...]] = []
    for _ in range(60):
        world.step(1 / 60)
        begun += [tuple(row) for row in world.events.begin[["a", "b", "wall", "speed"]].tolist()]
        assert len(world.events.end) == 0
    assert begun == [(0, -1, 2, pytest.approx(np.sqrt(2 * G), rel=1e-9))]


def test_a_ledger_explains_what_walls_take() -> None:
    # It falls 1 m and stays: m g H, all of it taken by the impact with e = 0, which such walls do not tell from pushing.
    world = pv.World(boundary=room("box"), ledger=True, dtype=np.float64)
    world.add(position=(0, RADIUS + 1.0), radius=RADIUS, mass=2.0)
    world.run(seconds=3.0)
    assert world.ledger.restitution == pytest.approx(-2.0 * G, abs=1e-9)
    assert world.ledger.residual == pytest.approx(0.0, abs=1e-9)
    assert world.ledger.total == pytest.approx(world.energy().total, abs=1e-9)
