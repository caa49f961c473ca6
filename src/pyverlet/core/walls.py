# mypy: ignore-errors
"""The walls of a room: hard contacts, with impulses that last, and impacts in closed form. One particle at a time."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt

from pyverlet.core.impacts import NEVER, note_wall, strike
from pyverlet.core.step import CAGE, OPEN, Step

Wall = cython.struct(
    nx=cython.double,  # unit normal out of the room
    ny=cython.double,
    gap=cython.double,  # of the rim to the wall, m
    turn=cython.double,  # 1 / (radius of curvature of the path that slides along it), 1/m; 0: straight
)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def wall_of(w: cython.pointer(Step), i: cython.Py_ssize_t, side: cython.int) -> Wall:
    """Side 0, 1, 2, 3 of a box: left, right, bottom, top; of a cage there is side 0 only."""
    wall: Wall
    x: cython.double = w.position[2 * i]
    y: cython.double = w.position[2 * i + 1]
    r: cython.double = w.radius[i]
    wall.turn = 0
    if w.room == CAGE:
        x -= w.x0
        y -= w.y0
        d: cython.double = sqrt(x * x + y * y)
        wall.nx = x / d if d > 0 else 1.0
        wall.ny = y / d if d > 0 else 0.0
        wall.gap = w.x1 - r - d
        wall.turn = 1 / (w.x1 - r) if w.x1 > r else 0.0
    else:
        wall.nx = -1.0 if side == 0 else 1.0 if side == 1 else 0.0
        wall.ny = -1.0 if side == 2 else 1.0 if side == 3 else 0.0
        if side == 0:
            wall.gap = x - r - w.x0
        elif side == 1:
            wall.gap = w.x1 - r - x
        elif side == 2:
            wall.gap = y - r - w.y0
        else:
            wall.gap = w.y1 - r - y
    return wall


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def touch_time(
    w: cython.pointer(Step), i: cython.Py_ssize_t, wall: cython.pointer(Wall), ux: cython.double, uy: cython.double
) -> cython.double:
    """When the rim meets the wall, s into the substep; NEVER if it does not in this one."""
    h: cython.double = w.h
    ax: cython.double = w.acceleration[2 * i]
    ay: cython.double = w.acceleration[2 * i + 1]
    if wall.gap <= 0:
        return 0.0
    t: cython.double
    _: cython.int
    if w.room == CAGE:
        px: cython.double = w.position[2 * i] - w.x0
        py: cython.double = w.position[2 * i + 1] - w.y0
        room: cython.double = w.x1 - w.radius[i]
        along: cython.double = px * ux + py * uy
        square: cython.double = ux * ux + uy * uy
        near: cython.double = room * room - px * px - py * py
        if square == 0:
            return NEVER
        root: cython.double = sqrt(along * along + square * near)
        t = near / (along + root) if along > 0 else (root - along) / square
        for _ in range(2):
            half: cython.double = 0.5 * t * (h - t)
            x: cython.double = px + ux * t - ax * half
            y: cython.double = py + uy * t - ay * half
            slope: cython.double = 2 * (x * (ux + ax * (t - 0.5 * h)) + y * (uy + ay * (t - 0.5 * h)))
            if slope <= 0:
                return NEVER
            t -= (x * x + y * y - room * room) / slope
    else:
        u: cython.double = ux * wall.nx + uy * wall.ny
        a: cython.double = ax * wall.nx + ay * wall.ny
        if u <= 0:
            return NEVER
        t = wall.gap / u
        for _ in range(2):
            rate: cython.double = u + a * (t - 0.5 * h)
            if rate <= 0:
                return NEVER
            t -= (u * t - 0.5 * a * t * (h - t) - wall.gap) / rate
    return max(t, 0.0) if t < h else NEVER


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def bounce(w: cython.pointer(Step), i: cython.Py_ssize_t, side: cython.int, wall: cython.pointer(Wall)) -> cython.bint:
    """An impact on a wall, if it meets it in this substep and faster than contacts at rest do."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    ux: cython.double = v[width * i]
    uy: cython.double = v[width * i + 1]
    t: cython.double = touch_time(w, i, wall, ux, uy)
    if t == NEVER:
        return False
    back: cython.double = t - 0.5 * cython.cast(cython.double, w.h)
    nx: cython.double = wall.nx
    ny: cython.double = wall.ny
    if w.room == CAGE:
        half: cython.double = 0.5 * t * (w.h - t)
        nx = w.position[2 * i] - w.x0 + ux * t - w.acceleration[2 * i] * half
        ny = w.position[2 * i + 1] - w.y0 + uy * t - w.acceleration[2 * i + 1] * half
        d: cython.double = sqrt(nx * nx + ny * ny)
        nx /= d
        ny /= d
    ux += w.acceleration[2 * i] * back
    uy += w.acceleration[2 * i + 1] * back
    speed: cython.double = ux * nx + uy * ny
    free: cython.double = w.free[2 * i] * nx + w.free[2 * i + 1] * ny
    if speed <= w.least_bounce or free <= w.least_bounce:  # what only contacts push there carries load
        return False
    e: cython.double = max(w.wall_restitution, cython.cast(cython.double, w.own_restitution[i]))
    push: cython.double = (1 + e) * speed
    strike(w, i, -push * nx, -push * ny, 0, t)
    note_wall(w, i, -push * nx, -push * ny)
    mu: cython.double = w.wall_friction
    if w.own_friction[i] >= 0:
        mu = sqrt(mu * w.own_friction[i])
    if w.rough and mu > 0:
        slip: cython.double = ux * ny - uy * nx - w.motion[4 * i + 2] * w.radius[i] + w.wall_speed
        most: cython.double = mu * push
        jt: cython.double = min(max(-slip / 3, -most), most)
        strike(w, i, jt * ny, -jt * nx, -jt * 2 / w.radius[i], t)
        note_wall(w, i, jt * ny, -jt * nx)
    if t == 0 and wall.gap < 0:  # it was beyond: put back
        w.position[2 * i] += cython.cast(real, wall.gap * nx)
        w.position[2 * i + 1] += cython.cast(real, wall.gap * ny)
        w.moved[2 * i] += cython.cast(real, wall.gap * nx)
        w.moved[2 * i + 1] += cython.cast(real, wall.gap * ny)
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def hold(
    w: cython.pointer(Step), i: cython.Py_ssize_t, side: cython.int, wall: cython.pointer(Wall), relax: cython.bint
) -> cython.void:
    """A contact at rest: an impulse that lets the rim come to the wall within this substep, and no farther."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    at: cython.Py_ssize_t = side * w.count + i
    before: cython.double = w.wall_impulse[at]
    speed: cython.double = v[width * i] * wall.nx + v[width * i + 1] * wall.ny
    if not relax:
        if wall.turn > 0:  # sliding along a round wall: the chord leaves it
            slide: cython.double = v[width * i] * wall.ny - v[width * i + 1] * wall.nx
            speed += 0.5 * slide * slide * wall.turn * w.h
        speed -= wall.gap / w.h
    after: cython.double = max(before + speed, 0.0)
    if before == 0 and after == 0:
        return
    w.wall_impulse[at] = after
    change: cython.double = w.wall_impulse[at] - before
    v[width * i] -= cython.cast(real, change * wall.nx)
    v[width * i + 1] -= cython.cast(real, change * wall.ny)
    note_wall(w, i, -w.weigh * change * wall.nx, -w.weigh * change * wall.ny)
    if w.rough:
        mu: cython.double = w.wall_friction
        if w.own_friction[i] >= 0:
            mu = sqrt(mu * w.own_friction[i])
        slip: cython.double = v[4 * i] * wall.ny - v[4 * i + 1] * wall.nx - v[4 * i + 2] * w.radius[i] + w.wall_speed
        most: cython.double = mu * after
        old: cython.double = w.wall_tangent[at]
        w.wall_tangent[at] = min(max(old - slip / 3, -most), most)
        rubbed: cython.double = w.wall_tangent[at] - old
        v[4 * i] += cython.cast(real, rubbed * wall.ny)
        v[4 * i + 1] -= cython.cast(real, rubbed * wall.nx)
        note_wall(w, i, w.weigh * rubbed * wall.ny, -w.weigh * rubbed * wall.nx)
        v[4 * i + 2] -= cython.cast(real, rubbed * 2 / w.radius[i])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def bounce_walls(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Let particle i bounce from walls that it meets fast in this substep; not from those that carry its load."""
    side: cython.int
    bounced: cython.bint = False
    if w.inverse_mass[i] == 0:
        return False
    for side in range(1 if w.room == CAGE else 4):
        if w.restless or w.wall_impulse[side * w.count + i] == 0:
            wall: Wall = wall_of(w, i, side)
            bounced |= bounce(w, i, side, cython.address(wall))
    return bounced


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def hold_walls(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Hold particle i at the walls that it may reach in this substep."""
    side: cython.int
    for side in range(1 if w.room == CAGE else 4):
        wall: Wall = wall_of(w, i, side)
        if wall.gap < w.far or w.wall_impulse[side * w.count + i] > 0:
            hold(w, i, side, cython.address(wall), False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def relax_walls(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Walls that carry load: no speed into them."""
    side: cython.int
    for side in range(1 if w.room == CAGE else 4):
        if w.wall_impulse[side * w.count + i] > 0:
            wall: Wall = wall_of(w, i, side)
            hold(w, i, side, cython.address(wall), True)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def warm_walls(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """What walls gave in the last substep, along the normals of now."""
    side: cython.int
    for side in range(1 if w.room == CAGE else 4):
        at: cython.Py_ssize_t = side * w.count + i
        if w.wall_impulse[at] > 0:
            wall: Wall = wall_of(w, i, side)
            if w.substep == w.first:
                w.wall_impulse[at] *= w.scale
                w.wall_tangent[at] *= w.scale
            jn: cython.double = w.wall_impulse[at]
            jt: cython.double = w.wall_tangent[at] if w.rough else 0.0
            width: cython.Py_ssize_t = 4 if w.rough else 2
            v: cython.pointer(real) = w.motion if w.rough else w.velocity
            v[width * i] += cython.cast(real, jt * wall.ny - jn * wall.nx)
            v[width * i + 1] -= cython.cast(real, jt * wall.nx + jn * wall.ny)
            note_wall(w, i, w.weigh * (jt * wall.ny - jn * wall.nx), -w.weigh * (jt * wall.nx + jn * wall.ny))
            if w.rough:
                v[4 * i + 2] -= cython.cast(real, jt * 2 / w.radius[i])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def list_walls(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Note which particles from a to b may meet a wall in this substep, from `at_wall[a]` on; returns how many do."""
    far: real = w.far
    count: cython.Py_ssize_t = 0
    block: cython.Py_ssize_t
    i: cython.Py_ssize_t
    if w.room == OPEN:
        return 0
    x0: real = cython.cast(real, w.x0)
    y0: real = cython.cast(real, w.y0)
    x1: real = cython.cast(real, w.x1)
    y1: real = cython.cast(real, w.y1)
    for block in range(a, b, 64):
        end: cython.Py_ssize_t = min(block + 64, b)
        close: cython.bint = False
        if w.room == CAGE:
            for i in range(block, end):
                dx: real = w.position[2 * i] - x0
                dy: real = w.position[2 * i + 1] - y0
                room: real = x1 - w.radius[i] - far
                close |= (room <= 0) | (dx * dx + dy * dy > room * room)
        else:
            for i in range(block, end):
                x: real = w.position[2 * i]
                y: real = w.position[2 * i + 1]
                r: real = w.radius[i] + far
                close |= (x - r < x0) | (x + r > x1) | (y - r < y0) | (y + r > y1)
        if close:
            for i in range(block, end):
                if w.room == CAGE:
                    dx = w.position[2 * i] - x0
                    dy = w.position[2 * i + 1] - y0
                    room = x1 - w.radius[i] - far
                    close = (room <= 0) | (dx * dx + dy * dy > room * room)
                else:
                    x = w.position[2 * i]
                    y = w.position[2 * i + 1]
                    r = w.radius[i] + far
                    close = (x - r < x0) | (x + r > x1) | (y - r < y0) | (y + r > y1)
                if close and w.inverse_mass[i] > 0:
                    w.at_wall[a + count] = i
                    count += 1
    return count
