"""Sensors: who begins and ends to touch them, against the times of free flight; they change nothing."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, go_on_alike, points, refused, thing_of, world_with

import pyverlet as pv

DT, R = 1 / 60, 0.2

SENSORS: dict[str, tuple[Callable[..., pv.Obstacle], float, float]] = {
    "segment": (lambda **how: pv.Segment((0, -50), (0, 50), **how), 0.0, 0.0),
    "chain": (lambda **how: pv.Chain([(0, -50), (0, -1), (0, 50)], radius=0.1, **how), -0.1, 0.1),
    "capsule": (lambda **how: pv.Capsule((0, -50), (0, 50), radius=0.05, **how), -0.05, 0.05),
    "disc": (lambda **how: pv.Disc((0, 0), 1.5, **how), -1.5, 1.5),
    "polygon": (lambda **how: pv.Polygon([(-4, -9), (5, -9), (5, 9), (-4, 9)], **how), -4.0, 5.0),
}
"""Sensors, and from where to where they reach along y = 0."""


def watched(*obstacles: pv.Obstacle, **options: Any) -> pv.World:
    return world_with(*obstacles, **{"gravity": (0, 0), "events": True, **options})


def told(world: pv.World) -> list[tuple[str, int, int]]:
    """What the last frame said of obstacles."""
    events = [("begin", each) for each in world.events.begin] + [("end", each) for each in world.events.end]
    return sorted((name, int(each["a"]), int(each["obstacle"])) for name, each in events if each["obstacle"] >= 0)


@pytest.mark.parametrize("name", SENSORS)
@pytest.mark.parametrize(("dtype", "substeps"), [(np.float32, 16), (np.float64, 1)])
@pytest.mark.parametrize("speed", [3.0, 30.0, 1000.0])
def test_it_tells_of_the_frame_in_which_free_flight_begins_and_ends_to_touch(
    name: str, dtype: Any, substeps: int, speed: float
) -> None:
    # From x0 at v a rim of radius r touches what reaches from a to b from t = (a - r - x0) / v to (b + r - x0) / v. Frames are
    # numbered from 1: t lies in frame ceil(t / dt). The start puts both away from the ends of frames by more than rounding.
    make, left, right = SENSORS[name]
    world = watched(make(sensor=True), dtype=dtype, substeps=substeps)
    begins = (left - R) / speed  # s after x = 0
    start = -speed * (3.37 * DT - begins) if (right - left + 2 * R) / speed / DT % 1 < 0.6 else -speed * (3.05 * DT - begins)
    world.add(position=(start, 0), velocity=(speed, 0), radius=R)
    expected = [int(np.ceil((edge - start) / speed / DT)) for edge in (left - R, right + R)]
    seen: dict[str, list[int]] = {"begin": [], "end": []}
    for frame in range(1, expected[1] + 3):
        world.step(DT)
        for what, particle, obstacle in told(world):
            assert (particle, obstacle) == (0, 0)
            seen[what].append(frame)
        for each in world.events.begin:
            assert (each["speed"], each["impulse"]) == (0.0, 0.0)
        assert len(world.events.hit) == 0
    assert seen == {"begin": [expected[0]], "end": [expected[1]]}
    if speed == 1000.0 and name == "segment":
        assert expected[0] == expected[1]  # in the same frame


def busy(*sensors: pv.Obstacle, **options: Any) -> pv.World:
    """Discs of all sizes that fall on obstacles and on each other, and sensors."""
    law = pv.Collisions(restitution=0.3, friction=0.4)
    solid = [pv.Chain([(-5, 1), (0, -1), (5, 1)], friction=0.3), pv.Disc((1, 2), 0.5, restitution=0.5)]
    settings = {"gravity": (0, -9.81), "boundary": pv.Box((-5, -2), (5, 12)), "collisions": law, **options}
    world = watched(*sensors, *solid, **settings)
    chance = np.random.default_rng(2)
    world.add(position=points(np.linspace(-4, 4, 10), np.linspace(3, 9, 8)), radius=0.03 * 10 ** chance.random(80), density=1.0)
    return world


def many() -> list[pv.Obstacle]:
    """Forty sensors, some of which move, rub and turn."""
    moving: dict[str, Any] = {
        "velocity": (0.5, 0.1),
        "angular_velocity": 0.7,
        "friction": 1.0,
        "surface_speed": 3.0,
        "restitution": 1.0,
    }
    lines = [pv.Segment((-5, 0.2 * k), (5, 0.2 * k), sensor=True, **(moving if k % 3 == 0 else {})) for k in range(38)]
    return [*lines, pv.Disc((0, 0), 2, sensor=True), pv.Polygon([(-3, 0), (3, 0), (0, 4)], sensor=True, velocity=(0, 0.4))]


@pytest.mark.parametrize(
    ("options", "dtype"),
    [
        *(({"substeps": 1}, np.float32), ({"sleep": True}, np.float32)),
        *(({"ledger": True, "contacts": True}, np.float64), ({"events": False}, np.float32), ({"threads": 2}, np.float64)),
    ],
)
def test_they_change_nothing(options: dict[str, Any], dtype: Any) -> None:
    with_sensors, without = busy(*many(), dtype=dtype, **options), busy(dtype=dtype, **options)
    for world in (with_sensors, without):
        world.run(seconds=10.0 if options.get("sleep") else 1.0, dt=DT)
        if options.get("sleep"):
            assert world.asleep.any()
    assert with_sensors.state_hash() == without.state_hash()
    if options.get("ledger"):
        assert with_sensors.ledger == without.ledger
        assert with_sensors.contacts["impulse"].tobytes() == without.contacts["impulse"].tobytes()
    if options.get("sleep"):  # wakes alike, and sensors that come, change and go wake nobody
        asleep = with_sensors.asleep
        with_sensors.obstacles[3].category = 2
        with_sensors.obstacles.append(pv.Disc((0, 0), 3, sensor=True))
        for world in (with_sensors, without):
            world.step(DT)
        assert np.array_equal(with_sensors.asleep, asleep)
        with_sensors.obstacles.pop(7)
        for world in (with_sensors, without):
            world.add(position=(0.1, 8), radius=0.4, density=1.0)
            world.run(seconds=2.0, dt=DT)
        assert with_sensors.state_hash() == without.state_hash()


@pytest.mark.parametrize("sleep", [False, True])
def test_who_touches_at_the_end_of_a_frame_is_who_has_begun_and_not_ended(sleep: bool) -> None:
    # Sensors that move over discs that sleep, too. No ends of frames are so near to a rim that rounding decides.
    world = busy(*many(), sleep=sleep)
    touching = [set[int]() for _ in range(40)]
    for frame in each_frame(world, frames := 420 if sleep else 150):
        for what, particle, obstacle in told(world):
            if obstacle < 40:
                assert (particle in touching[obstacle]) == (what == "end") or what == "end"
                (touching[obstacle].add if what == "begin" else touching[obstacle].discard)(particle)
        if frame % 60 == 0 or frame > frames - 3:
            gaps = [thing_of(sensor).gap(world.position.astype(float)) for sensor in world.obstacles[:40]]
            assert touching == [set(np.flatnonzero(gap < world.radius)) for gap in gaps]
    if sleep:
        assert world.asleep.all()


def test_a_sleeper_is_swept_over_at_any_speed() -> None:
    world = busy(sleep=True)
    world.run(seconds=12.0, dt=DT)
    assert world.asleep.all()
    before = world.state_hash()
    world.obstacles.append(pv.Segment((-9, -3), (-9, 12), sensor=True, velocity=(4000, 0)))
    world.step(DT)
    begun = {a for what, a, _ in told(world) if what == "begin"}
    ended = {a for what, a, _ in told(world) if what == "end"}
    assert begun == ended == set(range(80))
    assert world.asleep.all()
    assert world.state_hash() != before  # of the time alone
    assert not world.velocity.any()


@pytest.mark.parametrize("restored", [False, True])
def test_a_sleeper_that_is_removed_leaves_its_sensor(restored: bool) -> None:
    world = watched(pv.Disc((0, 0), 2, sensor=True), boundary=pv.Box((-5, 0), (5, 5)), gravity=(0, -9.81), sleep=True)
    world.add(position=[(0, 0.4), (1.5, 0.4)], radius=0.4)
    world.run(seconds=3)
    assert world.asleep.all()
    world.remove(0)
    saved = world.save()
    world.step(DT)
    if restored:  # to where it had been removed, and nobody had been told
        world.restore(saved)
        world.step(DT)
    assert told(world) == [("end", -1, 0)]
    world.step(DT)
    assert told(world) == []
    assert world.asleep.all()


def test_a_disc_that_bounces_within_a_substep_crosses_twice() -> None:
    # Down to a floor and up again within a substep: what it crossed on its way was touched.
    for height in (0.5, 3.0):
        floor, sensor = pv.Segment((-9, 0), (9, 0), restitution=1.0), pv.Segment((-9, height), (9, height), sensor=True)
        world = watched(floor, sensor, substeps=1)
        world.add(position=(0, 5), velocity=(0, -600), radius=R)
        world.step(DT)
        assert world.position[0, 1] == pytest.approx(600 * DT - 4.8 + 0.2)
        assert told(world) == [("begin", 0, 0), ("begin", 0, 1), ("end", 0, 1)]


def test_filters_hold_for_sensors() -> None:
    world = watched(pv.Segment((0, -9), (0, 9), sensor=True, category=2, mask=4))
    world.add(position=[(-1, k) for k in range(4)], velocity=(50, 0), radius=R, category=[1, 4, 4, 6], mask=[2, 2, 1, 7])
    world.run(seconds=3 * DT, dt=DT)
    world.position[:, 0], world.velocity[:] = -0.5, (60, 0)
    world.step(DT)
    assert told(world) == [(what, a, 0) for what in ("begin", "end") for a in (1, 3)]


def test_a_sensor_that_goes_or_becomes_solid_ends_what_it_told() -> None:
    world = watched(pv.Disc((0, 0), 2.0, sensor=True), pv.Disc((9, 9), 1.0))
    world.add(position=[(0, 1.9), (0.5, 0)], radius=R)
    world.step(DT)
    assert told(world) == [("begin", 0, 0), ("begin", 1, 0)]
    world.step(DT)
    assert told(world) == []
    world.remove(1)
    world.step(DT)
    assert [(each["a"], each["obstacle"]) for each in world.events.end] == [(-1, 0)]
    world.obstacles[0].mask = 0
    world.step(DT)
    assert told(world) == [("end", 0, 0)]
    world.obstacles[0].mask = 1
    world.step(DT)
    assert told(world) == [("begin", 0, 0)]
    world.obstacles.pop(0)
    world.step(DT)
    assert [(each["a"], each["obstacle"]) for each in world.events.end] == [(0, -1)]
    world.obstacles[0].sensor = True
    world.obstacles[0].pivot = (0, 0)
    world.step(DT)
    assert told(world) == []


def test_in_a_periodic_room() -> None:
    world = watched(pv.Segment((9.9, 3), (10.1, 7), sensor=True), boundary=pv.Periodic((0, 0), (10, 10)))
    world.add(position=[(9.0, 5), (1.0, 4), (4.0, 6)], velocity=[(9, 0), (-9, 0), (900, 0)], radius=R)
    seen: dict[int, list[str]] = {0: [], 1: [], 2: []}
    for _ in each_frame(world, 18):
        for what, a, _ in told(world):
            seen[a].append(what)
    assert seen[0] == seen[1] == ["begin", "end"]
    assert seen[2].count("begin") == seen[2].count("end") == 18  # 15 m a frame: once or twice over it


def test_what_is_told_survives_a_file_and_a_copy(tmp_path: Path) -> None:
    world = busy(*many(), sleep=True, dtype=np.float32)
    world.run(seconds=1.0, dt=DT)
    assert any(frame["end"]["a"] for frame in go_on_alike(world, tmp_path, 30))


def test_no_hits_in_a_file_either(tmp_path: Path) -> None:
    world = watched(pv.Disc((0, 0), 1.0, sensor=True), pv.Disc((0, 5), 1.0))
    world.events.hit_speed = 0.0
    world.add(position=[(-1.25, 0), (-1.25, 5)], velocity=(6, 0), radius=R)
    world.step(DT)
    pv.save(world, tmp_path / "a.pvsnap")
    for each in (world, pv.load(tmp_path / "a.pvsnap")):
        assert len(each.events.begin) == 2
        assert each.events.hit["obstacle"].tolist() == [1]


def test_nobody_is_refused_a_place_in_a_sensor_and_it_looks_different() -> None:
    disc = pv.Disc((0, 0), 1.0, sensor=True)
    world = watched(disc)
    assert world.is_free((0, 0)).all()
    world.add(position=(0, 0), radius=0.1)
    assert len(disc.drawn()) > 5
    assert not any(filled for _, filled in disc.drawn())
    refused("sensor is 1; allowed are True and False", setattr, disc, "sensor", 1)


@pytest.mark.parametrize("substeps", [1, 8])
@pytest.mark.parametrize("turn", [2.0, -40.0])
def test_ways_are_straight_in_the_room_whatever_turns(substeps: int, turn: float) -> None:
    # Fast discs about a spinning disc and a turning line, against their distances at 4,000 times of a frame.
    reach, rng = 0.6, np.random.default_rng(5)
    spinning = pv.Disc((0, 0), reach, sensor=True, angular_velocity=turn)
    hand = pv.Segment((10, 0), (12, 0), sensor=True, angular_velocity=turn, pivot=(10, 0))
    world = watched(spinning, hand, substeps=substeps, collisions=None)
    way = rng.uniform(0, 2 * np.pi, 100)
    velocity = 600.0 * np.column_stack((np.cos(way), np.sin(way)))
    world.add(
        position=rng.uniform(-1.5, 1.5, (100, 2)) + [10, 0] * (np.arange(100)[:, None] % 2) - 5e-3 * velocity,
        velocity=velocity,
        radius=R,
    )
    time = np.linspace(0, DT, 4000)
    path = world.position[:, None] + velocity[:, None] * time[:, None]
    arm = path - [10, 0]
    out = np.stack((np.cos(turn * time), np.sin(turn * time)), -1)
    part = (arm * out).sum(axis=-1).clip(0, 2)
    gaps = (np.hypot(*path.T).T - reach - R, np.hypot(*(arm - part[..., None] * out).T).T - R)
    world.step(DT)
    for obstacle, gap in enumerate(gaps):
        nearest, told_of = gap.min(axis=1), [a for what, a, which in told(world) if what == "begin" and which == obstacle]
        assert set(np.flatnonzero(nearest < -0.01)) <= set(told_of) <= set(np.flatnonzero(nearest < 0.01))
        assert 10 < len(told_of) < 90
