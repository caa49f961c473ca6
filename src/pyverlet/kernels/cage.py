"""A cage around circles that neither bounce nor rub, eight at a time: those beyond its wall are looked for, and then held.

What becomes of a circle is what `kernels.bounds` makes of it with e = 0 and mu = 0, to the last bit: the same sums, without
its branches.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    larger,
    pick,
    place,
    put,
    smaller,
    spread,
    square_root,
    take,
    where_zero,
)
from pyverlet.compile.stealing import claim_evenly, none_claimed
from pyverlet.kernels.beyond import beyond_circle
from pyverlet.kernels.motion import arrive

# Circles one thread takes at a time.
_CHUNK = 2048


@kernel
def _impact_time(dx, dy, vx, vy, ax, ay, reach, zero, half, h):
    """As `kernels.bounds.impact_time`."""
    gap = reach * reach - dx * dx - dy * dy
    along = dx * vx + dy * vy
    root = square_root(larger(along * along + (vx * vx + vy * vy) * gap, zero))
    speed = larger(along, zero - along) + root
    time = where_zero(speed, h, smaller(larger(gap, zero - gap) / speed, h))
    for _ in range(2):
        px = dx - time * (vx - half * time * ax)
        py = dy - time * (vy - half * time * ay)
        slope = px * (ax * time - vx) + py * (ay * time - vy)
        after = smaller(larger(time + half * (reach * reach - px * px - py * py) / slope, zero), h)
        time = where_zero(slope, time, after)
    return time


@kernel
def _hold(which, x0, y0, size, position, velocity, acceleration, radius, hits, h, lag, rest_speed):
    """Hold the circles of `which`, all beyond the wall, on it; eight times the same is as good as once."""
    none = h - h
    zero, half, h, lag = spread(none), spread(h / (h + h)), spread(h), spread(lag)
    x0, y0, size, rest_speed = spread(x0), spread(y0), spread(size), spread(rest_speed)
    for k in range(0, which.shape[0], LANES):
        x, y = take(position, which, k)
        vx, vy = take(velocity, which, k)
        ax, ay = take(acceleration, which, k)
        dx, dy, room = x - x0, y - y0, larger(size - pick(radius, which, k), zero)
        distance = square_root(dx * dx + dy * dy)
        nx, ny, depth = (zero - dx) / distance, (zero - dy) / distance, distance - room
        ux, uy = vx + lag * ax, vy + lag * ay
        # 0 if it rests on the wall; otherwise that which it hit is the tangent where it hit.
        fast = smaller(larger((zero - (ux * nx + uy * ny)) - rest_speed, zero), room)
        time = _impact_time(dx, dy, ux, uy, ax, ay, room, zero, half, h)
        px = dx - time * (ux - half * time * ax)
        py = dy - time * (uy - half * time * ay)
        reached = square_root(px * px + py * py)
        nx, ny = where_zero(fast, nx, (zero - px) / reached), where_zero(fast, ny, (zero - py) / reached)
        depth = where_zero(fast, depth, larger((px - dx) * nx + (py - dy) * ny, zero))
        # What `meet` does with a circle that is held.
        an = ax * nx + ay * ny
        vn = vx * nx + vy * ny + lag * an
        before = vn - lag * an
        away = larger(before, zero) - before
        hit = square_root(larger(vn * vn + (depth + depth) * an, zero))
        hit = where_zero(smaller(vn, zero), zero, hit)
        place(hits, which, k, larger(pick(hits, which, k), hit))
        x, y = x + depth * nx, y + depth * ny
        # The wall bends away from the tangent along which it goes on: who is still beyond waits at the wall.
        dx, dy = x - x0, y - y0
        distance = square_root(dx * dx + dy * dy)
        outside = larger(distance - room, zero)
        part = room / distance
        put(position, which, k, where_zero(outside, x, x0 + dx * part), where_zero(outside, y, y0 + dy * part))
        put(velocity, which, k, vx + away * nx, vy + away * ny)


@kernel
def hold_some(
    x0, y0, size, position, velocity, acceleration, radius, inverse_mass, resting, hits, h, lag, rest_speed, begin, end
):
    """What `hold` does, for the circles from `begin` up to `end`."""
    found = np.empty(_CHUNK + 2 * LANES, np.uint32)
    for first in range(begin, end, _CHUNK):
        stop = min(first + _CHUNK, end)
        resting[first:stop] = 0
        number = beyond_circle(x0, y0, size, position, radius, inverse_mass, first, stop, found)
        if number > 0:
            for k in range(number):
                resting[found[k]] = 1
            lanes = (number + LANES - 1) // LANES * LANES
            found[number:lanes] = found[number - 1]
            _hold(found[:lanes], x0, y0, size, position, velocity, acceleration, radius, hits, h, lag, rest_speed)


@parallel_kernel
def hold(
    x0, y0, size, position, velocity, acceleration, radius, inverse_mass, resting, hits, h, lag, rest_speed,
    arrives, origin, moved, feed, claims,
):  # fmt: skip
    """All circles stay inside the cage of radius `size` about (x0, y0); `resting` is 1 for those that were beyond.

    arrives: 1 if contacts have `moved` them and they have yet to `arrive` there; or 0, and nobody looks at origin, moved and
    feed. claims: `_claims.Claims`.
    """
    count = radius.shape[0]
    chunks = (count + _CHUNK - 1) // _CHUNK
    none_claimed(claims)
    for part in prange(claims.shape[0]):
        chunk = claim_evenly(claims, chunks, part)
        while chunk >= 0:
            a, b = chunk * _CHUNK, min((chunk + 1) * _CHUNK, count)
            if arrives:
                arrive(position[a:b], velocity[a:b], origin[a:b], moved[a:b], feed)
            bodies = (position, velocity, acceleration, radius, inverse_mass, resting, hits)
            hold_some(x0, y0, size, *bodies, h, lag, rest_speed, a, b)
            chunk = claim_evenly(claims, chunks, part)
