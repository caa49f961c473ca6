# mypy: ignore-errors
"""Linked particles at surfaces: links move them along the surface, which absorbs the normal part."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import fabs
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.step import Step
from pyverlet.core.surface_contacts import excess_speed, keep_with_pair, passes_by
from pyverlet.core.surface_rows import (
    BEFORE_CHAIN,
    BEFORE_CHAIN_DRAG,
    COULOMB,
    DRAG,
    GAP,
    NORMAL,
    NORMAL_Y,
    PUSH,
    SPEED,
    SPEED_Y,
    row_of,
)
from pyverlet.core.surfaces import add_surface_impulse

WEDGED = cython.declare(cython.double, 1e-3)
"""If surfaces leave a row less than this fraction of its mobility, it is solved without them, and they follow."""

Mobility = cython.struct(xx=cython.double, xy=cython.double, yy=cython.double)


@inlined
def share_along(k: cython.pointer(Links), i: cython.Py_ssize_t, c: cython.Py_ssize_t) -> cython.double:
    """Fraction of a tangential impulse that moves linked particle i: a disc with grip also rolls, and keeps two thirds."""
    grips: cython.bint = fabs(k.contact[row_of(c) + DRAG]) < k.contact[row_of(c) + COULOMB] * k.contact[row_of(c) + PUSH]
    return k.ease[i] / (1 + k.ease[i]) if k.rough and k.has_friction[i] and grips else 1.0


@inlined
def moved_by(k: cython.pointer(Links), i: cython.Py_ssize_t) -> Mobility:
    """Velocity per impulse of linked particle i, (m/s)/(N s), as a symmetric matrix."""
    found: Mobility
    own: cython.double = k.weight[i]
    found.xx, found.xy, found.yy = own, 0, own
    c: cython.Py_ssize_t = k.held[i]
    if c >= 0:
        x: cython.double = k.contact[row_of(c) + NORMAL]
        y: cython.double = k.contact[row_of(c) + NORMAL_Y]
        own *= share_along(k, i, c)
        found.xx, found.xy, found.yy = own * y * y, -own * x * y, own * x * x
    return found


@inlined
def mobility_along(
    k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double, a: cython.double, b: cython.double
) -> cython.double:
    """Change of the velocity of linked particle i along (a, b) by an impulse (x, y)."""
    m: Mobility = moved_by(k, i)
    return (m.xx * x + m.xy * y) * a + (m.xy * x + m.yy * y) * b


@inlined
def press(
    k: cython.pointer(Links), i: cython.Py_ssize_t, c: cython.Py_ssize_t, into: cython.double, slip: cython.double
) -> cython.void:
    """Let surface contact c absorb the velocity `into` it of linked particle i, with friction within Coulomb's cone."""
    at: cython.Py_ssize_t = row_of(c)
    nx: cython.double = k.contact[at + NORMAL]
    ny: cython.double = k.contact[at + NORMAL_Y]
    into = max(into, -k.contact[at + PUSH])
    k.contact[at + PUSH] += into
    k.u[2 * i] -= into * nx
    k.u[2 * i + 1] -= into * ny
    if k.rough and k.has_friction[i]:
        most: cython.double = k.contact[at + COULOMB] * k.contact[at + PUSH]
        tangent: cython.double = min(max(k.contact[at + DRAG] - slip / (1 + k.ease[i]), -most), most) - k.contact[at + DRAG]
        k.contact[at + DRAG] += tangent
        k.u[2 * i] += tangent * ny
        k.u[2 * i + 1] -= tangent * nx
        k.rim[i] -= k.ease[i] * tangent


@inlined
def move(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Change the velocity of linked particle i, minus what its surface absorbs."""
    c: cython.Py_ssize_t = k.held[i]
    k.u[2 * i] += x
    k.u[2 * i + 1] += y
    if c >= 0:
        nx: cython.double = k.contact[row_of(c) + NORMAL]
        ny: cython.double = k.contact[row_of(c) + NORMAL_Y]
        press(k, i, c, x * nx + y * ny, x * ny - y * nx)


@kernel
def let_go_of_wedged(
    k: cython.pointer(Links), i: cython.Py_ssize_t, j: cython.Py_ssize_t, x: cython.double, y: cython.double
) -> cython.void:
    """Release two particles from surfaces that leave no motion along the unit vector (x, y) between them."""
    if k.held[i] < 0 and k.held[j] < 0:
        return
    left: cython.double = mobility_along(k, i, x, y, x, y) + mobility_along(k, j, x, y, x, y)
    if left < WEDGED * (k.weight[i] + k.weight[j]):
        k.held[i] = k.held[j] = -1


@kernel
def pulled_off(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.bint:
    """Whether an impulse (x, y) pulls linked particle i off its surface, from which it is then released."""
    c: cython.Py_ssize_t = k.held[i]
    if c < 0:
        return False
    into: cython.double = k.weight[i] * (x * k.contact[row_of(c) + NORMAL] + y * k.contact[row_of(c) + NORMAL_Y])
    if into >= -k.contact[row_of(c) + PUSH]:
        return False
    k.held[i] = -1
    return True


@kernel
def find_hold(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Assign linked particle i to the surface with the largest push."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    most: cython.double = 0
    k.held[i] = -1
    if k.own[i] > 0 and k.surfaces:
        for c in range(w.contact_begin[k.sorted_index[i]], w.contact_end[k.sorted_index[i]]):
            if w.contact[row_of(c) + PUSH] > most and w.contact[row_of(c) + GAP] > -k.deepest:
                most = w.contact[row_of(c) + PUSH]
                k.held[i] = cython.cast(int32_t, c)


@kernel
def save_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Save the state of linked particle i before its chain moves it."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    k.begun[3 * i], k.begun[3 * i + 1], k.begun[3 * i + 2] = k.u[2 * i], k.u[2 * i + 1], k.rim[i]
    if k.surfaces:
        for c in range(w.contact_begin[k.sorted_index[i]], w.contact_end[k.sorted_index[i]]):
            w.contact[row_of(c) + BEFORE_CHAIN] = w.contact[row_of(c) + PUSH]
            w.contact[row_of(c) + BEFORE_CHAIN_DRAG] = w.contact[row_of(c) + DRAG]


@kernel
def restore_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Restore the state that `save_node` saved."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    k.u[2 * i], k.u[2 * i + 1], k.rim[i] = k.begun[3 * i], k.begun[3 * i + 1], k.begun[3 * i + 2]
    if k.surfaces:
        for c in range(w.contact_begin[k.sorted_index[i]], w.contact_end[k.sorted_index[i]]):
            w.contact[row_of(c) + PUSH] = w.contact[row_of(c) + BEFORE_CHAIN]
            w.contact[row_of(c) + DRAG] = w.contact[row_of(c) + BEFORE_CHAIN_DRAG]
    find_hold(w, i)


@kernel
def hold_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Stop linked particle i at its surfaces in this substep; as `hold`."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    if k.own[i] == 0 or k.weight[i] == 0 or not k.surfaces:
        return
    for c in range(w.contact_begin[k.sorted_index[i]], w.contact_end[k.sorted_index[i]]):
        first: cython.Py_ssize_t = row_of(c)
        if w.contact[first + GAP] < -k.deepest:
            continue
        before: cython.double = w.contact[first + PUSH]
        if before > 0 or (w.contact[first + GAP] < w.far and not passes_by(w, k.sorted_index[i], c, k.u[2 * i], k.u[2 * i + 1])):
            x: cython.double = k.u[2 * i] - w.contact[first + SPEED]
            y: cython.double = k.u[2 * i + 1] - w.contact[first + SPEED_Y]
            slip: cython.double = x * w.contact[first + NORMAL_Y] - y * w.contact[first + NORMAL] - k.rim[i]
            press(k, i, c, excess_speed(w, c, k.u[2 * i], k.u[2 * i + 1]), slip)
    find_hold(w, i)


@kernel
def add_hold_impulses(w: cython.pointer(Step), i: cython.Py_ssize_t, share: cython.double) -> cython.void:
    """Record `share` of the impulses of surfaces on linked particle i: before (-1) and after (1) links change it."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    if k.own[i] == 0 or not k.surfaces:
        return
    for c in range(w.contact_begin[k.sorted_index[i]], w.contact_end[k.sorted_index[i]]):
        first: cython.Py_ssize_t = row_of(c)
        jn: cython.double = share * w.rest_scale * w.contact[first + PUSH]
        jt: cython.double = share * w.rest_scale * w.contact[first + DRAG]
        nx: cython.double = w.contact[first + NORMAL]
        ny: cython.double = w.contact[first + NORMAL_Y]
        add_surface_impulse(w, k.sorted_index[i], c, jn, jt, nx, ny, False)
        if w.surface[c] < 0:
            keep_with_pair(w, c)
