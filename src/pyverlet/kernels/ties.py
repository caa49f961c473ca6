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
    predicted, weight, start, back, particle, point, period_x, period_y, stiffness, damping, intact, h, give, left, way, kept,
):  # fmt: skip
    """Pins, before the rows: what a spring to a point does to its particle alone. The rows then meet a heavier particle.

    For them the particle has the inverse mass w give / (w + give): elimination, exact, which no Gauss-Seidel would be for a light
    particle that holds a heavy rope. It is `predicted` elsewhere meanwhile, `way` from where it was; what is left of the stretch
    is `left`, and what rows add to it is so little for a stiff pin that it has to be added up by itself, in `shift`.
    """
    for r in range(particle.shape[0]):
        p = particle[r]
        w = np.float64(weight[p])
        give[r] = 0.0
        if not intact[r] or w == 0.0:
            continue
        at = _near(point, r, start, p, period_x, period_y)
        kp, k0, km = 0.0, 0.0, 0.0
        give[r] = LINK_GIVE * LINK_GIVE * w
        if stiffness[r] < np.inf:
            kp, k0, km = blend(stiffness[r], damping[r], w, h)
            kp = max(kp, 1e-300)
            give[r] = 1.0 / (h * h * kp)
        for axis in range(2):
            kept[r, axis] = predicted[p, axis]
            away = kept[r, axis] - at[axis]
            if kp > 0.0:
                before = np.float64(start[p, axis]) - at[axis]
                away += (k0 * before + km * (before - back[p, axis])) / kp
            predicted[p, axis] = kept[r, axis] - w / (w + give[r]) * away
            left[r, axis] = give[r] / (w + give[r]) * away
            way[r, axis] = np.float64(predicted[p, axis]) - kept[r, axis]
        weight[p] = w * give[r] / (w + give[r])


@kernel
def note_ties(shift, predicted, particle, strength, intact, h, give, left, way, kept, lam, last, force):
    """What each pin pulls with after the rows; break those that pull too hard. What they did is part of the `shift`."""
    for r in range(particle.shape[0] - 1, -1, -1):
        lam[r] = 0.0
        if give[r] > 0.0:
            p = particle[r]
            x, y = left[r, 0] + shift[p, 0], left[r, 1] + shift[p, 1]
            lam[r] = -np.sqrt(x * x + y * y) / give[r]
            for axis in range(2):
                shift[p, axis] += way[r, axis]
                predicted[p, axis] = kept[r, axis]
    note_force(force, last, lam, intact, h)
    snap(force, strength, intact)
