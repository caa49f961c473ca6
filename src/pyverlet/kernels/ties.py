"""Pins: links of one particle to a point, solved before all others."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.ground.constants import LINK_GIVE
from pyverlet.kernels.links import blend, note_force, snap
from pyverlet.kernels.seam import image_near


@kernel
def _near(point, r, start, p, period_x, period_y):
    """The image of pin r's point that is nearest to where its particle p started from."""
    return image_near(point[r, 0], start[p, 0], period_x), image_near(point[r, 1], start[p, 1], period_y)


@kernel
def tie(
    position, weight, start, earlier, particle, point, period_x, period_y, stiffness, damping, intact, h, give, offset,
):  # fmt: skip
    """Pins, before the rows: what a spring to a point does to its particle alone. The rows then meet a heavier particle.

    For them the particle has the inverse mass w give / (w + give): elimination, exact, which no Gauss-Seidel would be for a light
    particle that holds a heavy rope.
    """
    for r in range(particle.shape[0]):
        p = particle[r]
        w = weight[p]
        if not intact[r] or w == 0.0:
            continue
        at = _near(point, r, start, p, period_x, period_y)
        give[r] = LINK_GIVE * LINK_GIVE * w
        offset[r, 0] = offset[r, 1] = 0.0
        if stiffness[r] < np.inf:
            kp, k0, km = blend(stiffness[r], damping[r], w, h)
            give[r] = 1.0 / (h * h * max(kp, 1e-300))
            for axis in range(2):
                before = k0 * (start[p, axis] - at[axis]) + km * (earlier[p, axis] - at[axis])
                offset[r, axis] = before / max(kp, 1e-300)
        for axis in range(2):
            away = position[p, axis] - at[axis] + offset[r, axis]
            position[p, axis] -= w / (w + give[r]) * away
        weight[p] = w * give[r] / (w + give[r])


@kernel
def note_ties(
    position, start, particle, point, period_x, period_y, strength, intact, h, give, offset, lam, last, force,
):  # fmt: skip
    """What each pin pulls with after the rows; break those that pull too hard."""
    for r in range(particle.shape[0]):
        lam[r] = 0.0
        if intact[r] and give[r] > 0.0:
            at_x, at_y = _near(point, r, start, particle[r], period_x, period_y)
            x = position[particle[r], 0] - at_x + offset[r, 0]
            y = position[particle[r], 1] - at_y + offset[r, 1]
            lam[r] = -np.sqrt(x * x + y * y) / give[r]
    note_force(force, last, lam, intact, h)
    snap(force, strength, intact)
