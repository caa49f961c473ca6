"""Narrow phase and contact solver, one pass over the candidate pairs a substep.

For circles i and j: normal n from i to j, depth = r_i + r_j - |x_j - x_i|, w = 1 / m.

Position: an overlapping pair is moved apart along n, each by its share w / (w_i + w_j). PUSHED of the depth goes into the
positions, FED of it, divided by h, into the velocities: that is what carries the weight of a pile from one substep to the next
(Mueller et al. 2007, Position Based Dynamics, has 1 and 1).

Velocity: what projection feeds in must not become a bounce. A second pass sets the normal velocity of touching pairs
to 0, and applies Coulomb friction with the normal impulse the projection has found (Mueller et al. 2020, Detailed Rigid Body
Simulation, section 3.5).

Impact, when e > 0, comes before both, while velocities are still those of the motion: a pair that meets faster than contact at
rest explains gets the impulse (1 + e) v_n, and the time left since is travelled with the new velocities, so that e = 1 keeps the
kinetic energy to rounding, in whatever order the pairs come. Two circles that both carried weight a substep ago do not meet, they
tremble: bouncing them keeps small ones in a pile rattling for ever.

Everything here runs strip by strip as kernels.grid explains: even strips in parallel, then odd ones.
"""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange
from pyverlet.constants import FED, HELD, PUSHED

# Golden angle, rad: coincident centres part in directions spread evenly over the circle.
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

# How a candidate pair stands at the end of the integration, before contacts have changed a velocity.
_APART, _RESTING, _PARTING = 0, 1, 2

# m^2 (m where a distance is meant): added to a divisor that is 0 for coincident centres. Below the rounding of any real distance.
_TINY = 1e-30


@kernel
def _any_normal(i, j):
    """A unit vector for circles whose centres coincide, where the normal is 0 / 0."""
    angle = _GOLDEN_ANGLE * (i + j)
    return np.cos(angle), np.sin(angle)


@kernel
def _project_strip(position, velocity, radius, inverse_mass, pair_i, pair_j, rate, most, touching, impulse):
    zero = rate - rate
    pushed, feed = position.dtype.type(PUSHED), position.dtype.type(FED) * rate
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
def _impact_strip(
    position, velocity, acceleration, radius, inverse_mass, pair_i, pair_j, h, lag, e, rest_speed, fed, meeting, impulse
):
    zero = h - h
    two = position.dtype.type(2)
    for k in range(pair_i.shape[0]):
        i, j = pair_i[k], pair_j[k]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        reach = radius[i] + radius[j]
        square = dx * dx + dy * dy
        if square >= reach * reach:
            meeting[k] = _APART
            continue
        impulse[k] = zero
        distance = np.sqrt(square)
        if distance == zero:
            meeting[k] = _RESTING
            continue
        nx, ny = dx / distance, dy / distance
        # As at a wall (kernels.bounds): the impact lies in the past, under the relative acceleration an.
        an = (acceleration[j, 0] - acceleration[i, 0]) * nx + (acceleration[j, 1] - acceleration[i, 1]) * ny
        before = (velocity[j, 0] - velocity[i, 0]) * nx + (velocity[j, 1] - velocity[i, 1]) * ny
        vn = before + lag * an
        depth = reach - distance
        hit = np.sqrt(max(vn * vn + two * an * depth, zero))
        if fed[i] & fed[j]:
            # Both carried weight a substep ago: what speed they have is the trembling of the pile, not an arrival.
            meeting[k] = _RESTING
        elif vn > rest_speed:
            meeting[k] = _PARTING
        elif vn >= zero or hit <= rest_speed:
            meeting[k] = _RESTING
        else:
            time = min(two * depth / (hit - vn), h)
            travelled = e * hit * time + an * time * time / two
            w = inverse_mass[i] + inverse_mass[j]
            shift = (depth + max(travelled, zero)) / w
            kick = (e * hit + an * time - lag * an - before) / w
            meeting[k] = _PARTING
            impulse[k] = kick
            _part(position, velocity, inverse_mass, i, j, nx, ny, shift, kick)


@kernel
def _part(position, velocity, inverse_mass, i, j, nx, ny, shift, kick):
    """Move i and j apart along n by `shift` per inverse mass, and their velocities by `kick`."""
    wi, wj = inverse_mass[i], inverse_mass[j]
    position[i, 0] -= shift * wi * nx
    position[i, 1] -= shift * wi * ny
    position[j, 0] += shift * wj * nx
    position[j, 1] += shift * wj * ny
    velocity[i, 0] -= kick * wi * nx
    velocity[i, 1] -= kick * wi * ny
    velocity[j, 0] += kick * wj * nx
    velocity[j, 1] += kick * wj * ny


@kernel
def _rest_strip(position, velocity, radius, inverse_mass, pair_i, pair_j, rate, most, meeting, fed, touching, impulse):
    zero = rate - rate
    pushed, feed = position.dtype.type(PUSHED), position.dtype.type(FED) * rate
    count = 0
    for k in range(pair_i.shape[0]):
        i, j = pair_i[k], pair_j[k]
        parting = meeting[k] == _PARTING
        # A pair that has come together only now waits for the next substep, unless one of them carries weight.
        if meeting[k] == _APART and not (fed[i] | fed[j]):
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
            # Those already on their way are given room, but are not thrown apart any faster.
            kick = zero if parting else shift * feed
            shift = shift if parting else shift * pushed
            _part(position, velocity, inverse_mass, i, j, nx, ny, shift, kick)
        elif not parting:
            continue
        # At or before k: nothing that is still to be read is overwritten.
        if not parting:
            fed[i] = 1
            fed[j] = 1
            touching[count] = k
            impulse[count] = kick
            count += 1
        elif impulse[k] > zero:
            touching[count] = k
            impulse[count] = -impulse[k]
            count += 1
    return count


@kernel
def _still_strip(position, velocity, inverse_mass, pair_i, pair_j, touching):
    tiny = position.dtype.type(_TINY)
    for t in range(touching.shape[0]):
        k = touching[t]
        i, j = pair_i[k], pair_j[k]
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        vxi, vyi, vxj, vyj = velocity[i, 0], velocity[i, 1], velocity[j, 0], velocity[j, 1]
        vn = (vxj - vxi) * dx + (vyj - vyi) * dy
        kick = vn / ((wi + wj) * (dx * dx + dy * dy + tiny))
        cx, cy = kick * dx, kick * dy
        velocity[i, 0] = vxi + cx * wi
        velocity[i, 1] = vyi + cy * wi
        velocity[j, 0] = vxj - cx * wj
        velocity[j, 1] = vyj - cy * wj


@kernel
def _rub_strip(start, position, velocity, spin, radius, inverse_mass, pair_i, pair_j, h, mu, touching, impulse):
    zero = h - h
    two = position.dtype.type(2)
    three = position.dtype.type(3)
    tiny = position.dtype.type(_TINY)
    part = position.dtype.type(HELD)
    for t in range(touching.shape[0]):
        k = touching[t]
        i, j = pair_i[k], pair_j[k]
        wi, wj = inverse_mass[i], inverse_mass[j]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        distance = np.sqrt(dx * dx + dy * dy) + tiny
        nx, ny = dx / distance, dy / distance
        vx = velocity[j, 0] - velocity[i, 0]
        vy = velocity[j, 1] - velocity[i, 1]
        bounced = impulse[t] < zero
        kick = zero if bounced else -(vx * nx + vy * ny) / (wi + wj)
        # Tangent (ny, -nx). A disc has I = m r^2 / 2, so the contact point has the inverse mass w + r^2 / I = 3 w.
        slip = vx * ny - vy * nx + spin[i] * radius[i] + spin[j] * radius[j]
        most = mu * max(abs(impulse[t]) + min(kick, zero), zero)
        rub = max(min(-slip / (three * (wi + wj)), most), -most)
        px = kick * nx + rub * ny
        py = kick * ny - rub * nx
        velocity[i, 0] -= px * wi
        velocity[i, 1] -= py * wi
        velocity[j, 0] += px * wj
        velocity[j, 1] += py * wj
        spin[i] += two * rub * wi / radius[i]
        spin[j] += two * rub * wj / radius[j]
        # Between circles at rest friction has held during the substep too: without this a heap creeps by g h^2 each substep. What
        # slipped is measured from where the substep started; the velocity would count feeds that have moved nobody yet.
        sx = (position[j, 0] - start[j, 0]) - (position[i, 0] - start[i, 0])
        sy = (position[j, 1] - start[j, 1]) - (position[i, 1] - start[i, 1])
        slipped = sx * ny - sy * nx + h * (spin[i] * radius[i] + spin[j] * radius[j])
        back = part * max(min(-slipped / (wi + wj), h * most), -h * most)
        held = zero if bounced else back
        sx, sy = held * ny, -held * nx
        position[i, 0] -= sx * wi
        position[i, 1] -= sy * wi
        position[j, 0] += sx * wj
        position[j, 1] += sy * wj


@parallel_kernel
def project(position, velocity, radius, inverse_mass, first, count, pair_i, pair_j, rate, most, touching, impulse, touches):
    """Move overlapping pairs apart (e = 0) and list them. rate = 1 / h; touches[s]: how many strip s has in touching, impulse."""
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            touches[s] = _project_strip(
                position, velocity, radius, inverse_mass, pair_i[a:b], pair_j[a:b], rate, most, touching[a:b], impulse[a:b]
            )


@parallel_kernel
def impacts(
    position, velocity, acceleration, radius, inverse_mass, first, count, pair_i, pair_j, h, lag, e, rest_speed,
    fed, meeting, impulse,
):  # fmt: skip
    """Bounce every pair that meets faster than rest_speed; note in `meeting` how each stands, in `impulse` how hard it hit."""
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            _impact_strip(
                position, velocity, acceleration, radius, inverse_mass, pair_i[a:b], pair_j[a:b], h, lag, e, rest_speed,
                fed, meeting[a:b], impulse[a:b],
            )  # fmt: skip


@parallel_kernel
def project_resting(
    position, velocity, radius, inverse_mass, first, count, pair_i, pair_j, rate, most, meeting, fed,
    touching, impulse, touches,
):  # fmt: skip
    """What `project` does, after `impacts`. Those that have bounced are listed too, with their impulse made negative.

    fed[i] is set to 1 for every particle whose velocity is fed.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            touches[s] = _rest_strip(
                position, velocity, radius, inverse_mass, pair_i[a:b], pair_j[a:b], rate, most, meeting[a:b], fed,
                touching[a:b], impulse[a:b],
            )  # fmt: skip


@parallel_kernel
def still(position, velocity, inverse_mass, first, count, pair_i, pair_j, touching, touches):
    """Set the normal velocity of touching pairs to 0."""
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            _still_strip(position, velocity, inverse_mass, pair_i[a:b], pair_j[a:b], touching[a : a + touches[s]])


@parallel_kernel
def rub(
    start, position, velocity, spin, radius, inverse_mass, first, count, pair_i, pair_j, h, mu, touching, impulse, touches
):  # fmt: skip
    """The same, but not for pairs that have bounced (impulse < 0); and Coulomb friction for both.

    It is at most mu times the normal impulse, and no more than stops the slip. start: positions before the integration.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _rub_strip(
                start, position, velocity, spin, radius, inverse_mass, pair_i[a:b], pair_j[a:b], h, mu,
                touching[a:t], impulse[a:t],
            )  # fmt: skip


@kernel
def mark_touching(first, pair_i, pair_j, touching, impulse, touches, flag):
    """flag[i] = 1 for every particle of a touching pair that has not bounced."""
    for s in range(first.shape[0]):
        a = first[s]
        for t in range(a, a + touches[s]):
            if not impulse[t] < 0:
                flag[pair_i[a + touching[t]]] = 1
                flag[pair_j[a + touching[t]]] = 1


@kernel
def fit(position, radius, first, count, pair_i, pair_j, fresh, least, grown):
    """Shrink fresh particles, and those they overlap, until they just touch: grown = distance / (r_i + r_j), at least `least`."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if fresh[i] | fresh[j]:
                dx = position[j, 0] - position[i, 0]
                dy = position[j, 1] - position[i, 1]
                part = max(np.sqrt(dx * dx + dy * dy) / (radius[i] + radius[j]), least)
                grown[i] = min(grown[i], part)
                grown[j] = min(grown[j], part)


@kernel
def overlaps(position, radius, first, count, pair_i, pair_j):
    """(number of touching pairs, sum and maximum of depth / (r_i + r_j))."""
    number, total, largest = 0, 0.0, 0.0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            dx = np.float64(position[j, 0]) - np.float64(position[i, 0])
            dy = np.float64(position[j, 1]) - np.float64(position[i, 1])
            reach = np.float64(radius[i]) + np.float64(radius[j])
            overlap = 1.0 - np.sqrt(dx * dx + dy * dy) / reach
            if overlap > 0.0:
                number += 1
                total += overlap
                largest = max(largest, overlap)
    return number, total, largest
