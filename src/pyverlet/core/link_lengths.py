# mypy: ignore-errors
"""Newton's method for the lengths of chains; where it fails, sweeps over single links."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_chains import CHORDS, LOST_WAY, WAVES, give, step_chain
from pyverlet.core.link_holds import hold_node, let_go_of_wedged, mobility_along, restore_node, save_node
from pyverlet.core.link_shapes import LinkWay, way_between
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import SPEED, SPEED_Y, row_of

MOST_STEPS = cython.declare(cython.int, 40)
LENGTH_SOLVED = cython.declare(cython.double, 1e-9)
NEAR_ENOUGH = cython.declare(cython.double, 1e-3)
"""Remaining relative length errors that are accepted after Newton's method has failed."""

LOST = cython.declare(cython.double, 0.01)
"""Relative length error from which Newton's method has failed."""

WORSE = cython.declare(cython.double, 2)
"""A step in a net has failed if it leaves more than this many times the error before."""

LEAST_SHARE = cython.declare(cython.double, 0.1)
"""Smallest step size after steps that went too far."""

STIRRED = cython.declare(cython.double, 0.5)
"""Largest gain of energy of a chain, in terms of its internal motion: with more, lengths are right but the solution is not, since
links do no work."""

NO_SPACE = cython.declare(cython.double, 0.1)
"""Relative length error from which there is no room between the surfaces that hold a chain; they then release it."""

LINK_SWEEPS = cython.declare(cython.int, 10)


ChainMotion = cython.struct(
    within=cython.double,  # of the ends of links relative to each other; infinite with springs, which do work
    whole=cython.double,  # of all particles
)
"""Twice the energy of a chain, J."""


@kernel
def misses(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.double:
    """The largest relative length error of the rows of a chain."""
    most: cython.double = 0
    for r in range(first, end):
        if k.intact[r] and k.soft[r] < INFINITY:
            e: cython.Py_ssize_t = k.first[r]
            p: LinkWay = way_between(k, k.node[e], k.node[e + 1], k.h)
            length: cython.double = sqrt(p.x * p.x + p.y * p.y)
            left: cython.double = length - k.rest[r] + k.soft[r] * k.impulse[r] - k.target[r]
            if k.upper[r] > 0 or k.impulse[r] < 0 or left > 0:
                most = max(most, fabs(left) / length if length > 0 else 1)
    return most


@kernel
def seen_from(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> LinkWay:
    """Velocity of what holds or pins a chain, or else the chain's mean, m/s: in this frame of reference links do no work."""
    mass: cython.double = 0
    mean: LinkWay
    mean.x = mean.y = 0
    for r in range(first, end + 1):
        i: cython.Py_ssize_t = k.node[k.first[r]] if r < end else k.node[k.first[end - 1] + 1]
        c: cython.Py_ssize_t = k.held[i]
        if c >= 0:
            mean.x, mean.y = k.contact[row_of(c) + SPEED], k.contact[row_of(c) + SPEED_Y]
            return mean
        if k.weight[i] == 0:
            mean.x, mean.y = k.u[2 * i], k.u[2 * i + 1]
            return mean
        mean.x += k.u[2 * i] / k.weight[i]
        mean.y += k.u[2 * i + 1] / k.weight[i]
        mass += 1 / k.weight[i]
    mean.x /= mass
    mean.y /= mass
    return mean


@kernel
def chain_motion(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, seen: LinkWay, least: cython.double
) -> ChainMotion:  # fmt: skip
    """Twice the energies of a chain in that frame of reference, plus `least` m/s for each link."""
    found: ChainMotion
    found.within = found.whole = 0
    j: cython.Py_ssize_t = k.node[k.first[first]]
    for r in range(first, end + 1):
        i: cython.Py_ssize_t = j
        x: cython.double = k.u[2 * i] - seen.x
        y: cython.double = k.u[2 * i + 1] - seen.y
        if k.weight[i] > 0:
            found.whole += (x * x + y * y) / k.weight[i]
        if r < end:
            j = k.node[k.first[r] + 1]
            x, y = k.u[2 * j] - k.u[2 * i], k.u[2 * j + 1] - k.u[2 * i + 1]
            if k.stiffness[r] < INFINITY:
                found.within = INFINITY
            elif k.weight[i] + k.weight[j] > 0:
                found.within += (x * x + y * y + least * least) / (k.weight[i] + k.weight[j])
    return found


@inlined
def is_settled(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, seen: LinkWay, before: ChainMotion
) -> cython.bint:  # fmt: skip
    """Whether a solved chain has gained no more energy than links that do no work allow."""
    after: ChainMotion = chain_motion(k, first, end, seen, 0)
    return after.whole - before.whole <= STIRRED * before.within


@kernel
def sweep_link(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Correct the length of row r after the drift, along its direction then: position-based dynamics, which is always stable."""
    e: cython.Py_ssize_t = k.first[r]
    if k.intact[r] == 0 or k.soft[r] == INFINITY:
        return
    p: LinkWay = way_between(k, k.node[e], k.node[e + 1], k.h)
    length: cython.double = sqrt(p.x * p.x + p.y * p.y)
    if length == 0:
        return
    let_go_of_wedged(k, k.node[e], k.node[e + 1], p.x / length, p.y / length)
    moves: cython.double = mobility_along(k, k.node[e], p.x, p.y, p.x, p.y) + mobility_along(k, k.node[e + 1], p.x, p.y, p.x, p.y)
    gives: cython.double = k.soft[r] + k.h * moves / (length * length)
    if gives <= 0:
        return
    before: cython.double = (k.given[2 * r] * p.x + k.given[2 * r + 1] * p.y) / length
    after: cython.double = before + (k.target[r] - k.soft[r] * before - length + k.rest[r]) / gives
    after = min(after, k.upper[r])
    k.impulse[r] = after
    give(k, r, (after - before) * p.x / length, (after - before) * p.y / length)


@kernel
def hold_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Stop the particles of a chain at surfaces."""
    k: cython.pointer(Links) = w.link_table
    if not k.surfaces or first == end:
        return
    hold_node(w, k.node[k.first[first]])
    for r in range(first, end):
        hold_node(w, k.node[k.first[r] + 1])


@kernel
def is_held(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.bint:
    """Whether a surface holds a particle of a chain."""
    found: cython.bint = k.held[k.node[k.first[first]]] >= 0
    for r in range(first, end):
        found |= k.held[k.node[k.first[r] + 1]] >= 0
    return found


@kernel
def let_go_of_surfaces(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Release all particles of a chain from surfaces."""
    k.held[k.node[k.first[first]]] = -1
    for r in range(first, end):
        k.held[k.node[k.first[r] + 1]] = -1


@kernel
def set_friction(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, has_friction: cython.bint
) -> cython.void:
    """Set whether surfaces have friction on the particles of a chain."""
    k.has_friction[k.node[k.first[first]]] = has_friction
    for r in range(first, end):
        k.has_friction[k.node[k.first[r] + 1]] = has_friction


@kernel
def save_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Save the state of a chain before it is solved."""
    k: cython.pointer(Links) = w.link_table
    save_node(w, k.node[k.first[first]])
    for r in range(first, end):
        save_node(w, k.node[k.first[r] + 1])
        k.had[2 * r], k.had[2 * r + 1] = k.given[2 * r], k.given[2 * r + 1]


@kernel
def restore_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Restore the saved state; after Newton's method has diverged, numbers may be too large to be subtracted again."""
    k: cython.pointer(Links) = w.link_table
    restore_node(w, k.node[k.first[first]])
    for r in range(first, end):
        restore_node(w, k.node[k.first[r] + 1])
        k.given[2 * r], k.given[2 * r + 1] = k.had[2 * r], k.had[2 * r + 1]


@kernel
def start_anew(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Restore the state before the chain was solved, with all its impulses removed."""
    k: cython.pointer(Links) = w.link_table
    restore_chain(w, first, end)
    for r in range(first, end):
        give(k, r, -k.given[2 * r], -k.given[2 * r + 1])


@kernel
def sweep_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Sweep forward and backward from zero impulses: for light chains whose links turn over in a substep."""
    k: cython.pointer(Links) = w.link_table
    start_anew(w, first, end)
    for _ in range(LINK_SWEEPS):
        for r in range(first, end):
            sweep_link(k, r)
        for r in range(end - 1, first - 1, -1):
            sweep_link(k, r)
        hold_chain(w, first, end)


@kernel
def approach(
    w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t, good: cython.double, how: cython.int
) -> cython.double:
    """Newton's method until relative errors are `good`; returns the largest."""
    k: cython.pointer(Links) = w.link_table
    tries: cython.int = 0
    before: cython.double = INFINITY
    missed: cython.double = INFINITY
    share: cython.double = 1
    while tries < MOST_STEPS and not missed <= good:
        tries += 1
        before = missed
        step_chain(k, first, end, True, how, share)
        hold_chain(w, first, end)
        missed = misses(k, first, end)
        share = max(0.5 * share, LEAST_SHARE) if not missed < before else min(1.5 * share, 1.0)
    return missed


@kernel
def pass_through(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Give a chain without room between surfaces its lengths all the same: if both were rigid, forces would be unbounded.

    Surfaces push its particles out afterwards, on the nearer side.
    """
    k: cython.pointer(Links) = w.link_table
    tries: cython.int = 0
    if misses(k, first, end) < NO_SPACE:
        return
    start_anew(w, first, end)
    let_go_of_surfaces(k, first, end)
    while tries < MOST_STEPS and not misses(k, first, end) < LOST:
        tries += 1
        step_chain(k, first, end, True, LOST_WAY, 1)


@kernel
def step_in_net(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """One Newton step for a chain of a net.

    A stretched chain between two particles held by friction has almost no mobility, and would be thrown. If a step makes errors
    much larger, friction is kept constant, and if that does not help, the chain is swept.
    """
    k: cython.pointer(Links) = w.link_table
    most: cython.double = max(WORSE * misses(k, first, end), LOST)
    save_chain(w, first, end)
    held: cython.bint = is_held(k, first, end)
    step_chain(k, first, end, True, CHORDS, 1)
    hold_chain(w, first, end)
    if not misses(k, first, end) < most and k.rough and k.surfaces:
        restore_chain(w, first, end)
        set_friction(k, first, end, False)
        step_chain(k, first, end, True, CHORDS, 1)
        hold_chain(w, first, end)
        set_friction(k, first, end, True)
    if not misses(k, first, end) < most:
        sweep_chain(w, first, end)
    if held:
        pass_through(w, first, end)


@kernel
def relax_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """After the drift: stop length changes. If surfaces leave almost no mobility and the chain is thrown, they are released."""
    k: cython.pointer(Links) = w.link_table
    if not is_held(k, first, end):
        step_chain(k, first, end, False, CHORDS, 1)
        return
    save_chain(w, first, end)
    seen: LinkWay = seen_from(k, first, end)
    before: ChainMotion = chain_motion(k, first, end, seen, k.least)
    step_chain(k, first, end, False, CHORDS, 1)
    if is_settled(k, first, end, seen, before):
        return
    for r in range(first, end):
        if k.acts[r]:
            k.impulse[r] -= k.answer[2 * r] * k.along[2 * r] + k.answer[2 * r + 1] * k.along[2 * r + 1]
    restore_chain(w, first, end)
    let_go_of_surfaces(k, first, end)
    step_chain(k, first, end, False, CHORDS, 1)


@kernel
def solve_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t, alone: cython.bint) -> cython.void:
    """Solve lengths after the drift. alone: no other block joins these particles; in nets more than one step would be undone.

    Where Newton's method fails because of friction, friction is kept constant at first.
    """
    k: cython.pointer(Links) = w.link_table
    if not alone:
        step_in_net(w, first, end)
        return
    if misses(k, first, end) <= LENGTH_SOLVED:  # already solved
        return
    save_chain(w, first, end)
    held: cython.bint = is_held(k, first, end)
    seen: LinkWay = seen_from(k, first, end)
    before: ChainMotion = chain_motion(k, first, end, seen, k.least)
    if approach(w, first, end, LENGTH_SOLVED, WAVES) <= LENGTH_SOLVED and is_settled(k, first, end, seen, before):
        return
    if k.rough and k.surfaces:
        restore_chain(w, first, end)
        set_friction(k, first, end, False)
        approach(w, first, end, LENGTH_SOLVED, WAVES)
    if not (misses(k, first, end) < LOST and is_settled(k, first, end, seen, before)):
        start_anew(w, first, end)
        if not (approach(w, first, end, NEAR_ENOUGH, LOST_WAY) < LOST and is_settled(k, first, end, seen, before)):
            sweep_chain(w, first, end)
            swept: cython.double = misses(k, first, end)
            if swept > NEAR_ENOUGH and not approach(w, first, end, NEAR_ENOUGH, LOST_WAY) < swept:
                sweep_chain(w, first, end)
        if held:
            pass_through(w, first, end)
    set_friction(k, first, end, True)
