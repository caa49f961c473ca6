"""Walls. Radius counts: the rim touches the wall, not the centre.

A wall acts on one circle through `meet`: the unit normal n into the room, the depth of the rim beyond the wall, and the velocity.
An impact is reflected where it happened: under the acceleration a, a circle found at depth d with speed v hit the wall with
v_i^2 = v^2 + 2 a_n d, a time t = 2 d / (v_i - v_n) ago; it left with e v_i and has moved under a since. A ballistic bounce
with e = 1 keeps its energy to rounding. Slower than `rest_speed`, or without time left, it rests: on the wall, at normal speed 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange
from pyverlet.constants import FED, PUSHED

# What is noted of a circle in `fed`: a contact at rest has fed its velocity, a wall has touched it; in this substep, or the last.
CARRIES, AT_WALL, CARRIED, WAS_AT_WALL = 1, 2, 4, 8


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
    fed: Any
    resting: Any
    hits: Any
    spent: Any
    start: Any
    turn: Any
    lift: Any


@kernel
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
    # The wall of a pile carries it: the speed that the weight of others has fed is no arrival.
    loaded = bodies.fed[i] & CARRIES and bodies.fed[i] & CARRIED and bodies.fed[i] & WAS_AT_WALL
    bodies.fed[i] |= AT_WALL
    if e * hit > rest_speed and vn < zero and not loaded:
        time = min(two * depth / (hit - vn), h)
        leaving = e * hit
        travelled = leaving * time + an * time * time / two
        if travelled >= zero:
            after = leaving + an * time - lag * an
            shift = depth + travelled
            bodies.spent[i, 0] -= 0.5 * mass * (hit * hit - leaving * leaving)
    held = after == zero
    # A circle in a pile ends each substep with the velocity that the next one's gravity needs to press it down again.
    lift = bodies.lift[i] if held else zero
    lx, ly = -lift * bodies.acceleration[i, 0], -lift * bodies.acceleration[i, 1]
    if held:
        bodies.resting[i] = 1
        after = max(before, lx * nx + ly * ny)
    position[i, 0] += shift * nx
    position[i, 1] += shift * ny
    velocity[i, 0] += (after - before) * nx
    velocity[i, 1] += (after - before) * ny
    if mu > zero:
        # Tangent (ny, -nx); impulses per unit mass; the contact point of a disc has inverse mass 3 / m.
        slip = (velocity[i, 0] - lx) * ny - (velocity[i, 1] - ly) * nx + spin[i] * radius[i]
        most = mu * (after - before)
        rub = max(min(-slip / three, most), -most)
        velocity[i, 0] += rub * ny
        velocity[i, 1] -= rub * nx
        spin[i] += two * rub / radius[i]
        bodies.spent[i, 1] += mass * rub * (slip + 1.5 * rub)
        if held:
            back = h * rub
            if bodies.turn.shape[0] > 0:
                # Among circles that rub each other: from what it has slipped, for they have pushed it since the integration.
                sx, sy = position[i, 0] - bodies.start[i, 0], position[i, 1] - bodies.start[i, 1]
                most *= h if lift == zero else h * position.dtype.type(PUSHED / FED)
                back = max(min(-(sx * ny - sy * nx + bodies.turn[i] * radius[i]) / three, most), -most)
                bodies.turn[i] += two * back / radius[i]
            position[i, 0] += back * ny
            position[i, 1] -= back * nx


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


@kernel
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


@kernel
def _at_box(i, left, right, down, up, bodies, h, lag, e, mu, rest_speed):
    """Circle i is beyond at least one wall of the box, by left, right, down or up > 0."""
    zero = h - h
    one = h / h
    if left > zero:
        meet(i, one, zero, left, bodies, h, lag, e, mu, rest_speed)
    elif right > zero:
        meet(i, -one, zero, right, bodies, h, lag, e, mu, rest_speed)
    if down > zero:
        meet(i, zero, one, down, bodies, h, lag, e, mu, rest_speed)
    elif up > zero:
        meet(i, zero, -one, up, bodies, h, lag, e, mu, rest_speed)


# The loops make the tuple themselves, and only for circles at a wall: from Python it is slow to hand over.


@parallel_kernel
def circle(
    x0, y0, size, position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, fed, resting, hits,
    spent, start, turn, lift, h, lag, e, mu, rest_speed,
):  # fmt: skip
    """A cage: all circles stay inside that of radius `size` about (x0, y0). position to lift: the fields of Bodies."""
    zero = h - h
    for i in prange(position.shape[0]):
        resting[i] = 0
        dx = position[i, 0] - x0
        dy = position[i, 1] - y0
        room = size - radius[i]
        if dx * dx + dy * dy > room * room and inverse_mass[i] > zero:
            bodies = Bodies(
                position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, fed, resting, hits, spent,
                start, turn, lift,
            )  # fmt: skip
            _at_cage(i, x0, y0, size, bodies, h, lag, e, mu, rest_speed)


@parallel_kernel
def box(
    x0, y0, x1, y1, position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, fed, resting, hits,
    spent, start, turn, lift, h, lag, e, mu, rest_speed,
):  # fmt: skip
    """Four walls; in a corner both axes act, one after the other. position to lift: the fields of Bodies."""
    zero = h - h
    for i in prange(position.shape[0]):
        resting[i] = 0
        r = radius[i]
        left = x0 + r - position[i, 0]
        right = position[i, 0] - (x1 - r)
        down = y0 + r - position[i, 1]
        up = position[i, 1] - (y1 - r)
        if max(left, right, down, up) > zero and inverse_mass[i] > zero:
            bodies = Bodies(
                position, velocity, acceleration, spin, radius, inverse_mass, restitution, friction, fed, resting, hits, spent,
                start, turn, lift,
            )  # fmt: skip
            _at_box(i, left, right, down, up, bodies, h, lag, e, mu, rest_speed)
            # As in the cage: what one reflection has sent beyond the other side waits at that wall.
            if position[i, 0] < x0 or position[i, 0] > x1:
                position[i, 0] = min(max(position[i, 0], x0 + r), x1 - r)
            if position[i, 1] < y0 or position[i, 1] > y1:
                position[i, 1] = min(max(position[i, 1], y0 + r), y1 - r)
