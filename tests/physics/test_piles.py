"""Piles settle, stay together and lose energy only; nothing escapes; crowded starts come apart."""

import math
from typing import Any

import numpy as np
import pytest
from tests.worlds import G, H, each_frame, linked_rows, points

import pyverlet as pv
from pyverlet.laws.contact_records import Pushes
from pyverlet.world.frames import PUSH_OUT

RADIUS = 0.5


def cage(n: int, *, seed: int = 0, **options: object) -> tuple[pv.World, pv.Group]:
    """n circles of radius 0.5 m on a shaken lattice in a cage of which they fill 60 %."""
    size = np.sqrt(0.25 * n / 0.6)
    axis = np.arange(-size, size, 1.05)
    position = points(axis, axis)
    position = position[np.argsort(np.hypot(*position.T), kind="stable")][:n]
    position += np.random.default_rng(seed).uniform(-0.02, 0.02, position.shape)
    world = pv.World(boundary=pv.Circle(radius=size), **options)  # type: ignore[arg-type]
    return world, world.add(position=position, radius=RADIUS)


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_every_integrator_settles_a_small_cage(name: str) -> None:
    world, _ = cage(300, integrator=pv.integrators.BY_NAME[name]())
    world.run(seconds=5)
    assert world.escaped() == 0
    assert world.overlap().max < 0.02
    assert world.energy().kinetic < 0.05 * 300 * G * RADIUS


@pytest.mark.parametrize(
    "options",
    [
        {"restitution": 0.8},
        *(pytest.param(each, marks=pytest.mark.slow) for each in ({}, {"friction": 0.0}, {"radius_spread": 1.0})),
    ],
)
def test_a_bouncy_pile_of_mixed_circles_comes_to_rest(options: dict[str, float]) -> None:
    # Restitution is for arrivals. Mistaken for them, the trembling of small circles between large ones went on for ever, at
    # 5e-3 of m g R and 2 m/s.
    world = pv.scenes.get("box").world(particles=800, **options)
    world.run(seconds=15)
    assert world.escaped() == 0
    assert world.energy().kinetic < 1e-3 * float((world.mass * G * world.radius).sum())
    assert np.percentile(np.hypot(*world.velocity.T), 99) < 0.5


@pytest.mark.parametrize("substeps", [1, 8, 16])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_circles_added_on_top_of_each_other_part_slowly(substeps: int, dtype: type) -> None:
    # Springs push them apart by at most PUSH_OUT r a second, and the velocity of that is taken back in the same substep.
    world = pv.World(gravity=(0, 0), substeps=substeps, dtype=dtype)
    balls = world.add(position=[(0.0, 0.0), (0.3, 0.0)], radius=RADIUS)
    apart, eps = 0.3, float(np.finfo(dtype).eps)
    for _ in each_frame(world, 120):
        before, apart = apart, float(balls.position[1, 0] - balls.position[0, 0])
        assert before - eps <= apart <= before + PUSH_OUT * RADIUS / 60 + eps
        # Rounded by an eps of it in each of the sweeps, which are less than a hundred a frame.
        assert np.abs(balls.velocity).max() <= 100 * eps * PUSH_OUT * RADIUS
    assert apart == pytest.approx(2 * RADIUS, rel=2e-3)


# ---- Friction at rest: what stands by it stands still, however the list of pairs comes and goes, and what cannot stand falls
# ----


LIMIT = np.tan(np.radians(15))  # 0.268


def pyramid(friction: float, **options: object) -> tuple[pv.World, pv.Group]:
    """One circle on two that touch, on a floor.

    It stands if mu >= tan 15 deg between circles: a lower one has two points of contact that carry, 150 degrees apart as seen
    from its centre. Without a torque the friction at both is the same, and with the weight and the two normal forces it
    balances only if it is tan 15 deg of the upper normal force. The floor, which carries more, needs less.
    """
    world = pv.World(
        boundary=pv.Box((-20, 0), (20, 20), friction=friction),
        collisions=pv.Collisions(friction=friction, **options),  # type: ignore[arg-type]
    )
    height = RADIUS + RADIUS * np.sqrt(3)
    circles = world.add(position=[(-RADIUS, RADIUS), (RADIUS, RADIUS), (0, height)], radius=RADIUS)
    return world, circles


def test_a_pyramid_falls_apart_below_tan_15_degrees() -> None:
    world, circles = pyramid(0.9 * LIMIT)
    world.run(seconds=5)
    assert np.ptp(circles.position[:, 1]) < 0.1 * RADIUS


STANDS: list[Any] = [
    *((name, 8, {}) for name in pv.integrators.BY_NAME),
    *(pytest.param(name, each, {}, marks=pytest.mark.slow) for name in pv.integrators.BY_NAME for each in (4, 16)),
    # While the list is made anew.
    *(
        pytest.param("position-verlet", 8, {"method": each}, marks=pytest.mark.slow)
        for each in (pv.Fast(skin=0), pv.BruteForce())
    ),
]


@pytest.mark.parametrize(("name", "substeps", "options"), STANDS)
def test_a_pyramid_stands_above_tan_15_degrees(name: str, substeps: int, options: dict[str, Any]) -> None:
    world, circles = pyramid(1.1 * LIMIT, **options)
    world.integrator = pv.integrators.BY_NAME[name]()
    world.substeps = substeps
    world.run(seconds=1)
    start = circles.position.astype(float)
    world.run(seconds=9 if options else 5)
    # Those of order 4 are several steps a substep, each rounded: 5,000 substeps by 6e-8 m.
    assert np.abs(circles.position - start).max() < (5e-4 if name in ("rk4", "yoshida4") else 5e-5) * RADIUS
    assert np.abs(circles.spin).max() < 1e-2  # rad/s


def test_a_pyramid_stands_while_others_come_and_go() -> None:
    world, circles = pyramid(1.1 * LIMIT)
    world.run(seconds=2)
    start = circles.position.astype(float)
    for k in range(120):
        others = world.add(position=np.array([(5, RADIUS), (7, 1)]) + 0.01 * k, radius=RADIUS)
        world.step(1 / 60)
        world.remove(others)
    assert np.abs(circles.position - start).max() < 1e-3 * RADIUS


# ---- What touching circles push each other with, as the page shows it, against closed forms ----


def looked_at(world: pv.World) -> Pushes:
    """The contacts of a world at rest."""
    with world.recording_contacts() as records:
        world.step(1 / 60)
    found = records.pushes()
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


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("layers", "first", "then"),
    [
        (16, (1 / 60, 8), [(1 / 60, 8), (1 / 30, 8)]),
        (24, (1 / 60, 8), [(1 / 30, 8)]),
        (24, (1 / 60, 8), [(1 / 60, 8), (1 / 60, 8), (1 / 30, 8)]),
        (24, (1 / 60, 8), [(1 / 60, 2), (1 / 60, 3), (1 / 60, 8)]),
        (24, (1 / 60, 8), [(1 / 50, 8), (1 / 40, 8), (1 / 70, 8)]),
        (16, (1 / 240, 8), [(1 / 60, 8), (1 / 144, 8)]),
        (24, (1 / 60, 8), [(0.25, 8), (1 / 60, 8)]),
    ],
)
def test_a_column_rests_when_substeps_become_longer(layers: int, first: Any, then: Any, dtype: type) -> None:
    # What disturbs it dies away, whatever frames and substeps follow each other: springs that are too stiff for a substep make
    # it grow, to 0.3 m/s within 150 frames. Rounding of places is worth eps y / h in m/s in the second to last substep.
    world = pv.World(boundary=pv.Box((-2, 0), (2, 40)), dtype=dtype)
    world.add(position=np.column_stack((np.zeros(layers), RADIUS + np.arange(layers))), radius=RADIUS)
    for frame in range(900):
        dt, world.substeps = first if frame < 500 else then[frame % len(then)]
        if frame == 500:
            world.velocity[:, 1] += np.random.default_rng(5).normal(0, 1e-6, layers)
        world.step(dt)
    rounding = float(np.finfo(dtype).eps) * layers * 8 / min(dt for dt, _ in then)
    assert np.abs(world.velocity).max() < 1e-9 + 2 * rounding


def test_one_on_two() -> None:
    # Without friction, a circle on two pinned ones that are 2 a apart: each pushes with m g / (2 cos b), sin b = a / 2r.
    world = pv.World(dtype=float)
    world.add(position=[(-0.6, 0), (0.6, 0)], radius=0.5).pin()
    world.add(position=(0, 0.8), radius=0.5, mass=3.0)
    world.run(seconds=2)
    found = looked_at(world)
    assert found.pairs[found.force > 1e-6].tolist() == [[0, 2], [1, 2]]
    assert found.force[found.force > 1e-6] == pytest.approx(3.0 * G / (2 * 0.8), rel=2e-3)


# ---- Circles at rest report that they are, whatever velocity the solver keeps to carry their weight with ----


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
    speed = [np.hypot(*circles.velocity.T) for _ in each_frame(world, 30)]
    least = float(np.finfo(np.float32).eps) * count / H
    assert np.mean(speed, axis=0).max() < least
    assert world.energy().kinetic < 0.5 * circles.mass.sum() * least**2


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
    place = points(0.88 * (np.arange(33) - 16), 0.5 + 0.88 * np.arange(24)) + rng.uniform(-0.03, 0.03, (24 * 33, 2))
    group = world.add(position=place, radius=r, mass=1.0, friction=mu, restitution=e)
    linked_rows(group, np.arange(24 * 33).reshape(24, 33), link, 4 if link == "dumb-bells" else 6)
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


SELDOM = [
    *((link, seed, None) for link in ("chains", "dumb-bells", "ropes") for seed in range(4) if (link, seed) != ("ropes", 0)),
    *((link, seed, 0.3) for link in ("chains", "dumb-bells", "ropes") for seed in (0, 1, 5) if (link, seed) != ("chains", 0)),
]


@pytest.mark.parametrize(
    ("link", "seed", "e"),
    [("ropes", 0, None), ("chains", 0, 0.3), *(pytest.param(*each, marks=pytest.mark.slow) for each in SELDOM)],
)
def test_linked_circles_in_a_heap_rest_as_others_do(link: str, seed: int, e: float | None) -> None:
    # What contacts carry of a link's pull is another velocity for each circle; passed on by the second sweep like motion,
    # it came to 0.1 m/s, five times g h, for one circle in a hundred, and 0.3 to 40 J in all. Ends of chains that walls hold,
    # too, may show some. If they bounce: what links pull with is far more than g; met at the speed that carries it, contacts at
    # rest were taken for impacts, and threw each other about: 0.06 to 0.7 m/s for one circle in a hundred, 8 to 10 J in a heap.
    world = rough_heap(seed, link, e)
    world.run(seconds=12)  # by 8 s one heap in thirty had a row that was still sliding
    assert np.percentile(np.hypot(*world.velocity.T), 99) < 0.5 * G * H
    # Those inside a rope that touch nobody may spin for ever; no motion is left beside that.
    assert 0.5 * np.sum(world.velocity**2) < 1e-3 * len(world) * G * 0.392 or not e
    assert np.median(np.hypot(*world.velocity.T)) < 0.05 * G * H or e


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
