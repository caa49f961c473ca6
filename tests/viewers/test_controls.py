"""What a viewer may change while a world runs, without any page: settings, circles, scenes, the pace."""

import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import scenes
from pyverlet.viewers import controls
from pyverlet.viewers.commands import (
    Build,
    Delete,
    Drag,
    Pause,
    Pin,
    Reset,
    SetFriction,
    SetGravity,
    SetIntegrator,
    SetRestitution,
    SetSpeed,
    SetSubsteps,
    Spawn,
    Step,
)
from pyverlet.viewers.presentation import Presentation, Repertoire
from pyverlet.viewers.session import Session

WaitUntil = Callable[[Callable[[], bool]], None]


def repertoire(scene: str = "cage", **overrides: object) -> Repertoire:
    return Repertoire(scenes.get(scene), dt=1 / 60, overrides={"particles": 40, **overrides})


def test_settings_reach_circles_and_walls(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    for command in (SetRestitution(0.75), SetFriction(0.5), SetIntegrator("rk4")):
        paused.submit(command)
    wait_until(lambda: paused.latest.status.integrator == "rk4")
    assert (paused.latest.status.restitution, paused.latest.status.friction) == (0.75, 0.5)
    assert world.collisions is not None
    assert (world.collisions.restitution, world.collisions.friction) == (0.75, 0.5)
    assert isinstance(world.boundary, pv.Box)
    assert (world.boundary.restitution, world.boundary.friction) == (0.75, 0.5)
    assert isinstance(world.integrator, pv.RK4)


def test_a_world_without_collisions_and_walls_has_no_friction(world: pv.World) -> None:
    nothing = controls.read(pv.World(collisions=None))
    assert nothing["restitution"] is None
    assert nothing["friction"] is None
    naive = pv.World(collisions=None, boundary=pv.ClampAndFlip(pv.Box((0, 0), (1, 1), restitution=0.25)))
    assert (controls.read(naive)["restitution"], controls.read(naive)["friction"]) == (0.25, None)
    controls.change(naive, SetRestitution(0.5))
    controls.change(naive, SetFriction(0.5))
    assert controls.read(naive)["restitution"] == 0.5


def test_an_integrator_of_ones_own_has_its_own_name() -> None:
    class Mine(pv.PositionVerlet):
        pass

    world = pv.World(integrator=Mine())
    assert controls.read(world)["integrator"] == "mine"
    assert not any(isinstance(command, SetIntegrator) for command in controls.present(world))


def test_a_pinned_circle_stays_until_it_is_let_go(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    world.position[4, 1] = 5.0
    paused.submit(Pin(1, 0.0, 5.0, 0.1))
    wait_until(lambda: bool(np.isinf(paused.latest.shape.mass[4])))
    paused.submit(Step(30))
    wait_until(lambda: paused.latest.status.frames >= 30)
    assert world.position[4].tolist() == [0.0, 5.0]
    paused.submit(Pin(1, 0.0, 5.0, 0.1))
    paused.submit(Step(30))
    wait_until(lambda: paused.latest.status.frames >= 60)
    assert world.mass[4] == 1.0
    assert world.position[4, 1] < 4.5


def test_pinning_nothing_changes_nothing(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    shape = paused.latest.shape
    paused.submit(Pin(1, 0.0, 15.0, 0.1))
    paused.submit(SetSubsteps(9))
    wait_until(lambda: paused.latest.status.substeps == 9)
    assert paused.latest.shape is shape
    assert np.isfinite(world.mass).all()


def test_a_spawned_circle_is_like_the_others_and_none_comes_outside(
    paused: Session, world: pv.World, wait_until: WaitUntil
) -> None:
    paused.submit(Spawn(1, 0.0, 10.0))
    paused.submit(Spawn(1, 0.0, -10.0))
    paused.submit(Spawn(1, 0.25, 10.0))  # on top of the first: it grows
    wait_until(lambda: paused.latest.status.particles == 11)
    assert world.radius[9:].tolist() == [0.5, 0.5]
    assert world.mass[9:].tolist() == [1.0, 1.0]
    paused.submit(Step(60))
    wait_until(lambda: paused.latest.status.frames >= 60)
    assert world.position[9:, 1].max() < 10.0
    assert np.abs(world.velocity).max() < 15.0


def test_reset_takes_back_what_came_and_brings_back_what_went(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    start = world.position.copy()  # they lie still: the start of the session is where they are
    paused.submit(Spawn(1, 0.0, 10.0))
    paused.submit(Delete(1, -8.0, 0.5, 0.1))
    paused.submit(Pin(1, 8.0, 0.5, 0.1))
    wait_until(lambda: paused.latest.shape.number.tolist() == list(range(1, 10)))
    paused.submit(Step(5))
    paused.submit(Reset())
    wait_until(lambda: paused.latest.shape.number.tolist() == list(range(9)))
    np.testing.assert_array_equal(world.position, start)
    assert paused.latest.shape.mass.tolist() == [1.0] * 9


def test_a_deleted_circle_leaves_the_others_alone(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    paused.submit(Delete(1, 0.0, 5.0, 0.1))  # nobody there
    paused.submit(Pin(1, 8.0, 0.5, 0.1))
    paused.submit(Drag(2, 6.0, 0.5, 0.1))
    paused.submit(Delete(1, 0.0, 0.5, 0.1))
    wait_until(lambda: paused.latest.status.particles == 8)
    assert 0.0 not in world.position[:, 0]
    paused.submit(Pin(1, 8.0, 0.5, 0.1))  # by another index now, and yet it weighs what it did
    paused.submit(Drag(2, 6.0, 5.0))
    paused.submit(Pause(False))
    wait_until(lambda: bool(world.position[6, 1] > 2.0))
    assert world.mass.tolist() == [1.0] * 8


def test_the_dragged_circle_may_be_deleted(session: Session, world: pv.World, wait_until: WaitUntil) -> None:
    session.submit(Drag(2, 0.0, 0.5, 0.1))
    wait_until(lambda: len(world.forces) == 1)
    session.submit(Delete(1, 0.0, 0.5, 0.3))
    wait_until(lambda: session.latest.status.particles == 8)
    frames = session.latest.status.frames
    wait_until(lambda: session.latest.status.frames > frames + 5)
    assert session.latest.status.error is None


def test_colours_belong_to_their_circles(wait_until: WaitUntil, world: pv.World) -> None:
    colours = np.arange(27, dtype=np.uint8).reshape(9, 3)
    with Session(Presentation("nine", pv.Panels.of(world), colours=colours)) as session:
        for command in (Pause(True), Delete(1, -8.0, 0.5, 0.2), Spawn(1, 0.0, 10.0)):
            session.submit(command)
        wait_until(lambda: session.latest.shape.number.tolist() == list(range(1, 10)))
        seen = session.latest.shape.colours
        assert seen is not None
        assert seen[:8].tolist() == colours[1:].tolist()
        assert len(set(seen[8].tolist())) == 1  # grey


def test_obstacles_are_on_show_and_those_that_move_move(wait_until: WaitUntil, world: pv.World) -> None:
    world.obstacles.append(pv.Disc(center=(0, 10), radius=1))
    world.obstacles.append(pv.Segment((-5, 8), (-3, 8), velocity=(1, 0)))
    world.step(1 / 60)
    with Session(world) as session:
        session.submit(Pause(True))
        wait_until(lambda: session.latest.status.paused)
        frame = session.latest
        ((disc, solid),) = frame.shape.obstacles
        assert solid
        assert np.hypot(*(np.array(disc) - (0, 10)).T) == pytest.approx(1.0, abs=0.01)
        before = np.array(frame.obstacles[0][0])
        session.submit(Step(30))
        wait_until(lambda: session.latest.status.frames >= frame.status.frames + 30)
        assert session.latest.shape is frame.shape
        after = np.array(session.latest.obstacles[0][0])
        assert after - before == pytest.approx(np.broadcast_to((0.5, 0), before.shape), abs=1e-4)
        world.obstacles.pop(0)
        session.submit(Step(1))
        wait_until(lambda: session.latest.shape is not frame.shape)
        assert session.latest.shape.obstacles == ()


def test_a_scene_that_grew_is_built_anew(wait_until: WaitUntil) -> None:
    plan = repertoire()
    with Session(plan.open()) as session:
        for command in (Pause(True), SetGravity(0.0, -3.0), SetFriction(0.25), SetSubsteps(3), SetIntegrator("velocity-verlet")):
            session.submit(command)
        session.submit(Spawn(1, 0.0, 0.0))
        wait_until(lambda: session.latest.status.particles == 41)
        for count in (40, 60):
            session.submit(Build(None, count))
            wait_until(lambda: session.latest.status.particles == count)  # noqa: B023
            status = session.latest.status
            assert (status.time, status.gravity) == (0.0, (0.0, -3.0))
            assert (status.friction, status.substeps, status.integrator) == (0.25, 3, "velocity-verlet")


def test_reset_of_a_scene_that_grew_takes_its_own_number(wait_until: WaitUntil) -> None:
    plan = repertoire()
    with Session(plan.open()) as session:
        session.submit(Pause(True))
        start = session.latest.position.copy()
        session.submit(Spawn(1, 0.0, 0.0))
        wait_until(lambda: session.latest.status.particles == 41)
        session.submit(Reset())
        wait_until(lambda: session.latest.status.particles == 40)
        np.testing.assert_array_equal(session.latest.position, start)


def test_another_scene_comes_with_its_own_settings(wait_until: WaitUntil) -> None:
    plan = repertoire(restitution=0.9)
    with Session(plan.open()) as session:
        first = session.latest.shape
        assert first.scene == "cage"
        assert dict(first.scenes)["box"] == scenes.get("box").summary
        session.submit(SetGravity(1.0, 0.0))
        session.submit(Build("box", 50))
        wait_until(lambda: session.latest.shape.scene == "box")
        status = session.latest.status
        assert (status.particles, status.restitution, status.gravity) == (50, 0.5, (0.0, -9.81))
        session.submit(Build("bounce-order", None))
        wait_until(lambda: len(session.latest.shape.panels) == 2)
        session.submit(Build("cage", None))
        wait_until(lambda: session.latest.shape.scene == "cage")
        assert (session.latest.status.particles, session.latest.status.restitution) == (40, 0.9)


def test_the_way_to_a_scene_is_told(wait_until: WaitUntil) -> None:
    plan = repertoire()
    seen: list[str | None] = []
    with Session(plan.open()) as session:
        session.subscribe(lambda: seen.append(session.latest.status.busy))
        session.submit(Build("image", 4))
        wait_until(lambda: session.latest.shape.scene == "image")
        wait_until(lambda: session.latest.status.frames > 2)
        assert session.latest.status.busy is None
        assert session.latest.shape.colours is not None
        assert session.latest.shape.colours.shape == (4, 3)
        assert session.latest.shape.parted
        session.submit(Spawn(1, 0.0, 1.0))
        wait_until(lambda: session.latest.status.particles == 5)
        assert session.latest.shape.colours.shape == (5, 3)
    told = [text for text in seen if text]
    assert told[0] == "building image"
    assert any(text.endswith("%") for text in told)


def test_a_session_that_stops_does_not_wait_for_a_scene(wait_until: WaitUntil) -> None:
    plan = repertoire()
    session = Session(plan.open())
    session.start()
    session.submit(Build("image", 3_000))  # minutes, were it not stopped
    wait_until(lambda: "%" in (session.latest.status.busy or ""))
    began = time.perf_counter()
    session.stop()
    assert time.perf_counter() - began < 5.0


def test_a_world_of_ones_own_has_no_other_scenes(paused: Session, wait_until: WaitUntil) -> None:
    assert paused.latest.shape.scenes == ()
    paused.submit(Build("box", 10))
    paused.submit(SetSubsteps(5))
    wait_until(lambda: paused.latest.status.substeps == 5)
    assert paused.latest.status.particles == 9


def test_slow_motion_is_the_same_run_shown_in_between(world: pv.World, wait_until: WaitUntil) -> None:
    """At a quarter of the speed a quarter of the frames pass, with the same bits, and pictures between them."""
    fast = pv.World(boundary=pv.Box((-10, 0), (10, 20)), substeps=4)
    fast.add(position=np.column_stack((np.arange(-8.0, 9.0, 2.0), np.full(9, 0.5))), radius=0.5)
    for each in (world, fast):
        each.position[:, 1] = 10.0
    heights: list[float] = []
    session = Session(world)
    session.submit(SetSpeed(0.25))
    session.subscribe(lambda: heights.append(float(session.latest.position[0, 1])))
    began = time.perf_counter()
    timer = threading.Timer(1.0, session.stop)
    timer.start()
    session.run()
    elapsed = time.perf_counter() - began
    assert session.latest.status.frames == world.frames
    assert 60 * 0.25 * elapsed - world.frames == pytest.approx(0.0, abs=4 + session.latest.status.dropped)
    assert len(set(heights)) > 2 * world.frames  # more places were shown than frames were made
    assert sorted(heights, reverse=True) == heights  # and it falls without jumping back
    for _ in range(world.frames):
        fast.step(1 / 60)
    assert fast.state_hash() == world.state_hash()


def test_a_command_the_world_refuses_is_told_and_reset_goes_on(paused: Session, world: pv.World, wait_until: WaitUntil) -> None:
    world.radius[:] = 30.0  # no circle like these fits the box
    paused.submit(Spawn(1, 0.0, 1.0))
    wait_until(lambda: paused.latest.status.error is not None)
    assert "allowed" in str(paused.latest.status.error)
    paused.submit(Reset())
    wait_until(lambda: paused.latest.status.error is None)
    assert world.radius.tolist() == [0.5] * 9
