"""Walls. Radius counts: the rim touches the wall, not the centre.

A wall acts on one circle through `meet`: the unit normal n into the room, the depth of the rim beyond the wall, and the velocity.
An impact is reflected where it happened: under the acceleration a, a circle found at depth d with speed v hit the wall with
v_i^2 = v^2 + 2 a_n d, a time t = 2 d / (v_i - v_n) ago; it left with e v_i and has moved under a since. A ballistic bounce
with e = 1 keeps its energy to rounding. Slower than `rest_speed`, or without time left, it rests: on the wall, at normal speed 0.
"""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange


@kernel
def meet(i, nx, ny, depth, position, velocity, acceleration, spin, radius, inverse_mass, resting, h, lag, e, mu, rest_speed):
    """Circle i is `depth` > 0 beyond a wall of normal (nx, ny): bounce it or hold it, with friction mu."""
    zero = h - h
    two = position.dtype.type(2)
    three = position.dtype.type(3)
    an = acceleration[i, 0] * nx + acceleration[i, 1] * ny
    # The velocity at the time of the position; integrators of Stormer's kind carry one that lags behind.
    vn = velocity[i, 0] * nx + velocity[i, 1] * ny + lag * an
    before = vn - lag * an
    square = vn * vn + two * an * depth
    hit = np.sqrt(max(square, zero))
    after = zero
    shift = depth
    if e * hit > rest_speed and vn < zero:
        time = min(two * depth / (hit - vn), h)
        leaving = e * hit
        travelled = leaving * time + an * time * time / two
        if travelled > zero:
            after = leaving + an * time - lag * an
            shift = depth + travelled
    held = after == zero
    if held:
        resting[i] = 1
        after = max(before, zero)
    position[i, 0] += shift * nx
    position[i, 1] += shift * ny
    velocity[i, 0] += (after - before) * nx
    velocity[i, 1] += (after - before) * ny
    if mu > zero:
        # Tangent (ny, -nx); impulses per unit mass; the contact point of a disc has inverse mass 3 / m.
        slip = velocity[i, 0] * ny - velocity[i, 1] * nx + spin[i] * radius[i]
        most = mu * (after - before)
        rub = max(min(-slip / three, most), -most)
        velocity[i, 0] += rub * ny
        velocity[i, 1] -= rub * nx
        spin[i] += two * rub / radius[i]
        if held:
            position[i, 0] += h * rub * ny
            position[i, 1] -= h * rub * nx


@parallel_kernel
def circle(x0, y0, size, position, velocity, acceleration, spin, radius, inverse_mass, resting, h, lag, e, mu, rest_speed):
    """A cage: everything stays inside the circle of radius `size` about (x0, y0)."""
    zero = h - h
    for i in prange(position.shape[0]):
        resting[i] = 0
        dx = x0 - position[i, 0]
        dy = y0 - position[i, 1]
        room = size - radius[i]
        square = dx * dx + dy * dy
        if square > room * room and inverse_mass[i] > zero:
            distance = np.sqrt(square)
            meet(i, dx / distance, dy / distance, distance - room, position, velocity, acceleration, spin, radius, inverse_mass,
                 resting, h, lag, e, mu, rest_speed)  # fmt: skip
            # Faster than a room width a substep one reflection is not enough: what is still outside waits at the wall.
            dx = position[i, 0] - x0
            dy = position[i, 1] - y0
            distance = np.sqrt(dx * dx + dy * dy)
            if distance > size:
                position[i, 0] = x0 + dx * (room / distance)
                position[i, 1] = y0 + dy * (room / distance)


@parallel_kernel
def box(x0, y0, x1, y1, position, velocity, acceleration, spin, radius, inverse_mass, resting, h, lag, e, mu, rest_speed):
    """Four walls; in a corner both axes act, one after the other."""
    zero = h - h
    one = h / h
    for i in prange(position.shape[0]):
        resting[i] = 0
        r = radius[i]
        if inverse_mass[i] > zero:
            left = x0 + r - position[i, 0]
            right = position[i, 0] - (x1 - r)
            if left > zero:
                meet(i, one, zero, left, position, velocity, acceleration, spin, radius, inverse_mass, resting,
                     h, lag, e, mu, rest_speed)  # fmt: skip
            elif right > zero:
                meet(i, -one, zero, right, position, velocity, acceleration, spin, radius, inverse_mass, resting,
                     h, lag, e, mu, rest_speed)  # fmt: skip
            down = y0 + r - position[i, 1]
            up = position[i, 1] - (y1 - r)
            if down > zero:
                meet(i, zero, one, down, position, velocity, acceleration, spin, radius, inverse_mass, resting,
                     h, lag, e, mu, rest_speed)  # fmt: skip
            elif up > zero:
                meet(i, zero, -one, up, position, velocity, acceleration, spin, radius, inverse_mass, resting,
                     h, lag, e, mu, rest_speed)  # fmt: skip
            # As in the cage: what one reflection has sent beyond the other side waits at that wall.
            if position[i, 0] < x0 or position[i, 0] > x1:
                position[i, 0] = min(max(position[i, 0], x0 + r), x1 - r)
            if position[i, 1] < y0 or position[i, 1] > y1:
                position[i, 1] = min(max(position[i, 1], y0 + r), y1 - r)
