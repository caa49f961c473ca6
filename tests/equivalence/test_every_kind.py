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
