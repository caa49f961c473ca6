"""Sleep: what rests costs little, wakes when touched, and finds again what its contacts remember; nobody meets one as a wall."""

import copy
import pickle
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G

import pyverlet as pv

RADIUS = 0.5


def troughs(**options: Any) -> pv.World:
    """Two V-shaped troughs, in which circles without friction come to rest."""
    world = pv.World(boundary=pv.Box((0, 0), (60, 60)), **{"sleep": True, **options})
    for x in (10, 45):
        world.obstacles.append(pv.Chain([(x - 8, 8), (x, 0.5), (x + 8, 8)]))
    return world


def fill(world: pv.World, *x: float) -> list[pv.Group]:
    """Six circles into the troughs there."""
    return [
        world.add(position=[(at + 1.02 * k - 1.02 * row, 3 + 1.1 * row + k) for row in range(3) for k in range(2)], radius=RADIUS)
        for at in x
    ]


@pytest.fixture(scope="module")
def sleepers() -> tuple[pv.World, pv.Group, Any]:
    """Two islands of six asleep, the first group, and the state to go back to; a pinned circle high above."""
    world = troughs()
    a, _ = fill(world, 10, 45)
    world.add(position=(30, 50), mass=np.inf)
    world.run(seconds=15)
    assert world.asleep[:12].all()
    return world, a, world.save()


Change = Callable[[pv.World, pv.Group], object]

OWN = {
    "velocity": (0, 3), "spin": 5, "restitution": 0.5, "friction": 0.5, "mass": 2.0, "category": 2, "mask": 2, "radius": 0.4,
    "position": (10, 9),
}  # fmt: skip
WORLDWIDE: dict[str, Change] = {
    "gravity": lambda world, a: setattr(world, "gravity", (1, -9)),
    "wall": lambda world, a: setattr(world.boundary, "friction", 0.3),
    "boundary": lambda world, a: setattr(world, "boundary", pv.Circle(center=(30, 30), radius=50)),
    "size": lambda world, a: setattr(world, "boundary", pv.Box((0, 0), (60, 60.0000001))),
    "force": lambda world, a: world.forces.append(pv.Wind(velocity=(5, 0), linear=1.0)),
    "collisions": lambda world, a: setattr(world, "collisions", pv.Collisions(friction=0.5)),
    "link": lambda world, a: world.links.append(pv.Stick(a, 0, 1)),
    "pinned": lambda world, a: world.position[12].__isub__((0, 0.1)),
    "add obstacle": lambda world, a: world.obstacles.append(pv.Disc((30, 30), 1)),
    "remove obstacle": lambda world, a: world.obstacles.pop(1),
    "move obstacle": lambda world, a: setattr(world.obstacles[1], "pivot", (45, 4)),
}


@pytest.mark.parametrize("removes", [False, True])
@pytest.mark.parametrize("change", [*OWN, *WORLDWIDE])
def test_what_the_user_does_wakes(sleepers: tuple[pv.World, pv.Group, Any], change: str, removes: bool) -> None:
    # With and without a removal before the same frame: columns of the sleepers must survive it.
    world, a, saved = sleepers
    world.gravity, world.boundary, world.collisions = (0, -G), pv.Box((0, 0), (60, 60)), pv.Collisions()
    world.forces.clear()
    world.restore(saved)
    extra = world.add(position=(55, 55))
    world.step(1 / 60)
    assert world.asleep[:12].all()
    if removes:
        extra.remove()
    if change in OWN:
        getattr(a, change)[5] = OWN[change]
    else:
        WORLDWIDE[change](world, a)
    world.step(1 / 60)
    assert not world.asleep[:6].any()
    assert world.asleep[6:12].all() == (change in OWN)


GOES: dict[str, tuple[int, Callable[[pv.World], object]]] = {
    "removed": (1, lambda world: world.remove(0)), "moved": (1, lambda world: world.groups[0].move_to((9, 9))),
    "let go": (0, lambda world: world.mass.__setitem__(0, 1.0)),
    "category of the upper one": (3, lambda world: world.category.__setitem__(3, 0)),
    "mask of the upper one": (3, lambda world: world.mask.__setitem__(3, 0)),
    "collisions": (3, lambda world: setattr(world, "collisions", None)),
    "a rule": (3, lambda world: world.actors.append(pv.contact_rule(lambda world, new: True))),
    "category of the obstacle": (4, lambda world: setattr(world.obstacles[0], "category", 2)),
    "a sensor": (4, lambda world: setattr(world.obstacles[0], "sensor", True)),
    "its own filter": (4, lambda world: (world.mask.__setitem__(4, 2), world.category.__setitem__(4, 2))),
    "mask of the room": (5, lambda world: setattr(world.boundary, "mask", 2)),
}  # fmt: skip


@pytest.mark.parametrize("change", GOES)
@pytest.mark.parametrize("sleep", [False, True])
def test_what_lies_on_something_falls_when_that_goes(change: str, sleep: bool) -> None:
    """By g t^2 / 2 from the middle of a substep on: on a pinned circle, on another, on an obstacle, on the floor."""
    who, changed = GOES[change]
    world = pv.World(boundary=pv.Box((-20, 0), (20, 20)), dtype=np.float64, threads=1, sleep=sleep)
    world.obstacles.append(pv.Segment((4, 6), (8, 6), category=1))
    for at in ((-9, 6), (-9, 7), (0, 0.5), (0, 1.5), (6, 6.5), (12, 0.5)):
        world.add(position=at, radius=RADIUS, mask=1)
    world.mass[0] = np.inf
    world.run(seconds=4)
    assert not sleep or world.asleep[1:].all()
    before, below = world.position[who, 1], world.position[2, 1]
    changed(world)
    world.run(seconds=0.25)
    assert who != 3 or world.position[2, 1] == pytest.approx(below, abs=1e-3)  # what it lay on stays on the floor
    who -= len(world) < 6
    assert not sleep or not world.asleep[who]
    assert world.position[who, 1] == pytest.approx(before - G / 32, abs=1.01 * 0.5 * G * 0.25 / 480 + 1e-9)


AWAKE: dict[str, Change] = {
    "link": lambda world, a: world.links.append(pv.Stick(a, 0, 1)),
    "motor": lambda world, a: world.links.append(pv.Motor(a, 0, speed=0.0, max_torque=3.0)),
    "moving obstacle": lambda world, a: world.obstacles.append(pv.Segment((0, 30), (10, 30), velocity=(0, 0.1))),
    "drum": lambda world, a: setattr(
        world, "boundary", pv.Circle(center=(30, 30), radius=50, friction=0.5, angular_velocity=1e-3)
    ),
    "heat bath": lambda world, a: world.forces.append(pv.Langevin(temperature=0.0, friction=50.0)),
    "fluid": lambda world, a: world.forces.append(pv.Fluid(a, rest_density=1.0, stiffness=1.0)),
}


@pytest.mark.parametrize("kind", AWAKE)
def test_linked_circles_and_worlds_that_move_do_not_sleep(kind: str) -> None:
    world = troughs()
    (group,) = fill(world, 10)
    AWAKE[kind](world, group)
    world.run(seconds=15)
    assert not world.asleep.any()


# ---- What contacts remember is there again when sleepers wake ----


PRECISIONS = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def heap(dtype: Any, friction: float, count: int = 400, **more: Any) -> pv.World:
    """Discs of 0.2 to 0.3 m thrown into a box."""
    chance = np.random.default_rng(0)
    world = pv.World(
        boundary=pv.Box((0, 0), (12, 400), friction=friction), collisions=pv.Collisions(friction=friction),
        dtype=dtype, sleep=True, **more,
    )  # fmt: skip
    k = np.arange(count)
    x, y = 0.4 + 0.58 * (k % 20) + chance.uniform(-0.02, 0.02, count), 0.4 + 0.65 * (k // 20)
    world.add(position=np.column_stack((x, y)), radius=chance.uniform(0.2, 0.3, count))
    return world


def fall_asleep(world: pv.World, *frames: float, within: float = 30.0) -> None:
    """Step by frames of these lengths, drawn by chance, until all sleep."""
    chance, end = np.random.default_rng(1), world.time + within
    while not world.asleep.all():
        assert world.time < end
        world.step(float(chance.choice(frames)))


def moved(world: pv.World, before: Any) -> Any:
    """How far each has moved, in radii."""
    return np.hypot(*(world.position[: len(before)] - before).T) / world.radius[: len(before)]


@PRECISIONS
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_a_heap_falls_asleep_at_any_step_and_wakes_without_a_jump(dtype: Any, friction: float) -> None:
    world = heap(dtype, friction)
    fall_asleep(world, 1 / 240, 1 / 60)
    # A disc that falls by s = 2 mm meets the highest one at sqrt(2 g s) = 0.2 m/s, and pushes it by at most 3.3 mm in a frame.
    highest = int(np.argmax(world.position[:, 1]))
    world.add(position=world.position[highest] + (0.0, world.radius[highest] + 0.25 + 0.002), radius=0.25)
    before = world.position[:400].copy()
    while world.asleep[0]:
        assert (world.position[:400] == before).all()
        world.step(FRAME)
    hit = np.hypot(*(before - world.position[400]).T) < world.radius[:400] + 0.25 + 0.004
    assert 1 <= hit.sum() <= 2
    assert world.asleep.sum() <= 2  # in voids, where they touch no one but the floor or a wall
    # It has stopped at speeds below 0.02 sqrt(g r) = 0.03 m/s, 2e-3 radii a frame, and goes on so, half as much again by the
    # blow: with nothing remembered, layers fall by g t^2 / 2.
    assert moved(world, before)[~hit].max() < 3e-3
    world.boundary = pv.Box((0, 0), (12, 400), friction=friction, restitution=0.5)
    for dt in (1 / 240, 1 / 60, 1 / 60):
        before = world.position[:400].copy()
        world.step(dt)
        assert moved(world, before)[~hit].max() < 6e-3  # three times that: the blow is passed on (2 to 5e-3 in four such heaps)


@PRECISIONS
def test_a_heap_that_is_woken_at_once_stays_at_rest(dtype: Any) -> None:
    world = heap(dtype, 0.4)
    fall_asleep(world, FRAME)
    before = world.position.copy()
    world.boundary = pv.Box((0, 0), (12, 400), friction=0.4, restitution=0.5)  # all wake
    for dt in (1 / 240, 1 / 60, 1 / 60, 1 / 240):
        world.step(dt)
        assert not world.asleep.any()
    # 0.05 s. Those who forgot their contacts would be g t^2 / 2 = 12 mm lower, 4e-2 to 6e-2 radii.
    assert moved(world, before).max() < 5e-4


@pytest.mark.parametrize("frames", [(1 / 60, 1 / 240), (1 / 240, 1 / 60)])
def test_a_heap_wakes_on_the_springs_it_lay_on(frames: tuple[float, float]) -> None:
    # Contacts are as stiff as the substep allows. A disc in flight has them adapt to other frames while the heap sleeps.
    world = heap(np.float64, 0.4, 200)
    fall_asleep(world, frames[0], within=60)
    world.add(position=(6, 100), velocity=(0, 60), radius=0.3)
    world.run(seconds=6, dt=frames[1])
    assert world.asleep.sum() == 200
    before = world.position[:200].copy()
    world.boundary = pv.Box((0, 0), (12, 400), friction=0.5)
    world.run(seconds=5 * frames[1], dt=frames[1])
    assert not world.asleep.any()
    assert moved(world, before).max() < 2e-3


@PRECISIONS
@pytest.mark.parametrize("gap", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("speed", [1.0, 20.0])
def test_a_blow_goes_along_a_row_of_sleepers(dtype: Any, gap: float, speed: float) -> None:
    # Equal discs with e = 1 hand their velocity on: the last one goes off with it, whoever was asleep.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1.0), sleep=True, dtype=dtype)
    world.add(position=[(k * (1 + gap), 0) for k in range(6)], radius=0.5)
    world.run(seconds=1.0)
    assert world.asleep.all()
    world.add(position=(-3.0, 0), velocity=(speed, 0), radius=0.5)
    world.run(seconds=6 / speed)
    tolerance = speed * (1e-5 if dtype is np.float32 else 1e-12)
    assert world.velocity[:, 0] == pytest.approx([0, 0, 0, 0, 0, speed, 0], abs=tolerance)


def test_nobody_wakes_whom_a_fast_circle_passes() -> None:
    # 10 m/s are 2 cm in a substep; it passes at 1 cm.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(), sleep=True)
    world.add(position=[(0, 0), (3, 0)], radius=0.5)
    world.run(seconds=1.0)
    assert world.asleep.all()
    world.add(position=(-4, 1.01), velocity=(10, 0), radius=0.5)
    world.run(seconds=1.0)
    assert world.asleep.tolist() == [True, True, False]
    assert world.velocity[2].tolist() == [10, 0]


def on_obstacles(
    dtype: Any = np.float64, *, friction: float = 0.3, integrator: pv.Integrator | None = None, drag: float = 0.0, **more: Any
) -> pv.World:
    """Discs in a trough of chains, on two capsules that meet in a valley, and in stacks against a wall."""
    law = pv.Collisions(friction=friction, restitution=0.2)
    room = pv.Box((0, 0), (40, 40), friction=friction)
    world = pv.World(boundary=room, collisions=law, sleep=True, dtype=dtype, integrator=integrator, **more)
    world.forces += [pv.Drag(linear=drag)] if drag else []
    world.obstacles.append(pv.Chain([(4, 8), (9, 1.0), (14, 8)], friction=friction))
    world.obstacles.append(pv.Capsule((20, 7), (27, 3), radius=0.4, friction=friction))
    world.obstacles.append(pv.Capsule((27, 3), (34, 7), radius=0.4, friction=friction))
    chance = np.random.default_rng(3)
    rows = [(6.5 + 0.62 * i + 0.3 * (j % 2), 8 + 0.62 * j) for i in range(8) for j in range(8)]
    world.add(position=rows, radius=chance.uniform(0.2, 0.3, 64))
    world.add(position=[(26.1 + 0.62 * i + 0.3 * (j % 2), 6 + 0.62 * j) for i in range(3) for j in range(4)], radius=0.25)
    world.add(position=[(39.25 + 0.5 * i, 0.25 + 0.5 * j) for i in range(2) for j in range(6)], radius=0.25)
    return world


ON_OBSTACLES: dict[str, dict[str, Any]] = {
    "rough": {}, "float32": {"dtype": np.float32}, "smooth": {"friction": 0.0},
    "VelocityVerlet": {"integrator": pv.VelocityVerlet()}, "RK4": {"integrator": pv.RK4()},
    "PositionVerlet": {"integrator": pv.PositionVerlet()},
    "noted": {"events": True, "contacts": True, "ledger": True}, "drag": {"drag": 0.1},
}  # fmt: skip


@pytest.mark.parametrize("name", ON_OBSTACLES)
def test_discs_on_obstacles_and_at_walls_fall_asleep_and_wake_without_a_jump(name: str) -> None:
    world = on_obstacles(**ON_OBSTACLES[name])
    # When the step changes PositionVerlet keeps x - x_prev, whatever the velocity was: then nothing comes to rest.
    fall_asleep(world, *((1 / 60,) if name == "PositionVerlet" else (1 / 240, 1 / 60)), within=60)
    before, energy = world.position.copy(), world.energy().total
    world.run(seconds=1.0)
    assert (world.position == before).all()
    assert world.energy().total == energy
    assert not world.keeps_ledger or world.ledger.total == pytest.approx(energy, rel=1e-9)
    world.boundary = pv.Box((0, 0), (40, 40), friction=0.31)
    world.step(FRAME)
    assert not world.asleep.any()
    assert moved(world, before).max() < 1e-3


@pytest.mark.parametrize("name", ["float32", *(pytest.param(name, marks=pytest.mark.slow) for name in ("smooth", "noted"))])
def test_threads_saves_and_copies_keep_the_bits(name: str) -> None:
    # Islands fall asleep one by one, some wake again; saved after each frame, and now and then taken up by another world.
    found = []
    for kept in (False, True):
        world, asleep = on_obstacles(threads=2 if kept else 1, **ON_OBSTACLES[name]), []
        for frame in range(500):
            if frame == 400:
                world.add(position=[(9.3, 14), (39.2, 8)], velocity=[(0, -15), (0, -2)], radius=0.3)
            world.step(FRAME)
            asleep.append(int(world.asleep.sum()))
            if kept and frame % 100 == 43:
                world = pickle.loads(pickle.dumps(world))
            elif kept and frame % 100 == 93:
                world = copy.deepcopy(world)
            elif kept and (frame % 20 == 0 or len(set(asleep[-2:])) > 1):
                saved = world.save()
                world.step(1 / 50)
                world.restore(saved)
        found.append((world.state_hash(), asleep))
        assert len(set(asleep)) > 3
    assert found[0] == found[1]


def test_contacts_go_on_until_sleepers_wake() -> None:
    # A ball meets the heap in any substep of a frame: contacts are heard only in what is left of it.
    law = pv.Collisions(friction=0.3)
    room = pv.Box((4.5, 0), (8.5, 20), friction=0.3)
    world = pv.World(boundary=room, collisions=law, sleep=True, events=True, dtype=np.float64)
    world.add(position=[(5 + k, 0.5) for k in range(4)] + [(5.5 + k, 0.5 + 0.75**0.5) for k in range(3)], radius=0.5)
    fall_asleep(world, FRAME)
    saved = world.save()
    for higher in np.linspace(0, 0.16, 9):
        world.restore(saved)
        ball = world.add(position=(6.5, 3.0 + higher), radius=0.5)
        while world.asleep[5]:
            world.step(FRAME)
            assert len(world.events.end) == 0
            assert len(world.events.begin) == 0 or not world.asleep[5]
        assert (5, 7) in zip(world.events.begin["a"].tolist(), world.events.begin["b"].tolist(), strict=True)
        ball.remove()


def test_who_is_left_over_when_others_go_wakes_with_its_contacts() -> None:
    # Three stacks; one of the second goes, and its island wakes: what is below stays where it is, what was above falls.
    world = pv.World(boundary=pv.Box((0, 0), (20, 20)), collisions=pv.Collisions(), sleep=True, dtype=np.float64)
    stacks = [world.add(position=[(5 * k + 3, 0.5 + j) for j in range(5)], radius=0.5) for k in range(3)]
    fall_asleep(world, FRAME)
    stacks[0].remove()
    stacks[1].remove([3])
    before = stacks[1].position.copy()
    world.run(seconds=6 / 60)
    assert world.asleep.tolist() == [False] * 4 + [True] * 5
    # It rests to rounding: depths are 1e-5 of a radius, and three carry one less than before.
    assert stacks[1].position[:3] == pytest.approx(before[:3], abs=1e-4)
    assert stacks[1].position[3, 1] == pytest.approx(before[3, 1] - 0.5 * 9.81 * 0.1**2, abs=2e-3)
    before = stacks[2].position.copy()
    world.gravity = (0, -9.8)
    world.step(FRAME)
    assert not world.asleep.any()
    assert stacks[2].position == pytest.approx(before, abs=1e-6)


def test_all_asleep_costs_next_to_nothing() -> None:
    # 0.18 of a frame of smooth circles at rest, in which all that users may have written is compared. The best of many, in turns.
    worlds, took = [], [np.inf, np.inf]
    for sleep in (True, False):
        worlds.append(world := pv.World(gravity=(0, 0), collisions=pv.Collisions(), sleep=sleep, threads=1))
        x, y = np.mgrid[0:100, 0:100]
        world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.5)
        world.run(seconds=0.55)
        assert world.asleep.all() == sleep
    for _ in range(40):
        for k, world in enumerate(worlds):
            start = time.perf_counter()
            world.step(FRAME)
            took[k] = min(took[k], time.perf_counter() - start)
    assert took[0] < 0.35 * took[1]
