"""More sweeps over the few contacts that one sweep does not settle: light circles that carry heavy ones.

A sweep of Gauss and Seidel gives a light circle between two heavy ones to the one, and then to the other. What it leaves beyond
REFINED_FROM of the contact distance is treated again, there and back, a part at a time; nothing jumps where that begins.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import PUSHED, REFINED, REFINED_FROM, REFINEMENTS
from pyverlet.kernels.impacts import part


@kernel
def _excess(position, radius, i, j, most):
    """(unit normal, what of the overlap is beyond REFINED_FROM), 0 if none is or the centres coincide."""
    zero = most - most
    dx, dy = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    reach = radius[i] + radius[j]
    near = reach - position.dtype.type(REFINED_FROM) * reach
    square = dx * dx + dy * dy
    if square >= near * near or square == zero:
        return zero, zero, zero
    distance = np.sqrt(square)
    return dx / distance, dy / distance, min(near - distance, most * reach)


@kernel
def _refine_strip(position, velocity, radius, inverse_mass, pair_i, pair_j, feed, most, touching, impulse):
    zero = feed - feed
    pushed, feed = position.dtype.type(REFINED * PUSHED), position.dtype.type(REFINED) * feed
    deep = np.empty(touching.shape[0], np.int64)
    count = 0
    for t in range(touching.shape[0]):
        k = touching[t]
        if not impulse[t] < zero and _excess(position, radius, pair_i[k], pair_j[k], most)[2] > zero:
            deep[count] = t
            count += 1
    for sweep in range(REFINEMENTS):
        for n in range(count):
            t = deep[n if sweep % 2 else count - 1 - n]
            k = touching[t]
            i, j = pair_i[k], pair_j[k]
            nx, ny, depth = _excess(position, radius, i, j, most)
            shift = depth / (inverse_mass[i] + inverse_mass[j])
            part(position, velocity, inverse_mass, i, j, nx, ny, shift * pushed, shift * feed)
            impulse[t] += shift * feed


@parallel_kernel
def refine(position, velocity, radius, inverse_mass, first, count, pair_i, pair_j, feed, most, touching, impulse, touches):
    """After `project` or `project_resting`, with the same arguments; impulse gains what is added. Not for pairs that bounced."""
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _refine_strip(
                position, velocity, radius, inverse_mass, pair_i[a:b], pair_j[a:b], feed, most, touching[a:t], impulse[a:t]
            )
