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


@kernel
def place(segments, bodies, time, h):
    """Where the segments stand `time` seconds into the frame, and h later."""
    for k in range(segments.shape[0]):
        segment, body = segments[k], bodies[segments[k].body]
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
def bin_segments(segments, reach, x0, y0, cell, columns, rows, start, entries):
    """List in every cell the segments that may be met from it; returns how many entries there are, also beyond the room."""
    start[:] = 0
    for fill in range(2):
        for k in range(segments.shape[0]):
            segment = segments[k]
            far = reach + segment.rounding + segment.inner + segment.sweep
            x, y = segment.bx, segment.by
            dx, dy = segment.bc * segment.length, segment.bs * segment.length
            low = max(int(np.floor((min(y, y + dy) - far - y0) / cell)), 0)
            high = min(int(np.floor((max(y, y + dy) + far - y0) / cell)), rows - 1)
            for row in range(low, high + 1):
                # The part of the segment that is within reach of the row.
                s0, s1 = 0.0, 1.0
                if dy != 0.0:
                    a, b = (y0 + row * cell - far - y) / dy, (y0 + (row + 1) * cell + far - y) / dy
                    s0, s1 = max(min(a, b), 0.0), min(max(a, b), 1.0)
                xa, xb = x + s0 * dx, x + s1 * dx
                left = max(int(np.floor((min(xa, xb) - far - x0) / cell)), 0)
                right = min(int(np.floor((max(xa, xb) + far - x0) / cell)), columns - 1)
                for column in range(left, right + 1):
                    c = row * columns + column
                    if fill:
                        start[c] -= 1
                        entries[start[c]] = k
                    else:
                        start[c] += 1
        if fill == 0:
            for c in range(columns * rows):
                start[c + 1] += start[c]
            if start[columns * rows] > entries.shape[0]:
                return start[columns * rows]
    return start[columns * rows]


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
def _first_meeting(
    segments, entries, low, high, fresh, px, py, qx, qy, radius, best, best_gap, best_depth, best_nx, best_ny, best_k
):
    """The earliest meeting of the way from p to q with the segments of one cell, or what was the best before.

    `fresh`: p belongs to the beginning of the substep; otherwise to its end, as after a first meeting.
    Returns (time, distance, depth, world normal x, y, segment). A time below 0 says that p is inside a polygon.
    """
    travel = np.hypot(qx - px, qy - py)
    for entry in range(low, high):
        k = entries[entry]
        segment = segments[k]
        ox, oy = qx - segment.bx, qy - segment.by
        x1, y1 = segment.bc * ox + segment.bs * oy, segment.bc * oy - segment.bs * ox
        reach = segment.rounding + radius
        past = x1 - min(max(x1, 0.0), segment.length)
        far = reach + travel + segment.sweep + segment.inner
        if past * past + y1 * y1 > far * far:
            continue
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
        if time < NEVER and depth > least and (time < best or (time == best and gap < best_gap)):
            best, best_gap, best_depth, best_k = time, gap, depth, k
            best_nx, best_ny = segment.bc * nx - segment.bs * ny, segment.bs * nx + segment.bc * ny
    return best, best_gap, best_depth, best_nx, best_ny, best_k


@kernel
def search(segments, x0, y0, cell, columns, rows, start, entries, fresh, px, py, qx, qy, radius):
    """The earliest meeting of the way from p to q with any segment; as `_first_meeting`."""
    best, gap, depth, nx, ny, k = NEVER, 0.0, 0.0, 0.0, 0.0, np.int64(-1)
    dx, dy = qx - px, qy - py
    # The part of the way that is over the grid, in pieces no longer than a cell; the middle of a piece stands for it.
    s0, s1 = 0.0, 1.0
    for axis in range(2):
        p, d = (px - x0, dx) if axis == 0 else (py - y0, dy)
        size = cell * (columns if axis == 0 else rows)
        if d != 0.0:
            a, b = -p / d, (size - p) / d
            s0, s1 = max(s0, min(a, b)), min(s1, max(a, b))
        elif not 0.0 <= p <= size:
            return best, gap, depth, nx, ny, k
    if not s0 <= s1:
        return best, gap, depth, nx, ny, k
    pieces = int((s1 - s0) * np.hypot(dx, dy) / cell) + 1
    for piece in range(pieces):
        s = s0 + (piece + 0.5) / pieces * (s1 - s0)
        column = min(max(int((px + s * dx - x0) / cell), 0), columns - 1)
        row = min(max(int((py + s * dy - y0) / cell), 0), rows - 1)
        c = row * columns + column
        best, gap, depth, nx, ny, k = _first_meeting(
            segments, entries, start[c], start[c + 1], fresh, px, py, qx, qy, radius, best, gap, depth, nx, ny, k
        )
    return best, gap, depth, nx, ny, k


@kernel
def covered(segments, position, by):
    """Which obstacle has each of the (n, 2) points in it, -1 for none; lines have no inside."""
    for i in range(position.shape[0]):
        x, y = position[i, 0], position[i, 1]
        by[i] = -1
        for k in range(segments.shape[0]):
            segment = segments[k]
            if segment.rounding > 0.0:
                ox, oy = x - segment.ax, y - segment.ay
                along, across = segment.c * ox + segment.s * oy, segment.c * oy - segment.s * ox
                if np.hypot(along - min(max(along, 0.0), segment.length), across) < segment.rounding:
                    by[i] = segment.body
                    break
            if segment.faces > 0 and segment.first == k and _inside(segments, segment, x, y):
                by[i] = segment.body
                break
