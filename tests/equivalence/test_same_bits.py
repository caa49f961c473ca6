"""Equal bits: for any number of threads, after save and restore, and however often a frame is drawn."""

from __future__ import annotations

import copy
import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

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
        env={**os.environ, "PYVERLET_THREADS": "8"},
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
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
    world.run(seconds=0.7)
    saved = world.save()
    world.run(seconds=0.7)
    expected = world.state_hash()
    world.restore(saved)
    assert world.time == saved.time
    world.run(seconds=0.7)
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
        for _ in range(15):
            world.step(1 / 60)
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
