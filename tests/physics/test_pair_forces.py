"""Pair forces: against sums over all pairs, quadrature, the virial expansion, and what must be conserved."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from tests.worlds import WORLDS, each_frame, empty, go_on_alike, refused

import pyverlet as pv

Array = np.ndarray[Any, Any]


def crystal(world: pv.World, side: int, spacing: float, *, speed: float = 0.3) -> pv.World:
    """side^2 particles on a square grid, at rest as a whole."""
    x = (np.arange(side) + 0.5) * spacing
    velocity = np.random.default_rng(side).normal(0, speed, (side * side, 2))
    world.add(position=np.stack(np.meshgrid(x, x), -1).reshape(-1, 2), velocity=velocity - velocity.mean(axis=0), radius=0.1)
    return world


@pv.pair_force(range=0.9, potential=lambda distance, i, j: 2.0 * (0.9 - distance) ** 2)
def spring(distance: Array, i: Array, j: Array) -> Array:
    return np.asarray(4.0 * (0.9 - distance))


@pv.pair_force(range=1.2, symmetric=False)
def chase(distance: Array, i: Array, j: Array) -> Array:
    return np.asarray(np.where(i < j, -1.0, 0.5) * (1.2 - distance) * (1 + (i + j) % 3))


def summed(world: pv.World, law: Any) -> Array:
    """(n, 2) N: each pair by itself, in the user's order."""
    position, force = world.position.astype(float), np.zeros((len(world), 2))
    for i in range(len(world)):
        for j in range(len(world)):
            way = world.boundary.periodic.nearest(position[i] - position[j])
            distance = np.hypot(*way)
            if 0 < distance < law.range:
                force[i] += float(np.ravel(law.force(np.array([distance]), np.array([i]), np.array([j])))[0]) * way / distance
    return force


LAWS = [
    pv.LennardJones(epsilon=2.0, sigma=0.4), pv.Yukawa(strength=0.3, screening_length=0.25, cutoff=1.1),
    pv.SoftRepulsion(strength=3.0, range=0.8), spring, chase,
]  # fmt: skip
NAMED = pytest.mark.parametrize("law", LAWS, ids=lambda law: getattr(law, "__name__", type(law).__name__))


@NAMED
@pytest.mark.parametrize(("boundary", "dtype"), [(pv.Open(), np.float32), (pv.Periodic((0, 0), (6, 6)), np.float64)])
def test_forces_are_those_of_all_pairs(law: Any, boundary: pv.Boundary, dtype: Any) -> None:
    world = crystal(empty(boundary=boundary, dtype=dtype, substeps=1), 10, 0.6)
    world.position += np.random.default_rng(0).uniform(-0.1, 0.1, (100, 2))
    world.mass[::2] = 2.0
    world.forces.append(law)
    before, expected = world.velocity.astype(float), summed(world, law) / world.mass[:, None]
    dt = 1e-3
    world.step(dt)
    found = (world.velocity.astype(float) - before) / dt  # mean of the accelerations at both ends
    # (a + a') / 2 - a = da/dt h / 2, at most |dF/dr| |v| h / 2 of some neighbours: 5e-3 of the largest; float32: eps |v| / h.
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max() + (1e-3 if dtype == np.float32 else 0)


@pytest.mark.parametrize("law", LAWS[:4], ids=lambda law: getattr(law, "__name__", type(law).__name__))
def test_the_force_is_the_slope_of_the_energy(law: Any) -> None:
    reach = law.range
    r, step = np.linspace(0.3, reach * (1 - 1e-4), 200), 1e-6
    i, j = np.zeros((2, 200), int)
    slope = (law.energy(r + step, i, j) - law.energy(r - step, i, j)) / (2 * step)
    # Central differences: F''' step^2 / 6, and rounding of 1e-16 U / step.
    assert law.force(r, i, j) == pytest.approx(-slope, rel=1e-7, abs=1e-8)
    assert law.energy(np.array([reach]), i[:1], j[:1]) == pytest.approx(0.0, abs=1e-12)


def test_two_bodies_swing_in_the_well_as_long_as_the_integral_says() -> None:
    """T = 2 int dr / sqrt(2 (E - U(r)) / mu) between the turning points, mu = m1 m2 / (m1 + m2)."""
    law = pv.LennardJones(epsilon=1.5, sigma=0.8)
    m1, m2, inner = 1.0, 3.0, 0.86
    one = np.zeros(1, int)

    def u(r: float) -> float:
        return float(law.energy(np.array([r]), one, one)[0])

    mu, energy = m1 * m2 / (m1 + m2), u(inner)
    outer = brentq(lambda r: u(r) - energy, 0.95, 1.9)
    middle, half = (inner + outer) / 2, (outer - inner) / 2
    # r = middle + half sin(s): the roots at the ends are gone.
    period = 2 * quad(
        lambda s: half * np.cos(s) / np.sqrt(2 * max(energy - u(middle + half * np.sin(s)), 1e-300) / mu),
        -np.pi / 2 + 1e-7, np.pi / 2 - 1e-7, limit=200,
    )[0]  # fmt: skip
    world = empty(law, substeps=8)
    world.add(position=[(0, 0), (inner, 0)], mass=(m1, m2), radius=0.01)
    h = 2.5e-4
    r = [world.position[1, 0] - world.position[0, 0] for _ in each_frame(world, int(5.5 * period / h / 8), 8 * h)]
    r_of, t = np.array(r) - middle, 8 * h * np.arange(1, len(r) + 1)
    up = np.flatnonzero((r_of[:-1] < 0) & (r_of[1:] >= 0))
    crossed = t[up] - r_of[up] * 8 * h / (r_of[up + 1] - r_of[up])
    # Order 2: (omega h)^2 / 24 at the steepest, omega = 60 / s at `inner`; linear interpolation of 8 h: 1e-6 of a period.
    assert len(crossed) >= 5
    assert (crossed[-1] - crossed[0]) / (len(crossed) - 1) == pytest.approx(period, rel=2e-5)
    assert world.momentum() == pytest.approx([0, 0], abs=1e-13)


def test_energy_is_kept_to_order_two_and_momentum_to_rounding() -> None:
    errors = []
    for substeps in (4, 8):
        world = crystal(empty(boundary=pv.Periodic((0, 0), (9, 9)), substeps=substeps), 8, 1.125, speed=0.5)
        world.forces.append(pv.LennardJones(epsilon=1.0, sigma=1.0, cutoff=2.0 ** (1 / 6)))  # smooth at the cutoff, to F
        start = world.energy().total
        totals = [world.energy().total - start for _ in each_frame(world, 100, 0.02)]
        errors.append(np.std(totals))
        assert np.abs(world.momentum()).max() < 1e-12
    assert 3 < errors[0] / errors[1] < 5  # 4 for order 2
    assert errors[1] < 1e-3 * start


def mayer(law: pv.LennardJones, thermal: float) -> tuple[float, float]:
    """Second and third virial coefficient in two dimensions, m^2 and m^4, by sums over a grid.

    With f = exp(-U / kT) - 1: B = -1/2 int f d^2r, C = -1/3 int f(r) (f * f)(r) d^2r, * a convolution (Mayer 1940).
    """
    size, count = 16.0, 1600
    x = (np.arange(count) - count // 2) * size / count
    r = np.hypot(*np.meshgrid(x, x)).clip(0.3)
    none = np.zeros(1, int)
    f = np.where(r < law.cutoff, np.expm1(-law.energy(r, none, none) / thermal), 0.0)
    cell, spectrum = (size / count) ** 2, np.fft.rfft2(np.fft.ifftshift(f))
    twice = np.fft.fftshift(np.fft.irfft2(spectrum**2)) * cell
    return -0.5 * f.sum() * cell, -(f * twice).sum() * cell / 3


@pytest.mark.slow  # of the virial alone, without noise, the next test
def test_a_gas_presses_as_its_virial_coefficients_say() -> None:
    """P = n kT (1 + n B + n^2 C + ...): of molecular dynamics in a heat bath, against integrals of the law."""
    law, thermal, density, count = pv.LennardJones(epsilon=1.0, sigma=1.0), 1.0, 0.05, 900
    b, c = mayer(law, thermal)
    assert b == pytest.approx(-np.pi * quad(
        lambda r: np.expm1(-float(law.energy(np.array(r), 0, 0)) / thermal) * r, 0.3, 2.5, limit=200  # type: ignore[arg-type]
    )[0] + np.pi * 0.3**2 / 2, abs=2e-4)  # fmt: skip
    length = np.sqrt(count / density)
    world = empty(boundary=pv.Periodic((0, 0), (length, length)), substeps=10, contacts=True)
    crystal(world, 30, length / 30, speed=1.0)
    world.forces += [law, pv.Langevin(temperature=thermal, friction=0.5, seed=1)]
    world.run(seconds=6, dt=0.1)
    found = []
    for _ in each_frame(world, 600, 0.1):
        ideal = float((world.velocity**2).sum()) / (2 * length**2)  # its fluctuations are known to be those of an ideal gas
        stream = count * float((world.velocity.mean(axis=0) ** 2).sum()) / (2 * length**2)
        found.append((world.pressure() - ideal + stream) / (density * thermal))
    blocks = np.reshape(found, (15, 40)).mean(axis=1)
    error = blocks.std() / np.sqrt(14)
    expected = density * b + density**2 * c  # -0.0351; n^3 D, with D of the order of b^3, is 1e-4
    assert error < 0.1 * abs(expected)
    assert abs(np.mean(found) - expected) < 3 * error + 1e-4
    assert abs(np.mean(found)) > 5 * error  # an ideal gas is told apart


def test_pressure_of_a_still_crystal_is_the_slope_of_its_energy() -> None:
    """P = -dU/dA at rest: all distances times 1 + s change the energy by -2 A P s."""
    law = pv.LennardJones(epsilon=1.0, sigma=1.0)

    def at(scale: float) -> pv.World:
        world = empty(law, boundary=pv.Periodic((0, 0), (8.8 * scale, 8.8 * scale)), contacts=True)
        return crystal(world, 8, 1.1 * scale, speed=0.0)

    step = 1e-5
    slope = (at(1 + step).energy().total - at(1 - step).energy().total) / (2 * step)
    assert at(1.0).pressure() == pytest.approx(-slope / (2 * 8.8**2), rel=1e-6)


def test_work_of_forces_that_are_not_symmetric_is_in_the_ledger() -> None:
    world = crystal(empty(chase, ledger=True, substeps=16), 6, 0.5)
    world.run(seconds=1.0)
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12)
    assert abs(world.ledger.forces) > 1.0
    # The trapezoidal rule and the integrator are of order 2: (omega h)^2 with omega = 3 / s and h = 1e-3 s.
    assert abs(world.ledger.residual) < 1e-3 * abs(world.ledger.forces)
    assert np.abs(world.momentum()).max() > 1e-3


def test_a_class_of_ones_own() -> None:
    class Hunt(pv.PairForce):
        range, symmetric = 2.0, False

        def force(self, distance: Array, i: Array, j: Array) -> Any:
            return np.where(i == 0, -1.0, 0.5)

    class Push(pv.PairForce):
        range = 2.0

        def force(self, distance: Array, i: Array, j: Array) -> Any:
            return 1.0  # the same for all

    for law, expected in ((Hunt(), [(0.01, 0), (0.005, 0)]), (Push(), [(-0.01, 0), (0.01, 0)])):
        world = empty(law, substeps=1)
        world.add(position=[(0, 0), (1, 0)], radius=0.1)
        world.step(0.01)
        assert world.velocity == pytest.approx(np.array(expected), rel=1e-12)


def test_copies_go_on_with_the_same_bits(tmp_path: Path) -> None:
    # Several laws, of which two of a user's own share a list with others; some particles are pinned, some removed.
    world = WORLDS["sticky"](events=True)
    world.forces += [spring, chase]
    world.run(seconds=0.3)
    world.remove([3, 77, 140])
    world.run(seconds=0.1)
    assert go_on_alike(world, tmp_path, 8, [spring, chase])[-1]["bonds"] != [[]]


def test_one_law_in_two_worlds() -> None:
    law = pv.LennardJones(epsilon=1.0, sigma=0.4)
    alone, *both = crystal(empty(law), 6, 0.5), crystal(empty(law), 6, 0.5), crystal(empty(law), 5, 0.55)
    for _ in range(20):
        for world in both:
            world.step(0.01)
    alone.run(seconds=0.2, dt=0.01)
    assert alone.state_hash() == both[0].state_hash()


def test_soft_particles_at_one_place_part_along_x() -> None:
    """r'' = w^2 (R - r) with w^2 = 2 F / (m R) = 4: r = R (1 - cos w t) up to R, then on at w R; F R / 2 = 1 J is U."""
    world = empty(pv.SoftRepulsion(strength=2.0, range=1.0))
    world.add(position=[(3, 1), (3, 1)], mass=1.0)
    assert world.energy().potential == pytest.approx(1.0, rel=1e-12)
    world.run(seconds=0.5)
    assert np.diff(world.position[:, 0]) == pytest.approx([1 - np.cos(1)], rel=1e-4)
    world.run(seconds=0.5)
    assert np.diff(world.position[:, 0]) == pytest.approx([1 + 2 - np.pi / 2], rel=1e-4)
    assert world.velocity == pytest.approx(np.array([(-1.0, 0), (1.0, 0)]), rel=1e-4)
    assert (world.position[:, 1] == 1).all()


def test_pinned_particles_push_and_feel_nothing() -> None:
    world = empty(pv.SoftRepulsion(strength=2.0, range=1.0))
    group = world.add(position=[(0, 0), (0.5, 0), (0, 0.5)], radius=0.1)
    group.pin([0, 2])
    # Of the two pinned ones nothing is counted: U = 2 (1 - r)^2 / 2 for 0-1 and 1-2.
    assert world.energy().potential == pytest.approx(0.25 + (1 - np.sqrt(0.5)) ** 2, rel=1e-12)
    world.run(seconds=0.2)
    assert world.velocity[1, 0] > 0.1
    assert world.position[[0, 2]].tolist() == [[0, 0], [0, 0.5]]


def law(returned: Any, **options: Any) -> Any:
    @pv.pair_force(**{"range": 1.0} | options)
    def mine(distance: Array, i: Array, j: Array) -> Any:
        return returned(distance, i, j)

    return mine


REFUSED: dict[str, tuple[Any, Any, str]] = {
    "shape": (lambda d, i, j: np.zeros(3), pv.InputError, r"'mine' \(.*line \d+\) returns an array of shape \(3,\) for 1 pairs"),
    "none": (lambda d, i, j: None, pv.InputError, "returns None for 1 pairs; allowed is code on arrays"),
    "raises": (lambda d, i, j: 1 / 0, pv.InputError, "raised ZeroDivisionError"),
    "if": (lambda d, i, j: 1.0 if (d < [0.1, 0.2]).all() and d else np.arange(5), pv.InputError, "allowed is code on arrays"),
    "nan": (lambda d, i, j: d * np.nan, pv.NonFiniteError, r"returned nan for particles 0 and 1 at a distance of 0\.5"),
    "one-sided": (lambda d, i, j: 1.0 * (i < j), pv.InputError, r"returns 1 for particles 0 and 1, and 0 .*=False"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_functions_that_fail_are_named_in_one_sentence(case: str) -> None:
    function, kind, says = REFUSED[case]
    world = empty(law(function))
    world.add(position=[(0, 0), (0.5, 0)], radius=0.1)
    with pytest.raises(kind, match=says):
        world.step(0.01)
    assert world.position.tolist() == [[0, 0], [0.5, 0]]


@pytest.mark.parametrize(
    ("reach", "force", "energy", "says"),
    [
        (-1, 1.0, 0.0, "range is -1; allowed is a finite number greater than 0"),
        ("far", 1.0, 0.0, "range is 'far'; allowed"), (np.nan, 1.0, 0.0, "range is nan; allowed"),
        (1.0, np.zeros(3), 0.0, r"Own\(\) returned array.* for 1 pairs; allowed is one number for each"),
        (1.0, "x", 0.0, r"Own\(\) returned 'x' for 1 pairs; allowed"), (1.0, 0.0, np.zeros(3), r"Own\(\) returned array"),
    ],
)  # fmt: skip
def test_a_class_of_ones_own_is_checked(reach: Any, force: Any, energy: Any, says: str) -> None:
    class Own(pv.PairLaw):
        range = reach

        def force(self, distance: Array, i: Array, j: Array) -> Any:
            return force

        def energy(self, distance: Array, i: Array, j: Array) -> Any:
            return energy

    world = empty(Own())
    world.add(position=[(0, 0), (0.5, 0)], radius=0.1)
    refused(says, lambda: world.run(seconds=0.01 + 0.0 * world.energy().total))


@pytest.mark.parametrize("collisions", [None, pv.Collisions()])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_overlapping_atoms_are_refused_before_they_explode(dtype: Any, collisions: Any) -> None:
    # At random 2 of 300 are 0.015 m apart: F = 48 epsilon sigma^12 / r^13 = 3e20 N, which moves 1 kg by F h^2 = 1.5e15 m.
    where = np.random.default_rng(0).uniform(0, 6, (300, 2))
    world = pv.World(boundary=pv.Periodic((0, 0), (6, 6)), gravity=(0, 0), collisions=collisions, dtype=dtype, ledger=True)
    world.add(position=where, radius=0.1, mass=1.0)
    world.forces.append(pv.LennardJones(epsilon=1.0, sigma=0.4))
    says = r"moves particles 31 and 117, 0.0152 m apart, by 1.47e\+15 m in a substep; allowed is at most its range, 1 m: let them"
    refused(says, world.step, 1 / 60)
    assert np.array_equal(world.position, where.astype(dtype))


def test_a_room_narrower_than_two_ranges_is_refused() -> None:
    world = crystal(empty(pv.LennardJones(epsilon=1, sigma=1), boundary=pv.Periodic((0, 0), (3, 3))), 5, 0.6)
    refused(r"range is 2.5; allowed in this periodic room is at most 1.5", world.step, 0.01)
    refused(r"range is 2.5", world.energy)


@pytest.mark.parametrize("dts", [(1 / 60,), (1 / 30,), (0.1,), (0.25, 1 / 240, 1 / 20)])
@pytest.mark.parametrize("law", [pv.LennardJones(epsilon=50.0, sigma=1.0), pv.SoftRepulsion(strength=2e4, range=1.5)], ids=repr)
def test_a_vapour_keeps_its_energy_at_any_frame_rate(law: pv.PairLaw, dts: tuple[float, ...]) -> None:
    # Verlet's energy goes up and down by (omega h)^2 / 4 of what is in collisions: some per cent of these. Frames that are
    # stepped as they are end within a second, with molecules that fly apart.
    world = pv.World(gravity=(0, 0), boundary=pv.Periodic((0, 0), (20, 20)), collisions=None, dtype=np.float64)
    k, rng = np.arange(100), np.random.default_rng(0)
    world.add(position=np.column_stack((k % 10, k // 10)) * 2.0 + 0.5, velocity=rng.normal(0, 5, (100, 2)), radius=0.5)
    world.forces.append(law)
    start = world.energy()
    while world.time < 3.0:
        world.step(float(rng.choice(dts)))
        assert abs(world.energy().total - start.total) < 0.03 * start.kinetic
