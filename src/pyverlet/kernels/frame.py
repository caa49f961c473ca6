"""Substeps one after the other, without Python in between: what `World._frame` does stage by stage, as long as nothing is asked
of it.

A substep is left for Python when the list of pairs may no longer be good, and when it is the last. The names are those of the
stages in `world.profile`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.bundle import bundle
from pyverlet.compile.clock import note
from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange, variant
from pyverlet.compile.lanes import copy_row
from pyverlet.ground.constants import CARRIED_WEIGHT, REST_ACCELERATIONS
from pyverlet.kernels.balance import balance_pull
from pyverlet.kernels.bounds import box
from pyverlet.kernels.cage import confine as confine_in_cage
from pyverlet.kernels.cage import hold
from pyverlet.kernels.drive import drive, drive_called
from pyverlet.kernels.kinds import for_each_kind
from pyverlet.kernels.lending import (
    Terms,
    even_up,
    join,
    join_linked,
    lend,
    note_unpushed,
    settle,
    tell_weights,
)
from pyverlet.kernels.linked import (
    Linking,
    lay_down,
    lay_down_alone,
    look,
    look_alone,
    note_calm,
    note_calm_alone,
    note_pull,
    note_pull_alone,
    pick_up,
    pick_up_alone,
    solve,
    solve_alone,
)
from pyverlet.kernels.measure import mechanical
from pyverlet.kernels.meetings import collide
from pyverlet.kernels.motion import first_leap, leap
from pyverlet.kernels.sweeps import push, relax
from pyverlet.kernels.tables import Law

CONTACTS, BOUNDS, VELOCITIES, INTEGRATE, OBSTACLES, LEDGER, LINKS = map(np.int64, range(1, 8))
STAGES = ("contacts", "bounds", "velocities", "integrate", "obstacles", "ledger", "links")
"""Names of the numbers above, less one, by which their time is noted. They are no literals: see
`compile.jit.kernel`."""

OPEN, SMOOTH_CAGE, CAGE, FOUR_WALLS = range(4)
"""Rooms: without walls; round, without restitution and friction, around circles that have none either; round; a box."""

INTEGRATED, TOUCHED, JOINED, STILLED, PULLED = map(np.int64, range(5))
LOOKS = 5
"""At the energy in a substep: where a ledger looks. What leads there from the one before is a part of a substep."""

WHOLE = -1
"""All parts of it, in place of one of the numbers above."""

SERVED = LINKED = CALLS = False
"""Whether there may be more in a world than circles, a room and gravity: `Services`; links; functions of the user's own."""

BESIDE: dict[str, dict[str, Any]] = {
    "": {},
    "served": {"SERVED": True},
    "linked": {"SERVED": True, "LINKED": True},
    "few_linked": {
        "SERVED": True,
        "LINKED": True,
        "look": look_alone,
        "note_calm": note_calm_alone,
        "solve": solve_alone,
        "lay_down": lay_down_alone,
        "pick_up": pick_up_alone,
        "note_pull": note_pull_alone,
    },
}
BESIDE |= {f"{name}_called": {**what, "CALLS": True, "drive": drive_called} for name, what in BESIDE.items() if name}
"""Frames are compiled for each of these. Links so few that it does not pay stay on one thread where circles use several."""

_CHUNK = 4096


class Room(NamedTuple):
    """what: of the rooms above. Of a round one x0, y0 is the centre and x1 the radius, m; e and mu are those of the walls."""

    what: Any
    x0: Any
    y0: Any
    x1: Any
    y1: Any
    e: Any
    mu: Any


class Start(NamedTuple):
    """Where a call begins. looks, sets_out: as for `push`, in the first substep. opens: 1 if that is yet to be integrated.
    part: `WHOLE`, or the part of a substep that is all there is to do: what contacts do in it, not links, walls and obstacles.
    gx, gy: gravity, m/s^2.
    """

    looks: Any
    sets_out: Any
    opens: Any
    part: Any
    gx: Any
    gy: Any


@bundle
class Beside:
    """What there may be beside circles, a room and gravity, empty where it is not there: what `drive`, `meetings.collide`,
    `kernels.lending` (loans, hanging) and, where there are links, `kernels.linked` (linked, rows) take.
    """

    forces: Any
    course: Any
    loans: Any
    hanging: Any
    linked: Any
    rows: Any


class Services(NamedTuple):
    """Numbers that come with that.

    h, lag: s, in float64. down: gravity, m/s^2, in float64. period, ahead: what `drive` takes. cells, drop: what
    `meetings.collide` takes. terms, linking: what `kernels.lending`, and `kernels.linked`, take. began: when the frame did, s.
    energies: (substeps, LOOKS) J, becomes what `measure.mechanical` says after the integration of each substep, but of the one
    that is handed back, and of the first unless it opens; after its contacts, links and so on; without links at its end only.
    """

    h: Any
    lag: Any
    down: Any
    period: Any
    ahead: Any
    cells: Any
    drop: Any
    terms: Any
    linking: Any
    energies: Any
    began: Any


@kernel
def _felt(law, strongest, h, position):
    """The law of a substep in which nobody feels more than `strongest`, m/s^2; h: in float64."""
    g, real = np.float64(strongest), position.dtype.type
    carried = CARRIED_WEIGHT * g * h if g > 0 else np.inf
    return Law(
        law.varied, law.sized, law.mixed, law.rubs, law.listens, law.accounts, law.arrives, law.h, law.lag, law.feed, law.most,
        law.deep, real(REST_ACCELERATIONS * g * h), law.grazes, 1 if g > 0 else 0, real(carried),
    )  # fmt: skip


@parallel_kernel
def remember(start, position):
    """start = position: where a substep begins, for friction measures slip from there."""
    for c in prange((position.shape[0] + _CHUNK - 1) // _CHUNK):
        for i in range(c * _CHUNK, min((c + 1) * _CHUNK, position.shape[0])):  # not a slice: its checks take seconds to compile
            copy_row(start, i, position, i)


# ---- from here on `room` and `law` are named tuples, `circles` and `pairs` bundles ----------------------------------------


@driver
def confine(room, circles, law, claims):
    """What the walls do."""
    if room.what == OPEN:
        circles.resting[:] = 0
    elif room.what == SMOOTH_CAGE:
        hold(circles, room.x0, room.y0, room.x1, law.h, law.lag, law.rest_speed, 1 - law.arrives, law.feed, claims)
    elif room.what == CAGE:
        confine_in_cage(circles, room.x0, room.y0, room.x1, law.h, law.lag, room.e, room.mu, law.rest_speed)
    else:
        box(circles, room.x0, room.y0, room.x1, room.y1, law.h, law.lag, room.e, room.mu, law.rest_speed)


# ---- substeps --------------------------------------------------------------------------------------------------------------


@driver
def _look_at_energy(energies, substep, when, circles, mass, lag, down, spent, clock):
    """Note what there is, if anybody wants to know."""
    if energies.shape[0] > 0:
        energies[substep, when] = mechanical(
            circles.position, circles.velocity, circles.acceleration, lag, circles.spin, circles.radius, mass, down[0], down[1]
        )
        note(spent, LEDGER, clock[0], clock[1])


def _substeps(
    substep, stop, last, circles, pairs, law, room, beside, services, function, cut, start, checked, far, claims, spent, clock
):  # fmt: skip
    """From `start`, in `substep`, whose list of pairs is good, up to the end of substep `stop` - 1.

    last: the substep whose end is that of the frame. circles, pairs, law: `kernels.tables`. beside, services: `Beside` and
    `Services`, or nothing. function: what the user's functions of forces have become, by itself, for Numba is slow to tell the
    type of what holds one.
    start: `Start`. checked, far: as for `leap`. spent, clock: as for `note`, (address, tick).

    Returns the substep that is next, whether it has been integrated and the list of pairs needs a look, and if so under what
    largest acceleration, m/s^2.
    """
    law, room, start = Law(*law), Room(*room), Start(*start)
    strongest, begins = law.h - law.h, law.rubs != 0
    first, looks, sets_out, part, whole = substep, start.looks, start.sets_out, start.part, start.part == WHOLE
    if SERVED:
        services = Services(*services)
        forces, course, (period_x, period_y) = beside.forces, beside.course, services.period
        energies, lag, down = services.energies, services.lag, services.down
        meets, forced = course.segments.shape[0] > 0, forces.kind.shape[0] > 0
        loans, hanging, terms = beside.loans, beside.hanging, Terms(*services.terms)
        lends = loans.mass.shape[0] > 0
        begins = begins or meets
    if LINKED:
        linked, rows, linking = beside.linked, beside.rows, Linking(*services.linking)
    integrates = start.opens != 0
    if LINKED and integrates:
        look(linked, linking, circles.position, circles.velocity, circles.inverse_mass)
        note(spent, LINKS, clock[0], clock[1])
    while True:
        if integrates:
            if LINKED or CALLS or (SERVED and forced):  # what links have pulled is not felt again
                strongest, strayed = drive(
                    circles, forces, period_x, period_y, start.gx, start.gy, law.h, services.ahead, checked, far, function,
                    services.began + substep * services.h,
                )  # fmt: skip
                law = _felt(law, strongest, services.h, circles.position)
            elif start.opens != 0 and substep == first:
                strayed = first_leap(
                    circles.position, circles.velocity, circles.acceleration, circles.inverse_mass, start.gx, start.gy, law.h,
                    checked, far, circles.origin, circles.moved, claims,
                )  # fmt: skip
            else:
                strayed = leap(
                    circles.position, circles.velocity, circles.acceleration, law.h, checked, far, circles.origin, circles.moved,
                    claims,
                )  # fmt: skip
            note(spent, INTEGRATE, clock[0], clock[1])
            if strayed:
                return substep, True, strongest
            if SERVED:
                _look_at_energy(energies, substep, INTEGRATED, circles, forces.mass, lag, down, spent, clock)
        if whole or part == TOUCHED:
            if SERVED and lends:
                lend(circles, pairs, loans, terms, cut, law.rubs != 0)
                looks = 1  # with the inertia of the moment others overlap deeply
            if LINKED and circles.calm.shape[0] > 0:
                note_calm(linked, circles.calm, 1 if lends else 0)
            push(circles, pairs, law, cut, looks, sets_out, claims)
            if SERVED and lends:
                settle(circles, pairs, loans, hanging, terms, cut, claims)
            if LINKED and lends:
                tell_weights(linked.slot, linked.weight, loans.lighter)
            note(spent, CONTACTS, clock[0], clock[1])
        if LINKED and whole:
            _look_at_energy(energies, substep, TOUCHED, circles, forces.mass, lag, down, spent, clock)
            solve(linked, rows, linking, circles.position, circles.velocity)
            note(spent, LINKS, clock[0], clock[1])
            _look_at_energy(energies, substep, JOINED, circles, forces.mass, lag, down, spent, clock)
            lay_down(linked, linking, circles.velocity)
            note(spent, LINKS, clock[0], clock[1])
        if LINKED and lends and (whole or part == JOINED):
            note_unpushed(circles, loans)
        if whole:
            confine(room, circles, law, claims)
            note(spent, BOUNDS, clock[0], clock[1])
        if SERVED and meets and whole:
            until = substep * services.h + services.h
            collide(circles, course, until, *services.cells, law.h, law.lag, law.rest_speed, services.drop)
            note(spent, OBSTACLES, clock[0], clock[1])
        if whole or part == STILLED:
            if LINKED and lends:
                join_linked(circles, pairs, loans, hanging, linked.slot, linked.assembly, linked.tied, linked.tie_intact)
            elif SERVED and lends:
                join(circles, pairs, loans, hanging)
            relax(circles, pairs, law, cut, 1 if substep == last else 0, claims)
            if LINKED:
                pick_up(linked, circles.velocity)
            if SERVED and lends:
                even_up(circles, loans, hanging.group if LINKED else hanging.root, law.rubs)
            note(spent, VELOCITIES, clock[0], clock[1])
        if SERVED and whole:
            _look_at_energy(energies, substep, STILLED, circles, forces.mass, lag, down, spent, clock)
        if LINKED and whole:
            note_pull(linked, linking, circles.acceleration)
        if LINKED and lends and (whole or part == PULLED):
            balance_pull(circles, loans, hanging.group, linked.slot, linked.shift, 1.0 / services.h)
        if LINKED and whole:
            note(spent, LINKS, clock[0], clock[1])
            _look_at_energy(energies, substep, PULLED, circles, forces.mass, lag, down, spent, clock)
        substep += 1
        if substep == stop:
            return substep, False, strongest
        looks, sets_out, integrates = 0, 0, True
        if begins:
            remember(circles.start, circles.position)
        if LINKED:
            look(linked, linking, circles.position, circles.velocity, circles.inverse_mass)
            note(spent, LINKS, clock[0], clock[1])


frames = {
    beside: for_each_kind(driver, variant(_substeps, beside, **constants), push=push, relax=relax)
    for beside, constants in BESIDE.items()
}
"""Substeps, by what there may be `BESIDE` circles, of each kind of world."""
