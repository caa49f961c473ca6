# mypy: ignore-errors
"""Start of a substep for pairs: normals and depths, and the warm start with the impulses of the last substep."""

from __future__ import annotations

import cython
from cython.cimports.lanes import (
    above,
    any_above,
    choose,
    lanes,
    lanes2,
    larger,
    load,
    magnitude,
    mask,
    put,
    real,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_zero,
)

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pairs_in_lanes import apply_impulses, arm_of, clamped, motion_of
from pyverlet.core.step import ELASTIC, FADING, TOUCHED, Step

Normals = cython.struct(x=lanes, y=lanes)


@inlined
def measure(shared: cython.pointer(Step), s: cython.Py_ssize_t, rough: cython.bint, warm: cython.bint) -> cython.void:
    """Compute normals and depths of the pairs of group s. warm: apply the impulses of the last substep.

    Pairs too far apart to touch in this substep get only a depth.
    """
    own: Step = shared[0]  # a copy that no store to an array can alias: its fields stay in registers
    w: cython.pointer(Step) = cython.address(own)
    zero: lanes = spread(0)
    far: lanes = spread(w.far)
    weight: lanes = spread(w.rest_speed)
    fading: lanes = spread(FADING)
    least: lanes = spread(w.rest_speed * cython.cast(real, 0.01))
    scale: lanes = spread(w.scale if w.substep == w.first else cython.cast(real, 1))
    first: cython.Py_ssize_t = w.begin[s]
    end: cython.Py_ssize_t = first + w.swept[s]
    for k in range(first, end, 8):
        p: lanes2 = take(w.moved, w.i, k)
        q: lanes2 = take(w.moved, w.j, k)
        dx: lanes = load(w.gap_x, k) + (q.x - p.x)
        dy: lanes = load(w.gap_y, k) + (q.y - p.y)
        square: lanes = dx * dx + dy * dy
        reach: lanes = load(w.reach, k * w.sized)
        impulse: lanes = load(w.impulse, k)
        soon: lanes = reach + far
        loaded: cython.bint = any_above(impulse, zero)
        if warm:
            # Load may at most double per substep, so that an impact is not repeated; separated pairs forget it slowly.
            before: lanes = magnitude(load(w.load, k))
            # Pairs that overlap only on the extrapolated path before a bounce have not touched.
            depth: lanes = load(w.depth, k)
            depth = choose(
                above(load(w.restitution, k * w.mixed), spread(ELASTIC)), smaller(depth, reach * reach - square), depth
            )
            touched: mask = above(larger(depth, impulse), zero)
            impulse = smaller(impulse, before + before + weight) * scale
            kept: lanes = smaller(least - fading * before, zero)
            store(w.load, k, choose(touched, larger(impulse, spread(TOUCHED)), kept))
        if not loaded and not any_above(soon * soon, square):
            store(w.depth, k, -soon)
            continue
        distance: lanes = square_root(square)
        dx = where_zero(distance, reach, dx)
        distance = where_zero(distance, reach, distance)
        per_metre: lanes = spread(1) / distance
        nx: lanes = dx * per_metre
        ny: lanes = dy * per_metre
        store(w.normal_x, k, nx)
        store(w.normal_y, k, ny)
        store(w.depth, k, reach - distance)
        if warm and loaded:
            tangent: lanes = zero
            roll: lanes = zero
            if rough:
                tangent = clamped(load(w.tangent_impulse, k) * scale, load(w.friction, k * w.mixed) * impulse)
                store(w.tangent_impulse, k, tangent)
                if w.rolls:
                    roll = clamped(load(w.roll_impulse, k) * scale, load(w.rolling, k * w.mixed) * impulse)
                    store(w.roll_impulse, k, roll)
            store(w.impulse, k, impulse)
            turning: lanes = tangent * arm_of(w, k, reach - distance) if rough else zero
            apply_impulses(w, k, rough, motion_of(w, k, rough), nx, ny, impulse, tangent, turning, roll)


@kernel
def measure_pairs(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Compute normals and depths of the pairs of group s."""
    if w.rough:
        measure(w, s, True, False)
    else:
        measure(w, s, False, False)


@kernel
def warm_start(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Compute normals and depths of the pairs of group s, and warm-start them."""
    if w.rough:
        measure(w, s, True, True)
    else:
        measure(w, s, False, True)


@inlined
def turned_normals(w: cython.pointer(Step), k: cython.Py_ssize_t, impulse: lanes, old_x: lanes, old_y: lanes) -> Normals:
    """Normals after the drift of the pairs from k on; old: those before, along which impulses would turn fast pairs.

    The half of the impulses in velocities at the end of a frame would do so, too, and impacts in the next substep depend on
    velocities without contacts: both are corrected as if impulses had been along the new normals.
    """
    p: lanes2 = take(w.moved, w.i, k)
    q: lanes2 = take(w.moved, w.j, k)
    dx: lanes = load(w.gap_x, k) + (q.x - p.x)
    dy: lanes = load(w.gap_y, k) + (q.y - p.y)
    distance: lanes = square_root(dx * dx + dy * dy)
    reach: lanes = load(w.reach, k * w.sized)
    dx = where_zero(distance, reach, dx)
    per_metre: lanes = spread(1) / where_zero(distance, reach, distance)
    n: Normals
    n.x = dx * per_metre
    n.y = dy * per_metre
    store(w.normal_x, k, n.x)
    store(w.normal_y, k, n.y)
    x: lanes = impulse * (n.x - old_x)
    y: lanes = impulse * (n.y - old_y)
    part: lanes = load(w.share, k * w.varied)
    other: lanes = spread(1) - part
    u: lanes2 = take(w.free, w.i, k)
    v: lanes2 = take(w.free, w.j, k)
    put(w.free, w.i, k, u.x + x * part, u.y + y * part)
    put(w.free, w.j, k, v.x - x * other, v.y - y * other)
    return n
