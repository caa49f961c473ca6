"""Builders of particles joined by threads, in lines and grids: chains, ropes, bridges, nets and cloths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.arrays import Indices
from pyverlet.common.errors import InputError
from pyverlet.laws.links import Link, Rope, Spring, Stick
from pyverlet.state.group import Group
from pyverlet.world.builders._built import Built, Point, Sheet, add, builder, weight

if TYPE_CHECKING:
    from pyverlet.world.world import World


def lay_line(
    world: World, start: Point, end: Point, links: int, length: float | None, mass: float, radius: float | None, **particles: Any
) -> tuple[Group, Indices, float]:
    """Add particles along a line; returns them, the index of the first end of each link, and the length of a link, m."""
    count = checks.integer("links", links)
    a, b = np.array(checks.vector("start", start)), np.array(checks.vector("end", end))
    if not (apart := float(np.hypot(*(b - a)))):
        raise InputError(f"end is {tuple(map(float, b))}, where start is; allowed is another point")
    whole = apart if length is None else checks.number("length", length)
    if whole < apart * (1 - 1e-6):
        raise InputError(f"length is {whole:g} m; allowed is at least the distance from start to end, {apart:g} m")
    group = add(world, a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a), apart / count, radius, mass, **particles)
    return group, np.arange(count), whole / count


@builder
def chain(
    world: World,
    start: Point,
    end: Point,
    *,
    links: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """Particles from `start` to `end`, joined by sticks; `chain.group.pin(0)` hangs it up.

    Args:
        world: receives the particles and the sticks.
        start: (x, y) of the first particle, m.
        end: (x, y) of the last one, m.
        links: number of sticks.
        mass: total mass of the particles, kg.
        radius: of each, m; by default neighbours almost touch.
        compliance: of each stick, m/N.
        breaking_force: force at which a stick breaks, N.
        particles: category, friction and any other argument of `World.add`.
    """
    group, k, _ = lay_line(world, start, end, links, None, mass, radius, **particles)
    stick = Stick(group, k, k + 1, compliance=compliance, breaking_force=breaking_force, collide=False)
    return Built(group, (world.links.append(stick),))


@builder
def rope(
    world: World,
    start: Point,
    end: Point,
    *,
    length: float | None = None,
    links: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """Particles from `start` to `end`, joined by ropes; `rope.group.pin([0, -1])` hangs it up at both ends.

    Args:
        world: receives the particles and the ropes.
        start: (x, y) of the first particle, m.
        end: (x, y) of the last one, m.
        length: of the whole rope, m; longer than the distance of the ends makes it sag. None: that distance.
        links: number of pieces.
        mass: total mass of the particles, kg.
        radius: of each, m; by default neighbours almost touch.
        compliance: of each piece, m/N.
        breaking_force: force at which a piece breaks, N.
        particles: category, friction and any other argument of `World.add`.
    """
    group, k, each = lay_line(world, start, end, links, length, mass, radius, **particles)
    piece = Rope(group, k, k + 1, length=each, compliance=compliance, breaking_force=breaking_force, collide=False)
    return Built(group, (world.links.append(piece),))


@builder
def bridge(
    world: World,
    start: Point,
    end: Point,
    *,
    slack: float = 0.03,
    planks: int = 20,
    mass: float = 10.0,
    radius: float | None = None,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """A deck of circles on a rope with fixed ends, which carries what falls on it.

    Args:
        world: receives the particles and the links.
        start: (x, y) of one fixed end, m.
        end: (x, y) of the other, m.
        slack: excess length of the deck over the distance of its ends, as a fraction, 0 or more. At 0 the tension is enormous.
        planks: number of planks.
        mass: total mass of the planks, kg.
        radius: of each, m; by default neighbours almost touch.
        breaking_force: force at which the deck tears between two planks, N.
        particles: category, friction and any other argument of `World.add`.
    """
    checks.number("slack", slack, least=0.0)
    apart = float(np.hypot(*(np.subtract(checks.vector("end", end), checks.vector("start", start)))))
    built = rope(
        world, start, end, length=(1 + slack) * apart, links=checks.integer("planks", planks) + 1, mass=mass, radius=radius,
        breaking_force=breaking_force, **particles,
    )  # fmt: skip
    built.group.pin([0, -1])
    return built


@builder
def net(
    world: World,
    top_left: Point,
    *,
    width: float,
    height: float,
    columns: int = 20,
    rows: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Sheet:
    """Knots in rows and columns, each tied to its neighbours by ropes. `net.group.pin(net.grid[0])` fixes the upper edge.

    Args:
        world: receives the particles and the ropes.
        top_left: (x, y) of the first knot, m.
        width: of the net, m.
        height: of the net, m.
        columns: knots in a row, at least 2.
        rows: knots in a column, at least 2.
        mass: total mass of the knots, kg.
        radius: of each, m; by default neighbours almost touch.
        compliance: of each piece of rope, m/N.
        breaking_force: force at which a piece breaks, N.
        particles: category, friction and any other argument of `World.add`.
    """
    group, grid = lay_grid(world, top_left, width, height, columns, rows, mass, radius, **particles)
    links = tuple(
        world.links.append(Rope(group, a, b, compliance=compliance, breaking_force=breaking_force, collide=False))
        for a, b in threads(grid)
    )
    return Sheet(group, links, grid)


def lay_grid(
    world: World, top_left: Point, width: float, height: float, columns: int, rows: int, mass: float, radius: float | None,
    **particles: Any,
) -> tuple[Group, Indices]:  # fmt: skip
    """Add particles in a grid, row 0 on top; returns them and their indices (rows, columns)."""
    x0, y0 = checks.vector("top_left", top_left)
    across, down = checks.number("width", width, above=0.0), checks.number("height", height, above=0.0)
    nx, ny = checks.integer("columns", columns, least=2), checks.integer("rows", rows, least=2)
    x, y = np.meshgrid(x0 + np.linspace(0.0, across, nx), y0 - np.linspace(0.0, down, ny))
    place, apart = np.column_stack((x.ravel(), y.ravel())), min(across / (nx - 1), down / (ny - 1))
    group = add(world, place, apart, radius, mass, **particles)
    return group, np.arange(nx * ny).reshape(ny, nx)


def threads(grid: Indices) -> tuple[tuple[Indices, Indices], ...]:
    """Ends of the links along rows and down columns, one thread after the other: each thread is solved at once as a chain."""
    return (grid[:, :-1].ravel(), grid[:, 1:].ravel()), (grid[:-1].T.ravel(), grid[1:].T.ravel())


@builder
def cloth(
    world: World,
    top_left: Point,
    *,
    width: float,
    height: float,
    columns: int = 20,
    rows: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    slack: float = 0.0,
    compliance: float = 0.0,
    shear: float | None = None,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Sheet:
    """A sheet of particles joined by threads, with diagonal springs. `cloth.group.pin(cloth.grid[0])` fixes the upper edge.

    Args:
        world: receives the particles and the links.
        top_left: (x, y) of the first particle, m.
        width: of the cloth, m.
        height: of the cloth, m.
        columns: particles in a row, at least 2.
        rows: particles in a column, at least 2.
        mass: total mass of the particles, kg.
        radius: of each, m; by default neighbours almost touch.
        slack: excess length of the threads along the rows, as a fraction: the cloth hangs in folds.
        compliance: of each piece of thread, m/N.
        shear: stiffness of the diagonal springs, N/m; 0 for none. None: five times the weight over the height.
        breaking_force: force at which a piece of thread or a spring breaks, N. If it is finite, a spring also breaks at three
            times its length, or it would hold on to pieces that have broken off.
        particles: category, friction and any other argument of `World.add`.
    """
    k = 5.0 * weight(world, mass) / height if shear is None else checks.number("shear", shear, least=0.0)
    group, grid = lay_grid(world, top_left, width, height, columns, rows, mass, radius, **particles)
    along = (1.0 + checks.number("slack", slack, least=0.0)) * width / (grid.shape[1] - 1)
    (a, b), (c, d) = threads(grid)
    links: list[Link] = [
        Rope(group, a, b, length=along, compliance=compliance, breaking_force=breaking_force, collide=False),
        Rope(group, c, d, compliance=compliance, breaking_force=breaking_force, collide=False),
    ]
    if k > 0.0:
        diagonal = float(np.hypot(width / (grid.shape[1] - 1), height / (grid.shape[0] - 1)))
        across = min(breaking_force, 2.0 * k * diagonal) if np.isfinite(breaking_force) else np.inf
        for square in (grid, grid[:, ::-1]):
            a, b = diagonals(square)
            links.append(Spring(group, a, b, stiffness=k, breaking_force=across, collide=False))
    world.links.extend(links)
    return Sheet(group, tuple(links), grid)


def diagonals(grid: Indices) -> tuple[Indices, Indices]:
    """Ends of the links from each particle to the next on the lower right, diagonal by diagonal: each is solved as a chain."""
    row, column = np.indices((grid.shape[0] - 1, grid.shape[1] - 1)).reshape(2, -1)
    order = np.lexsort((row, column - row))
    return grid[row[order], column[order]], grid[row[order] + 1, column[order] + 1]
