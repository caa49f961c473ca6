"""Loans of inertia in a substep, in the order they are called: `lend` before the contacts, `settle` after them, `set_aside` and
`leave_out` around links, `join` when walls have pushed, and `even_up` when velocities are done.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.bundle import borrowed, bundle
from pyverlet.compile.jit import driver, kernel
from pyverlet.kernels.balance import balance, cluster, note_walls, set_out
from pyverlet.kernels.loans import give_back, pull, share, take_up, weigh
from pyverlet.kernels.packs import share_anew
from pyverlet.kernels.tables import Circles, Pairs


@bundle
class Lending:
    """Who has lent how much, by slot (`laws.contacts.loans`), and scratch of a substep.

    mass, lent: (n,) kg; busy: (n,) s; calm: (n,) m/s; held, touched, open_to, among: (n,); lighter: (n,) 1/kg; before, unpushed,
    aside: (n, 2) m/s; spin_before: (n,) rad/s; rows: (n, 4); root: (n,); sums: (n, 10).
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
    rows: Any
    root: Any
    sums: Any
    open_to: Any
    among: Any


class Terms(NamedTuple):
    """kick, s, and fall, s^2: see `kernels.loans.take_up`; part: of a loan given back in a substep of h seconds; sunk, m/s: see
    `kernels.loans.weigh`.
    """

    kick: Any
    fall: Any
    part: Any
    sunk: Any
    h: Any


@driver
def lend(circles, pairs, lending, terms, cut):
    """The inertia with which this substep's contacts are solved; each is pulled at by its own weight all the same."""
    weigh(
        lending.mass, circles.inverse_mass, lending.lent, lending.busy, terms.sunk, lending.lighter, lending.calm,
    )  # fmt: skip
    set_out(circles.velocity, circles.acceleration, circles.spin, lending.held, terms.kick, lending.before, lending.spin_before)
    pull(circles.position, circles.acceleration, circles.inverse_mass, lending.lighter, lending.held, terms.fall)
    share_anew(
        pairs.begin, pairs.lanes, pairs.lane_i, pairs.lane_j, cut, circles.radius, lending.lighter, pairs.share, pairs.made_of
    )


@kernel
def _copy(to, velocity):
    for i in range(velocity.shape[0]):
        to[i, 0], to[i, 1] = velocity[i, 0], velocity[i, 1]


@driver
def settle(circles, pairs, lending, terms, cut):
    """Those that touch lend each other; those that do not have fallen by themselves. What changes velocities next is walls."""
    share(
        pairs.begin, pairs.lanes, pairs.lane_i, pairs.lane_j, pairs.normal, cut, lending.mass, circles.inverse_mass, lending.lent,
        lending.busy, lending.touched, lending.rows,
    )  # fmt: skip
    take_up(
        circles.position, circles.velocity, circles.acceleration, circles.inverse_mass, lending.lighter, lending.held,
        lending.touched, terms.kick, terms.fall,
    )  # fmt: skip
    give_back(lending.mass, terms.part, terms.h, lending.lent, lending.busy)
    _copy(lending.unpushed, circles.velocity)


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
def join(circles, pairs, lending):
    """Walls have pushed: who hangs together, and is held by them."""
    cluster(pairs.begin, pairs.lanes, pairs.lane_i, pairs.lane_j, pairs.normal, circles.inverse_mass, lending.root)
    note_walls(
        circles.velocity, lending.unpushed, circles.inverse_mass, lending.touched, lending.root, lending.sums, lending.open_to,
        lending.held,
    )  # fmt: skip


@driver
def even_up(circles, lending, rubs):
    """The substep is done: give those who have met with borrowed inertia what their momentum lacks."""
    balance(
        circles.position, circles.velocity, circles.spin, circles.radius, lending.mass, circles.inverse_mass, lending.lighter,
        lending.touched, lending.before, lending.spin_before, lending.root, rubs != 0, lending.sums, lending.open_to,
        lending.among,
    )  # fmt: skip


# ---- called from Python, which has plain tuples ------------------------------------------------------------------------------


@driver
def call_lend(circles, pairs, lending, terms, cut):
    """`lend`."""
    lend(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)), Terms(*terms), cut)


@driver
def call_settle(circles, pairs, lending, terms, cut):
    """`settle`."""
    settle(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)), Terms(*terms), cut)


@driver
def call_set_aside(circles, lending):
    """`set_aside`."""
    set_aside(Circles(*borrowed(circles)), Lending(*borrowed(lending)))


@driver
def call_leave_out(circles, lending):
    """`leave_out`."""
    leave_out(Circles(*borrowed(circles)), Lending(*borrowed(lending)))


@driver
def call_join(circles, pairs, lending):
    """`join`."""
    join(Circles(*borrowed(circles)), Pairs(*borrowed(pairs)), Lending(*borrowed(lending)))


@driver
def call_even_up(circles, lending, rubs):
    """`even_up`."""
    even_up(Circles(*borrowed(circles)), Lending(*borrowed(lending)), rubs)
