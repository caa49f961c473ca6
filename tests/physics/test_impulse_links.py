"""Links under the law of impulses: pendulums, springs, chains and nets against closed forms and conservation laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import core
from pyverlet.compile import jit
from pyverlet.core import reference
from pyverlet.data import snapshot

G, FRAME = 9.81, 1 / 60


def made(**more: Any) -> pv.World:
    options: dict[str, Any] = {"collisions": pv.Collisions(impulses=True), "dtype": np.float64}
    return pv.World(**(options | more))


def clock(steady: bool, count: int) -> list[float]:
    return [FRAME] * count if steady else np.random.default_rng(1).choice([1 / 240, FRAME, 1 / 30], count).tolist()


def row(world: pv.World, count: int, *, spacing: float = 0.1, mass: Any = 0.01, radius: float = 0.01) -> Any:
    return world.add(position=np.column_stack((spacing * np.arange(count), np.zeros(count))), radius=radius, mass=mass)


def stretch(group: Any, length: float) -> float:
    return float(np.abs(np.hypot(*np.diff(group.position, axis=0).T) / length - 1).max())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("steady", [True, False])
def test_a_pendulum_keeps_its_energy_and_length(dtype: Any, steady: bool) -> None:
    # E = m g L (1 - cos a) is kept; the velocity shown is good to h^2.
    world = made(dtype=dtype)
    group = world.add(position=np.array([[0, 0], [1.3 * np.sin(2), -1.3 * np.cos(2)]]), radius=0.02, mass=0.7)
    group.pin(0)
    world.links.append(pv.Stick(group, 0, 1))
    start, off = world.energy().total, 0.0
    for dt in clock(steady, 600):
        world.step(dt)
        off = max(off, abs(world.energy().total - start))
    assert off < 1e-3 * 0.7 * G * 1.3
    assert stretch(group, 1.3) < (1e-6 if dtype == np.float32 else 1e-12)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("steady", [True, False])
def test_a_damped_spring_follows_its_closed_form(dtype: Any, steady: bool) -> None:
    # x = A exp(-d t) (cos w t + d / w sin w t), d = c / (2 m*), w^2 = k / m* - d^2, m* = 1/2 kg; (w h)^2 / 12 w t = 7e-4.
    world = made(dtype=dtype, gravity=(0, 0))
    group = world.add(position=np.array([[0, 0], [1.1, 0]]), radius=0.02, mass=1.0)
    stiffness, damping = 0.5 * (2 * np.pi) ** 2, 0.1
    world.links.append(pv.Spring(group, 0, 1, length=1.0, stiffness=stiffness, damping=damping))
    omega, time = np.sqrt(2 * stiffness - damping**2), 0.0
    for dt in clock(steady, 600):
        world.step(dt)
        time += dt
        x = 0.1 * np.exp(-damping * time) * (np.cos(omega * time) + damping / omega * np.sin(omega * time))
        assert group.position[1, 0] - group.position[0, 0] - 1 == pytest.approx(x, abs=1e-3 * 0.1)


def test_a_double_pendulum_keeps_its_energy() -> None:
    # Chaotic, so energy is all there is to compare.
    world = made()
    group = world.add(position=[[0, 0], [1, 0], [1, 1]], radius=1e-6, mass=1.0)
    group.pin(0)
    world.links.append(pv.Stick(group, [0, 1], [1, 2]))
    start, energy = world.energy().total, []
    for _ in range(1200):
        world.step(FRAME)
        energy.append(world.energy().total)
    assert np.abs(np.array(energy) - start).max() < 0.01 * 4 * G
    assert np.mean(energy[600:]) == pytest.approx(np.mean(energy[:600]), abs=1e-3 * 4 * G)


@pytest.mark.parametrize("kind", [pv.Stick, pv.Rope])
def test_a_light_chain_carries_ten_thousand_times_a_bead(kind: Any) -> None:
    # At rest each pull is the weight below it: 100 kg and the beads of 10 g.
    world = made()
    mass = np.append(np.full(10, 0.01), 100.0)
    group = world.add(position=np.column_stack((np.zeros(11), -0.1 * np.arange(11))), radius=0.01, mass=mass)
    pin, chain = world.links.append(pv.Pin(group, 0)), world.links.append(kind(group, range(10), range(1, 11)))
    world.run(seconds=3.0)
    below = np.cumsum(mass[::-1])[::-1]
    assert chain.force == pytest.approx(G * below[1:], rel=1e-6)
    assert pin.force == pytest.approx(G * below[:1], rel=1e-6)
    assert stretch(group, 0.1) < 1e-9


def test_a_slack_rope_does_not_pull() -> None:
    # Free fall until it is taut: x = 1/2 g t^2, exact for this integrator.
    world = made()
    group = world.add(position=np.array([[0, 0], [0.5, 0]]), radius=0.01, mass=1.0)
    group.pin(0)
    rope = world.links.append(pv.Rope(group, 0, 1, length=1.0))
    world.run(seconds=0.25)
    assert group.position[1] == pytest.approx([0.5, -0.5 * G * 0.25**2], abs=1e-12)
    assert rope.force[0] == 0.0
    world.run(seconds=2.0)
    assert np.hypot(*group.position[1]) < 1 + 1e-9


def test_free_linked_bodies_keep_momentum_and_angular_momentum() -> None:
    world = made(gravity=(0, 0))
    chance = np.random.default_rng(4)
    group = world.add(position=chance.uniform(-1, 1, (6, 2)), velocity=chance.normal(0, 1, (6, 2)), radius=1e-6, mass=range(1, 7))
    world.links.append(pv.Stick(group, range(5), range(1, 6)))
    turn, push = world.angular_momentum(), (world.mass[:, None] * world.velocity).sum(axis=0)
    world.run(seconds=2.0)
    assert (world.mass[:, None] * world.velocity).sum(axis=0) == pytest.approx(push, abs=1e-11)
    # Shown velocities are good to h^2: off by 4.6e-5, 1.1e-5 and 2.8e-6 with 8, 16 and 32 substeps, mostly in the first frame.
    assert world.angular_momentum() == pytest.approx(turn, abs=2e-4)


def test_it_breaks_at_its_breaking_force() -> None:
    # The pull at rest is m g.
    for strength, holds in ((0.99 * G, False), (1.01 * G, True)):
        world = made()
        group = world.add(position=[[0, 0], [0, -1]], radius=0.01, mass=1.0)
        group.pin(0)
        stick = world.links.append(pv.Stick(group, 0, 1, breaking_force=strength))
        world.run(seconds=0.5)
        assert stick.intact[0] == holds


def test_area_and_angle_keep_their_values() -> None:
    world = made()
    turn = 2 * np.pi * np.arange(12) / 12
    ring = world.add(position=np.column_stack((np.cos(turn), np.sin(turn))), radius=0.01, mass=1.0)
    ring.pin(0)
    world.links.append(pv.Spring(ring, range(12), np.roll(range(12), -1), stiffness=1e4, damping=10.0))
    area = world.links.append(pv.Area(ring, compliance=1e-6))
    rod = row(world, 4, mass=1.0)
    rod.pin([0, 1])
    world.links.append(pv.Stick(rod, range(3), range(1, 4)))
    world.links.append(pv.Angle(rod, [0, 1], [1, 2], [2, 3]))
    world.run(seconds=1.0)
    x, y = ring.position.T
    assert 0.5 * (x @ np.roll(y, -1) - np.roll(x, -1) @ y) == pytest.approx(area.area[0], rel=1e-3)
    assert rod.position[:, 1] == pytest.approx(0.0, abs=1e-9)


def net(dtype: Any, **more: Any) -> pv.World:
    """A small net with a spring, a rope, a pin, an angle and a ring beside it, over a floor."""
    world = made(dtype=dtype, boundary=pv.Box((-2, -1), (3, 3), friction=0.3), substeps=4, **more)
    y, x = np.mgrid[0:3, 0:3]
    group = world.add(position=np.column_stack((0.3 * x.ravel(), 0.3 * y.ravel())), radius=0.1, mass=1.0)
    i = np.arange(9).reshape(3, 3)
    world.links.append(pv.Spring(group, i[:, :-1].ravel(), i[:, 1:].ravel(), stiffness=500.0))
    world.links.append(pv.Spring(group, i[:-1].ravel(), i[1:].ravel(), stiffness=300.0, damping=1.0))
    world.links.append(pv.Pin(group, 8, compliance=1e-3))
    other = world.add(position=np.array([[1, 0], [1.3, 0], [1.3, 0.4], [1, 0.3]]), velocity=(1, 2), radius=0.1, mass=0.5)
    world.links.append(pv.Area(other, compliance=1e-3))
    world.links.append(pv.Rope(other, [0, 1, 2, 3], [1, 2, 3, 0], compliance=1e-3))
    world.links.append(pv.Angle(other, 0, 1, 2, compliance=0.1))
    return world


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_uncompiled_it_has_the_same_bits(dtype: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = net(dtype)
    compiled.run(seconds=0.1)
    slow = reference.load("engine", dtype)
    monkeypatch.setattr(core, "unit", lambda name, dtype: slow)
    plain = net(dtype)
    plain.run(seconds=0.1)
    assert plain.state_hash() == compiled.state_hash()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_saved_and_restored_it_has_the_same_bits(dtype: Any, tmp_path: Any) -> None:
    world = net(dtype)
    world.run(seconds=0.3)
    saved = world.save()
    snapshot.save(world, tmp_path / "net.zip")
    other = snapshot.load(tmp_path / "net.zip")
    hashes = []
    for each in (world, other):
        each.run(seconds=0.3)
        hashes.append(each.state_hash())
    world.restore(saved)
    world.run(seconds=0.3)
    assert {world.state_hash(), *hashes} == {hashes[0]}


def test_removed_particles_and_links_leave_the_rest_as_it_is() -> None:
    world = made()
    group = world.add(position=np.column_stack((np.arange(6.0), np.zeros(6))), radius=0.1, mass=1.0)
    weights = world.add(position=np.column_stack((np.arange(6.0), np.full(6, -0.5))), radius=0.1, mass=2.0)
    group.pin(range(6))
    sticks = world.links.append(pv.Stick((group, range(6)), (weights, range(6))))
    other = world.links.append(pv.Rope((group, 0), (weights, 1), length=3.0))
    world.run(seconds=0.5)
    world.links.remove(other)
    weights.remove([2])
    world.step(FRAME)
    assert sticks.force == pytest.approx(2 * G, rel=1e-6)
    assert len(sticks) == 5


def test_any_number_of_threads_has_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    hashes = set()
    for threads in (1, 2, 3):
        monkeypatch.setattr(jit, "threads_in_use", lambda threads=threads: threads)
        world = made(boundary=pv.Box((0, 0), (30, 40)), dtype=np.float32)
        y, x = np.mgrid[0:30, 0:25]
        loose = np.random.default_rng(5).normal(0, 0.02, (750, 2))
        group = world.add(position=1 + 1.1 * np.column_stack((x.ravel(), y.ravel())) + loose, radius=0.4)
        k = np.arange(750).reshape(30, 25)
        world.links.append(pv.Stick(group, k[:, ::5].ravel(), k[:, 1::5].ravel()))
        world.links.append(pv.Rope(group, k[:, 1::5].ravel(), k[:, 2::5].ravel()))
        world.run(seconds=0.3)
        assert world._impulses._parts == threads
        hashes.add(world.state_hash())
    assert len(hashes) == 1


def test_rigid_links_that_form_a_net_are_refused() -> None:
    world = made()
    group = row(world, 4)
    world.links.append(pv.Stick(group, [0, 0, 0], [1, 2, 3]))
    with pytest.raises(pv.InputError, match="rigid links"):
        world.step(FRAME)
