"""What a session publishes: immutable pictures of a world, ready to be sent anywhere; and when the next one is due."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.laws.boundaries import Boundary, Circle
from pyverlet.laws.obstacles import Outline
from pyverlet.picture import periodic_images
from pyverlet.picture.colour import USUAL_MULTIPLE
from pyverlet.picture.pen import Drawing
from pyverlet.picture.view import Rect
from pyverlet.scenes._scene import Graph
from pyverlet.state.periodicity import Periodicity
from pyverlet.viewers.forces import NONE as NO_CONTACTS
from pyverlet.viewers.forces import Contacts
from pyverlet.viewers.layout import Layout
from pyverlet.world.substep_snapshot import SubstepSnapshot
from pyverlet.world.world import World


class OutlineCache:
    """Outlines of the obstacles that move, or do not, in worlds side by side; the same object until an obstacle moves.

    Those that stand still go along once, those that move with every frame.
    """

    def __init__(self, worlds: Sequence[World], *, moving: bool) -> None:
        self._worlds, self._moving = worlds, moving
        self._drawn: list[list[Outline]] = []
        self._outlines: tuple[Outline, ...] = ()

    def draw(self, layout: Layout) -> tuple[Outline, ...]:
        """As they are now, in the picture's coordinates."""
        found = [
            (layout.offset(k), obstacle.drawn(), world.boundary.periodic)
            for k, world in enumerate(self._worlds)
            for obstacle in world.obstacles
            if obstacle.moves == self._moving
        ]
        drawn = [outlines for _, outlines, _ in found]
        if len(drawn) != len(self._drawn) or any(a is not b for a, b in zip(drawn, self._drawn, strict=True)):
            self._drawn = drawn
            images = [(offset, periodic_images.outlines(outlines, periodic)) for offset, outlines, periodic in found]
            self._outlines = tuple(Outline(points + offset, filled) for offset, outlines in images for points, filled in outlines)
        return self._outlines


GRID_MAX = 65535  # largest coordinate on the 16-bit grid: 65,536 places across the view are 1/30 of a pixel on 2,000 pixels
VELOCITY_MAX = 32767  # largest velocity component as a 16-bit number; the fastest circle has it
PUSH_MULTIPLE = 6.0  # the largest force that is encoded, in terms of the mean
VIEW_MARGIN = 0.03  # free space around the bounds, as a fraction of their longer side
OPEN_GROWTH = 8.0  # an unbounded view grows with its particles to so many times its start: one runaway does not shrink the rest
ROOM = 1.25  # size of an unbounded view, in terms of what must fit
MEDIAN_SAMPLE = 1000  # particles whose median the view follows: a median of all would take milliseconds
OUTLINE_POINTS = 240  # points of a circle's outline: off the true circle by less than a tenth of a pixel on a screen of 2,000


@dataclass(frozen=True)
class PanelShape:
    """One of several worlds in a picture."""

    name: str
    first: int  # its first particle among all on show, and how many it has
    count: int
    energy: float  # total at the start, J
    strip: Rect  # (left, top, width, height) of that of its name and curve, parts of the view from its upper left corner


@dataclass(frozen=True, eq=False)
class Shape:
    """What stays the same from frame to frame: sent once to each viewer, again when it changes."""

    title: str
    budget_ms: float
    bounded: bool
    parted: bool  # only a part of the room is on show
    outlines: tuple[tuple[tuple[float, float], ...], ...]  # closed lines of the bounds, metres
    lines: tuple[tuple[tuple[float, float], tuple[float, float]], ...]  # ends of dashed lines, metres
    panels: tuple[PanelShape, ...]  # several worlds side by side; empty for a single one
    differing: tuple[str, ...]  # settings in which the panels differ, and which therefore stay as they are
    obstacles: tuple[Outline, ...]  # those that stand still
    scene: str  # name of the scene, or "" for worlds of the user's own
    scenes: tuple[tuple[str, str], ...]  # name and one line of each scene that can be picked; empty where none can
    callbacks: tuple[str, ...]  # of "keys" and "click", what the user's own program wants to know of
    countable: bool  # whether another number of circles can be asked for
    radius: NDArray[np.float32]  # (n,) metres, read-only
    mass: NDArray[np.float32]  # (n,) kg, infinite where pinned; read-only
    number: NDArray[np.uint32]  # (n,) what each circle is called as long as it lives; read-only
    group: NDArray[np.int64]  # (n,) ascending in each world: which circles were added together; read-only
    kinds: NDArray[np.uint32] | None  # (n, 2) category and mask, (0, 0) without collisions; None if all collide with all
    apart: NDArray[np.uint32]  # (k, 2) circles that do not collide with each other since a link says so
    colours: NDArray[np.uint8] | None  # (n, 3) bytes R, G, B, the circles' own, if they have any; read-only
    # Of periodic worlds their first circle, how many, and their periodicity in the picture.
    periodicities: tuple[tuple[int, int, Periodicity], ...] = ()


@dataclass(frozen=True)
class Status:
    """The numbers on show with a frame. Energies in joules, times in seconds, physics in milliseconds a frame."""

    time: float
    frames: int
    particles: int
    dropped: int
    physics_ms: float
    physics_median_ms: float
    physics_p95_ms: float
    stages: dict[str, float]  # milliseconds of the last frame by stage of the engine
    kinetic: float
    potential: float
    links: float
    energy: float
    ledger: dict[str, float] | None  # where the energies have gone, J by account; None unless all worlds keep a ledger
    energies: tuple[float, ...]  # total of each panel, J; `kinetic`, `potential`, `links` and `energy` are sums
    gravity: tuple[float, float]
    substeps: int
    restitution: float | None  # None where nothing can bounce, and so for friction
    friction: float | None
    integrator: str
    speed: float  # seconds of the world in a second of the wall, as wished
    pace: float | None  # the same as it was over the last second; None while that is not known
    paused: bool
    busy: str | None  # what keeps the world from moving for now, such as building another
    error: str | None
    graph: Graph | None  # what the scene measures, beside a curve
    complaint: str | None  # what is wrong with a sketch, while the world goes on
    sliders: tuple[tuple[str, float, float, float, float], ...]  # name, ends, step and value of those the program has made
    watched: dict[str, float]  # what is drawn beside the energy
    undo: tuple[int, int]  # how often one can undo, and redo


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture of the world. `seq` grows by one with every frame published."""

    seq: int
    shape: Shape
    view: Rect
    status: Status
    rows: NDArray[np.float32]  # (n, 2) positions in metres, read-only copy, in the order the particles were added or `order`
    moving: NDArray[np.float32]  # (n, 2) velocities in m/s, by `moving_order`; of an earlier moment unless a viewer asks
    obstacles: tuple[Outline, ...]  # those that move
    joined: NDArray[np.uint32]  # (m, 2) which circles each link joins
    force: NDArray[np.float32]  # (m,) what it pulls with, N; negative if it pushes
    turned: NDArray[np.uint8]  # (n,) how far each circle has turned, in 1/256 of a turn, counter-clockwise; empty until one has
    order: NDArray[np.int32] | None = None  # (n,) which particle each row is of, between substeps; None: row k is particle k
    moving_order: NDArray[np.int32] | None = None
    drawing: Drawing = ()  # what the user's own function has drawn over it; of the frame before, between its substeps
    contacts: Contacts = NO_CONTACTS  # forces of contacts, if a viewer shows them; of a moment ago

    def moved(self, snapshot: SubstepSnapshot, seq: int, status: Status, *, velocity: bool) -> Frame:
        """The same a little later, between two substeps; its velocities are those of this frame unless they are asked for."""
        moving, moving_order = self.moving, self.moving_order
        if velocity:
            rows, moving, order = snapshot.look()
            moving.flags.writeable, moving_order = False, order
        else:
            rows, order = snapshot.positions()
        rows.flags.writeable = False
        return replace(self, seq=seq, status=status, rows=rows, moving=moving, order=order, moving_order=moving_order)

    @cached_property
    def position(self) -> NDArray[np.float32]:
        """(n, 2) metres, read-only, in the order the particles were added. Sorted in the thread that asks first, as in `grid`."""
        return _sorted(self.rows, self.order)

    @cached_property
    def velocity(self) -> NDArray[np.float32]:
        """(n, 2) m/s, likewise."""
        return _sorted(self.moving, self.moving_order)

    @cached_property
    def strain(self) -> NDArray[np.uint8]:
        """(m,) how hard each link works: 0 is slack, 255 three times the usual and more."""
        load = np.abs(self.force)
        usual = USUAL_MULTIPLE * float(load.mean()) if len(load) else 0.0
        share = load * np.float32(255 / usual) if 0.0 < usual < np.inf else np.zeros_like(load)
        return np.asarray(np.clip(np.nan_to_num(share), 0, 255), dtype=np.uint8)

    @cached_property
    def push(self) -> tuple[NDArray[np.uint8], float]:
        """(m,) how hard each contact pushes, in so many N: what is most is PUSH_MULTIPLE times the mean."""
        force = self.contacts.force
        unit = PUSH_MULTIPLE * float(force.mean()) / 255 if len(force) else 0.0
        return np.asarray(np.clip(np.rint(force / np.float32(unit or 1.0)), 0, 255), np.uint8), unit

    @cached_property
    def normals(self) -> NDArray[np.uint8]:
        """(m,) which way each contact's normal points, in 1/256 of a turn."""
        return np.asarray(np.rint(self.contacts.angle * (128 / np.pi)).astype(np.int64).astype(np.uint8))

    @cached_property
    def grid(self) -> NDArray[np.uint16]:
        """(n, 2) positions on the 16-bit grid over `view`, as `quantise` makes it.

        Computed when first asked for, in the thread that sends the frame: it costs the physics thread nothing.
        """
        return quantise(self.position, self.view)

    @cached_property
    def copies(self) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """Circles that reach through the boundary of a periodic room, once more: (k,) which, and (k, 2) where, m."""
        found = [(np.empty(0, np.uint32), np.empty((0, 2), np.float32))]
        for first, count, periodic in self.shape.periodicities:
            mine = slice(first, first + count)
            owner, place = periodic_images.copies(self.position[mine], self.shape.radius[mine], periodic)
            found.append((owner + np.uint32(first), place))
        owners, places = zip(*found, strict=True)
        return np.concatenate(owners), np.concatenate(places)

    @cached_property
    def segments(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Links as lines, (m, 2, 2) in m, and (m,) what they pull with, N; those through a boundary from both ends."""
        ends, force, found = self.position[self.joined], self.force, []
        for first, count, periodic in self.shape.periodicities:
            mine = (self.joined[:, 0] >= first) & (self.joined[:, 0] < first + count)
            found.append(periodic_images.lines(ends[mine], force[mine], periodic))
            ends, force = ends[~mine], force[~mine]
        return np.concatenate([ends, *(lines for lines, _ in found)]), np.concatenate([force, *(pulls for _, pulls in found)])

    @cached_property
    def velocity_unit(self) -> float:
        """Metres a second that one count of `velocity_grid` stands for."""
        fastest = float(np.abs(self.velocity).max(initial=0.0))
        return fastest / VELOCITY_MAX if 0.0 < fastest < np.inf else 1.0

    @cached_property
    def velocity_grid(self) -> NDArray[np.int16]:
        """(n, 2) velocities in whole `velocity_unit`."""
        counts = np.nan_to_num(self.velocity * np.float32(1.0 / self.velocity_unit), posinf=0.0, neginf=0.0)
        return np.asarray(np.rint(counts), dtype=np.int16)


def _sorted(rows: NDArray[np.float32], order: NDArray[np.int32] | None) -> NDArray[np.float32]:
    if order is not None:
        result = np.empty_like(rows)
        unit("tools").put_rows(result, rows, order)
        rows = result
    rows.flags.writeable = False
    return rows


def quantise(position: NDArray[np.float32], view: Rect) -> NDArray[np.uint16]:
    """(n, 2) positions in metres on the 16-bit grid over `view`, y up. Clipped, so that nothing wraps around.

    0 and 65535 mean outside the view.
    """
    x0, y0, x1, y1 = view
    grid = np.empty(position.shape, dtype=np.uint16)
    unit("tools").quantize(position, x0, y0, GRID_MAX / (x1 - x0), GRID_MAX / (y1 - y0), GRID_MAX, grid)
    return grid


def outline(boundary: Boundary) -> tuple[tuple[tuple[float, float], ...], ...]:
    """The closed lines that draw a boundary, metres: of a circle, or the rectangle of its extent; Open has none."""
    if isinstance(boundary, Circle):
        angle = np.linspace(0.0, 2.0 * np.pi, OUTLINE_POINTS, endpoint=False)
        x = boundary.center[0] + boundary.radius * np.cos(angle)
        y = boundary.center[1] + boundary.radius * np.sin(angle)
        return (tuple(zip(x.tolist(), y.tolist(), strict=True)),)
    extent = boundary.extent()
    if extent is None:
        return ()
    x0, y0, x1, y1 = map(float, extent)
    return (((x0, y0), (x1, y0), (x1, y1), (x0, y1)),)


class Camera:
    """Chooses the part of the plane on show: the bounds with a margin or, without bounds, where the particles are.

    Of several worlds it shows the same part: all of the largest bounds, or all the particles; a `part`, metres, whatever they do.
    """

    def __init__(self, *worlds: World, part: Rect | None = None) -> None:
        extents = [extent for world in worlds if (extent := world.boundary.extent()) is not None]
        self._fixed = part
        if part is not None:
            return
        if extents:
            lowest, highest = np.min(extents, axis=0), np.max(extents, axis=0)
            x0, y0, x1, y1 = (float(value) for value in (*lowest[:2], *highest[2:]))
            # Through a seam circles reach out of the room.
            out = max((1.1 * float(world.radius.max(initial=0.0)) for world in worlds if world.boundary.periodic), default=0.0)
            margin = max(VIEW_MARGIN * max(x1 - x0, y1 - y0), out)
            self._fixed = (x0 - margin, y0 - margin, x1 + margin, y1 + margin)
            return
        _, _, reach = _middle_and_reach(np.concatenate([world.position for world in worlds]))
        largest = max(float(np.max(world.radius, initial=0.0)) for world in worlds)
        self._half = ROOM * max(reach, 12.0 * largest) or 1.0
        self._largest_half = OPEN_GROWTH * self._half
        self._centre = (0.0, 0.0)

    def view(self, position: NDArray[np.float32]) -> Rect:
        """The rectangle to show (n, 2) positions in."""
        if self._fixed is not None:
            return self._fixed
        x, y, reach = _middle_and_reach(position)
        if np.isfinite([x, y, reach]).all():
            self._centre = (x, y)
            # Grow only: a view that breathes with every bounce makes people seasick.
            self._half = max(self._half, min(ROOM * reach, self._largest_half))
        (x, y), half = self._centre, self._half
        return (x - half, y - half, x + half, y + half)


def _middle_and_reach(position: NDArray[np.float32]) -> tuple[float, float, float]:
    """The median of (n, 2) positions, which no runaway moves, and the farthest distance from it in x or y; metres."""
    if not len(position):
        return 0.0, 0.0, 0.0
    middle = np.median(position[:: 1 + len(position) // MEDIAN_SAMPLE], axis=0)
    reach = np.maximum(position.max(axis=0) - middle, middle - position.min(axis=0)).max()
    return float(middle[0]), float(middle[1]), float(reach)


PICTURE_S = 1 / 60  # seconds between two pictures of a slow world, on the mean: what a screen shows


class FramePacing:
    """As many pictures a second as a screen shows, made at moments that do not fit that pace: between two substeps.

    Each is due so long after the last was due, not after it was made. With substeps of 6 ms every third would come after 18 ms
    otherwise, and of 8 ms every third too, after 24. What is missed is not made up for, but for one.
    """

    def __init__(self) -> None:
        self._next = 0.0

    def due(self, now: float) -> bool:
        """Whether a picture is due at this time, s."""
        return now >= self._next

    def made(self, now: float) -> None:
        """There is one."""
        self._next = max(self._next + PICTURE_S, now)
