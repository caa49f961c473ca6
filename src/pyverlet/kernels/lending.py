"""Loans of inertia in a substep, in the order they are called: `lend` before the contacts, `settle` after them, `set_aside` and
`leave_out` around links, `join` when walls have pushed, and `even_up` when velocities are done.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.bundle import borrowed, bundle
from pyverlet.compile.jit import driver, kernel
from pyverlet.kernels.balance import balance, note_walls
from pyverlet.kernels.hanging import follow
from pyverlet.kernels.loans import begin, share, take_up
from pyverlet.kernels.packs import share_out
from pyverlet.kernels.tables import Circles, Pairs


@bundle
class Lending:
    """Who has lent how much, by slot (`laws.contacts.loans`), and scratch of a substep.

    mass, lent: (n,) kg; busy: (n,) s; calm: (n,) m/s; held, touched, what: (n,); lighter: (n,) 1/kg; before, unpushed,
    aside: (n, 2) m/s; spin_before: (n,) rad/s; sums: (n, 10); among: (n,); found: for each `kernels.loans.CHUNK` of circles.
    """

    mass: Any
    lent: Any
    busy: Any
    calm: Any
    held: Any
    lighter: Any
    touched: Any
    before: Any
    spin_before: Any
    unpushed: Any
    aside: Any
    what: Any
    sums: Any
    among: Any
    found: Any


@bundle
class Hanging:
    """Who hangs together (`kernels.hanging`).

    root: (n,) the lowest member of each one's cluster; heads: (n,) those that are roots; sets: (2,) how many of them, -1: it is
    not known yet, and how often something was looked for. touch, changed: by pack, and changes: by strip: `kernels.loans.share`.
    first: (n + 1,) and where: `kernels.hanging.list_lanes`. found: (k,), seen: (n,) scratch. left: (n,) whom the cluster of a
    root was taken out of in this substep, else -1.
    """

    root: Any
    heads: Any
    sets: Any
    touch: Any
    changed: Any
    changes: Any
    first: Any
    where: Any
    found: Any
    seen: Any
    left: Any


class Terms(NamedTuple):
    """kick, s, and fall, s^2: by what a becomes a change of velocity, and of position; part: of a loan given back in a substep
    of h seconds; sunk, m/s: see `kernels.loans.begin`.
    """

    kick: Any
    fall: Any
    part: Any
    sunk: Any
    h: Any


@driver
def lend(circles, pairs, lending, terms, cut, rubs):
    """The inertia with which this substep's contacts are solved; each is pulled at by its own weight all the same.

    `moved` is set anew, too: circles stand elsewhere.
    """
    begin(circles, lending, terms, pairs.made_of.shape[1] > 0, rubs)
    share_out(pairs.begin, pairs.lanes, pairs.lane_i, pairs.lane_j, cut, lending.lighter, pairs.share, pairs.reduced)


@kernel
def _copy(to, velocity):
    for i in range(velocity.shape[0]):
        to[i, 0], to[i, 1] = velocity[i, 0], velocity[i, 1]


@driver
def settle(circles, pairs, lending, hanging, terms, cut, claims):
    """Those that touch lend each other; those that do not have fallen by themselves. What changes velocities next is walls."""
    share(circles, pairs, hanging, cut, claims)
    take_up(circles, lending, terms)


@kernel
def set_aside(circles, lending):
    """Links come: what they change keeps momentum by itself."""
    _copy(lending.aside, circles.velocity)


@kernel
def leave_out(circles, lending):
    """That was theirs."""
    velocity, aside, before, unpushed = circles.velocity, lending.aside, lending.before, lending.unpushed
    for i in range(velocity.shape[0]):
        for axis in range(2):
            change = velocity[i, axis] - aside[i, axis]
            before[i, axis] += change
            unpushed[i, axis] += change


@driver
def join(circles, pairs, lending, hanging):
    """Walls have pushed: who hangs together, and is held by them."""
    follow(pairs, hanging)
    note_walls(circles, lending, hanging)


@driver
def even_up(circles, lending, hanging, rubs):
    """The substep is done: give those who have met with borrowed inertia what their momentum lacks."""
    balance(circles, lending, hanging.root, rubs != 0)


# ---- called from Python, which has plain tuples ------------------------------------------------------------------------------


@driver
def call_lend(circles, pairs, lending, terms, cut, rubs):
    """`lend`."""
    lend(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)), Terms(*terms), cut, rubs != 0)


@driver
def call_settle(circles, pairs, lending, hanging, terms, cut, claims):
    """`settle`."""
    settle(
        Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)), Hanging(*borrowed(hanging)),
        Terms(*terms), cut, claims,
    )  # fmt: skip


@driver
def call_set_aside(circles, lending):
    """`set_aside`."""
    set_aside(Circles(*borrowed(circles)), Lending(*borrowed(lending)))


@driver
def call_leave_out(circles, lending):
    """`leave_out`."""
    leave_out(Circles(*borrowed(circles)), Lending(*borrowed(lending)))


@driver
def call_join(circles, pairs, lending, hanging):
    """`join`."""
    join(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)), Hanging(*borrowed(hanging)))


@driver
def call_even_up(circles, lending, hanging, rubs):
    """`even_up`."""
    even_up(Circles(*borrowed(circles)), Lending(*borrowed(lending)), Hanging(*borrowed(hanging)), rubs)
