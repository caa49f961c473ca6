"""Equal bits: for any number of threads, after save and restore, and however often a frame is drawn."""

import copy
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.uncompiled import UNCOMPILED
from tests.worlds import WORLDS, go_on_alike

import pyverlet as pv
from pyverlet import core
from pyverlet.world.team import Team

DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])

# A process of its own gets eight threads, whatever this machine has.
RUN_WITH_THREADS = """
import json, sys
import numpy as np
import pyverlet as pv
hashes = {}
seconds, numbers, kinds = json.loads(sys.argv[1])
for threads in numbers:
    for restitution, friction, spread, heavy in kinds:
        world = pv.World(boundary=pv.Circle(radius=43.2, restitution=restitution, friction=friction),
                         collisions=pv.Collisions(restitution=restitution, friction=friction), threads=threads)
        x, y = np.meshgrid(np.arange(-30, 30, 1.05), np.arange(-30, 30, 1.05))
        position = np.column_stack((x.ravel(), y.ravel())) + np.random.default_rng(0).uniform(-0.02, 0.02, (x.size, 2))
        rng = np.random.default_rng(1)
        world.add(position=position, radius=0.5 * spread ** -rng.random(x.size), mass=heavy ** rng.random(x.size))
        world.run(seconds=seconds)
        hashes.setdefault(f"{restitution} {friction} {spread} {heavy}", []).append(world.state_hash())
json.dump(hashes, sys.stdout)
"""


# Restitution, friction, how much smaller and how much heavier the others are. Each kind's kernels are compiled for many threads.
SMOOTH_AND_ROUGH = [(0, 0, 1, 1), (0.5, 0.3, 1, 1)]
EVERY_KIND = [*SMOOTH_AND_ROUGH, (0, 0, 30, 1), (0, 0, 1, 1000), (0.5, 0.3, 1, 1000), (0.5, 0.3, 30, 1000)]


@pytest.mark.parametrize(
    ("seconds", "numbers", "kinds"),
    [(0.35, [1, 8], SMOOTH_AND_ROUGH), pytest.param(2.0, [1, 2, 4, 8], EVERY_KIND, marks=pytest.mark.slow)],
    ids=["two kinds", "every kind"],
)
def test_threads_do_not_change_a_bit(seconds: float, numbers: list[int], kinds: list[tuple[float, ...]]) -> None:
    # The lowest meet the wall after a quarter of a second.
    run = subprocess.run(
        [sys.executable, "-c", RUN_WITH_THREADS, json.dumps([seconds, numbers, kinds])],
        env={**os.environ, "PYVERLET_THREADS": "8"}, capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    hashes = json.loads(run.stdout)
    assert len(hashes) == len(kinds)
    for values in hashes.values():
        assert len(values) == len(numbers)
        assert len(set(values)) == 1


def falling_heap(**options: Any) -> pv.World:
    world = pv.World(boundary=pv.Box((0, 0), (30, 100)), **options)
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(1, 29.0), np.arange(1, 29.0))
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=rng.uniform(0.3, 0.45, x.size))
    return world


@pytest.mark.parametrize(
    ("restitution", "friction"),
    [(0.0, 0.0), (0.5, 0.3), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((0.5, 0.0), (0.0, 0.3)))],
)
@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_restore_continues_with_the_same_bits(name: str, restitution: float, friction: float) -> None:
    collisions = pv.Collisions(restitution=restitution, friction=friction)
    world = falling_heap(integrator=pv.integrators.BY_NAME[name](), collisions=collisions)
    world.run(seconds=0.5)
    saved = world.save()
    world.run(seconds=0.3)
    expected = world.state_hash()
    world.restore(saved)
    assert world.time == saved.time
    world.run(seconds=0.3)
    assert world.state_hash() == expected


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", pv.scenes.SCENES)
def test_every_scene_starts_again_with_the_same_bits(name: str, dtype: type) -> None:
    """Restored to before its first frame, what the engine has learnt since (the skin of its lists, their age) is forgotten."""
    scene = pv.scenes.get(name)
    most = 500 if dtype == np.float32 else scene.defaults.particles
    world = scene.world(dtype=dtype, particles=min(scene.defaults.particles, most))
    saved = world.save()
    hashes = set()
    for _ in range(2):
        world.run(seconds=10 / 60)
        hashes.add(world.state_hash())
        world.restore(saved)
    assert len(hashes) == 1


@pytest.mark.parametrize("collisions", [None, pv.Collisions(restitution=1)])
def test_copies_in_a_periodic_room_go_on_with_the_same_bits(collisions: pv.Collisions | None) -> None:
    """Also where nothing is listed: positions run on beyond the room, and are rounded there, until they are looked at anew."""
    world = pv.World(gravity=(0, 0), boundary=pv.Periodic((-4.6, 0), (4.6, 9.2)), collisions=collisions, substeps=1)
    x = 1.15 * np.arange(8) + 0.5
    velocity = np.random.default_rng(0).normal(0, 4, (64, 2))
    world.add(position=np.stack(np.meshgrid(x - 4.6, x), -1).reshape(-1, 2), velocity=velocity, radius=0.1)
    world.run(seconds=0.5)
    for _ in range(10):
        again = copy.deepcopy(world)
        for each in (world, again):
            each.step(1 / 60)
        assert again.state_hash() == world.state_hash()


def test_restore_after_the_collisions_were_changed() -> None:
    for before, after in (
        (None, pv.Collisions()),
        (pv.Collisions(method=pv.BruteForce()), pv.Collisions()),
        (pv.Collisions(), None),
    ):
        world = falling_heap(collisions=before)
        world.run(seconds=0.1)
        saved = world.save()
        position = world.position.copy()
        world.collisions = after
        world.run(seconds=0.1)
        world.restore(saved)
        assert world.position.tolist() == position.tolist()
        world.run(seconds=0.1)
        assert np.isfinite(world.position).all()


def test_what_was_edited_before_saving_is_news_after_restoring() -> None:
    # Edits between frames make lists of pairs void, and circles added on top of others are to start smaller.
    def overlap(world: pv.World) -> None:
        world.add(position=world.position[:3] + 0.05, radius=0.4)

    def shrink(world: pv.World) -> None:
        world.radius[:] *= 0.98

    def filter_out(world: pv.World) -> None:
        world.category[:50] = world.mask[:50] = 2

    for edit in (overlap, shrink, filter_out):
        world = falling_heap()
        world.run(seconds=0.7)
        edit(world)
        saved = world.save()
        world.run(seconds=0.1)
        expected = world.state_hash()
        world.restore(saved)
        world.run(seconds=0.1)
        assert world.state_hash() == expected, edit.__name__


def test_measuring_does_not_change_the_motion() -> None:
    watched, alone = falling_heap(), falling_heap()
    for _ in range(60):
        watched.step(1 / 60)
        watched.overlap(), watched.energy(), watched.state_hash(), watched.save(), watched.momentum()
        alone.step(1 / 60)
    assert watched.state_hash() == alone.state_hash()


@pytest.mark.parametrize("drawn_per_second", [10, 30, 60, 144])
def test_the_trajectory_does_not_depend_on_the_drawing(drawn_per_second: int) -> None:
    # A4: two seconds of wall time, whatever the interval between pictures, are the same 120 frames of physics.
    world, clock = falling_heap(), pv.Clock(dt=1 / 60, max_catch_up=6)
    for _ in range(2 * drawn_per_second):
        for _ in range(clock.advance(1 / drawn_per_second)):
            world.step(clock.dt)
    reference = falling_heap()
    reference.run(seconds=2)
    assert clock.dropped == 0
    assert world.frames == 120
    assert world.state_hash() == reference.state_hash()


def test_the_hash_sees_one_bit() -> None:
    world = falling_heap()
    before = world.state_hash()
    world.position[17, 0] = np.nextafter(world.position[17, 0], np.float32(1e9))
    assert world.state_hash() != before


# ---- Worlds of every kind have equal bits: on any number of threads, taken up again, watched or not, and uncompiled ----


EVERY = pytest.mark.parametrize("name", WORLDS)
DEAR = ("water", "sticky", "stars")
EVERY_PRECISION = pytest.mark.parametrize(
    ("name", "dtype"), [*((name, np.float32) for name in WORLDS), *((name, np.float64) for name in WORLDS if name not in DEAR)]
)


def after(world: pv.World, frames: int) -> tuple[Any, ...]:
    """What there is after so many frames: bits, what links pull with, bonds, and what the ledger says."""
    world.run(seconds=frames / 60)
    pulls = [link.force.tobytes() for link in world.links]
    bonds = [force.bonds.tolist() for force in world.forces if isinstance(force, pv.Cohesion)]
    return world.state_hash(), pulls, bonds, world.ledger.as_dict() if world.keeps_ledger else None


@EVERY_PRECISION
def test_taken_up_again_it_goes_on_with_the_same_bits(name: str, dtype: Any, tmp_path: Path) -> None:
    """From a saved state, a copy, a pickle and a file; in the middle of a fall, and later, when others have gone."""
    world = WORLDS[name](dtype=dtype, ledger=True)
    for frames in (15, 12):
        after(world, frames)
        go_on_alike(world, lambda world: after(world, 6), tmp_path)
        world.remove(len(world) // 2)


@EVERY
def test_any_number_of_threads_has_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(Team, "size", lambda team, most, frame_ms, threads=threads: threads)
        world = WORLDS[name](ledger=True, threads=min(threads, 2))
        found.append(after(world, 20))
        assert world.collisions is None or world._frames.held.parts == threads
    assert found[0] == found[1] == found[2]


@EVERY_PRECISION
def test_it_moves_alike_whether_anybody_listens(name: str, dtype: Any) -> None:
    plain, heard = WORLDS[name](dtype=dtype), WORLDS[name](dtype=dtype, events=True, contacts=True, ledger=True)
    for _ in range(2):
        assert after(plain, 9)[:3] == after(heard, 9)[:3]


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        pytest.param(name, dtype, marks=pytest.mark.slow if (name, dtype) == ("linked", np.float64) else ())
        for name in ("linked", "driven", "sieve", "by_pairs")
        for dtype in (np.float32, np.float64)
    ],
)
def test_uncompiled_it_has_the_same_bits(name: str, dtype: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = after(WORLDS[name](dtype=dtype, ledger=True, substeps=4), 3)
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert after(WORLDS[name](dtype=dtype, ledger=True, substeps=4), 3) == compiled


# ---- The compiled core against the same files run as Python, and what is left of a frame that turned non-finite ----


def world(dtype: Any, *, friction: float = 0.3, restitution: float = 0.5, gravity: float = -9.81) -> pv.World:
    """Twenty discs of all sizes and masses in a cage, thrown about."""
    chance = np.random.default_rng(1)
    made = pv.World(
        boundary=pv.Circle(radius=3, restitution=0.4, friction=friction),
        collisions=pv.Collisions(restitution=restitution, friction=friction), gravity=(0, gravity), dtype=dtype,
        substeps=4,
    )  # fmt: skip
    x, y = np.meshgrid(np.arange(5) * 0.75 - 1.5, np.arange(4) * 0.75 - 1.5)
    place = np.column_stack((x.ravel(), y.ravel())) + chance.normal(0, 0.02, (20, 2))
    made.add(
        position=place, velocity=chance.normal(0, 2, (20, 2)), radius=chance.uniform(0.2, 0.35, 20),
        mass=chance.uniform(0.5, 3, 20),
    )  # fmt: skip
    return made


@DTYPES
@pytest.mark.parametrize(
    "more", [{}, {"restitution": 0.3}, {"friction": 0.0}, {"gravity": 0.0, "restitution": 1.0, "friction": 0.0}]
)
def test_uncompiled_a_crowd_has_the_same_bits(dtype: Any, more: dict[str, float], monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = world(dtype, **more)
    compiled.run(seconds=0.25)
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    plain = world(dtype, **more)
    plain.run(seconds=0.25)
    assert plain.state_hash() == compiled.state_hash()


@DTYPES
@pytest.mark.parametrize("room", [pv.Box((-2, -2), (2, 2), mask=5), pv.Periodic((-2, -2), (2, 2), axes="x", mask=5)])
def test_uncompiled_filters_sensors_and_one_way_lines_have_the_same_bits(
    dtype: Any, room: pv.Box, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run() -> tuple[str, list[bytes]]:
        made = pv.World(boundary=room, dtype=dtype, substeps=2, events=True)
        made.obstacles += [
            pv.Chain([(-2, -0.5), (0, -0.8), (1.9, -0.3)], one_way=(0, 1)),
            pv.Segment((-2, 0.5), (2, 0.5), sensor=True),
            pv.Polygon([(-1, -1), (1, -1), (0, 1)], sensor=True, angular_velocity=2.0),
            pv.Disc((1, 0), 0.3, mask=2),
        ]
        y = np.linspace(-1.5, 1.5, 6)
        speed = np.column_stack((0 * y, np.where(y < 0, 9, -40)))
        made.add(position=np.column_stack((y, y)), velocity=speed, radius=0.15, category=[1, 2, 3, 4, 5, 6])
        said = []
        for _ in range(6):
            made.step(1 / 60)
            said += [made.events.begin[["a", "obstacle"]].tobytes(), made.events.end.tobytes()]
        return made.state_hash(), said

    compiled = run()
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert run() == compiled


@DTYPES
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_uncompiled_sleepers_wake_with_the_same_bits(dtype: Any, friction: float, monkeypatch: pytest.MonkeyPatch) -> None:
    def row() -> tuple[pv.World, list[int]]:
        """Four at rest in a row, two of them on the floor of a room without gravity; hit after they have fallen asleep."""
        law = pv.Collisions(restitution=0.7, friction=friction)
        made = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (9, 3)), collisions=law, dtype=dtype, sleep=True, substeps=2)
        made.add(position=[(2, 0.5), (3, 0.5), (4.2, 0.6), (5.3, 0.7)], radius=0.5)
        made.run(seconds=0.55)
        asleep = [int(made.asleep.sum())]
        made.add(position=(0.6, 1.0), velocity=(15, -1.0), radius=0.4)
        for _ in range(12):
            made.step(1 / 60)
            asleep.append(int(made.asleep.sum()))
        return made, asleep

    compiled, asleep = row()
    assert asleep[0] == 4
    assert asleep[-1] == 0
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    plain, same = row()
    assert same == asleep
    assert plain.state_hash() == compiled.state_hash()


def test_a_world_that_turned_non_finite_still_holds_the_frame_before() -> None:
    made = world(np.float64)
    made.step(1 / 60)
    before = made.position.copy()
    made.velocity[2] = np.nan
    with pytest.raises(pv.NonFiniteError, match="particle 2"):
        made.step(1 / 60)
    assert np.array_equal(made.position, before)
    made.velocity[2] = 0
    made.step(1 / 60)


@DTYPES
def test_uncompiled_linked_particles_bounce_with_the_same_bits(dtype: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> str:
        made = pv.World(
            boundary=pv.Box((0, 0), (2, 2), restitution=0.9), collisions=pv.Collisions(restitution=1.0), dtype=dtype, substeps=2
        )
        square = made.add(position=[(0.3, 1), (0.7, 1), (0.7, 1.4), (0.3, 1.4)], radius=0.1, velocity=(3, -4))
        made.links.append(pv.Stick(square, [0, 1, 2, 3, 0], [1, 2, 3, 0, 2]))
        bell = made.add(position=[(1.3, 1), (1.8, 1.1)], radius=0.1, velocity=(-2, -3))
        made.links.append(pv.Stick(bell, 0, 1))
        made.add(position=[(1, 0.2)], radius=0.1)
        made.run(seconds=0.3, dt=1 / 60)
        return made.state_hash()

    compiled = run()
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert run() == compiled
