"""Contacts eight pairs at a time against one pair after the other: the same pairs, and the same bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.compile.lanes import LANES
from pyverlet.ground.constants import DEEP, DEEP_PART, DEEP_SWEEPS, FED_SMOOTH, LARGEST_PUSH, PUSHED
from pyverlet.laws.contacts.broadphase import BruteForce, Fast
from pyverlet.laws.contacts.packs import Packs
from pyverlet.state.state import Slots

H = 1 / 480


def crowd(seed: int, n: int, spread: float, dtype: Any) -> Slots:
    """A random crowd with overlaps, some of it pinned."""
    rng = np.random.default_rng(seed)
    world = pv.World(dtype=dtype)
    room = 0.6 * np.sqrt(n)
    world.add(
        position=rng.uniform(-room, room, (n, 2)),
        velocity=rng.normal(0, 1, (n, 2)),
        radius=0.5 * spread ** rng.uniform(-1, 0, n),
        mass=np.where(rng.random(n) < 0.1, np.inf, rng.uniform(1, 3, n)) if spread > 1 else 1.0,
    )
    slots = Slots(np.dtype(dtype))
    slots.gather(world._state)
    return slots


def packed(slots: Slots, method: Fast | BruteForce) -> tuple[Any, Packs]:
    phase = method.start(slots.dtype)
    phase.update(slots)
    packs = Packs(slots.dtype)
    packs.take(phase.list, phase.built, slots.radius)
    return phase.list, packs


cases = given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 900),
    spread=st.sampled_from([1.0, 4.0, 50.0]),
    dtype=st.sampled_from([np.float32, np.float64]),
    method=st.sampled_from([Fast(), BruteForce()]),
)


@settings(max_examples=40, deadline=None)
@cases
def test_packs_hold_every_pair_and_share_no_particle(seed: int, n: int, spread: float, dtype: Any, method: Any) -> None:
    pairs, packs = packed(crowd(seed, n, spread, dtype), method)
    lanes = packs.pairs()
    assert set(map(tuple, lanes.tolist())) == set(map(tuple, pairs.pairs().tolist()))
    for pack in lanes.reshape(-1, LANES, 2):
        alone = np.unique(pack, axis=0)  # a pair repeated to fill a pack writes the same twice
        assert len(np.unique(alone)) == alone.size


def refine(slots: Slots, packs: Packs, moved: Any, shares: dict[int, Any], deep: list[range]) -> None:
    """What kernels.packs does with the packs of a strip that overlap by more than DEEP."""
    real = slots.real
    for sweep in range(DEEP_SWEEPS):
        left = []
        for pack in deep[::-1] if sweep % 2 else deep:
            pushes = []
            for k in (k for k in pack if k in shares):
                i, j = packs.lane_i[k], packs.lane_j[k]
                d = packs.gap[:, k] + (moved[j] - moved[i])
                distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
                reach = slots.size[i] + slots.size[j]
                excess = max(real(1 - DEEP) * reach - distance, real(0))
                if distance <= real(1 - LARGEST_PUSH) * reach:
                    excess, distance = real(0), reach
                pushes.append((k, i, j, d * (real(DEEP_PART * PUSHED) * excess / distance), excess))
            if any(excess > 0 for *_, excess in pushes):
                left.append(pack)
                for k, i, j, c, _ in pushes:
                    moved[i] = moved[i] - c * shares[k]
                    moved[j] = moved[j] + c * (real(1) - shares[k])
        if sweep == 0:
            deep = left


def one_by_one(slots: Slots, packs: Packs) -> None:
    """kernels.packs.project and still, in NumPy's scalars of the same dtype, pair after pair."""
    real = slots.real
    moved = slots.position - packs.origin
    strips = [range(a, a + n) for a, n in zip(packs.begin, packs.lanes, strict=False)]
    strips = [*strips[::2], *strips[1::2]]
    lanes = [(k, packs.lane_i[k], packs.lane_j[k]) for strip in strips for k in strip]
    lanes = [lane for a, lane in enumerate(lanes) if a % LANES == 0 or lane[1:] != lanes[a - 1][1:]]
    normals = {}
    shares = {}
    deep = set()
    for k, i, j in lanes:
        shares[k] = slots.inverse_mass[i] / (slots.inverse_mass[i] + slots.inverse_mass[j])
        reach = slots.size[i] + slots.size[j]
        d = packs.gap[:, k] + (moved[j] - moved[i])
        distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
        depth = min(max(reach - distance, real(0)), real(LARGEST_PUSH) * reach)
        if depth > real(DEEP) * reach:
            deep.add(k)
        n = d * (real(1) / distance)
        normals[k] = n if depth > 0 else 0 * n
        c = n * (real(PUSHED) * depth)
        moved[i] = moved[i] - c * shares[k]
        moved[j] = moved[j] + c * (real(1) - shares[k])
    for strip in strips:
        refine(slots, packs, moved, shares, [range(k, k + LANES) for k in strip[::LANES] if deep & set(range(k, k + LANES))])
    by = moved - (slots.position - packs.origin)
    slots.position += by
    slots.velocity += real(FED_SMOOTH / PUSHED / H) * by
    v = slots.velocity
    for k, i, j in lanes:
        n = normals[k]
        u = v[j] - v[i]
        c = (u[0] * n[0] + u[1] * n[1]) * n
        v[i], v[j] = v[i] + c * shares[k], v[j] - c * (real(1) - shares[k])


@settings(max_examples=20, deadline=None)
@cases
def test_eight_at_once_are_one_by_one(seed: int, n: int, spread: float, dtype: Any, method: Any) -> None:
    slots = crowd(seed, n, spread, dtype)
    _, packs = packed(slots, method)
    slots.position += np.random.default_rng(seed).normal(0, 0.01, slots.position.shape).astype(dtype)
    other = Slots(slots.dtype)
    for name in ("position", "velocity", "radius", "inverse_mass"):
        setattr(other, name, getattr(slots, name).copy())
    other.size = other.radius
    packs.project(slots, H)
    packs.still(slots)
    one_by_one(other, packs)
    assert slots.position.tobytes() == other.position.tobytes()
    assert slots.velocity.tobytes() == other.velocity.tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_coincident_centres_part(dtype: Any) -> None:
    slots = crowd(0, 2, 1.0, dtype)
    slots.position[:] = 3.0
    slots.velocity[:] = 0.0
    _, packs = packed(slots, Fast())
    packs.project(slots, H)
    # LARGEST_PUSH of the contact distance at most is seen, PUSHED of it is taken.
    parted = np.hypot(*(slots.position[1] - slots.position[0]))
    assert parted == pytest.approx(PUSHED * LARGEST_PUSH, rel=1e-5)


def test_a_circle_with_hundreds_of_neighbours() -> None:
    # More pairs than a set of colours has bits: 300 small circles around a large one.
    slots = Slots(np.dtype(np.float32))
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    world = pv.World()
    world.add(position=np.vstack(([0, 0], 10.04 * np.column_stack((np.cos(angle), np.sin(angle))))), radius=[10, *[0.05] * 300])
    slots.gather(world._state)
    pairs, packs = packed(slots, Fast())
    lanes = packs.pairs()
    assert set(map(tuple, lanes.tolist())) == set(map(tuple, pairs.pairs().tolist()))
    for pack in lanes.reshape(-1, LANES, 2):
        alone = np.unique(pack, axis=0)
        assert len(np.unique(alone)) == alone.size
