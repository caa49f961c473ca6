# mypy: ignore-errors
"""A substep, stage by stage; the threads of the team share the items of each stage.

Stages of a substep of length h:
 1. kick: velocities gain the acceleration; surfaces (walls and obstacles) repeat their impulses of the last substep.
 2. warm start: so do contacts, along current normals. With links, particles that would become much faster give part back.
 3. surfaces: fast particles bounce, others are held.
 4. contacts: one sweep over the pairs, with springs; fast pairs bounce in closed form.
 5. drift: surfaces once more, then x += v h. With links: impacts are passed on, then surfaces, links, and all that again; in
    motion without the springs.
 6. relax: sweeps without the springs, along the normals after the drift.
 7. remember the impulses of contacts.

Velocities within a frame are those of the middle of a substep (Stormer and Verlet). With v, a and c the velocity, the
acceleration by forces and that by contacts at the start of a frame, its first substep begins from v + a h / 2 - c h' / 2, h'
being the substep before, and contacts give c (h + h') / 2; at the end v + (a + c) h / 2 is the velocity of the final positions.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.team import team_enter, team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.contact_recording import pair_records_stage
from pyverlet.core.contacts import bounce_again, hold_contacts, solve_contacts
from pyverlet.core.event_recording import record_loads, record_surface_loads
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_motors import add_motor_work, keep_motor_spin
from pyverlet.core.links import begin_links, end_links, limit_warm_links, remember_motors_stage, solve_links
from pyverlet.core.obstacles import place_moving
from pyverlet.core.pair_groups import busy_group, each_busy
from pyverlet.core.particle_stages import drift, kick_stage, moves_stage, remember_stage
from pyverlet.core.relaxation import energy_before, relax
from pyverlet.core.sensors import sense
from pyverlet.core.shared_impacts import begin_impacts, share_impacts
from pyverlet.core.spans import INTEGRATE, LINKS, NOTES, PAIRS, SURFACES
from pyverlet.core.step import NEAR, OPEN, Step
from pyverlet.core.surface_batches import TASK_HOLD, TASK_RELAX, TASK_WARM, solve_surfaces
from pyverlet.core.surface_contacts import forget_jam
from pyverlet.core.surface_sides import keep_in_sight, keep_inside, keep_sides
from pyverlet.core.warm_start import warm_start
from pyverlet.core.work import add_drift_work, add_end_work, add_friction_work, add_grip_work, add_start_work

ROUNDS = cython.declare(cython.int, 2)
ROUGH_ROUNDS = cython.declare(cython.int, 4)
"""Rounds over contacts and links if all is at rest, as friction converges more slowly. In motion, contacts after the first round
do not separate overlaps, as links would pass that on."""

TURNING = cython.declare(real, 3e-4)
"""Seconds: pairs whose relative motion in a substep exceeds that in this time at the speed of separation turn their normals. That
is a four hundredth of a mean radius."""

SMALL_OUT = cython.declare(cython.double, 1e-4)
LINKED_OUT = cython.declare(cython.double, 0.5)
"""Radii by which particles at obstacles, or pulled by links, may be outside the room after a substep."""

MOST_ROUNDS = cython.declare(cython.int, 100)  # over the groups with impacts


@kernel
def warm_surfaces_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Warm start: repeat the impulses of surfaces on particles of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    solve_surfaces(w, w.awake[item], TASK_WARM)


@kernel
def hold_surfaces_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Hold particles of a block at surfaces after the warm start of contacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    n: cython.Py_ssize_t
    block: cython.int = w.awake[item]
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        forget_jam(w, w.at_surface[n])
    solve_surfaces(w, block, TASK_HOLD)


@kernel
def hold_on_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Hold particles of a block at surfaces again: contacts may have pushed them there."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    solve_surfaces(w, w.awake[item], TASK_HOLD)
    if w.solids > 0:
        keep_sides(w, w.awake[item])


@kernel
def drift_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Hold particles at surfaces again, then move a block of particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    n: cython.Py_ssize_t
    block: cython.int = w.awake[item]
    a: cython.Py_ssize_t = block * BLOCK
    if not w.linked:
        solve_surfaces(w, block, TASK_HOLD)
        if w.collides and not w.lists.brute:
            keep_in_sight(w, block)
        if w.solids > 0:
            keep_sides(w, block)
            for n in range(a, a + w.at_surface_count[block] if w.boundary != OPEN else a):
                keep_inside(w, w.at_surface[n], SMALL_OUT)
    elif w.boundary != OPEN:
        for n in range(a, min(a + BLOCK, w.count)):
            keep_inside(w, n, LINKED_OUT)
    if w.records_events and w.sensors > 0:
        sense(w, block)
    drift(w, a, min(a + BLOCK, w.count), block)
    if w.records_work:
        add_drift_work(w, block)
    if w.relaxes > 0:
        solve_surfaces(w, block, TASK_RELAX)


@kernel
def warm_start_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Warm start: repeat the impulses of the contacts of a group."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    warm_start(w, busy_group(w, item))


@kernel
def solve_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Solve the contacts of a group, and its impacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = busy_group(w, item)
    solve_contacts(w, s, phase_of(w, s))


@kernel
def bounce_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Resolve impacts of a group that impacts in others have caused."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = busy_group(w, item)
    bounce_again(w, s, 3 * w.turn + phase_of(w, s))


@inlined
def phase_of(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.int:
    """Phase in which a group is solved: 1 even groups, 2 odd ones, 3 the last, of particles without a cell."""
    return 3 if s == w.lists.rows else 1 + cython.cast(cython.int, s % 2)


@kernel
def bounce_on(w: cython.pointer(Step)) -> cython.void:
    """Repeat over all groups until there are no more impacts."""
    s: cython.Py_ssize_t
    again: cython.bint = True
    w.turn = 0
    while again and w.turn < MOST_ROUNDS:
        again = False
        for s in range(w.evens + w.odds + w.alone):
            again |= w.bounced[w.busy[s]] > 3 * w.turn
        w.turn += 1
        if again:
            each_busy(w, bounce_stage)


@kernel
def hold_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Keep the pairs of a group from approaching."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    hold_contacts(w, busy_group(w, item))


@kernel
def friction_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Book the friction work of a group's pairs."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    add_friction_work(w, busy_group(w, item))


@kernel
def loads_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Record which pairs of a group touch."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    record_loads(w, busy_group(w, item))


@kernel
def surface_loads_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Record which surfaces the particles of a block touch."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    block: cython.Py_ssize_t = w.awake[item]
    n: cython.Py_ssize_t
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        record_surface_loads(w, w.at_surface[n])


@kernel
def substep(w: cython.pointer(Step), blocks: cython.int) -> cython.bint:
    """Run one substep; returns whether the pair list may be invalid in the next one."""
    b: cython.Py_ssize_t
    turn: cython.int
    most: real = 0
    stale: cython.bint = False
    team_enter(w.team, INTEGRATE)
    team_stage(w.team, kick_stage, w, w.awake_count)
    if w.records_work:
        team_enter(w.team, NOTES)
        team_stage(w.team, add_start_work, w, w.awake_count)
    for b in range(blocks):
        most = max(most, w.fastest[b])
    fastest: real = cython.cast(real, sqrt(most))
    w.far = 2 * w.h * fastest + w.near + NEAR * cython.cast(real, w.lists.largest)
    w.least_bounce = fastest * cython.cast(real, 1e-14 if cython.sizeof(real) == 8 else 2e-6)
    if w.falls_free:
        w.least_bounce = max(w.rest_speed, w.least_bounce)
    surfaces: cython.bint = w.boundary != OPEN or w.solids > 0 or w.pins
    most_after: cython.double = energy_before(w, fastest)
    if w.linked:
        team_enter(w.team, LINKS)
        begin_links(w, surfaces)
        begin_impacts(w, blocks)
    team_enter(w.team, SURFACES)
    place_moving(w)
    if surfaces:
        team_stage(w.team, warm_surfaces_stage, w, w.awake_count)
    team_enter(w.team, PAIRS)
    each_busy(w, warm_start_stage)
    if w.linked:
        limit_warm_links(w)
    if surfaces:
        team_enter(w.team, SURFACES)
        team_stage(w.team, hold_surfaces_stage, w, w.awake_count)
    team_enter(w.team, PAIRS)
    each_busy(w, solve_stage)
    bounce_on(w)
    if w.linked:
        team_enter(w.team, LINKS)
        share_impacts(w, blocks)
        if surfaces:
            team_stage(w.team, hold_on_stage, w, w.awake_count)
        rests: cython.bint = fastest < min(w.rest_speed, w.push)
        rounds: cython.int = ROUGH_ROUNDS if rests and w.rough else ROUNDS
        for turn in range(rounds):
            if turn > 0:
                if rests:
                    each_busy(w, solve_stage)
                    bounce_on(w)
                else:
                    each_busy(w, hold_stage)
                if surfaces:
                    team_stage(w.team, hold_on_stage, w, w.awake_count)
            share_impacts(w, blocks)
            solve_links(w, turn > 0, turn + 1 == rounds)
    w.turned = False
    team_enter(w.team, INTEGRATE)
    team_stage(w.team, drift_stage, w, w.awake_count)
    w.turning = TURNING * w.push / w.h
    if w.relaxes > 0 and 2 * fastest > w.turning:
        w.turned = True
        team_stage(w.team, moves_stage, w, w.awake_count)
    relax(w, surfaces, most_after)
    if w.linked:
        team_enter(w.team, LINKS)
        end_links(w)
    team_enter(w.team, NOTES)
    if w.records_work and w.rough:
        each_busy(w, friction_stage)
        team_stage(w.team, add_grip_work, w, w.awake_count)
    if w.linked and w.link_table.motors:
        if w.records_work:
            add_motor_work(w)
        keep_motor_spin(w)
    if w.records_work:
        team_stage(w.team, add_end_work, w, w.awake_count)
    if w.records_contacts:
        each_busy(w, pair_records_stage)
    if w.records_events:
        each_busy(w, loads_stage)
        team_stage(w.team, surface_loads_stage, w, w.awake_count)
    team_enter(w.team, PAIRS)
    if w.rough or w.substep + 1 == w.substeps:  # without friction, only the last impulses are used
        team_stage(w.team, remember_stage, w, w.awake_count)
        if w.linked and w.link_table.motors:
            team_stage(w.team, remember_motors_stage, w, (w.link_table.count + BLOCK - 1) // BLOCK)
    for b in range(blocks):
        stale |= w.stale[b] != 0
    return stale
