"""Links: constraints between particles, solved once a substep on the positions the integrator predicts.

Row r has a value C(x), its gradient g, a stiffness k and a damping d (kernels.shapes measures them). It acts with the force
F = -(k C + d dC/dt) along g. What is solved for is lam = F h^2; then x moves by w g lam and the velocity by that over h (Macklin
et al. 2019, Small Steps in Physics Simulation). Two things differ from there, both for the sake of energy:

The force acts along g at the start of the substep, not at its end. For a rigid link that is SHAKE (Ryckaert, Ciccotti, Berendsen
1977): with an integrator of Stormer's kind symplectic, where projection along the new direction brakes whatever turns. Only where
the pull makes particles swing sideways faster than substeps can follow (a light rope, a heavy ball) the new direction is taken.

For a soft link the C of the force is a C+ + b C0 + c C-, of the end, the start and the substep before. (1/4, 1/2, 1/4) neither
damps nor explodes, (1, 0, 0) is XPBD and settles links stiffer than the substep can follow; `blend` goes from one to the other.

Rows are solved colour by colour (Gauss-Seidel); those of one colour share no particle. kernels.chains solves whole chains of
distances at once. Everything here is float64, on a compact copy of the linked particles.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import LINK_GIVE, LINK_LEAST_N, LINK_MEMORY_S, LINK_RESOLVED
from pyverlet.kernels.seam import image_near


@kernel
def share_settled(s):
    """From 0, follow the motion, to 1, settle it; s = (frequency * h)^2."""
    return s * s / (s * s + LINK_RESOLVED * LINK_RESOLVED)


@kernel
def blend(stiffness, damping, ww, h):
    """(K+, K0, K-): the force is -(K+ C+ + K0 C0 + K- C-). ww: sum of w |g|^2, 1/kg for a distance."""
    s = h * h * stiffness * ww  # (natural frequency * h)^2
    q = share_settled(s)
    kp, k0, km = stiffness * (1.0 + 3.0 * q) / 4.0, stiffness * (1.0 - q) / 2.0, stiffness * (1.0 - q) / 4.0
    # The rate of C likewise: (C+ - C-) / 2h where the substep resolves the damping, (C+ - C0) / h where it does not.
    s = h * damping * ww
    p = 0.5 + 0.5 * s / (1.0 + s)
    rate = damping / h
    return kp + rate * p, k0 + rate * (1.0 - 2.0 * p), km - rate * (1.0 - p)


@parallel_kernel
def prepare(
    first, particle, weight, stiffness, damping, upper, h, start, earlier, gradient, bend, force, last, give, offset,
    turn, bow, lam,
):  # fmt: skip
    """From C0 `start`, C- `earlier` and the last force: row r is to satisfy C+ + offset + give lam = 0.

    Its force acts along a direction that is the part `turn` of the way from the old gradient to the new; bow: see kernels.chains.
    lam starts from the `last` pull, N, as far as the substep follows the motion.
    """
    for r in prange(stiffness.shape[0]):
        ww = total = 0.0
        for e in range(first[r], first[r + 1]):
            total += weight[particle[e]]
            ww += weight[particle[e]] * (gradient[e, 0] * gradient[e, 0] + gradient[e, 1] * gradient[e, 1])
        give[r] = LINK_GIVE * ww
        offset[r] = lam[r] = 0.0
        swing = h * h * abs(force[r]) * bend[r] * total  # (frequency of swinging sideways * h)^2
        turn[r] = share_settled(swing)
        bow[r] = turn[r] * h * h * max(force[r], 0.0) * bend[r]
        if stiffness[r] < np.inf:
            kp, k0, km = blend(stiffness[r], damping[r], ww, h)
            c0, cm = start[r], earlier[r]
            if upper[r] <= 0.0:  # a slack rope has no stretch to remember
                c0, cm = max(c0, 0.0), max(cm, 0.0)
            give[r] += 1.0 / (h * h * max(kp, 1e-300))
            offset[r] = (k0 * c0 + km * cm) / max(kp, 1e-300)
            if upper[r] == np.inf:
                lam[r] = -(1.0 - share_settled(h * h * stiffness[r] * ww)) * last[r] * h * h


@parallel_kernel
def begin_rows(begin, end, position, first, particle, weight, intact, along, lam):
    """Move the particles of the rows `begin` to `end`, which share none, by the lam they start from."""
    for r in prange(begin, end):
        if intact[r] and lam[r] != 0.0:
            for e in range(first[r], first[r + 1]):
                w = weight[particle[e]] * lam[r]
                if w != 0.0:
                    position[particle[e], 0] += w * along[e, 0]
                    position[particle[e], 1] += w * along[e, 1]


@parallel_kernel
def solve_rows(begin, end, position, first, particle, weight, upper, intact, value, gradient, along, turn, give, offset, lam):
    """Move the particles of the rows `begin` to `end`, which share none; add to lam what it took."""
    for r in prange(begin, end):
        if not intact[r]:
            continue
        straight = turned = 0.0
        for e in range(first[r], first[r + 1]):
            w = weight[particle[e]]
            along[e, 0] += turn[r] * (gradient[e, 0] - along[e, 0])
            along[e, 1] += turn[r] * (gradient[e, 1] - along[e, 1])
            straight += w * (gradient[e, 0] * gradient[e, 0] + gradient[e, 1] * gradient[e, 1])
            turned += w * (gradient[e, 0] * along[e, 0] + gradient[e, 1] * along[e, 1])
        if turned < 0.5 * straight:  # turned by more than 60 degrees in a substep: the old direction says nothing any more
            turned = straight
            for e in range(first[r], first[r + 1]):
                along[e, 0], along[e, 1] = gradient[e, 0], gradient[e, 1]
        if turned <= 0.0:
            continue
        step = -(value[r] + offset[r] + give[r] * lam[r]) / (turned + give[r])
        step = min(step, upper[r] - lam[r])
        lam[r] += step
        for e in range(first[r], first[r + 1]):
            w = weight[particle[e]] * step
            if w != 0.0:
                position[particle[e], 0] += w * along[e, 0]
                position[particle[e], 1] += w * along[e, 1]


@kernel
def note_force(force, last, lam, intact, h):
    """last = -lam / h^2, the pull in N, which for rigid links is noisy; let `force` follow it, but for the broken."""
    part = h / (h + LINK_MEMORY_S)
    for r in range(force.shape[0]):
        last[r] = -lam[r] / (h * h)
        if intact[r]:
            force[r] += part * (last[r] - force[r])
            if abs(force[r]) < LINK_LEAST_N:
                force[r] = 0.0


@kernel
def snap(force, strength, intact):
    """Break every row that pulls or pushes harder than its strength, N."""
    for r in range(force.shape[0]):
        if abs(force[r]) > strength[r]:
            intact[r] = 0


@kernel
def recall(past_number, past_start, past_left, past_calm, number, position, particle, start, calm):
    """A frame begins: what is remembered of each `particle`, in `start` and `calm`, if it is where it was left; NaN if not.

    number, position: of all, in the user's order; `particle` and both numbers are ascending.
    """
    r = 0
    for k in range(particle.shape[0]):
        p = particle[k]
        calm[k] = np.nan
        while r < past_number.shape[0] and past_number[r] < number[p]:
            r += 1
        if r == past_number.shape[0]:
            continue
        if past_number[r] == number[p] and past_left[r, 0] == position[p, 0] and past_left[r, 1] == position[p, 1]:
            start[k, 0], start[k, 1], calm[k] = past_start[r, 0], past_start[r, 1], past_calm[r]


@parallel_kernel
def look_back(slot, position, velocity, inverse_mass, period_x, period_y, calm, h, start, earlier, weight):
    """Copy who is linked: where a substep starts; `earlier`, where everybody was a substep ago; the inverse mass.

    That is by the velocity, or, by memory of `start`, where rest has put another velocity in. Contacts at rest carry weight by
    small velocities that move nobody, and links would take them for motion. calm: (k,) m/s, by how much the velocity may differ
    from the way gone and still be of that kind; beyond it there was an impact. NaN: unknown. In a periodic room what is
    remembered may be another image of where they were.
    """
    for k in prange(slot.shape[0]):
        s = slot[k]
        before_x, before_y = start[k, 0], start[k, 1]
        start[k, 0], start[k, 1] = position[s, 0], position[s, 1]
        x, y = start[k, 0] - h * np.float64(velocity[s, 0]), start[k, 1] - h * np.float64(velocity[s, 1])
        bx = image_near(before_x, start[k, 0], period_x)
        by = image_near(before_y, start[k, 1], period_y)
        dx, dy, most = x - bx, y - by, h * calm[k]
        if dx * dx + dy * dy <= most * most:
            x, y = bx, by
        earlier[k, 0], earlier[k, 1] = x, y
        weight[k] = inverse_mass[s]


@parallel_kernel
def take_twice(position, predicted, source, slot):
    """Where the integrator has put who is linked, in two copies: one to solve on."""
    for k in prange(slot.shape[0]):
        s = slot[k]
        for axis in range(2):
            position[k, axis] = predicted[k, axis] = source[s, axis]


@parallel_kernel
def hand_back(position, velocity, slot, solved, predicted, rate, pull):
    """Give the particles in `slot` their solved positions, and their velocities what that came to; pull: m/s^2 it was."""
    for k in prange(slot.shape[0]):
        s = slot[k]
        for axis in range(2):
            shift = solved[k, axis] - predicted[k, axis]
            position[s, axis] = solved[k, axis]
            velocity[s, axis] += shift * rate
            pull[k, axis] = shift * rate * rate


@parallel_kernel
def add_pull(acceleration, slot, pull, calm, rest):
    """acceleration[slot[k]] += pull[k], (n, 2); no slot comes twice. calm[k] becomes what both are in `rest` seconds, m/s."""
    for k in prange(slot.shape[0]):
        s = slot[k]
        ax, ay = np.float64(acceleration[s, 0]), np.float64(acceleration[s, 1])
        calm[k] = rest * (np.sqrt(ax * ax + ay * ay) + np.sqrt(pull[k, 0] * pull[k, 0] + pull[k, 1] * pull[k, 1]))
        acceleration[s, 0] += pull[k, 0]
        acceleration[s, 1] += pull[k, 1]
