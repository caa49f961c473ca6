# mypy: ignore-errors
"""Writes the results of a frame to the tables of links, which are valid between frames."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_integers, const_small_integers, doubles_in, octets_in
from cython.cimports.libc.math import hypot
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t


def put_links(pool, links, prefix, names, row) -> int:
    """Copy the state of these links to their rows of `pool`; returns how many have broken.

    names: columns, (n, 2) in the pool, (k,) of links or (k, 2) of pins, whose names in `links` have a prefix.
    """
    which: cython.pointer[cython.const[int64_t]] = const_integers(row)
    intact: cython.pointer(uint8_t) = octets_in(pool, "intact")
    force: cython.pointer(cython.double) = doubles_in(pool, "force")
    whole: cython.pointer[cython.const[int32_t]] = const_small_integers(links[prefix + "intact"])
    pull: cython.pointer[cython.const[cython.double]] = const_doubles(links[prefix + "pull"])
    wide: cython.Py_ssize_t = 2 if prefix else 1
    count: cython.Py_ssize_t = len(row)
    broken: cython.Py_ssize_t = 0
    for name in names:
        to: cython.pointer(cython.double) = doubles_in(pool, name)
        now: cython.pointer[cython.const[cython.double]] = const_doubles(links[prefix + name])
        for k in range(count):
            to[2 * which[k]] = now[wide * k]
            to[2 * which[k] + 1] = now[wide * k + wide - 1]
    for k in range(count):
        pulls: cython.double = hypot(pull[2 * k], pull[2 * k + 1]) if wide == 2 else pull[k]
        intact[which[k]] = whole[k] != 0
        force[which[k]] = pulls if whole[k] != 0 else 0.0
        broken += whole[k] == 0
    return broken
