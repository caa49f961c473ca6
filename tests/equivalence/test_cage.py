"""A cage that holds eight circles at a time against one that meets one after the other: the same bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.compile import jit
from pyverlet.kernels import bounds
from pyverlet.kernels import cage as kernels
from pyverlet.laws.contacts._held import circles, claims
from pyverlet.laws.rooms import Circle
from pyverlet.state.slots import Slots

H = 1 / 480
CHANGED = ("position", "velocity", "resting", "hits")


def note_turn(slots: Slots) -> None:
    """Circles rub each other: `turn` is what their spin makes it, nobody's `lift` is known yet."""
    slots.turn, slots.lift = slots.spin * slots.real(H), np.zeros_like(slots.spin)


def crowd(seed: int, n: int, speed: float, dtype: Any) -> Slots:
    """Circles in and around a cage of radius 10 m about (1, 2), some of them pinned, some faster than a room width a substep."""
    rng = np.random.default_rng(seed)
    angle, distance = rng.uniform(0, 2 * np.pi, n), 10 * rng.uniform(0.5, 1.1, n)
    world = pv.World(dtype=dtype)
    world.add(
        position=np.column_stack((1 + distance * np.cos(angle), 2 + distance * np.sin(angle))),
        velocity=rng.normal(0, speed, (n, 2)),
        radius=rng.uniform(0.1, 1, n),
        mass=np.where(rng.random(n) < 0.1, np.inf, 1.0),
    )
    slots = Slots(np.dtype(dtype))
    slots.gather(world._state)
    slots.acceleration[:] = rng.normal(0, 10, (n, 2))
    slots.hits[:] = rng.normal(0, 5, n)
    return slots


def hold(slots: Slots, lag: float) -> None:
    """The smooth cage of radius 10 m about (1, 2), eight at a time."""
    kernels.hold(circles(slots), *slots.reals(1, 2, 10, H, lag, 0.08), 0, slots.real(0), claims(slots))


def meet_one_by_one(slots: Slots, lag: float, restitution: float = 0.0, friction: float = 0.0) -> None:
    """The cage of radius 10 m about (1, 2), circle after circle."""
    slots.resting[:] = 0
    for i in np.flatnonzero(slots.inverse_mass > 0):
        seen = bounds.look(i, circles(slots))._asdict()  # Python has numbers of one size only
        whole = ("fed", "resting", "to_impact", "to_friction")
        body = bounds.Body(**{name: value if name in whole else slots.real(value) for name, value in seen.items()})
        body = bounds.at_cage(body, *slots.reals(1, 2, 10, H, lag, restitution, friction, 0.08))
        bounds.put(i, body, circles(slots))


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 100),
    speed=st.sampled_from([0.0, 0.02, 3.0, 1e4]),
    lag=st.sampled_from([0.0, H / 2]),
    dtype=st.sampled_from([np.float32, np.float64]),
)
@settings(max_examples=200, deadline=None)
def test_eight_at_a_time_are_one_after_the_other(seed: int, n: int, speed: float, lag: float, dtype: Any) -> None:
    one, eight = crowd(seed, n, speed, dtype), crowd(seed, n, speed, dtype)
    meet_one_by_one(one, lag)
    hold(eight, lag)
    for name in CHANGED:
        assert getattr(one, name).tobytes() == getattr(eight, name).tobytes(), name


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 60),
    speed=st.sampled_from([0.0, 0.02, 3.0]),
    lag=st.sampled_from([0.0, H / 2]),
    dtype=st.sampled_from([np.float32, np.float64]),
    wall=st.sampled_from([(0.0, 0.0), (0.3, 0.0), (0.0, 0.5), (0.5, 0.7)]),
    rubs=st.booleans(),
)
@settings(max_examples=100, deadline=None)
def test_so_are_circles_of_any_material(
    seed: int, n: int, speed: float, lag: float, dtype: Any, wall: tuple[float, float], rubs: bool
) -> None:
    one, eight = (crowd(seed, n, speed, dtype) for _ in range(2))
    for slots in (one, eight):
        rng = np.random.default_rng(seed)
        slots.spin[:] = rng.normal(0, 1, n)
        slots.restitution[:] = rng.choice([-1.0, 0.0, 0.5], n)
        slots.friction[:] = rng.choice([-1.0, 0.0, 0.7], n)
        slots.fed[:] = rng.integers(0, 16, n)
        if rubs:
            note_turn(slots)
            slots.note_start()
            slots.start += rng.normal(0, 0.01, (n, 2)).astype(dtype)
            slots.lift[:] = rng.choice([0.0, 1e-3], n)
    meet_one_by_one(one, lag, *wall)
    cage = Circle(center=(1, 2), radius=10, restitution=wall[0], friction=wall[1])
    cage.confine(eight, H, lag, 0.08)
    for name in (*CHANGED, "spin", "fed", "turn"):
        assert getattr(one, name).tobytes() == getattr(eight, name).tobytes(), name


@pytest.mark.skipif(jit.max_threads() < 2, reason="one core")
def test_any_number_of_threads_gives_the_same() -> None:
    results = []
    for count in (1, 2):
        slots = crowd(0, 10_000, 3.0, np.float32)
        jit.use_threads(count)
        try:
            Circle(center=(1, 2), radius=10).confine(slots, H, 0.0, 0.08)
        finally:
            jit.use_threads(1)
        results.append([getattr(slots, name).tobytes() for name in CHANGED])
    assert results[0] == results[1]


@pytest.mark.parametrize("change", ["bouncy wall", "rough wall", "bouncy circle", "circles that rub"])
def test_circles_that_bounce_or_rub_do_so(change: str) -> None:
    slots = crowd(0, 100, 3.0, np.float64)
    cage = Circle(center=(1, 2), radius=10, restitution=0.5 * (change == "bouncy wall"), friction=0.5 * (change == "rough wall"))
    if change == "bouncy circle":
        slots.restitution[:] = slots.most_restitution = 0.5
    if change == "circles that rub":
        note_turn(slots)
        slots.lift[:] = 0.1
    smooth = crowd(0, 100, 3.0, np.float64)
    cage.confine(slots, H, 0.0, 0.08)
    Circle(center=(1, 2), radius=10).confine(smooth, H, 0.0, 0.08)
    # They bounce; or rub; or, at rest against others that rub, leave with the velocity that gravity takes again.
    assert np.abs(slots.velocity - smooth.velocity).max() > 1e-3
