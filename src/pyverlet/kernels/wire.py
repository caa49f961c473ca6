"""Numbers as they travel to a page."""

from __future__ import annotations

from pyverlet.compile.jit import kernel, parallel_kernel, prange


@parallel_kernel
def copy_moving(position, velocity, acceleration, resting, lag, to_position, to_velocity):
    """Copy (n, 2) positions, and velocities brought forward by `lag` seconds but for circles that contacts hold."""
    for k in prange(resting.shape[0]):
        ahead = lag if resting[k] == 0 else lag - lag
        to_position[k, 0], to_position[k, 1] = position[k, 0], position[k, 1]
        to_velocity[k, 0] = velocity[k, 0] + ahead * acceleration[k, 0]
        to_velocity[k, 1] = velocity[k, 1] + ahead * acceleration[k, 1]


@kernel
def put_rows(out, rows, index):
    """out[index[k]] = rows[k] for (n, 2) arrays; NumPy takes three times as long."""
    for k in range(index.shape[0]):
        i = index[k]
        out[i, 0], out[i, 1] = rows[k, 0], rows[k, 1]


@kernel
def quantise(position, origin, scale, largest, grid):
    """Fill `grid` (n, 2) with the nearest whole (position - origin) scale from 0 to `largest`; what is no number becomes 0.

    position (n, 2), origin (2,) and scale (2,) are float32. One pass: NumPy takes seven, and six times as long.
    """
    half = scale.dtype.type(0.5)
    for i in range(position.shape[0]):
        for axis in range(2):
            place = (position[i, axis] - origin[axis]) * scale[axis] + half
            # Not by max: a comparison with NaN is false, and a cast of it would be undefined.
            grid[i, axis] = (place if place < largest else largest) if place > 0 else 0
