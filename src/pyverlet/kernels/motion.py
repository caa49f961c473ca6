"""The two moves every integrator is made of, and the copies between the user's order and the engine's.

Arrays: position, velocity, acceleration (n, 2); radius, mass, inverse_mass, spin (n,). SI units.
Loops that treat x and y alike run over the 2 n numbers of a row after row: so they are vectorised, and four times as fast.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, copy_row, larger_finite, load, load_rows, spread, where_zero
from pyverlet.compile.rows import store_rows
from pyverlet.compile.stealing import claim_evenly, none_claimed

_ONE = np.uint64(1)

# What holds a particle at rest: a wall, others, or both.
ON_WALL, IN_PILE = 1, 2

BLOCK = 2048
"""Particles that one thread takes at a time, here and wherever one pass over all is made."""


@parallel_kernel
def advance(out, base, slope, h):
    """out = base + h * slope, on (n, 2) arrays. If out is base `add_scaled` is faster: always vectorised."""
    to, start, rate = out.reshape(-1), base.reshape(-1), slope.reshape(-1)
    for k in prange(to.shape[0]):
        to[k] = start[k] + h * rate[k]


@parallel_kernel
def add_scaled(what, slope, h):
    """what += h * slope, on (n, 2) arrays."""
    to, rate = what.reshape(-1), slope.reshape(-1)
    for k in prange(to.shape[0]):
        to[k] = to[k] + h * rate[k]


@kernel
def kick_drift(position, velocity, acceleration, h):
    """v += h a, then x += h v: both moves in one pass over the memory."""
    x, v, a = position.reshape(-1), velocity.reshape(-1), acceleration.reshape(-1)
    for k in range(x.shape[0]):
        kicked = v[k] + h * a[k]
        v[k] = kicked
        x[k] = x[k] + h * kicked


@kernel
def newton_block(acceleration, force, inverse_mass, gx, gy):
    """`newton`; returns the square of the largest acceleration."""
    a, f = acceleration.reshape(-1), force.reshape(-1)
    zero = gx - gx
    largest = zero
    if f.shape[0] == 0:
        for k in range(inverse_mass.shape[0]):
            i = np.uint64(2 * k)
            free = inverse_mass[np.uint64(k)] > zero
            a[i] = gx if free else zero
            a[i + _ONE] = gy if free else zero
        return gx * gx + gy * gy
    for k in range(inverse_mass.shape[0]):
        i = np.uint64(2 * k)
        w = inverse_mass[np.uint64(k)]
        # Computed before it is known whether it counts: a load that may not happen is not vectorised.
        ax, ay = gx + f[i] * w, gy + f[i + _ONE] * w
        free = w > zero
        ax, ay = ax if free else zero, ay if free else zero
        a[i], a[i + _ONE] = ax, ay
        largest = larger_finite(largest, ax * ax + ay * ay)
    return largest


@parallel_kernel
def newton(acceleration, force, inverse_mass, gx, gy):
    """a = g + F / m for every free particle, 0 for a pinned one (Newton's second law); returns the largest |a|.

    force: (n, 2), or (0, 2) where gravity alone acts.
    """
    largest = gx - gx
    for block in prange((inverse_mass.shape[0] + BLOCK - 1) // BLOCK):
        a, b = block * BLOCK, min((block + 1) * BLOCK, inverse_mass.shape[0])
        largest = max(largest, newton_block(acceleration[a:b], force[a:b], inverse_mass[a:b], gx, gy))
    return np.sqrt(largest)


@parallel_kernel
def newton_kick_drift(position, velocity, acceleration, force, inverse_mass, gx, gy, h, ahead):
    """v -= ahead a with the a of before, `newton`, v += h a, x += h v: block by block, for the caches' sake."""
    largest = gx - gx
    for block in prange((inverse_mass.shape[0] + BLOCK - 1) // BLOCK):
        a, b = block * BLOCK, min((block + 1) * BLOCK, inverse_mass.shape[0])
        if ahead != 0:
            add_scaled(velocity[a:b], acceleration[a:b], -ahead)
        largest = max(largest, newton_block(acceleration[a:b], force[a:b], inverse_mass[a:b], gx, gy))
        kick_drift(position[a:b], velocity[a:b], acceleration[a:b], h)
    return np.sqrt(largest)


@kernel
def set_out(position, origin, moved):
    """moved = position - origin."""
    x, start, way = position.reshape(-1), origin.reshape(-1), moved.reshape(-1)
    for k in range(x.shape[0]):
        way[k] = x[k] - start[k]


@kernel
def arrive(position, velocity, origin, moved, feed):
    """Add to positions what has been added to `moved`, and feed the velocities."""
    x, v, start, way = position.reshape(-1), velocity.reshape(-1), origin.reshape(-1), moved.reshape(-1)
    for k in range(x.shape[0]):
        by = way[k] - (x[k] - start[k])
        x[k] = x[k] + by
        v[k] = v[k] + feed * by


@kernel
def any_strayed(x, start, first, stop, square):
    """What `strayed` does, of the particles from first up to stop; x, start: (2 n,), rows one after the other."""
    found = False
    for k in range(first, stop):
        i = np.uint64(2 * k)
        dx, dy = x[i] - start[i], x[i + _ONE] - start[i + _ONE]
        found |= dx * dx + dy * dy > square
    return found


@parallel_kernel
def strayed(position, reference, square):
    """Whether any particle has moved from its reference position by more than the root of `square`.

    Yes or no, for the largest distance takes four times as long: a maximum is not vectorised.
    """
    x, start = position.reshape(-1), reference.reshape(-1)
    found = 0
    for block in prange((position.shape[0] + BLOCK - 1) // BLOCK):
        first = block * BLOCK
        found += int(any_strayed(x, start, first, min(first + BLOCK, position.shape[0]), square))
    return found > 0


@kernel
def _leap(position, velocity, acceleration, h, reference, square, origin, moved, a, b):
    """What `leap` does, of the particles from a up to b."""
    kick_drift(position[a:b], velocity[a:b], acceleration[a:b], h)
    set_out(position[a:b], origin[a:b], moved[a:b])
    return any_strayed(position.reshape(-1), reference.reshape(-1), a, b, square)


@parallel_kernel
def leap(position, velocity, acceleration, h, reference, square, origin, moved, claims):
    """`kick_drift`, whether anyone has `strayed` by it, and `set_out` for the contacts: block by block, for the caches' sake."""
    blocks, found = (position.shape[0] + BLOCK - 1) // BLOCK, 0
    none_claimed(claims)
    for part in prange(claims.shape[0]):
        block = claim_evenly(claims, blocks, part)
        while block >= 0:
            a, b = block * BLOCK, min((block + 1) * BLOCK, position.shape[0])
            found += int(_leap(position, velocity, acceleration, h, reference, square, origin, moved, a, b))
            block = claim_evenly(claims, blocks, part)
    return found > 0


@parallel_kernel
def first_leap(position, velocity, acceleration, inverse_mass, gx, gy, h, reference, square, origin, moved, claims):
    """`leap` under gravity, which becomes the acceleration of all but pinned particles: how a frame begins."""
    blocks, found, none = (position.shape[0] + BLOCK - 1) // BLOCK, 0, position[:0]
    none_claimed(claims)
    for part in prange(claims.shape[0]):
        block = claim_evenly(claims, blocks, part)
        while block >= 0:
            a, b = block * BLOCK, min((block + 1) * BLOCK, position.shape[0])
            newton_block(acceleration[a:b], none, inverse_mass[a:b], gx, gy)
            found += int(_leap(position, velocity, acceleration, h, reference, square, origin, moved, a, b))
            block = claim_evenly(claims, blocks, part)
    return found > 0


@parallel_kernel
def take_rows(out, source, index):
    """out[k] = source[index[k]] for (n, 2) arrays, of one dtype or two: links take float32 to float64."""
    for k in prange(index.shape[0]):
        out[k, 0] = source[index[k], 0]
        out[k, 1] = source[index[k], 1]


@parallel_kernel
def put_rows(out, source, index):
    """out[index[k]] = source[k] for (n, 2) arrays of one dtype; index is a permutation."""
    for k in prange(index.shape[0]):
        copy_row(out, np.int64(index[k]), source, k)


@parallel_kernel
def take_motion(position, velocity, acceleration, spin, from_position, from_velocity, from_acceleration, from_spin, index):
    """Row k of the first four arrays is row index[k] of the others: one pass, for what changes in every frame."""
    for k in prange(index.shape[0]):
        i = np.int64(index[k])
        copy_row(position, k, from_position, i)
        copy_row(velocity, k, from_velocity, i)
        copy_row(acceleration, k, from_acceleration, i)
        spin[k] = from_spin[i]


@parallel_kernel
def put_motion(
    position, velocity, acceleration, spin, to_position, to_velocity, to_acceleration, to_spin, angle, half_dt, index
):  # fmt: skip
    """The way back: index is a permutation, so every row has one writer. Angles turn by the mean of the spins before and now."""
    for k in prange(index.shape[0]):
        i = np.int64(index[k])
        turns = np.float64(to_spin[i]) + np.float64(spin[k])
        if turns != 0.0:  # smooth circles do not, and to look up their angles takes a fifth of all this
            angle[i] += half_dt * turns
        copy_row(to_position, i, position, k)
        copy_row(to_velocity, i, velocity, k)
        copy_row(to_acceleration, i, acceleration, k)
        to_spin[i] = spin[k]


@kernel
def differs(one, other):
    """Whether two (n,) arrays differ anywhere; a NaN differs from itself. `one` may be one number in place of n equal ones."""
    found = one.shape[0] not in (1, other.shape[0])
    if one.shape[0] == 1:
        for k in range(other.shape[0]):
            found |= other[k] != one[0]
    elif not found:
        for k in range(one.shape[0]):
            found |= one[k] != other[k]
    return found


@kernel
def _rows_differ(then, now, first, stop):
    """`differs`, of the rows from first up to stop, where there are as many now as then."""
    if then.shape[0] not in (1, now.shape[0]):
        return True
    return differs(then if then.shape[0] == 1 else then[first:stop], now[first:stop])


@parallel_kernel
def any_differs(a, b, c, d, e, f, a_now, b_now, c_now, d_now, e_now, f_now):
    """Whether any of six arrays differs from what it is now; they are equally long now."""
    found = 0
    for block in prange((a_now.shape[0] + BLOCK - 1) // BLOCK):
        x, y = block * BLOCK, min((block + 1) * BLOCK, a_now.shape[0])
        found += int(
            _rows_differ(a, a_now, x, y) or _rows_differ(b, b_now, x, y) or _rows_differ(c, c_now, x, y)
            or _rows_differ(d, d_now, x, y) or _rows_differ(e, e_now, x, y) or _rows_differ(f, f_now, x, y)
        )  # fmt: skip
    return found > 0


@kernel
def clear_pinned(vectors, inverse_mass):
    """Set the rows of pinned particles to 0."""
    zero = vectors.dtype.type(0)
    for i in range(vectors.shape[0]):
        if inverse_mass[i] == zero:
            vectors[i, 0] = zero
            vectors[i, 1] = zero


@kernel
def _kick_free(velocity, acceleration, inverse_mass, h):
    n = inverse_mass.shape[0]
    packed, none = n - n % LANES, h - h
    zero, kick = spread(none), spread(h)
    for k in range(0, packed, LANES):
        w = load(inverse_mass, k)
        ax, ay = load_rows(acceleration, k)
        ax, ay = where_zero(w, zero, ax), where_zero(w, zero, ay)
        vx, vy = load_rows(velocity, k)
        store_rows(acceleration, k, ax, ay)
        store_rows(velocity, k, vx + kick * ax, vy + kick * ay)
    for i in range(packed, n):
        ax, ay = acceleration[i, 0], acceleration[i, 1]
        if inverse_mass[i] == none:
            ax = ay = none
        acceleration[i, 0], acceleration[i, 1] = ax, ay
        velocity[i, 0], velocity[i, 1] = velocity[i, 0] + h * ax, velocity[i, 1] + h * ay


@parallel_kernel
def kick_free(velocity, acceleration, inverse_mass, h):
    """v += h a; accelerations of pinned particles are 0."""
    for block in prange((inverse_mass.shape[0] + BLOCK - 1) // BLOCK):
        a, b = block * BLOCK, min((block + 1) * BLOCK, inverse_mass.shape[0])
        _kick_free(velocity[a:b], acceleration[a:b], inverse_mass[a:b], h)


@kernel
def _any_non_finite(numbers):
    found = False
    for k in range(numbers.shape[0]):  # from 0, of a slice: only then are eight looked at at a time
        found |= numbers[k] - numbers[k] != 0  # x - x is 0 for finite numbers, NaN for others
    return found


@parallel_kernel
def any_non_finite(vectors):
    """Whether an (n, 2) array has a NaN or an infinity."""
    numbers = vectors.reshape(-1)
    found = 0
    for block in prange((numbers.shape[0] + BLOCK - 1) // BLOCK):
        found += int(_any_non_finite(numbers[block * BLOCK : min((block + 1) * BLOCK, numbers.shape[0])]))
    return found > 0


@driver
def first_non_finite(vectors):
    """Index of the first row that is NaN or infinite; -1 if all are finite."""
    if any_non_finite(vectors):
        for i in range(vectors.shape[0]):
            if not (np.isfinite(vectors[i, 0]) and np.isfinite(vectors[i, 1])):
                return i
    return -1


# ---- what a frame opens and closes with, a call each: to be called takes longer than to be done, in a small world ------------


@driver
def take_up(velocity, acceleration, inverse_mass, h):
    """`kick_free`; or False, and nothing is done, if there is a NaN or an infinity among the accelerations."""
    if any_non_finite(acceleration):
        return False
    kick_free(velocity, acceleration, inverse_mass, h)
    return True


@driver
def all_finite(position, velocity):
    """Whether no row is NaN or infinite."""
    return not (any_non_finite(position) or any_non_finite(velocity))
