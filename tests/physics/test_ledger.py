"""The ledger: its accounts add up to the energy, and each says what the equations say."""

from time import perf_counter
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import scenes

G = 9.81


def undamped(**options: object) -> pv.World:
    return pv.World(ledger=True, dtype=np.float64, **options)  # type: ignore[arg-type]


def scenes_in_both() -> list[Any]:
    """Names and dtypes."""
    return [
        pytest.param(name, dtype, id=f"{name}-{dtype.__name__}", marks=marks)
        for name in scenes.SCENES
        for dtype, marks in ((np.float32, ()), (np.float64, pytest.mark.slow))
    ]


@pytest.mark.parametrize("most", [100, pytest.param(300, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "dtype"), scenes_in_both())
def test_the_accounts_add_up_to_the_energy_in_every_scene(name: str, dtype: type[np.float32], most: int) -> None:
    settings: dict[str, Any] = {"particles": min(scenes.get(name).defaults.particles, most), "dtype": dtype, "ledger": True}
    for panel in scenes.get(name).panels(**settings):
        world = panel.world
        scale = world.energy().kinetic + float(world.mass.sum() * G * np.ptp(world.position[:, 1]) + world.mass.sum() * G)
        for _ in range(60 if most > 100 else 30):
            panel.step(1 / 60)
        # Each of the frames x substeps entries rounds at 1e-16 of the energy. In float32 the energy of stiff springs is told from
        # their forces, up to what coordinates can hide: the car has springs of 6e4 N/m.
        coarse = 1e-8 if name == "car" and dtype == np.float32 else 1e-11
        assert world.ledger.total == pytest.approx(world.energy().total, abs=coarse * scale)


def test_inelastic_impacts_are_booked_as_restitution() -> None:
    # A drop from height H, until it rests, loses m g H in all; after the first bounce (1 - e^2) m g H.
    world = undamped(boundary=pv.Box((-5, 0), (5, 10), restitution=0.5))
    ball = world.add(position=(0, 2.5), mass=2.0)
    while ball.velocity[0, 1] <= 0:
        world.step(1 / 60)
    assert world.ledger.restitution == pytest.approx(-(1 - 0.25) * 2 * G * 2, rel=1e-12)
    assert world.ledger.friction == world.ledger.drag == world.ledger.forces == 0
    assert abs(world.ledger.projection) + abs(world.ledger.residual) < 1e-12 * 2 * G * 2
    world.run(seconds=5)
    assert world.ledger.restitution == pytest.approx(-2 * G * 2, rel=1e-3)  # it ends within 1e-3 of the drop


def test_impacts_between_circles_are_booked_as_restitution() -> None:
    # Equal masses, relative speed u: (1 - e^2) m u^2 / 4.
    world = undamped(gravity=(0, 0), collisions=pv.Collisions(restitution=0.8))
    world.add(position=[(-1, 0), (1, 0.3)], velocity=[(1, 0), (-1, 0)], mass=3.0)
    world.run(seconds=2)
    normal = np.sqrt(1 - 0.3**2)  # the centres are 0.3 m apart in y and 1 m when they touch
    assert world.ledger.restitution == pytest.approx(-(1 - 0.64) * 3 * (2 * normal) ** 2 / 4, rel=1e-9)
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-14)


def test_the_work_of_drag_and_of_other_forces_is_booked() -> None:
    # v' = -c v / m takes m v0^2 / 2 (1 - exp(-2 c t / m)); the trapezoidal rule is of second order: (c h / m)^2 / 3 off.
    world = undamped(gravity=(0, 0), integrator=pv.RK4())
    world.add(position=(0, 0), velocity=(4, 0), mass=2.0)
    world.forces.append(pv.forces.Drag(linear=1.0))
    world.run(seconds=1)
    taken = 16 * (1 - np.exp(-1.0))
    h = 1 / 480
    assert world.ledger.drag == pytest.approx(-taken, rel=2 * (h * 1.0 / 2) ** 2)
    assert abs(world.ledger.residual) < 2 * (h / 2) ** 2 * taken

    class Pull:
        velocity_dependent = False

        def apply(self, state: object, t: float) -> None:
            state.force[:, 0] += 3.0  # type: ignore[attr-defined]

    world = undamped(gravity=(0, 0), integrator=pv.VelocityVerlet())
    world.add(position=(0, 0))
    world.forces.append(Pull())
    world.run(seconds=2)
    # F x, exactly, for the velocity is linear in time.
    assert world.ledger.forces == pytest.approx(3.0 * world.position[0, 0], rel=1e-12)
    assert abs(world.ledger.residual) < 1e-11


def test_the_error_of_the_integrator_is_the_residual() -> None:
    # Explicit Euler gains m g^2 h^2 / 2 in every step of free fall; velocity Verlet nothing.
    for integrator, gain in ((pv.ExplicitEuler(), 0.5 * (G / 480) ** 2), (pv.VelocityVerlet(), 0.0), (pv.PositionVerlet(), 0.0)):
        world = undamped(integrator=integrator)
        world.add(position=(0, 0))
        world.run(seconds=1)
        assert world.ledger.residual == pytest.approx(480 * gain, abs=1e-11)
        assert world.ledger.outside == 0


def test_what_is_done_between_frames_is_booked_as_outside() -> None:
    world = undamped()
    ball = world.add(position=(0, 3), velocity=(2, 0))
    world.step(1 / 60)
    assert world.ledger.outside == pytest.approx(3 * G + 2, rel=1e-14)
    before = world.energy().total
    ball.velocity[0] = (0, 5)
    added = world.energy().total - before
    world.step(1 / 60)
    assert world.ledger.outside == pytest.approx(3 * G + 2 + added, rel=1e-14)


def test_it_is_refused_where_it_is_off() -> None:
    with pytest.raises(pv.InputError, match=r"allowed is a world built with World\(ledger=True\)"):
        pv.World().ledger  # noqa: B018


@pytest.mark.parametrize("integrator", [pv.PositionVerlet(), pv.TimeCorrectedVerlet(), pv.VelocityVerlet()])
def test_a_disc_that_slides_into_rolling_leaves_no_residual(integrator: pv.Integrator) -> None:
    # From v0 to 2/3 v0: a third of m v0^2 / 2 goes into friction and nothing else happens, but that 4,800 substeps round.
    world = undamped(boundary=pv.Box((-50, 0), (50, 10), friction=0.5), integrator=integrator)
    world.add(position=(-40, 0.5), velocity=(10, 0))
    world.run(seconds=10)
    books = world.ledger
    assert books.friction == pytest.approx(-100 / 2 / 3, abs=1e-11)
    assert abs(books.residual) + abs(books.restitution) + abs(books.projection) < 1e-10


def test_a_ledger_of_few_links_costs_little() -> None:
    # A frame with a ledger takes 1.4 times as long as one without on a quiet machine; it was 14 times.
    def frame_s(ledger: bool) -> float:
        world = worlds[ledger]
        start = perf_counter()
        world.step(1 / 60)
        return perf_counter() - start

    worlds = [scenes.get("newton-cradle").world(ledger=ledger) for ledger in (False, True)]
    for world in worlds:
        world.run(seconds=0.1)
    without, with_it = (min(frame_s(ledger) for _ in range(40)) for ledger in (False, True))
    assert with_it < 2.5 * without
    assert len(worlds[0].links)
    assert worlds[0].state_hash() == worlds[1].state_hash()


def test_what_the_limiter_takes_has_an_account() -> None:
    # Circles on top of each other at rest in no field have no energy: what parting them gains is put in and taken back.
    world = undamped(gravity=(0, 0))
    world.add(position=np.random.default_rng(0).uniform(-1, 1, (40, 2)), radius=0.5)
    world.run(seconds=1)
    books = world.ledger
    assert books.limiter < 0 < books.projection
    # Sums of what 10^5 contacts gave and took, 1e2 J in all, each rounded by eps.
    assert abs(books.total) == pytest.approx(world.energy().total, abs=1e-11)
    assert world.energy().kinetic < 1e-12
    world.run(seconds=30)
    assert world.overlap().max < 1e-6
