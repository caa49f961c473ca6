# mypy: ignore-errors
"""Distributes blocks of arrays over the threads of a world's team, outside of substeps."""

from __future__ import annotations

import cython
from cython.cimports.team import team_function, team_run, team_stage, thread_team

from pyverlet.core.kernels import kernel

Share = cython.struct(
    threads=cython.pointer(thread_team),
    function=team_function,
    argument=cython.p_void,
    items=cython.int,
)


@kernel
def share_items(what: cython.p_void, part: cython.int) -> cython.void:
    """Run all items as a stage of the team."""
    share: cython.pointer(Share) = cython.cast(cython.pointer(Share), what)
    team_stage(share.threads, share.function, share.argument, share.items)


@kernel
def by_team(
    threads: cython.size_t, parts: cython.int, function: team_function, argument: cython.p_void, items: cython.int
) -> cython.void:
    """Call function(argument, item) for each item, by `parts` threads of the team at this address; 0: on this thread alone."""
    own: Share
    share: cython.pointer(Share) = cython.address(own)
    if parts < 2 or items < 2:
        threads = 0
    share.threads, share.function = cython.cast(cython.pointer(thread_team), threads), function
    share.argument, share.items = argument, items
    team_run(share.threads, share_items, share, parts)
