"""Small worlds that need the same kernels as large ones, stepped once or twice so that these are compiled, or loaded from disk.

`PARTS` divides what worlds of circles may need into parts that have little in common: several processes compile several parts at
once. What a small world needs beyond its part is looked for on disk first, so that no part depends on another.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.ground.constants import FUSED_FROM, KNOWN_FROM, LINKS_ONE_THREAD_BELOW, ONE_THREAD_BELOW, UNEVEN
from pyverlet.kernels.motion import ON_WALL
from pyverlet.laws.contacts import _held_rooms
from pyverlet.laws.contacts.broadphase import start
from pyverlet.laws.contacts.collisions import Collisions
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.laws.forces import Conservative, Drag, Force
from pyverlet.laws.limiter import Watch
from pyverlet.laws.links import Angle, Area, Link, Pin, Rope, Spring, Stick
from pyverlet.laws.obstacles import Segment
from pyverlet.laws.rooms import Boundary, Box, Circle, Open, Periodic
from pyverlet.state.group import Group
from pyverlet.state.slots import Slots
from pyverlet.world.world import World

_ROOMS = (Open, Circle, Box, Periodic)


def rehearse(world: World) -> None:
    """What this world needs: frames of a small one of the same kind, its forces, and sleep."""
    if world.collisions:  # stage by stage, as beside pegs or moving obstacles; lists come last, for helpers begin with them
        law = {"restitution": world.collisions.restitution, "friction": world.collisions.friction}
        staged = _small(world.dtype, world.threads, Open, **law)
        _make_alike(staged, world)
        _obstruct(staged, world)
        staged.step(1e-3)
    small = _lattice(
        max(
            _enough(world.threads),
            *(least for least in (0, ONE_THREAD_BELOW, LINKS_ONE_THREAD_BELOW, KNOWN_FROM) if len(world) >= least),
        ),
        world.dtype,
        type(world.boundary),
        getattr(world.boundary, "restitution", 0.0),
        world.collisions,
        threads=world.threads,
        ledger=world.keeps_ledger,
        events=world.tells_events,
    )
    small.integrator, small.substeps = world.integrator, 2  # the second leans on the first
    if world.links:
        _link(small, {type(link) for link in world.links})
    if _obstruct(small, world):
        small.is_free((0, 0))
    known = Slots(world.dtype)
    for force in _ours(world):
        if (row := getattr(force, "compiled", None) or getattr(force, "native", None)) and row(known):
            small.forces.append(force)
    _make_alike(small, world)
    _use(small)
    if len(world) >= FUSED_FROM:
        _fuse(world)
    if len(world) and type(world.boundary) not in _ROOMS:  # one circle in the world's own room, which has kernels of its own
        alone = World(boundary=world.boundary, collisions=None, substeps=1, dtype=world.dtype)
        alone.add(position=world.position[0], radius=world.radius[0], allow_overlap=True)
        alone.step(1e-3)
    _forces(world)
    if world._sleep:
        _sleep(world.dtype)


def _make_alike(small: World, world: World) -> None:
    """Of circles as different in mass, some pinned if any are, and some as elastic and rough, as any."""
    if (masses := world.mass[np.isfinite(world.mass)]).size and masses.max() > UNEVEN * masses.min():
        small.mass[0] *= 2 * UNEVEN
    if np.isinf(world.mass).any():
        small.mass[-1] = np.inf
    if len(world):
        small.restitution[0], small.friction[0] = world.restitution.max(), world.friction.max()


def _obstruct(small: World, world: World) -> bool:
    """An obstacle, if there are any: as elastic as the most elastic."""
    if world.obstacles:
        small.obstacles.append(Segment((0, 0), (1, 0), restitution=max(each.restitution for each in world.obstacles)))
    return len(small.obstacles) > 0


def _fuse(world: World) -> None:
    """A frame of equal circles in a cage, of which none touches another, so many that their substeps are fused."""
    side = int(np.ceil(np.sqrt(FUSED_FROM)))
    small = World(boundary=Circle(radius=2.0 * side), substeps=1, dtype=world.dtype, threads=world.threads)
    row, column = np.divmod(np.arange(side * side), side)
    small.add(position=2.0 * np.column_stack((column, row)) - side, radius=0.5)
    small.step(1e-3)


def _forces(world: World) -> None:
    """Evaluate our own kinds of force once, on a copy of the particles."""
    slots = Slots(world.dtype)
    slots.gather(world._state)
    for force in _ours(world):
        force.apply(slots, world.time)
        if isinstance(force, Conservative):
            force.potential(world._state)


def _ours(world: World) -> list[Force]:
    """Its forces of our own kinds: others may count how often they are asked."""
    return [force for force in world.forces if type(force).__module__.startswith("pyverlet.")]


def _sleep(dtype: np.dtype[Any]) -> None:
    """Two circles fall asleep, are looked at, and are woken by a third."""
    small = World(gravity=(0, 0), substeps=1, dtype=dtype, sleep=True)
    small.add(position=[(0, 0), (1, 0)], radius=0.5)
    small.step(1.0)
    small.step(1.0)
    small.add(position=(3, 0), velocity=(-2, 0), radius=0.5)
    small.step(1.0)


def _enough(threads: int) -> int:
    """Particles for a world to use so many threads."""
    return 9 if threads == 1 else ONE_THREAD_BELOW


def _link(world: World, kinds: set[type[Link]]) -> None:
    """One link of every kind that a chain is made of; one of every kind, if there are others; then, for several threads, many."""
    group = Group(world._state, slice(0, len(world)), world.remove)
    world.links.append(Stick(group, [0, 1], [1, 2], collide=False, breaking_force=1e9))
    world.links.append(Spring(group, 0, 2, stiffness=1.0))
    world.links.append(Pin(group, 3))
    if not kinds <= {Stick, Spring, Rope, Pin}:
        world.step(1e-3)
        world.links.append(Angle(group, 0, 1, 2, compliance=1.0))
        world.links.append(Area(group, [0, 1, 2], area=1.0, compliance=1.0))
    if world.threads > 1 and len(world) >= LINKS_ONE_THREAD_BELOW:
        world.step(1e-3)
        world.links.append(Stick(group, np.arange(len(world) - 1), np.arange(1, len(world))))


def _use(world: World) -> None:
    world.step(1e-3)
    world.step(1e-3)  # by now somebody has moved far enough for a closer look at the list of pairs
    if world._contacts:
        _take_back(world, world._slots, world._contacts.listed())
    _lean(world)
    world.energy()
    world.momentum()
    world.overlap()


def _take_back(world: World, slots: Slots, listed: tuple[Any, ...]) -> None:
    """Contacts have brought energy."""
    Watch(world._state, world._force_sum, world.links, world.boundary, world._course, 1e-3).take_back(slots, listed, 0.0)


def _lean(world: World) -> None:
    """At the end of a frame somebody has come to rest on a smooth wall."""
    world._slots.resting[:1], world._slots.along = ON_WALL, world._slots.along[:0]
    _held_rooms.leave(world.boundary, world._slots)


def _lattice(
    count: int, dtype: np.dtype[Any], boundary: type[Boundary], restitution: float, collisions: Collisions | None,
    *, threads: int, ledger: bool = False, events: bool = False,
) -> World:  # fmt: skip
    side = int(np.ceil(np.sqrt(count)))
    room: Boundary = Open()
    if boundary is Circle:
        room = Circle(radius=2.0 * side, restitution=restitution)
    elif boundary is Box:
        room = Box((-side, -side), (side, side), restitution=restitution)
    elif boundary is Periodic:
        room = Periodic((-side, -side), (side, side))
    world = World(boundary=room, collisions=collisions, substeps=1, dtype=dtype, threads=threads, ledger=ledger, events=events)
    row, column = np.divmod(np.arange(count), side)
    # Small ones for a second grid, and one fast enough to pass through the skin in a step.
    group = world.add(position=np.column_stack((column, row)) - 0.5 * side, radius=np.where(np.arange(count) % 4, 0.5, 0.05))
    group.velocity[-1] = (500.0, 0.0)
    return world


# ---- what circles may need, in parts -----------------------------------------------------------------------------------


def _small(dtype: np.dtype[Any], threads: int, boundary: type[Boundary], elastic: float = 0.0, **collisions: Any) -> World:
    """A world whose pairs are listed in the simple way, which is soon compiled. elastic: restitution of its walls."""
    how = Collisions(method=BruteForce(), **collisions)
    return _lattice(_enough(threads), dtype, boundary, elastic, how, threads=threads)


def _lists(dtype: np.dtype[Any], threads: int) -> None:
    """Grids and lists: made, found too old once somebody has moved, and made anew; and what is taken back by them."""
    world = _lattice(_enough(threads), dtype, Open, 0.0, None, threads=threads)
    jit.use_threads(world.threads)
    world.overlap()
    slots, phase = Slots(dtype), start(Fast(), dtype)
    slots.gather(world._state)
    slots.h = 1e-3
    for _ in range(2):
        phase.update(slots)
        slots.position[-1] += 10.0
    _take_back(world, slots, phase.list.listed())


def _cages(dtype: np.dtype[Any], threads: int) -> None:
    """Circles in a cage, smooth or not; saved, which takes down what they have slipped."""
    for elastic in (0.0, 0.5):
        world = _small(dtype, threads, Circle, elastic, friction=elastic)
        _use(world)
        world.save()


def _boxes(dtype: np.dtype[Any], threads: int) -> None:
    """Circles that bounce, in a box."""
    _small(dtype, threads, Box, 0.5, restitution=0.5).step(1e-3)


def _uneven(dtype: np.dtype[Any], threads: int) -> None:
    """Circles of very different masses."""
    _lend(dtype, threads)


def _uneven_rough(dtype: np.dtype[Any], threads: int) -> None:
    """The same, that rub."""
    _lend(dtype, threads, friction=0.5)


def _uneven_bouncing(dtype: np.dtype[Any], threads: int) -> None:
    """The same, that bounce."""
    _lend(dtype, threads, restitution=0.5)


def _lend(dtype: np.dtype[Any], threads: int, **collisions: float) -> None:
    world = _small(dtype, threads, Open, **collisions)
    world.mass[0] *= 2 * UNEVEN
    world.step(1e-3)


def _motion(dtype: np.dtype[Any], threads: int) -> None:
    """Forces and measures."""
    world = _lattice(_enough(threads), dtype, Open, 0.0, None, threads=threads)
    world.forces.append(Drag(linear=0.1))
    _use(world)
    jit.use_threads(world.threads)


PARTS: dict[str, Callable[[np.dtype[Any], int], None]] = {
    part.__name__: part for part in (_lists, _motion, _cages, _uneven_rough, _boxes, _uneven, _uneven_bouncing)
}
"""Each compiles a part of what circles of a dtype on so many threads may need. First what each world needs."""
