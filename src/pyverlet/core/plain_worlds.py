# mypy: ignore-errors
"""Plain frames of many worlds at once: each thread of a team takes whole worlds."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, integers
from cython.cimports.libc.stdint import int64_t
from cython.cimports.team import team_free, team_new, team_run, team_stage, thread_team

from pyverlet.core.kernels import kernel
from pyverlet.core.plain_frames import SHORT, Plain, run_plain
from pyverlet.core.plain_object import PlainFrames

Many = cython.struct(
    threads=cython.pointer(thread_team),
    plain=cython.pointer(int64_t),  # (count,) addresses
    count=cython.int,
)


@kernel
def run_one(what: cython.p_void, item: cython.int) -> cython.void:
    """Run the frames of one world."""
    many: cython.pointer(Many) = cython.cast(cython.pointer(Many), what)
    run_plain(cython.cast(cython.pointer(Plain), many.plain[item]))


@kernel
def run_each(what: cython.p_void, item: cython.int) -> cython.void:
    """Run the frames of all worlds."""
    many: cython.pointer(Many) = cython.cast(cython.pointer(Many), what)
    team_stage(many.threads, run_one, many, many.count)


@cython.cclass
class PlainWorlds:
    """A team of threads that runs plain frames of many worlds."""

    many: Many
    parts = cython.declare(cython.int)

    def __init__(self, threads: cython.int):
        self.parts, self.many.threads = threads, team_new(threads)
        if self.many.threads == cython.NULL:
            raise MemoryError

    def __dealloc__(self):
        team_free(self.many.threads)

    def step(self, worlds: list, dt: cython.double, frames: cython.int, times):
        """Run frames of dt seconds of these worlds, for each as many of `frames` as are plain.

        times: (n,) s, updated for worlds with any. Returns (n,) the number of frames made, errors by world number, and which
        worlds have particles that are `far`.
        """
        many: cython.pointer(Many) = cython.address(self.many)
        count: cython.Py_ssize_t = len(worlds)
        plain: PlainFrames
        made, address = np.zeros(count, np.int64), np.zeros(count, np.int64)
        errors, far = {}, []
        ready: list = []  # for each world its PlainFrames, or None
        counts: cython.pointer(int64_t) = integers(made)
        time: cython.p_double = doubles(times)
        many.plain, many.count = integers(address), 0
        for k in range(count):
            plain = worlds[k]._plain
            if plain is not None and not (plain.dt == dt and plain.enter(worlds[k])):
                plain = None
            ready.append(plain)
            if plain is not None:
                plain.p.left = frames
                if cython.compiled:
                    many.plain[many.count] = cython.cast(int64_t, cython.address(plain.p))
                    many.count += 1
        if cython.compiled:
            with cython.nogil:
                team_run(many.threads, run_each, many, self.parts)
        for k in range(count):
            plain = ready[k]
            if plain is None:
                continue
            if not cython.compiled or plain.p.status == SHORT:
                plain.reserve()
                plain.go_on()
            counts[k] = frames - plain.p.left
            try:
                plain.close(worlds[k])
                counts[k] = frames - plain.p.left
            except BaseException as error:  # the other worlds are still run
                errors[k] = error
            plain.leave()
            time[k] = worlds[k].time
            if plain.p.far:
                far.append(k)
        return made, errors, far
