"""Substeps one after the other, without Python in between: what `World._frame` does stage by stage, as long as nothing is asked
of it.

A substep is left for Python when the list of pairs may no longer be good, and when it is the last. The names are those of the
stages in `world.profile`. A frame is compiled for a kind of room: `frames` has one for each.
"""

from __future__ import annotations

from pyverlet.compile.bundle import borrowed, fields
from pyverlet.compile.clock import note
from pyverlet.compile.jit import driver, parallel_kernel, prange, variant
from pyverlet.compile.lanes import copy_row
from pyverlet.kernels.bounds import box
from pyverlet.kernels.cage import confine as confine_in_cage
from pyverlet.kernels.cage import hold
from pyverlet.kernels.kinds import for_each_kind
from pyverlet.kernels.motion import leap
from pyverlet.kernels.sweeps import push, relax
from pyverlet.kernels.tables import Circles, Law, Pairs

CONTACTS, BOUNDS, VELOCITIES, INTEGRATE = 1, 2, 3, 4
STAGES = ("contacts", "bounds", "velocities", "integrate")
"""Names of the numbers above, less one, by which their time is noted."""

NORMAL = fields(Pairs).index("normal")
"""Where in the tuple of `Pairs` the normals are."""

_CHUNK = 4096


@parallel_kernel
def remember(start, position):
    """start = position: where a substep begins, for friction measures slip from there."""
    for c in prange((position.shape[0] + _CHUNK - 1) // _CHUNK):
        for i in range(c * _CHUNK, min((c + 1) * _CHUNK, position.shape[0])):  # not a slice: its checks take seconds to compile
            copy_row(start, i, position, i)


# ---- rooms: from here on `law` and `circles` are named tuples -------------------------------------------------------------


@driver
def open_space(room, circles, law, claims):
    """No walls."""
    circles.resting[:] = 0


@driver
def smooth_cage(room, circles, law, claims):
    """(x, y, radius) of a round room without restitution and friction, around circles that have none either."""
    hold(
        room[0], room[1], room[2], circles.position, circles.velocity, circles.acceleration, circles.radius, circles.inverse_mass,
        circles.resting, circles.hits, law.h, law.lag, law.rest_speed, 1 - law.arrives, circles.origin, circles.moved, law.feed,
        claims,
    )  # fmt: skip


@driver
def cage(room, circles, law, claims):
    """(x, y, radius, e, mu) of a round room."""
    confine_in_cage(
        room[0], room[1], room[2], circles.position, circles.velocity, circles.acceleration, circles.spin, circles.radius,
        circles.inverse_mass, circles.restitution, circles.friction, circles.fed, circles.resting, circles.hits, circles.spent,
        circles.start, circles.turn, circles.lift, law.h, law.lag, room[3], room[4], law.rest_speed,
    )  # fmt: skip


@driver
def four_walls(room, circles, law, claims):
    """(x0, y0, x1, y1, e, mu) of a box."""
    box(
        room[0], room[1], room[2], room[3], circles.position, circles.velocity, circles.acceleration, circles.spin,
        circles.radius, circles.inverse_mass, circles.restitution, circles.friction, circles.fed, circles.resting, circles.hits,
        circles.spent, circles.start, circles.turn, circles.lift, law.h, law.lag, room[4], room[5], law.rest_speed,
    )  # fmt: skip


# ---- substeps --------------------------------------------------------------------------------------------------------------


def _project(circles, pairs, law, cut, looks, sets_out, claims):
    """The first sweep over the pairs, called from Python, which has plain tuples."""
    push(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Law(*law), cut, looks, sets_out, claims)


def _still(circles, pairs, law, cut, marks, claims):
    """The second one."""
    relax(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Law(*law), cut, marks, claims)


def _substeps(substep, stop, last, circles, pairs, law, room, cut, looks, sets_out, checked, far, claims, spent, clock):
    """From after the integration of `substep`, whose list of pairs is good, up to the end of substep `stop` - 1.

    last: the substep whose end is that of the frame. circles, pairs, law: `kernels.tables`. looks, sets_out: as for `push`, in
    the first substep. checked, far: as for `leap`. spent, clock: as for `note`, (address, tick).

    Returns the substep that is next, and whether it has been integrated and the list of pairs needs a look.
    """
    circles, pairs, law = Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Law(*law)
    while True:
        push(circles, pairs, law, cut, looks, sets_out, claims)
        note(spent, CONTACTS, clock[0], clock[1])
        confine(room, circles, law, claims)  # noqa: F821  (`frames` says what that is)
        note(spent, BOUNDS, clock[0], clock[1])
        relax(circles, pairs, law, cut, 1 if substep == last else 0, claims)
        note(spent, VELOCITIES, clock[0], clock[1])
        substep += 1
        if substep == stop:
            return substep, False
        if law.rubs != 0:
            remember(circles.start, circles.position)
        strayed = leap(
            circles.position, circles.velocity, circles.acceleration, law.h, checked, far, circles.origin, circles.moved, claims
        )
        note(spent, INTEGRATE, clock[0], clock[1])
        looks, sets_out = 0, 0
        if strayed:
            return substep, True


project = for_each_kind(driver, _project, push=push)
still = for_each_kind(driver, _still, relax=relax)
frames = {
    room: for_each_kind(driver, variant(_substeps, room.function.__name__, confine=room), push=push, relax=relax)
    for room in (open_space, smooth_cage, cage, four_walls)
}
"""Substeps in each kind of room, of each kind of world."""
