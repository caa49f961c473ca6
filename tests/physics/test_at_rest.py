"""Circles at rest report that they are, whatever velocity the solver keeps to carry their weight with."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

G = 9.81
H = 1 / 480


def slot(count: int, **options: object) -> tuple[pv.World, pv.Group]:
    """A column of circles in a slot one diameter wide."""
    world = pv.World(boundary=pv.Box((0, 0), (1, 2 * count + 2)), **options)  # type: ignore[arg-type]
    return world, world.add(position=np.column_stack((np.full(count, 0.5), 0.5 + np.arange(count))), radius=0.5)


@pytest.mark.parametrize("integrator", [pv.PositionVerlet(), pv.integrators.TimeCorrectedVerlet()])
@pytest.mark.parametrize("settings", [{}, {"friction": 0.5}, {"restitution": 0.5}, {"restitution": 0.5, "friction": 0.5}])
@pytest.mark.parametrize("count", [1, 5, pytest.param(2, marks=pytest.mark.slow)])
def test_a_column_at_rest_reports_no_velocity(count: int, settings: dict[str, float], integrator: pv.Integrator) -> None:
    # Contacts give each circle its weight, so that it does not move, but for the rounding of places in a substep: eps `count` m.
    world, circles = slot(count, collisions=pv.Collisions(**settings), integrator=integrator)  # type: ignore[arg-type]
    world.run(seconds=5)
    speed = []
    for _ in range(30):
        world.step(1 / 60)
        speed.append(np.hypot(*circles.velocity.T))
    least = float(np.finfo(np.float32).eps) * count / H
    assert np.mean(speed, axis=0).max() < least
    assert world.energy().kinetic < 0.5 * circles.mass.sum() * least**2


def test_light_circles_under_a_heavy_one_report_no_velocity() -> None:
    world, circles = slot(6)
    circles.mass[5] = 1000.0
    world.run(seconds=20)
    assert np.hypot(*circles.velocity.T).max() < 0.1 * G * H


def test_a_rough_pile_reports_no_velocity() -> None:
    fastest = []
    for count in (297, 300):
        world = pv.scenes.get("cage").world(particles=count, friction=0.5)
        world.run(seconds=15)
        fastest.append(np.hypot(*world.velocity.T).max())
        assert abs(float(np.median(world.velocity[:, 1]))) < 0.01 * G * H
    assert max(fastest) < 0.1 * G * H


def rough_heap(seed: int, link: str = "", e: float | None = None) -> pv.World:
    """24 rows of 33 rough circles, one kilogram each, that fall a little; every fourth, or every sixth row, may be linked."""
    rng, r, mu = np.random.default_rng(seed), 0.392, 0.3
    world = pv.World(boundary=pv.Box((-15, 0), (15, 60), friction=mu))
    x, y = np.meshgrid(0.88 * (np.arange(33) - 16), 0.5 + 0.88 * np.arange(24))
    place = np.column_stack((x.ravel(), y.ravel())) + rng.uniform(-0.03, 0.03, (24 * 33, 2))
    group, n = world.add(position=place, radius=r, mass=1.0, friction=mu, restitution=e), np.arange(24 * 33).reshape(24, 33)
    if link == "dumb-bells":
        world.links.append(pv.Stick(group, n[::4, :-1:4].ravel(), n[::4, 1::4].ravel()))
    elif link:
        row = (n[::6, :-1].ravel(), n[::6, 1:].ravel())
        world.links.append(pv.Stick(group, *row) if link == "chains" else pv.Rope(group, *row))
    return world


@pytest.mark.parametrize(
    ("seed", "e"),
    [
        *((1, None), (8, 0.3)),
        *(pytest.param(each, None, marks=pytest.mark.slow) for each in (0, 2, 3, 4, 5, 6, 7)),
        *(pytest.param(each, 0.3, marks=pytest.mark.slow) for each in (0, 4, 5, 10)),
    ],
)
def test_a_rough_heap_keeps_no_pairs_that_meet_for_ever(seed: int, e: float | None) -> None:
    # Pairs that were taken for impacts in every substep held each other up, with circles beside them at 0.5 m/s that did not
    # move: 0.2 to 5 J in six heaps of eight without restitution, in three of twelve with e = 0.3. At rest no circle has more than
    # 1e-4 of m g r, 3.8 J.
    world = rough_heap(seed, e=e)
    world.run(seconds=20)
    assert (0.5 * np.sum(world.velocity**2, axis=1)).max() < 1e-4 * G * 0.392
    assert world.energy().kinetic < 1e-6 * len(world) * G * 0.392


@pytest.mark.parametrize("link", ["ropes", *(pytest.param(each, marks=pytest.mark.slow) for each in ("chains", "dumb-bells"))])
@pytest.mark.parametrize("seed", [0, *(pytest.param(each, marks=pytest.mark.slow) for each in (1, 2, 3))])
def test_linked_circles_in_a_heap_rest_as_others_do(seed: int, link: str) -> None:
    # What contacts carry of a link's pull is another velocity for each circle; passed on by the second sweep like motion,
    # it came to 0.1 m/s, five times g h, for one circle in a hundred, and 0.3 to 40 J in all. Ends of chains that walls hold,
    # too, may show some.
    world = rough_heap(seed, link)
    world.run(seconds=12)
    assert np.percentile(np.hypot(*world.velocity.T), 99) < 0.5 * G * H
    assert np.median(np.hypot(*world.velocity.T)) < 0.05 * G * H


@pytest.mark.parametrize(
    ("link", "seed"),
    [
        ("chains", 0),
        *(pytest.param("chains", each, marks=pytest.mark.slow) for each in (1, 5)),
        *(pytest.param(link, each, marks=pytest.mark.slow) for link in ("dumb-bells", "ropes") for each in (0, 1, 5)),
    ],
)
def test_so_they_do_if_they_bounce(link: str, seed: int) -> None:
    # What links pull with is far more than g: met at the speed that carries it, contacts at rest were taken for impacts, and
    # threw each other about: 0.06 to 0.7 m/s for one circle in a hundred, a chain's heap 8 to 10 J.
    world = rough_heap(seed, link, e=0.3)
    world.run(seconds=12)
    assert np.percentile(np.hypot(*world.velocity.T), 99) < 0.5 * G * H
    # Those inside a rope that touch nobody may spin for ever; no motion is left beside that.
    assert 0.5 * np.sum(world.velocity**2) < 1e-3 * len(world) * G * 0.392


def test_a_circle_that_links_pull_at_bounces_as_ever() -> None:
    # Two springs pull at it across its way with 100 m/s^2 each. It meets another at 1 m/s, faster than contacts at rest do under
    # such a pull, 4 a h = 0.83 m/s: e = 1 and equal masses, so that they change velocities.
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    place, velocity = [(0, 0), (0, 1.5), (10, 1.5), (-10, 1.5)], [(0, 0), (0, -1), (0, -1), (0, -1)]
    group = world.add(position=place, velocity=velocity, restitution=1.0, radius=0.5)
    world.links.append(pv.Spring(group, [1, 1], [2, 3], stiffness=10.0, length=1e-3))
    world.run(seconds=0.55)
    # 0.05 s after the impact: what the springs have pulled upwards by then is 2 k y t with y = -v t: 2 k v t^2 / 2 = 0.025 m/s.
    assert group.velocity[0, 1] == pytest.approx(-1, abs=0.01)
    assert group.velocity[1, 1] == pytest.approx(0, abs=0.03)


def test_what_is_not_reported_is_not_forgotten() -> None:
    # The weight is carried from frame to frame by what is not shown: no contact gives way when a frame begins.
    world, circles = slot(5, dtype=np.float64)
    world.run(seconds=40)
    height = circles.position.copy()
    world.run(seconds=1)
    assert circles.position == pytest.approx(height, abs=1e-9)


@pytest.mark.parametrize("mass", [1.0, 1000.0])
@pytest.mark.parametrize("substeps", [1, 8])
def test_circles_that_fall_in_touch_report_how_fast_they_fall(substeps: int, mass: float) -> None:
    # They rest against each other, but on nothing: v = -g t to rounding.
    world = pv.World(dtype=np.float64, substeps=substeps)
    circles = world.add(position=[(0, 0), (0.999, 0), (0.5, 0.86)], radius=0.5, mass=[1.0, mass, 1.0])
    world.run(seconds=2)  # what they overlap moves them by up to 1e-3 m / h at first
    speed = circles.mass @ circles.velocity / circles.mass.sum()
    assert speed == pytest.approx([0, -2 * G], abs=1e-12)
