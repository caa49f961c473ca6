"""Particles that are put elsewhere go on there: no impulse, no way between, no memory of contacts; positions as if unwrapped."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G, refused

import pyverlet as pv


def run(world: pv.World, frames: int) -> None:
    world.run(seconds=frames / 60)


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_free_flight_goes_on_from_there(name: str, dtype: Any) -> None:
    """A twin that is not moved flies the same way, to rounding of coordinates that are larger by the move."""
    worlds = [pv.World(integrator=pv.integrators.BY_NAME[name](), dtype=dtype) for _ in range(2)]
    groups = [w.add(position=[(0, 0), (3, 1)], velocity=[(2, 5), (-1, 0)], spin=3.0) for w in worlds]
    for world in worlds:
        run(world, 20)
    velocity = groups[0].velocity.copy()
    shift = np.array([16.0, -8.0])
    groups[0].move_to(groups[0].position + shift)
    assert groups[0].velocity.tolist() == velocity.tolist()
    for world in worlds:
        run(world, 40)
    rounding = float(40 * 8 * np.finfo(dtype).eps * 40)
    # Methods that begin anew, without accelerations of before, begin as after World.add.
    assert groups[0].position == pytest.approx(groups[1].position + shift, abs=rounding)
    assert groups[0].velocity == pytest.approx(groups[1].velocity, abs=rounding * 10)
    assert groups[0].angle == pytest.approx(groups[1].angle, abs=rounding)


@pytest.mark.parametrize("integrator", [pv.PositionVerlet, pv.TimeCorrectedVerlet, pv.VelocityVerlet, pv.RK4])
@pytest.mark.parametrize("axes", [None, "xy", "x"])
def test_a_linked_body_keeps_its_shape_and_its_pulls(axes: str | None, integrator: Any) -> None:
    """A wheel of sticks turns freely: moved across the periodic boundary it turns on as its twin that is not moved."""
    room = pv.Open() if axes is None else pv.Periodic((-10, -10), (10, 10), axes=axes)
    options: dict[str, Any] = {"boundary": room, "dtype": np.float64, "collisions": None}
    worlds = [pv.World(gravity=(0, 0), integrator=integrator(), **options) for _ in range(2)]
    groups = []
    angle = 2 * np.pi * np.arange(6) / 6
    rim = np.column_stack((np.cos(angle), np.sin(angle)))
    for world in worlds:
        wheel = world.add(
            position=np.vstack(((0, 0), rim)), velocity=np.vstack(((0, 0), 3 * rim @ [[0, 1], [-1, 0]])), radius=0.1
        )
        world.links.append(pv.Stick(wheel, [0] * 6 + list(range(1, 7)), [*range(1, 7), *range(2, 7), 1]))
        groups.append(wheel)
        run(world, 30)
    first, twin = groups
    pulls = worlds[0].links[0].force
    assert pulls.min() > 1.0
    goal = np.array([9.8, -9.6]) if axes == "xy" else np.array([9.8, 3.0])  # across the periodic boundary
    for _ in range(2):  # the second time it lies across the periodic boundary before
        first.move_to(goal)
        center = first.unwrapped.mean(axis=0)
        assert center == pytest.approx(goal, abs=1e-12)
        assert first.unwrapped - center == pytest.approx(twin.position - twin.position.mean(axis=0), abs=1e-12)
        for world in worlds:
            world.step(FRAME)
        assert worlds[0].links[0].force == pytest.approx(worlds[1].links[0].force, rel=1e-9)
        goal = -goal
    for world in worlds:
        run(world, 60)
    center, center_of_twin = first.unwrapped.mean(axis=0), twin.unwrapped.mean(axis=0)
    assert first.unwrapped - center == pytest.approx(twin.unwrapped - center_of_twin, abs=1e-9)
    assert center - center_of_twin == pytest.approx(-goal, abs=1e-9)


def test_nothing_is_met_on_the_way() -> None:
    """Over walls, a thin line and a crowd: no contact begins, nobody is pushed, and what rests elsewhere rests."""
    world = pv.World(boundary=pv.Box((0, 0), (20, 10)), events=True, contacts=True)
    world.obstacles.append(pv.Segment((10, 0), (10, 10)))
    crowd = world.add(position=[(x, 0.5) for x in range(8, 10)] + [(x, 0.5) for x in range(11, 14)])
    ball = world.add(position=(2, 0.5), velocity=(0, 0))
    run(world, 60)
    before = crowd.position.copy()
    ball.move_to((18, 0.5))
    world.step(FRAME)
    assert ball.position[0] == pytest.approx([18, 0.5], abs=1e-3)
    assert world.events.begin[world.events.begin["b"] >= 0].tolist() == []
    assert set(world.contacts["a"][world.contacts["b"] >= 0]) == set()
    run(world, 60)
    assert crowd.position == pytest.approx(before, abs=1e-3)
    assert np.abs(ball.velocity).max() < 1e-2
    ball.velocity = (-40, 0)  # and it has the other side of the line from now on
    run(world, 60)
    assert ball.position[0, 0] > 13.0


def test_contacts_forget_those_that_are_moved_and_no_others() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 20)), collisions=pv.Collisions(friction=0.4))
    world.add(position=[(2, 0.5 + k) for k in range(5)] + [(6, 0.5 + k) for k in range(5)])
    run(world, 60)
    remembered = world._frames.save().pairs.tolist()
    assert remembered == [[k, k + 1] for k in range(9) if k != 4]
    top = world.groups[0][4]
    top.move_to((8, 15))
    kept = world._frames.save()
    assert kept.pairs.tolist() == [pair for pair in remembered if 4 not in pair]
    assert kept.given[4].tolist() == [0, 0, 0]
    world.step(FRAME)
    # It falls from rest, and the columns stand as they stood.
    assert top.velocity == pytest.approx([0, -G * FRAME], rel=1e-3)
    assert np.abs(np.delete(world.velocity, 4, axis=0)).max() < 0.02


def test_sleepers_wake_that_are_moved_or_that_lay_on_them() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (30, 20)), sleep=True)
    world.add(position=[(2, 0.5), (2, 1.5), (8, 0.5), (8, 1.5), (14, 0.5)])
    run(world, 120)
    assert world.asleep.all()
    world.groups[0][0].move_to((20, 0.5))
    world.step(FRAME)
    assert world.asleep.tolist() == [False, False, True, True, True]
    run(world, 120)
    assert world.asleep.all()
    assert world.position[1] == pytest.approx([2, 0.5], abs=0.01)
    world.groups[0].move_to(world.groups[0].position)  # nowhere: nobody is woken
    world.step(FRAME)
    assert world.asleep.all()
    world.groups[0][3].move_to((14, 3))  # onto a sleeper
    run(world, 120)
    assert world.position[3] == pytest.approx([14, 1.5], abs=0.01)
    world.groups[0].move_to((10, 10))  # all at once
    world.step(FRAME)
    assert not world.asleep.any()


@pytest.mark.parametrize("resting", [True, False])
def test_a_ledger_has_the_lift_under_outside(resting: bool) -> None:
    """m g h, while what contacts had given is accounted for as if it had gone: 1e-9 of the energies, in float64."""
    world = pv.World(boundary=pv.Box((0, 0), (10, 30)), ledger=True, dtype=np.float64)
    balls = world.add(
        position=[(2, 0.5), (2, 1.5), (5, 0.5)] if resting else [(2, 20), (5, 22)], mass=[2.0, 3.0, 4.0][: 3 if resting else 2]
    )
    run(world, 60 if resting else 20)
    before, outside = world.energy(), world.ledger.outside
    height = balls.position[1, 1]
    balls[1].move_to((8, height + 2.5))
    assert world.energy().potential - before.potential == pytest.approx(3 * G * 2.5, rel=1e-12)
    world.step(FRAME)
    assert world.ledger.outside - outside == pytest.approx(3 * G * 2.5, rel=1e-9)
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12)


def test_a_sink_is_not_crossed_by_a_move() -> None:
    class Portal(pv.Actor):
        def act(self, world: pv.World, dt: float) -> None:
            for ball in world.groups[0]:
                if ball.position[0] > 8:
                    ball.move_to((1.0, ball.position[1]))

    world = pv.World(gravity=(0, 0))
    balls = world.add(position=[(7, 0), (6, 4)], velocity=[(20, 0), (-20, 0)])
    sink = pv.Sink(pv.Box((3, -1), (5, 5)))
    world.actors += [sink, Portal()]
    run(world, 5)
    assert (len(balls), sink.removed) == (1, 1)  # the second by its own motion
    assert balls.position[0] == pytest.approx([1.0 + 20 * FRAME, 0], abs=1e-5)
    run(world, 15)
    assert sink.removed == 2


def test_pinned_and_picked_ones_and_single_particles() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Box((-9, -9), (9, 9)))
    balls = world.add(position=[(0, 0), (2, 0), (4, 0)])
    balls[[2, 0]].move_to([(5, 5), (-5, 5)])
    balls[1].move_to((7, 7))
    assert world.position.tolist() == [[-5, 5], [7, 7], [5, 5]]
    balls.pin()
    balls.move_to((20, 20))  # pinned ones may be anywhere
    assert world.position.mean(axis=0) == pytest.approx([20, 20])
    world.add(position=np.zeros((0, 2))).move_to((1, 1))


def test_places_in_any_memory_order_and_never_in_the_middle_of_a_frame() -> None:
    world = pv.World(boundary=pv.Periodic((0, 0), (12, 9)), dtype=np.float64)
    balls = world.add(position=[(1, 2), (3, 4), (5, 6)])
    balls.move_to(np.asfortranarray([(2.0, 3.0), (14.0, 5.0), (6.0, -2.0)]))
    assert world.position.tolist() == [[2, 3], [2, 5], [6, 7]]
    assert world.unwrapped.tolist() == [[2, 3], [14, 5], [6, -2]]

    world.observer = lambda _: balls.move_to((1, 1))
    refused("move_to is called in the middle of a frame of this world", world.step, FRAME)


# ---- Positions in a periodic room as if it did not repeat: what crosses the seam goes on, and nothing else changes ----


LOWER, PERIOD = np.array([-4.0, 1.0]), np.array([12.0, 9.0])
AXES = {"xy": (1, 1), "x": (1, 0), "y": (0, 1)}


def room(axes: str = "xy") -> pv.Periodic:
    return pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=axes, restitution=1.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("integrator", [pv.TimeCorrectedVerlet, pv.RK4])
def test_a_free_particle_flies_straight_on(dtype: Any, axes: str, integrator: Any) -> None:
    """x0 + v t, also where a frame is longer than several periods."""
    along = np.array(AXES[axes])
    velocity = (
        np.array([(3.0, 0.0), (-700.0, 0.0), (1500.0, 0.0)]) * along + np.array([(0, -2.0), (0, 40.0), (0, 1900.0)]) * along
    )
    world = pv.World(gravity=(0, 0), boundary=room(axes), collisions=None, dtype=dtype, integrator=integrator())
    start = LOWER + PERIOD * np.array([(0.1, 0.3), (0.5, 0.5), (0.9, 0.7)])
    balls = world.add(position=start, velocity=velocity, radius=0.1)
    assert world.unwrapped == pytest.approx(start, abs=1e-6)
    frames = 200
    world.run(seconds=frames / 60)
    # Each substep rounds a coordinate of at most a period and the way of a frame, by half a unit in the last place.
    rounding = frames * 8 * np.finfo(dtype).eps * (20 + np.abs(velocity) * FRAME)
    assert (np.abs(balls.unwrapped - (start + velocity * world.time)) <= rounding).all()
    inside = (world.position >= LOWER) & (world.position < LOWER + PERIOD)
    assert inside[:, along == 1].all()
    # What is between the two is whole periods.
    periods = (world.unwrapped - world.position) / PERIOD
    assert periods == pytest.approx(np.rint(periods), abs=1e-9)
    assert (periods[:, along == 0] == 0).all()


def test_what_is_added_or_written_outside_is_there() -> None:
    world = pv.World(gravity=(0, 0), boundary=room(), dtype=np.float64)
    far = LOWER + PERIOD * (3.25, -1.5)
    balls = world.add(position=[far, LOWER + 1], radius=0.2)
    assert balls.unwrapped == pytest.approx(np.array([far, LOWER + 1]))
    assert balls.position[0] == pytest.approx(LOWER + PERIOD * (0.25, 0.5))
    balls.position[1] += 2 * PERIOD
    world.step(FRAME)
    assert balls.unwrapped[1] == pytest.approx(LOWER + 1 + 2 * PERIOD)
    assert balls[1].unwrapped == pytest.approx(LOWER + 1 + 2 * PERIOD)
    world.boundary = pv.Periodic(tuple(LOWER), tuple(LOWER + 2 * PERIOD))  # of another room: the way so far counts
    world.step(FRAME)
    assert balls.unwrapped[1] == pytest.approx(LOWER + 1 + 2 * PERIOD)


def test_elsewhere_it_is_the_position_and_is_only_read() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (9, 9)))
    ball = world.add(position=[(2, 3), (4, 3)])
    world.run(seconds=1)
    assert world.unwrapped.tolist() == world.position.astype(float).tolist()
    for thing in (world, ball, ball[0]):
        refused("unwrapped is only to be read; allowed is to write position", setattr, thing, "unwrapped", 0)
    with pytest.raises(ValueError, match="read-only"):
        ball.unwrapped[0] = 1


def test_threads_and_slots_in_another_order_count_alike() -> None:
    """More than a thousand discs are sorted by their places: the periods go with them."""
    worlds = []
    for threads in (1, 2):
        world = pv.World(
            gravity=(0, 0), boundary=room(), collisions=pv.Collisions(restitution=1.0), threads=threads, dtype=np.float64
        )
        rng = np.random.default_rng(0)
        x, y = np.meshgrid(np.arange(0.1, 12, 0.25), np.arange(0.1, 9, 0.25))
        start = LOWER + np.column_stack((x.ravel(), y.ravel()))
        world.add(position=start, velocity=rng.normal(0, 30, (x.size, 2)), radius=0.05)
        summed = world.unwrapped.copy()
        for _ in range(20):
            before = world.position.copy()
            world.step(FRAME)
            summed += world.boundary.periodic.nearest(world.position - before)
        assert world.unwrapped == pytest.approx(summed, abs=1e-10)
        worlds.append(world)
    assert worlds[0].unwrapped.tolist() == worlds[1].unwrapped.tolist()


@pytest.mark.parametrize("integrator", [pv.VelocityVerlet, pv.TimeCorrectedVerlet, pv.RK4, pv.SemiImplicitEuler])
@pytest.mark.parametrize("substeps", [8, 1])
@pytest.mark.parametrize("how", ["pin", "mass"])
def test_what_is_pinned_at_rest_stays_there(how: str, substeps: int, integrator: type[pv.Integrator]) -> None:
    # It sank for ever with g h / 2: what contacts had given in the last substep was taken back, and not given again. One of
    # infinite mass goes on with the speed that it has: in float32 that of a circle at rest is some 1e-5 m/s.
    world = pv.World(boundary=pv.Box((0, 0), (9, 9)), substeps=substeps, integrator=integrator())
    group = world.add(position=[(2, 0.5), (2, 1.5), (5, 0.5)])
    world.run(seconds=2)
    where = group.position.copy()
    if how == "pin":
        group.pin([0, 1])
    else:
        world.mass[:2] = np.inf
    world.run(seconds=3)
    assert group.position[:2] == pytest.approx(where[:2], abs=0 if how == "pin" else 3e-4)
    assert group.velocity[:2] == pytest.approx(np.zeros((2, 2)), abs=0 if how == "pin" else 1e-4)
