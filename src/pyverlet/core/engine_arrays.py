# mypy: ignore-errors
"""Arrays that the engine allocates, by their names in `Step`, `Cells` and `Lists`, whose pointers are set here."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import (
    const_indices_in,
    const_reals_in,
    doubles,
    doubles_in,
    indices,
    indices_in,
    integers,
    integers_in,
    octets_in,
    reals,
    reals_in,
    small_integers,
    small_integers_in,
)
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t
from cython.cimports.team import team_reserved

from pyverlet.common import memory
from pyverlet.core.cell_sorting import pieces_of
from pyverlet.core.cells import BLOCK, LEVELS, Cells
from pyverlet.core.contact_recording import ROW
from pyverlet.core.contact_records import RECORD_COLUMNS
from pyverlet.core.engine_events import make_event_arrays
from pyverlet.core.engine_rebounds import make_rebound_arrays
from pyverlet.core.engine_surfaces import make_surface_rows, set_rows
from pyverlet.core.pair_batches import SPARE_LANES
from pyverlet.core.pair_groups import GROUP, mark_dirty
from pyverlet.core.pair_lists import INDEX_WORDS, Lists
from pyverlet.core.pair_memory import chain_pair
from pyverlet.core.step import Step
from pyverlet.core.surface_lists import swap_surfaces


@cython.cfunc
def map_row(rows, k: cython.int) -> cython.pointer(real):
    """The address of a row of an array."""
    return reals(rows[k])


@cython.cfunc
def make_level_arrays(c: cython.pointer(Cells), a, dtype):
    """Allocate the arrays of the grids."""
    a |= {name: np.zeros(LEVELS, np.int64) for name in ("shift", "base", "width", "height", "held")}
    a |= {name: np.zeros(LEVELS, dtype) for name in ("across", "along", "level_largest")}
    c.shift, c.base, c.held = integers_in(a, "shift"), integers_in(a, "base"), integers_in(a, "held")
    c.width, c.height = integers_in(a, "width"), integers_in(a, "height")
    c.across, c.along, c.largest = reals_in(a, "across"), reals_in(a, "along"), reals_in(a, "level_largest")


@cython.cfunc
def share_memory(w: cython.pointer(Step), a, dtype):
    """Let substeps, list building and the list's age check share memory: none needs what another leaves."""
    step = w.count + 40  # patches and spots are read beyond the last particle; see `lay_rows`
    set_rows(a, ("shared",), 4 * step, (), dtype)
    shared, words = a["shared"], a["shared"].view(np.uint32)
    w.begun, w.free, w.cells.box = reals(shared), reals(shared[2 * step :]), reals(shared)
    w.cells.spot_u, w.cells.spot_v = reals(shared), reals(shared[step:])
    w.lists.used, w.lists.batch = indices(words[INDEX_WORDS * 2 * step :]), indices(words[INDEX_WORDS * 3 * step :])
    w.cells.mixed = w.lists.batch


@cython.cfunc
def make_particle_arrays(w: cython.pointer(Step), a, count: cython.Py_ssize_t, dtype):
    """Allocate arrays for so many particles, their cells and groups; values of remaining particles are kept."""
    c: cython.pointer(Cells) = w.cells
    ls: cython.pointer(Lists) = w.lists
    w.count = c.count = count
    blocks, groups = (count + BLOCK - 1) // BLOCK, count // GROUP + 3
    set_rows(a, ("listed", "checked", "moved"), count, (2,), dtype)
    set_rows(a, ("spot_r",), count + 8, (), dtype)
    set_rows(a, ("cell", "order"), count, (), np.uint32)
    share_memory(w, a, dtype)
    set_rows(a, ("fastest", "speeds"), blocks, (), dtype)
    set_rows(a, ("momenta",), blocks, (3,), np.float64)
    set_rows(a, ("energy",), blocks, (), np.float64)
    set_rows(a, ("stale", "awake"), blocks, (), np.int32)
    set_rows(a, ("still",), blocks, (), np.uint8)
    set_rows(a, ("begin", "lanes", "held_lanes", "swept", "busy", "row"), groups, (), np.int64)
    set_rows(a, ("found", "looked", "beyond", "cut", "in_group"), groups, (), np.int64)
    set_rows(a, ("bounced", "searched", "crowded"), groups, (), np.int32)
    set_rows(a, ("dirty",), groups, (), np.uint8)
    set_rows(a, ("start",), 4 * count + 72, (), np.uint32)
    set_rows(a, ("tally",), pieces_of(count) * (pieces_of(count) + 1), (), np.uint32)
    set_rows(a, ("extent",), blocks, (4,), dtype)
    w.listed, w.checked, w.moved = reals_in(a, "listed"), reals_in(a, "checked"), reals_in(a, "moved")
    w.fastest, w.stale, w.still = reals_in(a, "fastest"), small_integers_in(a, "stale"), octets_in(a, "still")
    w.bounced, w.searched = small_integers_in(a, "bounced"), small_integers_in(a, "searched")
    w.crowded = small_integers_in(a, "crowded")
    w.awake, w.busy = small_integers_in(a, "awake"), integers_in(a, "busy")
    w.begin, w.lanes, w.swept = integers_in(a, "begin"), integers_in(a, "lanes"), integers_in(a, "swept")
    c.spot_r, c.extent = reals_in(a, "spot_r"), reals_in(a, "extent")
    c.cell, c.order, c.start = indices_in(a, "cell"), indices_in(a, "order"), indices_in(a, "start")
    c.tally = indices_in(a, "tally")
    ls.speeds = reals_in(a, "speeds")
    ls.momenta, w.energy = doubles_in(a, "momenta"), doubles_in(a, "energy")
    ls.fan = 0
    make_chains(w, a, ls.lanes_capacity)
    make_rare_arrays(w, a, dtype)
    ls.row, ls.found, ls.held_lanes = integers_in(a, "row"), integers_in(a, "found"), integers_in(a, "held_lanes")
    ls.looked, ls.beyond, ls.dirty = integers_in(a, "looked"), integers_in(a, "beyond"), octets_in(a, "dirty")
    ls.cut, ls.held = integers_in(a, "cut"), integers_in(a, "in_group")
    make_surface_rows(w, a)
    make_rebound_arrays(w, a)


@cython.cfunc
def make_scratch_arrays(w: cython.pointer(Step), a, capacity: cython.Py_ssize_t, threads, dtype):
    """Allocate scratch arrays per thread for so many pairs, or lanes, of the group in work: list building and impacts."""
    ls: cython.pointer(Lists) = w.lists
    ls.scratch_capacity = capacity
    kinds = {"raw_i": np.uint32, "raw_j": np.uint32, "sorted": np.uint32, "rest": np.uint32, "key": np.uint8}
    kinds |= {"put_i": np.uint32, "put_j": np.uint32, "put_x": dtype, "put_y": dtype, "hit": np.int64, "hit_time": np.float64}
    a |= {name: memory.zeros(threads * capacity, kind) for name, kind in kinds.items()}
    ls.raw_i, ls.raw_j = indices_in(a, "raw_i"), indices_in(a, "raw_j")
    ls.sorted, ls.rest = indices_in(a, "sorted"), indices_in(a, "rest")
    ls.key, ls.put_i, ls.put_j = octets_in(a, "key"), indices_in(a, "put_i"), indices_in(a, "put_j")
    ls.put_x, ls.put_y = reals_in(a, "put_x"), reals_in(a, "put_y")
    w.hit, w.hit_time = integers_in(a, "hit"), doubles_in(a, "hit_time")


@cython.cfunc
def lengthen(a, name, shape, dtype):
    """Resize an array; its contents along the last axis are kept."""
    larger = memory.zeros(shape, dtype)
    if name in a:
        larger.T[: len(a[name].T)] = a[name].T
    a[name] = larger


@cython.cfunc
def make_lane_arrays(w: cython.pointer(Step), a, lanes: cython.Py_ssize_t, dtype):
    """Allocate arrays for so many lanes while the list is made anew; contact state, and the chains that link it, are kept."""
    ls: cython.pointer(Lists) = w.lists
    ls.lanes_capacity = lanes
    lost = {"i": (lanes, np.uint32), "j": (lanes, np.uint32), "gap": ((2, lanes), dtype), "depth": (lanes, dtype)}
    a |= dict.fromkeys(lost)  # first: what is kept exists twice for a moment
    for name, shape in (("normal", (2, lanes)), ("load", (lanes,)), ("impulse", (lanes,))):
        lengthen(a, name, shape, dtype)
    a |= {name: memory.zeros(*each) for name, each in lost.items()}
    w.i, w.j = indices_in(a, "i"), indices_in(a, "j")
    w.gap_x, w.gap_y = map_row(a["gap"], 0), map_row(a["gap"], 1)
    w.normal_x, w.normal_y = map_row(a["normal"], 0), map_row(a["normal"], 1)
    w.depth, w.load, w.impulse = reals_in(a, "depth"), reals_in(a, "load"), reals_in(a, "impulse")
    ls.kept_next, ls.kept_other = small_integers(a["normal"][0].view(np.int32)), indices(a["normal"][1].view(np.uint32))
    ls.source = small_integers(a["depth"].view(np.int32))
    make_rare_arrays(w, a, dtype)
    make_rebound_arrays(w, a)


@cython.cfunc
def reserve_records(a, rows: cython.Py_ssize_t):
    """Allocate memory in advance in which so many rows of `core.contact_recording` become records: the first query is fast."""
    if "recorded_key" not in a or len(a["recorded_key"]) < rows:
        a |= {name: memory.zeros(rows, np.int64) for name in ("recorded_key", "recorded_order")}
        a["recorded_row"], records = memory.zeros((rows, ROW), np.float64), memory.zeros((rows, RECORD_COLUMNS), np.int64)
        a["recorded_records"] = records, records.view(np.float64)


@cython.cfunc
def make_rare_arrays(w: cython.pointer(Step), a, dtype):
    """Allocate arrays that few worlds need: for contact records, friction and rolling resistance."""
    lanes = w.lists.lanes_capacity
    wanted = {
        "summed": ((3, lanes), w.records_contacts),
        "tangent_impulse": ((lanes,), w.tangents),
        "roll_impulse": ((lanes,), w.rollings),
    }
    for name, (shape, asked) in wanted.items():
        if asked and (name not in a or a[name].shape != shape):
            lengthen(a, name, shape, dtype)
    if w.records_contacts:
        reserve_records(a, lanes)
        w.summed_x, w.summed_y, w.summed_virial = map_row(a["summed"], 0), map_row(a["summed"], 1), map_row(a["summed"], 2)
    if w.tangents:
        w.tangent_impulse = reals_in(a, "tangent_impulse")
        set_rows(a, ("motion",), w.count, (4,), dtype)
        set_rows(a, ("free_spin",), w.count, (), dtype)
        w.motion, w.free_spin = reals_in(a, "motion"), reals_in(a, "free_spin")
    if w.rollings:
        w.roll_impulse = reals_in(a, "roll_impulse")


@cython.cfunc
def make_chains(w: cython.pointer(Step), a, lanes: cython.Py_ssize_t):
    """Allocate the chains of stored contact state, several per particle in crowds to keep them short, and move the contents."""
    ls: cython.pointer(Lists) = w.lists
    fan: cython.Py_ssize_t = 1
    while 8 * w.count * fan < lanes and w.count > 0:
        fan *= 2
    if fan == ls.fan:
        return
    old, before = a.get("head"), ls.fan
    ls.fan, a["head"] = fan, np.full(w.count * fan, -1, np.int32)
    ls.head = small_integers_in(a, "head")
    if ls.impulses_stored:
        chain_pairs_again(ls, old, before, np.arange(w.count, dtype=np.int32))


@cython.cfunc
def chain_pairs_again(ls: cython.pointer(Lists), old, fan: cython.Py_ssize_t, place):
    """Rehang entries of the `old` chains, `fan` per row, on the current ones; row k is now place[k], or removed (-1)."""
    before: cython.pointer(int32_t) = small_integers(old)
    now: cython.pointer(int32_t) = small_integers(place)
    c: cython.Py_ssize_t
    for c in range(len(place) * fan):
        n: int32_t = before[c]
        while n >= 0:
            following: int32_t = ls.kept_next[INDEX_WORDS * n]
            p: int32_t = now[c // fan]
            q: int32_t = now[ls.kept_other[INDEX_WORDS * n]]
            if p >= 0 and q >= 0:
                chain_pair(ls, cython.cast(uint32_t, min(p, q)), cython.cast(uint32_t, max(p, q)), n)
            n = following


@cython.cfunc
def forget_pairs(w: cython.pointer(Step)):
    """Discard the pair list and all contact state."""
    w.lists.listed = w.lists.good = w.lists.impulses_stored = False
    w.groups = w.lists.rows = 0
    w.evens = w.odds = w.alone = 0


@cython.cfunc
def renumber_places(w: cython.pointer(Step), place, gone, closes: cython.bint):
    """Mark rows that move to `place`, and removed ones, in the list. It stays valid only if remaining rows keep their order.

    closes: they do, and are packed without gaps.
    """
    ls: cython.pointer(Lists) = w.lists
    now: cython.pointer(int32_t) = small_integers(place)
    sorted_index: cython.pointer(int64_t) = integers(gone)
    last: int32_t = -1
    k: cython.Py_ssize_t
    n: cython.Py_ssize_t
    for n in range(len(gone) if ls.listed else 0):
        mark_dirty(w.cells, ls, sorted_index[n], w.listed[2 * sorted_index[n]], w.listed[2 * sorted_index[n] + 1])
    for k in range(0 if closes else len(place)):
        if now[k] >= 0:
            ls.good = ls.good and now[k] > last
            last = now[k]
    ls.patching, ls.place = True, now
    ls.anew = ls.anew or (ls.tied and closes and len(gone) > 0)  # particle numbers have changed


@cython.cfunc
def move_rows(w: cython.pointer(Step), a, place, gone, source, count: cython.Py_ssize_t, dtype):
    """Move row k to place[k] of `count`, or drop it (-1), with its contact state in chains or in the list.

    gone: removed rows, ascending. source: (count,) the previous row of each, or -1; None: remaining rows are packed without
    gaps, and new ones follow.
    """
    old, fan, listed = a["head"], w.lists.fan, w.lists.listed
    if not w.surfaces_kept:
        swap_surfaces(w)
    blanks = {"contact_begin": 0, "contact_end": 0, "listed": np.nan, "checked": np.nan}
    for name, blank in blanks.items():
        a[name] = memory.moved(a[name], gone, source, count, blank)
    make_particle_arrays(w, a, count, dtype)
    if not listed:
        forget_pairs(w)
        chain_pairs_again(w.lists, old, fan, place)
        w.lists.impulses_stored = True


@cython.cfunc
def make_material_arrays(w: cython.pointer(Step), a, dtype):
    """Allocate arrays for the materials of pairs: one entry per lane, or eight if all are alike."""
    lanes = max(w.lists.lanes_capacity, 8)
    shapes = {
        "reach": (2, lanes if w.sized else 8),
        "share": (lanes if w.varied else 8,),
        "made_of": (8, lanes if w.mixed else 8),
    }
    for name, shape in shapes.items():
        if name not in a or a[name].shape != shape:
            a[name] = np.zeros(shape, dtype)
            w.lists.refill = True
    reach, made_of = a["reach"], a["made_of"]
    w.reach, w.per_reach, w.share = map_row(reach, 0), map_row(reach, 1), reals_in(a, "share")
    w.restitution, w.friction, w.radius_i = map_row(made_of, 0), map_row(made_of, 1), map_row(made_of, 2)
    w.radius_j, w.turn_i, w.turn_j = map_row(made_of, 3), map_row(made_of, 4), map_row(made_of, 5)
    w.rolling, w.grip = map_row(made_of, 6), map_row(made_of, 7)


@cython.cfunc
def make_lanes(w: cython.pointer(Step), a, lanes, dtype):
    """Allocate arrays for at least so many lanes; contact state is kept."""
    if lanes > w.lists.lanes_capacity:
        make_lane_arrays(w, a, lanes, dtype)
        make_chains(w, a, lanes)
        make_material_arrays(w, a, dtype)
        make_event_arrays(w, a, dtype)


@cython.cfunc
def reserve_pairs(w: cython.pointer(Step), a, threads: cython.int, dtype):
    """Allocate room for as many pairs as the last list would have needed."""
    most = w.lists.most
    if most > w.lists.scratch_capacity:
        make_scratch_arrays(w, a, 5 * most // 4, threads, dtype)
    # Groups without scratch memory have reserved nothing: count their pairs, plus some for partial batches.
    found = a["found"][: w.groups].sum() + 2 * SPARE_LANES * w.groups
    make_lanes(w, a, max(found, team_reserved(w.team), 8) * 33 // 32, dtype)


@cython.cfunc
def set_particles(w: cython.pointer(Step), arrays, a, dtype):
    """See `Engine.set_particles`."""
    arrays.update(a)
    if w.count != len(a["position"]):
        forget_pairs(w)
        make_particle_arrays(w, arrays, len(a["position"]), dtype)
    w.position, w.velocity, w.acceleration = reals_in(a, "position"), reals_in(a, "velocity"), reals_in(a, "acceleration")
    w.inverse_mass, w.radius, w.spin = reals_in(a, "inverse_mass"), reals_in(a, "radius"), reals_in(a, "spin")
    w.given, w.given_spin = reals_in(a, "given"), reals_in(a, "given_spin")
    w.surfaces_good = w.still_known = False
    w.own_restitution, w.own_friction = const_reals_in(a, "own_restitution"), const_reals_in(a, "own_friction")
    w.own_rolling, w.own_material = const_reals_in(a, "own_rolling"), const_indices_in(a, "own_material")
    w.ease = const_reals_in(a, "ease")
    w.cells.position, w.cells.radius = w.position, w.radius
    w.lists.particle, w.lists.filtered = small_integers_in(a, "particle"), len(a["category"]) > 0
    w.lists.category, w.lists.mask = indices_in(a, "category"), indices_in(a, "mask")


@cython.cfunc
def set_materials(w: cython.pointer(Step), a, n, dtype):
    """See `Engine.set_materials`."""
    ls: cython.pointer(Lists) = w.lists
    if not (w.collides and n["collides"]):
        w.groups = ls.rows = 0
        w.evens = w.odds = w.alone = 0
        w.pins = ls.listed = ls.good = False
    w.sized, w.varied, w.mixed, w.collides = n["sized"], n["varied"], n["mixed"], n["collides"]
    w.surfaces_good = False
    w.cells.bulk, w.cells.smallest, ls.largest, ls.mean_radius = n["bulk"], n["smallest"], n["largest"], n["mean_radius"]
    ls.restitution, ls.friction, ls.rolling = n["restitution"], n["friction"], n["rolling"]
    ls.tests_pairs = n["tests_pairs"] or ls.linked
    ls.refill, ls.brute = True, n["brute"]
    a["together"] = n["together"]
    w.combine, w.materials, w.together = n["combine"], len(n["together"]), doubles(n["together"])
    make_material_arrays(w, a, dtype)
