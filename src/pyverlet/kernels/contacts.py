"""Narrow phase and contact solver, one pass over the candidate pairs a substep.

For circles i and j: normal n from i to j, depth = r_i + r_j - |x_j - x_i|, w = 1 / m.

Position: an overlapping pair is moved apart along n, each by its share w / (w_i + w_j). PUSHED of the depth goes into the
positions, FED of it, divided by h, into the velocities: that is what carries the weight of a pile from one substep to the next
(Mueller et al. 2007, Position Based Dynamics, has 1 and 1).

Velocity: what projection feeds in must not become a bounce. A second pass sets the normal velocity of touching pairs
to 0 (Mueller et al. 2020, Detailed Rigid Body Simulation, section 3.5). With friction that pass is kernels.friction.rub.

Impacts, when e > 0, come before both: kernels.impacts.

Everything here runs strip by strip as kernels.pairs explains: even strips in parallel, then odd ones.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import PUSHED
from pyverlet.kernels.bounds import CARRIES
from pyverlet.kernels.impacts import APART, PARTING, part
from pyverlet.kernels.motion import IN_PILE
from pyverlet.kernels.seam import nearest

# Golden angle, rad: coincident centres part in directions spread evenly over the circle.
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

# m^2 (m where a distance is meant): added to a divisor that is 0 for coincident centres. Below the rounding of any real distance.
_TINY = 1e-30


@kernel
def _any_normal(i, j):
    """A unit vector for circles whose centres coincide, where the normal is 0 / 0."""
    angle = _GOLDEN_ANGLE * (i + j)
    return np.cos(angle), np.sin(angle)


@kernel
def _project_strip(position, velocity, radius, inverse_mass, pair_i, pair_j, feed, most, touching, impulse):
    zero = feed - feed
    pushed = position.dtype.type(PUSHED)
    count = 0
    for k in range(pair_i.shape[0]):
        i, j = pair_i[k], pair_j[k]
        xi, yi, xj, yj = position[i, 0], position[i, 1], position[j, 0], position[j, 1]
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx, dy = xj - xi, yj - yi
        reach = radius[i] + radius[j]
        distance = np.sqrt(dx * dx + dy * dy)
        if distance == zero:
            nx, ny = _any_normal(i, j)
            dx, dy, distance = reach * position.dtype.type(nx), reach * position.dtype.type(ny), reach
            depth = most * reach
        else:
            # No branch on touching: a third of the candidates do not, in no order, and each wrong guess stalls the processor.
            depth = min(max(reach - distance, zero), most * reach)
        # One division for all: a second one cost 3 ns more a particle.
        scale = depth / (distance * (wi + wj))
        push = scale * pushed
        cx, cy = dx * push, dy * push
        position[i, 0] = xi - cx * wi
        position[i, 1] = yi - cy * wi
        position[j, 0] = xj + cx * wj
        position[j, 1] = yj + cy * wj
        kick = scale * feed
        cx, cy = dx * kick, dy * kick
        velocity[i, 0] -= cx * wi
        velocity[i, 1] -= cy * wi
        velocity[j, 0] += cx * wj
        velocity[j, 1] += cy * wj
        touching[count] = k
        impulse[count] = kick * distance
        count += depth > zero
    return count


@kernel
def _make_room(position, velocity, radius, inverse_mass, i, j, slow, most, weight):
    """Move i and j, on their way apart, to where they no longer overlap, without throwing them apart any faster.

    Those without weight that will part by themselves, faster than `slow` times the gap, are left alone: moving them changes their
    angular momentum.
    """
    zero = most - most
    dx, dy = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    reach = radius[i] + radius[j]
    distance = np.sqrt(dx * dx + dy * dy)
    if zero < distance < reach:
        nx, ny = dx / distance, dy / distance
        leaving = (velocity[j, 0] - velocity[i, 0]) * nx + (velocity[j, 1] - velocity[i, 1]) * ny
        if weight or (slow > zero and leaving < (reach - distance) * slow):
            shift = min(reach - distance, most * reach) / (inverse_mass[i] + inverse_mass[j])
            part(position, velocity, inverse_mass, i, j, nx, ny, shift, zero)


@kernel
def _rest_strip(position, velocity, radius, inverse_mass, pair_i, pair_j, feed, most, slow, meeting, fed, touching, impulse):
    zero = feed - feed
    pushed = position.dtype.type(PUSHED)
    count = 0
    for k in range(pair_i.shape[0]):
        i, j = pair_i[k], pair_j[k]
        if meeting[k] == PARTING:
            _make_room(position, velocity, radius, inverse_mass, i, j, slow, most, (fed[i] | fed[j]) & CARRIES)
            # At or before k: nothing that is still to be read is overwritten.
            if impulse[k] > zero:
                touching[count] = k
                impulse[count] = -impulse[k]
                count += 1
            continue
        # A pair that has come together only now waits for the next substep, unless one of them carries weight.
        if meeting[k] == APART and not (fed[i] | fed[j]) & CARRIES:
            continue
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        reach = radius[i] + radius[j]
        distance = np.sqrt(dx * dx + dy * dy)
        if distance < reach:
            if distance == zero:
                ax, ay = _any_normal(i, j)
                nx, ny = position.dtype.type(ax), position.dtype.type(ay)
            else:
                nx, ny = dx / distance, dy / distance
            shift = min(reach - distance, most * reach) / (inverse_mass[i] + inverse_mass[j])
            kick = shift * feed
            part(position, velocity, inverse_mass, i, j, nx, ny, shift * pushed, kick)
            fed[i] |= CARRIES
            fed[j] |= CARRIES
            touching[count] = k
            impulse[count] = kick
            count += 1
    return count


@kernel
def _still_strip(position, velocity, inverse_mass, pair_i, pair_j, touching, impulse):
    zero, tiny = position.dtype.type(0), position.dtype.type(_TINY)
    for t in range(touching.shape[0]):
        k = touching[t]
        i, j = pair_i[k], pair_j[k]
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        vxi, vyi, vxj, vyj = velocity[i, 0], velocity[i, 1], velocity[j, 0], velocity[j, 1]
        vn = (vxj - vxi) * dx + (vyj - vyi) * dy
        kick = vn / ((wi + wj) * (dx * dx + dy * dy + tiny))
        kick = zero if impulse[t] < zero else kick
        cx, cy = kick * dx, kick * dy
        velocity[i, 0] = vxi + cx * wi
        velocity[i, 1] = vyi + cy * wi
        velocity[j, 0] = vxj - cx * wj
        velocity[j, 1] = vyj - cy * wj


@parallel_kernel
def project(position, velocity, radius, inverse_mass, first, count, pair_i, pair_j, feed, most, touching, impulse, touches):
    """Move overlapping pairs apart (e = 0) and list them.

    feed: FED / h, 1/s. touches[s]: how many strip s has in touching, impulse.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            touches[s] = _project_strip(
                position, velocity, radius, inverse_mass, pair_i[a:b], pair_j[a:b], feed, most, touching[a:b], impulse[a:b]
            )


@parallel_kernel
def project_resting(
    position, velocity, radius, inverse_mass, first, count, pair_i, pair_j, feed, most, slow, meeting, fed,
    touching, impulse, touches,
):  # fmt: skip
    """What `project` does, after `impacts`. Those that have bounced are listed too, with their impulse made negative.

    feed: FED / h, 1/s. slow: 1/s, as for _make_room; 1 / h where accelerations could stop a pair that parts, 0 where nothing can.
    fed[i] becomes CARRIES for every particle whose velocity is fed.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            touches[s] = _rest_strip(
                position, velocity, radius, inverse_mass, pair_i[a:b], pair_j[a:b], feed, most, slow, meeting[a:b], fed,
                touching[a:b], impulse[a:b],
            )  # fmt: skip


@parallel_kernel
def still_resting(position, velocity, inverse_mass, first, count, pair_i, pair_j, touching, impulse, touches):
    """Set the normal velocity of touching pairs to 0, but not for pairs that have bounced (impulse < 0)."""
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _still_strip(position, velocity, inverse_mass, pair_i[a:b], pair_j[a:b], touching[a:t], impulse[a:t])


@kernel
def mark_touching(first, pair_i, pair_j, touching, impulse, touches, flag):
    """flag[i] gains IN_PILE for every particle of a touching pair that has not bounced."""
    for s in range(first.shape[0]):
        a = first[s]
        for t in range(a, a + touches[s]):
            if not impulse[t] < 0:
                flag[pair_i[a + touching[t]]] |= IN_PILE
                flag[pair_j[a + touching[t]]] |= IN_PILE


@kernel
def fit(position, radius, period_x, period_y, first, count, pair_i, pair_j, fresh, least, grown):
    """Shrink fresh particles, and those they overlap, until they just touch: grown = distance / (r_i + r_j), at least `least`."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if fresh[i] | fresh[j]:
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                part = max(np.sqrt(dx * dx + dy * dy) / (radius[i] + radius[j]), least)
                grown[i] = min(grown[i], part)
                grown[j] = min(grown[j], part)


@kernel
def overlaps(position, radius, period_x, period_y, first, count, pair_i, pair_j):
    """(number of touching pairs, sum and maximum of depth / (r_i + r_j))."""
    number, total, largest = 0, 0.0, 0.0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            dx = nearest(np.float64(position[j, 0]) - np.float64(position[i, 0]), period_x)
            dy = nearest(np.float64(position[j, 1]) - np.float64(position[i, 1]), period_y)
            reach = np.float64(radius[i]) + np.float64(radius[j])
            overlap = 1.0 - np.sqrt(dx * dx + dy * dy) / reach
            if overlap > 0.0:
                number += 1
                total += overlap
                largest = max(largest, overlap)
    return number, total, largest
