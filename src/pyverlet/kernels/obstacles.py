"""Obstacles: every shape is made of rounded segments, which circles meet on their way through a substep.

In the frame of a segment, its start is the origin and its end (length, 0). A circle's centre travels from where the substep
began, seen from the segment of then, to where it ended, seen from the segment of now. It meets the segment where that way comes
within reach = rounding + radius: over its face, or about an end. Whoever travels from one side of a line to the other crosses it,
however fast: nobody is seen for the first time behind it.

Where segments join, an end belongs to the neighbour as long as the centre stands over the neighbour's face: a circle that rolls
over the joint of a floor does not feel it.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel

BODY = np.dtype([(name, np.float64) for name in ("x", "y", "angle", "vx", "vy", "spin")])
"""Where an obstacle's pivot is at the beginning of a frame, m and rad, and how it moves, m/s and rad/s."""

SEGMENT = np.dtype(
    [
        ("body", np.int64),
        ("first", np.int64), ("faces", np.int64),  # the faces of its polygon; none if it is no part of one
        ("around", np.int64),  # 1: its surface runs counter-clockwise around it; 0: along it, on both sides
        ("lx", np.float64), ("ly", np.float64), ("lc", np.float64), ("ls", np.float64),  # start and direction, as built
        ("length", np.float64), ("rounding", np.float64), ("inner", np.float64),  # inner: who is inside is as near as this, m
        ("before_x", np.float64), ("before_y", np.float64),  # from its start to the neighbour's start, in its own frame; or 0
        ("after_x", np.float64), ("after_y", np.float64),  # from its end to the neighbour's end
        ("restitution", np.float64), ("friction", np.float64), ("belt", np.float64),
        ("ax", np.float64), ("ay", np.float64), ("c", np.float64), ("s", np.float64),  # start and direction, beginning of substep
        ("bx", np.float64), ("by", np.float64), ("bc", np.float64), ("bs", np.float64),  # the same at its end
        ("sweep", np.float64),  # what any of its points travels in the substep at most, m
        ("kept_x", np.float64), ("kept_y", np.float64),  # its start when it was listed in the grid; NaN: it is not
        ("kept_to_x", np.float64), ("kept_to_y", np.float64), ("kept_sweep", np.float64),  # its end, and its sweep
        ("slack", np.float64),  # by how much it may move until it must be listed again, m
    ]
)  # fmt: skip
"""A rounded segment of an obstacle. Metres."""

NEVER = 2.0
"""A time on the way, from 0 to 1, that means no meeting."""

SETTLED = 1e-9
"""Part of the radius: a second look within a substep takes less depth than this, and what the coordinates are rounded by, for
rounding. Ways are followed in float64, whatever the world's dtype: a place is rounded once, at the end."""

_ROUNDED = 2.0**-48


@kernel
def tolerance(x, y, radius):
    """Depth, m, that is but rounding for a circle at (x, y)."""
    return SETTLED * radius + _ROUNDED * (abs(x) + abs(y))


FARTHEST = 2.0**50
"""Cells from the origin to where an obstacle can still be listed."""

NO_ROOM = -1
"""`update` has not listed all: the grid must be made anew, with more room or larger cells."""


@kernel
def _place(segment, body, time, h):
    """Where a segment stands `time` seconds into the frame, and h later."""
    for late in range(2):
        t = time + h * late
        turned = body.angle + body.spin * t
        c, s = np.cos(turned), np.sin(turned)
        x = body.x + body.vx * t + c * segment.lx - s * segment.ly
        y = body.y + body.vy * t + s * segment.lx + c * segment.ly
        along, across = c * segment.lc - s * segment.ls, s * segment.lc + c * segment.ls
        if late == 0:
            segment.ax, segment.ay, segment.c, segment.s = x, y, along, across
        else:
            segment.bx, segment.by, segment.bc, segment.bs = x, y, along, across
    arm = np.hypot(segment.lx, segment.ly) + segment.length
    segment.sweep = h * (np.hypot(body.vx, body.vy) + abs(body.spin) * arm)


@kernel
def place(segments, bodies, time, h):
    """Place all segments; `update` places some."""
    for k in range(segments.shape[0]):
        _place(segments[k], bodies[segments[k].body], time, h)


@kernel
def _head_of(column, row, size):
    """Index of a cell in a table of `size` heads, a power of two: a hash, so that the table need not cover the plane."""
    mixed = column * 73856093 ^ row * 19349663
    return (mixed ^ (mixed >> 15)) & (size - 1)


@kernel
def _list(k, segments, reach, cell, box, heads, links, used):
    """List segment k in the cells from which it may be met; returns how many links are used, or NO_ROOM."""
    segment = segments[k]
    far = reach + segment.rounding + segment.inner + segment.sweep + segment.slack
    x, y = segment.bx, segment.by
    dx, dy = segment.bc * segment.length, segment.bs * segment.length
    left, right, low, high = min(x, x + dx) - far, max(x, x + dx) + far, min(y, y + dy) - far, max(y, y + dy) + far
    if not max(abs(left), abs(right), abs(low), abs(high)) < FARTHEST * cell:
        return NO_ROOM
    box[0], box[1], box[2], box[3] = min(box[0], left), min(box[1], low), max(box[2], right), max(box[3], high)
    for row in range(int(np.floor(low / cell)), int(np.floor(high / cell)) + 1):
        # The part of the segment that is within reach of the row.
        s0, s1 = 0.0, 1.0
        if dy != 0.0:
            a, b = (row * cell - far - y) / dy, ((row + 1) * cell + far - y) / dy
            s0, s1 = max(min(a, b), 0.0), min(max(a, b), 1.0)
        xa, xb = x + s0 * dx, x + s1 * dx
        for column in range(int(np.floor((min(xa, xb) - far) / cell)), int(np.floor((max(xa, xb) + far) / cell)) + 1):
            if used == links.shape[0]:
                return NO_ROOM
            head = _head_of(column, row, heads.shape[0])
            links[used, 0], links[used, 1] = k, heads[head]
            heads[head] = used
            used += 1
    segment.kept_x, segment.kept_y, segment.kept_to_x, segment.kept_to_y = x, y, x + dx, y + dy
    segment.kept_sweep = segment.sweep
    return used


@kernel
def update(segments, bodies, first, which, images, time, h, reach, cell, box, heads, links, used):
    """Place the segments of the bodies `which`, and list those that have left the cells they are listed in.

    Links of where a segment was stay in the grid: they say only what is to be looked at. What moves is listed with half a cell to
    spare, so that most substeps list nothing.

    first: of each body its first segment, and one more. images: of the periodic room, whose segments lie behind one another.
    box: x0, y0, x1, y1 around all that is listed, m; grows. heads, links: of the grid. used: links in use.
    Returns how many are used now, or NO_ROOM.
    """
    sides = segments.shape[0] // images
    for image in range(images):
        for b in which:
            for k in range(image * sides + first[b], image * sides + first[b + 1]):
                segment, body = segments[k], bodies[segments[k].body]
                _place(segment, body, time, h)
                to_x, to_y = segment.bx + segment.bc * segment.length, segment.by + segment.bs * segment.length
                moved = max(
                    np.hypot(segment.bx - segment.kept_x, segment.by - segment.kept_y),
                    np.hypot(to_x - segment.kept_to_x, to_y - segment.kept_to_y),
                )
                if moved + max(segment.sweep - segment.kept_sweep, 0.0) <= segment.slack:
                    continue
                segment.slack = 0.5 * cell if segment.sweep > 0.0 else 0.0
                used = _list(k, segments, reach, cell, box, heads, links, used)
                if used == NO_ROOM:
                    return NO_ROOM
    return used


@kernel
def first_link(x, y, cell, heads):
    """The first link of the cell at (x, y), or -1."""
    return heads[_head_of(int(np.floor(x / cell)), int(np.floor(y / cell)), heads.shape[0])]


@kernel
def _round_end(x0, y0, dx, dy, reach):
    """When the way (x0, y0) + s (dx, dy) comes within reach of the origin."""
    a = dx * dx + dy * dy
    b = x0 * dx + y0 * dy
    c = x0 * x0 + y0 * y0 - reach * reach
    root = b * b - a * c
    if b >= 0.0 or root < 0.0 or a == 0.0 or reach <= 0.0:
        return NEVER
    s = (-b - np.sqrt(root)) / a
    return s if 0.0 <= s <= 1.0 else NEVER


@kernel
def _on_the_way(segment, x0, y0, x1, y1, reach):
    """(time, normal x, normal y, point x) of the first meeting of a way with a segment, in its frame; the time may be NEVER."""
    length = segment.length
    side = 1.0 if y0 >= 0.0 else -1.0
    near = min(max(x0, 0.0), length)
    gap = np.hypot(x0 - near, y0)
    # Before the start and beyond the end: does the neighbour have that end?
    left = x0 < 0.0 and x0 * segment.before_x + y0 * segment.before_y > 0.0
    right = x0 > length and (x0 - length) * segment.after_x + y0 * segment.after_y > 0.0
    if gap < reach and not (left or right):
        if near == x0 and length > 0.0:
            return 0.0, 0.0, side, near
        if gap > 0.0:
            return 0.0, (x0 - near) / gap, y0 / gap, near
        return 0.0, 0.0, 1.0, near
    dx, dy = x1 - x0, y1 - y0
    time, nx, ny, point = NEVER, 0.0, side, 0.0
    if side * dy < 0.0 and length > 0.0:
        s = max((reach - side * y0) / (side * dy), 0.0)
        x = x0 + s * dx
        if s <= 1.0 and 0.0 <= x <= length:
            time, point = s, x
        else:
            s = -y0 / dy  # crosses the line itself, having come in sideways
            x = x0 + s * dx
            if s <= 1.0 and 0.0 <= x <= length:
                time, point = s, x
    if time == NEVER and (left or right) and length > 0.0 and dx != 0.0:
        # From over its neighbour's face, where rounding has left it a little too deep to be outside of this one.
        point = 0.0 if left else length
        s = (point - x0) / dx
        if 0.0 <= s <= 1.0 and 0.0 <= side * (y0 + s * dy) < reach:
            time = s
    for end in range(2):
        at = length * end
        s = _round_end(x0 - at, y0, dx, dy, reach)
        if s < time:
            x, y = x0 + s * dx - at, y0 + s * dy
            beyond = x <= 0.0 if end == 0 else x >= 0.0
            if end == 0:
                owned = x * segment.before_x + y * segment.before_y > 0.0
            else:
                owned = x * segment.after_x + y * segment.after_y > 0.0
            if (beyond or length == 0.0) and not owned:
                time, nx, ny, point = s, x / reach, y / reach, at
    return time, nx, ny, point


@kernel
def _inside(segments, segment, x, y):
    """Whether (x, y), at the beginning of the substep, is inside this face's polygon, whose faces run counter-clockwise."""
    for k in range(segment.first, segment.first + segment.faces):
        face = segments[k]
        if face.c * (y - face.ay) - face.s * (x - face.ax) <= 0.0:
            return False
    return True


@kernel
def _may_meet(segment, qx, qy, reach):
    """Whether a circle that ends the substep at q could have met this segment; reach: its radius and how far it went, m."""
    ox, oy = qx - segment.bx, qy - segment.by
    along, across = segment.bc * ox + segment.bs * oy, segment.bc * oy - segment.bs * ox
    past = along - min(max(along, 0.0), segment.length)
    far = reach + segment.rounding + segment.sweep + segment.inner
    return past * past + across * across <= far * far


@kernel
def _earlier(segments, k, fresh, px, py, qx, qy, radius, best, best_gap, best_depth, best_nx, best_ny, best_k):
    """The meeting of the way from p to q with segment k if it is the earliest, or what was the best before.

    `fresh`: p belongs to the beginning of the substep; otherwise to its end, as after a first meeting.
    Returns (time, distance, depth, world normal x, y, segment). A time below 0 says that p is inside a polygon.
    """
    segment = segments[k]
    ox, oy = qx - segment.bx, qy - segment.by
    x1, y1 = segment.bc * ox + segment.bs * oy, segment.bc * oy - segment.bs * ox
    reach = segment.rounding + radius
    c, s = (segment.c, segment.s) if fresh else (segment.bc, segment.bs)
    ox, oy = (px - segment.ax, py - segment.ay) if fresh else (px - segment.bx, py - segment.by)
    x0, y0 = c * ox + s * oy, c * oy - s * ox
    if fresh and segment.faces > 0 and y0 > 0.0 and _inside(segments, segment, px, py):
        # The nearest face lets it out.
        time, nx, ny, gap = -1.0, 0.0, -1.0, y0
        depth = reach + y1
    else:
        time, nx, ny, point = _on_the_way(segment, x0, y0, x1, y1, reach)
        depth = reach - (x1 - point) * nx - y1 * ny
        gap = np.hypot(x0 - point, y0)
    least = 0.0 if fresh else tolerance(qx, qy, radius)
    # Of equal ones the last: the order of links does not matter.
    first = time < best or (time == best and (gap < best_gap or (gap == best_gap and k > best_k)))
    if first and time < NEVER and depth > least:
        nx, ny = segment.bc * nx - segment.bs * ny, segment.bs * nx + segment.bc * ny
        return time, gap, depth, nx, ny, np.int64(k)
    return best, best_gap, best_depth, best_nx, best_ny, best_k


@kernel
def search(segments, x0, y0, x1, y1, cell, heads, links, fresh, px, py, qx, qy, radius):
    """The earliest meeting of the way from p to q with any segment; as `_earlier`."""
    best, gap, depth, nx, ny, k = NEVER, 0.0, 0.0, 0.0, 0.0, np.int64(-1)
    dx, dy = qx - px, qy - py
    # The part of the way in the box around the obstacles, in pieces no longer than a cell; the middle of a piece stands for it.
    s0, s1 = 0.0, 1.0
    for axis in range(2):
        p, d = (px, dx) if axis == 0 else (py, dy)
        low, high = (x0, x1) if axis == 0 else (y0, y1)
        if d != 0.0:
            a, b = (low - p) / d, (high - p) / d
            s0, s1 = max(s0, min(a, b)), min(s1, max(a, b))
        elif not low <= p <= high:
            return best, gap, depth, nx, ny, k
    if not s0 <= s1:
        return best, gap, depth, nx, ny, k
    travel = np.hypot(dx, dy)
    length, far = (s1 - s0) * travel / cell, radius + travel
    if length > segments.shape[0]:  # so far in one substep that looking at all segments takes less
        for each in range(segments.shape[0]):
            if _may_meet(segments[each], qx, qy, far):
                best, gap, depth, nx, ny, k = _earlier(segments, each, fresh, px, py, qx, qy, radius, best, gap, depth, nx, ny, k)
        return best, gap, depth, nx, ny, k
    pieces = int(length) + 1
    for piece in range(pieces):
        s = s0 + (piece + 0.5) / pieces * (s1 - s0)
        link = first_link(px + s * dx, py + s * dy, cell, heads)
        while link >= 0:
            each, link = links[link, 0], links[link, 1]
            if _may_meet(segments[each], qx, qy, far):
                best, gap, depth, nx, ny, k = _earlier(segments, each, fresh, px, py, qx, qy, radius, best, gap, depth, nx, ny, k)
    return best, gap, depth, nx, ny, k


@kernel
def _covers(segments, k, x, y):
    """Whether (x, y), at the beginning of the substep, is in segment k, or in the polygon of which it is a face."""
    segment = segments[k]
    if segment.rounding > 0.0:
        ox, oy = x - segment.ax, y - segment.ay
        along, across = segment.c * ox + segment.s * oy, segment.c * oy - segment.s * ox
        if np.hypot(along - min(max(along, 0.0), segment.length), across) < segment.rounding:
            return True
    return segment.faces > 0 and _inside(segments, segment, x, y)


@kernel
def covered(segments, cell, heads, links, position, by):
    """Which body has each of the (n, 2) points in it, -1 for none; lines have no inside. Of several the first."""
    for i in range(position.shape[0]):
        x, y = position[i, 0], position[i, 1]
        by[i] = -1
        if not abs(x) + abs(y) < FARTHEST * cell:
            continue
        link = first_link(x, y, cell, heads)
        while link >= 0:
            k, link = links[link, 0], links[link, 1]
            if (by[i] < 0 or segments[k].body < by[i]) and _covers(segments, k, x, y):
                by[i] = segments[k].body


@kernel
def _gap(segment, x, y):
    """(distance of (x, y) from the surface of a segment, unit normal x, y out of it), at the end of the substep."""
    ox, oy = x - segment.bx, y - segment.by
    t = min(max(segment.bc * ox + segment.bs * oy, 0.0), segment.length)
    ox, oy = ox - t * segment.bc, oy - t * segment.bs
    far = np.hypot(ox, oy)
    return far - segment.rounding, ox / max(far, 1e-300), oy / max(far, 1e-300)


@kernel
def facing(segments, count, reach, cell, heads, links, position, beyond, row, body, gap, normal):
    """The bodies nearest to each of the points (n, 2), and those at most `beyond` (n,) m farther away.

    count: of bodies, without images. reach: m, up to which a cell knows all segments near it; who is farther from all is compared
    with each. Fills row, body, gap and normal, and returns how many there are, also beyond their room.
    """
    found, total = 0, segments.shape[0]
    for i in range(position.shape[0]):
        x, y = position[i, 0], position[i, 1]
        least, every = np.inf, not abs(x) + abs(y) < FARTHEST * cell
        for attempt in range(2):
            every |= attempt == 1 and least + beyond[i] > reach
            if attempt == 1 and not every:
                break
            link = 0 if every else first_link(x, y, cell, heads)
            while link >= 0:
                k = link if every else links[link, 0]
                least = min(least, _gap(segments[k], x, y)[0])
                link = (link + 1 if link + 1 < total else -1) if every else links[link, 1]
        begun = found
        link = 0 if every else first_link(x, y, cell, heads)
        while link >= 0:
            k = link if every else links[link, 0]
            link = (link + 1 if link + 1 < total else -1) if every else links[link, 1]
            far, nx, ny = _gap(segments[k], x, y)
            if not far <= least + beyond[i]:
                continue
            which = segments[k].body % count
            at = begun
            while at < found and (at >= row.shape[0] or body[at] != which):
                at += 1
            if at < row.shape[0] and (at == found or far < gap[at]):
                row[at], body[at], gap[at], normal[at, 0], normal[at, 1] = i, which, far, nx, ny
            found += at == found
    return found
