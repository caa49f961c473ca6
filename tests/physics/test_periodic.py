"""A periodic room is the same everywhere: what happens across its periodic boundary is what happens in its middle."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, refused

import pyverlet as pv
from pyverlet.lab.physics import gas as checks

LOWER, PERIOD = np.array([-4.0, 1.0]), np.array([12.0, 9.0])
MIDDLE = LOWER + PERIOD / 2
CORNERS = [(0.0, 0.0), (6.0, 0.0), (0.0, 4.5), (6.0, 4.5), (-6.0, 4.5)]
"""Moves that bring what is in the middle there, over one seam, over the other, and over both."""


def _room(axes: str = "xy", **walls: Any) -> pv.Periodic:
    return pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=axes, **walls)


def _world(**options: Any) -> pv.World:
    return pv.World(**{"gravity": (0, 0), "boundary": _room(), "dtype": np.float64, **options})


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance of the nearest images, m."""
    way = a - b
    return float(np.abs(way - PERIOD * np.rint(way / PERIOD)).max())


@pytest.mark.slow
def test_a_stream_keeps_its_digits() -> None:
    """At 300 m/s around a room of 12 m for 600 rounds: everyone stays inside, the stream as fast, contacts as they are."""
    world = _world(dtype=np.float32, collisions=pv.Collisions(restitution=1.0))
    rng = np.random.default_rng(3)
    velocity = rng.normal(0, 0.5, (40, 2))
    place = LOWER + (np.column_stack(np.divmod(np.arange(40), 5)) + 0.5) * PERIOD / (8, 5)
    world.add(position=place, velocity=velocity - velocity.mean(axis=0) + (300.0, 0.0), radius=0.4)
    world.run(seconds=24.0)
    assert world.escaped() == 0
    assert ((world.position >= LOWER) & (world.position <= LOWER + PERIOD)).all()
    # In float32 a velocity of 300 m/s has a last digit of 3e-5; 40 circles met some hundred times.
    assert world.momentum() / 40 == pytest.approx((300.0, 0.0), abs=2e-3)
    assert world.overlap().max < 0.02


# Energy, momentum and pressure of a gas at one density are among the promises, which `test_check.py` runs.


@pytest.mark.parametrize(
    ("count", "seconds", "fraction"), [(100, 16.0, 0.05), *((900, 10.0, each) for each in (0.1, 0.2, 0.3, 0.4, 0.5))]
)
@pytest.mark.slow
def test_pressure_of_hard_discs_at_all_densities(count: int, seconds: float, fraction: float) -> None:
    """Also by Z = 1 / (1 - 2 f + (2 f_c - 1) (f / f_c)^2), f_c = pi sqrt(3) / 6 (Santos, Lopez de Haro and Yuste 1995)."""
    found, close = checks.pressure(count, seconds, fraction), np.pi * np.sqrt(3) / 6
    assert found.passed, found.measured
    theory = 1 / (1 - 2 * fraction + (2 * close - 1) * (fraction / close) ** 2)
    # At f = 0.5 it is 2.0 % less than Henderson's; what is measured lies between, and from run to run within 0.3 %.
    assert found.values["measured"] == pytest.approx(theory, rel=0.025)


def test_pressure_does_not_depend_on_the_stream() -> None:
    """Galileo: u does not count. And the pressure of those that meet nobody is the sum of m |v - u|^2 over twice the area."""
    world = _world(contacts=True)
    world.add(position=[(0, 3), (3, 7)], velocity=[(101, 2), (99, 0)], radius=0.1, mass=2.0)
    world.step(1 / 60)
    assert world.pressure() == pytest.approx(2 * 2.0 * (1 + 1) / (2 * 12 * 9))


def test_pressure_of_a_pile_without_weight() -> None:
    """Two circles pressed together across the periodic boundary by a constant force f at distance d: the virial is f d."""
    world = _world(contacts=True)
    # Touching once they have come nearer by 0.1 m at most.
    one, other = (world.add(position=(x, 5), radius=0.5, mass=1.0) for x in (7.6, -3.4))
    world.forces += [pv.ConstantForce((5.0, 0.0), group=one), pv.ConstantForce((-5.0, 0.0), group=other)]
    world.run(seconds=2.0)
    mean = np.mean([world.pressure() for _ in each_frame(world, 60)])
    reach = float(np.abs(_way(other.position[0] - one.position[0])[0]))
    assert mean * 2 * 12 * 9 == pytest.approx(5.0 * reach, rel=0.01)


def _way(way: np.ndarray) -> np.ndarray:
    return np.asarray(way - PERIOD * np.rint(way / PERIOD))


def test_a_pile_lies_across_the_boundary() -> None:
    """A row that fills the period rests, and who lies on two of it across the boundary rests too: h = sqrt(3) r above."""
    world = _world(gravity=(0, -10), boundary=_room("x", friction=0.5), collisions=pv.Collisions(friction=0.5))
    row = world.add(position=np.column_stack((np.arange(12) - 3.5, np.full(12, 1.5))), radius=0.5)
    top = world.add(position=(8.0, 1.5 + np.sqrt(3) / 2), radius=0.5)
    world.run(seconds=3.0)
    assert np.abs(row.velocity).max() < 1e-2
    assert np.abs(top.velocity).max() < 1e-2
    assert top.position[0, 1] == pytest.approx(1.5 + np.sqrt(3) / 2, abs=0.02)
    assert abs(_way(top.position[0] - (8.0, 0.0))[0]) < 0.02


def test_walls_have_a_pressure() -> None:
    """Weight over length: m g / (2 L) of the two walls together, for those at rest on one."""
    world = _world(gravity=(0, -10), boundary=_room("x"), contacts=True)
    world.add(position=[(0, 1.5), (7.9, 1.5)], radius=0.5, mass=3.0)
    world.run(seconds=1.0)
    assert world.pressure() == pytest.approx(2 * 3.0 * 10 / (2 * 12), rel=1e-3)
    assert set(world.contacts["wall"]) == {2}  # the floor has the number of a Box's


@pytest.mark.parametrize("ends", [None, 0.5])
def test_the_ledger_closes(ends: float | None) -> None:
    """Down a slope without an end, with impacts, friction and drag: the accounts sum to the energy, `seam` is m g L a passage."""
    world = _world(gravity=(4, -9), boundary=_room("x", restitution=0.5, friction=0.1), ledger=True)
    rng = np.random.default_rng(4)
    grains = world.add(position=rng.uniform((-3.5, 2), (7.5, 9), (40, 2)), radius=0.3, restitution=ends, friction=0.3)
    world.forces.append(pv.Drag(linear=0.3))
    start = world.energy().total
    rounds, before = np.zeros(40), grains.position[:, 0].copy()
    for _ in each_frame(world, 180):
        rounds -= np.rint((grains.position[:, 0] - before) / 12.0)
        before = grains.position[:, 0].copy()
    ledger = world.ledger
    assert rounds.sum() > 20
    assert ledger.seam == pytest.approx(4 * 12.0 * rounds.sum(), rel=1e-9)
    assert ledger.total == pytest.approx(world.energy().total, rel=1e-9)
    assert ledger.outside == pytest.approx(start, rel=1e-9)
    assert abs(ledger.residual) < 0.05 * abs(ledger.drag)


def test_a_chain_around_the_room() -> None:
    """Closed across the boundary nothing can stretch it: 12 springs of 0.9 m over 12 m pull with k (1 - 0.9) N for ever."""
    world = _world()
    chain = world.add(position=np.column_stack((np.arange(12) - 3.5, np.full(12, 5.0))), radius=0.2, velocity=(3.0, 0))
    spring = world.links.append(pv.Spring(chain, np.arange(12), (np.arange(12) + 1) % 12, length=0.9, stiffness=20.0))
    world.run(seconds=5.0)
    assert spring.force == pytest.approx(20.0 * 0.1, abs=1e-6)
    assert chain.velocity == pytest.approx(np.tile((3.0, 0.0), (12, 1)), abs=1e-9)
    ends = world.links.segments()[0]
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T) == pytest.approx(1.0, abs=1e-9)


def test_events_and_touches_across_the_boundary() -> None:
    """Two that hit each other at x = 8, where the room ends: the point is there, the normal from one to the other."""
    world = _world(collisions=pv.Collisions(restitution=1.0), events=True, contacts=True)
    world.add(position=[(7.0, 5.0), (-3.0, 5.0)], velocity=[(3.0, 0), (-3.0, 0)], radius=0.5, mass=2.0)
    hits: list[Any] = []
    records: list[Any] = []
    for _ in each_frame(world, 30):
        hits.extend(world.events.hit.copy())
        records.extend(world.contacts.copy())
    (hit,) = hits
    assert (hit["a"], hit["b"]) == (0, 1)
    assert hit["speed"] == pytest.approx(6.0)
    assert hit["normal"] == pytest.approx((1, 0))
    assert min(abs(hit["point"][0] - 8.0), abs(hit["point"][0] + 4.0)) < 0.1
    assert hit["point"][1] == pytest.approx(5.0)
    (touch,) = records
    assert touch["impulse"] == pytest.approx(2 * 2.0 * 3.0)
    assert touch["normal"] == pytest.approx((1, 0))
    assert LOWER[0] <= touch["point"][0] < LOWER[0] + PERIOD[0]


def test_sleepers_wake_across_the_boundary() -> None:
    world = _world(gravity=(0, -10), boundary=_room("x"), sleep=True)
    sleeper = world.add(position=[(7.8, 1.5), (3.0, 1.5)], radius=0.5)
    world.run(seconds=2.0)
    assert world.asleep.all()
    world.add(position=(-1.0, 1.5), velocity=(-3.0, 0), radius=0.5)
    world.run(seconds=1.0)
    assert world.asleep.tolist() == [False, True, False]
    assert abs(_way(sleeper.position[0] - (7.8, 1.5))[0]) > 0.1


def test_a_room_that_is_too_small_for_what_is_there() -> None:
    """Nothing changes then."""
    world = pv.World(boundary=pv.Open(), gravity=(0, 0))
    two = world.add(position=[(0, 3), (1, 3)], radius=0.1)
    world.links.append(pv.Rope(two, 0, 1, length=5.0))
    refused("at most half a period", setattr, world, "boundary", _room())
    assert isinstance(world.boundary, pv.Open)
    world.step(1 / 60)


def test_a_room_that_changes() -> None:
    """What was near across the periodic boundary is not any more, and the other way round."""
    world = _world(collisions=pv.Collisions(restitution=1.0))
    two = world.add(position=[(7.0, 5.0), (-3.0, 5.0)], velocity=[(1.0, 0), (-1.0, 0)], radius=0.5)
    world.run(seconds=0.2)
    world.boundary = pv.Box(tuple(LOWER), tuple(LOWER + PERIOD), restitution=1.0)
    world.run(seconds=0.5)
    assert two.velocity[:, 0] == pytest.approx((-1.0, 1.0))  # off the walls
    world.boundary = _room()
    two.velocity[:, 0] = 1.0, -1.0
    world.run(seconds=1.0)
    assert two.velocity[:, 0] == pytest.approx((-1.0, 1.0))  # off each other


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_slides_along_an_obstacle_across_the_seam_stays_on_it(dtype: Any) -> None:
    # In the substep in which its centre crosses the seam it still touches the image that it was on, not that of the other side.
    world = pv.World(gravity=(9.81, 0), boundary=pv.Periodic((0, 0), (10, 10), axes="y"), dtype=dtype, collisions=None)
    world.obstacles.append(pv.Segment((6, 8), (6, 12)))
    discs = world.add(position=[(5.8, 0.52), (5.8, 9.48)], velocity=[(0, -1.5), (0, 1.5)], radius=0.2)
    world.run(seconds=1.0, dt=1 / 60)
    assert discs.position[:, 0] == pytest.approx(5.8, abs=1e-6)
    assert discs.position[:, 1] == pytest.approx([9.02, 0.98], abs=480 * 1e-6)  # so many roundings of 10 m


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_too_far_away_to_have_an_image_is_put_inside(dtype: Any) -> None:
    # Beyond 2^53 periods the nearest number is periods away: the grids of cells end before such an image.
    room = pv.Periodic((0, 0), (6, 6))
    far = np.array([[1e17, -3e25], [7e30, 3.0], [-1e37, 1e20]], dtype)
    inside = room.periodic.wrapped(far)
    assert ((inside >= 0) & (inside < 6)).all()
    assert inside[1, 1] == 3


AROUND = 2 * np.pi * np.arange(10) / 10
OUT = np.column_stack((np.cos(AROUND), np.sin(AROUND)))
TWO: dict[str, Any] = {"position": [(-1.0, 0.2), (1.0, -0.1)], "velocity": [(1, 2), (-2, -1)], "radius": 0.2, "mass": [1, 2]}
# It swings from wide to high, with its area: what it moves by is far above rounding, and nothing is taken back from it.
RING: dict[str, Any] = {"position": 1.5 * OUT, "velocity": (1.0, 0.5) + OUT * (0.5, -0.5), "radius": 0.2}
BEAM: dict[str, Any] = {"position": [(-1, 0), (0, 0.3), (1, 0)], "velocity": [(0, 1), (0, -2), (0, 1)], "radius": 0.2}
MEET: dict[str, Any] = {
    "position": [(-0.9, 0.1), (0.6, -0.1)], "velocity": [(3.0, 0.2), (-2.0, 0.0)], "radius": [0.5, 0.7], "mass": [1.0, 2.5],
    "spin": [4.0, -1.0],
}  # fmt: skip
ATTRACTED: dict[str, Any] = {"position": [(-1.0, 0.3), (1.0, 0)], "velocity": [(0, 1), (0, -1)], "radius": 0.1}
BALL: dict[str, Any] = {"position": (-1.2, 0), "velocity": (3.0, 0.0), "radius": 0.3}
LAWS: list[dict[str, Any]] = [{"restitution": 1.0}, {"restitution": 0.5, "friction": 0.4}, {}]


def meet(law: Any) -> tuple[dict[str, Any], dict[str, Any], Any]:
    return MEET, {"collisions": law}, lambda world, two, there: None


def disc(speed: float) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """A disc that moves, or not, and hangs over the periodic boundary."""
    made: dict[str, Any] = {"velocity": (-speed, 0.0), "restitution": 1.0}
    return BALL, {"collisions": None}, lambda world, ball, there: world.obstacles.append(pv.Disc(there(0.5, 0.2), 0.6, **made))


def join(circles: dict[str, Any], *links: Any) -> tuple[dict[str, Any], dict[str, Any], Any]:
    return circles, {}, lambda world, group, there: [world.links.append(link(group, there)) for link in links]


def attract(world: pv.World, two: pv.Group, there: Any) -> None:
    world.forces.append(pv.Gravitation(strength=3.0))
    world.forces.append(pv.Attractor(center=there(0.5, 1.0), strength=2.0, softening=0.1))
    world.forces.append(pv.PointSpring(center=there(-0.5, -1.0), stiffness=1.0))


ACROSS: dict[str, tuple[dict[str, Any], dict[str, Any], Any]] = {
    **{f"{law} {method}": meet(pv.Collisions(method=method, **law)) for law in LAWS for method in (pv.Fast(), pv.BruteForce())},
    "stick": join(TWO, lambda g, _: pv.Stick(g, 0, 1)),
    "spring": join(TWO, lambda g, _: pv.Spring(g, 0, 1, stiffness=50.0, damping=0.1)),
    "rope": join(TWO, lambda g, _: pv.Rope(g, 0, 1, length=2.1)),
    "area": join(RING, lambda g, _: pv.Spring(g, range(10), [*range(1, 10), 0], stiffness=400.0), lambda g, _: pv.Area(g)),
    "angle": join(
        BEAM, lambda g, _: pv.Stick(g, [0, 1], [1, 2]), lambda g, _: pv.Angle(g, 0, 1, 2, angle=np.pi, compliance=0.01)
    ),
    "limit": join(
        BEAM, lambda g, _: pv.Stick(g, [0, 1], [1, 2]), lambda g, _: pv.AngleLimit(g, 0, 1, 2, least=2.6, most=np.pi + 0.4)
    ),
    "motor": join(TWO, lambda g, _: pv.Stick(g, 0, 1), lambda g, _: pv.Motor(g, 0, 1, speed=9.0, max_torque=0.5)),
    "pin": join(
        {"position": (0.4, 0.3), "velocity": (2, 1), "radius": 0.2},
        lambda g, there: pv.Pin(g, 0, point=there(0, 0), compliance=0.02),
    ),
    "disc": disc(0.0), "moving disc": disc(2.0), "forces": (ATTRACTED, {"collisions": None}, attract),
}  # fmt: skip


@pytest.mark.parametrize("kind", ACROSS)
def test_across_the_seam_all_is_as_in_the_middle_of_the_room(kind: str) -> None:
    """For half a second of a meeting, or a second: the same velocities, spins and energies, and places as far apart, to rounding
    of coordinates of 13 m. A pull is a way over h^2, and 1e-9 m of rounding are 2e-4 N at h = 1/480 s.
    """
    circles, options, add = ACROSS[kind]
    found = []
    for move in CORNERS:
        world = _world(**options)
        group = world.add(**circles | {"position": MIDDLE + np.array(circles["position"]) + move})
        add(world, group, lambda x, y, move=move: tuple(MIDDLE + np.array((x, y)) + move))
        energy = world.energy().total
        world.run(seconds=0.5 if circles is MEET else 1.0)
        assert ((group.position >= LOWER) & (group.position < LOWER + PERIOD)).all()
        assert not world.forces or world.energy().total == pytest.approx(energy, abs=2e-2)
        pivots = np.array([each.pivot for each in world.obstacles]).reshape(-1, 2)
        assert not world.is_free(pivots).any()
        state = np.concatenate((group.velocity.ravel(), group.spin, [world.energy().total, world.energy().links]))
        places = np.concatenate((group.position, pivots)) - move
        found.append((state, places, np.concatenate([[0.0], *(link.force for link in world.links)])))
    (state, places, force), *others = found
    assert abs(state[0] - 3.0) > 0.5  # they did meet, or turn
    within = 1e-12 if circles is MEET else 1e-9
    for other in others:
        assert other[0] == pytest.approx(state, abs=within)
        assert _apart(other[1], places) < within
        assert other[2] == pytest.approx(force, abs=1e-3)


def test_an_obstacle_keeps_what_it_was_given_when_another_comes() -> None:
    world = pv.World(boundary=pv.Periodic((-5, -5), (5, 5)), dtype=np.float64)
    floor = world.obstacles.append(pv.Segment((-4, 0), (4, 0)))
    ball = world.add(position=(0, 0.5), velocity=(1, 0), radius=0.3)
    world.step(1 / 60)
    floor.friction = 0.5
    world.step(1 / 60)
    world.obstacles.append(pv.Disc((3, 3), 0.1))
    world.run(seconds=0.5)
    assert ball.spin[0] < -1.0
