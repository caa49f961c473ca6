"""Mouse tools: dragging and pushing particles; also pinning, adding and removing. On the physics thread only.

`History` undoes them: it stores worlds as they were before each action.
"""

from typing import Any

import numpy as np

from pyverlet.laws.forces import Grip, Push
from pyverlet.picture.view import nearest
from pyverlet.viewers.commands import Delete, Drag, Pin, PointerTool, Poke, Spawn
from pyverlet.viewers.layout import Layout
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

GRIP_FREQUENCY = 4.0  # Hz, of the spring between mouse and particle: it follows within a quarter of a second

LINKED_STRENGTH = 8.0
"""Factor of the drag spring for a particle linked to others: enough to tear a cloth; w h sqrt(8) stays below the stability limit
of 2 at one substep of 1/60 s."""

LEASH = 0.08  # longest stretch of the spring over the view, so that a flick of the mouse shoots no particle through a pile
POKE_RADIUS = 0.08  # over the view
POKE_TIME_S = 0.09  # s that a particle at rest near the middle of a poke takes to its rim: opens a heap to the ground
SPAWNED_RADIUS = 0.5  # m, in an empty world


class Pointers:
    """The pointers over a picture of one or more worlds. Each acts in the world where it was first pressed until it is released.

    Points are in the picture's coordinates, metres. The `forces` of the worlds get one entry for every pointer that holds
    something.
    """

    def __init__(self, *worlds: World) -> None:
        self._worlds = worlds
        self._world_of: dict[int, int] = {}
        self._held: dict[int, Grip | Push | None] = {}
        self._aim: dict[int, tuple[float, float]] = {}
        self._pinned: list[dict[int, float]] = [{} for _ in worlds]  # particle number -> mass before pinning

    @property
    def busy(self) -> bool:
        """Whether any pointer is pressed."""
        return bool(self._world_of)

    def is_down(self, pointer: int) -> bool:
        """Whether this pointer is already pressed, so that it only moves."""
        return pointer in self._world_of

    def use(self, command: PointerTool, layout: Layout) -> bool:
        """Apply a pointer command; returns whether it changed anything, or holds something.

        It takes the particle whose rim is nearest to the point, if within `reach`. A pointer that drags or pushes starts when it
        is pressed, and afterwards only moves.
        """
        panel = layout.at(command.x, command.y)
        if isinstance(command, Drag | Poke):
            panel = self._world_of.setdefault(command.pointer, panel)
        (dx, dy), world = layout.offset(panel), self._worlds[panel]
        point = command.x - dx, command.y - dy
        i = None
        if isinstance(command, Pin | Delete) or (isinstance(command, Drag) and command.pointer not in self._held):
            i = nearest(world, np.array(point), command.reach)
        match command:
            case Drag(pointer) | Poke(pointer):
                if pointer not in self._held:
                    self._hold(pointer, _grip(world, i, point) if isinstance(command, Drag) else _push(point, layout.size))
                self._aim[pointer] = point
                return self._held[pointer] is not None
            case Spawn():
                return _spawn(world, point)
            case Pin() if i is not None:
                _pin(world, i, self._pinned[panel])
            case Delete() if i is not None:
                world.remove(i)
        return i is not None

    def move(self, view_size: float) -> None:
        """Update the forces to the positions of the pointers; before every frame."""
        for pointer, force in self._held.items():
            if isinstance(force, Push):
                force.center = self._aim[pointer]
            elif force is not None and force.particle >= 0:
                world = self._worlds[self._world_of[pointer]]
                x, y = (float(value) for value in world.position[force.particle])
                dx, dy = world.boundary.periodic.nearest(np.array(self._aim[pointer]) - (x, y))
                shorten = min(1.0, LEASH * view_size / max(float(np.hypot(dx, dy)), 1e-30))
                force.target = (x + dx * shorten, y + dy * shorten)

    def release(self, pointer: int) -> None:
        """Release what this pointer holds."""
        panel, force = self._world_of.pop(pointer, 0), self._held.pop(pointer, None)
        self._aim.pop(pointer, None)
        if force is not None and force in self._worlds[panel].forces:
            self._worlds[panel].forces.remove(force)

    def release_all(self) -> None:
        """Release every pointer. Pins stay."""
        for pointer in list(self._world_of):
            self.release(pointer)

    def _hold(self, pointer: int, force: Grip | Push | None) -> None:
        self._held[pointer] = force
        if force is not None:
            self._worlds[self._world_of[pointer]].forces.append(force)


def _grip(world: World, i: int | None, point: tuple[float, float]) -> Grip | None:
    if i is None:
        return None
    return Grip(i, target=point, frequency=GRIP_FREQUENCY, strength=LINKED_STRENGTH if world.links.hold(i) else 1.0)


def _push(point: tuple[float, float], view_size: float) -> Push:
    radius = POKE_RADIUS * view_size
    return Push(center=point, radius=radius, acceleration=2.0 * radius / POKE_TIME_S**2)


def _pin(world: World, i: int, masses: dict[int, float]) -> None:
    """Pin a particle; or free a pinned one, with its previous mass."""
    number = int(world.number[i])
    if np.isfinite(world.mass[i]):
        masses[number] = float(world.mass[i])
        world.mass[i] = np.inf
    else:
        world.mass[i] = masses.pop(number, None) or usual_density(world) * float(world.radius[i]) ** 2
    world.velocity[i] = 0.0
    world.spin[i] = 0.0


def _spawn(world: World, point: tuple[float, float]) -> bool:
    """Add a circle of the usual radius and density, at rest; not outside the bounds or inside an obstacle.

    If it overlaps another, contacts separate them gradually.
    """
    free = bool(world.is_free(point)[0])
    if free:
        radius = float(np.median(world.radius)) if len(world) else SPAWNED_RADIUS
        world.add(position=point, velocity=0.0, radius=radius, mass=usual_density(world) * radius**2)
    return free


def usual_density(world: World) -> float:
    """Median of mass / radius^2 over the free circles, kg/m^2; 4 where there are none: 1 kg at 0.5 m."""
    free = np.isfinite(world.mass)
    return float(np.median(world.mass[free] / world.radius[free] ** 2)) if free.any() else 4.0


MOST = 50  # undo steps
CAPACITY = 256_000_000  # bytes for all of them, approximately; at least two are kept
EACH = 400  # approximate bytes per particle in a copy of a world


class History:
    """An undo history: actions on worlds, each with a copy of the whole state before it.

    An action lasts from pressing a pointer until it is released.
    """

    def __init__(self, panels: Panels) -> None:
        self._panels = panels
        self._back: list[Any] = []
        self._forth: list[Any] = []
        self._strokes: set[int] = set()
        self._before: Any = None

    @property
    def depth(self) -> tuple[int, int]:
        """Numbers of possible undos and redos."""
        return len(self._back), len(self._forth)

    def open(self, pointer: int) -> None:
        """Before an action of a pointer."""
        self._before = None if pointer in self._strokes else self._panels.save()

    def close(self, pointer: int, *, changed: bool) -> None:
        """After it; changed: whether it had any effect."""
        if changed and self._before is not None:
            self._back.append(self._before)
            self._forth.clear()
            self._strokes.add(pointer)
            most = max(2, min(MOST, CAPACITY // (EACH * max(1, sum(map(len, self._panels.worlds))))))
            del self._back[:-most]
        self._before = None

    def release(self, pointer: int) -> None:
        """End this pointer's action."""
        self._strokes.discard(pointer)

    def go(self, *, back: bool) -> bool:
        """Undo or redo one action; returns whether there was one."""
        source, to = (self._back, self._forth) if back else (self._forth, self._back)
        if not source:
            return False
        self._strokes.clear()
        to.append(self._panels.save())
        self._panels.restore(source.pop())
        return True
