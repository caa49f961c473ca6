# mypy: ignore-errors
"""Stages to which the time of a frame is charged."""

from __future__ import annotations

import cython
from cython.cimports.team import team_clock, team_spent, thread_team

from pyverlet.core.kernels import kernel

OTHER = cython.declare(cython.int, 0)
LISTS = cython.declare(cython.int, 1)  # making lists of pairs and surfaces, including the cell sort
INTEGRATE = cython.declare(cython.int, 2)  # kick and drift
SURFACES = cython.declare(cython.int, 3)
PAIRS = cython.declare(cython.int, 4)
RELAX = cython.declare(cython.int, 5)
LINKS = cython.declare(cython.int, 6)
NOTES = cython.declare(cython.int, 7)  # records for the ledger and events

NAMES = ("contacts", "lists", "integrate", "surfaces", "pairs", "relax", "links", "notes")  # as in `World.profile`

TIMED_FROM = cython.declare(cython.Py_ssize_t, 256)
"""Least number of particles: in smaller frames reading the clock would take noticeable time."""


@kernel
def begin_spans(team: cython.pointer(thread_team), particles: cython.Py_ssize_t) -> cython.void:
    """Start the clock, if there are enough particles."""
    team.timed = particles >= TIMED_FROM
    team.since = team_clock()


@cython.cfunc
def spans_of(team: cython.pointer(thread_team)):
    """name: (seconds, active threads) since the last call."""
    spent: cython.double = 0
    k: cython.int
    found = {}
    if not team.timed:
        return found
    for k in range(NOTES + 1):
        threads: cython.int = team_spent(team, k, cython.address(spent))
        if spent > 0:
            found[NAMES[k]] = spent, threads
    return found
