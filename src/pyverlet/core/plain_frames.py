# mypy: ignore-errors
"""Whole frames of worlds in which only motion changes: from the user's arrays and back, without running Python code."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t, uint32_t
from cython.cimports.team import team_clock, team_run, team_spent

from pyverlet.core.contact_recording import begin_records
from pyverlet.core.frame_ends import all_finite
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.rest_timers import longer_at_rest
from pyverlet.core.rows import MovingRows, put_rows, take_rows
from pyverlet.core.running import run_substeps
from pyverlet.core.spans import INTEGRATE, LISTS, NOTES, OTHER
from pyverlet.core.step import Step
from pyverlet.core.total_energy import block_energy

GATHER = cython.declare(cython.int, 8)
FINISH = cython.declare(cython.int, 9)
SCATTER = cython.declare(cython.int, 10)
FRAMES = cython.declare(cython.int, 11)
"""Columns for the times of plain frames, after those of `core.spans`: s, and the number of frames."""

MADE = cython.declare(cython.int, 0)
OTHERS = cython.declare(cython.int, 1)
"""The user has changed something: nothing has been done."""
SHORT = cython.declare(cython.int, 2)
"""Arrays are too small for a list: enlarge them and continue the frame."""
DOUBTFUL = cython.declare(cython.int, 3)
"""Python ends the frame: a number may not be finite, there is too much energy, particles may fall asleep, or a sleeper is touched
in a coming substep, before which the others have been made."""

RELEASED_FROM = cython.declare(cython.Py_ssize_t, 256)
"""Particles from which on the GIL is released: smaller frames end before another thread could begin."""

PLACED = cython.declare(cython.double, 0.1)
"""Fraction of the allowed energy gain: if a frame gains more, and the user has moved particles, these may have to separate."""

NUMBERS = cython.declare(cython.int, 6)  # columns of numbers that users set, and of marks
MARKED = cython.declare(cython.int, 4)

Plain = cython.struct(
    w=cython.pointer(Step),
    taken=cython.pointer(MovingRows),  # the user's rows to rows
    put=cython.pointer(MovingRows),  # rows to the user's rows
    radius=cython.pointer[cython.const[real]],  # the user's columns
    mass=cython.pointer[cython.const[real]],
    sorted_mass=cython.pointer[cython.const[real]],
    restitution=cython.pointer[cython.const[real]],
    friction=cython.pointer[cython.const[real]],
    rolling=cython.pointer[cython.const[real]],
    inertia=cython.pointer[cython.const[real]],
    category=cython.pointer[cython.const[uint32_t]],
    mask=cython.pointer[cython.const[uint32_t]],
    material=cython.pointer[cython.const[uint32_t]],
    fixed_rotation=cython.pointer[cython.const[uint32_t]],
    known=cython.pointer(real),  # (NUMBERS, count) their previous values
    marks=cython.pointer(uint32_t),  # (MARKED, count)
    given=cython.pointer(real),  # (count, 3) contact impulses before this frame
    substeps=cython.int,
    gx=cython.double,
    gy=cython.double,
    most=cython.double,  # J that a frame may gain; infinite: no limit
    placed=cython.bint,  # whether the user has moved a particle before this frame
    energy=cython.double,  # J at its start
    limited=cython.bint,
    precise=real,  # m: at larger coordinates resting particles may tremble
    far=cython.bint,  # whether any particle is beyond
    sleepers=cython.bint,  # whether anyone sleeps
    asleep=cython.bint,  # whether nothing moves: all particles are pinned or asleep
    timers=cython.p_float,  # (count,) s at rest
    free=cython.pointer[cython.const[int64_t]],  # (timed,) rows of particles with a timer; none unless particles may sleep
    timed=cython.Py_ssize_t,
    rest=cython.double,  # see `core.rest_timers`
    dt=cython.double,
    after=cython.double,  # s at rest after which a particle may fall asleep
    left=cython.int,  # frames still to be made
    made=cython.int,  # frames not yet reported to the world
    status=cython.int,
    since=cython.double,
    last=cython.p_double,  # (columns,) of the last frame
    total=cython.p_double,  # of all frames
)


@inlined
def charge(p: cython.pointer(Plain), column: cython.int) -> cython.void:
    """Charge the time since the last call to a column."""
    now: cython.double = team_clock()
    p.last[column] = p.last[column] + (now - p.since)
    p.since = now


@inlined
def numbers_differ(
    now: cython.pointer[cython.const[real]], known: cython.pointer(real), at: cython.Py_ssize_t, count: cython.Py_ssize_t
) -> cython.bint:
    """Whether a column differs from its known values from `at` on."""
    differ: cython.int = 0
    for k in range(count):
        differ |= now[k] != known[at + k]
    return differ != 0


@inlined
def marks_differ(
    now: cython.pointer[cython.const[uint32_t]], known: cython.pointer(uint32_t), at: cython.Py_ssize_t, count: cython.Py_ssize_t
) -> cython.bint:
    """`numbers_differ` for marks."""
    differ: uint32_t = 0
    for k in range(count):
        differ |= now[k] ^ known[at + k]
    return differ != 0


@kernel
def was_set(p: cython.pointer(Plain)) -> cython.bint:
    """Whether the user has set anything but motion."""
    n: cython.Py_ssize_t = p.taken.count  # while all sleep the engine may have no particles
    return (
        numbers_differ(p.radius, p.known, 0, n)
        or numbers_differ(p.mass, p.known, n, n)
        or numbers_differ(p.restitution, p.known, 2 * n, n)
        or numbers_differ(p.friction, p.known, 3 * n, n)
        or numbers_differ(p.rolling, p.known, 4 * n, n)
        or numbers_differ(p.inertia, p.known, 5 * n, n)
        or marks_differ(p.category, p.marks, 0, n)
        or marks_differ(p.mask, p.marks, n, n)
        or marks_differ(p.material, p.marks, 2 * n, n)
        or marks_differ(p.fixed_rotation, p.marks, 3 * n, n)
    )


@kernel
def was_moved(p: cython.pointer(Plain)) -> cython.bint:
    """Whether the user has set a position, velocity or spin of a sleeper or of a pinned particle."""
    m: cython.pointer(MovingRows) = p.taken
    moved: cython.bint = False
    for k in range(m.count):
        if not p.asleep and p.w.inverse_mass[k] > 0:
            continue
        i: cython.Py_ssize_t = m.order[k]
        moved |= m.x[2 * k] != m.x_from[2 * i] or m.x[2 * k + 1] != m.x_from[2 * i + 1]
        moved |= m.v[2 * k] != m.v_from[2 * i] or m.v[2 * k + 1] != m.v_from[2 * i + 1] or m.s[k] != m.s_from[i]
    return moved


@kernel
def stays_awake(p: cython.pointer(Plain)) -> cython.bint:
    """Add a frame to the timers of particles at rest. False, and nothing is changed, if any may fall asleep."""
    w: cython.pointer(Step) = p.w
    for store in range(2):
        for k in range(p.timed):
            i: cython.Py_ssize_t = p.free[k]
            longer: cython.float = longer_at_rest(
                w.velocity, w.spin, w.radius, i, cython.cast(real, p.rest), cython.cast(cython.float, p.dt), p.timers[i]
            )
            if store:
                p.timers[i] = longer
            elif longer >= cython.cast(cython.float, p.after):
                return False
    return True


@kernel
def begin_plain(p: cython.pointer(Plain)) -> cython.void:
    """Gather, and save what a refused frame goes back to."""
    w: cython.pointer(Step) = p.w
    m: cython.pointer(MovingRows) = p.taken
    take_rows(m, 0)
    charge(p, GATHER)
    p.placed = False
    for k in range(w.count):
        p.placed |= m.placed[k] != 0
        p.given[3 * k], p.given[3 * k + 1], p.given[3 * k + 2] = w.given[2 * k], w.given[2 * k + 1], w.given_spin[k]
    if p.limited:
        p.energy = block_energy(m.x_from, m.v_from, m.v_from, 0.0, m.s_from, p.radius, p.mass, p.gx, p.gy, 0, w.count)
    w.still_known = False
    if w.records_contacts:
        begin_records(w)
    w.first, w.substep, w.substeps = 0, 0, p.substeps
    charge(p, INTEGRATE)


@kernel
def charge_contacts(p: cython.pointer(Plain)) -> cython.void:
    """Charge the time of substeps, by stage if it is known."""
    k: cython.int
    spent: cython.double = 0
    charge(p, OTHER)
    for k in range(LISTS, NOTES + 1 if p.w.team.timed else 0):
        team_spent(p.w.team, k, cython.address(spent))
        p.last[k] = p.last[k] + spent
        p.last[OTHER] = p.last[OTHER] - spent


@kernel
def end_plain(p: cython.pointer(Plain)) -> cython.int:
    """After substeps: scatter the results, if they are good."""
    w: cython.pointer(Step) = p.w
    charge_contacts(p)
    if w.substep < w.substeps:  # an awake particle touches a sleeper
        return DOUBTFUL
    good: cython.bint = all_finite(w)
    if good and p.limited:
        now: cython.double = block_energy(
            w.position, w.velocity, w.velocity, 0.0, w.spin, w.radius, p.sorted_mass, p.gx, p.gy, 0, w.count
        )
        good = not (now - p.energy > p.most * (PLACED if p.placed else 1))
    good = good and stays_awake(p)
    charge(p, FINISH)
    if not good:
        return DOUBTFUL
    put_rows(p.put, 0)
    find_far(p)
    end_times(p)
    return MADE


@kernel
def find_far(p: cython.pointer(Plain)) -> cython.void:
    """Determine whether any particle is far from the origin."""
    p.far = False
    for k in range(2 * p.taken.count):
        p.far |= p.taken.x[k] > p.precise or p.taken.x[k] < -p.precise


@kernel
def end_times(p: cython.pointer(Plain)) -> cython.void:
    """Complete a frame's times."""
    k: cython.int
    charge(p, SCATTER)
    p.left -= 1
    p.made += 1
    p.last[FRAMES] = 1
    for k in range(FRAMES + 1):
        p.total[k] = p.total[k] + p.last[k]


@kernel
def run_plain(p: cython.pointer(Plain)) -> cython.void:
    """Make the remaining frames, as long as they are plain and no particle is far; or continue one after arrays were enlarged."""
    k: cython.int
    while p.left > 0:
        if p.status != SHORT:
            p.since = team_clock()
            for k in range(FRAMES + 1):
                p.last[k] = 0
            if was_set(p) or (p.sleepers and was_moved(p)):
                p.status = OTHERS
                return
            if p.asleep:
                end_times(p)
                continue
            begin_plain(p)
        team_run(p.w.team, run_substeps, p.w, 1)
        p.status = SHORT if p.w.lists.short else end_plain(p)
        if p.status != MADE or p.far:
            return
