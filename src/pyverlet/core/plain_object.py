# mypy: ignore-errors
"""The `PlainFrames` class, with which Python runs plain frames in the core."""

from __future__ import annotations

from itertools import chain
from threading import get_ident

import cython
import numpy as np
from cython.cimports.arrays import (
    const_indices_in,
    const_integers,
    const_octets,
    const_reals,
    const_reals_in,
    doubles,
    doubles_in,
    indices,
    octets,
    reals,
    singles,
)
from cython.cimports.libc.math import INFINITY

from pyverlet.core.engine_object import Engine
from pyverlet.core.plain_frames import DOUBTFUL, MADE, OTHERS, RELEASED_FROM, SHORT, Plain, end_times, find_far, run_plain
from pyverlet.core.rows import MovingRows, map_motion


@cython.cclass
class PlainFrames:
    """Runs frames of one length of a small world, as long as only motion changes.

    Args:
        engine: which has made such a frame.
        lock: that of the world, `common.step_lock`; taken here, without running Python code, so that no Ctrl-C intervenes.
        rows, state: position, velocity, acceleration and spin in the engine's order, and in the user's.
        placed: (n,) becomes 1 where the user has moved a particle.
        order: (n,) the user's index of each row.
        angle: (n,) in the user's order.
        sorted_mass: (n,) kg.
        numbers, marks: the user's columns, which must stay unchanged.
        law: (8,) seconds and substeps of a frame, gravity, J that a frame may gain, infinite for no limit, m from the origin
            up to which coordinates are precise enough for particles at rest, and the limit and time of `core.resting`.
        same: (object, name, value): attributes that must stay unchanged; of the world if the object is None.
        checked, changes: such attributes, which change only when `changes.latest` does; see `common.checked`.
        obstacles: such attributes, which change with obstacles; see `world.plain.follow`.
        empty: lists that must stay empty.
        end: called with the world and this object to end a frame that is in doubt, while `pending`.
        times: (2, FRAMES + 1), written here; see there.
        sleepers, asleep: whether anyone sleeps, and whether nothing moves.
        timers, free: (n,) s and rows, as in `core.resting`; no rows if none sleeps.

    Attributes:
        given: (n, 3) contact impulses before the last frame, m/s and rad/s.
        limited: whether the energy gain of frames is checked.
        far: whether a particle is beyond that distance from the origin.
        reached: number of substeps of the last frame that the core has made.
        pending: whether Python must still end a frame.
        used: whether it has made any frames.
    """

    p: Plain
    taken: MovingRows
    put: MovingRows
    engine: Engine
    lock = cython.declare(object)
    arrays = cython.declare(tuple)
    same = cython.declare(tuple)  # object, name and value, one after the other: a tuple each took a cache line each
    checked = cython.declare(tuple)
    changes = cython.declare(object)
    seen = cython.declare(object)  # `changes.latest` when `checked` were last compared
    obstacles = cython.declare(list, visibility="public")
    empty = cython.declare(list)
    end = cython.declare(object)
    dt = cython.declare(cython.double, visibility="readonly")
    given = cython.declare(object, visibility="readonly")
    limited = cython.declare(cython.bint, visibility="readonly")
    pending = cython.declare(cython.bint, visibility="public")
    used = cython.declare(cython.bint, visibility="readonly")

    def __init__(
        self, engine: Engine, lock, rows, placed, state, order, angle, sorted_mass, numbers, marks, law, same, checked,
        changes, obstacles, empty, end, times, sleepers, asleep, timers, free,
    ):  # fmt: skip
        p: cython.pointer(Plain) = cython.address(self.p)
        count: cython.Py_ssize_t = len(order)
        self.engine, self.lock, self.obstacles, self.empty, self.end = engine, lock, obstacles, empty, end
        self.same, self.checked = tuple(chain.from_iterable(same)), tuple(chain.from_iterable(checked))
        self.changes, self.seen = changes, None
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
        self.arrays = (timers, free, rows, placed, state, order, angle, sorted_mass, numbers, marks, times, none, known, marked)
        p.put.turned, p.put.half_dt, p.put.skips = doubles(angle), 0.5 * self.dt, False
        p.put.still, p.put.written = const_octets(none), octets(none)
        p.sorted_mass = const_reals(sorted_mass)
        p.radius, p.mass, p.restitution = const_reals_in(numbers, 0), const_reals_in(numbers, 1), const_reals_in(numbers, 2)
        p.friction, p.rolling, p.inertia = const_reals_in(numbers, 3), const_reals_in(numbers, 4), const_reals_in(numbers, 5)
        p.category, p.mask = const_indices_in(marks, 0), const_indices_in(marks, 1)
        p.material, p.fixed_rotation = const_indices_in(marks, 2), const_indices_in(marks, 3)
        p.known, p.marks, p.given = reals(known), indices(marked), reals(self.given)
        p.last, p.total = doubles_in(times, 0), doubles_in(times, 1)
        p.sleepers, p.asleep, p.far, p.timed = sleepers, asleep, False, len(free)
        p.dt, p.rest, p.after = self.dt, value[6], value[7]
        p.timers, p.free = singles(timers), const_integers(free)
        if asleep:
            find_far(p)

    def step(self, world, dt) -> bool:
        """Make a frame of dt seconds if it is plain; returns whether it was."""
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

    @property
    def reached(self) -> int:
        return self.p.w.substep

    @cython.cfunc
    def enter(self, world) -> cython.bint:
        """Take the lock, if it is free and nothing has changed; returns whether it did."""
        lock = self.lock
        if lock.holder is not None or lock.page is not None or lock._queue.locked() or not lock._lock.acquire(False):
            return False
        lock.holder, lock._depth, lock.in_frame = get_ident(), 1, True
        self.p.status = MADE
        latest = self.changes.latest
        if latest != self.seen:
            self.compare(world, self.checked)
        self.compare(world, self.same)
        for what, name, value in self.obstacles:
            if getattr(what, name) is not value:
                self.p.status = OTHERS
        for listed in self.empty:
            if len(listed) > 0:
                self.p.status = OTHERS
        if self.p.status == OTHERS or self.engine.ls.patching:
            self.leave()
            return False
        self.seen = latest
        return True

    @cython.cfunc
    def compare(self, world, same: tuple):
        """Note in `status` if an attribute has changed."""
        for k in range(0, len(same), 3):
            what = same[k]
            if getattr(world if what is None else what, same[k + 1]) is not same[k + 2]:
                self.p.status = OTHERS

    @cython.cfunc
    def leave(self):
        """Release the lock."""
        lock = self.lock
        lock.holder, lock._depth, lock.in_frame = None, 0, False
        lock._lock.release()

    @cython.cfunc
    def go_on(self):
        """Make the remaining frames, as long as they are plain."""
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
        """Enlarge arrays for pairs and surfaces, or save records."""
        if self.engine.ls.short:
            self.engine.reserve()

    @cython.cfunc
    def close(self, world) -> cython.bint:
        """Report complete frames to the world; returns whether none is left."""
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
        """Have Python end a frame. A Ctrl-C is delayed until it is complete, and returned."""
        interrupted = None
        self.pending = True
        while self.pending:
            try:
                self.end(world, self)
            except KeyboardInterrupt as error:
                interrupted = error
        return interrupted
