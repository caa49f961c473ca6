"""Soft bodies: a skin of springs or sticks under pressure, or a lattice of springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.laws.links import Angle, Area, Link, Spring, Stick
from pyverlet.world.builders._built import RIM, Built, add, builder, weight
from pyverlet.world.builders.outline import inside, simple_polygon, walk

if TYPE_CHECKING:
    from pyverlet.world.world import World

FIRMNESS = 40.0
"""Default force at strain 1, in body weights: of the skin, or of the inside across the width."""

BENDING = 0.1
"""Damping of the angle between two springs of a skin, over that of a spring times the square of their spacing."""

NEAREST = 6
"""Least number of neighbours that each particle of a filled body is linked to."""

LIMP = 1e9
"""rad/(N m), compliance of such an angle: practically no stiffness, only damping."""


@builder
def soft_body(
    world: World,
    outline: ArrayLike,
    *,
    spacing: float,
    mass: float = 1.0,
    stiffness: float | None = None,
    damping: float | None = None,
    bulk: float | None = None,
    filled: bool = False,
    **particles: Any,
) -> Built:
    """A body inside `outline`, such as `pv.builders.disc((0, 3), 1.0)`, `pv.builders.box((0, 0), (2, 1))` or corners of your own.

    Hollow, it is a skin of springs that keeps its area: a balloon, which loses its corners over time. Filled, it is a lattice of
    springs throughout, which keeps its shape. Its particles have fixed rotation.

    Args:
        world: receives the particles and the links.
        outline: (p, 2) corners of a simple polygon, m. The particles stay inside it.
        spacing: distance between neighbours, m.
        mass: of the body, kg.
        stiffness: of each spring, N/m; infinity makes sticks. None: 40 weights over the spacing, or over the width if filled.
        damping: of each spring, N s/m; the angles of a skin are damped in proportion. None: a tenth of critical damping of the
            whole body; a skin of sticks is damped like one of springs.
        bulk: stiffness of the area, N/m: a pressure of a hundredth of it reduces the area by a hundredth. None: 40 weights over
            the width; 0 leaves the area free. Hollow bodies only.
        filled: a lattice instead of a skin.
        particles: category, friction and any other argument of `World.add`.

    Raises:
        InputError: the outline crosses itself, there is no room for three particles, or a number is outside what is allowed.
    """
    corners = simple_polygon("outline", outline)
    apart = checks.number("spacing", spacing, above=0.0)
    width = float(np.ptp(corners[:, 0]))
    firm = FIRMNESS * weight(world, checks.number("mass", mass, above=0.0))
    k = firm / (width if filled else apart) if stiffness is None else _stiffness(stiffness)
    if damping is None:
        damping = 0.2 * float(np.sqrt((k if np.isfinite(k) else firm / apart) * mass))
    resistance = firm / width if bulk is None else checks.number("bulk", bulk, least=0.0)
    shrunk = _shrink(corners, RIM * apart)
    skin, filled = walk(shrunk, apart), checks.flag("filled", filled)
    if len(skin) < 3:
        raise InputError(f"spacing is {apart:g} m; allowed is less, so that at least three particles fit along the outline")
    points = np.concatenate((skin, _lattice(shrunk, skin, apart))) if filled else skin
    nearest = float(np.sqrt(_squares(points)[np.triu_indices(len(points), 1)].min()))
    group = add(world, points, min(apart, nearest), None, mass, **particles)
    group.fixed_rotation[:] = 1  # particles of a skin are not wheels for it to roll on
    n = np.arange(len(skin))
    pairs = np.column_stack((n, np.roll(n, -1))) if not filled else _neighbours(corners, points)
    links: list[Link] = []
    if np.isinf(k):
        links.append(Stick(group, pairs[:, 0], pairs[:, 1], damping=0.0, collide=False))
    else:
        links.append(Spring(group, pairs[:, 0], pairs[:, 1], stiffness=k, damping=damping, collide=False))
    if not filled and damping > 0.0:  # bending waves do not stretch a skin: only this damps them
        links.append(Angle(group, np.roll(n, 1), n, np.roll(n, -1), compliance=LIMP, damping=BENDING * damping * apart**2))
    if not filled and resistance > 0.0:
        area = Area(group)
        links.append(Area(group, compliance=float(area.area[0]) / resistance))
    world.links.extend(links)
    return Built(group, tuple(links))


def _stiffness(value: float) -> float:
    if value == np.inf:
        return float(np.inf)
    return checks.number("stiffness", value, above=0.0)


def _shrink(corners: Floats, by: float) -> Floats:
    """The polygon with its sides moved inward, so that the rims of particles stay inside the outline."""
    along = np.roll(corners, -1, axis=0) - corners
    along /= np.hypot(*along.T)[:, None]
    inward = np.column_stack((-along[:, 1], along[:, 0]))
    before = np.roll(inward, 1, axis=0)
    # The intersection of both moved sides; at very sharp corners at most three times the shift.
    shift = (inward + before) / np.maximum(1.0 + np.sum(inward * before, axis=1), 2 / 9)[:, None]
    result: Floats = corners + by * shift
    return result


def _lattice(corners: Floats, skin: Floats, apart: float) -> Floats:
    """Rows of a triangular lattice inside the skin, at least 0.8 of the spacing away from it."""
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    rows = []
    for r, y in enumerate(np.arange(y0, y1, apart * np.sqrt(0.75))):
        x = np.arange(x0 + apart * (r % 2) / 2, x1, apart)
        rows.append(np.column_stack((x, np.full_like(x, y))))
    points = np.concatenate(rows)
    points = points[inside(corners, points)]
    nearest = np.array([np.min(np.sum((skin - point) ** 2, axis=1)) for point in points])
    return np.asarray(points[nearest > (0.8 * apart) ** 2])


def _squares(points: Floats) -> Floats:
    """(k, k) squared distances between all points."""
    return np.asarray(np.sum((points[:, None] - points[None]) ** 2, axis=2))


def _neighbours(corners: Floats, points: Floats) -> NDArray[np.int64]:
    """(m, 2) pairs inside: each point and its six nearest, as in a triangular lattice. With fewer, parts swing freely."""
    near = np.argsort(_squares(points), axis=1)[:, 1 : NEAREST + 1]
    pairs = np.column_stack((np.repeat(np.arange(len(points)), near.shape[1]), near.ravel()))
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    return np.asarray(pairs[inside(corners, points[pairs].mean(axis=1))])
