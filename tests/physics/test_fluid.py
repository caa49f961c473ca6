"""Fluids of particles: against sums over all pairs, hydrostatics, Archimedes, and a dam that broke in 1952."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, forces_of, grid, pull_of, refused

import pyverlet as pv
from pyverlet.laws.forces.fluid import FLUID, MEASURED, SUPPORT

Array = Any

G, DT, RHO = 9.81, 1 / 60, 1000.0


def lattice(columns: int, rows: int, s: float) -> Array:
    return grid(columns, rows, s, (s / 2, s / 2), loose=0)


def fill(world: pv.World, where: Array, spacing: float, sound: float, thick: float = 0.03) -> tuple[Any, pv.Fluid]:
    """A fluid in which sound comes `sound` spacings in a substep; thick: viscosity times the substep, in squares of these."""
    h = DT / world.substeps
    water = world.add(position=where, radius=spacing / 2, mass=RHO * spacing**2, friction=0.0, restitution=0.0)
    stiffness, viscosity = (sound * spacing / h) ** 2, thick * spacing**2 / h
    return water, world.forces.append(pv.Fluid(water, rest_density=RHO, stiffness=stiffness, viscosity=viscosity))


def smooth_box(width: float, height: float) -> pv.Box:
    return pv.Box((0, 0), (width, height), restitution=0.0, friction=0.0)


def shaken(boundary: Any, dtype: Any = np.float64) -> tuple[pv.World, Any, pv.Fluid]:
    """Two hundred particles that overlap and move at random, in the left lower corner of a room."""
    rng = np.random.default_rng(4)
    world = pv.World(boundary=boundary, gravity=(0, 0), collisions=None, dtype=dtype, substeps=4)
    water, fluid = fill(world, lattice(20, 10, 0.1) + rng.uniform(-0.03, 0.03, (200, 2)), 0.1, 0.5, 0.02)
    water.velocity = rng.normal(0, 1, (200, 2))
    return world, water, fluid


def by_pairs(fluid: pv.Fluid, x: Array, v: Array, m: Array) -> tuple[Array, Array]:
    """Forces and densities by the formulas, all pairs in float64: W = 7 / (pi R^2) (1 - q)^4 (1 + 4 q)."""
    reach = SUPPORT * np.sqrt(m.mean() / RHO)
    d, u = x[:, None] - x[None], v[:, None] - v[None]
    square = (d**2).sum(axis=-1)
    q = np.minimum(np.sqrt(square) / reach, 1)
    density = 7 / (np.pi * reach**2) * ((1 - q) ** 4 * (1 + 4 * q)) @ m
    share = fluid.stiffness * np.maximum(density - RHO, 0) / density**2
    slope = 140 / (np.pi * reach**4) * (1 - q) ** 3  # -W' / r
    drag = 8 * fluid.viscosity / RHO * (u * d).sum(axis=-1) / (square + reach**2 / 400)
    return ((np.outer(m, m) * slope * (share[:, None] + share[None] - drag))[..., None] * d).sum(axis=1), density


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_forces_are_those_of_all_pairs_and_keep_momentum(dtype: Any) -> None:
    world, water, fluid = shaken(pv.Open(), dtype)
    eps = float(np.finfo(dtype).eps)
    force = forces_of(fluid, world)
    x, v, m = (np.array(each, float) for each in (water.position, water.velocity, water.mass))
    exact, density = by_pairs(fluid, x, v, m)
    assert force == pytest.approx(exact, abs=100 * eps * np.abs(exact).max())
    assert fluid.density == pytest.approx(density, rel=100 * eps)
    pressure = MEASURED * fluid.stiffness * np.maximum(density - RHO, 0)
    assert fluid.pressure == pytest.approx(pressure, abs=100 * eps * fluid.stiffness * RHO)
    assert np.abs(force.sum(axis=0)).max() < eps * np.abs(force).sum()
    torque = x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]
    assert abs(torque.sum()) < eps * (np.hypot(*x.T) * np.hypot(*force.T)).sum()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_drops_that_fall_for_ever_change_no_force(dtype: Any) -> None:
    found = []
    for depth in (0.0, 2e4):
        world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=None, dtype=dtype, threads=1)
        body = lattice(40, 45, 0.1) + np.random.default_rng(1).uniform(-0.03, 0.03, (1800, 2))
        drops = np.column_stack((np.linspace(0, 4, 200), -5 - np.linspace(0, 1, 200) ** 2 * depth - 0.5 * np.arange(200)))
        _, fluid = fill(world, np.concatenate((body, drops)), 0.1, 0.5)
        found.append(forces_of(fluid, world)[:1800])
    # Rows begin elsewhere, so that neighbours are summed in another order.
    assert found[1] == pytest.approx(found[0], abs=100 * float(np.finfo(dtype).eps) * np.abs(found[0]).max())


ROOMS = [pv.Open(), smooth_box(2.0, 1.0), pv.Circle(center=(1, 0.5), radius=1.2), pv.Periodic((0, 0), (2, 1))]
ROOMS += [pv.Periodic((0, 0), (2, 1), axes="x")]


@pytest.mark.parametrize("room", ROOMS, ids=repr)
def test_the_force_without_viscosity_is_minus_the_slope_of_the_potential(room: Any) -> None:
    world, _, fluid = shaken(room)
    fluid.viscosity = 0.0
    force, energy = forces_of(fluid, world), fluid.potential(world._state)
    # An error of order step^2, and rounding of the energy over the step. A round wall is a mirror that turns, which forces leave
    # out: reach / radius of those at it.
    within = (0.1 if isinstance(room, pv.Circle) else 1e-5) * np.abs(force).max() + 1e-9 * energy / 1e-6
    for k in (0, 9, 87, 140, 199):  # in corners, at walls, within
        assert force[k] == pytest.approx(pull_of(lambda: fluid.potential(world._state), world, k), abs=within)


@pytest.mark.parametrize(("axes", "move"), [("xy", (0.77, 0.61)), ("x", (1.07, 0.0))])
def test_a_seam_ends_neither_pairs_nor_floor_nor_disc(axes: str, move: tuple[float, float]) -> None:
    world, water, fluid = shaken(pv.Periodic((0, 0), (2, 1), axes=axes))
    groups = [water, *([world.add(position=(0.9, 0.9), radius=0.3, mass=1.0, on_overlap="push")] if axes == "x" else [])]
    force = forces_of(fluid, world)
    for group in groups:
        group.position += move
        group.position[:] = world.boundary.periodic.wrapped(np.ascontiguousarray(group.position))
    assert np.abs(force[-1]).max() > 0
    assert forces_of(fluid, world) == pytest.approx(force, abs=1e-9 * np.abs(force).max())


def test_a_potential_of_known_densities_is_that_of_new_ones() -> None:
    world, water, fluid = shaken(smooth_box(2.0, 3.0), np.float32)
    world.add(position=[(1.5, 1.4), (0.5, 1.3)], radius=0.4, mass=1.0)
    forces_of(fluid, world)
    known, fluid._last = fluid.potential(world._state), ()
    assert fluid.potential(world._state) == known
    water.position[7, 0] += 0.01
    assert fluid.potential(world._state) != known


@pytest.mark.parametrize("rows", [1.0, np.sqrt(3) / 2])
def test_pressure_is_force_per_length_in_a_lattice(rows: float) -> None:
    # Virial theorem: force per length = p n m^2 / rho^2 sum -W'(r) r / 2, for n m = 1 kg/m^2 and rho = m sum W.
    y, x = np.meshgrid(np.arange(-6, 7), np.arange(-6, 7))
    r = np.hypot(x + (0.5 * y if rows < 1 else 0), y * rows) / np.sqrt(rows)
    q = np.minimum(r / SUPPORT, 1)
    density = (7 / (np.pi * SUPPORT**2) * (1 - q) ** 4 * (1 + 4 * q)).sum()
    virial = (70 / (np.pi * SUPPORT**4) * (1 - q) ** 3 * r**2).sum()
    assert pytest.approx(virial / density**2, rel=0.01) == MEASURED


def test_a_tank_at_rest_has_hydrostatic_pressure_and_a_level_surface() -> None:
    columns, rows, s = 20, 30, 0.1
    world = pv.World(boundary=smooth_box(columns * s, 6.0), gravity=(0, -G), collisions=None)
    water, fluid = fill(world, lattice(columns, rows, s), s, 1.0, 0.06)
    world.run(seconds=4, dt=DT)
    assert np.abs(water.velocity).max() < 0.15
    height, pressure = water.position[:, 1].astype(float), np.zeros(len(water))
    for _ in each_frame(world, 60):  # sound goes on for a while
        pressure += fluid.pressure / 60
    order = np.argsort(-height)
    above = (np.arange(len(order)) + 0.5) * RHO * s * s * G / (columns * s)  # N/m, the weight above each over the width
    for first in range(60, 580, 40):  # by layers of two rows; the one at the surface is half in the air
        row = order[first : first + 40]
        assert pressure[row].mean() == pytest.approx(above[first : first + 40].mean(), rel=0.03)
    assert pressure[order[60:580]].mean() == pytest.approx(above[60:580].mean(), rel=0.02)
    # That is rho g depth: what presses it makes it heavier by p / c^2 rho, here up to g H / c^2 = 1.3 %.
    depth = height[order[:20]].mean() + s / 2 - height
    deep = depth > 1.0
    assert pressure[deep].mean() == pytest.approx(RHO * G * depth[deep].mean(), rel=0.05)
    tops = [height[np.abs(water.position[:, 0] - x) < 0.2].max() for x in np.arange(0.2, 2.0, 0.2)]
    assert np.ptp(tops) < 0.5 * s
    assert np.mean(tops) == pytest.approx(rows * s - s / 2, abs=1.0 * s)


def test_the_front_of_a_broken_dam_is_where_it_was_measured() -> None:
    # Martin and Moyce, Phil. Trans. R. Soc. A 244 (1952) 312: a square column of water, 2.25 in; T = t sqrt(g / a), Z = z / a.
    measured = np.array([
        (0.43, 1.11), (0.62, 1.22), (0.80, 1.44), (0.97, 1.67), (1.14, 1.89), (1.29, 2.11), (1.45, 2.33), (1.62, 2.56),
        (1.76, 2.78), (1.93, 3.00), (2.07, 3.22), (2.24, 3.44), (2.40, 3.67), (2.54, 3.89), (2.71, 4.11), (2.87, 4.33),
    ])  # fmt: skip
    fallen = np.array([(0.80, 0.89), (1.29, 0.78), (1.74, 0.67), (2.15, 0.56)])  # height of the column, H = eta / a
    n, a = 32, 4.0
    world = pv.World(boundary=smooth_box(6 * a, 2 * a), gravity=(0, -G), collisions=None)
    water, _ = fill(world, lattice(n, n, a / n), a / n, 0.8, 0.06)
    time, front, top = [0.0], [1.0], [1.0]
    while time[-1] < 2.9:
        world.step(DT)
        x, y = water.position.T
        time.append(world.time * np.sqrt(G / a))
        front.append(float(x.max()) / a)
        top.append(float(y[x < 0.1 * a].max()) / a)
    assert np.interp(measured[:, 0], time, front) == pytest.approx(measured[:, 1], rel=0.10)
    assert np.interp(fallen[:, 0], time, top) == pytest.approx(fallen[:, 1], rel=0.10)


@pytest.mark.parametrize(
    ("radius", "ratio", "columns", "rows"),
    [(1.0, 0.6, 46, 24), (0.2, 0.6, 30, 15), pytest.param(1.0, 0.3, 52, 26, marks=pytest.mark.slow)],
)
def test_discs_float_as_archimedes_has_it(radius: float, ratio: float, columns: int, rows: int) -> None:
    s = 0.1
    world = pv.World(boundary=smooth_box(columns * s, 6.0), gravity=(0, -G))
    where, middle = lattice(columns, rows, s), np.array([columns * s / 2, rows * s])
    water, _ = fill(world, where[np.hypot(*(where - middle).T) > radius + s / 2], s, 0.8, 0.06)
    disc = world.add(position=middle, radius=radius, mass=ratio * RHO * np.pi * radius**2, friction=0.0, restitution=0.0)
    world.run(seconds=5, dt=DT)
    heights, levels = [], []
    for _ in each_frame(world, 60):
        x, y = water.position.T
        far = np.abs(x - disc.position[0, 0]) > radius + 4 * s
        tops = [y[far & (np.abs(x - at) < 0.2)].max(initial=0.0) for at in np.arange(0.2, columns * s, 0.4)]
        levels.append(np.mean([top for top in tops if top > 0]) + s / 2)
        heights.append(float(disc.position[0, 1]))
    # A segment of the disc, up to the level: (arccos(-u) + u sqrt(1 - u^2)) / pi of its area, u = (level - height) / radius.
    u = (np.mean(levels) - np.mean(heights)) / radius
    immersed = (np.arccos(-u) + u * np.sqrt(1 - u * u)) / np.pi
    assert immersed == pytest.approx(ratio, rel=0.04)


def test_a_heavy_disc_sinks() -> None:
    world = pv.World(boundary=smooth_box(3.0, 4.0), gravity=(0, -G))
    fill(world, lattice(30, 15, 0.1), 0.1, 0.6, 0.05)
    stone = world.add(position=(1.5, 2.0), radius=0.3, mass=3 * RHO * np.pi * 0.09, friction=0.0, restitution=0.0)
    world.run(seconds=2, dt=DT)
    assert stone.position[0, 1] < 0.45


def test_shear_decays_by_the_viscosity() -> None:
    # v = V sin(k y) decays as exp(-nu k^2 t): the viscosity of Monaghan (2005) is nu, to what sums over 20 neighbours make of it.
    side, s = 4.0, 0.1
    world = pv.World(boundary=pv.Periodic((0, 0), (side, side)), gravity=(0, 0), collisions=None)
    where = lattice(40, 40, s) + np.random.default_rng(2).uniform(-0.3, 0.3, (1600, 2)) * s  # a lattice has directions
    water, fluid = fill(world, where, s, 0.8, 0.04)
    world.run(seconds=1, dt=DT)
    k = 2 * np.pi / side
    wave = np.sin(k * water.position[:, 1].astype(float))
    water.velocity[:] = np.column_stack((0.3 * wave, 0 * wave))
    start = world.time
    before = float(water.velocity[:, 0] @ wave)
    seconds = 0.5 / (fluid.viscosity * k**2)
    world.run(seconds=round(seconds * 60) / 60, dt=DT)
    wave = np.sin(k * water.position[:, 1].astype(float))
    decay = -np.log(float(water.velocity[:, 0] @ wave) / before)
    assert decay == pytest.approx(fluid.viscosity * k**2 * (world.time - start), rel=0.1)


def test_the_books_balance_and_viscosity_is_drag() -> None:
    world = pv.World(boundary=smooth_box(6.0, 4.0), gravity=(0, -G), collisions=None, ledger=True, dtype=np.float64)
    fill(world, lattice(15, 20, 0.1), 0.1, 0.6, 0.03)
    world.step(DT)
    start = world.energy().total
    given = world.ledger.drag
    world.run(seconds=1, dt=DT)
    lost, drag = world.energy().total - start, world.ledger.drag - given
    assert drag < 0.5 * lost < 0  # the rest is lost to walls
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-9)
    # The leapfrog's own error, with sound at 0.6 spacings a substep.
    assert abs(world.ledger.residual) < 0.1 * abs(drag)


@pytest.mark.parametrize("bits", [{"category": 1 << 5, "mask": 1 << 5}, {"mask": 1}, {}])
def test_the_ledger_sees_the_mirrors_that_the_fluid_sees(bits: Any) -> None:
    # A disc that does not meet the water is no mirror to it: ledgers took it for one, and were off by a tenth of the energy.
    world = pv.World(boundary=smooth_box(2.0, 3.0), gravity=(0, -G), ledger=True, dtype=np.float64)
    fill(world, lattice(20, 10, 0.1), 0.1, 0.5, 0.03)
    world.add(position=(1.0, 0.8), radius=0.3, mass=200.0, **bits)
    for _ in each_frame(world, 10):
        assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-9)


def test_the_ledger_of_a_fluid_of_all_particles_is_that_of_their_group() -> None:
    kept = []
    for some in (True, False):
        world = pv.World(boundary=smooth_box(2.0, 2.0), gravity=(0, -G), collisions=None, ledger=True, dtype=np.float64)
        group = world.add(position=lattice(8, 8, 0.1), radius=0.05, mass=0.01)
        world.forces.append(pv.Fluid(group if some else None, rest_density=1.0, stiffness=100.0))
        world.run(seconds=0.1, dt=DT)
        kept.append(world.ledger)
    assert kept[0] == kept[1]


def test_without_viscosity_energy_is_kept() -> None:
    world = pv.World(boundary=pv.Periodic((0, 0), (2, 2)), gravity=(0, 0), collisions=None, dtype=np.float64)
    water, _ = fill(world, lattice(20, 20, 0.1), 0.1, 0.3, 0.0)
    water.velocity = np.random.default_rng(1).normal(0, 0.3, (400, 2))
    start = world.energy().total
    world.run(seconds=1, dt=DT)
    # Of order (omega h)^2 / 24 with omega h up to 2 x 0.3 x 2.6 / 2.6: it oscillates by a per cent or so, and does not drift.
    assert world.energy().total == pytest.approx(start, rel=0.02)


def test_its_particles_meet_all_but_each_other() -> None:
    world = pv.World(gravity=(0, 0), contacts=True)
    water, _ = fill(world, np.array([(0.0, 0.0), (0.05, 0.0)]), 0.1, 0.3)
    disc = world.add(position=(0.3, 0.0), radius=0.2)
    assert (water.category == FLUID).all()
    disc.mass = 1.0
    water.velocity[:, 0] = 1.0
    met: set[tuple[int, int]] = set()
    for _ in each_frame(world, 12):
        met |= set(zip(world.contacts["a"].tolist(), world.contacts["b"].tolist(), strict=True))
    assert disc.velocity[0, 0] > 0
    assert met <= {(0, 2), (1, 2)}
    own = world.add(position=[(9, 9), (9, 8)], mass=1.0, category=4, mask=2)
    pv.Fluid(own, rest_density=1.0, stiffness=1.0)
    assert own.category.tolist() == [4, 4]  # who has others keeps them


def test_a_light_fluid_stays_on_a_heavy_one() -> None:
    # Fluids meet as discs do: the floor carries both, but for what hangs between the discs at the walls.
    s, world = 0.1, pv.World(boundary=smooth_box(2.0, 6.0), gravity=(0, -G))
    layers, h = [], DT / world.substeps
    for rho, rows, low in ((1000.0, 15, 0.0), (500.0, 10, 1.5)):
        where = lattice(20, rows, s) + np.array((0, low))
        layer = world.add(position=where, radius=s / 2, mass=rho * s * s, friction=0.0, restitution=0.0)
        law = pv.Fluid(layer, rest_density=rho, stiffness=0.6 * (s / h) ** 2, viscosity=0.06 * s * s / h)
        layers.append((layer, world.forces.append(law)))
    world.run(seconds=3, dt=DT)
    (heavy, below), (light, _) = layers
    assert [set(group.category.tolist()) for group in (heavy, light)] == [{FLUID}, {FLUID // 2}]
    assert heavy.position[:, 1].mean() == pytest.approx(0.75, rel=0.02)
    assert light.position[:, 1].mean() == pytest.approx(2.0, rel=0.1)
    deep = heavy.position[:, 1] < s
    assert below.pressure[deep].mean() == pytest.approx((1000.0 * 1.5 + 500.0 * 1.0) * G, rel=0.06)


def test_pinned_ones_are_no_fluid_and_lone_ones_feel_nothing() -> None:
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=None)
    water, fluid = fill(world, np.array([(0.0, 0.0), (0.05, 0.0), (9.0, 9.0), (9.0, -9.0)]), 0.1, 0.3)
    water.mass[1] = np.inf
    world.step(DT)
    assert not water.velocity.any()
    assert np.isnan(fluid.pressure).tolist() == [False, True, False, False]
    world.remove(water)
    world.step(DT)
    assert len(fluid.pressure) == 0


@pytest.mark.parametrize(("how", "more"), [({"stiffness": 1e5}, 6), ({"stiffness": 100.0, "viscosity": 1.0}, 3)])
def test_a_frame_too_long_for_it_is_stepped_as_several(how: dict[str, float], more: int) -> None:
    # c h <= 1.2 s and viscosity h <= 0.07 s^2, with particles s = 0.1 m apart and 8 substeps: 5.5 and 2.98 frames.
    bits = []
    for substeps in (8, 8 * more):
        world = pv.World(boundary=pv.Box((0, 0), (1, 2)), collisions=None, substeps=substeps)
        water = world.add(position=lattice(3, 3, 0.1) + 0.5, radius=0.05, mass=10.0)
        world.forces.append(pv.Fluid(water, rest_density=RHO, **how))
        world.run(seconds=0.2, dt=DT)
        bits.append(world.state_hash())
    assert bits[0] == bits[1]


@pytest.mark.parametrize("dt", [1 / 240, 1 / 30, 0.1])
def test_a_dam_breaks_alike_at_any_frame_rate(dt: float) -> None:
    # The front of the water after 0.3 s, beside that at the usual rate: a spacing is 0.2 m, and shocks spread over some.
    fronts = []
    for step in (DT, dt):
        world = pv.scenes.get("dam-break").world(particles=400)
        world.run(seconds=0.3, dt=step)
        fronts.append(float(world.position[:, 0].max()))
    assert fronts[1] == pytest.approx(fronts[0], abs=0.3)


def test_what_cannot_be_is_refused() -> None:
    world = pv.World(boundary=pv.Open(), collisions=None)
    water = world.add(position=lattice(3, 3, 0.1), radius=0.05, mass=10.0)
    world.forces.append(pv.Fluid(water, rest_density=RHO, stiffness=1e15))
    refused(r"dt is 0\.016.*, which takes .* substeps here; allowed are 100,000", world.step, DT)
    refused("rest_density is 0", pv.Fluid, water, rest_density=0, stiffness=1.0)
    narrow = pv.World(boundary=pv.Periodic((0, 0), (0.4, 4)), gravity=(0, 0), collisions=None)
    fill(narrow, lattice(4, 4, 0.1), 0.1, 0.3)
    refused("half its period", narrow.step, DT)
