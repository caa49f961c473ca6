"""One pass over the packs of `kernels.chains`, colour by colour."""

from __future__ import annotations

from pyverlet.compile.jit import FALSE, driver, parallel_kernel, prange
from pyverlet.compile.stealing import claim_evenly, none_claimed
from pyverlet.kernels.chain_rows import SOFTS, note_pack, prepare_pack
from pyverlet.kernels.chains import solve_pack


@parallel_kernel
def _solve(
    prepares, notes, first, stop, start, node, holds, lanes, bowed, torn, row, more, shift, h, rooms, wide, claims, begun,
    predicted, back, weight, period_x, period_y,
):  # fmt: skip
    for part in prange(claims.shape[0]):
        k = claim_evenly(claims, stop - first, part)
        while k >= 0:
            p = first + k
            if prepares and not holds[p] & SOFTS:
                bowed[p] = prepare_pack(
                    FALSE, p, start, node, holds, row, more, begun, predicted, back, weight, shift, period_x, period_y, h
                )
            solve_pack(p, start, node, holds, lanes, bowed, row, more, shift, h * h, rooms[part], wide[part])
            if notes:
                note_pack(p, start, holds, row, more, torn, h)
            k = claim_evenly(claims, stop - first, part)


@driver
def sweep(homeward, skip, prepares, notes, linked, linking):
    """Solve all packs, colour by colour or `homeward` from the last one, without the first colour on the way if `skip`.

    Colour c is packs colour[c] to colour[c + 1], which share no particle. rooms, wide: (parts, SCRATCH or WIDE times the items of
    the longest pack): as many packs are solved beside each other. claims: see `compile.stealing`. prepares: hard ones are
    prepared on the way; notes: their force is noted, and who breaks (`chain_rows.note_pack`), of the last colour alone on the way
    out, for the others come again. So rows are not fetched for that once more.
    """
    colour, colours = linked.colour, linked.colour.shape[0] - 1
    for n in range(1 if skip else 0, colours):
        c = colours - 1 - n if homeward else n
        none_claimed(linked.claims)
        _solve(
            prepares, notes and (homeward or c == colours - 1), colour[c], colour[c + 1], linked.begin, linked.node, linked.holds,
            linked.lanes, linked.bowed, linked.torn, linked.row, linked.more, linked.shift, linking.h, linked.rooms, linked.wide,
            linked.claims, linked.start, linked.predicted, linked.back, linked.weight, linking.period_x, linking.period_y,
        )  # fmt: skip
