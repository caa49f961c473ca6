"""Substeps in one compiled call, stage by stage or strip by strip, are to the last bit those that Python goes through."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import jit
from pyverlet.laws.contacts import broadphase, grids
from pyverlet.laws.contacts.solver import ContactSolver
from pyverlet.world import substeps

SECONDS = 1.5

slow = functools.partial(pytest.param, marks=pytest.mark.slow)
"""Each compiles a frame of its own."""


@pytest.fixture(autouse=True)
def slots_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in large worlds. Whether slots are sorted again changes the order of circles in a cell, and with it the last bits."""
    monkeypatch.setattr(broadphase, "FUSED_FROM", 2)


def take_the_long_way(patch: pytest.MonkeyPatch) -> None:
    """Python calls every stage."""
    patch.setattr(ContactSolver, "steady", lambda contacts, state: None)


class Fusing:
    """What worlds are fused, and how often, until `undo`: then none is. One of their own way may be small for once."""

    def __init__(self, patch: pytest.MonkeyPatch, *, by_strips: bool) -> None:
        self._patch, self._by_strips, self.substeps, self.leaps = patch, by_strips, 0, 0
        self.first_leaps = 0
        patch.setattr(substeps, "FUSED_FROM", 2 if by_strips else 10**9)
        go = substeps.Substeps.go

        def counted(run: substeps.Substeps, *about: Any, opens: bool = False) -> bool:
            before, gone = run.substep, go(run, *about, opens=opens)
            self.first_leaps += gone and opens
            self.substeps += (done := run.substep - before)
            self.leaps += max(done - 1, 0) + (run.leapt and done > 0)
            return gone

        patch.setattr(substeps.Substeps, "go", counted)

    def undo(self) -> None:
        take_the_long_way(self._patch)

    def has(self, world: pv.World) -> bool:
        """Whether this world has gone this way."""
        return "fused" in world.profile.stages if self._by_strips else self.substeps > 0


@pytest.fixture(params=["strips", "stages"])
def fusing(request: pytest.FixtureRequest, slots_in_order: None, monkeypatch: pytest.MonkeyPatch) -> Fusing:
    return Fusing(monkeypatch, by_strips=request.param == "strips")


@pytest.fixture
def by_strips(slots_in_order: None, monkeypatch: pytest.MonkeyPatch) -> Fusing:
    return Fusing(monkeypatch, by_strips=True)


@pytest.fixture
def by_stages(slots_in_order: None, monkeypatch: pytest.MonkeyPatch) -> Fusing:
    """Where links are, or loans, no world goes by strips."""
    return Fusing(monkeypatch, by_strips=False)


def heap(particles: int = 6000, seconds: float = SECONDS, **options: Any) -> pv.World:
    world = pv.scenes.get("cage").world(particles=particles)
    for name, value in options.items():
        setattr(world, name, value)
    world.run(seconds=seconds)
    return world


def fallen(seconds: float, **options: Any) -> pv.World:
    """A block of 1,000 that falls into a cage."""
    world = pv.World(boundary=pv.Circle(radius=26), **options)
    world.add(position=np.stack(np.meshgrid(np.arange(40.0) - 20, np.arange(25.0) - 16), axis=-1).reshape(-1, 2), radius=0.45)
    world.velocity[:] = np.random.default_rng(3).normal(0, 2, world.velocity.shape)
    world.run(seconds=seconds)
    return world


def same(one: pv.World, other: pv.World) -> bool:
    return one.state_hash() == other.state_hash() and np.array_equal(one._slots.resting, other._slots.resting)


@pytest.fixture(scope="module")
def expected() -> pv.World:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(broadphase, "FUSED_FROM", 2)
        take_the_long_way(patch)
        return heap()


def test_a_list_out_of_order_in_the_midst_of_a_frame(monkeypatch: pytest.MonkeyPatch, by_strips: Fusing) -> None:
    # The substep before has begun the next one, which then goes stage by stage.
    monkeypatch.setattr(broadphase, "FUSED_FROM", 10**9)
    world, fell_back = heap(6000, 0.1), 0
    for _ in range(100):
        world.step(1 / 60)
        fell_back += by_strips.has(world) and "contacts" in world.profile.stages
    assert fell_back > 3
    by_strips.undo()
    expected = heap(6000, 0.1)
    for _ in range(100):
        expected.step(1 / 60)
    assert same(world, expected)


@pytest.mark.parametrize("threads", range(1, jit.max_threads() + 1))
def test_the_bits_are_those_of_the_long_way(expected: pv.World, threads: int, fusing: Fusing) -> None:
    # Contacts, wall, deep pairs, lists made anew: 1.5 s of falling and crashing has them all.
    world = heap(threads=threads)
    assert fusing.has(world)
    assert same(world, expected)
    assert world.overlap().contacts > 1000
    assert world._contacts is not None
    assert world._contacts.broad_phase.rebuilds > 30


@pytest.mark.parametrize("parts", [2, 3, pytest.param(5, marks=pytest.mark.slow)])
def test_borders_between_threads_change_no_bit(parts: int, monkeypatch: pytest.MonkeyPatch, by_strips: Fusing) -> None:
    # As many parts as a machine with more cores would have; those of two threads may be done by one.
    monkeypatch.setattr(grids, "STRIP_PARTICLES", 32)  # rows enough for as many
    shared: set[int] = set()
    shares_out = substeps.Substeps._share_out

    def among_more(self: Any, strips: Any, lanes: Any, dtype: Any) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(jit, "threads_in_use", lambda: parts)
            shares_out(self, strips, lanes, dtype)
        shared.add(len(self._cut) - 1)

    monkeypatch.setattr(substeps.Substeps, "_share_out", among_more)
    world = heap(20_000, 0.7)
    by_strips.undo()
    assert shared == {parts}
    assert same(world, heap(20_000, 0.7))


@pytest.mark.parametrize("integrator", [pv.SemiImplicitEuler(), pv.VelocityVerlet(), pv.TimeCorrectedVerlet()], ids=repr)
def test_with_any_integrator(integrator: pv.Integrator, fusing: Fusing) -> None:
    world = heap(3000, 0.7, integrator=integrator)
    assert fusing.has(world)
    assert (fusing.first_leaps > 0) == integrator.leaps
    fusing.undo()
    assert same(world, heap(3000, 0.7, integrator=integrator))


def test_who_looks_on_sees_the_same(fusing: Fusing) -> None:
    def watched() -> tuple[pv.World, list[Any]]:
        world, seen = heap(3000, 0.7), []
        world.onlooker = lambda moment: seen.append((moment.time, [array.sum() for array in moment.look()]))
        world.run(seconds=0.1)
        return world, seen

    world, seen = watched()
    assert fusing.has(world)
    fusing.undo()
    expected, seen_then = watched()
    assert same(world, expected)
    assert seen == seen_then
    assert len(seen) == 6 * 7


def test_radii_that_differ_and_pinned_circles(fusing: Fusing) -> None:
    def uneven() -> pv.World:
        world = pv.World(boundary=pv.Circle(radius=40))
        x, y = np.meshgrid(np.arange(-25, 25, 1.05), np.arange(-25, 25, 1.05))
        world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=np.random.default_rng(0).uniform(0.4, 0.5, x.size))
        world.mass[7] = np.inf
        world.run(seconds=2)
        return world

    world = uneven()
    assert fusing.has(world)
    assert fusing.first_leaps
    fusing.undo()
    assert same(world, uneven())


def changed(change: Any, fusing: Fusing) -> pv.World:
    world = heap(2000, 0.2)
    change(world)
    fusing.substeps = fusing.leaps = 0
    world.run(seconds=0.1)
    return world


@pytest.mark.slow
def test_brute_force_goes_the_long_way(fusing: Fusing) -> None:
    def brutal(world: pv.World) -> None:
        world.collisions = pv.Collisions(method=pv.BruteForce())

    world = changed(brutal, fusing)
    assert not fusing.has(world)
    assert not fusing.substeps
    fusing.undo()
    assert same(world, changed(brutal, fusing))


class Thrust:
    """A force of one's own."""

    velocity_dependent = False

    def apply(self, state: Any, t: float) -> None:
        state.force[:, 0] += 0.1 * t * state.mass


def test_a_force_of_ones_own_is_asked_in_every_substep(fusing: Fusing) -> None:
    def thrust(world: pv.World) -> None:
        world.forces += [pv.Drag(linear=0.1), Thrust()]

    world = changed(thrust, fusing)
    assert (fusing.substeps, fusing.leaps) == (6 * world.substeps, 0)
    fusing.undo()
    assert same(world, changed(thrust, fusing))


@pv.force
def gust(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return 5.0 * mass * math.sin(9.0 * t + 0.1 * y), 0.0


@pv.force
def whirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -0.5 * y - 0.1 * vx, 0.5 * x - 0.1 * vy


def below(world: pv.World) -> float:
    """Where its lowest circles are."""
    return float(world.position[:, 1].min())


ALONG: dict[str, Any] = {
    "drag": lambda world: world.forces.append(pv.Drag(linear=0.1)),
    "wind": lambda world: world.forces.append(pv.Wind((3, 1), linear=0.1, quadratic=0.2)),
    "three forces": lambda world: world.forces.extend(
        [pv.PointSpring(stiffness=3), pv.ConstantForce((1, 2)), pv.Attractor(strength=5)]
    ),
    "segment": lambda world: world.obstacles.append(pv.Segment((-9, below(world)), (9, below(world) + 1), restitution=0.3)),
    "disc and drag": lambda world: (
        world.obstacles.append(pv.Disc((0, below(world)), 1)),
        world.forces.append(pv.Drag(quadratic=0.1)),
    ),
    "function": lambda world: world.forces.append(gust),
    "functions and drag": lambda world: world.forces.extend([whirl, pv.Drag(linear=0.1), gust]),
}
"""What a frame takes along."""


@pytest.mark.parametrize(
    ("mu", "change"),
    [
        pytest.param(mu, change, id=f"{mu}-{name}", marks=[pytest.mark.slow] if mu and "function" in name else [])
        for mu in (0.0, 0.5)
        for name, change in ALONG.items()
    ],
)
def test_forces_of_few_numbers_and_obstacles_that_stand_still_go_along(mu: float, change: Any, fusing: Fusing) -> None:
    def rough(world: pv.World) -> None:
        world.collisions = pv.Collisions(friction=mu)
        change(world)

    world = changed(rough, fusing)
    assert fusing.leaps == (0 if world.forces else 6 * (world.substeps - 1))  # forces are asked before each substep
    assert not same(world, changed(lambda world: setattr(world, "collisions", pv.Collisions(friction=mu)), fusing))
    fusing.undo()
    assert same(world, changed(rough, fusing))
    assert world._force_sum.t == changed(rough, fusing)._force_sum.t


def hang(world: pv.World) -> None:
    """A chain from a pin, which breaks, springs, ropes and angles across it, and areas, in the midst of the heap."""
    top = world.groups[0]
    world.links.append(pv.Stick(top, range(11), range(1, 12), breaking_force=50.0))
    world.links.append(pv.Pin(top, 0))
    world.links.append(pv.Spring(top, np.arange(10), np.arange(2, 12), stiffness=20.0, damping=0.1))
    world.links.append(pv.Rope(top, np.arange(0, 7, 3), np.arange(5, 12, 3)))
    world.links.append(pv.Angle(top, np.arange(8), np.arange(1, 9), np.arange(2, 10), compliance=0.1, damping=0.01))
    world.links.extend([pv.Area(top, [12, 13, 14], compliance=0.1), pv.Area(top, [13, 14, 15])])


@pytest.mark.parametrize(
    "change",
    [
        slow(lambda world: None, id="smooth"),
        pytest.param(lambda world: setattr(world, "collisions", pv.Collisions(friction=0.5, restitution=0.3)), id="rough"),
        slow(lambda world: world.forces.append(pv.Wind((3, 1), linear=0.1)), id="wind"),
        slow(
            lambda world: world.obstacles.append(pv.Segment((-9, below(world)), (9, below(world) + 1), friction=0.3)),
            id="segment",
        ),
        slow(lambda world: setattr(world, "boundary", pv.Box((-99, -99), (99, 99), friction=0.2)), id="box"),
    ],
)
def test_links_go_along(change: Any, by_stages: Fusing) -> None:
    def linked(world: pv.World) -> None:
        change(world)
        hang(world)

    world = changed(linked, by_stages)
    assert by_stages.leaps == 6 * (world.substeps - 1)
    by_stages.undo()
    assert same(world, changed(linked, by_stages))


@pytest.mark.parametrize(
    "name", ["newton-cradle", *(pytest.param(each, marks=pytest.mark.slow) for each in ("rope-bridge", "cloth"))]
)
def test_scenes_of_chains_go_along(name: str, by_stages: Fusing) -> None:
    def swung() -> pv.World:
        world = pv.scenes.get(name).world()
        world.run(seconds=0.5)
        return world

    world = swung()
    assert by_stages.leaps > 0.9 * world.frames * (world.substeps - 1)
    by_stages.undo()
    assert same(world, swung())


def test_forces_that_are_asked_leave_obstacles_to_compiled_code(fusing: Fusing) -> None:
    def both(world: pv.World) -> None:
        world.forces.append(Thrust())
        world.obstacles.append(pv.Segment((-9, below(world)), (9, below(world) + 1), friction=0.3))

    world = changed(both, fusing)
    assert (fusing.substeps, fusing.leaps) == (6 * world.substeps, 0)
    fusing.undo()
    assert same(world, changed(both, fusing))


@pytest.mark.parametrize("materials", [{}, {"restitution": 0.3, "friction": 0.5}], ids=["smooth", "both"])
def test_a_ledger_has_the_same_accounts(materials: dict[str, Any], fusing: Fusing) -> None:
    def kept() -> pv.World:
        return fallen(0.5, ledger=True, collisions=pv.Collisions(**materials))

    world = kept()
    assert fusing.leaps > 0.9 * world.frames * (world.substeps - 1)
    assert "ledger" in world.profile.stages
    fusing.undo()
    expected = kept()
    assert same(world, expected)
    assert world.ledger.as_dict() == expected.ledger.as_dict()


@pytest.mark.parametrize("stiffness", [None, 50.0])
def test_a_ledger_of_links_has_the_same_accounts(stiffness: float | None, by_stages: Fusing) -> None:
    def kept() -> pv.World:
        world = fallen(0.0, ledger=True, collisions=pv.Collisions(friction=0.3))
        world.links.append(pv.Stick(world.groups[0], range(39), range(1, 40)))
        if stiffness:
            world.links.append(pv.Spring(world.groups[0], 50, 52, stiffness=stiffness))
        world.run(seconds=0.5)
        return world

    world = kept()
    assert (by_stages.substeps > 0) == (stiffness is None)  # what springs hold Python asks them
    by_stages.undo()
    expected = kept()
    assert same(world, expected)
    assert world.ledger.as_dict() == expected.ledger.as_dict()
    assert world.ledger.links


@pytest.mark.parametrize(
    "change",
    [
        slow(lambda world: None, id="smooth"),
        pytest.param(lambda world: setattr(world, "collisions", pv.Collisions(friction=0.5, restitution=0.3)), id="rough"),
        slow(lambda world: world.forces.append(pv.Wind((3, 1), linear=0.1)), id="wind"),
        slow(
            lambda world: world.obstacles.append(pv.Segment((-9, below(world)), (9, below(world) + 1), friction=0.3)),
            id="segment",
        ),
        slow(lambda world: setattr(world, "boundary", pv.Circle(radius=world.boundary.radius, friction=0.5)), id="rough cage"),
        slow(hang, id="links"),
    ],
)
def test_circles_that_lend_each_other_inertia_go_along(change: Any, by_stages: Fusing) -> None:
    def uneven(world: pv.World) -> None:
        world.mass[::3] *= 100.0
        change(world)

    world = changed(uneven, by_stages)
    assert by_stages.leaps == 6 * (world.substeps - 1)
    assert world._contacts is not None
    assert world._contacts.lends
    by_stages.undo()
    assert same(world, changed(uneven, by_stages))


@pytest.mark.slow
def test_a_ledger_of_circles_that_lend(by_stages: Fusing) -> None:
    def kept() -> pv.World:
        world = fallen(0.0, ledger=True, collisions=pv.Collisions(friction=0.3))
        world.mass[::3] *= 100.0
        world.links.append(pv.Stick(world.groups[0], range(39), range(1, 40)))
        world.run(seconds=0.5)
        return world

    world = kept()
    assert by_stages.leaps > 0.9 * world.frames * (world.substeps - 1)
    by_stages.undo()
    expected = kept()
    assert same(world, expected)
    assert world.ledger.as_dict() == expected.ledger.as_dict()


def test_as_long_as_nobody_sleeps(fusing: Fusing) -> None:
    world = fallen(0.2, sleep=True)
    assert fusing.leaps > 0
    fusing.undo()
    assert same(world, fallen(0.2, sleep=True))


@pytest.mark.parametrize(
    "change",
    [
        lambda world: setattr(world, "collisions", pv.Collisions(friction=0.5)),
        lambda world: setattr(world, "collisions", pv.Collisions(restitution=0.5)),
        lambda world: setattr(world, "collisions", pv.Collisions(restitution=0.5, friction=0.5)),
        lambda world: setattr(world, "boundary", pv.Circle(radius=world.boundary.radius, friction=0.5)),
        lambda world: setattr(world, "boundary", pv.Circle(radius=world.boundary.radius, restitution=0.5)),
        lambda world: setattr(world, "boundary", pv.Box((-99, -99), (99, 99))),
        lambda world: setattr(world, "boundary", pv.Open()),
        lambda world: world.radius.__setitem__(slice(None, None, 2), 0.15),
    ],
    ids=["friction", "bounces", "both", "rough cage", "bouncy cage", "box", "open", "many sizes"],
)
def test_other_rooms_and_sizes_go_stage_by_stage(change: Any, fusing: Fusing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grids, "CELLS_PER_PARTICLE", 99)  # so few, so thinly spread, would have no second grid
    world = changed(change, fusing)
    assert "fused" not in world.profile.stages
    assert fusing.leaps == 6 * (world.substeps - 1)  # the first substep of a frame is begun by nobody
    fusing.undo()
    assert same(world, changed(change, fusing))


def test_a_frame_that_was_broken_off_leaves_nothing_behind(fusing: Fusing) -> None:
    def interrupted() -> pv.World:
        world = heap(3000, 0.7)
        assert world._contacts is not None
        set_up, last = world._contacts.set_up, world.frames + 5

        def interrupt(*about: Any, **options: Any) -> Any:
            if world.frames == last:
                raise KeyboardInterrupt
            return set_up(*about, **options)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(world._contacts, "set_up", interrupt)
            with pytest.raises(KeyboardInterrupt):
                world.run(seconds=0.2)
        world.position[:50] = world.position[-50:] + 1e-3  # nobody may rely on who was near whom before
        world.step(1 / 60)
        return world

    world = interrupted()
    fusing.undo()
    assert same(world, interrupted())


def test_a_list_that_was_broken_off_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    world = heap(3000, 0.7)
    assert world._contacts is not None
    phase = world._contacts.broad_phase
    assert phase.strips() is not None

    def interrupt(*arguments: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("pyverlet.kernels.pairs.list_pairs", interrupt)
        with pytest.raises(KeyboardInterrupt):
            world.run(seconds=1)
    assert phase.strips() is None
    world.run(seconds=0.5)
    assert world.overlap().max < 0.2
    assert not world.escaped()
