"""What time it is, told to a compiled function: stages that are replayed without Python (`_trace`) are timed all the same."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from numba.core import types

from pyverlet.compile import entry
from pyverlet.compile.jit import kernel

CLOCK = id(perf_counter)
"""What `note` is to look at."""

_ask = types.ExternalFunction("PyObject_CallNoArgs", types.int64(types.int64))
_seconds = types.ExternalFunction("PyFloat_AsDouble", types.float64(types.int64))
_release = types.ExternalFunction("Py_DecRef", types.void(types.int64))


@kernel
def _note(spent: Any, stage: Any, clock: Any) -> None:
    """`note`; only an entry may call it, for it needs the interpreter's lock."""
    answer = _ask(clock)
    now = _seconds(answer)
    _release(answer)
    spent[stage] += now - spent[0]
    spent[0] = now


@kernel
def keep(spent: Any, complete: Any, total: Any) -> None:
    """A frame is complete: what has been noted in it is kept, and added up, and nothing has been noted in the next."""
    for stage in range(spent.shape[0]):
        complete[stage] = spent[stage]
        total[stage] += spent[stage]
        spent[stage] = 0.0


def _note_in_python(spent: Any, stage: int, clock: int) -> None:
    now = perf_counter()
    spent[stage] += now - spent[0]
    spent[0] = now


note = _note if entry.usable() else _note_in_python
"""(spent, stage, CLOCK): spent[stage] += seconds since the last note; spent[0] is when that was, by `time.perf_counter`."""
