"""Contacts, forces on obstacles and walls, pressure."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import G, bits_after, each_frame, of_ones_own, points, refused

import pyverlet as pv


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_an_impact_gives_what_it_turns(e: float) -> None:
    # J = (1 + e) v m for a wall, (1 + e) v m1 m2 / (m1 + m2) for two circles.
    world = pv.World(
        gravity=(0, 0), boundary=pv.Box((-9, -9), (9, 9), restitution=e), collisions=pv.Collisions(restitution=e), contacts=True,
        dtype=np.float64,
    )  # fmt: skip
    world.add(position=[(8.4, 5), (0, 0), (1.1, 0)], velocity=[(5, 0), (4, 0), (0, 0)], mass=[3.0, 1.0, 3.0])
    seen = []
    for _ in each_frame(world, 6):
        seen += world.contacts[["a", "b", "wall", "impulse"]].tolist()
    assert [row[:3] for row in seen if row[3] > 0.1] == [(0, -1, 1), (1, 2, -1)]
    assert [row[3] for row in seen if row[3] > 0.1] == pytest.approx([(1 + e) * 5 * 3, (1 + e) * 4 * 0.75], rel=1e-6)


@pytest.mark.parametrize("substeps", [1, 8])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("own", [False, True])
def test_the_impulse_of_a_hit_is_what_the_two_got(own: bool, e: float, substeps: int) -> None:
    # At 7 m/s onto a pinned one, the floor, and one that lies on it, whom the floor throws back within the frame: m dv.
    room, laws = pv.Box((0, 0), (9, 9), restitution=e), pv.Collisions(restitution=e)
    settings: dict[str, Any] = {"gravity": (0, 0), "dtype": np.float64, "substeps": substeps, "collisions": laws}
    world = pv.World(boundary=of_ones_own(room) if own else room, events=True, **settings)
    world.add(position=[(2, 4), (4, 3.5), (6, 4)], velocity=[(0, -7)] * 3, mass=[3.0, 3.0, 2.0])
    world.add(position=[(2, 0.5), (6, 0.5)], mass=[np.inf, 1.0])
    got = np.zeros(3)
    for _ in range(30):
        world.step(1 / 60)
        begun = world.events.begin[world.events.begin["a"] < 3]
        np.add.at(got, begun["a"], begun["impulse"])
        off = got / (world.mass[:3] * (world.velocity[:3, 1] + 7) + 1e-300) - 1
        # At the end of a frame velocities have half of what contacts give that still hold a blow.
        assert (np.abs(off) < [1e-6, 1e-6, 0.05])[begun["a"]].all()
    assert (got > 4.6).all()


def test_impulses_of_hits_move_a_gas() -> None:
    # In a row, with frames in which each is hit several times: the changes of all momenta, to rounding.
    rng = np.random.default_rng(5)
    laws, room = pv.Collisions(restitution=1.0), pv.Box((0, -1), (30, 1), restitution=1.0)
    world = pv.World(gravity=(0, 0), boundary=room, collisions=laws, events=True, dtype=np.float64)
    world.add(position=[(1 + 1.4 * k, 0) for k in range(20)], mass=rng.uniform(0.3, 3, 20), radius=0.5)
    world.velocity[:, 0] = rng.normal(0, 6, 20)
    for _ in range(60):
        before = world.velocity[:, 0] * world.mass
        world.step(1 / 20)
        begun = world.events.begin
        push, pair = begun["impulse"] * begun["normal"][:, 0], begun["b"] >= 0
        np.add.at(before, begun["a"], -push)
        np.add.at(before, begun["b"][pair], push[pair])
        assert before == pytest.approx(world.velocity[:, 0] * world.mass, abs=1e-9)


def test_friction_rubs() -> None:
    # Sliding, mu N against the way; rolling, nothing.
    world = pv.World(contacts=True, dtype=np.float64)
    floor = world.obstacles.append(pv.Segment((-50, 0), (50, 0), friction=0.3))
    world.add(position=(-40, 0.5), velocity=(6, 0), mass=2.0)
    world.run(seconds=0.2)
    assert world.force_on(floor) == pytest.approx([0.3 * 2 * G, -2 * G], rel=1e-6)
    row = world.contacts[0]
    assert row["rub"] * 60 == pytest.approx(-0.3 * 2 * G, rel=1e-6)  # the normal is (0, -1): along (1, 0)
    world.run(seconds=3)
    assert world.force_on(floor) == pytest.approx([0, -2 * G], abs=1e-6)


@pytest.mark.parametrize("place", [(0.0, 0.8), (0.3, 0.9)])
def test_in_a_corner_of_one_chain_a_contact_is_all_that_it_gives(place: tuple[float, float]) -> None:
    # Both sides of a valley hold a disc: m g together, as a vector. The pushes were summed as numbers, along one of the normals.
    world = pv.World(contacts=True, dtype=np.float64)
    valley = world.obstacles.append(pv.Chain([(-6, 4.5), (0, 0), (6, 4.5)], friction=0.2))
    world.add(position=[place, (0.4, 2.4)], radius=[0.5, 0.7], mass=[2.0, 5.0])
    world.run(seconds=20)
    row = world.contacts[world.contacts["obstacle"] == 0]
    x, y = row["normal"].T
    given = np.array([row["impulse"] @ x + row["rub"] @ y, row["impulse"] @ y - row["rub"] @ x]) * 60
    assert world.force_on(valley) == pytest.approx([0, -7 * G], abs=1e-6)
    assert given == pytest.approx([0, -7 * G], abs=1e-6)


def test_the_pressure_of_a_gas_is_what_turns_it_round() -> None:
    # One circle for each of 14 heights, each on its own: m v to and fro, 2 m |v| at each of the hits in a box of inner width 19.
    world = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (20, 20), restitution=1), contacts=True, dtype=np.float64)
    speed = np.linspace(3.0, 9.0, 14)
    gas = world.add(position=[(10, 0.7 + 1.4 * k) for k in range(14)], velocity=[(v, 0) for v in speed], radius=0.5, mass=2.0)
    given = 0.0
    for _ in each_frame(world, 120):
        given += world.pressure() * 80 / 60
    hits = np.floor((speed * 2.0 + 9.5) / 19)  # from the middle to the first wall, and then from wall to wall
    assert given == pytest.approx(float((2 * gas.mass * speed * hits).sum()), rel=1e-9)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_what_bounces_and_flies_on_within_a_frame_has_pushed_what_it_met(dtype: str) -> None:
    # To and fro between two plates in a frame, past a post that it ends beside; and off a wall, to a place near another one.
    world = pv.World(gravity=(0, 0), boundary=pv.Box((-4, -4), (4, 4), restitution=1), contacts=True, dtype=dtype)
    floor, ceiling = (world.obstacles.append(pv.Segment((-1, y), (1, y), restitution=1)) for y in (0, 0.5))
    post = world.obstacles.append(pv.Disc((0.9, 0.35), 0.7))
    world.add(position=[(0, 0.25), (3.5, 3.0)], velocity=[(0, -30), (30, 20)], radius=0.1, mass=[1.0, 3.0])
    world.step(1 / 60)
    assert world.force_on(floor) / 60 == pytest.approx([0, -60], rel=1e-6)
    assert world.force_on(ceiling) / 60 == pytest.approx([0, 60], rel=1e-6)
    assert world.force_on(post).tolist() == [0, 0]
    assert world.force_on(world.boundary) / 60 == pytest.approx([180, 0], rel=1e-6)
    told = world.contacts[["a", "wall", "obstacle", "impulse", "rub"]].tolist()
    assert [row[:3] for row in told] == [(0, -1, 0), (0, -1, 1), (1, 1, -1)]
    assert [row[3] for row in told] == pytest.approx([60, 60, 180], rel=1e-6)
    assert [row[4] for row in told] == [0, 0, 0]


@pytest.mark.parametrize("room", [pv.Box((0, 0), (5, 5), restitution=1), pv.Circle(radius=3, restitution=1)])
def test_the_pressure_of_a_fast_gas_is_that_of_its_impacts(room: Any) -> None:
    # Within a frame points fly far from the walls they have hit: P A = N m v^2 / 2, A being where centres may be.
    world = pv.World(gravity=(0, 0), boundary=room, collisions=None, contacts=True)
    rng, speed, n = np.random.default_rng(0), 100.0, 400
    x0, y0, x1, y1 = room.extent()
    middle, turn = 0.5 * np.array([x0 + x1, y0 + y1]), rng.uniform(0, 2 * np.pi, n)
    velocity = speed * np.column_stack((np.cos(turn), np.sin(turn)))
    world.add(position=middle + rng.uniform(-1.5, 1.5, (n, 2)), velocity=velocity, radius=0.001, mass=2.0)
    pressures = [world.pressure() for _ in each_frame(world, 200)]
    area = np.pi * 9 if isinstance(room, pv.Circle) else 25.0
    assert np.mean(pressures) == pytest.approx(n * 2.0 * speed**2 / 2 / area, rel=0.005)


@pytest.mark.parametrize("room", [pv.Box((0, 0), (50, 30)), pv.Periodic((0, -5), (50, 40), axes="x")])
def test_sleepers_go_on_to_bear_and_weigh_while_others_are_awake(room: Any) -> None:
    # Two stacks on plates, one that leans in a corner, and then one that flies far away, in frames of another length.
    world = pv.World(boundary=room, sleep=True, contacts=True, dtype=np.float64, collisions=pv.Collisions(friction=0.3))
    plates = [world.obstacles.append(pv.Segment((x, 1), (x + 10, 1), friction=0.3)) for x in (10, 25)]
    plates += [world.obstacles.append(pv.Segment((35, 3), (37, 1))), world.obstacles.append(pv.Segment((37, 1), (39, 3)))]
    floor = room.extent()[1]
    world.add(position=[(12, 1.5), (12, 2.5), (26, 1.5), (37, 2.2), (3, floor + 0.5)], radius=0.5, mass=[1.0, 2.0, 3.0, 4.0, 5.0])
    world.run(seconds=4)
    assert world.asleep.all()
    before, forces = world.contacts.copy(), [world.force_on(plate) for plate in plates]
    assert forces[0] == pytest.approx([0, -3 * G], rel=1e-6)
    assert before["impulse"][before["wall"] == 2] * 60 == pytest.approx(5 * G, rel=1e-5)
    world.add(position=(45, 25))
    for dt in (1 / 60, 1 / 240):
        world.step(dt)
        assert world.asleep.tolist() == [True] * 5 + [False]
        assert np.array([world.force_on(plate) for plate in plates]) == pytest.approx(np.array(forces), rel=1e-6, abs=1e-6)
        assert world.contacts[["a", "b", "wall", "obstacle"]].tolist() == before[["a", "b", "wall", "obstacle"]].tolist()
        for name, scale in (("impulse", 60 * dt), ("rub", 60 * dt), ("normal", 1.0), ("point", 1.0)):
            assert world.contacts[name] == pytest.approx(scale * before[name], rel=1e-6, abs=1e-9)
    world.velocity[0] = (0, 1)
    world.step(1 / 60)
    assert world.force_on(plates[1]) == pytest.approx([0, -3 * G], rel=1e-6)


def test_who_is_removed_is_no_contact_any_more() -> None:
    # Fifty circles in five layers, at rest.
    world = pv.World(boundary=pv.Box((0, 0), (10, 20)), contacts=True, dtype=np.float64)
    where = points(np.arange(10) + 0.5, np.arange(5) + 0.5) + np.random.default_rng(0).normal(0, 0.005, (50, 2))
    world.add(position=where, radius=0.499, mass=2.0)
    world.run(seconds=6)
    before = world.contacts.copy()  # the array itself is renumbered
    world.remove([0, 7])
    after = world.contacts
    gone = np.isin(before["a"], (0, 7)) | np.isin(before["b"], (0, 7))
    assert len(after) == len(before) - int(gone.sum())
    assert np.array_equal(after["impulse"], before["impulse"][~gone])
    assert int(after["a"].max()) < 48
    world.step(1 / 60)
    assert len(world.contacts) > 20


# ---- Rules of a user's own for circles that are about to touch ----


def row(**settings: Any) -> pv.World:
    """One flies at 3 m/s towards one that is a little aside, and one behind it."""
    laws = pv.Collisions(restitution=1.0)
    world = pv.World(**{"gravity": (0, 0), "collisions": laws, "dtype": np.float64, **settings})
    world.add(position=[(0, 0), (5, 0.3), (9, 0)], velocity=[(3, 0), (0, 0), (0, 0)], radius=0.5)
    return world


def test_a_contact_that_is_ignored_changes_nothing() -> None:
    world, told = row(), []

    @pv.contact_rule
    def ghost(world: pv.World, new: pv.NewContacts) -> Any:
        if new.meets.any():
            told.append((world.time, new.a.tolist(), new.b.tolist(), *new.speed, *new.point.ravel(), *new.normal.ravel()))
        return new.b == 1

    world.actors.append(ghost)
    world.run(seconds=4)
    # Straight through the second: 4 m and then 0.5 m beyond it to the third, which it gives all it has.
    assert world.velocity == pytest.approx(np.array([(0, 0), (0, 0), (3, 0)]), abs=1e-12)
    assert world.position[:, 0] == pytest.approx([8, 5, 9 + 3 * (4 - 8 / 3)])
    (t, a, b, speed, x, y, nx, ny), (*_, second, _, _, _, _) = told
    lean = np.sqrt(1 - 0.09)  # the centres are 1 m from each other, 0.3 m of that across
    assert (a, b) == ([0], [1])
    assert t <= (5 - lean) / 3 <= t + 1 / 60
    assert (speed, x, y, nx, ny) == pytest.approx((3 * lean, 5 - lean / 2, 0.15, lean, 0.3))
    assert second == pytest.approx(3)


def test_without_an_answer_all_is_as_if_there_were_no_rule() -> None:
    hashes = set()
    for rule in (None, lambda world, new: None, lambda world, new: False):
        world = row(events=True)
        if rule:
            world.actors.append(pv.contact_rule(rule))
        hashes.add(bits_after(world, 4))
    assert len(hashes) == 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_ignored_contacts_are_those_of_filters(dtype: Any) -> None:
    """A gas in a periodic room, half of which ignores the other half: to the bit as with masks."""
    rng = np.random.default_rng(4)
    kind = (np.arange(64) % 2 + 1).astype(np.uint32)
    velocity = rng.normal(0, 2, (64, 2))
    ends = []
    for by_mask in (True, False):
        world = pv.World(
            gravity=(0, 0), boundary=pv.Periodic((0, 0), (8, 8)), dtype=dtype,
            collisions=pv.Collisions(restitution=1.0, method=pv.BruteForce()),
        )  # fmt: skip
        marks = kind if by_mask else np.full(64, 1, np.uint32)
        world.add(
            position=points(np.arange(8) + 0.5, np.arange(8) + 0.5), velocity=velocity, radius=0.2, category=marks, mask=marks
        )
        world.actors.append(pv.contact_rule(lambda world, new: kind[new.a] != kind[new.b]))
        world.run(seconds=2)
        ends.append(world.position.copy())
    # Chaos multiplies rounding, which the order of pairs changes, by some 10 for each of a dozen collisions.
    assert ends[0] == pytest.approx(ends[1], abs=1e-4 if dtype == np.float64 else 0.5)


def test_a_rule_may_merge_and_break() -> None:
    world = row()

    @pv.contact_rule
    def merge(world: pv.World, new: pv.NewContacts) -> None:
        if not new.meets.any():
            return
        a, b = int(new.a[0]), int(new.b[0])
        m, n = world.mass[a], world.mass[b]
        world.add(
            position=(m * world.position[a] + n * world.position[b]) / (m + n),
            velocity=(m * world.velocity[a] + n * world.velocity[b]) / (m + n),
            radius=float(np.hypot(world.radius[a], world.radius[b])),
            mass=float(m + n),
        )
        world.remove([a, b])

    world.actors.append(merge)
    before = world.momentum()
    world.run(seconds=5)
    assert len(world) == 1
    assert world.momentum() == pytest.approx(before)
    assert world.velocity[0] == pytest.approx([1, 0])


def test_others_may_be_removed_meanwhile() -> None:
    world = row()
    extra = world.add(position=(-20, -20))
    world.position[:] = world.position[[3, 0, 1, 2]]
    world.velocity[:] = world.velocity[[3, 0, 1, 2]]
    del extra
    world.actors.append(pv.contact_rule(lambda world, new: True))
    world.run(seconds=1.5)
    world.remove(0)
    world.run(seconds=2)
    assert world.velocity == pytest.approx(np.array([(3, 0), (0, 0), (0, 0)]))


@pytest.mark.parametrize("answer", ["yes", [True, False], 1.0, [0]])
def test_a_wrong_answer_gets_a_sentence(answer: Any) -> None:
    world = row()
    world.actors.append(pv.contact_rule(lambda world, new: answer))
    refused("allowed are None, and 1 bools: which of the contacts to ignore", world.run, seconds=3)
