"""Equal bits: for any number of threads, after save and restore, and however often a frame is drawn."""

import copy
import json
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.programs import python
from tests.worlds import RECORDING, WORLDS, bits_after, each_frame, go_on_alike, noted, said

import pyverlet as pv
from pyverlet.world.team import Team

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
    run = python("-c", RUN_WITH_THREADS, json.dumps([seconds, numbers, kinds]), check=True, PYVERLET_THREADS="8")
    hashes = json.loads(run.stdout)
    assert len(hashes) == len(kinds)
    for values in hashes.values():
        assert len(values) == len(numbers)
        assert len(set(values)) == 1


@pytest.mark.parametrize(
    ("restitution", "friction"),
    [(0.0, 0.0), (0.5, 0.3), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((0.5, 0.0), (0.0, 0.3)))],
)
@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_restore_continues_with_the_same_bits(name: str, restitution: float, friction: float) -> None:
    world = WORLDS["thrown"](integrator=pv.integrators.BY_NAME[name](), restitution=restitution, friction=friction)
    world.run(seconds=0.5)
    saved = world.save()
    expected = bits_after(world, 0.3)
    world.restore(saved)
    assert world.time == saved.time
    assert bits_after(world, 0.3) == expected


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
        hashes.add(bits_after(world, 10 / 60))
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
        assert bits_after(again, 1 / 60) == bits_after(world, 1 / 60)


def test_measuring_does_not_change_the_motion() -> None:
    watched, alone = WORLDS["machine"](), WORLDS["machine"]()
    for _ in each_frame(watched, 60):
        watched.overlap(), watched.energy(), watched.state_hash(), watched.save(), watched.momentum()
        alone.step(1 / 60)
    assert watched.state_hash() == alone.state_hash()


def test_the_hash_sees_one_bit() -> None:
    world = WORLDS["machine"]()
    before = world.state_hash()
    world.position[17, 0] = np.nextafter(world.position[17, 0], np.float32(1e9))
    assert world.state_hash() != before


# ---- Worlds of every kind have equal bits: on any number of threads, taken up again, watched or not ----


EVERY = pytest.mark.parametrize("name", WORLDS)
DEAR = ("water", "sticky", "stars")
EVERY_PRECISION = pytest.mark.parametrize(
    ("name", "dtype"), [*((name, np.float32) for name in WORLDS), *((name, np.float64) for name in WORLDS if name not in DEAR)]
)


def test_worlds_have_something_to_remember() -> None:
    # Else these tests would pass without it; sleepers are asserted to sleep where they are made.
    torn, rough, sticky, crowd = (WORLDS[name]() for name in ("linked", "machine", "sticky", "crowded"))
    for world in (torn, rough, sticky, crowd):
        world.run(seconds=1.0 if world in (torn, rough) else 0.25)
    assert len(said(sticky)["bonds"][0])
    assert not all(link.intact.all() for link in torn.links)
    assert (rough.save().impulses.values[:, 1] != 0).any()
    assert crowd.save().impulses.parting > 0


@pytest.mark.parametrize(
    ("name", "dtype", "listens"),
    [(name, dtype, dtype == np.float64) for name in WORLDS for dtype in (np.float32, np.float64) if name not in DEAR]
    + [pytest.param(name, np.float32, listens, marks=pytest.mark.slow) for name in DEAR for listens in (False, True)],
)
def test_taken_up_again_it_goes_on_with_the_same_bits(name: str, dtype: Any, listens: bool, tmp_path: Path) -> None:
    """From a saved state, a copy, a pickle and a file; in the middle of a fall, and later, when others have gone."""
    world = WORLDS[name](dtype=dtype, **(RECORDING if listens else {}))
    for count in (15, 12):
        world.run(seconds=count / 60)
        go_on_alike(world, tmp_path)
        world.remove(len(world) // 2)


@EVERY
def test_any_number_of_threads_has_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same in all frames, or another one in each."""
    found = []
    for numbers in ((1,), (2,), (3,), (2, 1, 3)):
        turns = cycle(numbers)
        monkeypatch.setattr(Team, "size", lambda team, most, frame_ms, turns=turns: next(turns))
        world, used = WORLDS[name](**RECORDING, threads=1 if numbers == (1,) else 2), set()
        for _ in each_frame(world, 20):
            used |= {world._frames.held.parts} if world.collisions else set()
        found.append(noted(world))
        assert used == (set(numbers) if world.collisions else set())
    assert found[0] == found[1] == found[2] == found[3]


@EVERY_PRECISION
def test_it_moves_alike_whether_anybody_listens(name: str, dtype: Any) -> None:
    plain, heard = WORLDS[name](dtype=dtype), WORLDS[name](dtype=dtype, **RECORDING)
    for _ in range(2):
        for world in (plain, heard):
            world.run(seconds=9 / 60)
        assert said(plain).items() <= said(heard).items()


def test_restored_across_a_change_of_what_contacts_are_made_of() -> None:
    # Also by the circles' own friction, where the solver stays who it is.
    rough, smooth, brute = pv.Collisions(friction=0.3), pv.Collisions(), pv.Collisions(method=pv.BruteForce())
    for before, after in ((rough, smooth), (smooth, rough), (None, smooth), (brute, smooth), (smooth, None), (smooth, 0.3)):
        world = WORLDS["machine"]()
        world.collisions = before
        world.run(seconds=0.5)
        saved = world.save()
        there = bits_after(world, 0.3)
        if isinstance(after, float):
            world.friction[:] = after
        else:
            world.collisions = after
        world.run(seconds=0.2)
        world.restore(saved)
        world.collisions = before
        assert bits_after(world, 0.3) == there


def test_who_looks_at_a_frame_that_begins_sees_the_threads_of_now(monkeypatch: pytest.MonkeyPatch) -> None:
    # With more threads there is another team, and that of before is no more: a fluid asked it for its energy, which may end the
    # process.
    seen: list[tuple[Any, Any]] = []

    class Watched(pv.Fluid):
        def potential(self, state: Any) -> float:
            held = world._frames.held
            seen.append((state.thread_team, (held.engine.thread_team, held.parts)))
            return super().potential(state)

    world = pv.World(boundary=pv.Box((0, 0), (4, 4)))
    group = world.add(position=0.2 * np.stack(np.meshgrid(np.arange(1, 9), np.arange(1, 9)), -1).reshape(-1, 2), radius=0.05)
    world.forces.append(Watched(group, rest_density=25.0, stiffness=100.0))
    for threads in (1, 2, 3):
        monkeypatch.setattr(Team, "size", lambda team, most, frame_ms, threads=threads: threads)
        world.step(1 / 60)
    assert len(seen) >= 3
    assert all(given == now for given, now in seen)
