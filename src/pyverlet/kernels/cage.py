"""A cage, eight circles at a time: those beyond its wall are looked for, and then held. Who may bounce is met one by one.

What becomes of a circle is what `kernels.bounds` makes of it, to the last bit: the same sums, without its branches. Circles that
neither bounce nor rub, in a cage that does neither, have a way of their own, `hold`, with less to read.
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
    store,
    take,
    where_above,
    where_zero,
    which_above,
)
from pyverlet.compile.stealing import claim_evenly, none_claimed
from pyverlet.ground.constants import FED, PUSHED
from pyverlet.kernels.beyond import beyond_circle
from pyverlet.kernels.bounds import AT_WALL, BOUNCED, LOADED, at_cage, hit_with, look, note
from pyverlet.kernels.bounds import put as put_back
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
def _wall(dx, dy, ux, uy, ax, ay, room, rest_speed, zero, half, h):
    """Of circles at (dx, dy) from the centre, with the velocity (ux, uy): the wall's normal (2), their depth, and whether they
    hit it faster than one that rests on it, not 0: then it is the tangent where they hit.
    """
    distance = square_root(dx * dx + dy * dy)
    nx, ny, depth = (zero - dx) / distance, (zero - dy) / distance, distance - room
    fast = smaller(larger((zero - (ux * nx + uy * ny)) - rest_speed, zero), room)
    time = _impact_time(dx, dy, ux, uy, ax, ay, room, zero, half, h)
    px = dx - time * (ux - half * time * ax)
    py = dy - time * (uy - half * time * ay)
    reached = square_root(px * px + py * py)
    nx, ny = where_zero(fast, nx, (zero - px) / reached), where_zero(fast, ny, (zero - py) / reached)
    return nx, ny, where_zero(fast, depth, larger((px - dx) * nx + (py - dy) * ny, zero)), fast


@kernel
def _hold(which, circles, x0, y0, size, h, lag, rest_speed):
    """Hold the circles of `which`, all beyond the wall, on it; eight times the same is as good as once."""
    position, velocity, acceleration = circles.position, circles.velocity, circles.acceleration
    radius, hits, impacts, speeds = circles.radius, circles.hits, circles.impacts, np.empty(LANES, circles.hits.dtype)
    none = h - h
    zero, half, h, lag = spread(none), spread(h / (h + h)), spread(h), spread(lag)
    x0, y0, size, rest_speed = spread(x0), spread(y0), spread(size), spread(rest_speed)
    for k in range(0, which.shape[0], LANES):
        x, y = take(position, which, k)
        vx, vy = take(velocity, which, k)
        ax, ay = take(acceleration, which, k)
        dx, dy, room = x - x0, y - y0, larger(size - pick(radius, which, k), zero)
        nx, ny, depth, _ = _wall(dx, dy, vx + lag * ax, vy + lag * ay, ax, ay, room, rest_speed, zero, half, h)
        # What `meet` does with a circle that is held.
        an = ax * nx + ay * ny
        vn = vx * nx + vy * ny + lag * an
        before = vn - lag * an
        away = larger(before, zero) - before
        hit = square_root(larger(vn * vn + (depth + depth) * an, zero))
        hit = where_zero(smaller(vn, zero), zero, hit)
        place(hits, which, k, larger(pick(hits, which, k), hit))
        if impacts.shape[0] > 0:
            _note(which, k, hit, impacts, speeds)
        _wait(which, k, x + depth * nx, y + depth * ny, x0, y0, room, zero, position)
        put(velocity, which, k, vx + away * nx, vy + away * ny)


@kernel
def _note(which, k, hit, impacts, speeds):
    """Eight circles have met the wall and stay there. speeds: (8,), overwritten."""
    store(speeds, 0, hit)
    for lane in range(LANES):
        note(impacts, which[k + lane], np.int64(0), np.int64(0), speeds[lane])


@kernel
def _wait(which, k, x, y, x0, y0, room, zero, position):
    """The wall bends away from the tangent along which it goes on: who is still beyond waits at the wall."""
    dx, dy = x - x0, y - y0
    distance = square_root(dx * dx + dy * dy)
    outside = larger(distance - room, zero)
    part = room / distance
    put(position, which, k, where_zero(outside, x, x0 + dx * part), where_zero(outside, y, y0 + dy * part))


@kernel
def _bits(fed, which, k, mask):
    """Of which of these circles all bits of `mask` are set in `fed`."""
    bits = 0
    for lane in range(LANES):
        bits |= (1 << lane) if fed[which[k + lane]] & mask == mask else 0
    return bits


@kernel
def _rest(which, circles, x0, y0, size, h, lag, e, mu, rest_speed):
    """Hold the circles of `which`, all beyond a wall that may bounce and rub them; those that may bounce, and seven others of
    their pack each, are left to be looked at one by one. `which` then begins with them. Returns how many.
    """
    position, velocity, acceleration, spin = circles.position, circles.velocity, circles.acceleration, circles.spin
    radius, restitution, friction, fed, hits = circles.radius, circles.restitution, circles.friction, circles.fed, circles.hits
    start, turn, lift = circles.start, circles.turn, circles.lift
    impacts, speeds = circles.impacts, np.empty(LANES, hits.dtype)
    rubs, left = turn.shape[0] > 0, 0
    none = h - h
    zero, half, share = spread(none), spread(h / (h + h)), spread(position.dtype.type(PUSHED / FED))
    two, three = spread((h + h) / h), spread((h + h + h) / h)
    h, lag, e, mu = spread(h), spread(lag), spread(e), spread(mu)
    x0, y0, size, rest_speed = spread(x0), spread(y0), spread(size), spread(rest_speed)
    for k in range(0, which.shape[0], LANES):
        x, y = take(position, which, k)
        vx, vy = take(velocity, which, k)
        ax, ay = take(acceleration, which, k)
        r = pick(radius, which, k)
        dx, dy, room = x - x0, y - y0, larger(size - r, zero)
        nx, ny, depth, fast = _wall(dx, dy, vx + lag * ax, vy + lag * ay, ax, ay, room, rest_speed, zero, half, h)
        an = ax * nx + ay * ny
        vn = vx * nx + vy * ny + lag * an
        hit = where_zero(smaller(vn, zero), zero, square_root(larger(vn * vn + (depth + depth) * an, zero)))
        own = larger(e, pick(restitution, which, k))
        leaves = which_above(own * hit, rest_speed)
        if leaves != 0:
            leaves &= ~_bits(fed, which, k, np.int64(LOADED))
        if leaves | (which_above(own, zero) & which_above(fast, zero)) != 0:
            for lane in range(LANES):
                which[left + lane] = which[k + lane]
            left += LANES
            continue
        before = vn - lag * an
        lifted = pick(lift, which, k) if rubs else zero
        lx, ly = zero - lifted * ax, zero - lifted * ay
        away = larger(before, lx * nx + ly * ny) - before
        place(hits, which, k, larger(pick(hits, which, k), hit))
        if impacts.shape[0] > 0:
            _note(which, k, hit, impacts, speeds)
        x, y = x + depth * nx, y + depth * ny
        vx, vy = vx + away * nx, vy + away * ny
        own = pick(friction, which, k)
        own = where_above(zero, own, mu, square_root(larger(mu * own, zero)))
        if which_above(own, zero) != 0:
            w = pick(spin, which, k)
            slip = (vx - lx) * ny - (vy - ly) * nx + w * r
            most = own * away
            rub = larger(smaller((zero - slip) / three, most), zero - most)
            vx, vy = vx + rub * ny, vy - rub * nx
            place(spin, which, k, w + two * rub / r)
            back = h * rub
            if rubs:
                # Among circles that rub each other: from what it has slipped, for they have pushed it since the integration.
                from_x, from_y = take(start, which, k)
                sx, sy, turned = x - from_x, y - from_y, pick(turn, which, k)
                most = most * where_zero(lifted, h, h * share)
                back = larger(smaller((zero - (sx * ny - sy * nx + turned * r)) / three, most), zero - most)
                place(turn, which, k, turned + two * back / r)
            x, y = x + back * ny, y - back * nx
        for lane in range(LANES):
            fed[which[k + lane]] |= np.uint8(AT_WALL)
        _wait(which, k, x, y, x0, y0, room, zero, position)
        put(velocity, which, k, vx, vy)
    return left


@kernel
def hold_some(circles, x0, y0, size, h, lag, rest_speed, begin, end):
    """What `hold` does, for the circles from `begin` up to `end`."""
    position, radius, inverse_mass, resting = circles.position, circles.radius, circles.inverse_mass, circles.resting
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
            _hold(found[:lanes], circles, x0, y0, size, h, lag, rest_speed)


@parallel_kernel
def hold(circles, x0, y0, size, h, lag, rest_speed, arrives, feed, claims):
    """All circles stay inside the cage of radius `size` about (x0, y0); `resting` is 1 for those that were beyond.

    arrives: 1 if contacts have `moved` them and they have yet to `arrive` there; or 0, and nobody looks at origin, moved and
    feed. claims: `_claims.Claims`.
    """
    position, velocity, origin, moved = circles.position, circles.velocity, circles.origin, circles.moved
    count = position.shape[0]
    chunks = (count + _CHUNK - 1) // _CHUNK
    none_claimed(claims)
    for part in prange(claims.shape[0]):
        chunk = claim_evenly(claims, chunks, part)
        while chunk >= 0:
            a, b = chunk * _CHUNK, min((chunk + 1) * _CHUNK, count)
            if arrives:
                arrive(position[a:b], velocity[a:b], origin[a:b], moved[a:b], feed)
            hold_some(circles, x0, y0, size, h, lag, rest_speed, a, b)
            chunk = claim_evenly(claims, chunks, part)


@kernel
def _confine_some(circles, x0, y0, size, first, stop, h, lag, e, mu, rest_speed):
    """What `confine` does, for the circles from `first` up to `stop`."""
    resting = circles.resting
    resting[first:stop] = 0
    found = np.empty(_CHUNK + LANES, np.uint32)
    number = beyond_circle(x0, y0, size, circles.position, circles.radius, circles.inverse_mass, first, stop, found)
    if number == 0:
        return
    left = number
    if circles.spent.shape[0] == 0:
        for k in range(number):
            resting[found[k]] = 1
        lanes = (number + LANES - 1) // LANES * LANES
        found[number:lanes] = found[number - 1]
        left = _rest(found[:lanes], circles, x0, y0, size, h, lag, e, mu, rest_speed)
    for k in range(left):
        i = found[k]
        if k > 0 and i == found[k - 1]:  # to fill a pack
            continue
        resting[i] = 0
        b = at_cage(hit_with(look(i, circles), h - h - h), x0, y0, size, h, lag, e, mu, rest_speed)
        note(circles.impacts, i, np.int64(0), b.fed // BOUNCED, b.hit)
        put_back(i, hit_with(b, max(b.hit, circles.hits[i])), circles)


@parallel_kernel
def confine(circles, x0, y0, size, h, lag, e, mu, rest_speed):
    """A cage of any material: all circles stay inside that of radius `size` about (x0, y0)."""
    count = circles.radius.shape[0]
    for chunk in prange((count + _CHUNK - 1) // _CHUNK):
        first, stop = chunk * _CHUNK, min((chunk + 1) * _CHUNK, count)
        _confine_some(circles, x0, y0, size, first, stop, h, lag, e, mu, rest_speed)
