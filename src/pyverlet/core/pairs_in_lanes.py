# mypy: ignore-errors
"""Eight pairs at a time: their velocities, and the effect of impulses.

Impulses are stored over the reduced mass, in m/s, so that formulas need no masses: i gets w_i / (w_i + w_j) of an impulse. Along
the tangent (n_y, -n_x) the contact point of two discs has three times the inverse mass (I = m r^2 / 2): see `grip`.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import lanes, lanes2, lanes4, larger, load, put, put4, smaller, spread, take, take4, where_zero

from pyverlet.core.kernels import inlined
from pyverlet.core.step import Step

Motion = cython.struct(ux=lanes, uy=lanes, us=lanes, vx=lanes, vy=lanes, vs=lanes)
"""Velocities u of i and v of j, m/s, and their spins, rad/s, which are 0 without friction."""


@inlined
def motion_of(w: cython.pointer(Step), k: cython.Py_ssize_t, rough: cython.bint) -> Motion:
    """Load the motion of the pairs from k on."""
    m: Motion
    if rough:
        a: lanes4 = take4(w.motion, w.i, k)
        b: lanes4 = take4(w.motion, w.j, k)
        m.ux, m.uy, m.us, m.vx, m.vy, m.vs = a.x, a.y, a.z, b.x, b.y, b.z
    else:
        u: lanes2 = take(w.velocity, w.i, k)
        v: lanes2 = take(w.velocity, w.j, k)
        m.ux, m.uy, m.us, m.vx, m.vy, m.vs = u.x, u.y, spread(0), v.x, v.y, spread(0)
    return m


@inlined
def arm_of(w: cython.pointer(Step), k: cython.Py_ssize_t, depth: lanes) -> lanes:
    """Distances from the centres to the contact point of the pairs from k on, over the radii.

    The centres of overlapping discs are closer than the sum of the radii. Tangential impulses conserve angular momentum if the
    two lever arms add up to the distance of the centres.
    """
    return spread(1) - larger(depth, spread(0)) * load(w.per_reach, k * w.sized)


@inlined
def roll_ease(turn: lanes, part: lanes, radius: lanes) -> lanes:
    """Change of a disc's spin by a unit angular impulse over the reduced mass: part times m / I; turn is m r / I, 0 if fixed."""
    return part * turn / radius


@inlined
def held_roll(w: cython.pointer(Step), k: cython.Py_ssize_t, m: Motion, normal: lanes, turning: lanes) -> lanes:
    """The angular impulse of the pairs from k on that stops their rolling on each other, limited by their resistance.

    The limit is c r_i r_j / (r_i + r_j) times the normal impulse (Ai, Chen, Rotter and Ooi 2011, model A, as a Coulomb cone).
    turning: the friction impulse about to be applied, times `arm_of`.
    """
    at: cython.Py_ssize_t = k * w.mixed
    part: lanes = load(w.share, k * w.varied)
    other: lanes = spread(1) - part
    spins: lanes = m.vs - m.us + turning * (other * load(w.turn_j, at) - part * load(w.turn_i, at))
    ease: lanes = roll_ease(load(w.turn_i, at), part, load(w.radius_i, at))
    ease = ease + roll_ease(load(w.turn_j, at), other, load(w.radius_j, at))
    wanted: lanes = load(w.roll_impulse, k) - where_zero(ease, spread(0), spins / where_zero(ease, spread(1), ease))
    return clamped(wanted, load(w.rolling, at) * normal)


@inlined
def apply_impulses(
    w: cython.pointer(Step),
    k: cython.Py_ssize_t,
    rough: cython.bint,
    m: Motion,
    nx: lanes,
    ny: lanes,
    normal: lanes,
    tangent: lanes,
    turning: lanes,
    roll: lanes,
) -> cython.void:
    """Apply impulses to the pairs from k on: `normal` along n, `tangent` across it; m: their motion.

    turning: what turns them, `tangent` times `arm_of`. roll: angular impulse on j, and its opposite on i; ignored unless `rolls`.
    """
    part: lanes = load(w.share, k * w.varied)
    other: lanes = spread(1) - part
    x: lanes = normal * nx
    y: lanes = normal * ny
    if rough:
        at: cython.Py_ssize_t = k * w.mixed
        x = x + tangent * ny
        y = y - tangent * nx
        turned_i: lanes = m.us + turning * part * load(w.turn_i, at)
        turned_j: lanes = m.vs + turning * other * load(w.turn_j, at)
        if w.rolls:
            turned_i = turned_i - roll * roll_ease(load(w.turn_i, at), part, load(w.radius_i, at))
            turned_j = turned_j + roll * roll_ease(load(w.turn_j, at), other, load(w.radius_j, at))
        put4(w.motion, w.i, k, m.ux - x * part, m.uy - y * part, turned_i, spread(0))
        put4(w.motion, w.j, k, m.vx + x * other, m.vy + y * other, turned_j, spread(0))
    else:
        put(w.velocity, w.i, k, m.ux - x * part, m.uy - y * part)
        put(w.velocity, w.j, k, m.vx + x * other, m.vy + y * other)


@inlined
def slip_of(w: cython.pointer(Step), k: cython.Py_ssize_t, m: Motion, nx: lanes, ny: lanes, arm: lanes) -> lanes:
    """Slip velocity of the contact points of the pairs from k on along the tangent, m/s."""
    at: cython.Py_ssize_t = k * w.mixed
    rims: lanes = arm * (m.us * load(w.radius_i, at) + m.vs * load(w.radius_j, at))
    return (m.vx - m.ux) * ny - (m.vy - m.uy) * nx + rims


@inlined
def clamped(a: lanes, most: lanes) -> lanes:
    """Clamp a to -most .. most."""
    return smaller(larger(a, -most), most)
