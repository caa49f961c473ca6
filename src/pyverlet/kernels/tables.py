"""What the kernels of contacts are handed: circles, pairs, and the law of a substep, by name.

Of numbers Python hands over plain tuples, which are quicker to look through; drivers give them the names.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.bundle import bundle

NEW = np.inf
"""The slip of a pair that did not touch in the substep before. What it slips in its first one, it may have slipped before it
met."""

E, MU, R_I, R_J, TURN_I, TURN_J = range(6)
"""Rows of `Pairs.made_of`: restitution, friction, radii m, and 2 / r: a push turns each disc by that times its share."""


@bundle
class Circles:
    """Circles by slot; what each is: `Slots`, of contacts `Wide`, and the last six `Loans`: empty where nobody lends, but
    for `calm`, which links fill, too.

    rows: (n, 4), where circles rub, what a pair reads and writes of each, side by side. In the first sweep: what friction moves
    it by (2), m, what that turns it by, rad, whether it carries weight. In the second: velocity (2), spin, `turn`.
    """

    position: Any
    velocity: Any
    acceleration: Any
    inverse_mass: Any
    origin: Any
    moved: Any
    resting: Any
    spin: Any
    carries: Any
    fed: Any
    rows: Any
    turn: Any
    lift: Any
    leans: Any
    start: Any
    radius: Any
    restitution: Any
    friction: Any
    hits: Any
    spent: Any
    impacts: Any
    before: Any
    spin_before: Any
    lent: Any
    busy: Any
    calm: Any
    inertia: Any


@bundle
class Pairs:
    """Candidate pairs by lane, those of strip s from begin[s] to begin[s] + lanes[s]; what each is: `Wide`."""

    begin: Any
    lanes: Any
    apart: Any
    lane_i: Any
    lane_j: Any
    gap: Any
    reach: Any
    share: Any
    reduced: Any
    made_of: Any
    normal: Any
    depth: Any
    slip: Any
    closing: Any
    deep: Any
    deeps: Any
    spent: Any
    bounced: Any


class Law(NamedTuple):
    """Numbers of a substep, and what there is to do in it.

    varied: 1, or 0 if share is the same for all and has one pack only; sized, mixed: the same of reach, `made_of`. rubs: whether
    any pair may rub; listens: whether somebody listens to who meets how fast; accounts: whether somebody asks what impacts take.
    arrives: 1 if what becomes of `moved` is to be added to positions and velocities when all pairs have been gone through, 0 if
    the room does that; always 1 where pairs may bounce. feed: FED / PUSHED / h, 1/s. most: the largest part of the contact
    distance that a push may see. deep: likewise, from which on an overlap is treated again. grazes: 1 if a pair without
    restitution may be an impact, for friction's sake, 0 where inertia is lent. weight: whether an acceleration could stop a pair
    that parts. carried: m/s, by which a substep feeds the velocity of one that carries weight.
    """

    varied: Any
    sized: Any
    mixed: Any
    rubs: Any
    listens: Any
    accounts: Any
    arrives: Any
    h: Any
    lag: Any
    feed: Any
    most: Any
    deep: Any
    rest_speed: Any
    grazes: Any
    weight: Any
    carried: Any
