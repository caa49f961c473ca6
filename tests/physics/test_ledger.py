"""The ledger: its accounts add up to the energy, and each says what the equations say."""

from time import perf_counter
from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G, points

import pyverlet as pv
from pyverlet import scenes


def vectors(found: Any) -> Any:
    """(k, 2) N s, what a has given the other, of `World.contacts`."""
    n = found["normal"]
    return found["impulse"][:, None] * n - found["rub"][:, None] * np.column_stack((-n[:, 1], n[:, 0]))


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


DROP: tuple[Any, Any] = ({"boundary": pv.Box((-5, 0), (5, 10), restitution=0.5)}, {"position": (0, 2.5), "mass": 2.0})
THROWN = {"position": points(np.arange(1, 10), np.arange(1, 10)), "velocity": np.random.default_rng(2).normal(0, 3, (81, 2))}
TAKEN = 16 * (1 - np.exp(-1.0))
BOOKS: dict[str, tuple[Any, Any, list[Any], float, dict[str, float], float, float]] = {
    # A drop from height H loses (1 - e^2) m g H in its first bounce, and m g H in all until it rests, within 1e-3 of the drop.
    "bounce": (*DROP, [], 0.7, {"restitution": -(1 - 0.25) * 2 * G * 2}, 1e-12 * 2 * G * 2, 1e-12 * 2 * G * 2),
    "bounces": (*DROP, [], 6.0, {"restitution": -2 * G * 2}, 1e-3 * 2 * G * 2, 1e-12 * 2 * G * 2),
    # Equal masses, relative speed u: (1 - e^2) m u^2 / 4. The centres are 0.3 m apart in y and 1 m when they touch.
    "impact": (
        {"gravity": (0, 0), "collisions": pv.Collisions(restitution=0.8)},
        {"position": [(-1, 0), (1, 0.3)], "velocity": [(1, 0), (-1, 0)], "mass": 3.0}, [], 2.0,
        {"restitution": -(1 - 0.64) * 3 * 4 * (1 - 0.3**2) / 4}, 1e-9, 1e-12,
    ),
    # v' = -c v / m takes m v0^2 / 2 (1 - exp(-2 c t / m)); the trapezoidal rule is of second order: (c h / m)^2 / 3 off.
    "drag": (
        {"gravity": (0, 0), "integrator": pv.RK4()}, {"position": (0, 0), "velocity": (4, 0), "mass": 2.0}, [pv.Drag(linear=1.0)],
        1.0, {"drag": -TAKEN}, 2 * (1 / 480 / 2) ** 2 * TAKEN, 2 * (1 / 480 / 2) ** 2 * TAKEN,
    ),
    # Where drag takes all that is fallen, m g v with v = m g / c, but for the m v^2 / 2 = 2e-5 J of the start.
    "honey": ({}, {"position": (0, 0), "mass": 2}, [pv.Drag(linear=4800)], 2.0, {"drag": -((2 * G) ** 2) / 2400}, 8e-4, 8e-4),
    # F x = F^2 t^2 / 2 m, exactly, for the velocity is linear in time.
    "pull": (
        {"gravity": (0, 0), "integrator": pv.VelocityVerlet()}, {"position": (0, 0)},
        [pv.force(lambda x, y, vx, vy, mass, t: (3.0, 0.0))], 2.0, {"forces": 18.0}, 1.8e-11, 1e-11,
    ),
    # Explicit Euler gains m g^2 h^2 / 2 in every step of free fall; velocity Verlet nothing.
    **{
        f"fall by {each!r}": ({"integrator": each}, {"position": (0, 0)}, [], 1.0, {"residual": 480 * gain}, 1e-11, 1e-12)
        for each, gain in ((pv.ExplicitEuler(), (G / 480) ** 2 / 2), (pv.VelocityVerlet(), 0.0), (pv.PositionVerlet(), 0.0))
    },
    # From v0 to 2/3 v0: a third of m v0^2 / 2 goes into friction and nothing else happens, but that 4,800 substeps round.
    **{
        f"slide by {each!r}": (
            {"boundary": pv.Box((-50, 0), (50, 10), friction=0.5), "integrator": each},
            {"position": (-40, 0.5), "velocity": (10, 0)}, [], 10.0, {"friction": -100 / 2 / 3}, 1e-11, 3.3e-11,
        )
        for each in (pv.PositionVerlet(), pv.TimeCorrectedVerlet(), pv.VelocityVerlet())
    },
    # e = 1 and no friction: energy is kept to rounding, and none of the accounts has anything.
    "elastic gas": (
        {
            "gravity": (0, 0), "boundary": pv.Box((0, 0), (10, 10), restitution=1.0),
            "collisions": pv.Collisions(restitution=1.0),
        },
        {**THROWN, "radius": 0.2}, [], 2.0, {}, 1e-10, 1e-10,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BOOKS)
def test_accounts_have_what_is_on_paper_and_nothing_else(case: str) -> None:
    options, circles, forces, seconds, expected, within, nothing = BOOKS[case]
    world = undamped(**options)
    world.add(**circles)
    world.forces += forces
    start = world.energy().total
    world.run(seconds=seconds)
    for name, joules in world.ledger.as_dict().items():
        paper = expected | {"outside": start}
        assert joules == pytest.approx(paper.get(name, 0.0), rel=0, abs=within if name in paper else nothing), name
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12, abs=1e-12)


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
    ledger = world.ledger
    assert ledger.limiter < 0 < ledger.projection
    # Sums of what 10^5 contacts gave and took, 1e2 J in all, each rounded by eps.
    assert abs(ledger.total) == pytest.approx(world.energy().total, abs=1e-11)
    assert world.energy().kinetic < 1e-12
    world.run(seconds=30)
    assert world.overlap().max < 1e-6


# ---- Contacts, forces and pressure under the contact law: read from the impulses, not found afterwards ----


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
    assert set(floor["a"]) == set(range(count))
    assert floor["normal"] == pytest.approx(np.tile((0, -1), (count, 1)))
    assert floor["point"] == pytest.approx(discs.position - (0, 0.5), abs=1e-3)
    assert floor["impulse"] == pytest.approx(np.full(count, 2 * G * float(dt)), rel=5 * within)
    assert discs.pressure() == pytest.approx(2 * count * G / 26, rel=within)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_what_contacts_give_is_what_momenta_change_by(friction: float) -> None:
    # m dv = m g dt + the sum of what a disc's contacts gave: to rounding at rest, where the velocity shown is that of the end. By
    # contacts a half of what the last substep gave is still to come, and of what the one before the frame gave: those of motion.
    chance = np.random.default_rng(2)
    heap = world(boundary=pv.Box((0, 0), (6, 20), friction=friction), friction=friction, dtype=np.float64)
    heap.add(position=np.stack(np.meshgrid(np.arange(5) + 0.6, np.arange(6) + 0.6), -1).reshape(-1, 2), radius=0.45, mass=2.0)
    heap.position[:] += chance.normal(0, 0.02, heap.position.shape)
    heap.run(seconds=5)
    before = np.hypot(*heap.velocity.T).max()
    heap.step(FRAME)
    contacts = heap.contacts
    given, pairs, got = vectors(contacts), contacts["b"] >= 0, np.zeros((30, 2))
    np.subtract.at(got, contacts["a"], given)
    np.add.at(got, contacts["b"][pairs], given[pairs])
    moving = 2.0 * max(before, np.hypot(*heap.velocity.T).max())
    assert got == pytest.approx(np.tile((0, 2 * G * FRAME), (30, 1)), abs=1e-9 + 2 * moving)
    assert (contacts["impulse"] > 0).all()
    assert (np.abs(contacts["rub"]) <= friction * contacts["impulse"] * (1 + 1e-9) + 1e-9 + 2 * moving).all()


def test_a_heap_loses_its_energy_to_impacts_and_friction_and_then_nothing() -> None:
    law, places = pv.Collisions(restitution=0.3, friction=0.5), points(np.arange(-4, 4.1, 0.8), np.arange(1, 10, 0.8))
    world = undamped(collisions=law, boundary=pv.Box((-5, 0), (5, 20)), threads=1)
    world.add(position=places + np.random.default_rng(1).uniform(-0.1, 0.1, places.shape), radius=0.3)
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


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("law", [{}, {"restitution": 0.5, "friction": 0.3}])
def test_it_is_the_physics_of_cells(room: Any, law: dict[str, Any]) -> None:
    # The order of pairs is another, so what contacts give differs by what one sweep leaves: per substep less than the velocity
    # that gravity adds, g h, at each of a few contacts. Over 20 frames, in which a fall makes 0.5 m, that stays below 1 cm. With
    # restitution small differences grow by each bounce; until two circles meet a third at once paths are the same to rounding.
    fast, brute = (
        pv.World(boundary=room, dtype=np.float64, collisions=pv.Collisions(method=method, **law)) for method in METHODS
    )
    rng = np.random.default_rng(3)
    speed, radius = rng.normal(0, 1, (40, 2)), rng.uniform(0.3, 0.6, 40)
    for world in (fast, brute):  # 40 circles of several sizes, apart from each other
        world.add(position=points(1.5 + 1.3 * np.arange(8), 2 + 1.3 * np.arange(5)), velocity=speed, radius=radius)
    for frame in range(20):
        for world in (fast, brute):
            world.step(1 / 60)
        if frame < 3:
            assert np.abs(fast.position - brute.position).max() < 1e-12
    assert np.abs(fast.position - brute.position).max() < 0.01
