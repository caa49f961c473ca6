"""The core's list of pairs against all pairs against all, and what contacts remember across new lists."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.state.slots import Slots

Array = np.ndarray[Any, Any]


def brute_force(slots: Slots, skin: float) -> set[tuple[int, int]]:
    """Pairs of slots whose rims are nearer than the skin, of which one is free and which take each other's category."""
    place, n = slots.position.astype(float), len(slots)
    i, j = np.triu_indices(n, 1)
    way = slots.seam.nearest(place[j] - place[i])
    near = np.hypot(*way.T) < slots.radius[i].astype(float) + slots.radius[j] + skin
    near &= (slots.inverse_mass[i] > 0) | (slots.inverse_mass[j] > 0)
    if len(slots.category):
        near &= (slots.category[i] & slots.mask[j]) != 0
        near &= (slots.category[j] & slots.mask[i]) != 0
    return set(zip(i[near].tolist(), j[near].tolist(), strict=True))


def listed(world: pv.World) -> tuple[set[tuple[int, int]], Array]:
    """The pairs of a list, and its lanes (k, 2) group by group; each batch of eight shares no particle."""
    first, count, i, j = world._impulses.listed()
    pairs: list[tuple[int, int]] = []
    for a, n in zip(first.tolist(), count.tolist(), strict=True):
        assert n % 8 == 0
        for k in range(a, a + n, 8):
            batch = list(dict.fromkeys(zip(i[k : k + 8].tolist(), j[k : k + 8].tolist(), strict=True)))
            assert len({p for pair in batch for p in pair}) == 2 * len(batch)
            pairs += batch
    assert len(set(pairs)) == len(pairs)
    return {(min(p), max(p)) for p in pairs}, np.array(pairs)


def room(kind: str, size: float) -> pv.Boundary:
    return {
        "open": pv.Open(),
        "box": pv.Box((-size, -size), (size, size)),
        "periodic": pv.Periodic((-size, -size), (size, size)),
        "tube": pv.Periodic((-size, -size), (size, size), axes="x"),
        "shaft": pv.Periodic((-size, -size), (size, size), axes="y"),
        "channel": pv.Box((-8 * size, -0.5 * size), (8 * size, 0.5 * size)),
        "ring": pv.Periodic((-8 * size, -0.5 * size), (8 * size, 0.5 * size), axes="x"),
    }[kind]


def radii(kind: str, n: int, chance: np.random.Generator) -> Array:
    equal = np.full(n, 0.1)
    equal[0] = 2.0 if kind == "giant" else 0.1
    equal[:3] = 1.5 if kind == "giants" else equal[:3]
    return {"1:5": chance.uniform(0.05, 0.25, n), "1:50": 0.01 * 50 ** chance.random(n)}.get(kind, equal)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("sizes", ["equal", "1:5", "1:50", "giant", "giants"])
@pytest.mark.parametrize("kind", ["open", "box", "periodic", "tube", "shaft", "channel", "ring"])
def test_the_list_is_that_of_all_pairs_against_all(kind: str, sizes: str, dtype: Any) -> None:
    for seed, n in ((1, 2), (2, 60), (3, 700)):
        chance = np.random.default_rng(seed)
        size = max(0.12 * np.sqrt(n), 4.5)
        world = pv.World(
            boundary=room(kind, size), collisions=pv.Collisions(impulses=True, method=pv.Fast(skin=0.3)), gravity=(0, 0), dtype=dtype
        )
        wide, high = (8 * size, 0.5 * size) if kind in ("channel", "ring") else (size, size)
        place = chance.uniform(-1, 1, (n, 2)) * (wide, high)
        place[n // 2] = place[0]  # coincident
        if kind == "open" and n > 2:
            place[1] = 1e5, -3e4  # far away
        mass = np.where(chance.random(n) < 0.1, np.inf, 1.0)
        world.add(position=place, radius=radii(sizes, n, chance), mass=mass)
        if seed == 3:
            world.category[: n // 3], world.mask[: n // 2] = 2, 1
        world.step(1e-9)
        slots, skin = world._slots, world._impulses._engine.save_list()[2][1] * 2
        found, _ = listed(world)
        # Rounding of coordinates, and of periods, decides about pairs at the very rim of the skin.
        slack = 1e-5 if dtype == np.float32 else 1e-12
        assert brute_force(slots, skin - slack) <= found <= brute_force(slots, skin + 30 * slack), (kind, sizes, n)
