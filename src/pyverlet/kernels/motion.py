"""The two moves every integrator is made of, and the copies between the user's order and the engine's.

Arrays: position, velocity, acceleration (n, 2); radius, mass, inverse_mass, spin (n,). SI units.
"""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange


@kernel
def advance_serial(out, base, slope, h):
    """out = base + h * slope, on (n, 2) arrays; out may be base."""
    for i in range(out.shape[0]):
        out[i, 0] = base[i, 0] + h * slope[i, 0]
        out[i, 1] = base[i, 1] + h * slope[i, 1]


@parallel_kernel
def advance_parallel(out, base, slope, h):
    """The same on many threads: each element has one writer and one formula, so the bits are the same."""
    for i in prange(out.shape[0]):
        out[i, 0] = base[i, 0] + h * slope[i, 0]
        out[i, 1] = base[i, 1] + h * slope[i, 1]


@kernel
def uniform_acceleration(acceleration, inverse_mass, gx, gy):
    """a = g for every free particle, 0 for a pinned one."""
    zero = gx - gx
    for i in range(acceleration.shape[0]):
        free = inverse_mass[i] > zero
        acceleration[i, 0] = gx if free else zero
        acceleration[i, 1] = gy if free else zero


@kernel
def newton(acceleration, force, inverse_mass, gx, gy):
    """a = g + F / m for every free particle, 0 for a pinned one (Newton's second law)."""
    zero = gx - gx
    for i in range(acceleration.shape[0]):
        w = inverse_mass[i]
        free = w > zero
        acceleration[i, 0] = gx + force[i, 0] * w if free else zero
        acceleration[i, 1] = gy + force[i, 1] * w if free else zero


@kernel
def largest_norm(vectors):
    """Largest length among the rows of an (n, 2) array; 0 if there are none."""
    largest = vectors.dtype.type(0)
    for i in range(vectors.shape[0]):
        largest = max(largest, vectors[i, 0] * vectors[i, 0] + vectors[i, 1] * vectors[i, 1])
    return np.sqrt(largest)


@kernel
def farthest_serial(position, reference):
    """Square of the largest distance any particle has moved from its reference position."""
    farthest = position.dtype.type(0)
    for i in range(position.shape[0]):
        dx = position[i, 0] - reference[i, 0]
        dy = position[i, 1] - reference[i, 1]
        farthest = max(farthest, dx * dx + dy * dy)
    return farthest


@parallel_kernel
def farthest_parallel(position, reference):
    """The same on many threads; a maximum does not depend on the order it is taken in."""
    farthest = position.dtype.type(0)
    for i in prange(position.shape[0]):
        dx = position[i, 0] - reference[i, 0]
        dy = position[i, 1] - reference[i, 1]
        farthest = max(farthest, dx * dx + dy * dy)
    return farthest


@parallel_kernel
def take_rows(out, source, index):
    """out[k] = source[index[k]] for (n, 2) arrays."""
    for k in prange(index.shape[0]):
        out[k, 0] = source[index[k], 0]
        out[k, 1] = source[index[k], 1]


@parallel_kernel
def put_rows(out, source, index):
    """out[index[k]] = source[k] for (n, 2) arrays; index is a permutation, so every row has one writer."""
    for k in prange(index.shape[0]):
        out[index[k], 0] = source[k, 0]
        out[index[k], 1] = source[k, 1]


@kernel
def take_checking(out, source, index):
    """out[k] = source[index[k]] for (n,) arrays; returns whether anything in out changed."""
    changed = False
    for k in range(index.shape[0]):
        value = source[index[k]]
        changed |= out[k] != value
        out[k] = value
    return changed


@kernel
def put(out, source, index):
    """out[index[k]] = source[k] for (n,) arrays; index is a permutation."""
    for k in range(index.shape[0]):
        out[index[k]] = source[k]


@kernel
def clear_where(vectors, flag):
    """Set the flagged rows of an (n, 2) array to 0."""
    zero = vectors.dtype.type(0)
    for i in range(vectors.shape[0]):
        if flag[i] != 0:
            vectors[i, 0] = zero
            vectors[i, 1] = zero


@kernel
def any_nan(vectors):
    """Whether the first column of an (n, 2) array has a NaN."""
    found = False
    for i in range(vectors.shape[0]):
        found |= vectors[i, 0] != vectors[i, 0]
    return found


@kernel
def first_non_finite(vectors):
    """Index of the first row that is NaN or infinite; -1 if all are finite."""
    for i in range(vectors.shape[0]):
        if not (np.isfinite(vectors[i, 0]) and np.isfinite(vectors[i, 1])):
            return i
    return -1
