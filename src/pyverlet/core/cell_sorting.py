# mypy: ignore-errors
"""Sorts particles by cell: a stable counting sort in two passes, by bucket of cells and by cell within each bucket.

Chunks of particles are distributed to buckets, and buckets are sorted, each by one thread without shared writes; a bucket fits
into a cache. Chunks follow each other in each bucket, so that the order equals that of a single pass.
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
"""Least number of particles per piece, and most pieces and buckets."""


@inlined
def pieces_of(count: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Number of pieces for so many particles."""
    return min(max(count // PIECE, 1), MOST_BUCKETS)


@inlined
def piece_begin(c: cython.pointer(Cells), piece: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """First particle of a piece."""
    return c.count * piece // pieces_of(c.count)


@inlined
def bucket_begin(c: cython.pointer(Cells), bucket: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Position of a bucket's first particle, after `buckets_stage`."""
    pieces: cython.Py_ssize_t = pieces_of(c.count)
    return c.tally[(pieces - 1) * pieces + bucket - 1] if bucket > 0 else 0


@inlined
def buckets_of(c: cython.pointer(Cells)) -> cython.int:
    """Number of buckets, at most that of pieces."""
    return cython.cast(cython.int, (c.total >> c.bits) + 1)


@kernel
def cells_stage(what: cython.p_void, piece: cython.int) -> cython.void:
    """Compute the cell of each particle of a piece; the few that are much larger or move much farther get none."""
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
    """Distribute the particles of a piece to buckets."""
    c: cython.pointer(Cells) = cython.cast(cython.pointer(Step), what).cells
    own: cython.Py_ssize_t = piece * pieces_of(c.count)
    for i in range(piece_begin(c, piece), piece_begin(c, piece + 1)):
        at: cython.Py_ssize_t = own + (c.cell[i] >> c.bits)
        c.mixed[c.tally[at]] = cython.cast(uint32_t, i)
        c.tally[at] += 1


@kernel
def spots_stage(what: cython.p_void, bucket: cython.int) -> cython.void:
    """Positions and radii of a bucket in cell order; places after the end match nothing."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.pointer(Cells) = w.cells
    for k in range(bucket_begin(c, bucket), bucket_begin(c, bucket + 1)):
        i: cython.Py_ssize_t = c.order[k]
        c.spot_u[k], c.spot_v[k] = grid_coordinate(c, c.position, i, 0), grid_coordinate(c, c.position, i, 1)
        c.spot_r[k] = reach_of(c, i)
        w.lists.batch[k] = 0xFFFFFFFF


@kernel
def order_stage(what: cython.p_void, bucket: cython.int) -> cython.void:
    """Sort a bucket by cell; afterwards start[k] is the number of particles in all cells before k."""
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
    for k in range(last, first, -1):  # ends of cells become starts
        c.start[k] = c.start[k - 1]
    c.start[first] = cython.cast(uint32_t, begin)
    for n in range(begin + 1, end):
        falls += c.order[n] < c.order[n - 1]
    c.tally[pieces_of(c.count) * pieces_of(c.count) + bucket] = falls
    spots_stage(what, bucket)


@kernel
def sort_cells(w: cython.pointer(Step)) -> cython.void:
    """Sort particles by cell; count those in cells, and how often their order descends."""
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
