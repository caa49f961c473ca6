"""The narrow door, without any server: commands in, frames out."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.forces import Push
from pyverlet.state.slots import Slots
from pyverlet.viewers.commands import Command, Drag, Pause, Poke, Release, Reset, SetGravity, SetSubsteps, Step
from pyverlet.viewers.pointers import LEASH
from pyverlet.viewers.session import KEEN, Session

WaitUntil = Callable[[Callable[[], bool]], None]


def test_runs_in_real_time(session: Session) -> None:
    before, began = session.latest.status.time, time.perf_counter()
    time.sleep(0.7)
    simulated = session.latest.status.time - before + session.latest.status.dropped / 60
    assert simulated == pytest.approx(time.perf_counter() - began, abs=0.12)


def test_pause_holds_time_and_resume_does_not_catch_up(paused: Session, wait_until: WaitUntil) -> None:
    held = paused.latest.status
    time.sleep(0.3)
    assert paused.latest.status.time == held.time
    began = time.perf_counter()
    paused.submit(Pause(False))
    wait_until(lambda: paused.latest.status.frames > held.frames)
    # On a busy machine somebody may look late: no more frames are due, made or dropped, than time has passed since.
    due = paused.latest.status.frames + paused.latest.status.dropped - held.frames - held.dropped
    assert due <= 60 * (time.perf_counter() - began) + 1


def test_time_until_it_goes_on_is_not_caught_up_with() -> None:
    """Paused for 0.2 s since the last turn: nothing of that is due, whenever the next turn looks."""
    session = Session(pv.scenes.get("fall").world(collisions=False))
    session.submit(Pause(True))
    session.turn()
    time.sleep(0.2)
    session.submit(Pause(False))
    began = time.perf_counter()
    session.turn()
    status = session.latest.status
    assert status.frames + status.dropped <= 60 * (time.perf_counter() - began) + 1


def test_step_pauses_and_advances_by_exactly_the_frames_asked(session: Session, wait_until: WaitUntil) -> None:
    session.submit(Pause(True))
    session.submit(Step(3))
    session.submit(Step())
    wait_until(lambda: session.latest.status.paused)
    frames = session.latest.status.frames
    session.submit(Step(5))
    wait_until(lambda: session.latest.status.frames != frames)
    assert session.latest.status.frames == frames + 5
    assert session.latest.status.time == pytest.approx((frames + 5) / 60)


def test_reset_goes_back_to_the_bits_of_the_start(world: pv.World, wait_until: WaitUntil) -> None:
    world.velocity[:, 1] = 5.0
    world.run(seconds=0.1)  # the start of the session is not the start of the world
    start, start_time, start_frames = world.state_hash(), world.time, world.frames
    with Session(world) as session:
        wait_until(lambda: session.latest.status.frames > start_frames + 5)
        session.submit(Pause(True))
        session.submit(Reset())
        wait_until(lambda: session.latest.status.time == start_time)
    assert world.state_hash() == start
    assert session.latest.status.paused


def test_gravity_and_substeps_reach_the_world_and_survive_reset(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    paused.submit(SetGravity(1.0, 2.5))
    paused.submit(SetSubsteps(3))
    wait_until(lambda: paused.latest.status.substeps == 3)
    assert paused.latest.status.gravity == (1.0, 2.5)
    assert (world.gravity, world.substeps) == ((1.0, 2.5), 3)
    paused.submit(Reset())
    wait_until(lambda: paused.latest.status.time == 0.0)
    assert (world.gravity, world.substeps) == ((1.0, 2.5), 3)
    paused.submit(Step(10))
    wait_until(lambda: paused.latest.status.frames == 10)
    assert paused.latest.position[:, 1].min() > 0.5  # they fall upward now


@pytest.fixture
def callers(world: pv.World, monkeypatch: pytest.MonkeyPatch) -> set[threading.Thread]:
    """The threads that have stepped the world."""
    found, step = set(), world.step

    def spy(dt: float) -> None:
        found.add(threading.current_thread())
        step(dt)

    monkeypatch.setattr(world, "step", spy)
    return found


def test_one_thread_and_no_other_steps_the_world(world: pv.World, callers: set[threading.Thread], wait_until: WaitUntil) -> None:
    with Session(world) as session:
        commands = (Step(2), Reset(), Pause(False), SetSubsteps(2))
        threads = [threading.Thread(target=session.submit, args=(command,)) for command in commands]
        for thread in threads:
            thread.start()
        wait_until(lambda: world.frames > 10 or session.latest.status.paused)
    assert len(callers) == 1
    assert callers.isdisjoint({threading.current_thread(), *threads})


def test_run_steps_in_the_calling_thread_until_stopped(world: pv.World, callers: set[threading.Thread]) -> None:
    for command in (Poke(pointer=1, x=0.0, y=0.5), Pause(True)):
        session = Session(world)
        session.submit(command)
        threading.Timer(0.2, session.stop).start()
        session.run()
        assert callers == {threading.current_thread()}
        assert world.forces == []
    assert session.latest.status.paused


def test_non_finite_stops_the_stepping_and_reset_cures_it(session: Session, world: pv.World, wait_until: WaitUntil) -> None:
    class Poison:
        velocity_dependent = False

        def apply(self, state: Slots, t: float) -> None:
            state.force[:] = np.nan

    wait_until(lambda: session.latest.status.frames > 3)
    world.forces.append(Poison())
    wait_until(lambda: session.latest.status.error is not None)
    assert "non-finite" in str(session.latest.status.error)
    stopped = session.latest.status.frames
    assert np.isfinite(session.latest.position).all()
    session.submit(Step())
    session.submit(SetSubsteps(2))  # still readable, still obeying
    wait_until(lambda: session.latest.status.substeps == 2)
    assert session.latest.status.frames == stopped
    world.forces.clear()
    session.submit(Reset())
    session.submit(Pause(False))
    wait_until(lambda: session.latest.status.error is None and session.latest.status.frames > 3)


def test_an_error_in_a_users_force_is_shown_and_logged(
    session: Session, world: pv.World, wait_until: WaitUntil, caplog: pytest.LogCaptureFixture
) -> None:
    class Broken:
        velocity_dependent = False

        def apply(self, state: Slots, t: float) -> None:
            raise KeyError("wind")

    world.forces.append(Broken())
    wait_until(lambda: session.latest.status.error is not None)
    assert session.latest.status.error == "KeyError: 'wind'"
    assert "Traceback" in caplog.text


def test_a_slow_world_drops_frames_counts_them_and_still_publishes_each_step(
    world: pv.World, monkeypatch: pytest.MonkeyPatch, wait_until: WaitUntil
) -> None:
    step = world.step

    def slow(dt: float) -> None:
        time.sleep(0.03)
        step(dt)

    monkeypatch.setattr(world, "step", slow)
    seen: list[int] = []
    with Session(world) as session:
        session.subscribe(lambda: seen.append(session.latest.status.frames))
        wait_until(lambda: session.latest.status.dropped > 10)
    assert seen == list(range(seen[0], seen[0] + len(seen)))
    assert session.latest.status.physics_median_ms > 30.0


class Treacle:
    """A force of nothing that takes its time: eight times in a frame of as many substeps."""

    velocity_dependent = False

    def apply(self, state: Slots, t: float) -> None:
        time.sleep(0.012)


@pytest.mark.parametrize("velocity", [True, False])
def test_a_slow_world_is_seen_between_its_substeps_if_somebody_asks(wait_until: WaitUntil, velocity: bool) -> None:
    watched, alone = falling(), falling()
    watched.forces.append(Treacle())
    session = Session(watched)
    seen: list[tuple[float, int, float]] = []
    speeds: list[float] = []

    def take() -> None:
        frame = session.latest
        seen.append((frame.status.time, frame.status.frames, float(frame.position[7, 1])))
        speeds.append(float(frame.velocity[7, 1]))
        session.take(frame, velocity=velocity)

    session.subscribe(take)
    with session:
        wait_until(lambda: watched.frames > 4)
    frames = watched.frames
    alone.run(seconds=frames / 60)
    assert watched.state_hash() == alone.state_hash()  # but for the wait the force does nothing
    times = [time for time, _, _ in seen]
    assert times == sorted(set(times))
    assert len(seen) > 3 * frames
    assert all(-1e-6 < time * 60 - frames < 1 for time, frames, _ in seen)
    between = [(time, y) for time, frames, y in seen if time * 60 - frames > 1e-3]
    assert len(between) > 2 * frames
    for t, y in between:  # y0 - g t^2 / 2, in float32
        assert y == pytest.approx(20 - 0.5 * 9.80665 * t * t, abs=2e-3)
    for (t, frames, _), v in zip(seen, speeds, strict=True):  # v = -g t; unless asked for, that of the end of some frame before
        then = t if velocity else min(round(v / -9.80665 * 60), frames) / 60
        assert v == pytest.approx(-9.80665 * then, abs=1e-3)  # float32: 20 m 2^-24 / h
    assert session.latest.status.stages["pictures"] > 0


def falling(**options: Any) -> pv.World:
    world = pv.World(collisions=None, **options)
    world.add(position=np.column_stack((np.arange(12.0)[::-1], np.full(12, 20.0))), radius=0.3)
    return world


def test_a_slow_world_that_nobody_asks_for_pictures_makes_one_a_frame(wait_until: WaitUntil) -> None:
    world = falling()
    world.forces.append(Treacle())
    session = Session(world)
    seen: list[float] = []
    session.subscribe(lambda: seen.append(session.latest.status.time))
    with session:
        wait_until(lambda: world.frames > 4)
    assert len(seen) <= world.frames + 1  # and the last, for the pause


def asks_once(session: Session, world: pv.World, commands: list[Command], may: Callable[[], bool] = lambda: True) -> list[int]:
    """Submit these when a picture between two substeps comes; the list gets the number of the frame then."""
    asked: list[int] = []

    def ask() -> None:
        frame = session.latest
        session.take(frame)
        if not asked and may() and 0.01 < frame.status.time * 60 - frame.status.frames < 0.6:
            asked.append(world.frames)
            for command in commands:
                session.submit(command)

    session.subscribe(ask)
    return asked


class Diary(Treacle):
    """Treacle that writes down in which frame it was asked, which gravity there was, and where the first poke was."""

    def __init__(self, world: pv.World) -> None:
        self.world = world
        self.gravity: list[tuple[int, float]] = []
        self.pokes: list[tuple[int, float]] = []

    def apply(self, state: Slots, t: float) -> None:
        super().apply(state, t)
        self.gravity.append((self.world.frames, self.world.gravity[1]))
        self.pokes += [(self.world.frames, force.center[0]) for force in self.world.forces if isinstance(force, Push)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("commands", "ledger", "at_once"),
    [
        ([SetGravity(0, 5)], False, True),
        ([SetGravity(0, 5)], True, False),  # which measures heights by what gravity was
        ([SetSubsteps(7), SetGravity(0, 5)], False, False),  # in the order asked
    ],
)
def test_a_slow_world_takes_another_gravity_between_substeps(
    wait_until: WaitUntil, commands: list[Command], ledger: bool, at_once: bool
) -> None:
    world = falling(ledger=ledger)
    diary = Diary(world)
    world.forces.append(diary)
    session = Session(world)
    asked = asks_once(session, world, commands)
    with session:
        wait_until(lambda: bool(asked) and world.frames > asked[0] + 2)
    after = [frame for frame, gravity in diary.gravity if gravity == 5]
    assert after[0] == asked[0] + (not at_once)
    assert session.latest.status.gravity == (0.0, 5.0)
    order = [gravity for _, gravity in diary.gravity]
    assert order == sorted(order)  # once changed it stays


def test_a_hand_that_is_down_in_a_slow_world_moves_between_substeps(wait_until: WaitUntil) -> None:
    world = falling()
    diary = Diary(world)
    world.forces.append(diary)
    session = Session(world)
    session.submit(Poke(pointer=1, x=3.0, y=0.0))
    asked = asks_once(session, world, [Poke(pointer=1, x=7.0, y=0.0)], lambda: bool(diary.pokes))
    with session:
        wait_until(lambda: bool(asked) and world.frames > asked[0] + 1)
    places = [x for _, x in diary.pokes]
    assert places == sorted(places)
    assert next(frame for frame, x in diary.pokes if x == 7.0) == asked[0]  # in the midst of it
    assert (asked[0], 3.0) in diary.pokes


def test_the_pace_is_that_of_the_wall(wait_until: WaitUntil) -> None:
    world = falling()
    world.forces.append(Treacle())
    with Session(world) as session:
        wait_until(lambda: world.frames > 6)
        pace, slow = session.latest.status.pace, session.latest.status.physics_median_ms
        # A frame of 1/60 s each `slow` ms and a little more.
        assert pace is not None
        assert 0.3 * (1000 / 60) / slow < pace < 1.1 * (1000 / 60) / slow
        session.submit(Pause(True))
        wait_until(lambda: session.latest.status.paused)
        assert session.latest.status.pace is None


def test_two_hands_hold_two_circles_and_one_that_missed_none(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    paused.submit(Drag(pointer=1, x=2.0, y=5.0, reach=0.3))
    paused.submit(Drag(pointer=1, x=2.0, y=0.5, reach=0.3))
    paused.submit(SetSubsteps(6))
    wait_until(lambda: paused.latest.status.substeps == 6)
    assert world.forces == []
    paused.submit(Release(pointer=1))
    paused.submit(Drag(pointer=1, x=-8.0, y=0.5, reach=0.1))
    paused.submit(Drag(pointer=2, x=8.0, y=0.5, reach=0.1))
    paused.submit(SetSubsteps(7))
    wait_until(lambda: paused.latest.status.substeps == 7)
    assert sorted(force.particle for force in world.forces if isinstance(force, pv.forces.Grip)) == [0, 8]
    paused.submit(Release(pointer=1))
    paused.submit(Release(pointer=3))  # never held anything
    wait_until(lambda: len(world.forces) == 1)


def test_the_grip_is_leashed(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    paused.submit(Drag(pointer=1, x=0.0, y=0.5, reach=0.1))
    paused.submit(Drag(pointer=1, x=0.0, y=19.0))
    frames = paused.latest.status.frames
    paused.submit(Step())
    wait_until(lambda: paused.latest.status.frames == frames + 1)
    (grip,) = world.forces
    assert isinstance(grip, pv.forces.Grip)
    x0, y0, x1, y1 = paused.latest.view
    assert grip.target[1] - 0.5 == pytest.approx(LEASH * max(x1 - x0, y1 - y0), rel=1e-3)


def test_poke_pushes_everything_near_away(session: Session, world: pv.World, wait_until: WaitUntil) -> None:
    start = session.latest.position
    session.submit(Poke(pointer=1, x=1.0, y=0.5))  # between particles 4 and 5
    wait_until(lambda: bool(session.latest.position[5, 0] - session.latest.position[4, 0] > 2.5))
    session.submit(Release(pointer=1))
    wait_until(lambda: world.forces == [])
    np.testing.assert_allclose(session.latest.position[[0, 8]], start[[0, 8]], atol=0.2)


def test_frames_are_immutable_and_numbered(session: Session, wait_until: WaitUntil) -> None:
    frame = session.latest
    kept = frame.position.copy()
    wait_until(lambda: session.latest.seq >= frame.seq + 5)
    np.testing.assert_array_equal(frame.position, kept)
    with pytest.raises(ValueError, match="read-only"):
        frame.position[0] = 0.0
    assert session.latest.shape is frame.shape


def test_added_particles_get_a_new_shape(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    world.add(position=(0.0, 10.0), radius=0.25)
    paused.submit(Step())
    wait_until(lambda: len(paused.latest.position) == 10)
    assert paused.latest.shape.radius.tolist() == [0.5] * 9 + [0.25]


def test_unsubscribed_listeners_hear_nothing(session: Session, wait_until: WaitUntil) -> None:
    heard: list[int] = []
    unsubscribe = session.subscribe(lambda: heard.append(1))
    wait_until(lambda: len(heard) > 2)
    unsubscribe()
    time.sleep(0.05)
    count = len(heard)
    time.sleep(0.1)
    assert len(heard) == count


def test_stop_gives_the_world_back(world: pv.World) -> None:
    session = Session(world)
    session.start()
    session.submit(Drag(pointer=1, x=0.0, y=0.5, reach=1.0))
    time.sleep(0.1)
    session.stop()
    session.stop()
    session.submit(Step())
    frames = world.frames
    time.sleep(0.1)
    assert world.frames == frames
    assert world.forces == []


def test_an_empty_world_can_be_watched(wait_until: WaitUntil) -> None:
    with Session(pv.World()) as session:
        session.submit(Drag(pointer=1, x=0.0, y=0.0, reach=1.0))
        wait_until(lambda: session.latest.status.frames > 3)
    assert session.latest.grid.shape == (0, 2)


@pytest.mark.parametrize(("name", "value"), [("dt", 0.0), ("dt", float("nan"))])
def test_bad_arguments_are_named(world: pv.World, name: str, value: float) -> None:
    with pytest.raises(pv.InputError, match=name):
        Session(world, **{name: value})  # type: ignore[arg-type]


def test_velocities_are_made_for_a_while_after_a_viewer_has_asked(world: pv.World) -> None:
    session = Session(world)
    first = session.latest
    session.take(replace(first, seq=2), velocity=True)
    session.take(replace(first, seq=3))  # another tab
    assert (session._taken, session._velocity_until) == (3, 2 + KEEN)
