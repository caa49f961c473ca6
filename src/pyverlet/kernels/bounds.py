"""Walls. Radius counts: the rim touches the wall, not the centre.

A wall acts on one circle through `meet`: the unit normal n into the room, the depth of the rim beyond the wall, and the velocity.
An impact is reflected where it happened: under the acceleration a, a circle found at depth d with speed v hit the wall with
v_i^2 = v^2 + 2 a_n d, a time t = 2 d / (v_i - v_n) ago; it left with e v_i and has moved under a since. A ballistic bounce
with e = 1 keeps its energy to rounding. Slower than `rest_speed`, or without time left, it rests: on the wall, at normal speed 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet._jit import inlined_kernel, kernel, parallel_kernel, prange

BLOCK = 64
"""Circles looked at together for whether any of them is at a wall: hardly any is."""

_ONE, _TWO = np.uint64(1), np.uint64(2)


class Bodies(NamedTuple):
    """What walls need to know of the circles, and note about them; as in `pyverlet.state.Slots`."""

    position: Any
    velocity: Any
    acceleration: Any
    spin: Any
    radius: Any
    inverse_mass: Any
    restitution: Any
    friction: Any
    resting: Any
    hits: Any
    spent: Any


@inlined_kernel
def meet(i, nx, ny, depth, bodies, h, lag, e, mu, rest_speed):
    """Circle i is `depth` > 0 beyond a wall of normal (nx, ny): bounce it or hold it, with friction mu.

    A circle with a restitution or friction of its own (not negative) changes the wall's: the larger e, the geometric mean of mu.
    bodies.hits[i] becomes the largest speed it hit with; bodies.spent[i] gains the energy that impact and friction took, J.
    """
    position, velocity, spin, radius = bodies.position, bodies.velocity, bodies.spin, bodies.radius
    zero = h - h
    two = position.dtype.type(2)
    three = position.dtype.type(3)
    e = max(e, bodies.restitution[i])
    if bodies.friction[i] >= zero:
        mu = np.sqrt(mu * bodies.friction[i])
    mass = 1.0 / np.float64(bodies.inverse_mass[i])
    an = bodies.acceleration[i, 0] * nx + bodies.acceleration[i, 1] * ny
    # The velocity at the time of the position; integrators of Stormer's kind carry one that lags behind.
    vn = velocity[i, 0] * nx + velocity[i, 1] * ny + lag * an
    before = vn - lag * an
    square = vn * vn + two * an * depth
    hit = np.sqrt(max(square, zero))
    after = zero
    shift = depth
    bodies.hits[i] = max(bodies.hits[i], hit if vn < zero else zero)
    if e * hit > rest_speed and vn < zero:
        time = min(two * depth / (hit - vn), h)
        leaving = e * hit
        travelled = leaving * time + an * time * time / two
        if travelled >= zero:
            after = leaving + an * time - lag * an
            shift = depth + travelled
            bodies.spent[i, 0] -= 0.5 * mass * (hit * hit - leaving * leaving)
    held = after == zero
    if held:
        bodies.resting[i] = 1
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
        bodies.spent[i, 1] += mass * rub * (slip + 1.5 * rub)
        if held:
            position[i, 0] += h * rub * ny
            position[i, 1] -= h * rub * nx


@kernel
def impact_time(dx, dy, vx, vy, ax, ay, reach, h):
    """Seconds ago, 0 to h, at which the distance |d - v t + a t^2 / 2| was `reach`, for a path that has just crossed it."""
    zero = h - h
    half = h / (h + h)
    gap = reach * reach - dx * dx - dy * dy
    along = dx * vx + dy * vy
    # On a straight path it is a quadratic equation, |v|^2 t^2 - 2 (d . v) t = gap, in the form that does not cancel.
    time = abs(gap) / (abs(along) + np.sqrt(max(along * along + (vx * vx + vy * vy) * gap, zero)))
    # Newton's method for the bend of the path: what is left of it after two steps is far below a rounding error.
    for _ in range(2):
        px = dx - time * (vx - half * time * ax)
        py = dy - time * (vy - half * time * ay)
        slope = px * (ax * time - vx) + py * (ay * time - vy)
        if slope != zero:
            time += half * (reach * reach - px * px - py * py) / slope
    return min(max(time, zero), h)


@inlined_kernel
def _at_cage(i, x0, y0, size, bodies, h, lag, e, mu, rest_speed):
    """Circle i is beyond the wall of the cage."""
    position, velocity, acceleration = bodies.position, bodies.velocity, bodies.acceleration
    zero = h - h
    half = h / (h + h)
    dx = position[i, 0] - x0
    dy = position[i, 1] - y0
    room = size - bodies.radius[i]
    distance = np.sqrt(dx * dx + dy * dy)
    nx, ny, depth = -dx / distance, -dy / distance, distance - room
    ax, ay = acceleration[i, 0], acceleration[i, 1]
    vx, vy = velocity[i, 0] + lag * ax, velocity[i, 1] + lag * ay
    if -(vx * nx + vy * ny) > rest_speed and room > zero:
        # The wall it hit is the tangent where it hit, not where it would be now: that keeps the angular momentum.
        time = impact_time(dx, dy, vx, vy, ax, ay, room, h)
        px = dx - time * (vx - half * time * ax)
        py = dy - time * (vy - half * time * ay)
        reached = np.sqrt(px * px + py * py)
        nx, ny = -px / reached, -py / reached
        depth = max((px - dx) * nx + (py - dy) * ny, zero)
    meet(i, nx, ny, depth, bodies, h, lag, e, mu, rest_speed)
    # Faster than a room width a substep one reflection is not enough: what is still outside waits at the wall.
    dx = position[i, 0] - x0
    dy = position[i, 1] - y0
    distance = np.sqrt(dx * dx + dy * dy)
    if distance > size:
        position[i, 0] = x0 + dx * (room / distance)
        position[i, 1] = y0 + dy * (room / distance)


@inlined_kernel
def _at_box(i, x0, y0, x1, y1, bodies, h, lag, e, mu, rest_speed):
    """Circle i is beyond at least one wall of the box."""
    position = bodies.position
    zero = h - h
    one = h / h
    r = bodies.radius[i]
    left, right = x0 + r - position[i, 0], position[i, 0] - (x1 - r)
    down, up = y0 + r - position[i, 1], position[i, 1] - (y1 - r)
    if left > zero:
        meet(i, one, zero, left, bodies, h, lag, e, mu, rest_speed)
    elif right > zero:
        meet(i, -one, zero, right, bodies, h, lag, e, mu, rest_speed)
    if down > zero:
        meet(i, zero, one, down, bodies, h, lag, e, mu, rest_speed)
    elif up > zero:
        meet(i, zero, -one, up, bodies, h, lag, e, mu, rest_speed)
    # As in the cage: what one reflection has sent beyond the other side waits at that wall.
    if position[i, 0] < x0 or position[i, 0] > x1:
        position[i, 0] = min(max(position[i, 0], x0 + r), x1 - r)
    if position[i, 1] < y0 or position[i, 1] > y1:
        position[i, 1] = min(max(position[i, 1], y0 + r), y1 - r)


@kernel
def _beyond_circle(x0, y0, size, position, radius, first, stop, flag):
    """Flag the circles from `first` to `stop` that reach beyond the cage; whether there are any. No branch, so in vectors."""
    x = position.reshape(-1)
    found = False
    for k in range(first, stop):
        i = np.uint64(k)  # spares the check for a negative index, which vectors cannot take
        dx, dy, room = x[_TWO * i] - x0, x[_TWO * i + _ONE] - y0, size - radius[i]
        beyond = dx * dx + dy * dy > room * room
        flag[i] = beyond
        found |= beyond
    return found


@kernel
def _beyond_box(x0, y0, x1, y1, position, radius, first, stop, flag):
    """The same for a box."""
    x = position.reshape(-1)
    zero = x0 - x0
    found = False
    for k in range(first, stop):
        i = np.uint64(k)
        px, py, r = x[_TWO * i], x[_TWO * i + _ONE], radius[i]
        beyond = (x0 + r - px > zero) | (px - (x1 - r) > zero) | (y0 + r - py > zero) | (py - (y1 - r) > zero)
        flag[i] = beyond
        found |= beyond
    return found


# The loops make the tuple themselves, and only for circles at a wall: from Python it is slow to hand over. Until a circle has met
# the wall, `resting` is where it is flagged.


@parallel_kernel
def circle(
    x0, y0, size, position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, resting, hits, spent,
    h, lag, e, mu, rest_speed,
):  # fmt: skip
    """A cage: all circles stay inside that of radius `size` about (x0, y0). position to spent: the fields of Bodies."""
    zero = h - h
    for block in prange((radius.shape[0] + BLOCK - 1) // BLOCK):
        first, stop = block * BLOCK, min((block + 1) * BLOCK, radius.shape[0])
        if _beyond_circle(x0, y0, size, position, radius, first, stop, resting):
            for i in range(first, stop):
                if resting[i] != 0:
                    resting[i] = 0
                    if inverse_mass[i] > zero:
                        bodies = Bodies(
                            position,
                            velocity,
                            acceleration,
                            spin,
                            radius,
                            inverse_mass,
                            restitution,
                            friction,
                            resting,
                            hits,
                            spent,
                        )
                        _at_cage(i, x0, y0, size, bodies, h, lag, e, mu, rest_speed)


@parallel_kernel
def box(
    x0, y0, x1, y1, position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, resting, hits, spent,
    h, lag, e, mu, rest_speed,
):  # fmt: skip
    """Four walls; in a corner both axes act, one after the other. position to spent: the fields of Bodies."""
    zero = h - h
    for block in prange((radius.shape[0] + BLOCK - 1) // BLOCK):
        first, stop = block * BLOCK, min((block + 1) * BLOCK, radius.shape[0])
        if _beyond_box(x0, y0, x1, y1, position, radius, first, stop, resting):
            for i in range(first, stop):
                if resting[i] != 0:
                    resting[i] = 0
                    if inverse_mass[i] > zero:
                        bodies = Bodies(
                            position,
                            velocity,
                            acceleration,
                            spin,
                            radius,
                            inverse_mass,
                            restitution,
                            friction,
                            resting,
                            hits,
                            spent,
                        )
                        _at_box(i, x0, y0, x1, y1, bodies, h, lag, e, mu, rest_speed)
