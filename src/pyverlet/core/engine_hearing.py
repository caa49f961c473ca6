# mypy: ignore-errors
"""What was heard of contacts, as Python takes it."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import reals, small_integers

from pyverlet.core.step import Step
from pyverlet.core.surface_rows import HEARD, HEARD_BOUNCES, HEARD_SPEED


@cython.cfunc
def make_hearing_arrays(w: cython.pointer(Step), a, dtype):
    """One a lane, if somebody listens."""
    lanes = w.lists.lanes_room if w.listening else 0
    if "met" not in a or len(a["met"]) < lanes:
        a["met"], a["touched"], a["bounces"] = np.zeros(lanes, dtype), np.zeros(lanes, np.int32), np.zeros(lanes, np.int32)
        w.met, w.touched, w.bounces = reals(a["met"]), small_integers(a["touched"]), small_integers(a["bounces"])


@cython.cfunc
def hear(w: cython.pointer(Step), a):
    """((i, j, speed, bounces), (slot, surface, speed, bounces)) of those that touch, by slot; they are then forgotten."""
    if "depth" in a:
        make_hearing_arrays(w, a, a["depth"].dtype)
    groups, none = w.groups, np.zeros(0, np.int64)
    parts = [np.arange(w.begin[s], w.begin[s] + w.lanes[s]) for s in range(groups)]
    lane = np.concatenate([none, *parts])
    pairs = tuple(none for _ in range(4))
    if len(lane):
        lane = lane[a["touched"][lane] > 0]
        pairs = a["i"][lane].astype(np.int64), a["j"][lane].astype(np.int64), a["met"][lane].astype(float), a["bounces"][lane]
        for name in ("met", "touched", "bounces"):
            a[name].fill(0)
    if w.count <= 0 or not w.surfaces_good:
        return pairs, tuple(none for _ in range(4))
    begin, end, rows = (a[f"{name}{w.side}"] for name in ("contact_begin", "contact_end", "contact"))
    count = end - begin
    slot = np.repeat(np.arange(w.count), count)
    place = np.arange(len(slot)) - np.repeat(np.cumsum(count) - count, count) + begin[slot]
    touching = rows[place, HEARD] > 0
    slot, place = slot[touching], place[touching]
    surfaces = (
        slot,
        a[f"surface{w.side}"][place].astype(np.int64),
        rows[place, HEARD_SPEED],
        rows[place, HEARD_BOUNCES].astype(np.int64),
    )
    rows[:, HEARD_SPEED : HEARD + 1] = 0
    return pairs, surfaces
