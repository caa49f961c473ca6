"""Particles in rows: nets and cloths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.laws.links import Link, Rope, Spring
from pyverlet.state.group import Group
from pyverlet.world.builders._built import Point, Sheet, add, weight

if TYPE_CHECKING:
    from pyverlet.world.world import World


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
    """Knots in rows and columns, each tied to its neighbours by ropes. `net.group.pin(net.grid[0])` hangs it by its upper edge.

    Args:
        world: gets the particles and the ropes.
        top_left: (x, y) of the first knot, m.
        width: of the net, m.
        height: of the net, m.
        columns: knots in a row, at least 2.
        rows: knots in a column, at least 2.
        mass: of all knots together, kg.
        radius: of each, m; by default neighbours all but touch.
        compliance: of each piece of rope, m/N.
        breaking_force: at which a piece breaks, N.
        particles: category, friction and all else that `World.add` takes.
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
) -> tuple[Group, NDArray[np.int64]]:  # fmt: skip
    """Particles in a grid, row 0 on top, and their indices (rows, columns)."""
    x0, y0 = checks.vector("top_left", top_left)
    across, down = checks.number("width", width, above=0.0), checks.number("height", height, above=0.0)
    nx, ny = checks.whole("columns", columns, least=2), checks.whole("rows", rows, least=2)
    x, y = np.meshgrid(x0 + np.linspace(0.0, across, nx), y0 - np.linspace(0.0, down, ny))
    place, apart = np.column_stack((x.ravel(), y.ravel())), min(across / (nx - 1), down / (ny - 1))
    group = add(world, place, apart, radius, mass, **particles)
    return group, np.arange(nx * ny).reshape(ny, nx)


def threads(grid: NDArray[np.int64]) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], ...]:
    """Ends of the links along the rows and down the columns, thread after thread: each is solved at once."""
    return (grid[:, :-1].ravel(), grid[:, 1:].ravel()), (grid[:-1].T.ravel(), grid[1:].T.ravel())


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
    """A sheet of particles joined by threads, with springs across. `cloth.group.pin(cloth.grid[0])` hangs it by its upper edge.

    Args:
        world: gets the particles and the links.
        top_left: (x, y) of the first particle, m.
        width: of the cloth, m.
        height: of the cloth, m.
        columns: particles in a row, at least 2.
        rows: particles in a column, at least 2.
        mass: of all particles together, kg.
        radius: of each, m; by default neighbours all but touch.
        slack: part by which the threads along the rows are longer than the way: the cloth hangs in folds.
        compliance: of each piece of thread, m/N.
        shear: N/m of the springs across; 0 for none. None takes five times the weight over the height.
        breaking_force: at which a piece of thread or a spring breaks, N. Where that is finite, a spring does so at three times
            its length too: it would hold on to what has been torn off.
        particles: category, friction and all else that `World.add` takes.
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


def diagonals(grid: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Ends of the links from each to the next on the right below, diagonal after diagonal: each is solved at once."""
    row, column = np.indices((grid.shape[0] - 1, grid.shape[1] - 1)).reshape(2, -1)
    order = np.lexsort((row, column - row))
    return grid[row[order], column[order]], grid[row[order] + 1, column[order] + 1]
