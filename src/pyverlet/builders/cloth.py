"""A cloth: threads crosswise that neither stretch nor crumple, and hold their square shape a little."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pyverlet import checks
from pyverlet.builders._built import Point, Sheet, weight
from pyverlet.builders.net import lay_grid, threads
from pyverlet.links import Link, Spring, Stick

if TYPE_CHECKING:
    from pyverlet.world import World


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
    compliance: float = 0.0,
    shear: float | None = None,
    breaking_force: float = np.inf,
) -> Sheet:
    """A sheet of particles joined by sticks, with springs across. `cloth.group.pin(cloth.grid[0])` hangs it by its upper edge.

    Args:
        world: gets the particles and the links.
        top_left: (x, y) of the first particle, m.
        width, height: of the cloth, m.
        columns, rows: of particles, at least 2.
        mass: of all particles together, kg.
        radius: of each, m; by default neighbours all but touch.
        compliance: of each stick, m/N.
        shear: N/m of the springs across; 0 for none. None takes five times the weight over the height.
        breaking_force: at which a stick or a spring breaks, N.
    """
    k = 5.0 * weight(world, mass) / height if shear is None else checks.number("shear", shear, least=0.0)
    group, grid = lay_grid(world, top_left, width, height, columns, rows, mass, radius)
    links: list[Link] = [
        Stick(group, a, b, compliance=compliance, breaking_force=breaking_force, collide=False) for a, b in threads(grid)
    ]
    if k > 0.0:
        for square in (grid, grid[:, ::-1]):
            a, b = diagonals(square)
            links.append(Spring(group, a, b, stiffness=k, breaking_force=breaking_force, collide=False))
    world.links.extend(links)
    return Sheet(group, tuple(links), grid)


def diagonals(grid: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Ends of the links from each to the next on the right below, diagonal after diagonal: each is solved at once."""
    row, column = np.indices((grid.shape[0] - 1, grid.shape[1] - 1)).reshape(2, -1)
    order = np.lexsort((row, column - row))
    return grid[row[order], column[order]], grid[row[order] + 1, column[order] + 1]
