"""The limit on threads and processes."""

import os
from functools import cache

from pyverlet.common.errors import InputError


@cache
def max_threads() -> int:
    """The processors that this process may use, or the value of the environment variable PYVERLET_THREADS.

    Raises:
        InputError: it is not an integer of at least 1.
    """
    asked = os.environ.get("PYVERLET_THREADS", "")
    if asked:
        if not asked.isdecimal() or int(asked) < 1:
            raise InputError(f"PYVERLET_THREADS is {asked!r}; allowed is a whole number of at least 1")
        return int(asked)
    if hasattr(os, "sched_getaffinity"):
        return max(len(os.sched_getaffinity(0)), 1)
    return os.cpu_count() or 1
