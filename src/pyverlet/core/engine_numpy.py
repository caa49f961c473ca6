"""Parts of the engine that need only NumPy: ordinary Python, as compiling would only enlarge it.

Column numbers are passed as arguments, because they belong to compiled modules.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.common.arrays import Array

Arrays = dict[str, Array]

MOST_TOGETHER: Final = 12
"""Largest set of particles joined by rigid links that takes an impact as a whole; in larger nets sweeps would not suffice."""


def have_zeros(a: Arrays, shapes: dict[str, tuple[tuple[int, ...], DTypeLike]]) -> bool:
    """Allocate zeros for arrays that are missing or have another shape; returns whether any was."""
    missing = {name: kind for name, kind in shapes.items() if name not in a or a[name].shape != kind[0]}
    a |= {name: np.zeros(shape, dtype) for name, (shape, dtype) in missing.items()}
    return bool(missing)


# ---- links -------------------------------------------------------------------------------------------------------------------


def have_link_arrays(a: Arrays, motor: int) -> None:
    """Allocate the arrays that only the core uses, besides those of `world/core_links.py`. motor: kind of motor rows."""
    particles, rows, pins = len(a["sorted_index"]), len(a["kind"]), len(a["pin_node"])
    a |= {name: np.zeros((particles, 2)) for name in ("x", "u", "warmed", "driven", "react")}
    a |= {name: np.zeros(particles) for name in ("own", "weight", "rim", "ease", "spun", "struck")}
    a["begun"] = np.zeros((particles, 3))
    a |= {name: np.zeros((len(a["node"]), 2)) for name in ("gradient", "slope")}
    a |= {name: np.zeros(rows) for name in ("soft", "target", "turned", "turning", "keeps", "chord_speed", "impact", "saved")}
    a |= {name: np.zeros((rows, 2)) for name in ("way", "end_way", "given", "along", "wanted", "answer", "had")}
    a |= {"inverse": np.zeros((rows, 3)), "ahead": np.zeros((rows, 3)), "acts": np.zeros(rows, np.int32)}
    a["has_friction"] = np.ones(particles, np.int32)
    a["held"] = np.full(particles, -1, np.int32)
    driven = a["node"][a["first"][:-1][a["kind"] == motor]]
    a["powered"] = np.bincount(driven, minlength=particles).astype(np.int32)
    a["stiff"] = stiff_ones(a, motor)
    a |= {"pin_soft": np.zeros(pins), "pin_target": np.zeros((pins, 2))}


def stiff_ones(a: Arrays, motor: int) -> Array:
    """(particles,) whether a rigid row or pin holds each linked particle, in sets small enough to take impacts as a whole."""
    count, entries = len(a["sorted_index"]), np.diff(a["first"])
    rigid = np.repeat(np.isinf(a["stiffness"]) & (a["kind"] != motor), entries)
    node, row = a["node"][rigid], np.repeat(np.arange(len(entries)), entries)[rigid]
    lowest, held = np.arange(count), np.bincount(node, minlength=count)
    held += np.bincount(a["pin_node"][np.isinf(a["pin_stiffness"])], minlength=count)
    before = None
    while before is None or (lowest != before).any():
        before, least = lowest.copy(), np.full(len(entries), count)
        np.minimum.at(least, row, lowest[node])
        np.minimum.at(lowest, node, least[row])
        lowest = lowest[lowest]
    return ((held > 0) & (np.bincount(lowest, minlength=count)[lowest] <= MOST_TOGETHER)).astype(np.int32)


def have_rebound_arrays(a: Arrays, count: int, blocks: int, lanes: int, places: int, impact: int, rebound: int) -> None:
    """Allocate arrays for particles, blocks, groups, lanes, and places of surfaces; impact, rebound: numbers of columns."""
    groups = len(a["bounced"])
    have_zeros(
        a,
        {
            "impact": ((count, impact), np.float64),
            "node": ((count,), np.int32),
            "rebounds": ((blocks,), np.int32),
            "rebounded": ((groups,), np.int32),
            "rebounding": ((groups,), np.int32),
            "rebound_sum": ((groups + blocks, 2), np.float64),
            "rebound_pair": ((lanes,), np.int64),
            "pair_rebound": ((lanes, rebound), np.float64),
            "surface_rebound": ((places, rebound), np.float64),
        },
    )


# ---- contacts ----------------------------------------------------------------------------------------------------------------


def runs(begin: Array, count: Array) -> tuple[Array, Array]:
    """(owner, place) of consecutive ranges: `count` places from `begin` on for each owner."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) + np.repeat(begin - (np.cumsum(count) - count), count)


def places_of(a: Arrays) -> tuple[Array, Array]:
    """(sorted_index, place) of the contacts in the list of surfaces."""
    return runs(a["contact_begin"], a["contact_end"] - a["contact_begin"])


def listed_pairs(a: Arrays, groups: int) -> tuple[Array, ...]:
    """(first, count, i, j): the ranges of the pairs of each group."""
    if not groups:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.uint32), np.zeros(0, np.uint32)
    return a["begin"][:groups], a["lanes"][:groups], a["i"], a["j"]


def renumber_list(a: Arrays, order: Array, groups: int) -> None:
    """Renumber rows in the list: the particle of row order[k] moves to row k."""
    place = np.empty(len(order), np.uint32)
    place[order] = np.arange(len(order), dtype=np.uint32)
    for s in range(groups):
        lanes = slice(a["begin"][s], a["begin"][s] + a["lanes"][s])
        for name in ("i", "j"):
            a[name][lanes] = place[a[name][lanes]]
    for name in ("listed", "checked"):
        a[name][:] = a[name][order]
    a["order"][:] = np.arange(len(order), dtype=np.uint32)


def remembered_at_surfaces(a: Arrays, side: int, push: int, roll: int, held: int) -> tuple[Array, Array, Array]:
    """(sorted_index, surface, values) of loaded contacts, and those with one-way lines; the load is -1 where these let pass."""
    sorted_index, place = places_of(a)
    rows, surface = a[f"contact{side}"], a[f"surface{side}"][place]
    values, holds = rows[place // 8, push // 8 : roll // 8 + 1, place % 8], rows[place // 8, held // 8, place % 8]
    values[holds < 0, 0] = -1
    loaded = ((values[:, 0] > 0) | (holds != 0)) & (surface >= 0)  # contacts with pinned circles are stored as pairs
    return sorted_index[loaded].astype(np.int32), surface[loaded], values[loaded]


def remember_at_surfaces(a: Arrays, side: int, known: tuple[Array, Array, Array], push: int, roll: int, held: int) -> None:
    """Write (sorted_index, surface, values), sorted by row, to one of the two surface lists."""
    sorted_index, surface, values = known
    rows, place = a[f"contact{side}"], np.arange(len(sorted_index))
    a[f"surface{side}"][: len(sorted_index)] = surface
    rows[place // 8, push // 8 : roll // 8 + 1, place % 8] = values
    rows[place // 8, held // 8, place % 8] = np.where(values[:, 0] < 0, -1, 1)
    rows[place // 8, push // 8, place % 8] = np.maximum(values[:, 0], 0)
    particles = np.arange(len(a["contact_begin"]))
    a["contact_begin"][:] = np.searchsorted(sorted_index, particles, "left")
    a["contact_end"][:] = np.searchsorted(sorted_index, particles, "right")


def bits_set(words: Array) -> tuple[Array, Array]:
    """(row, bit) of all set bits in (count, words) of 32 bits, by row."""
    row, word = np.nonzero(words)
    which, bit = np.nonzero((words[row, word][:, None] >> np.arange(32, dtype=np.uint32)) & 1)
    return row[which], 32 * word[which] + bit
