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
from pyverlet.state.sorted_state import SortedState
from pyverlet.viewers.commands import Command, Drag, Pause, Poke, Release, Reset, SetGravity, SetSubsteps, Step
from pyverlet.viewers.pointers import LEASH
from pyverlet.viewers.session import VELOCITY_FRAMES, Session

from .sessions import Treacle, after, wait_until


def test_runs_in_real_time(session: Session) -> None:
    before, began = session.latest.status.time, time.perf_counter()
    time.sleep(0.7)
    simulated = session.latest.status.time - before + session.latest.status.dropped / 60
    assert simulated == pytest.approx(time.perf_counter() - began, abs=0.12)


def test_time_until_it_goes_on_is_not_caught_up_with(paused: Session) -> None:
    """Paused for 0.2 s since the last turn: nothing of that is due, whenever the next turn looks."""
    time.sleep(0.2)
    began = time.perf_counter()
    status = after(paused, Pause(False)).status
    assert status.frames + status.dropped <= 60 * (time.perf_counter() - began) + 1


def test_step_pauses_and_advances_by_exactly_the_frames_asked(world: pv.World) -> None:
    session = Session(world)
    for frames, step in ((3, Step(3)), (4, Step()), (9, Step(5))):
        status = after(session, step).status
        assert (status.paused, status.frames) == (True, frames)
        assert status.time == pytest.approx(frames / 60)


def test_reset_goes_back_to_the_bits_of_the_start(world: pv.World) -> None:
    world.velocity[:, 1] = 5.0
    world.run(seconds=0.1)  # the start of the session is not the start of the world
    start, start_time, session = world.state_hash(), world.time, Session(world)
    assert after(session, Step(5)).status.time > start_time
    status = after(session, Reset()).status
    assert (world.state_hash(), status.time, status.paused) == (start, start_time, True)


def test_gravity_and_substeps_reach_the_world_and_survive_reset(paused: Session, world: pv.World) -> None:
    assert after(paused, SetGravity(1.0, 2.5), SetSubsteps(3)).status.gravity == (1.0, 2.5)
    assert (world.gravity, world.substeps) == ((1.0, 2.5), 3)
    assert after(paused, Step(3), Reset()).status.time == 0.0
    assert (world.gravity, world.substeps) == ((1.0, 2.5), 3)
    assert after(paused, Step(10)).position[:, 1].min() > 0.5  # they fall upward now


@pytest.fixture
def callers(world: pv.World, monkeypatch: pytest.MonkeyPatch) -> set[threading.Thread]:
    """The threads that have stepped the world."""
    found, step = set(), world.step

    def spy(dt: float) -> None:
        found.add(threading.current_thread())
        step(dt)

    monkeypatch.setattr(world, "step", spy)
    return found


def test_one_thread_and_no_other_steps_the_world(world: pv.World, callers: set[threading.Thread]) -> None:
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


def poison(state: SortedState) -> None:
    state.force[:] = np.nan


def fail(state: SortedState) -> None:
    raise KeyError("wind")


@pytest.mark.parametrize(("wrong", "said", "logged"), [(poison, "non-finite", False), (fail, "KeyError: 'wind'", True)])
def test_an_error_stops_the_stepping_is_told_and_reset_cures_it(
    session: Session,
    world: pv.World,
    caplog: pytest.LogCaptureFixture,
    wrong: Callable[[SortedState], None],
    said: str,
    logged: bool,
) -> None:
    class Wrong:
        velocity_dependent = False

        def apply(self, state: SortedState, t: float) -> None:
            wrong(state)

    wait_until(lambda: session.latest.status.frames > 3)
    world.forces.append(Wrong())
    wait_until(lambda: session.latest.status.error is not None)
    assert said in str(session.latest.status.error)
    assert ("Traceback" in caplog.text) is logged  # of what a user's code raises
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


def test_a_slow_world_drops_frames_counts_them_and_still_publishes_each_step(
    world: pv.World, monkeypatch: pytest.MonkeyPatch
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


def falling(*forces: Any, **options: Any) -> pv.World:
    world = pv.World(collisions=None, **options)
    world.add(position=np.column_stack((np.arange(12.0)[::-1], np.full(12, 20.0))), radius=0.3)
    world.forces.extend(forces)
    return world


@pytest.mark.parametrize("velocity", [True, False])
def test_a_slow_world_is_seen_between_its_substeps_if_somebody_asks(velocity: bool) -> None:
    watched, alone = falling(Treacle()), falling()
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


def test_a_slow_world_keeps_the_pace_it_tells_and_unasked_makes_a_picture_a_frame() -> None:
    world = falling(Treacle())
    session = Session(world)
    seen: list[float] = []
    session.subscribe(lambda: seen.append(session.latest.status.time))
    with session:
        wait_until(lambda: world.frames > 6)
        pace, slow = session.latest.status.pace, session.latest.status.physics_median_ms
        assert len(seen) <= world.frames + 1  # the last is on its way
        # A frame of 1/60 s each `slow` ms and a little more.
        assert pace is not None
        assert 0.3 * (1000 / 60) / slow < pace < 1.1 * (1000 / 60) / slow
        session.submit(Pause(True))
        wait_until(lambda: session.latest.status.paused)
        assert session.latest.status.pace is None


class Diary(Treacle):
    """Treacle that writes down in which frame it was asked, which gravity there was, and where the first poke was."""

    def __init__(self, **options: Any) -> None:
        super().__init__()
        self.world = falling(self, **options)
        self.gravity: list[tuple[int, float]] = []
        self.pokes: list[tuple[int, float]] = []

    def apply(self, state: SortedState, t: float) -> None:
        super().apply(state, t)
        self.gravity.append((self.world.frames, self.world.gravity[1]))
        self.pokes += [(self.world.frames, force.center[0]) for force in self.world.forces if isinstance(force, Push)]


def ask_between_substeps(session: Session, diary: Diary, commands: list[Command], *, poked: bool = False) -> int:
    """Submit these when a picture between two substeps comes, and wait for some frames; the number of the frame then."""
    asked: list[int] = []

    def ask() -> None:
        frame = session.latest
        session.take(frame)
        if not asked and bool(diary.pokes) >= poked and 0.01 < frame.status.time * 60 - frame.status.frames < 0.6:
            asked.append(diary.world.frames)
            for command in commands:
                session.submit(command)

    session.subscribe(ask)
    with session:
        wait_until(lambda: bool(asked) and diary.world.frames > asked[0] + 2)
    return asked[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("commands", "ledger", "at_once"),
    [
        ([SetGravity(0, 5)], False, True),
        ([SetGravity(0, 5)], True, False),  # which measures heights by what gravity was
        ([SetSubsteps(7), SetGravity(0, 5)], False, False),  # in the order asked
    ],
)
def test_a_slow_world_takes_another_gravity_between_substeps(commands: list[Command], ledger: bool, at_once: bool) -> None:
    diary = Diary(ledger=ledger)
    session = Session(diary.world)
    asked = ask_between_substeps(session, diary, commands)
    after = [frame for frame, gravity in diary.gravity if gravity == 5]
    assert after[0] == asked + (not at_once)
    assert session.latest.status.gravity == (0.0, 5.0)
    order = [gravity for _, gravity in diary.gravity]
    assert order == sorted(order)  # once changed it stays


def test_a_hand_that_is_down_in_a_slow_world_moves_between_substeps() -> None:
    diary = Diary()
    session = Session(diary.world)
    session.submit(Poke(pointer=1, x=3.0, y=0.0))
    asked = ask_between_substeps(session, diary, [Poke(pointer=1, x=7.0, y=0.0)], poked=True)
    places = [x for _, x in diary.pokes]
    assert places == sorted(places)
    assert next(frame for frame, x in diary.pokes if x == 7.0) == asked  # in the midst of it
    assert (asked, 3.0) in diary.pokes


def test_two_hands_hold_two_circles_and_one_that_missed_none(paused: Session, world: pv.World) -> None:
    after(paused, Drag(pointer=1, x=2.0, y=5.0, reach=0.3), Drag(pointer=1, x=2.0, y=0.5, reach=0.3))
    assert world.forces == []
    after(paused, Release(pointer=1))
    after(paused, Drag(pointer=1, x=-8.0, y=0.5, reach=0.1), Drag(pointer=2, x=8.0, y=0.5, reach=0.1))
    assert sorted(force.particle for force in world.forces if isinstance(force, pv.forces.Grip)) == [0, 8]
    after(paused, Release(pointer=1), Release(pointer=3))  # which never held anything
    assert len(world.forces) == 1


def test_the_grip_is_leashed(paused: Session, world: pv.World) -> None:
    x0, y0, x1, y1 = after(paused, Drag(pointer=1, x=0.0, y=0.5, reach=0.1), Drag(pointer=1, x=0.0, y=19.0), Step()).view
    (grip,) = world.forces
    assert isinstance(grip, pv.forces.Grip)
    assert grip.target[1] - 0.5 == pytest.approx(LEASH * max(x1 - x0, y1 - y0), rel=1e-3)


def test_poke_pushes_everything_near_away(paused: Session, world: pv.World) -> None:
    start = paused.latest.position
    position = after(paused, Poke(pointer=1, x=1.0, y=0.5), Step(20)).position  # between particles 4 and 5
    assert position[5, 0] - position[4, 0] > 2.5
    position = after(paused, Release(pointer=1)).position
    assert world.forces == []
    np.testing.assert_allclose(position[[0, 8]], start[[0, 8]], atol=0.2)


def test_frames_are_immutable_and_numbered(session: Session) -> None:
    frame = session.latest
    kept = frame.position.copy()
    wait_until(lambda: session.latest.seq >= frame.seq + 5)
    np.testing.assert_array_equal(frame.position, kept)
    with pytest.raises(ValueError, match="read-only"):
        frame.position[0] = 0.0
    assert session.latest.shape is frame.shape


def test_unsubscribed_listeners_hear_nothing(paused: Session) -> None:
    heard: list[int] = []
    unsubscribe = paused.subscribe(lambda: heard.append(paused.latest.seq))
    seq = after(paused, Step()).seq
    unsubscribe()
    after(paused, Step())
    assert heard == [seq]


def test_stop_gives_the_world_back(world: pv.World) -> None:
    session = Session(world)
    session.start()
    session.submit(Drag(pointer=1, x=0.0, y=0.5, reach=1.0))
    wait_until(lambda: world.forces != [])
    session.stop()
    session.stop()
    session.submit(Step())
    frames = world.frames
    time.sleep(0.1)
    assert (world.frames, world.forces) == (frames, [])


def test_an_empty_world_can_be_watched() -> None:
    assert after(Session(pv.World()), Drag(pointer=1, x=0.0, y=0.0, reach=1.0), Step(3)).grid.shape == (0, 2)


def test_velocities_are_made_for_a_while_after_a_viewer_has_asked(world: pv.World) -> None:
    session = Session(world)
    first = session.latest
    session.take(replace(first, seq=2), velocity=True)
    session.take(replace(first, seq=3))  # another tab
    assert (session._taken, session._velocity_until) == (3, 2 + VELOCITY_FRAMES)
