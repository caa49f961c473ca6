"""The words on the wire: what is understood, what is refused, what a frame looks like in bytes."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers import commands
from pyverlet.viewers.commands import COLOURINGS, Ack, ViewOptions
from pyverlet.viewers.frames import GRID_MAX, PICTURE_S, Camera, Frame, FramePacing, outline, quantise
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.protocol import MAX_MESSAGE, decode, encode_frame, encode_refusal, encode_shape
from pyverlet.viewers.renderer import JpegRenderer
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_state import ViewState

from .sessions import LOOK, unpack


def said(kind: str, **fields: Any) -> str:
    """A message of a page; of its look what these do not say is as in LOOK."""
    return json.dumps({**(LOOK if kind == "look" else {}), "type": kind, **fields})


def head_of(data: bytes) -> dict[str, Any]:
    return unpack(data)[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (said("ack", seq=12), Ack(12)), (said("pause", on=True), commands.Pause(True)), (said("step"), commands.Step(1)),
        (said("reset"), commands.Reset()), (said("gravity", x=0, y=-9.81), commands.SetGravity(0.0, -9.81)),
        (said("substeps", value=8), commands.SetSubsteps(8)),
        (said("drag", x=1, y=2, reach=0.5), commands.Drag(7, 1.0, 2.0, 0.5)),
        (said("poke", x=1, y=2), commands.Poke(7, 1.0, 2.0)), (said("speed", value=0.25), commands.SetSpeed(0.25)),
        (said("build", scene="box"), commands.Build("box", None)),
        (said("build", scene=None, particles=70), commands.Build(None, 70)),
        (said("restitution", value=0.5), commands.SetRestitution(0.5)), (said("friction", value=1), commands.SetFriction(1.0)),
        (said("integrator", value="rk4"), commands.SetIntegrator("rk4")),
        (said("pin", x=1, y=2, reach=0.5), commands.Pin(7, 1.0, 2.0, 0.5)),
        (said("spawn", x=1, y=2), commands.Spawn(7, 1.0, 2.0)),
        (said("delete", x=1, y=2, reach=0), commands.Delete(7, 1.0, 2.0, 0.0)),
        (said("look", part=[0, 0, 4, 3]), ViewOptions((0.0, 0.0, 4.0, 3.0), 400, 300, "order", True, False)),
        (said("look", velocity=True, dark=False, colour="speed"), ViewOptions(None, 400, 300, "speed", False, True)),
        (said("release", pointer=3), commands.Release(7)),  # a tab has its own pointer and no other
    ],
)  # fmt: skip
def test_understood(text: str, expected: object) -> None:
    assert decode(text, pointer=7) == expected


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "JSON"), ("{", "JSON"), ("[" * 4000, "JSON"), ("[]", "object"), ("null", "object"), ('"step"', "object"),
        ("{}", "type"), ('{"type": 1}', "type"), ('{"type": ["step"]}', "type"), (said("explode"), "explode"),
        (said("ack"), "seq"), (said("ack", seq=1.5), "seq"), (said("ack", seq=True), "seq"), (said("pause", on=1), "on"),
        (said("gravity", x=0), "y is None"), (said("gravity", x=0, y="down"), "y"),
        (said("gravity", x=0, y=math.nan), "gravity y"), (said("gravity", x=-math.inf, y=0), "gravity x"),
        (said("gravity", x=0, y=1e6), "gravity y"), (said("gravity", x=0, y=10**400), "y"),
        (said("substeps", value=0), "substeps"), (said("substeps", value=100000), "substeps"),
        (said("substeps", value=2.0), "value"), ('{"type": "drag", "x": 1e999, "y": 0, "reach": 1}', "x"),
        (said("poke", x=0), "y"), (said("speed", value=0), "speed"), (said("build", scene="nowhere"), "scene"),
        (said("build", scene=3), "scene"), (said("build", particles=100000000), "particles"),
        (said("restitution", value=1.5), "restitution"), (said("friction", value=-1), "friction"),
        (said("integrator", value="magic"), "integrator"), (said("integrator"), "value"), (said("pin", x=1, y=2), "reach"),
        ('{"type": "spawn", "x": 1e999, "y": 2}', "x"), (said("look", part=[0, 0, 4]), "part"), (said("look", part=7), "part"),
        (said("look", part=[0, 0, "a", 3]), "part"), (said("look", part=[0, 0, 1e30, 3]), "part"),
        (said("look", part=[0, 0, 0, 3]), "part"), (said("look", width=0), "width"), (said("look", height=1e9), "height"),
        (said("look", colour="pink"), "colour"), (said("step", pad="x" * MAX_MESSAGE), "characters"),
    ],
)  # fmt: skip
def test_refused_in_one_short_sentence(text: str, named: str) -> None:
    with pytest.raises(pv.InputError, match=named) as refusal:
        decode(text, pointer=0)
    assert len(str(refusal.value)) < 400  # the scenes are all named
    assert "allowed" in str(refusal.value)


def test_how_circles_have_turned(world: pv.World) -> None:
    assert "turned" not in head_of(encode_frame(Session(world).latest))
    world.angle[:] = np.linspace(-1, 7, 9) * np.pi
    frame = Session(world).latest
    for velocity in (False, True):
        head, body = unpack(encode_frame(frame, velocity=velocity))
        assert head["turned"]
        turned = np.frombuffer(body, np.uint8)[-9:] * (np.pi / 128)
        off = np.remainder(turned - world.angle + np.pi, 2 * np.pi) - np.pi
        assert np.abs(off).max() <= np.pi / 256 + 1e-9


def test_a_frame_in_bytes(world: pv.World) -> None:
    frame = Session(world).latest
    head, body = unpack(encode_frame(frame))
    assert (head["kind"], head["seq"]) == ("frame", frame.seq)
    assert (head["status"]["particles"], head["status"]["gravity"]) == (9, [0.0, -9.81])
    grid = np.frombuffer(body, dtype="<u2").reshape(-1, 2)
    x0, y0, x1, y1 = head["view"]
    back = grid / 65535.0 * (x1 - x0, y1 - y0) + (x0, y0)
    np.testing.assert_allclose(back, world.position, atol=(x1 - x0) / 65535)


def test_a_shape_in_bytes(world: pv.World) -> None:
    head, body = unpack(encode_shape(Session(world, title="nine").latest.shape))
    assert (head["kind"], head["title"], head["bounded"]) == ("shape", "nine", True)
    assert head["outlines"] == [[[-10, 0], [10, 0], [10, 20], [-10, 20]]]
    radius, mass = np.frombuffer(body[:72], dtype="<f4").reshape(2, -1)
    assert np.frombuffer(body[72:], dtype="<u4").tolist() == list(range(9))
    assert (radius.tolist(), mass.tolist()) == ([0.5] * 9, [1.0] * 9)


def test_who_collides_with_whom_follows_in_the_shape(world: pv.World) -> None:
    plain = Session(world).latest.shape
    assert (plain.kinds, len(plain.apart)) == (None, 0)
    world.category[2], world.mask[3] = 8, 0xFFFFFFF7
    world.links.append(pv.Stick(world.add(position=[(0, 5), (3, 5)]), 0, 1, collide=False))
    head, body = unpack(encode_shape(Session(world).latest.shape))
    assert (head["kinds"], head["apart"]) == (True, 1)
    count, words = 11, np.frombuffer(body, np.uint32)
    assert words[3 * count : 3 * count + 2].tolist() == [9, 10]
    assert words[3 * count + 2 :].reshape(count, 2)[2:4].tolist() == [[8, 0xFFFFFFFF], [1, 0xFFFFFFF7]]
    world.collisions = None
    nobody = Session(world).latest.shape.kinds
    assert nobody is not None
    assert not nobody.any()


def test_a_link_that_goes_changes_the_shape(world: pv.World) -> None:
    stick = pv.Stick(world.add(position=[(0, 5), (3, 5)]), 0, 1, collide=False)
    world.links.append(stick)
    view_state = ViewState(Presentation.of(world, "nine"))
    before = view_state.version
    assert view_state.version == before
    world.links.remove(stick)
    assert view_state.version != before
    assert len(view_state.shape().apart) == 0


def test_own_colours_follow_in_the_shape(world: pv.World) -> None:
    colours = np.arange(27, dtype=np.uint8).reshape(9, 3)
    shape = Session(Presentation("nine", pv.Panels.of(world), colours=colours)).latest.shape
    head, body = unpack(encode_shape(shape))
    assert head["coloured"]
    assert body[108:] == bytes(range(27))


def test_velocities_travel_if_wanted(world: pv.World) -> None:
    world.velocity[:] = [(0.5 * k, -k) for k in range(9)]
    head, body = unpack(encode_frame(Session(world).latest, velocity=True))
    back = np.frombuffer(body, dtype="<i2").reshape(2, -1, 2)[1] * head["unit"]
    np.testing.assert_allclose(back, world.velocity, atol=8 / 32767)


def test_links_travel_with_their_strain(world: pv.World) -> None:
    group = world.add(position=[(0, 2), (1, 2), (2, 2)], radius=0.1)
    world.links.append(pv.Stick(group, [0, 1], [1, 2]))
    head, body = unpack(encode_frame(Session(world).latest, velocity=True))
    assert head["links"] == 2
    circles = len(world) * 8
    assert np.frombuffer(body[circles : circles + 16], "<u4").reshape(2, 2).tolist() == [[9, 10], [10, 11]]
    assert body[circles + 16 :] == bytes(2)  # nothing pulls yet
    force = np.array([0, -2, 1, 30], np.float32)
    frame = replace(Session(pv.World()).latest, joined=np.zeros((4, 2), np.uint32), force=force)
    # 255 stands for three times the mean of |force|, 8.25 N.
    assert frame.strain.tolist() == [0, int(2 * 255 / 24.75), int(255 / 24.75), 255]


def test_a_tab_may_look_at_a_part(world: pv.World) -> None:
    part = (-1.0, 0.0, 1.0, 1.0)
    head, body = unpack(encode_frame(Session(world).latest, part))
    assert head["view"] == [-1, 0, 1, 1]
    assert head["room"][0] < -10
    grid = np.frombuffer(body, dtype="<u2").reshape(-1, 2)
    assert grid[4].tolist() == [32768, 32768]  # the middle one, at (0, 0.5)
    assert set(grid[[0, 8], 0].tolist()) == {0, 65535}


def test_numbers_json_does_not_have_become_null(world: pv.World) -> None:
    frame = Session(world).latest
    status = replace(frame.status, kinetic=math.inf, energy=math.nan)
    head = head_of(encode_frame(replace(frame, status=status)))
    assert (head["status"]["kinetic"], head["status"]["energy"]) == (None, None)


def test_a_refusal_in_bytes() -> None:
    head, body = unpack(encode_refusal("no"))
    assert (head, body) == ({"kind": "refused", "reason": "no"}, b"")


# ---- Frames: the 16-bit grid, the part of the plane on show, the lines of the bounds ----


VIEW = (-47.0, -47.0, 47.0, 47.0)


def test_what_is_outside_is_clipped_and_does_not_wrap() -> None:
    position = np.array([[-48, 0], [48, 0], [0, -1e9], [0, 1e30], [np.inf, np.nan]], dtype=np.float32)
    grid = quantise(position, VIEW)
    middle = GRID_MAX // 2 + 1
    assert grid.tolist() == [[0, middle], [GRID_MAX, middle], [middle, 0], [middle, GRID_MAX], [GRID_MAX, 0]]


def test_the_grid_is_what_numpy_makes_of_it() -> None:
    position = np.random.default_rng(2).uniform(-60, 60, (10_000, 2)).astype(np.float32)
    scale = np.float32(GRID_MAX / 94.0)
    plain = np.clip((position - np.float32(-47.0)) * scale + np.float32(0.5), 0, GRID_MAX).astype(np.uint16)
    assert (quantise(position, VIEW) == plain).all()


def test_the_frame_shows_all_of_the_bounds() -> None:
    world = pv.World(boundary=pv.Circle(center=(3, 4), radius=10))
    x0, y0, x1, y1 = Camera(world).view(world.position)
    assert x0 < -7 < 13 < x1
    assert y0 < -6 < 14 < y1
    assert x1 - x0 == pytest.approx(y1 - y0)


def test_without_bounds_the_view_follows_and_only_grows() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=[(-1.0, 10.0), (1.0, 10.0)], radius=0.5)
    camera = Camera(world)
    first = camera.view(world.position)
    world.run(seconds=2.0)
    later = camera.view(world.position)
    assert later[1] < group.position[:, 1].min() < later[3]
    assert later[3] - later[1] == pytest.approx(first[3] - first[1])
    group.position[:] = [(-40.0, 0.0), (40.0, 0.0)]
    wide = camera.view(world.position)
    assert wide[0] < -40 < 40 < wide[2]


def test_a_runaway_neither_shrinks_the_others_to_dust_nor_takes_the_view_along() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=[(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)], radius=0.5)
    camera = Camera(world)
    first = camera.view(world.position)
    group.position[2, 0] = 1e7
    for _ in range(100):
        view = camera.view(world.position)
    assert view[2] - view[0] <= 8.001 * (first[2] - first[0])
    assert view[0] < -1 < 0 < view[2]


def test_outlines() -> None:
    (circle,) = outline(pv.Circle(center=(1, 2), radius=5))
    np.testing.assert_allclose(np.hypot(*(np.array(circle) - (1, 2)).T), 5.0)
    assert outline(pv.Box((0, 0), (3, 2))) == (((0, 0), (3, 0), (3, 2), (0, 2)),)
    assert outline(pv.Open()) == ()


# ---- When pictures of slow worlds are due ----


def made(pacing: FramePacing, ends: list[float]) -> list[float]:
    """Which of these times, the ends of substeps, have a picture."""
    shown = []
    for end in ends:
        if pacing.due(end):
            pacing.made(end)
            shown.append(end)
    return shown


@pytest.mark.parametrize("substep_ms", [0.4, 5.6, 6.0, 8.0, 9.5, 12.0, 16.0])
def test_a_world_of_short_substeps_has_as_many_pictures_as_a_screen(substep_ms: float) -> None:
    shown = made(FramePacing(), [1.0 + k * substep_ms / 1000 for k in range(round(10_000 / substep_ms))])
    assert len(shown) == pytest.approx(600, abs=2)
    gaps = [b - a for a, b in pairwise(shown[1:])]
    assert max(gaps) < PICTURE_S + substep_ms / 1000 + 1e-9
    assert min(gaps) > PICTURE_S - substep_ms / 1000 - 1e-9


def test_a_world_of_long_substeps_has_one_after_each() -> None:
    ends = [0.03 * k for k in range(1, 100)]
    assert made(FramePacing(), ends) == ends


def test_of_what_was_missed_one_is_made_up_for() -> None:
    pacing = FramePacing()
    assert made(pacing, [1.0, 3.0, 3.001, 3.002, 3.003, 3.0167]) == [1.0, 3.0, 3.001, 3.0167]


# ---- Pictures of frames whose rows stand in the engine's order ----


@pytest.fixture
def frame() -> Frame:
    """Forty circles apart from each other, of uneven sizes and masses and in two groups, that move."""
    world = pv.World(boundary=pv.Box((-10, 0), (10, 20)))
    rng = np.random.default_rng(1)
    place = np.stack(np.meshgrid(np.arange(8.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    for part in (slice(0, 25), slice(25, 40)):
        count = len(place[part])
        group = world.add(position=place[part] + (-4, 3), radius=rng.uniform(0.2, 0.4, count), mass=rng.uniform(1, 9, count))
        group.velocity[:] = rng.normal(0, 3, (count, 2))
    return Session(world).latest


def shuffled(frame: Frame, seed: int) -> Frame:
    """The same, as it would come from between two substeps."""
    order = np.random.default_rng(seed).permutation(len(frame.rows)).astype(np.int32)
    rows, moving = frame.rows[order], frame.moving[order]
    return replace(frame, seq=frame.seq + seed, rows=rows, moving=moving, order=order, moving_order=order)


def test_the_users_order_comes_back(frame: Frame) -> None:
    other = shuffled(frame, 1)
    assert (other.rows != frame.rows).any()
    assert (other.position == frame.position).all()
    assert (other.velocity == frame.velocity).all()
    assert (other.grid == frame.grid).all()
    with pytest.raises(ValueError, match="read-only"):
        other.position[0] = 0.0


@pytest.mark.parametrize("colour", COLOURINGS)
def test_rows_in_any_order_give_the_same_picture(frame: Frame, colour: str) -> None:
    options = ViewOptions(width=300, height=300, colour=colour)
    renderer = JpegRenderer()
    expected = renderer.jpeg(frame, options)
    for seed in (1, 2, 2):
        assert renderer.jpeg(shuffled(frame, seed), options) == expected
    renderer.thread.shutdown()


def test_one_artist_serves_looks_of_different_colours_in_turn(frame: Frame) -> None:
    renderer, other = JpegRenderer(), shuffled(frame, 3)
    views = [ViewOptions(width=200, height=200, colour=colour) for colour in ("order", "mass", "speed")]
    expected = [JpegRenderer().jpeg(frame, options) for options in views]
    assert len(set(expected)) == 3
    assert [renderer.jpeg(other, options) for options in views + views[::-1]] == expected + expected[::-1]
