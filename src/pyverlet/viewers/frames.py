"""Frames that a session publishes: immutable pictures of a world; and frame pacing."""

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
    """Cached outlines of moving, or of fixed, obstacles in worlds side by side; replaced only when one moves.

    Fixed ones are sent once, moving ones with every frame.
    """

    def __init__(self, worlds: Sequence[World], *, moving: bool) -> None:
        self._worlds, self._moving = worlds, moving
        self._drawn: list[list[Outline]] = []
        self._outlines: tuple[Outline, ...] = ()

    def draw(self, layout: Layout) -> tuple[Outline, ...]:
        """The current outlines, in the picture's coordinates."""
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


GRID_MAX = 65535  # largest coordinate on the 16-bit grid: at 2,000 pixels 1/30 pixel
VELOCITY_MAX = 32767  # largest velocity component as a 16-bit number, for the fastest circle
PUSH_MULTIPLE = 6.0  # largest encoded force over the mean
VIEW_MARGIN = 0.03  # margin around the bounds over their longer side
OPEN_GROWTH = 8.0  # an unbounded view grows up to so many times its initial size, so that one runaway does not shrink the rest
ROOM = 1.25  # size of an unbounded view over what must fit
MEDIAN_SAMPLE = 1000  # particles whose median the view follows; a median of all would take milliseconds
OUTLINE_POINTS = 240  # points of a circle's outline: error below 1/10 pixel at 2,000 pixels


@dataclass(frozen=True)
class PanelShape:
    """One of several worlds in a picture."""

    name: str
    first: int  # its first particle, and number of particles
    count: int
    energy: float  # total at the start, J
    strip: Rect  # (left, top, width, height) of its strip for name and curve, as fractions of the view from the upper left


@dataclass(frozen=True, eq=False)
class Shape:
    """Properties that rarely change from frame to frame: sent once to each viewer, and again when they change."""

    title: str
    budget_ms: float
    bounded: bool
    parted: bool  # whether only a part of the room is shown
    outlines: tuple[tuple[tuple[float, float], ...], ...]  # closed outlines of the bounds, metres
    lines: tuple[tuple[tuple[float, float], tuple[float, float]], ...]  # ends of dashed lines, metres
    panels: tuple[PanelShape, ...]  # several worlds side by side; empty for a single one
    differing: tuple[str, ...]  # settings in which the panels differ, which cannot be changed
    obstacles: tuple[Outline, ...]  # fixed obstacles
    scene: str  # name of the scene, or "" for the user's worlds
    scenes: tuple[tuple[str, str], ...]  # name and summary of each scene to choose from; may be empty
    callbacks: tuple[str, ...]  # "keys" and "click", if the user's program handles them
    countable: bool  # whether the number of circles can be chosen
    radius: NDArray[np.float32]  # (n,) metres, read-only
    mass: NDArray[np.float32]  # (n,) kg, infinite where pinned; read-only
    number: NDArray[np.uint32]  # (n,) permanent number of each circle; read-only
    group: NDArray[np.int64]  # (n,) number of the `add` call, ascending in each world; read-only
    kinds: NDArray[np.uint32] | None  # (n, 2) category and mask, (0, 0) without collisions; None if all collide with all
    apart: NDArray[np.uint32]  # (k, 2) circles that do not collide because of a link
    colours: NDArray[np.uint8] | None  # (n, 3) bytes R, G, B, the circles' own colours, if any; read-only
    periodicities: tuple[
        tuple[int, int, Periodicity], ...
    ] = ()  # periodic worlds: first circle, number of circles, periodicity in the picture


@dataclass(frozen=True)
class Status:
    """Numbers shown with a frame. Energies in joules, times in seconds, physics in milliseconds per frame."""

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
    ledger: dict[str, float] | None  # energy accounts, J; None unless all worlds keep a ledger
    energies: tuple[float, ...]  # total of each panel, J; `kinetic`, `potential`, `links` and `energy` are sums
    gravity: tuple[float, float]
    substeps: int
    restitution: float | None  # None where it does not apply; also friction
    friction: float | None
    integrator: str
    speed: float  # requested simulated seconds per second
    pace: float | None  # measured simulated seconds per second, over the last second; None: unknown
    paused: bool
    busy: str | None  # reason why the world does not move now, such as a build
    error: str | None
    graph: Graph | None  # the scene's graph, beside a curve
    complaint: str | None  # error of a sketch while the world continues
    sliders: tuple[tuple[str, float, float, float, float], ...]  # name, ends, step and value of the program's sliders
    watched: dict[str, float]  # curves beside the energy
    undo: tuple[int, int]  # numbers of possible undos and redos


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture of the world. `seq` increases by one with every published frame."""

    seq: int
    shape: Shape
    view: Rect
    status: Status
    rows: NDArray[np.float32]  # (n, 2) positions, m, a read-only copy in the order particles were added, or by `order`
    moving: NDArray[np.float32]  # (n, 2) velocities, m/s, by `moving_order`; older unless a viewer asks for them
    obstacles: tuple[Outline, ...]  # moving obstacles
    joined: NDArray[np.uint32]  # (m, 2) circles that each link joins
    force: NDArray[np.float32]  # (m,) tension, N; negative if it pushes
    turned: NDArray[np.uint8]  # (n,) orientation of each circle, in 1/256 of a turn, counter-clockwise; empty before any turns
    order: NDArray[np.int32] | None = None  # (n,) particle of each row, between substeps; None: the same order
    moving_order: NDArray[np.int32] | None = None
    drawing: Drawing = ()  # the user's drawing; between substeps that of the previous frame
    contacts: Contacts = NO_CONTACTS  # contact forces, if shown; slightly older

    def moved(self, snapshot: SubstepSnapshot, seq: int, status: Status, *, velocity: bool) -> Frame:
        """The same frame a little later, between two substeps; velocities are not updated unless requested."""
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
        """(n, 2) metres, read-only, in the order particles were added. Sorted in the first thread that asks, as in `grid`."""
        return _sorted(self.rows, self.order)

    @cached_property
    def velocity(self) -> NDArray[np.float32]:
        """(n, 2) m/s, as `position`."""
        return _sorted(self.moving, self.moving_order)

    @cached_property
    def strain(self) -> NDArray[np.uint8]:
        """(m,) tension of each link: 0 is slack, 255 at least three times the usual one."""
        load = np.abs(self.force)
        usual = USUAL_MULTIPLE * float(load.mean()) if len(load) else 0.0
        share = load * np.float32(255 / usual) if 0.0 < usual < np.inf else np.zeros_like(load)
        return np.asarray(np.clip(np.nan_to_num(share), 0, 255), dtype=np.uint8)

    @cached_property
    def push(self) -> tuple[NDArray[np.uint8], float]:
        """(m,) force of each contact, and its unit, N: the largest encoded is PUSH_MULTIPLE times the mean."""
        force = self.contacts.force
        unit = PUSH_MULTIPLE * float(force.mean()) / 255 if len(force) else 0.0
        return np.asarray(np.clip(np.rint(force / np.float32(unit or 1.0)), 0, 255), np.uint8), unit

    @cached_property
    def normals(self) -> NDArray[np.uint8]:
        """(m,) direction of each contact's normal, in 1/256 of a turn."""
        return np.asarray(np.rint(self.contacts.angle * (128 / np.pi)).astype(np.int64).astype(np.uint8))

    @cached_property
    def grid(self) -> NDArray[np.uint16]:
        """(n, 2) positions on the 16-bit grid over `view`, by `quantise`.

        Computed on first use, in the thread that sends the frame, so that it costs the physics thread nothing.
        """
        return quantise(self.position, self.view)

    @cached_property
    def copies(self) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """Copies of circles that reach across a periodic boundary: (k,) which, and (k, 2) positions, m."""
        found = [(np.empty(0, np.uint32), np.empty((0, 2), np.float32))]
        for first, count, periodic in self.shape.periodicities:
            mine = slice(first, first + count)
            owner, place = periodic_images.copies(self.position[mine], self.shape.radius[mine], periodic)
            found.append((owner + np.uint32(first), place))
        owners, places = zip(*found, strict=True)
        return np.concatenate(owners), np.concatenate(places)

    @cached_property
    def segments(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Links as lines, (m, 2, 2) in m, and (m,) tensions, N; those across a periodic boundary from both ends."""
        ends, force, found = self.position[self.joined], self.force, []
        for first, count, periodic in self.shape.periodicities:
            mine = (self.joined[:, 0] >= first) & (self.joined[:, 0] < first + count)
            found.append(periodic_images.lines(ends[mine], force[mine], periodic))
            ends, force = ends[~mine], force[~mine]
        return np.concatenate([ends, *(lines for lines, _ in found)]), np.concatenate([force, *(pulls for _, pulls in found)])

    @cached_property
    def velocity_unit(self) -> float:
        """Velocity unit of `velocity_grid`, m/s."""
        fastest = float(np.abs(self.velocity).max(initial=0.0))
        return fastest / VELOCITY_MAX if 0.0 < fastest < np.inf else 1.0

    @cached_property
    def velocity_grid(self) -> NDArray[np.int16]:
        """(n, 2) velocities as integers, in `velocity_unit`."""
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
    """The closed outlines of a boundary, metres: of a circle, or the rectangle of its extent; none for Open."""
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
    """Chooses the visible part of the plane: the bounds with a margin or, without bounds, a part that follows the particles.

    All of several worlds show the same part: the largest bounds, or all particles; or a fixed `part`, metres.
    """

    def __init__(self, *worlds: World, part: Rect | None = None) -> None:
        extents = [extent for world in worlds if (extent := world.boundary.extent()) is not None]
        self._fixed = part
        if part is not None:
            return
        if extents:
            lowest, highest = np.min(extents, axis=0), np.max(extents, axis=0)
            x0, y0, x1, y1 = (float(value) for value in (*lowest[:2], *highest[2:]))
            # Circles stick out across a periodic boundary.
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
        """The rectangle in which to show (n, 2) positions."""
        if self._fixed is not None:
            return self._fixed
        x, y, reach = _middle_and_reach(position)
        if np.isfinite([x, y, reach]).all():
            self._centre = (x, y)
            # Only grow: a view that changes with every bounce makes people seasick.
            self._half = max(self._half, min(ROOM * reach, self._largest_half))
        (x, y), half = self._centre, self._half
        return (x - half, y - half, x + half, y + half)


def _middle_and_reach(position: NDArray[np.float32]) -> tuple[float, float, float]:
    """The median of (n, 2) positions, which runaways do not move, and the farthest distance from it in x or y; metres."""
    if not len(position):
        return 0.0, 0.0, 0.0
    middle = np.median(position[:: 1 + len(position) // MEDIAN_SAMPLE], axis=0)
    reach = np.maximum(position.max(axis=0) - middle, middle - position.min(axis=0)).max()
    return float(middle[0]), float(middle[1]), float(reach)


PICTURE_S = 1 / 60  # mean interval between pictures of a slow world: one per screen refresh


class FramePacing:
    """Frame pacing for a slow world: on average one picture per screen refresh, made between two substeps.

    Each is due an interval after the last was due, not after it was made. Otherwise with substeps of 6 ms every third would come
    after 18 ms, and with 8 ms after 24. At most one missed picture is made up for.
    """

    def __init__(self) -> None:
        self._next = 0.0

    def due(self, now: float) -> bool:
        """Whether a picture is due at time `now`, s."""
        return now >= self._next

    def made(self, now: float) -> None:
        """Record that a picture was made."""
        self._next = max(self._next + PICTURE_S, now)
