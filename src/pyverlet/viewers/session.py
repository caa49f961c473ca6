"""The interface between worlds and viewers: commands go in, frames come out.

A session owns the worlds, their clock and the single thread that steps them, the physics thread: the caller's (`run`, `turn`) or
its own (`start`). It is independent of how commands arrive and frames are delivered. Other threads may call `submit`, `take`,
`want_forces`, `subscribe`, `put_on`, `tell`, `held` and `stop` at any time.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.errors import PyverletError
from pyverlet.scenes.sketch import SketchError
from pyverlet.viewers import commands as asked
from pyverlet.viewers import controls
from pyverlet.viewers.commands import Command
from pyverlet.viewers.frames import PICTURE_S, Frame, FramePacing, Status
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.readouts import Readouts
from pyverlet.viewers.task_queue import Item, TaskQueue
from pyverlet.viewers.view_state import ViewState
from pyverlet.world.clock import Clock
from pyverlet.world.panels import Panels
from pyverlet.world.substep_snapshot import SubstepSnapshot
from pyverlet.world.world import World

_log = logging.getLogger(__name__)

MAX_CATCH_UP = 4  # late frames made up for at once; more are dropped and counted, so that slow worlds run slowly but smoothly
IDLE_S = 0.1  # longest sleep while nothing moves: on some systems Ctrl-C is delayed by it
VELOCITY_FRAMES = 10  # pictures with current velocities after a viewer has asked for some
FORCE_FRAMES = 60  # the same for forces, which are computed a few times per second
STOP_TIMEOUT_S = 10.0  # longest wait for the current frame when a session stops


class Session:
    """Runs one world in real time: in the calling thread with `run`, or in its own thread as a context manager.

    Several worlds side by side run as one: commands apply to all of them, except that a pointer acts in the one it touches. While
    the session runs, nothing else may step them; reset returns to their initial state.

    Args:
        dt: simulated seconds per frame, also the pace: 1/dt frames per second.
        view_state: makes the view state of a presentation; a journal's records everything.
    """

    def __init__(
        self,
        world: World | Panels | Presentation,
        *,
        title: str = "pyverlet",
        dt: float = 1 / 60,
        view_state: Callable[[Presentation], ViewState] = ViewState,
    ) -> None:
        self._dt = checks.number("dt", dt, above=0.0)
        self._tasks = TaskQueue()
        self._taken = self._velocity_until = self._force_until = 0  # sequence numbers of pictures
        self._listeners: tuple[Callable[[], None], ...] = ()
        self._listeners_lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._make_view_state = view_state
        self._paused = False
        self._speed = 1.0
        self._busy: str | None = None
        self._error: str | None = None
        self._complaint: str | None = None
        self._before: list[NDArray[np.float32]] | None = None
        self._seq = self._begun = 0
        self._readouts: Readouts
        self._pacing, self._last = FramePacing(), time.perf_counter()
        self._enter(Presentation.of(world, title))
        self.latest: Frame = self._picture()  # the newest; replaced, never changed: may be read from any thread

    def submit(self, command: Command) -> None:
        """Queue a command. Returns at once; the physics thread applies it between two frames, in order.

        A slow world applies gravity, and moves of pressed pointers, between two substeps.
        """
        self._tasks.put(command)

    def take(self, frame: Frame, *, velocity: bool = False) -> None:
        """Tell that a viewer has this frame and wants the next: a slow world then makes some between its substeps.

        Their velocities are current only if a viewer needs `velocity`.
        """
        self._taken = max(self._taken, frame.seq)
        if velocity:
            self._velocity_until = max(self._velocity_until, frame.seq + VELOCITY_FRAMES)

    def want_forces(self, frame: Frame) -> None:
        """Tell that a viewer with this frame shows forces between circles."""
        self._force_until = max(self._force_until, frame.seq + FORCE_FRAMES)

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Register `listener()`, called on the physics thread after every new frame; it must return at once and not raise.

        Returns a function that ends the subscription.
        """
        with self._listeners_lock:
            self._listeners = (*self._listeners, listener)

        def unsubscribe() -> None:
            with self._listeners_lock:
                self._listeners = tuple(other for other in self._listeners if other is not listener)

        return unsubscribe

    def held(self) -> AbstractContextManager[None]:
        """Context manager: the worlds stand between two frames and may be changed by the caller."""
        return self._tasks.held()

    def start(self) -> None:
        """Run in a thread of its own."""
        if self._thread is not None:
            raise RuntimeError("a session starts once")
        # A daemon, so that Ctrl-C still ends the process if a frame hangs.
        self._thread = threading.Thread(target=self.run, name="pyverlet-physics", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End after the current frame; waits for it if the session has its own thread. Repeated calls do nothing."""
        self._stopping.set()
        self._tasks.put(None)
        if self._thread is not None:
            self._thread.join(STOP_TIMEOUT_S)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def run(self) -> None:
        """Run in the calling thread until `stop` is called; afterwards the world is the caller's again."""
        self._last = time.perf_counter()
        with self._tasks.by_this_thread():
            while not self._stopping.is_set():
                wait = self.run_once()
                if self._held():
                    if self._apply_each(self._tasks.waiting(IDLE_S)):
                        self._publish()
                elif wait > 0.0:
                    # Sleep instead of waiting on the queue: on some systems a timed wait wakes only every 15 ms.
                    time.sleep(wait)
            self._view_state.pointers.release_all()

    def run_once(self, *, longest: float | None = None) -> float:
        """Apply queued commands, run the frames due since the last call, and publish.

        Args:
            longest: most seconds of wall time to count; None counts all of them.

        Returns:
            Seconds until the next frame is due.
        """
        if self._apply_each(self._tasks.all()) and self._held():
            self._publish()
        now = time.perf_counter()
        elapsed, self._last = now - self._last, now
        if self._held():
            return IDLE_S
        if longest is not None:
            elapsed = min(elapsed, longest)
        due = self._clock.advance(elapsed * self._speed)
        for _ in range(due):
            self._advance()
            if self._speed == 1.0:
                self._publish_if_due()
            self._apply_each(self._tasks.all())
            if self._held() or self._stopping.is_set():
                break
        if self._held():
            self._publish()  # the last picture for a while: it shows the reason
            return 0.0
        if self._speed < 1.0:
            self._publish_if_due()
            return now + self._dt - time.perf_counter()
        return now + (1.0 - self._clock.alpha) * self._dt - time.perf_counter()

    def _held(self) -> bool:
        return self._paused or self._error is not None

    def _advance(self) -> None:
        """Run one frame. An error stops the stepping, not the session: the page stays readable and Reset works."""
        began, self._begun = time.perf_counter(), self._seq
        # Judged by the previous frame: if it takes longer than a picture, pictures are made between substeps.
        self._late = self._readouts.budget.last_ms * self._speed > 1000.0 * max(self._dt, PICTURE_S)
        self._before = self._view_state.capture()[0] if self._speed < 1.0 and not self._late else None
        self._view_state.forces.wanted = self._seq <= self._force_until
        try:
            self._view_state.step(self._dt, self._observe if self._late else None)
        except SketchError as error:
            self._error = None if self._view_state.mend(error) else str(error)
        except PyverletError as error:
            self._error = str(error)
        except Exception as error:  # a user's force may raise anything
            _log.exception("the world stopped at %.6g s", self._view_state.panels.time)
            self._error = f"{type(error).__name__}: {error}"
        else:
            self._readouts.budget.record(1000.0 * (time.perf_counter() - began))
            self._readouts.passed(float(self._view_state.panels.time))

    def _apply_each(self, commands: Iterator[Item]) -> bool:
        """Apply commands; returns whether there were any."""
        applied = 0
        for applied, command in enumerate(commands, 1):  # noqa: B007  (how many there were)
            self._apply(command)
        return applied > 0

    def _apply(self, command: Item) -> None:
        held = self._held()
        try:
            self._do(command)
        except PyverletError as error:  # refused by the world
            self._error = str(error)
        except Exception as error:  # no command may end the physics thread
            _log.exception("a viewer asked for %r", command)
            self._error = f"{type(error).__name__}: {error}"
        if held and not self._held():
            self._last = time.perf_counter()  # paused time is not made up for

    def _do(self, command: Item) -> None:
        match command:
            case None:
                pass  # only wakes the thread
            case asked.Pause(on):
                self._paused = on
                self._readouts.held()
            case asked.Step(frames):
                self._paused = True
                for _ in range(frames):
                    if self._error is None and not self._stopping.is_set():
                        self._advance()
                self._before = None  # show the current state without interpolation
            case asked.SetSpeed(value):
                self._speed = value
                self._readouts.held()
                self._before = None
            case asked.Build(scene, particles):
                self._build(scene, particles)
            case _ if callable(command):
                command()
            case _:
                self._view_state.do(command)
                if isinstance(command, asked.Reset):
                    self._fresh_start()

    def _enter(self, presentation: Presentation) -> None:
        self._view_state = self._make_view_state(presentation)
        self._fresh_start()

    def put_on(self, presentation: Presentation) -> None:
        """Replace the presentation from the next frame on; view options stay. Thread-safe."""

        def put_on() -> None:
            self._view_state.pointers.release_all()
            self._complaint = self._busy = None
            self._enter(presentation)
            self._last = time.perf_counter()
            self._publish()

        self._tasks.put(put_on)

    def tell(self, *, complaint: str | None = None, busy: str | None = None) -> None:
        """Report a problem of the program that made the worlds, or what keeps them waiting; None: nothing. Thread-safe."""

        def tell() -> None:
            self._complaint, self._busy = complaint, busy
            self._publish()

        self._tasks.put(tell)

    def _fresh_start(self) -> None:
        self._error = None
        self._before = None
        self._late = False
        self._clock = Clock(dt=self._dt, max_catch_up=MAX_CATCH_UP)
        self._readouts = Readouts()

    def _build(self, scene: str | None, particles: int | None) -> None:
        """Build another scene, or the same with another number of circles, which keeps the settings of the sliders."""
        old = self._view_state
        if old.presentation.repertoire is None:
            return
        name = scene or old.presentation.scene
        old.pointers.release_all()

        def progress(done: int, total: int) -> None:
            if self._stopping.is_set():
                raise _Stopped
            self._say_busy(f"building {name}: {100 * done // max(total, 1)} %")

        self._say_busy(f"building {name}")
        try:
            self._enter(old.presentation.repertoire.build(name, particles, progress))
        except _Stopped:
            return
        finally:
            self._busy = None
            self._last = time.perf_counter()
        if scene is None:
            for command in controls.present(old.worlds[0]):
                self._view_state.do(command)
        self._publish()

    def _say_busy(self, text: str) -> None:
        if text != self._busy:
            self._busy = text
            self._publish()

    def _publish(self, snapshot: SubstepSnapshot | None = None) -> None:
        self._seq += 1
        self._pacing.made(time.perf_counter())
        if snapshot is None:
            self.latest = self._picture()
        else:  # readouts of the world only when a frame belongs to the last picture
            status = replace(self._status, time=snapshot.time, **controls.read(self._view_state.worlds[0]))
            self.latest = self.latest.moved(snapshot, self._seq, status, velocity=self._seq <= self._velocity_until)
        for listener in self._listeners:
            listener()

    def _publish_if_due(self) -> None:
        """Publish a picture at the end of a frame, if due."""
        if self._seq > self._begun and self._wanted() and not self._due():  # otherwise one was made just before, within the frame
            self._status = self._read()
        else:
            self._publish()

    def _observe(self, snapshot: SubstepSnapshot) -> None:
        """Called between two substeps of a frame that takes longer than a picture."""
        if not self._paused:  # single steps show the state when they were requested
            self._apply_each(self._tasks.while_(self._view_state.takes_at_once))
        if self._wanted() and self._due() and self._view_state.shape_is_current:
            self._publish(snapshot)

    def _wanted(self) -> bool:
        """Whether the world is slow and a viewer that has the last picture waits for more."""
        return self._late and self._taken >= self.latest.seq

    def _due(self) -> bool:
        return self._pacing.due(time.perf_counter())

    def _picture(self) -> Frame:
        self._status = self._read()
        return self._view_state.picture(self._seq, self._status, self._between)

    def _read(self) -> Status:
        return self._readouts.read(
            self._view_state,
            dropped=self._clock.dropped,
            speed=self._speed,
            paused=self._paused,
            busy=self._busy,
            error=self._error,
            complaint=self._complaint,
            at_once=self._held(),
        )

    def _between(self, now: list[NDArray[np.float32]]) -> list[NDArray[np.float32]]:
        """Interpolated positions in slow motion, between the last two frames: one frame late, but smooth."""
        before = self._before
        if self._speed == 1.0 or self._paused or before is None or list(map(len, before)) != list(map(len, now)):
            return now
        alpha = np.float32(self._clock.alpha)
        periodic = [world.boundary.periodic for world in self._view_state.worlds]
        return [
            periodic.wrapped(a + alpha * periodic.nearest(b - a)) for a, b, periodic in zip(before, now, periodic, strict=True)
        ]


class _Stopped(Exception):  # noqa: N818  (no error: it was asked for)
    """Raised in the build of a scene when the session ends."""
