"""Fill a shape with circles that do not overlap."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.shown import count
from pyverlet.laws.obstacles import Obstacle
from pyverlet.world.builders.region import PictureMask, Region
from pyverlet.world.queries import overlapping
from pyverlet.world.world import World

GAP = 1e-3
"""Gap between lattice neighbours over their distance: float32 rounding must not make them overlap."""

HALVINGS = 14
"""Bisection steps in the search for the lattice spacing."""

SCATTERED = 0.4
"""Default fraction of the area covered by pattern="random"."""

MOST_SCATTERED = 0.45
"""Largest fraction for pattern="random". Random sequential addition jams at 0.547 (Feder 1980), and is slow long before that."""

ROUNDS = 150
"""Rounds of random sampling."""

FEWEST_TRIES, MOST_TRIES = 2_000, 200_000
"""Bounds on the samples per round; the number is estimated from the round before."""

MOST = 5_000_000
"""Most circles: more is almost surely a mistyped radius."""

Sites = Callable[[float], Floats]


class Filling(NamedTuple):
    """Positions, radii and colours returned by `fill`."""

    position: Floats
    """(n, 2) centres, m."""
    radius: Floats
    """(n,) m."""
    colour: NDArray[np.uint8] | None
    """(n, 3) bytes R, G, B of the picture at each centre for pattern="picture"; None otherwise."""

    def __repr__(self) -> str:
        return f"Filling of {count(len(self.radius), 'circle')}" + ", in colour" * (self.colour is not None)


def fill(
    where: Any,
    *,
    radius: float | tuple[float, float] = 0.5,
    fraction: float | None = None,
    count: int | None = None,
    pattern: str = "hex",
    avoid: World | Iterable[Obstacle] = (),
    picture: str | Path | Any = None,
    seed: int = 0,
) -> Filling:
    """Places for circles that do not overlap, from the bottom up: `world.add(position=f.position, radius=f.radius)`.

    Args:
        where: a room with walls (`Box`, `Circle`), a `Polygon`, or the (n, 2) corners of any simple polygon, m.
        radius: m, or (smallest, largest) of a uniform distribution.
        fraction: covered fraction of the free area, above 0; None for the densest packing, or 0.4 for "random".
        count: number of circles, instead of `fraction`.
        pattern: "hex" (densest), "square", "random" (at most 0.45 of the area), or "picture": a hex lattice where the picture, as
            large as fits, is neither white nor transparent.
        avoid: obstacles to keep clear of, or a world whose obstacles and circles are avoided.
        picture: for that pattern: a file, or (h, w, 3) or (h, w, 4) bytes R, G, B, A.
        seed: seed of the random numbers.

    Returns:
        Positions and radii in float64, and the colours of a picture.

    Raises:
        InputError: an argument is outside what is allowed, or so many circles do not fit.
    """
    checks.choice("pattern", pattern, PATTERNS)
    if (picture is not None) != (pattern == "picture"):
        raise InputError(f"picture is {picture!r} for the pattern {pattern!r}; allowed is one for the pattern 'picture'")
    if fraction is not None and count is not None:
        raise InputError(f"count is {count!r} and fraction is {fraction!r}; allowed is one of them")
    low, high = radius if isinstance(radius, tuple) else (radius, radius)
    low = checks.number("radius", low, above=0.0)
    high = checks.number("radius", high, least=low)
    region, rng = Region(where, avoid), np.random.default_rng(checks.integer("seed", seed, least=0))
    if fraction is None and pattern == "random" and count is None:
        fraction = SCATTERED
    # The mean of r^2 of a uniform distribution from low to high.
    each = np.pi * (low * low + low * high + high * high) / 3
    wanted = None if count is None else checks.integer("count", count, most=MOST)
    picture_mask = PictureMask(picture, region.extent) if picture is not None else None
    if fraction is not None:
        area = region.area() if picture_mask is None else picture_mask.area()
        wanted = max(1, round(checks.number("fraction", fraction, above=0.0) * area / each))
    x0, y0, x1, y1 = region.extent
    if (wanted or (x1 - x0) * (y1 - y0) / (2 * 3**0.5 * high * high)) > MOST:
        raise InputError(f"radius is {radius!r}, so that more than {MOST:,} circles would fit; allowed is a larger one")
    if pattern == "random":
        assert wanted is not None
        sizes = rng.uniform(low, high, wanted)
        return Filling(_scatter(region, sizes, rng), sizes, None)
    lattice = _square if pattern == "square" else _hex

    def sites(apart: float) -> Floats:
        points = lattice(region.extent, high, apart)
        if picture_mask is not None:
            points = points[picture_mask.covers(points)]
        return points[region.free(points, np.full(len(points), high))]

    places = _spaced(sites, 2 * high * (1 + GAP), wanted, (x1 - x0) + (y1 - y0), pattern)
    sizes = rng.uniform(low, high, len(places)) if high > low else np.full(len(places), high)
    return Filling(places, sizes, None if picture_mask is None else picture_mask.colours(places))


PATTERNS = ("hex", "square", "random", "picture")
"""Names of the patterns of `fill`."""


def _spaced(sites: Sites, tight: float, wanted: int | None, widest: float, pattern: str) -> Floats:
    """The wanted number of sites at the largest possible spacing; all sites at spacing `tight` if `wanted` is None."""
    places = sites(tight)
    if wanted is None or wanted == len(places):
        return places
    if wanted > len(places):
        raise InputError(
            f"{wanted:,} circles are wanted, and {len(places):,} find room in the pattern {pattern!r}; allowed is "
            "less: a smaller fraction, count or radius"
        )
    # The number of sites falls with the square of the spacing, so the answer is near this guess.
    guess = tight * (len(places) / wanted) ** 0.5
    near, far = max(tight, 0.8 * guess), min(1.3 * guess, widest)
    if len(found := sites(near)) < wanted:
        near, found = tight, places
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        more = sites(middle)
        if len(more) >= wanted:
            near, found = middle, more
        else:
            far = middle
        if len(found) == wanted:
            break
    return found[:wanted]  # the surplus is left out at the top


def _square(extent: tuple[float, float, float, float], radius: float, apart: float) -> Floats:
    x, y = (_row(low, high, radius, apart) for low, high in ((extent[0], extent[2]), (extent[1], extent[3])))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _hex(extent: tuple[float, float, float, float], radius: float, apart: float) -> Floats:
    x0, y0, x1, y1 = extent
    height = y0 + radius + np.arange(max(0, int((y1 - y0 - 2 * radius) / (apart * 3**0.5 / 2) + 1e-9) + 1)) * apart * 3**0.5 / 2
    across = _row(x0, x1, radius, apart)
    x = across[None, :] + np.where(np.arange(len(height)) % 2, apart / 2, 0.0)[:, None]
    return np.column_stack((x.ravel(), np.broadcast_to(height[:, None], x.shape).ravel()))


def _row(low: float, high: float, radius: float, apart: float) -> Floats:
    """Evenly spaced centres along one axis, the first and the last within the walls."""
    return np.asarray(low + radius + apart * np.arange(max(0, int((high - low - 2 * radius) / apart + 1e-9) + 1)), np.float64)


def _scatter(region: Region, sizes: Floats, rng: np.random.Generator) -> Floats:
    """(n, 2) places by random sequential addition without overlaps, the largest circles first."""
    order = np.argsort(-sizes, kind="stable")
    x0, y0, x1, y1 = region.extent
    placed = np.empty((len(sizes), 2))
    done, luck = 0, 0.5
    for _ in range(ROUNDS):
        left = len(sizes) - done
        if not left:
            break
        tries = int(min(max(left / luck, FEWEST_TRIES), MOST_TRIES))
        points = rng.uniform((x0, y0), (x1, y1), (tries, 2))
        # All samples are tested for the largest circle that is still missing: where it fits, any later one fits.
        now = sizes[order[done]]
        size = np.full(tries, now)
        kept = region.free(points, size)
        points, size = points[kept], size[kept]
        there, theirs = placed[:done], sizes[order[:done]]
        clear = np.ones(len(points), bool)
        clear[overlapping(points, size, there, theirs)[:, 0]] = False
        points = points[clear]
        among = overlapping(points, np.full(len(points), now), points, np.full(len(points), now))
        beaten = among[among[:, 1] < among[:, 0], 0]  # overlaps an earlier sample, whether that one stays or not
        alone = np.ones(len(points), bool)
        alone[beaten] = False
        points = points[alone][:left]
        luck = max(len(points) / tries, 1e-3)
        placed[done : done + len(points)] = points
        done += len(points)
    if done < len(sizes):
        raise InputError(
            f"{len(sizes):,} circles are wanted, and {done:,} were placed at random; allowed is less, at most about "
            f"{MOST_SCATTERED:g} of the area (the patterns 'hex' and 'square' are denser)"
        )
    result = np.empty_like(placed)
    result[order] = placed
    return result
