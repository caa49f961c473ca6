"""Pins: links of one particle to a point, solved before all others."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.ground.constants import LINK_GIVE
from pyverlet.kernels.links import blend


@kernel
def tie(position, weight, start, earlier, particle, point, stiffness, damping, intact, h, give, offset):
    """Pins, before the rows: what a spring to a point does to its particle alone. The rows then meet a heavier particle.

    For them the particle has the inverse mass w give / (w + give): elimination, exact, which no Gauss-Seidel would be for a light
    particle that holds a heavy rope.
    """
    for r in range(particle.shape[0]):
        p = particle[r]
        w = weight[p]
        if not intact[r] or w == 0.0:
            continue
        give[r] = LINK_GIVE * LINK_GIVE * w
        offset[r, 0] = offset[r, 1] = 0.0
        if stiffness[r] < np.inf:
            kp, k0, km = blend(stiffness[r], damping[r], w, h)
            give[r] = 1.0 / (h * h * max(kp, 1e-300))
            for axis in range(2):
                before = k0 * (start[p, axis] - point[r, axis]) + km * (earlier[p, axis] - point[r, axis])
                offset[r, axis] = before / max(kp, 1e-300)
        for axis in range(2):
            away = position[p, axis] - point[r, axis] + offset[r, axis]
            position[p, axis] -= w / (w + give[r]) * away
        weight[p] = w * give[r] / (w + give[r])


@kernel
def pull_of_ties(position, particle, point, intact, give, offset, lam):
    """What each pin pulls with after the rows, in lam."""
    for r in range(particle.shape[0]):
        lam[r] = 0.0
        if intact[r] and give[r] > 0.0:
            x = position[particle[r], 0] - point[r, 0] + offset[r, 0]
            y = position[particle[r], 1] - point[r, 1] + offset[r, 1]
            lam[r] = -np.sqrt(x * x + y * y) / give[r]
