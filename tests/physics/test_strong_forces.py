"""Contacts of a particle rest below 4 |a| h of its own acceleration: a strong force on one changes no bounce of another.

|a| was once the largest in the world: a force of 1000 m/s^2 on a single circle took three quarters of the energy of an elastic
gas beside it, and drag on what had been thrown made all contacts of a crowd soft, so that a cloth in it was thrown to infinity.
"""

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, points

import pyverlet as pv
from pyverlet import core
from pyverlet.laws.integrators import BY_NAME


@pv.force
def hook(x: float, y: float, vx: float, vy: float, m: float, t: float) -> tuple[float, float]:
    """A stiff spring that holds whatever is right of x = 16 at (18, 18)."""
    return (-1e4 * (x - 18), -1e4 * (y - 18)) if x > 16 else (0.0, 0.0)


FORCES: dict[str, Callable[[pv.Group], Any]] = {
    "weak": lambda one: pv.ConstantForce((1.0, 0.0), group=one),
    "strong": lambda one: pv.ConstantForce((1e3, 0.0), group=one),
    "very strong": lambda one: pv.ConstantForce((0.0, -1e5), group=one),
    "hook": lambda one: hook,
}


def gas(force: str | None, **options: Any) -> tuple[pv.World, pv.Group]:
    """An elastic gas among pegs in the left part of a room; right of a wall there is one more, on which the force acts."""
    rng = np.random.default_rng(0)
    room = {"boundary": pv.Box((0, 0), (20, 20), restitution=1), "dtype": np.float64, "gravity": (0, 0), **options}
    world = pv.World(collisions=pv.Collisions(restitution=1), **room)
    group = world.add(position=points(1.0 + np.arange(12), 1.0 + np.arange(12)), radius=0.3, velocity=rng.normal(0, 1, (144, 2)))
    one = world.add(position=(18.5, 18), radius=0.3)
    world.obstacles += [pv.Segment((15, 0), (15, 20), restitution=1), pv.Disc((6.5, 6.5), 0.15, restitution=1)]
    if force:
        world.forces.append(FORCES[force](one))
    return world, group


@pytest.mark.parametrize(
    ("force", "integrator"),
    [
        *((force, "position-verlet") for force in FORCES),
        *(("hook", name) for name in ("time-corrected-verlet", "velocity-verlet")),
        ("very strong", "yoshida4"),
    ],
)
def test_an_elastic_gas_keeps_its_energy_beside_one_who_is_pushed_hard(force: str, integrator: str) -> None:
    world, group = gas(force, integrator=BY_NAME[integrator]())
    before = float((group.velocity**2).sum())
    world.run(seconds=1.5)
    assert float((group.velocity**2).sum()) == pytest.approx(before, rel=1e-11)


def test_its_bounces_are_told_as_without_the_force() -> None:
    counts = []
    for force in (None, "strong"):
        world, group = gas(force, events=True)
        bounces = 0
        for _ in each_frame(world, 60):
            begin = world.events.begin
            bounces += int(np.count_nonzero(begin["a"] < len(group)))
        counts.append(bounces)
    assert counts[0] > 150
    # Rounding, which the gas magnifies, makes another gas of it in the end.
    assert counts[1] == pytest.approx(counts[0], rel=0.02)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_who_is_pressed_hard_rests_and_shows_the_force(e: float) -> None:
    # Statics: two discs of 1 kg that are pressed to a floor by 1000 N each; others bounce beside them, on which no force acts.
    world = pv.World(
        boundary=pv.Box((0, 0), (20, 20), restitution=e), collisions=pv.Collisions(restitution=e), dtype=np.float64,
        gravity=(0, 0), contacts=True,
    )  # fmt: skip
    world.obstacles.append(pv.Segment((4, 3), (6, 3)))
    pressed = world.add(position=[(5, 3.5), (5, 4.5)], radius=0.5)
    world.add(position=[(10, 0.5 + 1.1 * k) for k in range(5)], radius=0.5, velocity=(0, 1.0))
    world.forces.append(pv.ConstantForce((0, -1e3), group=pressed))
    world.run(seconds=2)
    assert np.abs(pressed.velocity).max() < 1e-3
    assert world.force_on(world.obstacles[0])[1] == pytest.approx(-2e3, rel=1e-6)


def test_drag_on_what_is_thrown_leaves_a_crowd_its_bounces() -> None:
    # Pinned circles that move at up to 40 m/s sweep a cloth through a crowd. Impacts add at most twice their speed each;
    # nobody gets much faster than that, where speeds once went to 1e12 m/s.
    rng, n = np.random.default_rng(41), 143
    world = pv.World(
        boundary=pv.Box((-10, -10), (10, 10), restitution=0.76), collisions=pv.Collisions(restitution=0.69), dtype=np.float64
    )
    place, radius = rng.uniform(-6.66, 6.66, (n, 2)), 0.483 * 50 ** -rng.random(n)
    crowd = world.add(
        position=place, radius=radius, velocity=rng.normal(0, 13.6, (n, 2)), mass=3 ** rng.random(n), on_overlap="push"
    )
    crowd.mass[rng.random(n) < 0.1] = np.inf
    pv.cloth(world, (-1.98, 3.38), width=3, height=2, columns=6, rows=5)
    world.forces += [pv.Drag(quadratic=0.0863), pv.Attractor(strength=9.88, softening=1.0)]
    for _ in each_frame(world, 40):
        assert np.abs(world.velocity).max() < 400


# ---- Gravitation by a tree, against the sum over all pairs ----


Array = Any

N = 4000


def around(angle: Array) -> Array:
    return np.column_stack((np.cos(angle), np.sin(angle)))


def disc(rng: np.random.Generator, n: int) -> Array:
    return 10 * np.sqrt(rng.uniform(0, 1, (n, 1))) * around(rng.uniform(0, 2 * np.pi, n))


LIE: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "disc": disc,
    "clusters": lambda rng, n: (
        rng.uniform(-10, 10, (40, 2))[rng.integers(0, 40, n)] + rng.normal(0, 1, (n, 2)) * rng.choice([0.03, 0.3, 1.0], (n, 1))
    ),
    "galaxies": lambda rng, n: (
        rng.exponential(1, (n, 1)) * around(rng.uniform(0, 2 * np.pi, n)) + np.where(np.arange(n) % 2, 0, [[12], [3]]).T
    ),
    "lattice": lambda _, n: np.column_stack(np.divmod(np.arange(n), 63)) * 0.2,
    "ring": lambda _, n: 10 * around(2 * np.pi * np.arange(n) / n),
}


def by_tree(position: Array, mass: Array, softening: float, theta: float = 0.5) -> tuple[Array, float]:
    """Forces (n, 2) and the potential energy, for G = 1."""
    force, rows = np.zeros_like(position), np.arange(len(mass), dtype=np.int32)
    motion = core.unit("motion", position.dtype)
    energy = motion.gravitate(force, position, mass, rows, 1.0, softening, theta, (0, 0, 0, 0), 0, 1)
    return force.astype(float), energy


def by_pairs(position: Array, mass: Array, softening: float) -> tuple[Array, float]:
    """The same, every pair in float64, by NumPy."""
    x, m, force, energy = position.astype(float), mass.astype(float), np.zeros((len(mass), 2)), 0.0
    for some in np.array_split(np.arange(len(m)), -(-len(m) // 100)):
        way = x - x[some, None]
        square = (way**2).sum(axis=2) + softening**2
        near = np.divide(m[some, None] * m, np.sqrt(square), out=np.zeros_like(square), where=square > 0)
        force[some] = (np.divide(near, square, out=near.copy(), where=square > 0)[:, :, None] * way).sum(axis=1)
        near[np.arange(len(some)), some] = 0.0
        energy -= 0.5 * near.sum()
    return force, energy


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("softening", [0.05, 0.0])
@pytest.mark.parametrize("name", ["disc", *(pytest.param(name, marks=pytest.mark.slow) for name in ("clusters", "galaxies"))])
def test_accelerations_are_within_one_per_cent(name: str, softening: float, dtype: Any) -> None:
    rng = np.random.default_rng(3)
    position, mass = LIE[name](rng, N).astype(dtype), rng.uniform(0.5, 1.5, N).astype(dtype)
    force, energy = by_tree(position, mass, softening)
    exact, exact_energy = by_pairs(position, mass, softening)
    error, size = (np.hypot(*(each / mass[:, None]).T) for each in (force - exact, exact))
    # A square of size s < theta d is known to its second moments: what is left is of the order theta^3 / 8 of its own pull.
    assert np.median(error / size) < 2e-3
    assert np.percentile(error, 99) < 1e-2 * size.mean()
    if softening:
        assert error.max() < 1e-2 * size.mean()
    else:  # close pairs, whose pull is far above the mean, have their own scale
        assert (error < 1e-2 * np.maximum(size.mean(), size)).all()
    assert energy == pytest.approx(exact_energy, rel=1e-3)
    # Newton's third law, to rounding: what the sums leave is taken out.
    assert np.abs(force.sum(axis=0)).max() < 4 * np.finfo(dtype).eps * np.abs(force).sum()
    # Angular momentum is kept as well as forces are known: to 1e-4 of what all torques come to without their signs.
    arms = position - np.average(position, axis=0, weights=mass)
    torque = arms[:, 0] * force[:, 1] - arms[:, 1] * force[:, 0]
    assert abs(torque.sum()) < 1e-4 * (np.hypot(*arms.T) * np.hypot(*force.T)).sum()


@pytest.mark.parametrize("name", ["lattice", "ring"])
def test_so_they_are_where_pulls_of_neighbours_cancel(name: str) -> None:
    # With equal masses: what is left on a ring is a sixtieth of what its neighbours do, and each error counts as much more.
    position, mass = LIE[name](np.random.default_rng(3), N), np.ones(N)
    exact, _ = by_pairs(position, mass, 0.05)
    error = np.hypot(*(by_tree(position, mass, 0.05)[0] - exact).T)
    assert error.max() < 1e-2 * np.sqrt((exact**2).sum(axis=1).mean())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("far", [1e6, 1e9])
def test_one_that_has_flown_away_changes_nothing_for_the_others(far: float, dtype: Any) -> None:
    position, mass = disc(np.random.default_rng(3), N).astype(dtype), np.ones(N, dtype)
    position[17] = far, far / 3
    exact = by_pairs(position, mass, 0.05)[0]
    force = by_tree(position, mass, 0.05)[0]
    assert np.hypot(*(force - exact).T).max() < 1.5e-2 * np.sqrt((exact**2).sum(axis=1).mean())


def test_errors_grow_with_theta_and_vanish_without() -> None:
    rng = np.random.default_rng(5)
    position, mass = disc(rng, 1000), np.ones(1000)
    exact, _ = by_pairs(position, mass, 0.1)
    worst = [np.abs(by_tree(position, mass, 0.1, theta)[0] - exact).max() for theta in (1e-6, 0.25, 0.5, 1.0)]
    assert worst[0] < 1e-9 * np.abs(exact).max()  # nothing is far enough: all pairs in another order
    assert worst[1] < worst[2] / 4 < worst[3] / 16


def test_coincident_and_lone_particles() -> None:
    one = by_tree(np.array([[3.0, 4.0]]), np.ones(1), 0.0)
    assert not one[0].any()
    assert one[1] == 0.0
    # A thousand at one point feel the one beside, and nothing of each other: F = 1000 / 5^2, and phi = -1000 / 5.
    position = np.vstack((np.tile([1.0, 2.0], (1000, 1)), [[4.0, 6.0]]))
    force, energy = by_tree(position, np.ones(1001), 0.0)
    assert force[-1] == pytest.approx(-40 * np.array([0.6, 0.8]), rel=1e-9)
    assert force[:1000] == pytest.approx(np.tile([0.04 * 0.6, 0.04 * 0.8], (1000, 1)), rel=1e-9)
    assert energy == pytest.approx(-200.0, rel=1e-9)


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e9])
def test_clusters_far_smaller_than_the_finest_square(scale: float) -> None:
    rng = np.random.default_rng(7)
    tight = scale * 1e-9 * rng.uniform(-1, 1, (600, 2))  # 2^-16 of the extent is 1.5e-5, 2^-32 is 2e-10
    position = np.vstack((tight, scale * rng.uniform(-1, 1, (300, 2))))
    force, _ = by_tree(position, np.ones(900), 0.0)
    exact, _ = by_pairs(position, np.ones(900), 0.0)
    error, size = np.hypot(*(force - exact).T), np.hypot(*exact.T)
    for part in (slice(600), slice(600, 900)):
        assert (error[part] < 1e-2 * np.maximum(size[part].mean(), size[part])).all()


def world_of(n: int, **more: Any) -> tuple[pv.World, Any, pv.Gravitation]:
    options = {"gravity": (0, 0), "collisions": None, "substeps": 2} | more
    world = pv.World(**options)
    stars = world.add(position=disc(np.random.default_rng(1), n), radius=0.01)
    return world, stars, world.forces.append(pv.Gravitation(strength=0.01, softening=0.1))


def test_pinned_particles_take_no_part() -> None:
    world, stars, law = world_of(600)
    stars.mass[7] = np.inf
    before = stars.position.copy()
    world.step(1 / 60)
    exact, energy = by_pairs(np.delete(before, 7, 0), np.ones(599), 0.1)
    assert not stars.velocity[7].any()
    assert law.potential(world._state) == pytest.approx(0.01 * energy, rel=1e-3)
    assert np.delete(stars.velocity, 7, 0) * 60 == pytest.approx(0.01 * exact, abs=1e-2 * 0.01 * np.abs(exact).mean())


def test_theta_0_and_few_and_periodic_rooms_sum_all_pairs() -> None:
    def moved(n: int, theta: float, **more: Any) -> bytes:
        world, stars, law = world_of(n, **more)
        law.theta = theta
        world.step(1 / 60)
        return bytes(stars.velocity.tobytes())

    room = pv.Periodic((-11, -11), (11, 11))
    assert moved(256, 0.5) == moved(256, 0.0)
    assert moved(600, 0.5) != moved(600, 0.0)
    assert moved(600, 0.5, boundary=room) == moved(600, 0.0, boundary=room)


def test_copies_go_on_with_the_same_bits_though_they_forget_the_last_sum() -> None:
    world, stars, law = world_of(600)
    world.step(1 / 60)
    again = pickle.loads(pickle.dumps(world))
    assert law._last
    assert not again.forces[0]._last
    for each in (world, again):
        each.step(1 / 60)
    assert stars.velocity.tobytes() == again.velocity.tobytes()
    stars.position[0] += 1  # what was summed last is not what it would be now
    again.position[0] += 1
    again.forces[0]._last = ()
    for each in (world, again):
        each.step(1 / 60)
    assert stars.velocity.tobytes() == again.velocity.tobytes()
