# mypy: ignore-errors
"""What the time of a frame is charged to."""

from __future__ import annotations

import cython
from cython.cimports.team import team_clock, team_spent, thread_team

from pyverlet.core.kernels import kernel

OTHER = cython.declare(cython.int, 0)
LISTS = cython.declare(cython.int, 1)  # of pairs and surfaces, and sorting by cell for them
INTEGRATE = cython.declare(cython.int, 2)  # kick and drift
SURFACES = cython.declare(cython.int, 3)
PAIRS = cython.declare(cython.int, 4)
RELAX = cython.declare(cython.int, 5)
LINKS = cython.declare(cython.int, 6)
NOTES = cython.declare(cython.int, 7)  # for the ledger and events

NAMES = ("contacts", "lists", "integrate", "surfaces", "pairs", "relax", "links", "notes")  # in `World.profile`

TIMED_FROM = cython.declare(cython.Py_ssize_t, 256)
"""Particles: frames of fewer are so short that looking at the clock would show."""


@kernel
def begin_spans(team: cython.pointer(thread_team), particles: cython.Py_ssize_t) -> cython.void:
    """The clock starts, if there are particles enough."""
    team.timed = particles >= TIMED_FROM
    team.since = team_clock()


@cython.cfunc
def spans_of(team: cython.pointer(thread_team)):
    """name: (seconds, threads that did something) of what was done since the last call."""
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
