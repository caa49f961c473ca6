# mypy: ignore-errors
"""The object with which Python has the core make plain frames."""

from __future__ import annotations

from threading import get_ident

import cython
import numpy as np
from cython.cimports.arrays import (
    const_indices_in,
    const_octets,
    const_reals,
    const_reals_in,
    doubles,
    doubles_in,
    indices,
    octets,
    reals,
)
from cython.cimports.libc.math import INFINITY

from pyverlet.core.engine_object import Engine
from pyverlet.core.plain_frames import DOUBTFUL, MADE, OTHERS, RELEASED_FROM, SHORT, Plain, end_times, run_plain
from pyverlet.core.rows import MovingRows, map_motion


@cython.cclass
class PlainFrames:
    """What makes frames of one length of a small world, as long as nothing but motion changes.

    Args:
        engine: that has made such a frame.
        lock: that of the world, `common.step_lock`; taken here, without a step of Python, so that no Ctrl-C comes in between.
        rows, state: position, velocity, acceleration and spin of the engine's order, and of the user's.
        placed: (n,) becomes 1 where the user has put a particle elsewhere.
        order: (n,) the user's index at each sorted index.
        angle: (n,) of the user's.
        slot_mass: (n,) kg.
        numbers, marks: the user's columns, that are to stay what they are.
        law: (6,) seconds and substeps of a frame, gravity, J that a frame may gain, infinite if that is not asked, and m from the
            origin up to which coordinates are precise enough for what rests.
        same: (object, name, value): attributes that are to stay what they are; of the world where there is no object.
        obstacles: such ones as well, which change with obstacles; see `world.plain.follow`.
        empty: lists that are to stay empty.
        end: called with the world and this, ends a frame that the core has doubts about, and that `pending` is about.
        times: (2, FRAMES + 1) that it writes: see there.

    Attributes:
        given: (n, 3) what contacts gave before the last frame, m/s and rad/s.
        limited: whether it is looked at what a frame gains.
        far: whether a particle is beyond that.
        pending: whether Python is still to end one.
        used: whether it has made any.
    """

    p: Plain
    taken: MovingRows
    put: MovingRows
    engine: Engine
    lock = cython.declare(object)
    arrays = cython.declare(tuple)
    same = cython.declare(list)
    obstacles = cython.declare(list, visibility="public")
    empty = cython.declare(list)
    end = cython.declare(object)
    dt = cython.declare(cython.double, visibility="readonly")
    given = cython.declare(object, visibility="readonly")
    limited = cython.declare(cython.bint, visibility="readonly")
    pending = cython.declare(cython.bint, visibility="public")
    used = cython.declare(cython.bint, visibility="readonly")

    def __init__(
        self, engine: Engine, lock, rows, placed, state, order, angle, sorted_mass, numbers, marks, law, same, obstacles, empty,
        end, times,
    ):  # fmt: skip
        p: cython.pointer(Plain) = cython.address(self.p)
        count: cython.Py_ssize_t = len(order)
        self.engine, self.lock, self.same, self.obstacles, self.empty, self.end = engine, lock, same, obstacles, empty, end
        value: cython.p_double = doubles(law)
        self.dt, p.substeps, p.gx, p.gy, p.most, p.precise = (
            value[0], cython.cast(cython.int, value[1]), value[2], value[3], value[4], value[5]
        )  # fmt: skip
        p.left, p.made, self.pending, self.used = 0, 0, False, False
        self.limited = p.limited = p.most < INFINITY
        p.status, p.w = MADE, cython.address(engine.w)
        p.taken, p.put = cython.address(self.taken), cython.address(self.put)
        map_motion(p.taken, rows, state, order)
        map_motion(p.put, state, rows, order)
        self.taken.placed, none = octets(placed), np.zeros(1, np.uint8)
        known, marked, self.given = np.array(numbers), np.array(marks), np.zeros((count, 3), sorted_mass.dtype)
        self.arrays = (rows, placed, state, order, angle, sorted_mass, numbers, marks, times, none, known, marked)
        p.put.turned, p.put.half_dt, p.put.skips = doubles(angle), 0.5 * self.dt, False
        p.put.still, p.put.written = const_octets(none), octets(none)
        p.sorted_mass = const_reals(sorted_mass)
        p.radius, p.mass, p.restitution = const_reals_in(numbers, 0), const_reals_in(numbers, 1), const_reals_in(numbers, 2)
        p.friction, p.rolling, p.inertia = const_reals_in(numbers, 3), const_reals_in(numbers, 4), const_reals_in(numbers, 5)
        p.category, p.mask = const_indices_in(marks, 0), const_indices_in(marks, 1)
        p.material, p.fixed_rotation = const_indices_in(marks, 2), const_indices_in(marks, 3)
        p.known, p.marks, p.given = reals(known), indices(marked), reals(self.given)
        p.last, p.total = doubles_in(times, 0), doubles_in(times, 1)

    def step(self, world, dt) -> bool:
        """Whether a frame of dt seconds of its world was plain, and is made."""
        if not isinstance(dt, float) or dt != self.dt or not self.enter(world):
            return False
        try:
            self.p.left = 1
            self.go_on()
            return self.close(world)
        finally:
            self.leave()

    @property
    def far(self) -> bool:
        return self.p.far

    @cython.cfunc
    def enter(self, world) -> cython.bint:
        """Take the lock, if no one has it or waits for it, and all is what it was."""
        lock = self.lock
        if lock.holder is not None or lock.page is not None or lock._queue.locked() or not lock._lock.acquire(False):
            return False
        lock.holder, lock._depth, lock.in_frame = get_ident(), 1, True
        self.p.status = MADE
        for what, name, value in self.same:
            if getattr(world if what is None else what, name) is not value:
                self.p.status = OTHERS
        for what, name, value in self.obstacles:
            if getattr(what, name) is not value:
                self.p.status = OTHERS
        for listed in self.empty:
            if len(listed) > 0:
                self.p.status = OTHERS
        if self.p.status == OTHERS or self.engine.ls.patching:
            self.leave()
            return False
        return True

    @cython.cfunc
    def leave(self):
        """Give the lock back."""
        lock = self.lock
        lock.holder, lock._depth, lock.in_frame = None, 0, False
        lock._lock.release()

    @cython.cfunc
    def go_on(self):
        """Make the frames that are left, as far as they are plain."""
        p: cython.pointer(Plain) = cython.address(self.p)
        while True:
            if p.w.count < RELEASED_FROM:
                run_plain(p)
            else:
                with cython.nogil:
                    run_plain(p)
            if p.status != SHORT:
                return
            self.reserve()

    @cython.cfunc
    def reserve(self):
        """For as many pairs and surfaces as there are, if arrays are too small, or for notes to be taken."""
        if self.engine.ls.short:
            self.engine.reserve()

    @cython.cfunc
    def close(self, world) -> cython.bint:
        """Frames have been made: the time of the world becomes that of their end. Whether none is left."""
        interrupted = None
        if self.p.status == DOUBTFUL:
            interrupted = self.end_by_python(world)
            end_times(cython.address(self.p))
        for _ in range(self.p.made):
            world.time = world.time + self.dt
        world.frames = world.frames + self.p.made
        self.used = self.used or self.p.made > 0
        self.p.made = 0
        if interrupted is not None:
            raise interrupted
        return self.p.left == 0

    @cython.cfunc
    def end_by_python(self, world):
        """Have Python end a frame. A Ctrl-C comes before it has begun, or when it is over, and is returned."""
        interrupted = None
        self.pending = True
        while self.pending:
            try:
                self.end(world, self)
            except KeyboardInterrupt as error:
                interrupted = error
        return interrupted
