"""Circles at rest against each other lend each other inertia, so that light ones can carry heavy ones.

What one circle can do to another in a substep goes with the lighter mass of the two: many small pushes hold a heavy circle on
light ones, late and softly. But within a heap at rest nobody can tell which of the circles has the mass, as long as each keeps
its weight. So those that touch even out their inertia m', the sum of which stays the same, and solve contacts with it:

- The weight of what walls hold is still m a, not m' a: before contacts are solved, the integration's a h becomes a h m / m', and
  of how far that has moved the circle only the part PUSHED / FED, for the velocities with which circles at rest end a substep
  stay as they are.
- Who touches nobody has that undone, and falls as everything does; what was lent goes back within LOAN_S.
- Who bounces has its own mass at once, and lends and borrows nothing for LOAN_S: impacts go by the true masses.

To change the masses of particles that hardly move is common in calculations of granular matter (Thornton and Antony 1998,
Quasi-static deformation of particulate media, have more of it everywhere); here the sum is kept, and kernels.balance sees to it
that momentum is.
"""

from __future__ import annotations

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import LENT
from pyverlet.kernels.impacts import PARTING

# Of the own mass: less than this is no loan but the rounding of one.
_NOTHING = 1e-7


@kernel
def _inertia(mass, lent, i):
    """m + lent, at least what nobody may lend: the mass may have been changed since."""
    return max(mass[i] + lent[i], mass.dtype.type(1 - LENT) * mass[i])


@kernel
def weigh(mass, inverse_mass, lent, lighter):
    """lighter: 1 / m' of each circle, 1/kg."""
    for i in range(mass.shape[0]):
        w = inverse_mass[i]
        lighter[i] = w if w == w - w or lent[i] == w - w else w / w / _inertia(mass, lent, i)


@kernel
def recall(inverse_mass, first, count, pair_i, pair_j, meeting, impulse, wait, lent, busy, lighter):
    """After `impacts`: give those that have bounced their own inertia, and let them lend none for `wait` seconds."""
    for parity in range(2):
        for half in range((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            for k in range(first[s], first[s] + count[s]):
                if meeting[k] == PARTING and impulse[k] > 0:
                    for p in (pair_i[k], pair_j[k]):
                        lent[p] = 0
                        busy[p] = wait
                        lighter[p] = inverse_mass[p]


@kernel
def _pull(position, velocity, acceleration, inverse_mass, lighter, held, kick, fall, i):
    """Move circle i by what a (m / m' - 1) does to it: kick (s) in the velocity, fall (s^2) in the position."""
    w = inverse_mass[i]
    if held[i] and lighter[i] != w:
        more = lighter[i] / w - w / w
        velocity[i, 0] += more * kick * acceleration[i, 0]
        velocity[i, 1] += more * kick * acceleration[i, 1]
        position[i, 0] += more * fall * acceleration[i, 0]
        position[i, 1] += more * fall * acceleration[i, 1]


@kernel
def keep_weight(position, velocity, acceleration, inverse_mass, lighter, held, kick, fall):
    """Let the weight of each circle that walls hold, through others, be that of its own mass."""
    for i in range(position.shape[0]):
        _pull(position, velocity, acceleration, inverse_mass, lighter, held, kick, fall, i)


@kernel
def _share_strip(mass, inverse_mass, pair_i, pair_j, touching, impulse, lent, busy, touched):
    zero = mass.dtype.type(0)
    half = mass.dtype.type(0.5)
    least = mass.dtype.type(1 - LENT)
    for t in range(touching.shape[0]):
        if impulse[t] < zero:
            continue
        i, j = pair_i[touching[t]], pair_j[touching[t]]
        touched[i] = 1
        touched[j] = 1
        if inverse_mass[i] > zero and inverse_mass[j] > zero and not busy[i] > zero and not busy[j] > zero:
            mi, mj = mass[i] + lent[i], mass[j] + lent[j]
            flow = max(min(half * (mi - mj), mi - least * mass[i]), least * mass[j] - mj)
            lent[i] -= flow
            lent[j] += flow


@parallel_kernel
def share(mass, inverse_mass, first, count, pair_i, pair_j, touching, impulse, touches, lent, busy, touched):
    """Even out the inertia of each touching pair that has not bounced; nobody lends more than the part LENT of the own mass.

    touched[i], 0 before, becomes 1 for who is in such a pair.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            t = a + touches[s]
            _share_strip(mass, inverse_mass, pair_i[a:b], pair_j[a:b], touching[a:t], impulse[a:t], lent, busy, touched)


@kernel
def settle(position, velocity, acceleration, mass, inverse_mass, lighter, held, kick, fall, touched, back, h, lent, busy):
    """Let those that touch nobody fall as they would have, and give the part `back` of every loan back."""
    for i in range(position.shape[0]):
        if not touched[i]:
            _pull(position, velocity, acceleration, inverse_mass, lighter, held, -kick, -fall, i)
        busy[i] = max(busy[i] - h, h - h)
        lent[i] -= back * lent[i]
        if abs(lent[i]) < mass.dtype.type(_NOTHING) * mass[i]:
            lent[i] = h - h
