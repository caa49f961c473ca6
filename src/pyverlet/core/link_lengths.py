# mypy: ignore-errors
"""Chains of distances: Newton's method until lengths are right; where it fails, sweeps link by link."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_chains import CHORDS, LOST_WAY, WAVES, give, step_chain
from pyverlet.core.link_holds import hold_node, let_go_of_wedged, mobility_along, restore_node, save_node
from pyverlet.core.link_shapes import LinkWay, way_between
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import CONTACT, SPEED

MOST_STEPS = cython.declare(cython.int, 40)
LENGTH_SOLVED = cython.declare(cython.double, 1e-9)
NEAR_ENOUGH = cython.declare(cython.double, 1e-3)
"""Of lengths: errors that are left, and where Newton's method has failed."""

LOST = cython.declare(cython.double, 0.01)
"""Of lengths: with a larger error Newton's method has failed."""

WORSE = cython.declare(cython.double, 2)
"""Times the error before: a step of a chain in a net that leaves more has failed."""

LEAST_SHARE = cython.declare(cython.double, 0.1)
"""Of a step of Newton's method that is made where steps have gone too far."""

STIRRED = cython.declare(cython.double, 0.5)
"""Times the motion within a chain: if solving it adds more energy, lengths are right, and the answer is not. Links do no work."""

NO_SPACE = cython.declare(cython.double, 0.1)
"""Of lengths: with a larger error there is no room between the surfaces that hold a chain, and they let go of it."""

LINK_SWEEPS = cython.declare(cython.int, 10)


ChainMotion = cython.struct(
    within=cython.double,  # of the ends of its links against each other, infinite where there are springs, which do work
    whole=cython.double,  # of all its particles
)
"""Twice the energy of a chain, J."""


@kernel
def misses(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.double:
    """The largest error that rows of a chain are left with, of their lengths."""
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
    """The velocity of what holds or pins a chain, or else the mean of the chain, m/s: as seen from there, links do no work."""
    mass: cython.double = 0
    mean: LinkWay
    mean.x = mean.y = 0
    for r in range(first, end + 1):
        i: cython.Py_ssize_t = k.node[k.first[r]] if r < end else k.node[k.first[end - 1] + 1]
        c: cython.Py_ssize_t = k.held[i]
        if c >= 0:
            mean.x, mean.y = k.contact[CONTACT * c + SPEED], k.contact[CONTACT * c + SPEED + 1]
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
    """How a chain moves as seen from there, and in addition `least` m/s of each link."""
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
    """Whether a chain, solved, moves no faster than links can make it that do no work."""
    after: ChainMotion = chain_motion(k, first, end, seen, 0)
    return after.whole - before.whole <= STIRRED * before.within


@kernel
def sweep_link(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Right the length of row r after the drift, along its direction then: position-based dynamics, which is always stable."""
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
    """Surfaces hold the particles of a chain."""
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
    """No surface holds a particle of a chain."""
    k.held[k.node[k.first[first]]] = -1
    for r in range(first, end):
        k.held[k.node[k.first[r] + 1]] = -1


@kernel
def set_friction(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, has_friction: cython.bint
) -> cython.void:
    """Whether surfaces act on the particles of a chain by friction."""
    k.has_friction[k.node[k.first[first]]] = has_friction
    for r in range(first, end):
        k.has_friction[k.node[k.first[r] + 1]] = has_friction


@kernel
def save_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Before a chain is solved."""
    k: cython.pointer(Links) = w.link_table
    save_node(w, k.node[k.first[first]])
    for r in range(first, end):
        save_node(w, k.node[k.first[r] + 1])
        k.had[2 * r], k.had[2 * r + 1] = k.given[2 * r], k.given[2 * r + 1]


@kernel
def restore_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Back to that: where Newton's method has failed, numbers may be too large to be taken back one by one."""
    k: cython.pointer(Links) = w.link_table
    restore_node(w, k.node[k.first[first]])
    for r in range(first, end):
        restore_node(w, k.node[k.first[r] + 1])
        k.given[2 * r], k.given[2 * r + 1] = k.had[2 * r], k.had[2 * r + 1]


@kernel
def start_anew(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """Back to before the chain was solved, with nothing given."""
    k: cython.pointer(Links) = w.link_table
    restore_chain(w, first, end)
    for r in range(first, end):
        give(k, r, -k.given[2 * r], -k.given[2 * r + 1])


@kernel
def sweep_chain(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.void:
    """There and back, from nothing: of a light chain that is jerked or pushed together, whose links turn over in a substep."""
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
    """Newton's method, until errors are `good`; returns the largest, of lengths."""
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
    """A chain that has no room between surfaces has its lengths all the same: rigid both, they would press without limit.

    Surfaces push out what is in them afterwards, on the side that is nearer.
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
    """One step of Newton's method for a chain of a net.

    A stretched chain between two particles that friction grips leaves almost no motion: it would be thrown across. If a step
    makes errors much larger, friction is taken as given, and if that does not help, it is swept.
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
    """After the drift: lengths change no more. Surfaces may leave a chain almost no motion: if it is thrown, they follow it."""
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
    """Lengths after the drift. alone: nothing else joins these particles; in nets others undo what is more than one step.

    Where Newton's method fails because of friction, this is taken as given, and follows.
    """
    k: cython.pointer(Links) = w.link_table
    if not alone:
        step_in_net(w, first, end)
        return
    if misses(k, first, end) <= LENGTH_SOLVED:  # as it has been solved before
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
