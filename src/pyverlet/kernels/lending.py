"""Loans of inertia in a substep, in the order they are called: `lend` before the contacts, `settle` after them, `tell_weights`
before links and `note_unpushed` after them, `join` or `join_linked` when walls have pushed, `even_up` when velocities are done,
and `balance.balance_pull` when accelerations are.

Links move circles by the inertia of the substep, too. What they pull on by the own mass while contacts push by another would not
be in balance where contacts are: a light circle between a link and a heavy one would pass on its pull many times over.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.bundle import bundle
from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, pick, store
from pyverlet.kernels.balance import balance, note_pins, note_walls, tell
from pyverlet.kernels.hanging import follow, join_links
from pyverlet.kernels.loans import CHUNK, begin, share, take_up
from pyverlet.kernels.packs import share_out


@bundle
class Lending:
    """Who has lent how much, by slot (`laws.contacts.loans`), and scratch of a substep.

    mass, lent: (n,) kg; busy: (n,) s; calm: (n,) m/s; held, touched, what: (n,); linked: (n,) 1 for whom links join to others, or
    to a point; lighter: (n,) 1/kg; before, unpushed: (n, 2) m/s; spin_before: (n,) rad/s; sums: (n, 10); among: (n,); found: for
    each `kernels.loans.CHUNK` of circles.
    """

    mass: Any
    lent: Any
    busy: Any
    calm: Any
    held: Any
    lighter: Any
    touched: Any
    linked: Any
    before: Any
    spin_before: Any
    unpushed: Any
    what: Any
    sums: Any
    among: Any
    found: Any


@bundle
class Hanging:
    """Who hangs together (`kernels.hanging`).

    root: (n,) the lowest member of each one's cluster; heads: (n,) those that are roots; sets: (3,) how many of them, -1: it is
    not known yet, how often something was looked for, and how many chiefs. group, chiefs: (n,) as root and heads, of those that
    hang together by contacts or links. touch, changed: by pack, and changes: by strip: `kernels.loans.share`.
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
    group: Any
    chiefs: Any


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


@driver
def settle(circles, pairs, lending, hanging, terms, cut, claims):
    """Those that touch lend each other; those that do not have fallen by themselves. Walls, or links, change velocities next."""
    share(circles, pairs, hanging, cut, claims)
    take_up(circles, lending, terms)


@kernel
def _tell_weights(begin, end, slot, weight, lighter):
    for k in range(begin, end, LANES):
        store(weight, k, pick(lighter, slot, k))


@parallel_kernel
def tell_weights(slot, weight, lighter):
    """Links come: weight[k] = lighter[slot[k]], the inverse inertia of who is linked, 1/kg."""
    for c in prange((slot.shape[0] + CHUNK - 1) // CHUNK):
        _tell_weights(c * CHUNK, min((c + 1) * CHUNK, slot.shape[0]), slot, weight, lighter)


@kernel
def note_unpushed(circles, lending):
    """Links are done: it is from here on that walls push."""
    velocity, unpushed = circles.velocity, lending.unpushed
    for i in range(velocity.shape[0]):
        unpushed[i, 0], unpushed[i, 1] = velocity[i, 0], velocity[i, 1]


@driver
def join(circles, pairs, lending, hanging):
    """Walls have pushed: who hangs together by contacts, and is held by them."""
    follow(pairs, hanging)
    note_walls(circles, lending, hanging.root, hanging.heads, hanging.sets[0])
    tell(lending, hanging.root)


@driver
def join_linked(circles, pairs, lending, hanging, slot, assembly, tied, intact):
    """The same where links hold some together, too, and pins some at a point: those `tied` to it, in the order of `slot`."""
    follow(pairs, hanging)
    join_links(hanging, slot, assembly)
    note_walls(circles, lending, hanging.group, hanging.chiefs, hanging.sets[2])
    note_pins(lending, hanging.group, slot, tied, intact)
    tell(lending, hanging.group)


@driver
def even_up(circles, lending, root, rubs):
    """The substep is done: give those who have met with borrowed inertia what their momentum lacks. root: what was told."""
    balance(circles, lending, root, rubs != 0)
