"""Substeps of one call into the core give the bits of a call each, whatever happens between the frames."""

import copy
import functools
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, each_frame

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME
from pyverlet.state.group import Group
from pyverlet.world import plain
from pyverlet.world import world as module

ROOMS = {
    "cage": lambda: pv.Circle(radius=8), "bouncy cage": lambda: pv.Circle(center=(1, 0), radius=8, restitution=0.7),
    "box": lambda: pv.Box((-6, -7), (6, 7)),
    "rubbing box": lambda: pv.Box((-6, -7), (6, 7), restitution=0.5, friction=0.5), "open": pv.Open,
}  # fmt: skip


def pour(count: int = 40, **options: Any) -> pv.World:
    made = pv.World(**options)
    random = np.random.default_rng(5)
    place = np.stack(np.meshgrid(np.arange(-3, 4), np.arange(-3, 4)), axis=-1).reshape(-1, 2)[:count] * 1.3
    group = made.add(position=place + 0.1 * random.random(place.shape), radius=random.uniform(0.3, 0.5, len(place)))
    group.velocity[:] = random.normal(0, 3, place.shape)
    return made


def told(w: pv.World) -> list[Any]:
    """All that a frame leaves behind, as bytes."""
    arrays = [array.tobytes() for _, array in w._state.arrays()]
    return [w.time, w.frames, w.profile.frames, *arrays, w._sorted.wall_hits.tobytes(), w.energy()]


def observe(w: pv.World) -> None:
    """A call for each substep: somebody looks at the world between them."""

    def look(snapshot: Any) -> None:
        snapshot.look()

    w.observer = look


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Do the same to three worlds: one as it is, one whose frames are never plain, one that is observed; compare every frame."""
    never, real = list[pv.World](), plain.plain_frames
    monkeypatch.setattr(module, "plain_frames", lambda world, dt: None if any(world is w for w in never) else real(world, dt))

    def compare(make: Any, frames: int, meanwhile: Any = lambda w, frame: None) -> None:
        one, other, observed = make(), make(), make()
        never.append(other)
        observe(observed)
        for frame in range(frames):
            for w in (one, other, observed):
                meanwhile(w, frame)
                w.step(1 / 60)
            assert told(one) == told(other) == told(observed), frame
            mine = one.save().impulses
            for theirs in (other.save().impulses, observed.save().impulses):
                assert mine.skin == theirs.skin
                assert np.array_equal(mine.values, theirs.values)

    return compare


@pytest.mark.parametrize(
    ("room", "integrator"),
    [
        *(("cage", name) for name in BY_NAME),
        *((room, name) for room in ROOMS if room != "cage" for name in ("position-verlet", "rk4")),
    ],
)
def test_any_integrator_in_any_room(room: str, integrator: str, both: Any) -> None:
    both(lambda: pour(boundary=ROOMS[room](), integrator=BY_NAME[integrator]()), 60)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "options",
    [
        *({"collisions": law} for law in (None, pv.Collisions(), pv.Collisions(friction=0.3), pv.Collisions(restitution=0.5))),
        *({"sleep": True}, {"events": True, "ledger": True}, {"threads": 1}),
    ],
    ids=str,
)
def test_any_contacts(dtype: Any, options: dict[str, Any], both: Any) -> None:
    both(lambda: pour(boundary=ROOMS["cage"](), dtype=dtype, **options), 60)


def test_friction_comes_among_circles_that_bounce_and_carry_weight(both: Any) -> None:
    # What friction reads of each circle begins then; who carries weight has been known for long.
    def rub(w: pv.World, frame: int) -> None:
        if frame == 170:
            w.friction[:] = 0.5

    both(lambda: pour(boundary=ROOMS["cage"](), collisions=pv.Collisions(restitution=0.3)), 180, rub)


def swirl(world: pv.World) -> None:
    @pv.force
    def push(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
        return 20 * vy - vx, -20 * vx - vy

    world.forces += [push, pv.Drag(quadratic=900.0)]


def gone_back(world: pv.World) -> None:
    saved = world.save()
    world.velocity += 1
    world.step(1 / 60)
    world.restore(saved)


EDITS: dict[str, Any] = {
    "nothing": lambda w: None,
    "gravity": lambda w: setattr(w, "gravity", (3, -2)), "substeps": lambda w: setattr(w, "substeps", 5),
    "integrator": lambda w: setattr(w, "integrator", pv.SemiImplicitEuler()),
    "other integrator": lambda w: setattr(w, "integrator", pv.ExplicitEuler()),
    "cage": lambda w: setattr(w, "boundary", pv.Circle(radius=6.5)),
    "cage in place": lambda w: setattr(w.boundary, "radius", 6.5),
    "bounce of the cage": lambda w: setattr(w.boundary, "restitution", 0.9),
    "friction of the cage": lambda w: setattr(w.boundary, "friction", 0.9),
    "collisions": lambda w: setattr(w, "collisions", pv.Collisions(friction=0.4)),
    "bounces": lambda w: setattr(w, "collisions", pv.Collisions(restitution=0.8)),
    "no collisions": lambda w: setattr(w, "collisions", None), "push": lambda w: w.velocity[3].__iadd__((5, 2)),
    "move": lambda w: w.position[3:6].__iadd__(0.25), "moved": lambda w: w.groups[0][3].move_to((2, 6)),
    "spin": lambda w: w.spin.__iadd__(9), "inertia": lambda w: w.inertia.__setitem__(2, 1.0),
    "radius": lambda w: w.radius.__setitem__(slice(2, 9), 0.3), "mass": lambda w: w.mass.__setitem__(4, 3.0),
    "pinned": lambda w: w.mass.__setitem__(4, np.inf),
    "category": lambda w: (w.category.__setitem__(4, 2), w.mask.__setitem__(slice(5), 2)),
    "restitution": lambda w: w.restitution.__setitem__(4, 0.8),
    "friction": lambda w: w.friction.__setitem__(4, 0.8),
    "one more": lambda w: w.add(position=(0.3, 0.2), radius=0.4), "one less": lambda w: w.remove(np.array([7])),
    "force": lambda w: w.forces.append(pv.Drag(linear=0.5)), "own force": swirl,
    "actor": lambda w: w.actors.append(pv.Emitter(pv.Box((-2, 2), (2, 5)), rate=30, radius=0.2)),
    "stick": lambda w: w.links.append(pv.Stick(Group(w._state, 0, 5, w.remove), 0, 1)),
    "segment": lambda w: w.obstacles.append(pv.Segment((-2, -5), (2, -5))),
    "moving obstacle": lambda w: w.obstacles.append(pv.Disc((2, 1), 0.3, velocity=(0, 1))),
    "periodic": lambda w: setattr(w, "boundary", pv.Periodic((-6, -7), (6, 7), axes="x")),
    "records_contacts": lambda w: w.recording_contacts().__enter__(), "threads": lambda w: setattr(w, "threads", 1),
    "saved": lambda w: w.restore(w.save()), "gone back": gone_back,
}  # fmt: skip


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("first", EDITS)
def test_whatever_changes_between_frames_is_seen(first: str, dtype: Any, both: Any) -> None:
    others = [*EDITS]

    def meanwhile(w: pv.World, frame: int) -> None:
        if frame == 20:
            EDITS[first](w)
        elif frame in (30, 31, 45):
            EDITS[others[([*EDITS].index(first) + frame) % len(others)]](w)

    both(lambda: pour(boundary=ROOMS["cage"](), dtype=dtype), 60, meanwhile)


def test_a_crush_that_the_limiter_takes_back_is_the_same_if_it_is_observed() -> None:
    worlds = [pour(boundary=pv.Circle(radius=8)) for _ in range(2)]
    observe(worlds[1])
    for world in worlds:
        world.run(seconds=41 / 60)
        world.boundary.radius = 6.5  # type: ignore[attr-defined]
        world.step(1 / 60)
    assert told(worlds[0]) == told(worlds[1])


def test_an_observer_may_change_the_world() -> None:
    # Gravity turns between the first two substeps: the same whether frames were plain until then or not.
    def turn(snapshot: Any) -> None:
        world.gravity = (1, -9)

    worlds = [pour(boundary=ROOMS["cage"]()) for _ in range(2)]
    observe(worlds[1])
    for world in worlds:
        world.run(seconds=0.5)
        world.observer = turn
        world.run(seconds=0.5)
    assert told(worlds[0]) == told(worlds[1])


def test_shorter_frames_of_the_same_substeps_are_not_taken_for_the_longer_ones() -> None:
    # What a frame looks back on is as long as the frame.
    def stepped(prepare: Any) -> list[Any]:
        world = pour(boundary=ROOMS["cage"]())
        prepare(world)
        world.run(seconds=90 / 60)
        world.substeps = 2
        return [told(world) for _ in each_frame(world, 60, 1 / 240)]

    assert stepped(lambda world: None) == stepped(observe)


def test_a_frame_that_was_broken_off_leaves_the_one_before() -> None:
    # Somebody who looks fails between two substeps: the world holds the frame before, and a heap at rest stays at rest.
    def fail(snapshot: Any) -> None:
        raise ZeroDivisionError

    world = pour(boundary=pv.Circle(radius=8, friction=0.5), collisions=pv.Collisions(friction=0.5))
    world.run(seconds=20)
    for frame in range(60):
        before = told(world)
        if frame % 7 == 5:
            world.observer = fail
            with pytest.raises(ZeroDivisionError):
                world.step(1 / 60)
            world.observer = None
            assert told(world)[:-3] == before[:-3]
        world.step(1 / 60)
        assert np.abs(world.velocity).max() < 1e-3, frame


# ---- What contacts remember while particles come and go: the core moves it, `Memory.renumbered` is the reference ----


WORLDS: dict[str, dict[str, Any]] = {
    "smooth": {}, "rough": {"collisions": pv.Collisions(restitution=0.3, friction=0.5, rolling_resistance=0.1)},
    "heard": {"events": True, "contacts": True, "dtype": np.float64},
    "sleeping": {"sleep": True, "collisions": pv.Collisions(friction=0.5)},
    "periodic": {"boundary": pv.Periodic((0, -1), (12, 60), axes="x")}, "large": {},
}  # fmt: skip


def heap(name: str) -> pv.Group:
    """A copy of one that has been settled once."""
    world = copy.deepcopy(settled(name))
    world.step(1 / 60)
    return world.groups[0]


@functools.cache
def settled(name: str) -> pv.World:
    """Circles of two sizes on a floor and a wheel that turns, nearly at rest. In the large one slots are sorted."""
    columns, rows = (70, 20) if name == "large" else (11, 9)
    room = {"boundary": pv.Box((0, 0), (columns + 1, 60)), **WORLDS[name]}
    world = pv.World(**room)
    x, y = np.meshgrid(1.0 + np.arange(columns), 2.2 + np.arange(rows))
    place = np.column_stack((x.ravel(), y.ravel())) + np.random.default_rng(3).uniform(-0.02, 0.02, (x.size, 2))
    world.add(position=place, radius=np.where(np.arange(x.size) % 3 == 0, 0.3, 0.45))
    world.obstacles.append(pv.Segment((0, 0.5), (columns + 1, 0.7), friction=0.3))
    world.obstacles.append(pv.Disc((columns / 2, 1.0), 0.7, angular_velocity=0.5))
    world.run(seconds=90 / 60)
    return world


def gone(world: pv.World, which: Any) -> np.ndarray[Any, Any]:
    """(n,) where each particle will be once `which` have been removed, -1 of these."""
    kept = np.ones(len(world), bool)
    kept[which] = False
    return np.where(kept, np.cumsum(kept) - 1, -1)


def in_order(memory: Any) -> dict[str, Any]:
    """What contacts remember, whatever order it comes in."""
    pairs, surfaces = np.lexsort(memory.pairs.T[::-1]), np.lexsort(memory.surfaces.T[::-1])
    sleeper = np.lexsort(memory.asleep.pairs.T[::-1])
    return {
        "pairs": (memory.pairs[pairs], memory.values[pairs]),
        "surfaces": (memory.surfaces[surfaces], memory.pushes[surfaces]),
        "asleep": (memory.asleep.pairs[sleeper], memory.asleep.values[sleeper]),
        "given": (memory.given,),
    }


def assert_same(mine: Any, theirs: Any) -> None:
    for name, arrays in in_order(theirs).items():
        for a, b in zip(in_order(mine)[name], arrays, strict=True):
            np.testing.assert_array_equal(a, b, err_msg=name)


@pytest.mark.parametrize("which", [[0], [40], [3, 4, 5, 50, 98], slice(20, 60), slice(0, 98)], ids=repr)
@pytest.mark.parametrize("name", WORLDS)
def test_others_remember_what_they_did(name: str, which: Any) -> None:
    world = heap(name).world
    before = world.save().impulses
    assert len(before.pairs) > 50
    assert len(before.surfaces) > 5
    expected = before.renumbered(gone(world, which))
    world.remove(np.arange(len(world))[which])
    assert_same(world.save().impulses, expected)
    world.add(position=[(3.0, 40.0), (5.0, 40.0)], radius=0.4)  # and now between two frames
    world.remove(len(world) - 1)
    left = world.save().impulses
    assert_same(left._replace(given=expected.given), expected)


@pytest.mark.parametrize("name", WORLDS)
def test_who_is_moved_away_is_forgotten_and_nobody_else(name: str) -> None:
    group = heap(name)
    world = group.world
    before = world.save().impulses
    now = np.arange(len(world))
    now[[7, 30]] = -1
    given = before.given.copy()
    given[[7, 30]] = 0
    world.add(position=(6.0, 45.0), radius=0.2)  # one that the core does not know yet
    group[7].move_to((3.0, 50.0))
    group[30].move_to((5.0, 50.0))
    left = world.save().impulses
    assert_same(left._replace(given=left.given[: len(given)]), before.renumbered(now)._replace(given=given))


def after(world: pv.World) -> str:
    return bits_after(world, 8 / 60)


CHANGES: dict[str, Callable[[pv.World], object]] = {
    "gone": lambda world: world.remove([5, 40]),
    "come": lambda world: world.add(position=(4.0, 45.0), radius=0.3),
    "both": lambda world: (world.remove([11, 12, 70]), world.add(position=[(4.0, 45.0), (6.0, 45.0)], radius=0.3)),
    "come and gone": lambda world: (world.add(position=(4.0, 45.0), radius=0.3), world.remove([3, len(world) - 1])),
    "twice": lambda world: (world.remove(8), world.remove([0, 33])),
    "all but one": lambda world: world.remove(np.arange(1, len(world))),
    "on top": lambda world: world.add(position=world.position[:3] + 0.05, radius=0.4),
    "one in the midst of it": lambda world: world.position.__setitem__(slice(8), (4.0, 3.0)),
    "three times as large": lambda world: world.radius.__setitem__(5, 1.0),
    "smaller": lambda world: world.radius.__imul__(0.98),
    "filtered": lambda world: (world.category.__setitem__(slice(50), 2), world.mask.__setitem__(slice(50), 2)),
    "moved": lambda world: world.groups[0][5:9].move_to((6, 45)),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", WORLDS)
def test_a_world_taken_up_right_then_goes_on_with_the_same_bits(name: str, change: str) -> None:
    world = heap(name).world
    CHANGES[change](world)
    other, saved = copy.deepcopy(world), world.save()
    assert after(world) == after(other)
    end = world.state_hash()
    world.restore(saved)
    assert after(world) == end


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_obstacles_that_change_alone_act_as_if_all_surfaces_were_listed_anew(friction: float) -> None:
    """One peg a frame is moved, added, or given another filter: near discs and far from them. Where ten change, all is listed."""
    worlds = []
    for _ in range(2):
        world = pv.World(
            boundary=pv.Box((0, 0), (12, 30)), threads=1, collisions=pv.Collisions(friction=friction, restitution=0.3)
        )
        row, column = np.divmod(np.arange(60), 10)
        place = np.column_stack((1 + column + 0.5 * (row % 2), 3.0 + 1.5 * row)).tolist()
        world.obstacles.extend([pv.Disc(at, 0.15, restitution=0.4, friction=friction) for at in place])
        world.obstacles.extend([pv.Disc((100.0 + k, 100.0), 0.15) for k in range(10)])
        row, column = np.divmod(np.arange(150), 15)
        world.add(position=np.column_stack((1 + 0.7 * column + 0.1 * (row % 3), 13.0 + 0.7 * row)), radius=0.25, category=3)
        worlds.append(world)
    rng = np.random.default_rng(0)
    for frame in range(120):
        k, at, kind = int(rng.integers(60)), rng.uniform((0, 0), (12, 16)).tolist(), frame % 3
        for world in worlds:
            if kind == 0:
                world.obstacles[k].pivot = at
            elif kind == 1:
                world.obstacles[k].mask = 2 if frame % 2 else 0xFFFFFFFF
            else:
                world.obstacles.append(pv.Disc((at[0], -20.0 if frame % 2 else at[1]), 0.1))
        for far in range(60, 70):
            worlds[1].obstacles[far].pivot = 100.0 + far, 100.0 + frame
        for world in worlds:
            world.step(1 / 60)
        assert worlds[0].state_hash() == worlds[1].state_hash(), frame


@pytest.mark.parametrize("way", [copy.deepcopy, lambda world: pickle.loads(pickle.dumps(world))])
@pytest.mark.parametrize("change", ["particle", "obstacle", "new obstacle", "both"])
def test_a_copy_may_be_changed_before_its_first_step(way: Callable[[pv.World], pv.World], change: str) -> None:
    """What contacts with obstacles remember finds these by name: a copy that is changed does what a changed original does."""
    world = pv.World(boundary=pv.Box((0, 0), (4, 4)), collisions=pv.Collisions(friction=0.3))
    world.obstacles.extend([pv.Segment((0, 0.5), (2, 0.4)), pv.Segment((2, 0.4), (4, 0.5)), pv.Disc((2, 1.4), 0.2)])
    world.add(position=np.column_stack((np.linspace(0.2, 3.8, 15), np.full(15, 0.8))), radius=0.1)
    world.run(seconds=2, dt=1 / 60)
    copied = way(world)
    for each in (world, copied):
        if change in ("obstacle", "both"):
            del each.obstacles[0]
        if change in ("particle", "both"):
            each.remove(0)
        if change == "new obstacle":
            each.obstacles.insert(0, pv.Disc((1, 3), 0.1))
        each.step(1 / 60)
        each.restore(each.save())
        each.run(seconds=0.5, dt=1 / 60)
    assert world.state_hash() == copied.state_hash()
    assert np.array_equal(world.velocity, copied.velocity)


@pytest.mark.parametrize("left", [0, 1, 2])
def test_few_may_be_left_of_a_world_that_was_taken_up(left: int) -> None:
    # What contacts gave is taken up as rows of three numbers; the first two of a single row look like an array of their own.
    world = pv.World(integrator=pv.ExplicitEuler())
    world.add(position=np.column_stack((np.arange(left + 1) * 2.0, np.zeros(left + 1))))
    world.run(seconds=0.1)
    other = copy.deepcopy(world)
    world.restore(world.save())
    for taken_up in (world, other):
        taken_up.step(1 / 60)
        taken_up.remove(0)
        taken_up.step(1 / 60)
        taken_up.add(position=(50, 0))
        taken_up.step(1 / 60)
        assert len(taken_up.position) == left + 1
        assert np.allclose(taken_up.velocity[:left, 1], -9.81 * (0.1 + 3 / 60), rtol=1e-5)  # v = g t
