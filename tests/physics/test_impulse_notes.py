"""Contacts, forces and pressure under the contact law: read from the impulses, not found afterwards."""

from itertools import combinations
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
    heap.run(seconds=5)
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


# ---- Events, against bounces in closed form ----


def test_a_ball_is_heard_at_each_of_its_bounces() -> None:
    """After n bounces from a height H it has e^n of the speed sqrt(2 g H); in a frame of 0.25 s there are several."""
    e, height = 0.9, 0.05
    world = pv.World(boundary=pv.Box((-1, 0), (1, 9), restitution=e), collisions=pv.Collisions(), events=True, dtype=np.float64)
    world.add(position=(0, 0.1 + height), radius=0.1)
    speeds: list[float] = []
    counts = []
    for _ in range(3):
        world.step(0.25)
        counts.append(len(world.events.begin))
        speeds += [float(speed) for speed in world.events.begin["speed"]]
    assert max(counts) > 1
    # A contact of a frame is told with its largest speed, so many times as it has bounced.
    assert speeds[0] == pytest.approx(np.sqrt(2 * 9.81 * height), rel=1e-9)
    # T = 2 v / g between bounces: t_n = t_0 + 2 v_0 / g (e + ... + e^n), t_0 = v_0 / g.
    fall = np.sqrt(2 * height / 9.81)
    times = fall + 2 * fall * np.concatenate(([0], np.cumsum(e ** np.arange(1, 40))))
    assert len(speeds) == (times <= 0.75).sum()


# ---- The ledger under the contact law: what contacts take and give, against closed forms ----


def world_of(e: float = 0.0, mu: float = 0.0, **options: Any) -> pv.World:
    law = pv.Collisions(restitution=e, friction=mu)
    return pv.World(**{"ledger": True, "dtype": np.float64, "collisions": law, **options})


def heap(threads: int = 1, dtype: Any = np.float64, *, ledger: bool = True) -> pv.World:
    world = world_of(0.3, 0.5, boundary=pv.Box((-5, 0), (5, 20)), ledger=ledger, dtype=dtype, threads=threads)
    x, y = np.meshgrid(np.arange(-4, 4.1, 0.8), np.arange(1, 10, 0.8))
    places = np.column_stack((x.ravel(), y.ravel()))
    world.add(position=places + np.random.default_rng(1).uniform(-0.1, 0.1, places.shape), radius=0.3)
    return world


def test_an_elastic_gas_has_no_accounts() -> None:
    # e = 1 and no friction: energy is kept to rounding, and none of the accounts has anything.
    world = world_of(1.0, gravity=(0, 0), boundary=pv.Box((0, 0), (10, 10), restitution=1.0))
    places = np.stack(np.meshgrid(np.arange(1, 10), np.arange(1, 10)), axis=-1).reshape(-1, 2)
    world.add(position=places, velocity=np.random.default_rng(2).normal(0, 3, places.shape), radius=0.2)
    world.run(seconds=2)
    books = world.ledger.as_dict()
    assert books.pop("outside") == pytest.approx(world.energy().total, rel=1e-12)
    assert max(map(abs, books.values())) < 1e-12 * world.energy().total


def test_a_heap_loses_its_energy_to_impacts_and_friction_and_then_nothing() -> None:
    world = heap()
    world.run(seconds=12)
    settled = world.ledger.as_dict()
    assert settled["restitution"] < 0 > settled["friction"]
    assert abs(settled["residual"]) < 1e-13 * settled["outside"] * 5760  # substeps
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12)
    world.run(seconds=1)
    later = world.ledger.as_dict()
    scale = 1e-4 * settled["outside"]
    assert all(later[name] == pytest.approx(settled[name], abs=scale) for name in later)


# ---- All pairs there are, looked at one by one, against the lists from cells: the same contacts and the same physics ----


ROOMS: list[Any] = [pv.Box((0, 0), (12, 40)), pv.Circle(center=(6, 6), radius=9), pv.Open(), pv.Periodic((0, 0), (12, 14))]
METHODS: list[Any] = [pv.Fast(), pv.BruteForce()]


def scattered(method: Any, room: Any, dtype: Any = np.float64, **law: Any) -> pv.World:
    """40 circles of several sizes, apart from each other."""
    world = pv.World(boundary=room, dtype=dtype, collisions=pv.Collisions(method=method, **law))
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(1.5 + 1.3 * np.arange(8), 2 + 1.3 * np.arange(5))
    world.add(
        position=np.column_stack((x.ravel(), y.ravel())), velocity=rng.normal(0, 1, (40, 2)), radius=rng.uniform(0.3, 0.6, 40)
    )
    return world


def pairs_of(world: pv.World) -> list[tuple[int, int]]:
    """The listed pairs of user's indices, each once."""
    first, count, i, j = world._frames.listed()
    lane = np.concatenate([np.arange(f, f + n) for f, n in zip(first, count, strict=True)])
    particle = world._slots.particle
    both = np.sort(np.column_stack((particle[i[lane]], particle[j[lane]])), axis=1)
    return [(int(a), int(b)) for a, b in np.unique(both, axis=0)]


@pytest.mark.parametrize("room", ROOMS[:3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_pair_is_listed_once_and_for_all(room: Any, dtype: Any) -> None:
    world = scattered(pv.BruteForce(), room, dtype)
    world.run(seconds=60 / 60)
    assert pairs_of(world) == list(combinations(range(40), 2))
    assert world._frames.rebuilds == 1


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("law", [{}, {"restitution": 0.5, "friction": 0.3}])
def test_it_is_the_physics_of_cells(room: Any, law: dict[str, float]) -> None:
    # The order of pairs is another, so what contacts give differs by what one sweep leaves: per substep less than the velocity
    # that gravity adds, g h, at each of a few contacts. Over 20 frames, in which a fall makes 0.5 m, that stays below 1 cm. With
    # restitution small differences grow by each bounce; until two circles meet a third at once paths are the same to rounding.
    fast, brute = (scattered(method, room, **law) for method in METHODS)
    for frame in range(20):
        for world in (fast, brute):
            world.step(1 / 60)
        if frame < 3:
            assert np.abs(fast.position - brute.position).max() < 1e-12
    assert np.abs(fast.position - brute.position).max() < 0.01


def test_filters_and_pinned_circles_make_no_pairs() -> None:
    world = scattered(pv.BruteForce(), ROOMS[0])
    world.mass[:2] = np.inf
    world.category[2], world.mask[2] = 2, 2
    world.step(1 / 60)
    expected = {pair for pair in combinations(range(40), 2) if 2 not in pair} - {(0, 1)}
    assert set(pairs_of(world)) == expected
