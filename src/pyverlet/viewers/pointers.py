"""Mouse tools: each pointer drags a particle or pushes particles away; also pin, add and remove. On the physics thread only."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.laws.forces import Grip, Push
from pyverlet.picture.view import nearest
from pyverlet.viewers.layout import Layout
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

GRIP_FREQUENCY = 4.0  # Hz of the spring between mouse and particle: it follows the mouse within a quarter of a second

LINKED_STRENGTH = 8.0
"""How much harder a particle is pulled that is linked to others: enough to tear a cloth, and w h sqrt(8) stays
below 2, where it would become unstable, at one substep of 1/60 s."""

LEASH = 0.08  # the spring stretches to this part of the view at most: a flick of the mouse shoots no particle through a pile
POKE_RADIUS = 0.08  # of the view
POKE_TIME_S = 0.09  # seconds a particle at rest near the middle of a poke takes to its rim: opens a heap to the ground
SPAWNED_RADIUS = 0.5  # m, in a world that is empty


class Pointers:
    """What the pointers over a picture of one or more worlds hold. Each works in the world it first came down on until released.

    Points are given in the picture's coordinates, metres; without a `layout` those of the first world. The `forces` of the worlds
    gain one entry for every pointer that holds something.
    """

    def __init__(self, *worlds: World) -> None:
        self._worlds = worlds
        self._world_of: dict[int, int] = {}
        self._held: dict[int, Grip | Push | None] = {}
        self._aim: dict[int, tuple[float, float]] = {}
        self._pinned: list[dict[int, float]] = [{} for _ in worlds]  # particle number -> mass before it was pinned

    @property
    def busy(self) -> bool:
        """Whether any pointer is down."""
        return bool(self._world_of)

    def is_down(self, pointer: int) -> bool:
        """Whether this pointer is down already: then it only aims anew."""
        return pointer in self._world_of

    def drag(self, pointer: int, x: float, y: float, reach: float, layout: Layout | None = None) -> bool:
        """Aim this pointer at (x, y); returns whether it holds anything.

        A new pointer first takes the particle whose rim is nearest, if within `reach` metres.
        """
        panel, x, y = self._locate(x, y, layout, pointer)
        if pointer not in self._held:
            world = self._worlds[panel]
            i = nearest(world, np.array([x, y]), reach)
            strength = LINKED_STRENGTH if i is not None and world.links.hold(i) else 1.0
            grip = None if i is None else Grip(i, target=(x, y), frequency=GRIP_FREQUENCY, strength=strength)
            self._hold(pointer, grip)
        self._aim[pointer] = (x, y)
        return self._held[pointer] is not None

    def poke(self, pointer: int, x: float, y: float, view_size: float, layout: Layout | None = None) -> None:
        """Push everything around (x, y) away from it. `view_size`, metres, sets how wide."""
        _, x, y = self._locate(x, y, layout, pointer)
        if pointer not in self._held:
            radius = POKE_RADIUS * view_size
            self._hold(pointer, Push(center=(x, y), radius=radius, acceleration=2.0 * radius / POKE_TIME_S**2))
        self._aim[pointer] = (x, y)

    def move(self, view_size: float) -> None:
        """Bring the forces to where the pointers aim; before every frame."""
        for pointer, force in self._held.items():
            if isinstance(force, Push):
                force.center = self._aim[pointer]
            elif force is not None and force.particle >= 0:
                world = self._worlds[self._world_of[pointer]]
                x, y = (float(value) for value in world.position[force.particle])
                dx, dy = world.boundary.seam.nearest(np.array(self._aim[pointer]) - (x, y))
                shorten = min(1.0, LEASH * view_size / max(float(np.hypot(dx, dy)), 1e-30))
                force.target = (x + dx * shorten, y + dy * shorten)

    def release(self, pointer: int) -> None:
        """Let go of what this pointer holds, if anything."""
        panel, force = self._world_of.pop(pointer, 0), self._held.pop(pointer, None)
        self._aim.pop(pointer, None)
        if force is not None and force in self._worlds[panel].forces:
            self._worlds[panel].forces.remove(force)

    def release_all(self) -> None:
        """Release every pointer. Pins stay."""
        for pointer in list(self._world_of):
            self.release(pointer)

    def pin(self, x: float, y: float, reach: float, layout: Layout | None = None) -> bool:
        """Pin the particle whose rim is nearest to (x, y), if within `reach`, metres; a pinned one becomes free.

        Returns whether there was one.
        """
        panel, x, y = self._locate(x, y, layout)
        world, masses = self._worlds[panel], self._pinned[panel]
        i = nearest(world, np.array([x, y]), reach)
        if i is None:
            return False
        number = int(world.number[i])
        if np.isfinite(world.mass[i]):
            masses[number] = float(world.mass[i])
            world.mass[i] = np.inf
        else:
            world.mass[i] = masses.pop(number, None) or usual_density(world) * float(world.radius[i]) ** 2
        world.velocity[i] = 0.0
        world.spin[i] = 0.0
        return True

    def spawn(self, x: float, y: float, layout: Layout | None = None) -> None:
        """Add a circle of the usual radius and density at (x, y), at rest. On top of another it starts small and grows.

        None is added outside the bounds or inside an obstacle.
        """
        panel, x, y = self._locate(x, y, layout)
        world = self._worlds[panel]
        if world.is_free((x, y))[0]:
            radius = float(np.median(world.radius)) if len(world) else SPAWNED_RADIUS
            world.add(position=(x, y), velocity=0.0, radius=radius, mass=usual_density(world) * radius**2)

    def delete(self, x: float, y: float, reach: float, layout: Layout | None = None) -> None:
        """Remove the circle whose rim is nearest to (x, y), if within `reach`, metres."""
        panel, x, y = self._locate(x, y, layout)
        i = nearest(self._worlds[panel], np.array([x, y]), reach)
        if i is not None:
            self._worlds[panel].remove(i)

    def _locate(self, x: float, y: float, layout: Layout | None, pointer: int | None = None) -> tuple[int, float, float]:
        """The world at a point of the picture, or the one that `pointer` works in, and the point in its own coordinates."""
        panel = 0 if layout is None else layout.at(x, y)
        if pointer is not None:
            panel = self._world_of.setdefault(pointer, panel)
        dx, dy = (0.0, 0.0) if layout is None else layout.offset(panel)
        return panel, x - dx, y - dy

    def _hold(self, pointer: int, force: Grip | Push | None) -> None:
        self._held[pointer] = force
        if force is not None:
            self._worlds[self._world_of[pointer]].forces.append(force)


def usual_density(world: World) -> float:
    """Median of mass / radius^2 over the free circles, kg/m^2; 4 where there are none: 1 kg at 0.5 m."""
    free = np.isfinite(world.mass)
    return float(np.median(world.mass[free] / world.radius[free] ** 2)) if free.any() else 4.0


MOST = 50  # steps back
ROOM = 256_000_000  # bytes for all of them, about; two steps there are always
EACH = 400  # bytes a particle takes in a copy of a world, about


class History:
    """What was done to worlds by hand, each with what they were before it: all of it, their time too.

    A stroke is one thing done, from when a pointer comes down until it is released.
    """

    def __init__(self, panels: Panels) -> None:
        self._panels = panels
        self._back: list[Any] = []
        self._forth: list[Any] = []
        self._strokes: set[int] = set()
        self._before: Any = None

    @property
    def depth(self) -> tuple[int, int]:
        """How often one can undo, and redo."""
        return len(self._back), len(self._forth)

    def open(self, pointer: int) -> None:
        """A pointer is about to do something."""
        self._before = None if pointer in self._strokes else self._panels.save()

    def close(self, pointer: int, *, changed: bool) -> None:
        """It has; or nothing has come of it."""
        if changed and self._before is not None:
            self._back.append(self._before)
            self._forth.clear()
            self._strokes.add(pointer)
            most = max(2, min(MOST, ROOM // (EACH * max(1, sum(map(len, self._panels.worlds))))))
            del self._back[:-most]
        self._before = None

    def release(self, pointer: int) -> None:
        """What this pointer does next is another thing."""
        self._strokes.discard(pointer)

    def undo(self) -> bool:
        """Go back to before the last thing done; whether there was one."""
        return self._go(self._back, self._forth)

    def redo(self) -> bool:
        """Go to where the last undo was asked for."""
        return self._go(self._forth, self._back)

    def _go(self, source: list[Any], to: list[Any]) -> bool:
        if not source:
            return False
        self._strokes.clear()
        to.append(self._panels.save())
        self._panels.restore(source.pop())
        return True
