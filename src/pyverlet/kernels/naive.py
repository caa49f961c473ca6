"""Walls as sketches write them: look at the position after the step, put it back, do something to the velocity.

Kept to be shown, not to be used: when the circle met the wall is never asked. Both act on circles whose rim is beyond a wall.
`flip` true: the velocity along the normal is turned round, times e. False: only the position is put back, by a shift s, and
the velocity becomes that of a method whose only memory is x - x_prev: it gains s / h.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel


@kernel
def put_back(i, nx, ny, depth, position, velocity, h, e, flip):
    """Circle i is `depth` > 0 beyond a wall of normal (nx, ny) into the room."""
    position[i, 0] += depth * nx
    position[i, 1] += depth * ny
    vn = velocity[i, 0] * nx + velocity[i, 1] * ny
    change = -(e * vn + vn) if flip else depth / h
    velocity[i, 0] += change * nx
    velocity[i, 1] += change * ny


@kernel
def circle(x0, y0, size, position, velocity, radius, inverse_mass, h, e, flip):
    """A cage of radius `size` about (x0, y0)."""
    zero = h - h
    for i in range(position.shape[0]):
        dx = x0 - position[i, 0]
        dy = y0 - position[i, 1]
        room = size - radius[i]
        distance = np.sqrt(dx * dx + dy * dy)
        if distance > max(room, zero) and inverse_mass[i] > zero:
            put_back(i, dx / distance, dy / distance, distance - room, position, velocity, h, e, flip)


@kernel
def box(x0, y0, x1, y1, position, velocity, radius, inverse_mass, h, e, flip):
    """Four walls, one after the other."""
    zero = h - h
    one = h / h
    for i in range(position.shape[0]):
        if inverse_mass[i] > zero:
            for nx, ny, depth in (
                (one, zero, x0 + radius[i] - position[i, 0]),
                (-one, zero, position[i, 0] + radius[i] - x1),
                (zero, one, y0 + radius[i] - position[i, 1]),
                (zero, -one, position[i, 1] + radius[i] - y1),
            ):
                if depth > zero:
                    put_back(i, nx, ny, depth, position, velocity, h, e, flip)
