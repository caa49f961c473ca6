# mypy: ignore-errors
"""Particles sorted by cell: a stable counting sort in two passes, by bucket of cells and by cell within each bucket.

Pieces of the particles go to the buckets, and buckets to the order, each by one thread: none writes where another does, and what
a bucket needs stays in a cache. Pieces are one behind the other in each bucket, so that the order is that of one pass.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t, uint32_t
from cython.cimports.team import team_stage

from pyverlet.core.cells import Cells, cell_number, grid_coordinate, level_of, reach_of
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step

PIECE = cython.declare(cython.Py_ssize_t, 1024)
MOST_BUCKETS = cython.declare(cython.Py_ssize_t, 64)
"""Particles of a piece at least, and how many pieces, and buckets, there are at most."""


@inlined
def pieces_of(count: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """How many pieces so many particles are cut into."""
    return min(max(count // PIECE, 1), MOST_BUCKETS)


@inlined
def piece_begin(c: cython.pointer(Cells), piece: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """The first particle of a piece."""
    return c.count * piece // pieces_of(c.count)


@inlined
def bucket_begin(c: cython.pointer(Cells), bucket: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """The place of the first particle of a bucket, after `buckets_stage`."""
    pieces: cython.Py_ssize_t = pieces_of(c.count)
    return c.tally[(pieces - 1) * pieces + bucket - 1] if bucket > 0 else 0


@inlined
def buckets_of(c: cython.pointer(Cells)) -> cython.int:
    """How many buckets there are, never more than pieces."""
    return cython.cast(cython.int, (c.total >> c.bits) + 1)


@kernel
def cells_stage(what: cython.p_void, piece: cython.int) -> cython.void:
    """The cell of each particle of a piece: none of the few that are much larger than all others, or reach much farther."""
    c: cython.pointer(Cells) = cython.cast(cython.pointer(Step), what).cells
    own: cython.Py_ssize_t = piece * pieces_of(c.count)
    for k in range(buckets_of(c)):
        c.tally[own + k] = 0
    for i in range(piece_begin(c, piece), piece_begin(c, piece + 1)):
        cell: int64_t = c.total
        reach: real = reach_of(c, i)
        if c.radius[i] <= c.bulk and reach <= c.widest:
            level: cython.int = level_of(c, reach) if c.levels > 1 else 0
            column: int64_t = cell_number((grid_coordinate(c, c.position, i, 0) - c.u0) * c.across[level], c.width[level])
            row: int64_t = cell_number((grid_coordinate(c, c.position, i, 1) - c.v0) * c.along[level], c.height[level])
            cell = c.base[level] + row * c.width[level] + column
        c.cell[i] = cython.cast(uint32_t, cell)
        c.tally[own + (cell >> c.bits)] += 1


@kernel
def buckets_stage(what: cython.p_void, piece: cython.int) -> cython.void:
    """The particles of a piece go to their buckets."""
    c: cython.pointer(Cells) = cython.cast(cython.pointer(Step), what).cells
    own: cython.Py_ssize_t = piece * pieces_of(c.count)
    for i in range(piece_begin(c, piece), piece_begin(c, piece + 1)):
        at: cython.Py_ssize_t = own + (c.cell[i] >> c.bits)
        c.mixed[c.tally[at]] = cython.cast(uint32_t, i)
        c.tally[at] += 1


@kernel
def spots_stage(what: cython.p_void, bucket: cython.int) -> cython.void:
    """Places and radii of a bucket in the order of the cells; they are in no batch."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.pointer(Cells) = w.cells
    for k in range(bucket_begin(c, bucket), bucket_begin(c, bucket + 1)):
        i: cython.Py_ssize_t = c.order[k]
        c.spot_u[k], c.spot_v[k] = grid_coordinate(c, c.position, i, 0), grid_coordinate(c, c.position, i, 1)
        c.spot_r[k] = reach_of(c, i)
        w.lists.batch[k] = 0xFFFFFFFF


@kernel
def order_stage(what: cython.p_void, bucket: cython.int) -> cython.void:
    """A bucket in the order of the cells; start[k] of its cells is in the end the number of particles in all cells before k."""
    c: cython.pointer(Cells) = cython.cast(cython.pointer(Step), what).cells
    first: int64_t = cython.cast(int64_t, bucket) << c.bits
    last: int64_t = min(first + (cython.cast(int64_t, 1) << c.bits) - 1, c.total)
    begin: cython.Py_ssize_t = bucket_begin(c, bucket)
    end: cython.Py_ssize_t = bucket_begin(c, bucket + 1)
    place: uint32_t = cython.cast(uint32_t, begin)
    held: uint32_t
    falls: uint32_t = 0
    k: int64_t
    n: cython.Py_ssize_t
    for k in range(first, last + 1):
        c.start[k] = 0
    for n in range(begin, end):
        c.start[c.cell[c.mixed[n]]] += 1
    for k in range(first, last + 1):
        held = c.start[k]
        c.start[k] = place
        place += held
    for n in range(begin, end):
        k = c.cell[c.mixed[n]]
        c.order[c.start[k]] = c.mixed[n]
        c.start[k] += 1
    for k in range(last, first, -1):  # each is where its cell ends, which is where the next begins
        c.start[k] = c.start[k - 1]
    c.start[first] = cython.cast(uint32_t, begin)
    for n in range(begin + 1, end):
        falls += c.order[n] < c.order[n - 1]
    c.tally[pieces_of(c.count) * pieces_of(c.count) + bucket] = falls
    spots_stage(what, bucket)


@kernel
def sort_cells(w: cython.pointer(Step)) -> cython.void:
    """The particles in the order of the cells, how many stand in any, and how often their order falls."""
    c: cython.pointer(Cells) = w.cells
    pieces: cython.int = cython.cast(cython.int, pieces_of(c.count))
    place: cython.Py_ssize_t = 0
    held: uint32_t
    piece: cython.int
    bucket: cython.int
    c.bits = 0
    while (c.total >> c.bits) >= pieces:
        c.bits += 1
    team_stage(w.team, cells_stage, w, pieces)
    for bucket in range(buckets_of(c)):
        for piece in range(pieces):
            held = c.tally[piece * pieces + bucket]
            c.tally[piece * pieces + bucket] = cython.cast(uint32_t, place)
            place += held
    team_stage(w.team, buckets_stage, w, pieces)
    team_stage(w.team, order_stage, w, buckets_of(c))
    c.celled = c.start[c.total]
    c.falls = 0
    for bucket in range(buckets_of(c)):
        place = bucket_begin(c, bucket)
        c.falls += c.tally[pieces * pieces + bucket]
        c.falls += 0 < place < bucket_begin(c, bucket + 1) and c.order[place] < c.order[place - 1]
