# mypy: ignore-errors
"""Impacts on linked particles act on everything that rigid links join to them: afterwards the normal velocity is -e times before.

A single impact gives (1 + e) v_n over the inverse mass of its two particles alone. Links then pass it on (`core.link_impacts`),
which left an elastic dumb-bell with half its energy. So the missing impulse is applied and passed on again, until the velocity
is right. The law holds for velocities that links allow: v_n excludes what links will remove from it along themselves, because
velocities in the middle of a substep contain half of a substep's link forces.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.team import team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.event_recording import record_more
from pyverlet.core.impacts import PairMotion, pair_motion, strike
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_impacts import (
    begin_impact_rows,
    end_former_rows,
    end_impact_rows,
    forget_impacts,
    keep_impacts,
    point_rows,
    put_former,
    put_impacts,
    share_field,
    spread_chunk,
    take_former,
    take_impacts,
    take_kept_impacts,
    take_times,
)
from pyverlet.core.links import blocks_of, each_colour
from pyverlet.core.pair_groups import each_group
from pyverlet.core.rebounds import (
    FIRST_LACK,
    GOOD,
    IMPACT,
    IMPACT_WAY,
    LACK_LESS,
    MEASURE_GAIN,
    REBOUND,
    STAMP,
    STRIKE_MORE,
    STRUCK_AT,
    UNDO_ALL,
    WAY_OUT,
    advance_row,
    node_of,
    take_aim,
)
from pyverlet.core.step import Step
from pyverlet.core.surfaces import add_surface_impulse

MOST_STRIKES = cython.declare(cython.int, 16)
MOST_STEP = cython.declare(cython.double, 32)
WORST = cython.declare(cython.double, 2)
"""Largest step factor. If a step leaves WORST times the least error so far, all steps are undone: no such impulse exists.

Sweeps over nets of unequal masses, or over ropes, are not quite linear, and steps may grow without bound."""

NET_SWEEPS = cython.declare(cython.int, 16)
"""Sweeps over the links of nets for each strike; chains without other links need one."""


@inlined
def speed_out(
    w: cython.pointer(Step), i: cython.Py_ssize_t, row: cython.pointer(cython.double), at: cython.Py_ssize_t
) -> cython.double:
    """Velocity of particle i along the outward normal of a row."""
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    return v[width * i] * row[at + WAY_OUT] + v[width * i + 1] * row[at + WAY_OUT + 1]


@inlined
def taken_along(
    w: cython.pointer(Step), i: cython.Py_ssize_t, row: cython.pointer(cython.double), at: cython.Py_ssize_t
) -> cython.double:
    """The part of particle i's velocity before impacts that links remove, along the normal of a row."""
    if node_of(w, i) < 0:
        return 0.0
    return w.impact[IMPACT * i + 2] * row[at + WAY_OUT] + w.impact[IMPACT * i + 3] * row[at + WAY_OUT + 1]


@inlined
def warm_along(
    w: cython.pointer(Step), i: cython.Py_ssize_t, row: cython.pointer(cython.double), at: cython.Py_ssize_t
) -> cython.double:
    """Change of velocity at the time of impact by the impulses of links in the last substep, applied as an acceleration."""
    k: cython.pointer(Links) = w.link_table
    n: cython.Py_ssize_t = node_of(w, i)
    if n < 0 or k.own[n] == 0 or not k.warm:
        return 0.0
    x: cython.double = w.acceleration[2 * i] - k.driven[2 * n]
    y: cython.double = w.acceleration[2 * i + 1] - k.driven[2 * n + 1]
    return (x * row[at + WAY_OUT] + y * row[at + WAY_OUT + 1]) * (row[at + STRUCK_AT] - 0.5 * k.h)


@inlined
def struck_at(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.double:
    """Time of the impact that linked particle i takes part in; 0: none."""
    n: cython.Py_ssize_t = node_of(w, i)
    return w.link_table.struck[n] if n >= 0 else 0.0


@kernel
def spread_pairs(what: cython.p_void, item: cython.int) -> cython.void:
    """Give both particles of a pair the later of their impact times."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    n: cython.Py_ssize_t
    for n in range(w.begin[s], w.begin[s] + w.rebounding[s]):
        i: cython.Py_ssize_t = w.i[w.rebound_pair[n]]
        j: cython.Py_ssize_t = w.j[w.rebound_pair[n]]
        t: cython.double = max(struck_at(w, i), struck_at(w, j))
        if node_of(w, i) >= 0:
            w.link_table.struck[node_of(w, i)] = t
        if node_of(w, j) >= 0:
            w.link_table.struck[node_of(w, j)] = t


@kernel
def aim_surfaces(what: cython.p_void, block: cython.int) -> cython.void:
    """Set the target velocities at which linked particles of a block leave surfaces."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.Py_ssize_t
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        i: cython.Py_ssize_t = w.at_surface[n]
        for c in range(w.contact_begin[i], w.contact_end[i] if node_of(w, i) >= 0 else w.contact_begin[i]):
            row: cython.pointer(cython.double) = w.surface_rebound
            at: cython.Py_ssize_t = REBOUND * c
            if row[at + STAMP] == w.stamp:
                taken: cython.double = taken_along(w, i, row, at)
                take_aim(row, at, speed_out(w, i, row, at), taken, warm_along(w, i, row, at), w.link_table.warm)
                row[at + STRUCK_AT] = w.link_table.struck[node_of(w, i)]
                row[at + IMPACT_WAY], row[at + IMPACT_WAY + 1] = row[at + WAY_OUT], row[at + WAY_OUT + 1]


@kernel
def aim_pairs(what: cython.p_void, item: cython.int) -> cython.void:
    """Set the target velocities at which the pairs of a group separate."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    n: cython.Py_ssize_t
    for n in range(w.begin[s], w.begin[s] + w.rebounding[s]):
        k: cython.Py_ssize_t = w.rebound_pair[n]
        i: cython.Py_ssize_t = w.i[k]
        j: cython.Py_ssize_t = w.j[k]
        row: cython.pointer(cython.double) = w.pair_rebound
        at: cython.Py_ssize_t = REBOUND * k
        speed: cython.double = speed_out(w, j, row, at) - speed_out(w, i, row, at)
        taken: cython.double = taken_along(w, j, row, at) - taken_along(w, i, row, at)
        take_aim(row, at, speed, taken, warm_along(w, j, row, at) - warm_along(w, i, row, at), w.link_table.warm)

        now: PairMotion = pair_motion(w, k)
        when: cython.double = max(struck_at(w, i), struck_at(w, j))
        x: cython.double = now.px + now.ux * when
        y: cython.double = now.py + now.uy * when
        distance: cython.double = sqrt(x * x + y * y)
        row[at + STRUCK_AT] = when
        row[at + IMPACT_WAY] = x / distance if distance > 0 else row[at + WAY_OUT]
        row[at + IMPACT_WAY + 1] = y / distance if distance > 0 else row[at + WAY_OUT + 1]


@kernel
def advance_surfaces(what: cython.p_void, block: cython.int) -> cython.void:
    """Advance the impacts of a block of particles on surfaces by the current task."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.Py_ssize_t
    part: cython.Py_ssize_t = w.groups + block
    w.rebound_sum[2 * part] = w.rebound_sum[2 * part + 1] = 0
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        i: cython.Py_ssize_t = w.at_surface[n]
        for c in range(w.contact_begin[i], w.contact_end[i] if node_of(w, i) >= 0 else w.contact_begin[i]):
            row: cython.pointer(cython.double) = w.surface_rebound
            at: cython.Py_ssize_t = REBOUND * c
            if row[at + STAMP] == w.stamp:
                more: cython.double = advance_row(w, row, at, speed_out(w, i, row, at), 1 / w.inverse_mass[i], part)
                if more != 0:
                    strike(w, i, more * row[at + IMPACT_WAY], more * row[at + IMPACT_WAY + 1], 0, row[at + STRUCK_AT])
                    add_surface_impulse(w, i, c, more, 0, -row[at + IMPACT_WAY], -row[at + IMPACT_WAY + 1], True)
                    record_more(w, c, more)


@kernel
def advance_pairs(what: cython.p_void, item: cython.int) -> cython.void:
    """Advance the impacts of the pairs of a group by the current task."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    n: cython.Py_ssize_t
    w.rebound_sum[2 * s] = w.rebound_sum[2 * s + 1] = 0
    for n in range(w.begin[s], w.begin[s] + w.rebounding[s]):
        k: cython.Py_ssize_t = w.rebound_pair[n]
        i: cython.Py_ssize_t = w.i[k]
        j: cython.Py_ssize_t = w.j[k]
        row: cython.pointer(cython.double) = w.pair_rebound
        at: cython.Py_ssize_t = REBOUND * k
        inverse: cython.double = w.inverse_mass[i]
        inverse += w.inverse_mass[j]
        more: cython.double = advance_row(w, row, at, speed_out(w, j, row, at) - speed_out(w, i, row, at), 1 / inverse, s)
        if more != 0:
            x: cython.double = more * row[at + IMPACT_WAY]
            y: cython.double = more * row[at + IMPACT_WAY + 1]
            part: cython.double = w.share[k * w.varied]
            if w.records_contacts:
                w.summed_x[k] += cython.cast(real, x)
                w.summed_y[k] += cython.cast(real, y)
                w.summed_virial[k] += cython.cast(real, more * w.reach[k * w.sized])
            if w.records_events:
                w.pressed[k] += cython.cast(real, more)
            strike(w, i, -x * part, -y * part, 0, row[at + STRUCK_AT])
            strike(w, j, x * (1 - part), y * (1 - part), 0, row[at + STRUCK_AT])


@kernel
def advance(w: cython.pointer(Step), blocks: cython.int, task: cython.int) -> cython.void:
    """Run one task of the solver over all impacts."""
    w.rebound_task = task
    team_stage(w.team, advance_surfaces, w, blocks)
    each_group(w, advance_pairs)


@kernel
def sum_of(w: cython.pointer(Step), blocks: cython.int, which: cython.int) -> cython.double:
    """One of the two sums of the last task, added in the same order for any number of threads."""
    total: cython.double = 0
    for p in range(w.groups + blocks):
        total += w.rebound_sum[2 * p + which]
    return total


@kernel
def hand_on(w: cython.pointer(Step), nodes: cython.int, sweeps: cython.int) -> cython.void:
    """Pass the velocity changes by impacts on through links."""
    team_stage(w.team, take_impacts, w, nodes)
    share_field(w, sweeps)
    team_stage(w.team, put_impacts, w, nodes)


@kernel
def strike_again(w: cython.pointer(Step), blocks: cython.int, nodes: cython.int, sweeps: cython.int) -> cython.void:
    """Apply the missing impulses by conjugate gradients on A x = b, where the symmetric A maps impulses to velocity changes.

    A step is applied, passed on and measured; its correction is applied together with the next step.
    """
    advance(w, blocks, FIRST_LACK)
    first: cython.double = sum_of(w, blocks, 0)
    good: cython.double = GOOD * GOOD * sum_of(w, blocks, 1)
    if first <= good:
        return
    least: cython.double = first
    team_stage(w.team, keep_impacts, w, nodes)
    w.rebound_step, w.rebound_turn = 1, 0
    for _ in range(MOST_STRIKES):
        advance(w, blocks, STRIKE_MORE)
        hand_on(w, nodes, sweeps)
        advance(w, blocks, MEASURE_GAIN)
        gained: cython.double = sum_of(w, blocks, 0)
        # Excludes rows that no impulse changes, such as two discs whose link lies along the normal.
        lacks: cython.double = sum_of(w, blocks, 1)
        w.rebound_step = lacks / gained if lacks < MOST_STEP * gained else 0.0
        advance(w, blocks, LACK_LESS)
        left: cython.double = sum_of(w, blocks, 0)
        if left <= good or w.rebound_step == 0:
            break
        if not left < WORST * least:
            advance(w, blocks, UNDO_ALL)
            team_stage(w.team, take_kept_impacts, w, nodes)
            team_stage(w.team, put_impacts, w, nodes)
            return
        least = min(least, left)
        w.rebound_turn = left / lacks
    if fabs(w.rebound_step - 1) > GOOD:
        w.rebound_turn = -1
        advance(w, blocks, STRIKE_MORE)
        hand_on(w, nodes, sweeps)


@inlined
def any_rebound(w: cython.pointer(Step), blocks: cython.int) -> cython.bint:
    """Whether any linked particle has had an impact."""
    found: cython.bint = False
    for b in range(blocks):
        found |= w.rebounds[b] != 0
    for b in range(w.groups):
        found |= w.rebounded[b] != 0
    return found


@kernel
def begin_impacts(w: cython.pointer(Step), blocks: cython.int) -> cython.void:
    """Discard the records of impacts."""
    w.stamp += 1
    for b in range(blocks):
        w.rebounds[b] = 0
    for b in range(w.groups):
        w.rebounded[b] = w.rebounding[b] = 0


@kernel
def share_impacts(w: cython.pointer(Step), blocks: cython.int) -> cython.void:
    """After impacts and before links are solved: distribute impacts over everything joined by links."""
    k: cython.pointer(Links) = w.link_table
    nodes: cython.int = blocks_of(k)
    chunks: cython.int = cython.cast(cython.int, k.colour[k.colours])
    sweeps: cython.int = 1 if k.loose else NET_SWEEPS
    n: cython.int
    if not any_rebound(w, blocks):
        return
    team_stage(w.team, begin_impact_rows, w, chunks)
    team_stage(w.team, take_times, w, nodes)
    for n in range(sweeps + 1):
        each_colour(w, spread_chunk, n % 2 == 1)
        each_group(w, spread_pairs)
    each_colour(w, spread_chunk, False)
    team_stage(w.team, point_rows, w, chunks)
    team_stage(w.team, take_former, w, nodes)
    share_field(w, sweeps)
    team_stage(w.team, put_former, w, nodes)
    team_stage(w.team, end_former_rows, w, chunks)
    team_stage(w.team, aim_surfaces, w, blocks)
    each_group(w, aim_pairs)
    hand_on(w, nodes, sweeps)
    strike_again(w, blocks, nodes, sweeps)
    team_stage(w.team, end_impact_rows, w, chunks)
    team_stage(w.team, forget_impacts, w, nodes)
    begin_impacts(w, blocks)
