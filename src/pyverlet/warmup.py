"""Compile what a world needs before it is shown or timed, telling how far it is."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from pyverlet import _jit
from pyverlet.bounds import Boundary, Box, Circle, Open
from pyverlet.broadphase import BruteForce
from pyverlet.collisions import Collisions
from pyverlet.constants import ONE_THREAD_BELOW, SERIAL_BELOW, UNEVEN
from pyverlet.forces import Conservative, Drag
from pyverlet.group import Group
from pyverlet.links import Angle, Area, Pin, Spring, Stick
from pyverlet.obstacles import Segment
from pyverlet.passivity import Watch
from pyverlet.state import Slots
from pyverlet.world import World

OF_CIRCLES = (
    "bounds", "cage", "clusters", "contacts", "friction", "grid", "grips", "impacts", "loans", "measure", "motion", "packs",
    "pairs", "refine",
)  # fmt: skip
"""Modules of the kernels that every world of circles may need: how many there are is what progress is measured by."""

_ROOMS = (Open, Circle, Box)

Progress = Callable[[int, int], None]


def warm_up(world: World, progress: Progress | None = None) -> float:
    """Compile or load every kernel this world may need, without touching it.

    The first time on a machine all kernels that circles of the world's dtype need are compiled, so that nothing stalls when a
    setting is changed later: for one thread, or for several if the world uses several. Those of links, obstacles, the ledger and
    sleep are compiled when a world has them first. The compiled code is kept on disk, and later only what is in use is loaded.

    Args:
        world: the world about to be stepped.
        progress: called as progress(done, total) when a kernel begins to compile; not at all if none needs to.

    Returns:
        Seconds spent.
    """
    start = perf_counter()
    total = sum(name.split(".")[-2] in OF_CIRCLES for name in _jit.KERNELS)
    done = 0

    def started() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(min(done, total), total)

    with _jit.watch_compiling(started):
        if not _compiled_before(world.dtype, world.threads):
            _compile_all(world.dtype, world.threads)
            _remember_compiled(world.dtype, world.threads)
        _rehearse(world)
        _rehearse_forces(world)
        if world._sleep:
            _rehearse_sleep(world.dtype)
    if done and progress:
        progress(total, total)
    return perf_counter() - start


def _rehearse(world: World) -> None:
    """One frame of a small world of the same kind."""
    small = _lattice(
        _enough(world.threads) if len(world) < SERIAL_BELOW else SERIAL_BELOW,
        world.dtype,
        type(world.boundary),
        getattr(world.boundary, "restitution", 0.0),
        world.collisions,
        threads=world.threads,
        ledger=world.keeps_ledger,
        events=world.tells_events,
    )
    small.integrator = world.integrator
    if world.links:
        _link(small)
    if world.obstacles:
        small.obstacles.append(Segment((0, 0), (1, 0)))
    _use(small)
    if len(world) and type(world.boundary) not in _ROOMS:  # one circle in the world's own room, which has kernels of its own
        alone = World(boundary=world.boundary, collisions=None, substeps=1, dtype=world.dtype)
        alone.add(position=world.position[0], radius=world.radius[0])
        alone.step(1e-3)


def _rehearse_forces(world: World) -> None:
    """Evaluate our own kinds of force once, on a copy of the particles; others may count how often they are asked."""
    slots = Slots(world.dtype)
    slots.gather(world._state)
    for force in world.forces:
        if type(force).__module__.startswith("pyverlet."):
            force.apply(slots, world.time)
            if isinstance(force, Conservative):
                force.potential(world._state)


def _rehearse_sleep(dtype: np.dtype[Any]) -> None:
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


def _compile_all(dtype: np.dtype[Any], threads: int) -> None:
    for boundary, collisions in (
        (Circle, Collisions()),
        (Box, Collisions(restitution=0.5, friction=0.5)),
        (Open, Collisions(method=BruteForce())),
    ):
        small = _lattice(_enough(threads), dtype, boundary, 0.5, collisions, threads=threads)
        small.step(1e-3)
        small.friction[:] = 0.5
        small.step(1e-3)
        small.friction[:] = -1
        small.mass[0] *= 2 * UNEVEN
        small.save()
        small.forces.append(Drag(linear=0.1))
        _use(small)


def _link(world: World) -> None:
    """One link of every kind."""
    group = Group(world._state, slice(0, 4), world.remove)
    world.links.append(Stick(group, [0, 1], [1, 2], collide=False, breaking_force=1e9))
    world.links.append(Spring(group, 0, 2, stiffness=1.0))
    world.links.append(Angle(group, 0, 1, 2, compliance=1.0))
    world.links.append(Area(group, [0, 1, 2], area=1.0, compliance=1.0))
    world.links.append(Pin(group, 3))


def _use(world: World) -> None:
    world.step(1e-3)
    world.step(1e-3)  # by now somebody has moved far enough for a closer look at the list of pairs
    if world._contacts:
        Watch(world._state, world._force_sum, world.links).take_back(world._slots, world._contacts.listed(), 0.0)
    world.energy()
    world.momentum()
    world.overlap()


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
    world = World(boundary=room, collisions=collisions, substeps=1, dtype=dtype, threads=threads, ledger=ledger, events=events)
    row, column = np.divmod(np.arange(count), side)
    # Small ones for a second grid, and one fast enough to pass through the skin in a step.
    group = world.add(position=np.column_stack((column, row)) - 0.5 * side, radius=np.where(np.arange(count) % 4, 0.5, 0.05))
    group.velocity[-1] = (500.0, 0.0)
    return world


def _marker(dtype: np.dtype[Any], threads: int) -> Any:
    folder = _jit.cache_dir()
    return folder / f"compiled-{dtype.name}{'-threads' if threads > 1 else ''}" if folder else None


def _compiled_before(dtype: np.dtype[Any], threads: int) -> bool:
    marker = _marker(dtype, threads)
    return marker is not None and marker.exists()


def _remember_compiled(dtype: np.dtype[Any], threads: int) -> None:
    marker = _marker(dtype, threads)
    if marker is not None:
        with contextlib.suppress(OSError):
            marker.touch()
