# mypy: ignore-errors
"""Copies rows between the user's order and rows, and detects changed columns; by a team of threads."""

from __future__ import annotations

import cython
from cython.cimports.arrays import (
    const_indices,
    const_octets,
    const_reals,
    const_reals_in,
    const_small_integers,
    doubles,
    octets,
    reals_in,
)
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, uint8_t, uint32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.sharing import by_team

ROWS_SHARED = cython.declare(cython.Py_ssize_t, 2048)
"""Rows per work item of a thread."""

STILL = cython.declare(cython.Py_ssize_t, 512)
"""Rows per `still` flag: a BLOCK of `core.cells`, of which ROWS_SHARED is a multiple."""

WRITTEN = cython.declare(cython.Py_ssize_t, 4096)
"""The user's rows per flag of written blocks: see `core.checksum`."""

MovingRows = cython.struct(
    count=cython.Py_ssize_t,
    x=cython.pointer(real),
    v=cython.pointer(real),
    a=cython.pointer(real),
    s=cython.pointer(real),
    x_from=cython.pointer[cython.const[real]],
    v_from=cython.pointer[cython.const[real]],
    a_from=cython.pointer[cython.const[real]],
    s_from=cython.pointer[cython.const[real]],
    order=cython.pointer[cython.const[int32_t]],
    turned=cython.p_double,
    half_dt=cython.double,
    skips=cython.bint,
    placed=cython.pointer(uint8_t),
    still=cython.pointer[cython.const[uint8_t]],
    written=cython.pointer(uint8_t),
)


@kernel
def take_rows(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy rows to a block of rows, and mark those that the user has moved."""
    m: cython.pointer(MovingRows) = cython.cast(cython.pointer(MovingRows), what)
    for k in range(block * ROWS_SHARED, min((block + 1) * ROWS_SHARED, m.count)):
        i: cython.Py_ssize_t = m.order[k]
        m.placed[k] = m.x[2 * k] != m.x_from[2 * i] or m.x[2 * k + 1] != m.x_from[2 * i + 1]
        m.x[2 * k], m.x[2 * k + 1] = m.x_from[2 * i], m.x_from[2 * i + 1]
        m.v[2 * k], m.v[2 * k + 1] = m.v_from[2 * i], m.v_from[2 * i + 1]
        m.a[2 * k], m.a[2 * k + 1] = m.a_from[2 * i], m.a_from[2 * i + 1]
        m.s[k] = m.s_from[i]


@kernel
def put_rows(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy rows of a block of rows back."""
    m: cython.pointer(MovingRows) = cython.cast(cython.pointer(MovingRows), what)
    for b in range(block * ROWS_SHARED // STILL, (min((block + 1) * ROWS_SHARED, m.count) + STILL - 1) // STILL):
        if m.skips and m.still[b]:
            continue
        for k in range(b * STILL, min((b + 1) * STILL, m.count)):
            i: cython.Py_ssize_t = m.order[k]
            spins: cython.double = cython.cast(cython.double, m.s[i]) + cython.cast(cython.double, m.s_from[k])
            if spins != 0:
                m.turned[i] += m.half_dt * spins
            m.x[2 * i], m.x[2 * i + 1] = m.x_from[2 * k], m.x_from[2 * k + 1]
            m.v[2 * i], m.v[2 * i + 1] = m.v_from[2 * k], m.v_from[2 * k + 1]
            m.a[2 * i], m.a[2 * i + 1] = m.a_from[2 * k], m.a_from[2 * k + 1]
            m.s[i] = m.s_from[k]
            m.written[i // WRITTEN] = 1


@cython.cfunc
def map_motion(m: cython.pointer(MovingRows), to, of, index):
    """Set the addresses of position, velocity, acceleration and spin to write and to read."""
    m.count = len(index)
    m.x, m.v, m.a, m.s = reals_in(to, 0), reals_in(to, 1), reals_in(to, 2), reals_in(to, 3)
    m.x_from, m.v_from = const_reals_in(of, 0), const_reals_in(of, 1)
    m.a_from, m.s_from = const_reals_in(of, 2), const_reals_in(of, 3)
    m.order = const_small_integers(index)


def take_motion(rows, given, index, placed, threads: cython.size_t, parts: cython.int):
    """Copy position, velocity, acceleration and spin: row k of the rows from row index[k] of those given.

    placed: (n,) set to 1 where the position changes, else 0. threads, parts: address of a team, or 0, and the number of its
    threads to use.
    """
    own: MovingRows
    m: cython.pointer(MovingRows) = cython.address(own)
    map_motion(m, rows, given, index)
    m.placed = octets(placed)
    with cython.nogil:
        by_team(threads, parts, take_rows, m, cython.cast(cython.int, (m.count + ROWS_SHARED - 1) // ROWS_SHARED))


def put_motion(
    rows, given, angle, half_dt: cython.double, index, still, written, threads: cython.size_t, parts: cython.int
):  # fmt: skip
    """Copy rows of rows back to the user's. Angles advance by the mean of the old and new spins.

    still: (blocks,) which to leave out, or empty. written: (blocks of rows,) set to 1 where one was written.
    """
    own: MovingRows
    m: cython.pointer(MovingRows) = cython.address(own)
    map_motion(m, given, rows, index)
    m.turned, m.half_dt, m.skips = doubles(angle), half_dt, len(still) > 0
    m.still, m.written = const_octets(still), octets(written)
    with cython.nogil:
        by_team(threads, parts, put_rows, m, cython.cast(cython.int, (m.count + ROWS_SHARED - 1) // ROWS_SHARED))


Columns = cython.struct(
    count=cython.Py_ssize_t,
    step=cython.Py_ssize_t,  # 0: a single number for equal ones
    one=cython.pointer[cython.const[real]],
    other=cython.pointer[cython.const[real]],
    mark=cython.pointer[cython.const[uint32_t]],
    other_mark=cython.pointer[cython.const[uint32_t]],
    of_marks=cython.bint,
    differ=cython.bint,
)


@kernel
def compare_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Compare a block of two columns of numbers, or of marks."""
    c: cython.pointer(Columns) = cython.cast(cython.pointer(Columns), what)
    first: cython.Py_ssize_t = block * ROWS_SHARED
    last: cython.Py_ssize_t = min(first + ROWS_SHARED, c.count)
    differ: uint32_t = 0
    if c.of_marks and c.step == 0:
        mark: uint32_t = c.mark[0]
        for k in range(first, last):
            differ |= c.other_mark[k] ^ mark
    elif c.of_marks:
        for k in range(first, last):
            differ |= c.mark[k] ^ c.other_mark[k]
    elif c.step == 0:
        alike: real = c.one[0]
        for k in range(first, last):
            differ |= c.other[k] != alike
    else:
        for k in range(first, last):
            differ |= c.one[k] != c.other[k]
    if differ != 0:
        c.differ = True


def any_differs(numbers, now, marks, marks_now, threads: cython.size_t, parts: cython.int) -> bool:
    """Whether any of these columns of numbers, or of marks, has changed; a single number stands for equal ones."""
    own: Columns
    c: cython.pointer(Columns) = cython.address(own)
    c.differ = False
    for of_marks, columns, others in ((False, numbers, now), (True, marks, marks_now)):
        for one, other in zip(columns, others, strict=True):
            c.count, c.step = len(other), 0 if len(one) == 1 else 1
            if c.step == 1 and len(one) != c.count:
                return True
            if of_marks:
                c.mark, c.other_mark = const_indices(one), const_indices(other)
            else:
                c.one, c.other = const_reals(one), const_reals(other)
            c.of_marks = of_marks
            with cython.nogil:
                by_team(threads, parts, compare_stage, c, cython.cast(cython.int, (c.count + ROWS_SHARED - 1) // ROWS_SHARED))
            if c.differ:
                return True
    return False
