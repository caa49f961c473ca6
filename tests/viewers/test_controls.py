"""What a viewer may change while a world runs, without any page: settings, circles, scenes, the pace."""

import threading
import time

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import scenes
from pyverlet.viewers import commands, controls
from pyverlet.viewers.commands import Build, Delete, Drag, Pause, Pin, Reset, SetFriction, SetGravity, SetSubsteps, Spawn, Step
from pyverlet.viewers.presentation import Presentation, Repertoire
from pyverlet.viewers.session import Session

from .sessions import after, nine_circles, wait_until


def a_scene(**overrides: object) -> Session:
    """One of the scene `cage`, in whose place another may be put."""
    repertoire = Repertoire(scenes.get("cage"), dt=1 / 60, overrides={"particles": 40, **overrides})
    return Session(repertoire.open())


def test_settings_reach_circles_and_walls(paused: Session, world: pv.World) -> None:
    status = after(paused, commands.SetRestitution(0.75), SetFriction(0.5), commands.SetIntegrator("rk4")).status
    assert (status.restitution, status.friction, status.integrator) == (0.75, 0.5, "rk4")
    assert world.collisions is not None
    assert isinstance(world.boundary, pv.Box)
    for each in (world.collisions, world.boundary):
        assert (each.restitution, each.friction) == (0.75, 0.5)
    assert isinstance(world.integrator, pv.RK4)


def test_a_world_without_collisions_and_walls_has_no_friction() -> None:
    nothing = controls.read(pv.World(collisions=None))
    assert (nothing["restitution"], nothing["friction"]) == (None, None)
    naive = pv.World(collisions=None, boundary=pv.ClampAndFlip(pv.Box((0, 0), (1, 1), restitution=0.25)))
    assert (controls.read(naive)["restitution"], controls.read(naive)["friction"]) == (0.25, None)
    controls.change(naive, commands.SetRestitution(0.5))
    controls.change(naive, SetFriction(0.5))
    assert controls.read(naive)["restitution"] == 0.5


def test_an_integrator_of_ones_own_has_its_own_name() -> None:
    class Mine(pv.PositionVerlet):
        pass

    world = pv.World(integrator=Mine())
    assert controls.read(world)["integrator"] == "mine"
    assert not any(isinstance(command, commands.SetIntegrator) for command in controls.present(world))


def test_a_pinned_circle_stays_until_it_is_let_go(paused: Session, world: pv.World) -> None:
    world.position[4, 1] = 5.0
    assert np.isinf(after(paused, Pin(1, 0.0, 5.0, 0.1)).shape.mass[4])
    after(paused, Step(30))
    assert world.position[4].tolist() == [0.0, 5.0]
    after(paused, Pin(1, 0.0, 5.0, 0.1), Step(30))
    assert world.mass[4] == 1.0
    assert world.position[4, 1] < 4.5


def test_pinning_nothing_changes_nothing(paused: Session, world: pv.World) -> None:
    shape = paused.latest.shape
    assert after(paused, Pin(1, 0.0, 15.0, 0.1), SetSubsteps(9)).shape is shape
    assert np.isfinite(world.mass).all()


def test_a_spawned_circle_is_like_the_others_and_none_comes_outside(paused: Session, world: pv.World) -> None:
    after(paused, Spawn(1, 0.0, 10.0), Spawn(1, 0.0, -10.0), Spawn(1, 0.25, 10.0))  # the last on top of the first: it grows
    assert world.radius[9:].tolist() == [0.5, 0.5]
    assert world.mass[9:].tolist() == [1.0, 1.0]
    after(paused, Step(60))
    assert world.position[9:, 1].max() < 10.0
    assert np.abs(world.velocity).max() < 15.0


def test_reset_takes_back_what_came_and_brings_back_what_went(paused: Session, world: pv.World) -> None:
    start = world.position.copy()  # they lie still: the start of the session is where they are
    shape = after(paused, Spawn(1, 0.0, 10.0), Delete(1, -8.0, 0.5, 0.1), Pin(1, 8.0, 0.5, 0.1)).shape
    assert shape.number.tolist() == list(range(1, 10))
    shape = after(paused, Step(5), Reset()).shape
    assert shape.number.tolist() == list(range(9))
    np.testing.assert_array_equal(world.position, start)
    assert shape.mass.tolist() == [1.0] * 9


def test_a_deleted_circle_leaves_the_others_alone(paused: Session, world: pv.World) -> None:
    after(paused, Delete(1, 0.0, 5.0, 0.1), Pin(1, 8.0, 0.5, 0.1), Drag(2, 6.0, 0.5, 0.1), Delete(1, 0.0, 0.5, 0.1))
    assert len(world) == 8  # where the first was asked for there was nobody
    assert 0.0 not in world.position[:, 0]
    after(paused, Pin(1, 8.0, 0.5, 0.1), Drag(2, 6.0, 5.0), Step(60))  # by another index now, and yet it weighs what it did
    assert world.position[6, 1] > 2.0
    assert world.mass.tolist() == [1.0] * 8


def test_the_dragged_circle_may_be_deleted(session: Session, world: pv.World) -> None:
    session.submit(Drag(2, 0.0, 0.5, 0.1))
    wait_until(lambda: len(world.forces) == 1)
    session.submit(Delete(1, 0.0, 0.5, 0.3))
    wait_until(lambda: session.latest.status.particles == 8)
    frames = session.latest.status.frames
    wait_until(lambda: session.latest.status.frames > frames + 5)
    assert session.latest.status.error is None


def test_colours_belong_to_their_circles(world: pv.World) -> None:
    colours = np.arange(27, dtype=np.uint8).reshape(9, 3)
    session = Session(Presentation("nine", pv.Panels.of(world), colours=colours))
    shape = after(session, Pause(True), Delete(1, -8.0, 0.5, 0.2), Spawn(1, 0.0, 10.0)).shape
    assert shape.number.tolist() == list(range(1, 10))
    assert shape.colours is not None
    assert shape.colours[:8].tolist() == colours[1:].tolist()
    assert len(set(shape.colours[8].tolist())) == 1  # grey


def test_obstacles_are_on_show_and_those_that_move_move(world: pv.World) -> None:
    world.obstacles.append(pv.Disc(center=(0, 10), radius=1))
    world.obstacles.append(pv.Segment((-5, 8), (-3, 8), velocity=(1, 0)))
    world.step(1 / 60)
    session = Session(world)
    before = after(session, Pause(True))
    ((disc, solid),) = before.shape.obstacles
    assert solid
    assert np.hypot(*(np.array(disc) - (0, 10)).T) == pytest.approx(1.0, abs=0.01)
    moved = after(session, Step(30))
    assert moved.shape is before.shape
    old, new = (np.array(frame.obstacles[0][0]) for frame in (before, moved))
    assert new - old == pytest.approx(np.broadcast_to((0.5, 0), old.shape), abs=1e-4)
    world.obstacles.pop(0)
    assert after(session, Step(1)).shape.obstacles == ()


def test_a_scene_that_grew_is_built_anew() -> None:
    session = a_scene()
    settings = (SetGravity(0.0, -3.0), SetFriction(0.25), SetSubsteps(3), commands.SetIntegrator("velocity-verlet"))
    assert after(session, Pause(True), *settings, Spawn(1, 0.0, 0.0)).status.particles == 41
    for count in (40, 60):
        status = after(session, Build(None, count)).status
        assert (status.particles, status.time, status.gravity) == (count, 0.0, (0.0, -3.0))
        assert (status.friction, status.substeps, status.integrator) == (0.25, 3, "velocity-verlet")


def test_another_scene_comes_with_its_own_settings() -> None:
    session = a_scene(restitution=0.9)
    first = session.latest.shape
    assert first.scene == "cage"
    assert dict(first.scenes)["box"] == scenes.get("box").summary
    frame = after(session, SetGravity(1.0, 0.0), Build("box", 50))
    assert (frame.shape.scene, frame.status.particles) == ("box", 50)
    assert (frame.status.restitution, frame.status.gravity) == (0.5, (0.0, -9.81))
    assert len(after(session, Build("bounce-order", None)).shape.panels) == 2
    frame = after(session, Build("cage", None))
    assert (frame.shape.scene, frame.status.particles, frame.status.restitution) == ("cage", 40, 0.9)


def test_the_way_to_a_scene_is_told() -> None:
    session = a_scene()
    seen: list[str | None] = []
    session.subscribe(lambda: seen.append(session.latest.status.busy))
    for count, command in ((4, Build("image", 4)), (5, Spawn(1, 0.0, 1.0))):
        frame = after(session, command, Step())
        assert (frame.shape.scene, frame.status.busy, frame.shape.parted) == ("image", None, True)
        assert frame.shape.colours is not None
        assert frame.shape.colours.shape == (count, 3)
    told = [text for text in seen if text]
    assert told[0] == "building image"
    assert any(text.endswith("%") for text in told)


def test_a_session_that_stops_does_not_wait_for_a_scene() -> None:
    session = a_scene()
    session.start()
    session.submit(Build("image", 3_000))  # minutes, were it not stopped
    wait_until(lambda: "%" in (session.latest.status.busy or ""))
    began = time.perf_counter()
    session.stop()
    assert time.perf_counter() - began < 5.0


def test_a_world_of_ones_own_has_no_other_scenes(paused: Session) -> None:
    assert paused.latest.shape.scenes == ()
    assert after(paused, Build("box", 10), SetSubsteps(5)).status.particles == 9


def test_slow_motion_is_the_same_run_shown_in_between(world: pv.World) -> None:
    """At a quarter of the speed a quarter of the frames pass, with the same bits, and pictures between them."""
    fast = nine_circles()
    for each in (world, fast):
        each.position[:, 1] = 10.0
    heights: list[float] = []
    session = Session(world)
    session.submit(commands.SetSpeed(0.25))
    session.subscribe(lambda: heights.append(float(session.latest.position[0, 1])))
    began = time.perf_counter()
    threading.Timer(1.0, session.stop).start()
    session.run()
    elapsed = time.perf_counter() - began
    assert session.latest.status.frames == world.frames
    assert 60 * 0.25 * elapsed - world.frames == pytest.approx(0.0, abs=4 + session.latest.status.dropped)
    assert len(set(heights)) > 2 * world.frames  # more places were shown than frames were made
    assert sorted(heights, reverse=True) == heights  # and it falls without jumping back
    for _ in range(world.frames):
        fast.step(1 / 60)
    assert fast.state_hash() == world.state_hash()


def test_a_command_the_world_refuses_is_told_and_reset_goes_on(paused: Session, world: pv.World) -> None:
    world.radius[:] = 30.0  # no circle like these fits the box
    assert "allowed" in str(after(paused, Spawn(1, 0.0, 1.0)).status.error)
    assert after(paused, Reset()).status.error is None
    assert world.radius.tolist() == [0.5] * 9
