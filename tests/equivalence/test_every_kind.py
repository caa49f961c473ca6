"""Worlds of every kind have equal bits: on any number of threads, taken up again, watched or not, and uncompiled."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.uncompiled import UNCOMPILED

import pyverlet as pv
from pyverlet import core
from pyverlet.world.team import Team

from .worlds import WORLDS

DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])
EVERY = pytest.mark.parametrize("name", WORLDS)
DEAR = ("water", "sticky", "stars")
EVERY_PRECISION = pytest.mark.parametrize(
    ("name", "dtype"), [*((name, np.float32) for name in WORLDS), *((name, np.float64) for name in WORLDS if name not in DEAR)]
)


def after(world: pv.World, frames: int) -> tuple[Any, ...]:
    """What there is after so many frames: bits, what links pull with, bonds, and what the ledger says."""
    for _ in range(frames):
        world.step(1 / 60)
    pulls = [link.force.tobytes() for link in world.links]
    bonds = [force.bonds.tolist() for force in world.forces if isinstance(force, pv.Cohesion)]
    return world.state_hash(), pulls, bonds, world.ledger.as_dict() if world.keeps_ledger else None


@EVERY_PRECISION
def test_taken_up_again_it_goes_on_with_the_same_bits(name: str, dtype: Any, tmp_path: Path) -> None:
    """From a saved state, a copy, a pickle and a file; in the middle of a fall, and later, when others have gone."""
    world = WORLDS[name](dtype=dtype, ledger=True)
    for frames in (20, 15):
        after(world, frames)
        pv.save(world, tmp_path / f"{frames}.pvsnap")
        others = [copy.deepcopy(world), pickle.loads(pickle.dumps(world)), pv.load(tmp_path / f"{frames}.pvsnap", exact=True)]
        saved = world.save()
        expected = after(world, 8)
        assert [after(other, 8) for other in others] == [expected] * 3
        world.restore(saved)
        assert after(world, 8) == expected
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
        assert after(plain, 12)[:3] == after(heard, 12)[:3]


@DTYPES
@pytest.mark.parametrize("name", ["linked", "driven", "sieve", "by_pairs"])
def test_uncompiled_it_has_the_same_bits(name: str, dtype: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = after(WORLDS[name](dtype=dtype, ledger=True, substeps=4), 4)
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert after(WORLDS[name](dtype=dtype, ledger=True, substeps=4), 4) == compiled


# ---- The compiled core against the same files run as Python, and what is left of a frame that turned non-finite ----


def world(dtype: Any, *, friction: float = 0.3, restitution: float = 0.5, gravity: float = -9.81) -> pv.World:
    """Twenty discs of all sizes and masses in a cage, thrown about."""
    chance = np.random.default_rng(1)
    made = pv.World(
        boundary=pv.Circle(radius=3, restitution=0.4, friction=friction),
        collisions=pv.Collisions(restitution=restitution, friction=friction),
        gravity=(0, gravity),
        dtype=dtype,
        substeps=4,
    )
    x, y = np.meshgrid(np.arange(5) * 0.75 - 1.5, np.arange(4) * 0.75 - 1.5)
    place = np.column_stack((x.ravel(), y.ravel())) + chance.normal(0, 0.02, (20, 2))
    made.add(
        position=place,
        velocity=chance.normal(0, 2, (20, 2)),
        radius=chance.uniform(0.2, 0.35, 20),
        mass=chance.uniform(0.5, 3, 20),
    )
    return made


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
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


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
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


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
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


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
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
        made.run(seconds=0.5, dt=1 / 60)
        return made.state_hash()

    compiled = run()
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert run() == compiled
