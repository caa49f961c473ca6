"""What links do in a substep, each part of it one call: `look` before the integrator moves, `note_calm` before the contacts and
`solve` after them, `lay_down` and `pick_up` around walls and the second sweep, and `note_pull` when velocities are done.

The law is that of `kernels.links`: pins first (`ties`), then passes over runs of distances (`chains`) and all other rows
(`link_rows`), there and back, for one way only the links about a common particle throw it in a circle, faster and faster.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.bundle import bundle
from pyverlet.compile.jit import FALSE, TRUE, driver, kernel, variant
from pyverlet.kernels.chain_passes import sweep
from pyverlet.kernels.chain_rows import prepare_soft
from pyverlet.kernels.link_rows import note_rows, prepare_rows, sweep_rows
from pyverlet.kernels.links import add_pull, hand_back, look_back, set_down, set_out, shoulder, tell_calm
from pyverlet.kernels.ties import note_ties, tie


@bundle
class Linked:
    """The linked particles (`laws.links._work`), their chains (`_chains`) and pins (`pin`)."""

    slot: Any
    start: Any
    back: Any
    predicted: Any
    shift: Any
    weight: Any
    calm: Any
    burden: Any
    kept: Any
    assembly: Any
    colour: Any
    begin: Any
    node: Any
    holds: Any
    lanes: Any
    bowed: Any
    blended: Any
    torn: Any
    row: Any
    more: Any
    rooms: Any
    wide: Any
    claims: Any
    tied: Any
    point: Any
    tie_stiffness: Any
    tie_damping: Any
    tie_strength: Any
    tie_intact: Any
    tie_give: Any
    tie_left: Any
    tie_way: Any
    tie_kept: Any
    tie_lam: Any
    tie_last: Any
    tie_force: Any


class Linking(NamedTuple):
    """Numbers of a substep. count: of the linked; times: passes, there and back; rest: s, see `kernels.links.add_pull`."""

    h: Any
    period_x: Any
    period_y: Any
    count: Any
    times: Any
    rest: Any


@driver
def look(linked, linking, position, velocity, inverse_mass):
    """Before the integrator: where everybody starts. Arrays are by slot."""
    look_back(
        linked.slot, position, velocity, inverse_mass, linking.period_x, linking.period_y, linked.calm, linking.h, linked.start,
        linked.back, linked.weight,
    )  # fmt: skip


@driver
def note_calm(linked, calm, keep):
    """Before contacts that may bounce or rub: how slowly, m/s, linked circles meet and are still at rest; calm: by slot."""
    tell_calm(linked.slot, linked.calm, calm, keep)


@driver
def _passes(linked, rows, linking):
    """There and back so many times, from the lam that rows start from; once, one way, where there is a single colour."""
    h, period_x, period_y = linking.h, linking.period_x, linking.period_y
    prepare_soft(linked, linking)
    prepare_rows(rows, linked, period_x, period_y, h)
    colours, parts = linked.colour.shape[0] - 1, rows.part.shape[0] - 1
    several = colours + parts > 1
    turns = linking.times if several else 1
    for turn in range(turns):
        last = turn == turns - 1
        sweep(FALSE, FALSE, turn == 0, last and parts == 0, linked, linking)
        sweep_rows(FALSE, FALSE, rows, linked, period_x, period_y)
        if several:  # without what has just been solved
            sweep_rows(TRUE, TRUE, rows, linked, period_x, period_y)
            sweep(TRUE, parts == 0, FALSE, last, linked, linking)


@driver
def solve(linked, rows, linking, position, velocity):
    """Move the linked particles to where their links allow, and break those that pull too hard."""
    set_out(linked.predicted, linked.shift, position, linked.slot)
    tie(
        linked.predicted, linked.weight, linked.start, linked.back, linked.tied, linked.point, linking.period_x,
        linking.period_y, linked.tie_stiffness, linked.tie_damping, linked.tie_intact, linking.h, linked.tie_give,
        linked.tie_left, linked.tie_way, linked.tie_kept,
    )  # fmt: skip
    _passes(linked, rows, linking)
    note_rows(rows.intact, rows.number, linking.h)
    note_ties(
        linked.shift, linked.predicted, linked.tied, linked.tie_strength, linked.tie_intact, linking.h, linked.tie_give,
        linked.tie_left, linked.tie_way, linked.tie_kept, linked.tie_lam, linked.tie_last, linked.tie_force,
    )  # fmt: skip
    hand_back(position, velocity, linked.slot, linking.count, linked.predicted, linked.shift, 1.0 / linking.h)


@driver
def lay_down(linked, linking, velocity):
    """Before walls: velocities are without what carries the pull of links."""
    set_down(velocity, linked.slot, linked.shift, 1.0 / linking.h, linked.calm, linked.burden, linked.kept)


@driver
def pick_up(linked, velocity):
    """After the second sweep: they are with it again."""
    shoulder(velocity, linked.slot, linked.burden, linked.kept)


@driver
def note_pull(linked, linking, acceleration):
    """When velocities are done: what links did is part of the acceleration."""
    add_pull(acceleration, linked.slot, linked.shift, 1.0 / linking.h, linked.calm, linking.rest)


look_alone, note_calm_alone, solve_alone, lay_down_alone, pick_up_alone, note_pull_alone = (
    kernel(variant(each.function, "alone")) for each in (look, note_calm, solve, lay_down, pick_up, note_pull)
)
"""The same, which stay on one thread also where circles use several."""
