"""Circles go their way through a substep among obstacles, and meet what there is to meet (`kernels.obstacles` finds it).

Everything here is float64, and so is a place from one substep of a frame to the next: what the world's dtype rounds it by is
remembered, and what the integrator has rounded is computed anew. A circle that slides falls by g h^2 and is pushed out again in
every substep; with a rounding after each, the push along x, if it is less than half of one, would always be lost.

**Corners.** Who is held by two surfaces that face each other by more than a right angle cannot get out of one without getting
into the other: to push it out of one after the other converges, the more slowly the narrower the corner, and leaves a velocity
that moves nobody. So both conditions are solved at once: n1 . v = u1 and n2 . v = u2 for the speeds u of the surfaces, and the
same for the place. Between surfaces that are parallel, and nearer than the circle is wide, there is no such place: then it
stands in the middle, and counts as so much smaller for the rest of the substep.

**The room wins.** Who is pushed beyond a wall of the room by an obstacle is held by the wall, as by another surface; where there
is no place left between both it stands at the wall, in the obstacle.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.bundle import bundle
from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import FIRST_OBSTACLE
from pyverlet.kernels.bounds import hit_with, look, meet, moved, note, noted, put, wide
from pyverlet.kernels.obstacles import first_link, search, tolerance

MEETINGS, BOUNCES = 256, 8
"""Times one circle may meet anything in a substep, and bounce off it; who has still not come through waits where it last met
something."""

SQUEEZED = 0.05
"""Part of its radius by which a circle overlaps an obstacle when a substep begins, and is no arrival that could bounce."""

CLOSING = 4.0
"""A corner whose surfaces close on a circle, and are so nearly parallel that it would have to slip out by so many times what
they move by, closes over it: as between the blades of scissors it would be shot out at any speed."""

PARALLEL = 1e-4
"""Sine of the angle below which two surfaces that face each other count as parallel; and part of the speed that is no
approach."""

_BLOCK = 128
"""Circles of which is asked first whether there is anything near one of them."""

ROOM, NOBODY = -2, -1
"""Numbers that are no segment's."""

OPEN, ROUND, RECTANGLE = 0.0, 1.0, 2.0
"""What a room is; as numbers: [what, x0, y0, radius or x1, y1, restitution, friction]."""


@bundle
class Course:
    """Obstacles, as `kernels.obstacles` has them, and their grid: `links`, rows of a segment and of the next link of its cell.

    heads: of each cell the first link.
    room: its wall, which wins: (7,), see OPEN. along: (n, 2), becomes the acceleration left to those who are held, m/s^2, or 0.
    rest: (n, 2), what rounding has taken from places in the substep before, and takes in this, m.
    """

    segments: Any
    bodies: Any
    heads: Any
    links: Any
    room: Any
    along: Any
    rest: Any


class Surface(NamedTuple):
    """What holds a circle."""

    nx: Any
    ny: Any
    at: Any
    """n . x of a centre that just touches it, m."""
    speed: Any
    """n . v of a circle that stays at it, m/s."""
    which: Any
    """Segment, ROOM or NOBODY."""


@kernel
def _unrounded(x, before, v, a, h, drop, step):
    """Where the integrator has put a coordinate, unrounded; x itself if others have moved it too. step: of rounding."""
    exact = before + h * (v - (1.0 - drop) * h * a)
    return exact if abs(exact - x) <= step * (abs(x) + abs(before)) else x


@kernel
def _beyond(room, x, y, radius):
    """(depth, normal x, y) of the wall of the room that a rim is farthest beyond; a depth below 0: of none."""
    if room[0] == ROUND:
        dx, dy = x - room[1], y - room[2]
        distance = np.hypot(dx, dy)
        if distance > 0.0:
            return distance + radius - room[3], -dx / distance, -dy / distance
    elif room[0] == RECTANGLE:
        depth, nx, ny = room[1] + radius - x, 1.0, 0.0
        if x + radius - room[3] > depth:
            depth, nx = x + radius - room[3], -1.0
        if room[2] + radius - y > depth:
            depth, nx, ny = room[2] + radius - y, 0.0, 1.0
        if y + radius - room[4] > depth:
            depth, nx, ny = y + radius - room[4], 0.0, -1.0
        return depth, nx, ny
    return -1.0, 0.0, 1.0


@kernel
def _wall(room, nx, ny):
    """Number of the wall of the room with this normal: of a rectangle left, right, floor and ceiling; of a cage there is one."""
    if room[0] != RECTANGLE:
        return np.int64(0)
    if nx != 0.0:
        return np.int64(0 if nx > 0.0 else 1)
    return np.int64(2 if ny > 0.0 else 3)


@kernel
def _kept(room, b):
    """The circle b, not beyond any wall of the room."""
    for _ in range(2):  # a corner
        depth, nx, ny = _beyond(room, b.x, b.y, b.radius)
        if depth <= 0.0:
            break
        b = moved(b, b.x + depth * nx, b.y + depth * ny, b.vx, b.vy, b.from_x, b.from_y)
    return b


@kernel
def _touched(b, i, impacts, surface, nx, ny, depth, wx, wy, h, lag, e, mu, rest_speed, which):
    """The circle b meets a surface that moves with (wx, wy): what becomes of it, and the surface; NOBODY's if it bounced."""
    resting, hit, from_x, from_y = b.resting, b.hit, b.from_x, b.from_y
    # As the surface sees it: how fast it is, and how far it went.
    b = noted(moved(b, b.x, b.y, b.vx - wx, b.vy - wy, from_x + h * wx, from_y + h * wy), np.int64(0))
    b = meet(hit_with(b, -1.0), nx, ny, depth, h, lag, e, mu, rest_speed)
    held = b.resting != 0
    note(impacts, i, surface, np.int64(not held), b.hit)
    b = hit_with(b, max(hit, b.hit))
    b = noted(moved(b, b.x, b.y, b.vx + wx, b.vy + wy, from_x, from_y), resting | b.resting)
    speed = nx * (wx - b.lift * b.ax) + ny * (wy - b.lift * b.ay)
    return b, Surface(nx, ny, nx * b.x + ny * b.y, speed, which if held else NOBODY)


@kernel
def _along(b, surface, by_x, by_y):
    """(x, y) acceleration left to the circle b while the surface holds it; by: what it has just gained, m/s^2, friction included.

    That of an arrival is no acceleration: friction is at most what would stop it from being driven along the surface.
    """
    nx, ny = surface.nx, surface.ny
    driven = b.ax * ny - b.ay * nx  # along the tangent (ny, -nx)
    rub = by_x * ny - by_y * nx
    left = driven + max(min(rub, abs(driven)), -abs(driven))
    return left * ny, -left * nx


@kernel
def _still_there(surface, segments, x, y, size, least):
    """Whether a circle of this size at (x, y) touches the surface, or is beyond it: not if it has gone past its end."""
    if surface.which == ROOM:
        return True
    if surface.which == NOBODY:
        return False
    segment = segments[surface.which]
    ox, oy = x - segment.bx, y - segment.by
    along, across = segment.bc * ox + segment.bs * oy, segment.bc * oy - segment.bs * ox
    past = along - min(max(along, 0.0), segment.length)
    return np.hypot(past, across) <= segment.rounding + size + least


@kernel
def _in_corner(b, old, new, px, py, on_the_way, size, least, way, speed):
    """The circle b is held by the `old` surface too: (what becomes of it, how large it counts).

    px, py: where it met the new one; `on_the_way`: having gone there, instead of overlapping it to begin with. way, speed: what
    it has gone in this substep, m, and how fast.
    """
    cross = old.nx * new.ny - old.ny * new.nx
    over = 1.0 / cross if abs(cross) > PARALLEL else 0.0
    x, y, vx, vy = b.x, b.y, b.vx, b.vy
    # The room stands where it is; of two obstacles each has half of it.
    fixed = old if old.which == ROOM else new
    if old.nx * vx + old.ny * vy - old.speed < -PARALLEL * np.hypot(vx, vy):
        vx, vy = over * (old.speed * new.ny - new.speed * old.ny), over * (old.nx * new.speed - new.nx * old.speed)
        if over == 0.0 or np.hypot(vx, vy) > speed + CLOSING * (abs(old.speed) + abs(new.speed)):
            stays = fixed.speed if fixed.which == ROOM else 0.5 * (new.speed - old.speed)
            by = stays - fixed.nx * b.vx - fixed.ny * b.vy
            vx, vy = b.vx + by * fixed.nx, b.vy + by * fixed.ny
    short = old.at - old.nx * x - old.ny * y
    if short > least:
        if on_the_way and new.which != ROOM:
            x, y = px, py
        else:
            x, y = over * (old.at * new.ny - new.at * old.ny), over * (old.nx * new.at - new.nx * old.at)
            if over == 0.0 or np.hypot(x - b.x, y - b.y) > way + CLOSING * short:
                part = 0.0 if new.which == ROOM else 1.0 if old.which == ROOM else 0.5
                x, y = b.x + part * short * old.nx, b.y + part * short * old.ny
                size -= max(part, 1.0 - part) * short
    return moved(b, x, y, vx, vy, b.from_x, b.from_y), size


@kernel
def _in_wide_corner(b, old, new, x, y, vx, vy):
    """The circle b meets two surfaces in a wide corner: (what becomes of it, whether both hold it).

    x, y, vx, vy: where it was, and how fast, before it met the first. Both hold it if each has to push it then to satisfy both;
    one after the other, the second would have pushed it off the first. Who comes faster than a substep of gravity is not held.
    """
    dot = old.nx * new.nx + old.ny * new.ny
    square = 1.0 - dot * dot
    if square <= PARALLEL:
        return b, False
    first, second = old.speed - old.nx * vx - old.ny * vy, new.speed - new.nx * vx - new.ny * vy
    by_first, by_second = (first - dot * second) / square, (second - dot * first) / square
    if by_first < 0.0 or by_second < 0.0:
        return b, False
    vx, vy = vx + by_first * old.nx + by_second * new.nx, vy + by_first * old.ny + by_second * new.ny
    first, second = old.at - old.nx * x - old.ny * y, new.at - new.nx * x - new.ny * y
    by_first, by_second = (first - dot * second) / square, (second - dot * first) / square
    if by_first < 0.0 or by_second < 0.0:
        x, y = b.x, b.y
    else:
        x, y = x + by_first * old.nx + by_second * new.nx, y + by_first * old.ny + by_second * new.ny
    return moved(b, x, y, vx, vy, b.from_x, b.from_y), True


@kernel
def _carried(segment, time, px, py, qx, qy):
    """The place at that time on the way from p to q, taken along to where the segment is at the end of the substep."""
    ax, ay = px - segment.ax, py - segment.ay
    bx, by = qx - segment.bx, qy - segment.by
    along, across = segment.c * ax + segment.s * ay, segment.c * ay - segment.s * ax
    along += time * (segment.bc * bx + segment.bs * by - along)
    across += time * (segment.bc * by - segment.bs * bx - across)
    return segment.bx + segment.bc * along - segment.bs * across, segment.by + segment.bs * along + segment.bc * across


@kernel
def _travel(b, i, impacts, px, py, segments, bodies, until, x0, y0, x1, y1, cell, heads, links, room, h, lag, rest_speed):
    """The circle b comes from p: (what becomes of it, whether it has met anything, the acceleration left to it if it is held)."""
    size, along_x, along_y, bounces = b.radius, 0.0, 0.0, 0
    x_then, y_then, vx_then, vy_then = b.x, b.y, b.vx, b.vy
    way, speed = np.hypot(b.x - px, b.y - py), np.hypot(b.vx, b.vy)
    last = older = Surface(0.0, 0.0, 0.0, 0.0, NOBODY)
    for number in range(MEETINGS + 1):
        qx, qy = b.x, b.y
        time, gap, depth, nx, ny, k = search(segments, x0, y0, x1, y1, cell, heads, links, number == 0, px, py, qx, qy, size)
        least = tolerance(qx, qy, b.radius)
        if k >= 0:
            segment, body = segments[k], bodies[segments[k].body]
            # What the surface does where they touch.
            touch_x = qx - (size - depth) * nx - body.x - until * body.vx
            touch_y = qy - (size - depth) * ny - body.y - until * body.vy
            belt_x, belt_y = -ny * segment.belt, nx * segment.belt
            if segment.around == 0 and nx * segment.bs - ny * segment.bc < 0.0:
                belt_x, belt_y = -belt_x, -belt_y
            wx, wy = body.vx - body.spin * touch_y + belt_x, body.vy + body.spin * touch_x + belt_y
            e, mu, surface = segment.restitution, segment.friction, FIRST_OBSTACLE + segment.body
            squeezed = number == 0 and time <= 0.0 and (time < 0.0 or gap < segment.rounding + (1.0 - SQUEEZED) * size)
        else:
            if number == 0:
                return b, False, 0.0, 0.0
            depth, nx, ny = _beyond(room, qx, qy, b.radius)
            if depth <= least:
                break
            k, time, wx, wy, e, mu, squeezed = ROOM, 0.0, 0.0, 0.0, room[5], room[6], False
            surface = _wall(room, nx, ny)
        if number == MEETINGS or bounces == BOUNCES:
            b = moved(b, px, py, b.vx, b.vy, b.from_x, b.from_y)
            break
        vx, vy = b.vx, b.vy
        b, new = _touched(b, i, impacts, surface, nx, ny, depth, wx, wy, h, lag, e, mu, np.inf if squeezed else rest_speed, k)
        if k != ROOM:
            if time < 0.0:  # it was inside: the way so far does not count
                px, py = b.x, b.y
            elif number == 0:
                px, py = _carried(segments[k], time, px, py, qx, qy)
            else:
                px, py = px + time * (qx - px), py + time * (qy - py)
        along_x = along_y = 0.0
        if new.which == NOBODY:
            bounces += 1
        else:
            along_x, along_y = _along(b, new, (b.vx - vx) / h, (b.vy - vy) / h)
            for old in (last, older):
                if old.which != new.which and _still_there(old, segments, px, py, size, least):
                    cornered = False
                    if old.nx * new.nx + old.ny * new.ny < 0.0:
                        b, size = _in_corner(b, old, new, px, py, time > 0.0, size, least, way, speed)
                        cornered = abs(old.nx * new.ny - old.ny * new.nx) > PARALLEL
                    elif number == 1:
                        b, cornered = _in_wide_corner(b, old, new, x_then, y_then, vx_then, vy_then)
                    if cornered:
                        along_x = along_y = 0.0
            if last.which != new.which:
                older = last
            last = new
    return _kept(room, b), True, along_x, along_y


@kernel
def _alone(px, py, qx, qy, x0, y0, x1, y1, cell, heads):
    """Whether the way is short and there is nothing near its middle: true for most circles, most of the time."""
    if not abs(qx - px) + abs(qy - py) < cell:
        return False
    x, y = 0.5 * (px + qx), 0.5 * (py + qy)
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        return True
    return first_link(x, y, cell, heads) < 0


@kernel
def _nobody(position, before, x0, y0, x1, y1, cell):
    """Whether nothing can be near the ways of these circles: all are short, with their middles off the cells. Errs towards no."""
    q, p = position.reshape(-1), before.reshape(-1)
    near = False
    for k in range(position.shape[0]):
        i = np.uint64(2 * k)
        j = i + np.uint64(1)
        x, y = 0.5 * (p[i] + q[i]), 0.5 * (p[j] + q[j])
        near |= not (abs(q[i] - p[i]) + abs(q[j] - p[j]) < cell)
        near |= (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    return not near


@kernel
def _forget(along, rest):
    """Nobody of these has been met."""
    one, other = along.reshape(-1), rest.reshape(-1)
    for k in range(one.shape[0]):
        one[k] = 0
    for k in range(other.shape[0]):
        other[k] = 0


@kernel
def _collide(first, stop, circles, course, until, x0, y0, x1, y1, cell, h, lag, rest_speed, drop):
    """`collide`, of the circles from `first` up to `stop`."""
    position, before, inverse_mass, along, rest = circles.position, circles.start, circles.inverse_mass, course.along, course.rest
    segments, bodies, heads, links, room = course.segments, course.bodies, course.heads, course.links, course.room
    x0, y0, x1, y1 = x0 - cell, y0 - cell, x1 + cell, y1 + cell  # for rounding
    if _nobody(position[first:stop], before[first:stop], x0, y0, x1, y1, cell):
        _forget(along[first:stop], rest[first:stop])
        return
    step = 0.5 * np.finfo(position.dtype).eps
    for i in range(first, stop):
        along[i, 0] = along[i, 1] = 0.0
        met = False
        if inverse_mass[i] > 0 and not _alone(
            before[i, 0], before[i, 1], position[i, 0], position[i, 1], x0, y0, x1, y1, cell, heads
        ):
            b = wide(look(i, circles))
            rest_x, rest_y = np.float64(rest[i, 0]), np.float64(rest[i, 1])
            px, py = before[i, 0] + rest_x, before[i, 1] + rest_y
            if np.isfinite(px + py + b.x + b.y):
                long = np.float64(h)
                x = _unrounded(b.x + rest_x, px, b.vx, b.ax, long, drop, step)
                y = _unrounded(b.y + rest_y, py, b.vy, b.ay, long, drop, step)
                b, met, along_x, along_y = _travel(
                    moved(b, x, y, b.vx, b.vy, b.from_x, b.from_y), i, circles.impacts, px, py, segments, bodies, until, x0, y0,
                    x1, y1, cell, heads, links, room, long, np.float64(lag), np.float64(rest_speed),
                )  # fmt: skip
                if met:
                    along[i, 0], along[i, 1] = along_x, along_y
                    put(i, b, circles)
                    rest[i, 0], rest[i, 1] = b.x - position[i, 0], b.y - position[i, 1]
        if not met:
            rest[i, 0] = rest[i, 1] = 0.0


@parallel_kernel
def collide(circles, course, until, x0, y0, x1, y1, cell, h, lag, rest_speed, drop):
    """All circles, from where they were at the `start` of the substep to `position`; until: seconds into the frame at its end.

    x0, y0, x1, y1: box around the obstacles, m; cell: of their grid, see `kernels.obstacles`. drop: of the integrator.
    """
    count = circles.position.shape[0]
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        first, stop = block * _BLOCK, min((block + 1) * _BLOCK, count)
        _collide(first, stop, circles, course, until, x0, y0, x1, y1, cell, h, lag, rest_speed, drop)
