"""A heat bath: Ornstein-Uhlenbeck to the last digit that samples allow, equipartition, bits, the ledger."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, empty

import pyverlet as pv
from pyverlet.lab import table
from pyverlet.scenes.gas import henderson

COUNT = 20_000


def free(*, temperature: float = 2.0, friction: float = 1.5, seed: int = 4, count: int = COUNT, **options: Any) -> pv.World:
    """Particles apart from each other, half of them nine times as heavy."""
    world = empty(pv.Langevin(temperature=temperature, friction=friction, seed=seed), **{"substeps": 1} | options)
    side = int(np.ceil(np.sqrt(count)))
    k = np.arange(count)
    world.add(position=np.column_stack((k % side, k // side)), mass=np.where(k % 2, 9.0, 1.0), radius=0.1)
    return world


@pytest.mark.parametrize("h", [0.01, 0.5, 50.0])
def test_a_step_of_any_length_is_exact(h: float) -> None:
    """<v'> = v c and var v' = (1 - c^2) kT / m for each direction, with c = exp(-friction h); and it is normal: kurtosis 3."""
    world, before = free(), np.array([1.0, -2.0])
    world.velocity[:] = before
    world.step(h)
    c = np.exp(-1.5 * h)
    for heavy, mass in ((0, 1.0), (1, 9.0)):
        got, spread = world.velocity[heavy::2] - c * before, np.sqrt((1 - c * c) * 2.0 / mass)
        many = COUNT / 2
        # Of n normal numbers: the mean has an error of 1 / sqrt(n), the variance sqrt(2 / n), the kurtosis sqrt(24 / n), skewed.
        assert np.abs(got.mean(axis=0) / spread).max() < 4 / np.sqrt(many)
        assert got.var(axis=0) / spread**2 == pytest.approx(1.0, abs=4 * np.sqrt(2 / many))
        assert ((got / spread) ** 4).mean(axis=0) == pytest.approx(3.0, abs=5 * np.sqrt(24 / many))
        assert abs((got[:, 0] * got[:, 1]).mean() / spread**2) < 4 / np.sqrt(many)
        # Neighbours in number, and the same particle a frame later, know nothing of each other.
        assert abs((got[1:, 0] * got[:-1, 0]).mean() / spread**2) < 4 / np.sqrt(many)
    last = world.velocity.copy()
    world.step(h)
    step = world.velocity - c * last
    assert abs((step * (last - c * before))[1::2].mean() / ((1 - c * c) * 2.0 / 9.0)) < 4 / np.sqrt(COUNT)


def test_particles_diffuse_as_einstein_says() -> None:
    """<|x - x0|^2> = 4 D (t - (1 - exp(-g t)) / g) with D = kT / (m g), from equilibrium (Uhlenbeck and Ornstein 1930)."""
    world = free(substeps=4)
    rng, mass = np.random.default_rng(0), world.mass[:, None]
    world.velocity[:] = rng.normal(size=world.velocity.shape) * np.sqrt(2.0 / mass)
    start = world.position.copy()
    world.run(seconds=4, dt=0.1)
    t, g = 4.0, 1.5
    for heavy, m in ((0, 1.0), (1, 9.0)):
        square = ((world.position - start)[heavy::2] ** 2).sum(axis=1).mean()
        expected = 4 * 2.0 / (m * g) * (t - (1 - np.exp(-g * t)) / g)
        # Exponentially distributed: an error of 1 / sqrt(n); the substep, of order 2: (g h)^2 / 12 = 1e-4.
        assert square == pytest.approx(expected, rel=4 / np.sqrt(COUNT / 2))


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_equipartition_to_a_per_cent(dtype: Any) -> None:
    """In the crowd of a Lennard-Jones fluid, of two masses, each particle holds kT of motion."""
    world = pv.World(gravity=(0, 0), boundary=pv.Periodic((0, 0), (66, 66)), collisions=None, dtype=dtype, substeps=8)
    x = 1.5 * np.arange(44) + 0.5
    world.add(
        position=np.stack(np.meshgrid(x, x), -1).reshape(-1, 2), mass=np.where(np.arange(44 * 44) % 2, 9.0, 1.0), radius=0.4
    )
    world.forces += [pv.LennardJones(epsilon=1.0, sigma=1.0), pv.Langevin(temperature=0.8, friction=3.0, seed=2)]
    world.run(seconds=3, dt=0.04)
    light, heavy = [], []
    for _ in range(80):
        world.run(seconds=0.16, dt=0.04)
        motion = 0.5 * world.mass * (world.velocity.astype(float) ** 2).sum(axis=1)
        light.append(motion[::2].mean() / 0.8)
        heavy.append(motion[1::2].mean() / 0.8)
    # 968 particles of each, remembered for 1 / (2 friction) = 0.17 s: 80 samples are worth 38, and 1 / sqrt(38 * 968) = 0.5 %.
    assert np.mean(light) == pytest.approx(1.0, abs=0.015)
    assert np.mean(heavy) == pytest.approx(1.0, abs=0.015)
    assert (np.mean(light) + np.mean(heavy)) / 2 == pytest.approx(1.0, abs=0.01)


INTEGRATORS = {"position-verlet": pv.PositionVerlet(), "velocity-verlet": pv.VelocityVerlet(), "rk4": pv.RK4()}


@pytest.mark.parametrize(
    ("integrator", "friction", "h"),
    [*((name, 0.5, 0.05) for name in ("velocity-verlet", "rk4")), *((name, 4.0, 0.2) for name in ("position-verlet", "rk4"))],
)
def test_a_harmonic_well_holds_half_kt_a_direction(integrator: str, friction: float, h: float) -> None:
    """k <x^2> = kT, for position Verlet exactly at any h; others have an error of order 2, (omega h)^2 / 4 at most."""
    world = free(friction=friction, integrator=INTEGRATORS[integrator], substeps=5)
    world.forces.append(pv.PointSpring(stiffness=9.0))  # omega = 3 and 1 / s
    rng = np.random.default_rng(1)
    world.position[:] = rng.normal(0, np.sqrt(2.0 / 9.0), world.position.shape)  # as it is to stay
    world.velocity[:] = rng.normal(size=world.position.shape) * np.sqrt(2.0 / world.mass[:, None])
    warm = [(world.position**2).mean(axis=1) * 9.0 / 2.0 for step in each_frame(world, 40, 5 * h) if step >= 20]
    for heavy, omega in ((0, 3.0), (1, 1.0)):
        found = np.mean([row[heavy::2].mean() for row in warm])
        # 20,000 coordinates, 20 times: worth 5 at least. 4 sqrt(2 / (5 * 20,000)) = 1.8 %.
        allowed = 0.018 + (0.0 if integrator == "position-verlet" else (omega * h) ** 2 / 4)
        assert found == pytest.approx(1.0, abs=allowed)


def test_without_a_temperature_it_is_friction() -> None:
    world = free(temperature=0.0, count=10)
    world.velocity[:] = 3.0, -1.0
    world.run(seconds=1, dt=0.1)
    assert world.velocity == pytest.approx(np.exp(-1.5) * np.array([[3.0, -1.0]] * 10), rel=1e-12)


def test_pinned_particles_and_spins_are_left_alone() -> None:
    world = free(count=4)
    world.mass[0] = np.inf
    world.spin[:] = 2.0
    world.run(seconds=0.5)
    assert world.velocity[0].tolist() == [0, 0]
    assert world.position[0].tolist() == [0, 0]
    assert world.spin.tolist() == [2, 2, 2, 2]
    assert world.velocity[1:].all()


def test_what_a_particle_gets_depends_on_its_number_and_the_time_alone() -> None:
    world, few = free(count=100), free(count=100)
    few.remove(np.arange(50))
    for each in (world, few):
        each.run(seconds=0.3, dt=0.05)
    assert few.velocity.tobytes() == world.velocity[50:].tobytes()
    other = free(count=100, seed=5)
    other.run(seconds=0.3, dt=0.05)
    assert not (other.velocity == world.velocity).any()


def test_the_ledger_has_what_the_bath_gives() -> None:
    world = free(ledger=True, count=400)
    world.run(seconds=2, dt=0.1)
    # Without forces nothing else changes the energy.
    assert world.ledger.thermostat == pytest.approx(world.energy().total, rel=1e-12)
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12)


def test_the_ledger_in_a_well_and_with_contacts() -> None:
    world = free(
        ledger=True, count=400, substeps=8, collisions=pv.Collisions(restitution=0.5), boundary=pv.Box((-1, -1), (21, 21))
    )
    world.radius[:] = 0.4
    world.forces.append(pv.PointSpring(center=(10, 10), stiffness=1.0))
    start = world.energy().total
    world.run(seconds=60 / 60)
    ledger = world.ledger
    assert ledger.total == pytest.approx(world.energy().total, rel=1e-9)
    assert ledger.restitution < -1.0
    assert ledger.thermostat > 50.0
    # Order 2 in omega h = 2e-3, and kicks that shift positions by up to v h / 2 in a well: below 1e-3 of what there is.
    assert abs(ledger.residual) < 1e-3 * start


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_ledger_of_drag_in_a_heat_bath(dtype: Any) -> None:
    # In balance m <v^2> / 2 = kT gamma / (gamma + k / m) for two directions: drag takes n k <v^2> = 9600 W. The bath kicks once a
    # substep, between two of the powers of drag: what is left over is of the second order of k h / m = 0.06.
    world = empty(pv.Langevin(temperature=1.0, friction=20.0, seed=2), pv.Drag(linear=30.0), ledger=True, dtype=dtype)
    world.add(position=np.random.default_rng(0).uniform(0, 9, (400, 2)), radius=0.1, mass=1.0)
    world.run(seconds=0.5, dt=1 / 60)
    assert world.ledger.drag == pytest.approx(-0.5 * 400 * 30.0 * 2 * 20.0 / (20.0 + 30.0), rel=0.02)
    assert abs(world.ledger.residual) < 0.06**2 * abs(world.ledger.drag)


# ---- A gas keeps its pressure however far its circles move in a substep ----


@pytest.mark.parametrize("step", [0.1, 0.3, 1.0])
def test_a_gas_presses_as_henderson_says(step: float) -> None:
    # Some 3,000 impacts on the walls in 6 s, correlated over a few: 3 % of statistics. Walls add some more: an edge of r in 18 m.
    assert table.measure_pressure(0.6, step, seconds=6.0)["compressibility"] == pytest.approx(henderson(0.6), rel=0.08)
