"""Walls. Radius counts: the rim touches the wall, not the centre.

A wall acts on one circle through `meet`: the unit normal n into the room, the depth of the rim beyond the wall, and the velocity.
An impact is reflected where it happened: under the acceleration a, a circle found at depth d with speed v hit the wall with
v_i^2 = v^2 + 2 a_n d, a time t = 2 d / (v_i - v_n) ago; it left with e v_i and has moved under a since. A ballistic bounce
with e = 1 keeps its energy to rounding. Slower than `rest_speed`, or without time left, it rests: on the wall, at normal speed 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.rounding import rounded
from pyverlet.ground.constants import FED, PUSHED, SURFACES
from pyverlet.kernels.beyond import beyond_box

_CHUNK = 1024
"""Circles one thread takes at a time."""

REFLECTIONS = 8
"""Times a circle may bounce off the walls of a room in one substep."""

# What is noted of a circle in `fed`: a contact at rest has fed its velocity, a wall has touched it; in this substep, or the last.
CARRIES, AT_WALL, CARRIED, WAS_AT_WALL = 1, 2, 4, 8

BOUNCED = 256
"""Bits of `Body.fed` from here on count how often the circle has bounced; they are not kept."""

LOADED = CARRIES | CARRIED | WAS_AT_WALL


class Body(NamedTuple):
    """What a wall needs to know of one circle, and notes about it; of x, v and a both components, the others as in `Slots`.

    Numbers, not arrays: a tuple of arrays counts references, which costs more than a bounce.
    """

    x: Any
    y: Any
    vx: Any
    vy: Any
    ax: Any
    ay: Any
    spin: Any
    radius: Any
    inverse_mass: Any
    restitution: Any
    friction: Any
    fed: Any
    resting: Any
    hit: Any
    to_impact: Any  # J, of `spent`
    to_friction: Any
    from_x: Any
    from_y: Any
    share: Any  # of an impulse of friction that positions take, where circles rub each other; 0 where they do not
    turn: Any
    lift: Any


@kernel
def look(i, circles):
    """Circle i."""
    position, velocity, acceleration, spent = circles.position, circles.velocity, circles.acceleration, circles.spent
    radius = circles.radius[i]
    zero = radius - radius
    rubs, accounted = circles.turn.shape[0] > 0, spent.shape[0] > 0
    from_x, from_y = (circles.start[i, 0], circles.start[i, 1]) if rubs else (zero, zero)
    share = position.dtype.type(PUSHED / FED) if rubs else zero
    return Body(
        position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1], acceleration[i, 0], acceleration[i, 1],
        circles.spin[i], radius, circles.inverse_mass[i], circles.restitution[i], circles.friction[i], np.int64(circles.fed[i]),
        np.int64(circles.resting[i]), circles.hits[i], spent[i, 0] if accounted else 0.0, spent[i, 1] if accounted else 0.0,
        from_x, from_y, share, circles.turn[i] if rubs else zero, circles.lift[i] if rubs else zero,
    )  # fmt: skip


@kernel
def put(i, body, circles):
    """Write down what has become of circle i."""
    position, velocity, spent = circles.position, circles.velocity, circles.spent
    position[i, 0] = body.x
    position[i, 1] = body.y
    velocity[i, 0] = body.vx
    velocity[i, 1] = body.vy
    circles.spin[i] = body.spin
    circles.fed[i] = body.fed & (BOUNCED - 1)
    circles.resting[i] = body.resting
    circles.hits[i] = body.hit
    if spent.shape[0] > 0:
        spent[i, 0] = body.to_impact
        spent[i, 1] = body.to_friction
    if body.share > 0:
        circles.turn[i] = body.turn


@kernel
def moved(b, x, y, vx, vy, from_x, from_y):
    """The circle b, but there and so fast."""
    return Body(
        x, y, vx, vy, b.ax, b.ay, b.spin, b.radius, b.inverse_mass, b.restitution, b.friction, b.fed, b.resting, b.hit,
        b.to_impact, b.to_friction, from_x, from_y, b.share, b.turn, b.lift,
    )  # fmt: skip


@kernel
def noted(b, resting):
    """The circle b, but with these notes of who holds it."""
    return Body(
        b.x, b.y, b.vx, b.vy, b.ax, b.ay, b.spin, b.radius, b.inverse_mass, b.restitution, b.friction, b.fed, resting, b.hit,
        b.to_impact, b.to_friction, b.from_x, b.from_y, b.share, b.turn, b.lift,
    )  # fmt: skip


@kernel
def hit_with(b, hit):
    """The circle b, but with this as the largest speed it hit with."""
    return Body(
        b.x, b.y, b.vx, b.vy, b.ax, b.ay, b.spin, b.radius, b.inverse_mass, b.restitution, b.friction, b.fed, b.resting, hit,
        b.to_impact, b.to_friction, b.from_x, b.from_y, b.share, b.turn, b.lift,
    )  # fmt: skip


@kernel
def note(impacts, i, surface, bounces, speed):
    """Circle i has met a surface and has bounced off it so often. impacts: as in `Slots`; empty where no events are recorded."""
    if impacts.shape[0] == 0:
        return
    number, at = np.int64(impacts[i, 0]), np.int64(0)
    while at < number and impacts[i, 1 + 3 * at] != surface:
        at += 1
    if at == SURFACES:
        return
    k = 1 + 3 * at
    if at == number:
        impacts[i, 0] = number + 1
        impacts[i, k], impacts[i, k + 1], impacts[i, k + 2] = surface, 0, 0
    impacts[i, k + 1] += bounces
    impacts[i, k + 2] = max(impacts[i, k + 2], speed)


@kernel
def wide(b):
    """The circle b in float64."""
    f = np.float64
    return Body(
        f(b.x), f(b.y), f(b.vx), f(b.vy), f(b.ax), f(b.ay), f(b.spin), f(b.radius), f(b.inverse_mass), f(b.restitution),
        f(b.friction), b.fed, b.resting, f(b.hit), f(b.to_impact), f(b.to_friction), f(b.from_x), f(b.from_y), f(b.share),
        f(b.turn), f(b.lift),
    )  # fmt: skip


@kernel
def _rounded(b, like):
    """The circle b in the dtype of the number `like`."""
    f = rounded
    return Body(
        f(b.x, like), f(b.y, like), f(b.vx, like), f(b.vy, like), f(b.ax, like), f(b.ay, like), f(b.spin, like),
        f(b.radius, like), f(b.inverse_mass, like), f(b.restitution, like), f(b.friction, like), b.fed, b.resting,
        f(b.hit, like), b.to_impact, b.to_friction, f(b.from_x, like), f(b.from_y, like), f(b.share, like), f(b.turn, like),
        f(b.lift, like),
    )  # fmt: skip


@kernel
def meet(b, nx, ny, depth, h, lag, e, mu, rest_speed):
    """The circle b is `depth` > 0 beyond a wall of normal (nx, ny): what becomes of it, bounced or held, with friction mu.

    A circle with a restitution or friction of its own (not negative) changes the wall's: the larger e, the geometric mean of mu.
    `hit` becomes the largest speed it hit with; `to_impact`, `to_friction` gain the energy that each took, J.
    """
    zero = h - h
    two = (h + h) / h
    three = (h + h + h) / h
    e = max(e, b.restitution)
    if b.friction >= zero:
        mu = np.sqrt(mu * b.friction)
    mass = 1.0 / np.float64(b.inverse_mass)
    x, y, vx, vy, spin, turn, resting = b.x, b.y, b.vx, b.vy, b.spin, b.turn, b.resting
    to_impact, to_friction = b.to_impact, b.to_friction
    an = b.ax * nx + b.ay * ny
    # The velocity at the time of the position; integrators of Stormer's kind carry one that lags behind.
    vn = vx * nx + vy * ny + lag * an
    before = vn - lag * an
    square = vn * vn + two * an * depth
    hit = np.sqrt(max(square, zero))
    after = zero
    shift = depth
    # The wall of a pile carries it: the speed that the weight of others has fed is no arrival.
    loaded = b.fed & LOADED == LOADED
    if e * hit > rest_speed and vn < zero and not loaded:
        time = min(two * depth / (hit - vn), h)
        leaving = e * hit
        travelled = leaving * time + an * time * time / two
        if travelled >= zero:
            after = leaving + an * time - lag * an
            shift = depth + travelled
            to_impact -= 0.5 * mass * (hit * hit - leaving * leaving)
    held = after == zero
    fed = (b.fed | AT_WALL) + (0 if held else BOUNCED)
    # A circle in a pile ends each substep with the velocity that the next one's gravity needs to press it down again.
    lift = b.lift if held else zero
    lx, ly = -lift * b.ax, -lift * b.ay
    if held:
        resting = 1
        after = max(before, lx * nx + ly * ny)
    x += shift * nx
    y += shift * ny
    vx += (after - before) * nx
    vy += (after - before) * ny
    if mu > zero:
        # Tangent (ny, -nx); impulses per unit mass; the contact point of a disc has inverse mass 3 / m.
        slip = (vx - lx) * ny - (vy - ly) * nx + spin * b.radius
        most = mu * (after - before)
        rub = max(min(-slip / three, most), -most)
        vx += rub * ny
        vy -= rub * nx
        spin += two * rub / b.radius
        to_friction += mass * rub * (slip + 1.5 * rub)
        if held:
            back = h * rub
            if b.share > zero:
                # Among circles that rub each other: from what it has slipped, for they have pushed it since the integration.
                sx, sy = x - b.from_x, y - b.from_y
                most *= h if lift == zero else h * b.share
                back = max(min(-(sx * ny - sy * nx + turn * b.radius) / three, most), -most)
                turn += two * back / b.radius
            x += back * ny
            y -= back * nx
    return Body(
        x, y, vx, vy, b.ax, b.ay, spin, b.radius, b.inverse_mass, b.restitution, b.friction, fed, resting,
        max(b.hit, hit if vn < zero else zero), to_impact, to_friction, b.from_x, b.from_y, b.share, turn, b.lift,
    )  # fmt: skip


@kernel
def impact_time(dx, dy, vx, vy, ax, ay, reach, h):
    """Seconds ago, 0 to h, at which the distance |d - v t + a t^2 / 2| was `reach`, for a path that has just crossed it."""
    zero = h - h
    half = h / (h + h)
    gap = reach * reach - dx * dx - dy * dy
    along = dx * vx + dy * vy
    # On a straight path it is a quadratic equation, |v|^2 t^2 - 2 (d . v) t = gap, in the form that does not cancel. Squares of
    # slow velocities underflow: who is that slow has been on its way for longer than h.
    speed = abs(along) + np.sqrt(max(along * along + (vx * vx + vy * vy) * gap, zero))
    time = min(abs(gap) / speed, h) if speed > zero else h
    # Newton's method for the bend of the path: what is left of it after two steps is far below a rounding error.
    for _ in range(2):
        px = dx - time * (vx - half * time * ax)
        py = dy - time * (vy - half * time * ay)
        slope = px * (ax * time - vx) + py * (ay * time - vy)
        if slope != zero:
            time = min(max(time + half * (reach * reach - px * px - py * py) / slope, zero), h)
    return time


@kernel
def _bounced(b, px, py, back_x, back_y, h, lag, e, mu, rest_speed):
    """The circle b has met the cage's wall at (px, py) from its centre, (back_x, back_y) from where it is: what becomes of it.

    In float64, so that it is rounded once: a normal in float32 is longer than 1, or shorter, and heats a gas or cools it.
    """
    f = np.float64
    reached = np.sqrt(f(px) * px + f(py) * py)
    nx, ny = -px / reached, -py / reached
    depth = max(back_x * nx + back_y * ny, 0.0)
    return _rounded(meet(wide(b), nx, ny, depth, f(h), f(lag), f(e), f(mu), f(rest_speed)), h)


@kernel
def at_cage(b, x0, y0, size, h, lag, e, mu, rest_speed):
    """The circle b is beyond the wall of the cage: what becomes of it."""
    zero = h - h
    half = h / (h + h)
    room = max(size - b.radius, zero)
    for _ in range(REFLECTIONS):
        dx, dy = b.x - x0, b.y - y0
        square = dx * dx + dy * dy  # compared as where those beyond the wall are looked for
        if not square > room * room:
            return b
        distance = np.sqrt(square)
        nx, ny, depth = -dx / distance, -dy / distance, distance - room
        vx, vy = b.vx + lag * b.ax, b.vy + lag * b.ay
        if -(vx * nx + vy * ny) > rest_speed and room > zero:
            # The wall it hit is the tangent where it hit, not where it would be now: that keeps the angular momentum.
            time = impact_time(dx, dy, vx, vy, b.ax, b.ay, room, h)
            px = dx - time * (vx - half * time * b.ax)
            py = dy - time * (vy - half * time * b.ay)
            if max(e, b.restitution) > zero:
                b = _bounced(b, px, py, px - dx, py - dy, h, lag, e, mu, rest_speed)
                if b.resting != 0:
                    break
                continue
            reached = np.sqrt(px * px + py * py)
            nx, ny = -px / reached, -py / reached
            depth = max((px - dx) * nx + (py - dy) * ny, zero)
        b = meet(b, nx, ny, depth, h, lag, e, mu, rest_speed)
        if b.resting != 0:
            break
    # The wall bends away from the tangent along which a held circle goes on, and not everybody is back after so many reflections:
    # who is still beyond the wall waits there.
    dx, dy = b.x - x0, b.y - y0
    distance = np.sqrt(dx * dx + dy * dy)
    if distance > room:
        b = moved(b, x0 + dx * (room / distance), y0 + dy * (room / distance), b.vx, b.vy, b.from_x, b.from_y)
    return b


@kernel
def _at_box(i, circles, x0, y0, x1, y1, h, lag, e, mu, rest_speed):
    """Circle i is beyond at least one wall of the box: what becomes of it. In a corner one axis acts after the other."""
    zero = h - h
    one = h / h
    b = look(i, circles)
    r = b.radius
    for axis in range(2):
        low, high = (x0 + r, x1 - r) if axis == 0 else (y0 + r, y1 - r)
        for _ in range(REFLECTIONS):
            at = b.x if axis == 0 else b.y
            below, above = low - at, at - high
            if not max(below, above) > zero:
                break
            inward = one if below > zero else -one
            nx, ny = (inward, zero) if axis == 0 else (zero, inward)
            held, hit = b.resting, b.hit
            b = hit_with(noted(b, np.int64(0)), -one)
            b = meet(b, nx, ny, below if below > zero else above, h, lag, e, mu, rest_speed)
            note(circles.impacts, i, np.int64(2 * axis if below > zero else 2 * axis + 1), np.int64(b.resting == 0), b.hit)
            b = hit_with(b, max(hit, b.hit))
            if b.resting != 0:
                break
            b = noted(b, held)
    # As in the cage: who is still beyond waits at the wall.
    x, y = min(max(b.x, x0 + r), x1 - r), min(max(b.y, y0 + r), y1 - r)
    return moved(b, x, y, b.vx, b.vy, b.from_x, b.from_y)


@kernel
def _box_some(circles, x0, y0, x1, y1, first, stop, h, lag, e, mu, rest_speed):
    """What `box` does, for the circles from `first` up to `stop`."""
    circles.resting[first:stop] = 0
    found = np.empty(_CHUNK, np.uint32)
    for k in range(beyond_box(x0, y0, x1, y1, circles.position, circles.radius, circles.inverse_mass, first, stop, found)):
        i = found[k]
        put(i, _at_box(i, circles, x0, y0, x1, y1, h, lag, e, mu, rest_speed), circles)


@parallel_kernel
def box(circles, x0, y0, x1, y1, h, lag, e, mu, rest_speed):
    """Four walls; in a corner both axes act, one after the other."""
    count = circles.radius.shape[0]
    for chunk in prange((count + _CHUNK - 1) // _CHUNK):
        first, stop = chunk * _CHUNK, min((chunk + 1) * _CHUNK, count)
        _box_some(circles, x0, y0, x1, y1, first, stop, h, lag, e, mu, rest_speed)
