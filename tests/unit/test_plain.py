"""Frames in which nothing but motion changes are made by the core alone: the bits are those of all others, whatever is set."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.laws import gains, limiter
from pyverlet.world import plain
from pyverlet.world import world as module

DT = 1 / 60


def heap(count: int = 12, dtype: Any = np.float32, **options: Any) -> pv.World:
    world = pv.World(**{
        "boundary": pv.Box((0, 0), (4, 40), friction=0.5, restitution=0.3),
        "collisions": pv.Collisions(friction=0.5, restitution=0.3),
        "dtype": dtype,
    } | options)  # fmt: skip
    k = np.arange(count)
    world.add(position=np.column_stack((0.5 + 0.9 * (k % 4) + 0.01 * (k % 7), 0.5 + 0.9 * (k // 4))), radius=0.4)
    return world


@pytest.fixture
def long_way(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Any]], Any]:
    """What comes of it if no frame is plain."""

    def run(act: Callable[[], Any]) -> Any:
        with monkeypatch.context() as patch:
            patch.setattr(module, "plain_frames", lambda *_: None)
            return act()

    return run


@pytest.mark.parametrize("count", [1, 2, 40, 300])
@pytest.mark.parametrize("room", [pv.Circle(center=(2, 40), radius=50), pv.Box((0, 0), (4, 200)), pv.Open()])
def test_most_frames_are_plain(count: int, room: pv.Boundary, long_way: Any) -> None:
    def run() -> tuple[Any, ...]:
        world = heap(count, boundary=room)
        world.obstacles.append(pv.Segment((-1, 0.05), (5, 0.05)))
        plain = 0
        for _ in range(60):
            world.step(DT)
            plain += int(world.profile.plain[0, -1])
        return plain, world.state_hash()

    (most, found), (none, expected) = run(), long_way(run)
    assert (most > 50, none, found) == (True, 0, expected)


def test_walls_that_change_after_plain_frames_are_seen(long_way: Any) -> None:
    def run() -> str:
        room = pv.Box((0, 0), (4, 40), friction=0.5, restitution=0.3)
        world = heap(boundary=room)
        for frame in range(60):
            if frame == 20:
                room.lower = (0.0, -3.0)
            world.step(DT)
        return world.state_hash()

    assert run() == long_way(run)


def test_plain_frames_are_not_prepared_in_vain_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def counted(world: pv.World, dt: float) -> Any:
        made.append(world.frames)
        return plain.plain_frames(world, dt)

    monkeypatch.setattr(module, "plain_frames", counted)
    world = heap()
    for k in range(200):  # pauses of 1, 3, 7 and 15 frames, and of 15 from there on
        world.gravity = (0.01 * k, -9.81)
        world.step(DT)
    assert len(made) < 200 / 10
    made.clear()
    world.run(seconds=1)
    assert 1 <= len(made) <= 2  # then all frames are made by what is prepared once


def test_lengths_of_frames_may_change(long_way: Any) -> None:
    def run() -> str:
        world = heap()
        for dt in [DT] * 9 + [DT / 2] * 9 + [DT, DT, DT / 2, 0.05, 0.05, np.float64(DT)] + [DT] * 5:
            world.step(dt)
        return world.state_hash()

    assert run() == long_way(run)


OBSTACLES: dict[str, Callable[[pv.World, int], Any]] = {
    "moved": lambda world, k: setattr(world.obstacles[1], "pivot", (0.03 * k, 1.0)),
    "turned": lambda world, k: setattr(world.obstacles[0], "angle", 0.002 * k),
    "added": lambda world, k: world.obstacles.append(pv.Disc((0.05 * k, 3.0), 0.1, friction=0.2)),
    "replaced": lambda world, k: world.obstacles.__setitem__(k % 2, pv.Segment((-1, 0.02 * k), (5, 0.5))),
    "removed": lambda world, k: world.obstacles.pop(),
    "made springy": lambda world, k: setattr(world.obstacles[1], "restitution", 0.01 * k),
    "far away": lambda world, k: setattr(world.obstacles[1], "pivot", (10.0 ** min(k, 60), 0)),
    "passable": lambda world, k: setattr(world.obstacles[2], "one_way", (0.0, 1.0) if k % 2 else None),
    "set moving now and then": lambda world, k: setattr(world.obstacles[1], "velocity", (0.1 * (k % 3), 0)),
    "made rough": lambda world, k: setattr(world.obstacles[1], "friction", 0.1 * (k > 20)),
    "made a sensor": lambda world, k: setattr(world.obstacles[1], "sensor", k % 4 == 0),
}


@pytest.mark.parametrize("rough", [True, False])
@pytest.mark.parametrize("change", OBSTACLES)
def test_frames_are_plain_where_obstacles_are_others_in_each(change: str, rough: bool, long_way: Any) -> None:
    def run() -> tuple[int, str]:
        smooth: dict[str, Any] = {} if rough else {"boundary": pv.Box((0, 0), (4, 40)), "collisions": pv.Collisions()}
        world, made = heap(40, **smooth), 0
        world.obstacles.extend([pv.Segment((-1, 0.05), (5, 0.3)), pv.Disc((2, 0.5), 0.3), pv.Segment((0, 2), (2, 2))])
        world.obstacles.extend(pv.Disc((0.1 * k, 0.1), 0.1) for k in range(40))
        world.run(seconds=0.2, dt=DT)
        for k in range(40):
            OBSTACLES[change](world, k)
            world.step(DT)
            made += int(world.profile.plain[0, -1])
        return made, world.state_hash()

    (most, found), (none, expected) = run(), long_way(run)
    assert none == 0
    assert most > 35 or change.startswith(("set", "made", "passable"))  # what lies on a line that becomes passable is let go
    assert found == expected


SLEEPERS: dict[str, Callable[[pv.World], Any]] = {
    "nothing": lambda world: None,
    "position": lambda world: world.position[3].__iadd__((0, 0.3)),
    "velocity": lambda world: world.velocity[3].__iadd__((0, 2.0)),
    "spin": lambda world: world.spin.__setitem__(3, 4.0),
    "radius": lambda world: world.radius.__setitem__(3, 0.3),
    "mass": lambda world: world.mass.__setitem__(3, 3.0),
    "friction": lambda world: world.friction.__setitem__(3, 0.1),
    "category": lambda world: world.category.__setitem__(3, 2),
    "pinned": lambda world: world.position[-1].__iadd__((0, 0.1)),
    "pinned velocity": lambda world: world.velocity.__setitem__(-1, (0, -1)),
    "gravity": lambda world: setattr(world, "gravity", (1.0, -9.0)),
    "wall": lambda world: setattr(world.boundary, "friction", 0.1),
    "size": lambda world: setattr(world.boundary, "upper", (4.5, 40)),
    "boundary": lambda world: setattr(world, "boundary", pv.Circle(center=(2, 20), radius=30)),
    "collisions": lambda world: setattr(world, "collisions", pv.Collisions(friction=0.1)),
    "obstacle": lambda world: world.obstacles.append(pv.Disc((2, 9), 0.2)),
    "moved obstacle": lambda world: setattr(world.obstacles[0], "pivot", (0.0, -0.03)),
    "force": lambda world: world.forces.append(pv.Drag(linear=0.1)),
    "link": lambda world: world.links.append(pv.Stick(world.add(position=[(1, 14), (2, 14)], radius=0.3), 0, 1)),
    "another": lambda world: world.add(position=(2, 12), radius=0.4),
    "fewer": lambda world: world.remove(np.array([2, 5])),
    "step": lambda world: setattr(world, "substeps", 4),
    "integrator": lambda world: setattr(world, "integrator", pv.VelocityVerlet()),
    "restored": lambda world: world.restore(world.save()),
}


@pytest.mark.parametrize("count", [12, 40])
@pytest.mark.parametrize("change", SLEEPERS)
def test_frames_of_sleepers_are_plain_and_they_wake_as_in_others(change: str, count: int, long_way: Any) -> None:
    def run() -> tuple[int, list[str]]:
        world, made, found = heap(count, sleep=True), 0, []
        world.obstacles.append(pv.Segment((-1, 0.05), (5, 0.05)))
        world.add(position=(2, 30), mass=np.inf, radius=0.2)
        for frame in range(420):
            if frame in (5, 300, 330):  # in flight, when all sleep, and when they have woken or sleep again
                SLEEPERS[change](world)
            world.step(DT)
            made += int(world.profile.plain[0, -1])
            if frame % 30 == 29:
                found += [world.state_hash(), str(world.asleep.sum())]
        return made, found

    (most, found), (none, expected) = run(), long_way(run)
    assert none == 0
    assert most > 150 or change in ("force", "link", "pinned velocity", "integrator")
    assert found == expected


def test_sleepers_of_a_copy_wake(long_way: Any) -> None:
    """The core of a copy has not moved any particle yet."""

    def run() -> list[Any]:
        world = heap(12, sleep=True)
        world.obstacles.append(pv.Segment((-1, 0.05), (5, 0.05)))
        world.run(seconds=8, dt=DT)
        assert world.asleep.all()
        world, found = copy.deepcopy(world), []
        for frame in range(40):
            if frame == 5:
                world.radius[3] = 0.3
            world.step(DT)
            found.append((world.asleep.sum(), world.state_hash()))
        return found

    assert run() == long_way(run)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("restitution", [0.0, 0.9])
@pytest.mark.parametrize("change", [*(name for name in SLEEPERS if name not in ("size", "boundary", "fewer")), "awake"])
def test_frames_are_plain_while_some_sleep_and_they_wake_when_touched(
    change: str, restitution: float, dtype: Any, long_way: Any
) -> None:
    """Circles that fall, roll and bounce beside sleepers, and into them."""

    def run() -> tuple[int, list[str]]:
        floor = pv.Box((0, 0), (40, 40), friction=0.5, restitution=0.3)
        world, made, found = heap(12, sleep=True, boundary=floor, dtype=dtype), 0, []
        world.obstacles.extend([pv.Segment((-1, 0.05), (5, 0.05)), pv.Segment((4.2, 0), (4.2, 3))])
        world.run(seconds=8, dt=DT)
        assert world.asleep.all()
        place = [(8 + 2 * k, 2 + 5 * k) for k in range(6)]
        world.add(position=place, velocity=[(-1.2 * k, 0) for k in range(6)], radius=0.4, restitution=restitution)
        world.add(position=(2, 30), mass=np.inf, radius=0.2)
        for frame in range(600):
            if frame == 50 and change == "awake":
                world.position[14] += (0, 1)
            elif frame == 50:
                SLEEPERS[change](world)
            world.step(DT)
            made += int(world.profile.plain[0, -1]) * bool(0 < world.asleep.sum() < 18)
            if frame % 30 == 29:
                found += [world.state_hash(), str(world.asleep.sum())]
        return made, found

    (most, found), (none, expected) = run(), long_way(run)
    assert none == 0
    assert found == expected
    assert most > 15 or change in ("force", "link", "pinned velocity", "integrator")


def test_an_obstacle_too_far_away_is_refused_in_each_frame_until_it_is_not() -> None:
    world = heap()
    peg = world.obstacles.append(pv.Disc((2, 0.5), 0.3))
    world.run(seconds=0.2, dt=DT)
    peg.pivot = (1e200, 0)
    for _ in range(3):
        refused(r"obstacles\[0\] is farther away than numbers reach", world.step, DT)
    peg.pivot = (2, 0.5)
    world.step(DT)
    assert world.frames == 13


@pytest.mark.parametrize("what", ["position", "velocity"])
def test_a_particle_that_turns_non_finite_is_named_and_the_last_good_frame_kept(what: str, long_way: Any) -> None:
    def run() -> tuple[str, str]:
        world = heap()
        world.run(seconds=1)
        good = getattr(world, what).copy()
        getattr(world, what)[7] = np.nan
        with pytest.raises(pv.NonFiniteError, match="particle 7") as error:
            world.step(DT)
        assert world.frames == 60
        getattr(world, what)[:] = good
        world.run(seconds=0.5)
        return str(error.value), world.state_hash()

    assert run() == long_way(run)


def test_what_is_refused_is_refused_in_plain_frames() -> None:
    world = heap()
    world.run(seconds=0.1)
    for wrong in (0.0, -1.0, np.nan, "soon", None):
        with pytest.raises(pv.InputError, match="dt is"):
            world.step(wrong)  # type: ignore[arg-type]
    world.radius[3] = -1.0
    refused("radius", world.step, DT)


def test_a_frame_is_ended_even_if_ctrl_c_comes_before_its_end(monkeypatch: pytest.MonkeyPatch, long_way: Any) -> None:
    def crowd() -> pv.World:
        world = heap()
        world.run(seconds=0.1)
        return world

    pressed, end = [KeyboardInterrupt, KeyboardInterrupt], plain._end

    def interrupted(*about: Any) -> None:
        if pressed:
            raise pressed.pop()
        end(*about)

    monkeypatch.setattr(plain, "_end", interrupted)
    monkeypatch.setattr(gains, "SURPLUS", 1e-9)
    monkeypatch.setattr(limiter, "SURPLUS", 1e-9)  # rounding is more than a frame may gain
    world = crowd()
    with pytest.raises(KeyboardInterrupt):
        world.run(seconds=1)
    assert not pressed
    frames = world.frames

    def expected() -> str:
        other = crowd()
        for _ in range(frames - other.frames):
            other.step(DT)
        return other.state_hash()

    assert world.state_hash() == long_way(expected)
    world.step(DT)
    assert world.frames == frames + 1
