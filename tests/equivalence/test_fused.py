"""A substep strip by strip is, to the last bit, a substep stage by stage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import _jit, broadphase, fused, grids

SECONDS = 1.5


@pytest.fixture(autouse=True)
def slots_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in large worlds. Whether slots are sorted again changes the order of circles in a cell, and with it the last bits."""
    monkeypatch.setattr(broadphase, "FUSED_FROM", 2)


@pytest.fixture
def small_ones_too(slots_in_order: None) -> Iterator[pytest.MonkeyPatch]:
    """Fused worlds need not be large for once; until `undo`."""
    patch = pytest.MonkeyPatch()
    patch.setattr(fused, "FUSED_FROM", 2)
    yield patch
    patch.undo()


def heap(particles: int = 6000, seconds: float = SECONDS, **options: Any) -> pv.World:
    world = pv.scenes.get("cage").world(particles=particles)
    for name, value in options.items():
        setattr(world, name, value)
    world.run(seconds=seconds)
    return world


def is_fused(world: pv.World) -> bool:
    return "fused" in world.profile.stages


def same(one: pv.World, other: pv.World) -> bool:
    return one.state_hash() == other.state_hash() and np.array_equal(one._slots.resting, other._slots.resting)


@pytest.fixture(scope="module")
def by_stages() -> pv.World:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(broadphase, "FUSED_FROM", 2)
        world = heap()
    assert not is_fused(world)
    return world


def test_a_list_out_of_order_in_the_midst_of_a_frame(monkeypatch: pytest.MonkeyPatch, small_ones_too: pytest.MonkeyPatch) -> None:
    # The substep before has begun the next one, which then goes stage by stage; those after it must be begun anew.
    monkeypatch.setattr(broadphase, "FUSED_FROM", 10**9)
    world, fell_back = heap(6000, 0.1), 0
    for _ in range(100):
        world.step(1 / 60)
        fell_back += is_fused(world) and "contacts" in world.profile.stages
    assert fell_back > 3
    small_ones_too.undo()
    expected = heap(6000, 0.1)
    for _ in range(100):
        expected.step(1 / 60)
    assert same(world, expected)


@pytest.mark.usefixtures("small_ones_too")
@pytest.mark.parametrize("threads", range(1, _jit.max_threads() + 1))
def test_the_bits_are_those_of_the_stages(by_stages: pv.World, threads: int) -> None:
    # Contacts, wall, deep pairs, lists made anew: 1.5 s of falling and crashing has them all.
    world = heap(threads=threads)
    assert is_fused(world)
    assert same(world, by_stages)
    assert world.overlap().contacts > 1000
    assert world._contacts is not None
    assert world._contacts.broad_phase.rebuilds > 50


@pytest.mark.parametrize("parts", [2, 3, 5])
def test_borders_between_threads_change_no_bit(
    parts: int, monkeypatch: pytest.MonkeyPatch, small_ones_too: pytest.MonkeyPatch
) -> None:
    # As many parts as a machine with more cores would have; those of two threads may be done by one.
    monkeypatch.setattr(grids, "STRIP_PARTICLES", 32)  # rows enough for as many
    shared: set[int] = set()
    shares_out = fused.Fused._share_out

    def among_more(self: Any, strips: Any, lanes: Any, dtype: Any) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_jit, "threads_in_use", lambda: parts)
            shares_out(self, strips, lanes, dtype)
        shared.add(len(self._cut) - 1)

    small_ones_too.setattr(fused.Fused, "_share_out", among_more)
    world = heap(20_000, 0.7)
    small_ones_too.undo()
    assert shared == {parts}
    assert same(world, heap(20_000, 0.7))


@pytest.mark.parametrize("integrator", [pv.SemiImplicitEuler(), pv.VelocityVerlet(), pv.TimeCorrectedVerlet()], ids=repr)
def test_with_any_integrator(integrator: pv.Integrator, small_ones_too: pytest.MonkeyPatch) -> None:
    world = heap(3000, 0.7, integrator=integrator)
    assert is_fused(world)
    small_ones_too.undo()
    assert same(world, heap(3000, 0.7, integrator=integrator))


def test_who_looks_on_sees_the_same(small_ones_too: pytest.MonkeyPatch) -> None:
    def watched() -> tuple[pv.World, list[Any]]:
        world, seen = heap(3000, 0.7), []
        world.onlooker = lambda moment: seen.append((moment.time, [array.sum() for array in moment.look()]))
        world.run(seconds=0.1)
        return world, seen

    world, seen = watched()
    assert is_fused(world)
    small_ones_too.undo()
    expected, seen_then = watched()
    assert same(world, expected)
    assert seen == seen_then
    assert len(seen) == 6 * 7


def test_radii_that_differ_and_pinned_circles(small_ones_too: pytest.MonkeyPatch) -> None:
    def uneven() -> pv.World:
        world = pv.World(boundary=pv.Circle(radius=40))
        x, y = np.meshgrid(np.arange(-25, 25, 1.05), np.arange(-25, 25, 1.05))
        world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=np.random.default_rng(0).uniform(0.4, 0.5, x.size))
        world.mass[7] = np.inf
        world.run(seconds=2)
        return world

    world = uneven()
    assert is_fused(world)
    small_ones_too.undo()
    assert same(world, uneven())


@pytest.mark.parametrize(
    "change",
    [
        lambda world: world.forces.append(pv.Drag(linear=0.1)),
        lambda world: setattr(world, "boundary", pv.Circle(radius=world.boundary.radius, friction=0.5)),
        lambda world: setattr(world, "boundary", pv.Open()),
        lambda world: setattr(world, "collisions", pv.Collisions(friction=0.5)),
        lambda world: setattr(world, "collisions", pv.Collisions(restitution=0.5)),
        lambda world: setattr(world, "collisions", pv.Collisions(method=pv.BruteForce())),
        lambda world: world.links.append(pv.Stick(world.add(position=[(0, 99), (1, 99)], radius=0.1), 0, 1)),
        lambda world: world.add(position=(0, 0), radius=0.02),
    ],
    ids=["force", "rough cage", "open", "friction", "bounces", "brute force", "link", "many sizes"],
)
def test_whatever_more_there_is_goes_stage_by_stage(change: Any, small_ones_too: pytest.MonkeyPatch) -> None:
    def changed() -> pv.World:
        world = heap(2000, 0.2)
        change(world)
        world.run(seconds=0.1)
        return world

    world = changed()
    assert not is_fused(world)
    small_ones_too.undo()
    assert same(world, changed())


def test_a_frame_that_was_broken_off_leaves_nothing_behind(small_ones_too: pytest.MonkeyPatch) -> None:
    def interrupted(at: int) -> pv.World:
        world, calls = heap(3000, 0.7), 0
        assert world._contacts is not None
        find = world._contacts.find

        def interrupt(state: Any, lag: float) -> None:
            nonlocal calls
            calls += 1
            if calls == at:
                raise KeyboardInterrupt
            find(state, lag)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(world._contacts, "find", interrupt)
            with pytest.raises(KeyboardInterrupt):
                world.run(seconds=0.2)
        world.position[:50] = world.position[-50:] + 1e-3  # nobody may rely on who was near whom before
        world.step(1 / 60)
        return world

    world = interrupted(20)
    small_ones_too.undo()
    assert same(world, interrupted(20))
