"""The law of a contact (docs/design/contact-law.md) against closed forms, and that it is each pair's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

H = 1 / 480


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_billiard_rack_keeps_momentum_and_energy(dtype: Any) -> None:
    # Fifteen discs that touch, struck off centre at 3 m/s; each of some 100 impacts rounds to a digit of float32 or float64.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1), dtype=dtype, threads=1)
    rows = [(k * np.sqrt(3) * 0.05, 0.1 * (j - k / 2)) for k in range(5) for j in range(k + 1)]
    discs = world.add(position=[(-0.3, 0.01), *rows], radius=0.05, mass=0.17)
    discs.velocity[0] = (3, 0)
    before = world.momentum(), world.energy().kinetic
    world.run(seconds=0.5)
    assert np.abs(discs.velocity[1:]).max(axis=0).min() > 0.1  # they have scattered
    digits = 1e-6 if dtype == np.float32 else 1e-13
    assert world.momentum() == pytest.approx(before[0], abs=10 * digits * 0.17 * 3)
    assert world.energy().kinetic == pytest.approx(before[1], rel=10 * digits)


@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("phase", [0.05, 0.3, 0.55, 0.8, 0.95])
@pytest.mark.parametrize("spin", [0.0, 4.0])
def test_an_impact_rubs_as_coulomb_says(restitution: float, phase: float, spin: float) -> None:
    # J_n = (1 + e) v_n / W; J_t = min(mu J_n, |slip| / (3 W)), for a disc has I = m r^2 / 2; it turns each disc by 2 J_t / (m r).
    speed, mu, radius, mass = 3.0, 0.3, 0.5, (1.0, 2.0)
    way = speed * H * (20 + phase)  # they meet within a substep, at 45 degrees
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=restitution, friction=mu), dtype=np.float64, threads=1)
    along = np.sqrt(0.5)
    discs = world.add(
        position=[(-1 - way * along, -way * along), (0, 0)],
        velocity=[(speed * along, speed * along), (0, 0)],
        radius=radius,
        mass=mass,
    )
    discs.spin[0] = spin
    world.run(seconds=0.1)
    w = 1 / mass[0] + 1 / mass[1]
    normal = (1 + restitution) * speed * along / w
    # Along t = (n_y, -n_x) = (0, -1): the struck disc's velocity less the other's, and what the rims add.
    slip = speed * along + spin * radius
    tangent = min(mu * normal, slip / (3 * w))
    assert discs.spin == pytest.approx([spin - 2 * tangent / (mass[0] * radius), -2 * tangent / (mass[1] * radius)], rel=1e-6)
    assert discs.velocity[1] == pytest.approx([normal / mass[1], tangent / mass[1]], rel=1e-6)


@pytest.mark.parametrize("walls", [0.5, pytest.param(0.0, marks=pytest.mark.slow)])
def test_what_one_circle_is_made_of_is_nothing_to_the_others(walls: float) -> None:
    # A heap that falls, crashes and settles, and one circle alone far from it: whatever that is, the others keep their bits. By
    # brute force, for when a list is made anew depends on how far anybody has moved, and another list has another order.
    def heap(**odd: float) -> bytes:
        rng = np.random.default_rng(2)
        law = pv.Collisions(method=pv.BruteForce())
        world = pv.World(boundary=pv.Box((-60, 0), (60, 60), restitution=walls), collisions=law, threads=1)
        row, column = np.divmod(np.arange(160), 20)
        heap = world.add(position=np.column_stack((column, row + 1)) * 1.05 + rng.uniform(0, 0.04, (160, 2)), radius=0.5)
        alone = world.add(position=(-50, 5), velocity=(3, 0), radius=0.5)
        for name, value in odd.items():
            setattr(alone, name, value)
        world.run(seconds=3)
        return heap.position.tobytes() + heap.velocity.tobytes()

    plain = heap()
    assert heap(restitution=0.8) == plain
    assert heap(friction=0.7) == plain
    assert heap(restitution=0.5, friction=0.5) == plain


@pytest.mark.parametrize("obstacle", [False, True])
def test_smooth_circles_come_to_rest_on_walls_that_bounce(obstacle: bool) -> None:
    # Smooth ones may slip to a better place once more, as late as after 15 s.
    room = pv.Box((-7, 0), (7, 30), restitution=0.0 if obstacle else 0.5)
    world = pv.World(boundary=room)
    if obstacle:
        world.obstacles.append(pv.Segment((-7, 0.5), (7, 0.5), restitution=0.5))
    row, column = np.divmod(np.arange(400), 20)
    start = np.column_stack((column * 0.5 - 4.75, row * 0.5 + 1))
    world.add(position=start + np.random.default_rng(1).uniform(-0.02, 0.02, (400, 2)), radius=0.22)
    world.run(seconds=25)
    assert world.energy().kinetic < 2e-6 * world.mass.sum() * 9.81 * 7
    # 0.2 % under its own weight; one start in four jams a row between the walls, which presses it by up to 1 %.
    assert world.overlap().max < 0.012
