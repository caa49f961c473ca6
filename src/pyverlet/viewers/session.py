"""The narrow door between a world and whoever watches it: commands go in, frames come out.

A session owns the world, its clock and the one thread that steps it, the physics thread: the caller's (`run`) or one of its
own (`start`). The compiled kernels' workers do not stand several callers. It knows nothing of how commands arrive or where
frames go.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pyverlet import checks
from pyverlet.clock import Clock, FrameBudget
from pyverlet.constants import FRAME_BUDGET_MS
from pyverlet.errors import PyverletError
from pyverlet.panels import Panels
from pyverlet.viewers.commands import Command, Drag, Pause, Poke, Release, Reset, SetGravity, SetSubsteps, Step
from pyverlet.viewers.frames import Camera, Frame, PanelShape, Shape, Status, outline
from pyverlet.viewers.hands import HandsOnPanels
from pyverlet.viewers.layout import Layout

if TYPE_CHECKING:
    from pyverlet.world import World

_log = logging.getLogger(__name__)

SLOW_STATUS_S = 0.1
"""Energy and percentiles read every particle or many frames; ten times a second is as fast as anybody reads."""

MAX_CATCH_UP = 4
"""Late frames made up for at once; more are dropped and counted. A world that is too slow runs slow, smoothly."""

IDLE_S = 0.1
"""Longest nap while nothing moves: on some systems Ctrl-C waits for it to end."""

STOP_TIMEOUT_S = 10.0
"""Longest wait for a frame under way when a session stops."""


class Session:
    """Runs one world in real time: in the calling thread with `run`, or in one of its own as a context manager.

    Several worlds side by side run as one: every command is for all of them, but a hand works in the one it touches.

    Args:
        world: a world or panels, stepped by this session only, while it runs. Reset goes back to the present state.
        title: what the viewer calls it.
        dt: simulated seconds per frame, also the pace: 1/dt frames a second.
        budget_ms: milliseconds of physics a frame may take, for the figures on show.

    Raises:
        InputError: dt or budget_ms is not a positive finite number.
    """

    def __init__(
        self, world: World | Panels, *, title: str = "pyverlet", dt: float = 1 / 60, budget_ms: float = FRAME_BUDGET_MS
    ) -> None:
        self._panels = Panels.of(world)
        self._worlds = self._panels.worlds
        self._title = title
        self._dt = checks.number("dt", dt, above=0.0)
        self._budget_ms = checks.number("budget_ms", budget_ms, above=0.0)
        self._saved = self._panels.save()
        self._start_energies = [float(each.energy().total) for each in self._worlds]
        self._commands: queue.SimpleQueue[Command | None] = queue.SimpleQueue()
        self._listeners: tuple[Callable[[], None], ...] = ()
        self._listeners_lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._paused = False
        self._error: str | None = None
        self._hands = HandsOnPanels(self._worlds)
        self._substeps_differ = len({each.substeps for each in self._worlds}) > 1
        self._seq = 0
        self._fresh_start()
        self._shape = self._make_shape()
        self.latest: Frame = self._picture()
        """The newest frame. Replaced, never changed; read it from any thread."""

    # -- for viewers, from any thread ---------------------------------------------------------------------------------

    def submit(self, command: Command) -> None:
        """Ask for something. Returns at once; the physics thread does it between two frames, in the order asked."""
        self._commands.put(command)

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener()` called on the physics thread after every new frame; it must return at once and not raise.

        Returns a function that ends the subscription.
        """
        with self._listeners_lock:
            self._listeners = (*self._listeners, listener)

        def unsubscribe() -> None:
            with self._listeners_lock:
                self._listeners = tuple(other for other in self._listeners if other is not listener)

        return unsubscribe

    def start(self) -> None:
        """Run in a thread of the session's own."""
        if self._thread is not None:
            raise RuntimeError("a session starts once")
        # A daemon: should a frame ever hang, Ctrl-C still ends the process.
        self._thread = threading.Thread(target=self.run, name="pyverlet-physics", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Have the frame under way be the last; wait for it if the session has its own thread. Twice is once."""
        self._stopping.set()
        self._commands.put(None)
        if self._thread is not None:
            self._thread.join(STOP_TIMEOUT_S)

    def __enter__(self) -> Session:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()

    # -- the physics thread -------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Run in the calling thread until somebody calls `stop`; afterwards the world is the caller's again.

        Prefer this where the world has been stepped before: OpenMP keeps a team of workers for each thread that ever called
        a parallel kernel, and with two teams alive every frame takes twice as long.
        """
        last = time.perf_counter()
        while not self._stopping.is_set():
            if self._held():
                if self._obey_next():
                    self._publish()
                last = time.perf_counter()  # time spent paused is not time to catch up with
                continue
            now = time.perf_counter()
            due = self._clock.advance(now - last)
            last = now
            for _ in range(due):
                self._advance()
                self._publish()
                self._obey_all()
                if self._held() or self._stopping.is_set():
                    break
            # Sleeping, not waiting on the queue: on some systems a timed wait only wakes at every 15 ms.
            time.sleep(max(0.0, last + (1.0 - self._clock.alpha) * self._dt - time.perf_counter()))
            self._obey_all()
            if self._held():
                self._publish()  # the last picture for a while: it says why
        self._hands.release_all()

    def _held(self) -> bool:
        return self._paused or self._error is not None

    def _advance(self) -> None:
        """One frame. An error stops the stepping, not the session: the page stays readable and Reset works."""
        self._hands.move(self._view_size())
        began = time.perf_counter()
        try:
            self._panels.step(self._dt)
        except PyverletError as error:
            self._error = str(error)
        except Exception as error:  # a user's own force may raise anything
            _log.exception("the world stopped at %.6g s", self._panels.time)
            self._error = f"{type(error).__name__}: {error}"
        else:
            self._budget.record(1000.0 * (time.perf_counter() - began))

    def _obey_next(self) -> bool:
        """Wait for a command and obey it and all behind it; False if none comes for a while."""
        try:
            self._obey(self._commands.get(timeout=IDLE_S))
        except queue.Empty:
            return False
        self._obey_all()
        return True

    def _obey_all(self) -> None:
        while True:
            try:
                command = self._commands.get_nowait()
            except queue.Empty:
                return
            self._obey(command)

    def _obey(self, command: Command | None) -> None:
        match command:
            case None:
                pass  # only wakes the thread up
            case Pause(on):
                self._paused = on
            case Step(frames):
                self._paused = True
                for _ in range(frames):
                    if self._error is None and not self._stopping.is_set():
                        self._advance()
            case Reset():
                self._panels.restore(self._saved)
                self._hands.release_all()
                self._fresh_start()
            case SetGravity(x, y):
                for world in self._worlds:
                    world.gravity = (x, y)
            case SetSubsteps(value):
                for world in () if self._substeps_differ else self._worlds:
                    world.substeps = value
            case Drag(hand, x, y, reach):
                self._hands.drag(hand, x, y, reach, self._layout)
            case Poke(hand, x, y):
                self._hands.poke(hand, x, y, self._view_size(), self._layout)
            case Release(hand):
                self._hands.release(hand)

    def _fresh_start(self) -> None:
        self._error = None
        self._clock = Clock(dt=self._dt, max_catch_up=MAX_CATCH_UP)
        self._budget = FrameBudget(limit_ms=self._budget_ms)
        self._camera = Camera(*self._worlds)
        self._look()
        self._slow_status_due = 0.0

    # -- frames -------------------------------------------------------------------------------------------------------

    def _view_size(self) -> float:
        x0, y0, x1, y1 = self._layout.room
        return max(x1 - x0, y1 - y0)

    def _look(self) -> list[NDArray[np.float32]]:
        """Point the camera at where everybody is now; returns each world's positions."""
        positions = [np.array(world.position, dtype=np.float32) for world in self._worlds]
        bounded = any(world.boundary.extent() is not None for world in self._worlds)
        together = positions[0] if len(positions) == 1 else np.concatenate(positions)
        self._layout = Layout(self._camera.view(together), len(positions), bounded)
        return positions

    def _publish(self) -> None:
        self._seq += 1
        self.latest = self._picture()
        for listener in self._listeners:
            listener()

    def _picture(self) -> Frame:
        positions = self._look()
        if sum(map(len, positions)) != len(self._shape.radius):
            self._shape = self._make_shape()
        placed = [self._layout.place(k, position) for k, position in enumerate(positions)]
        position = placed[0] if len(placed) == 1 else np.concatenate(placed)
        position.flags.writeable = False
        return Frame(self._seq, self._shape, self._layout.view, self._status(), position)

    def _status(self) -> Status:
        world, budget = self._worlds[0], self._budget
        now = time.perf_counter()
        if now >= self._slow_status_due or self._held():
            self._slow_status_due = now + SLOW_STATUS_S
            energies = [each.energy() for each in self._worlds]
            self._kinetic = sum(float(energy.kinetic) for energy in energies)
            self._energies = tuple(float(energy.total) for energy in energies)
            self._percentiles = (float(budget.median_ms), float(budget.p95_ms))
        return Status(
            time=float(self._panels.time),
            frames=int(self._panels.frames),
            particles=sum(map(len, self._worlds)),
            dropped=int(self._clock.dropped),
            physics_ms=float(budget.last_ms),
            physics_median_ms=self._percentiles[0],
            physics_p95_ms=self._percentiles[1],
            kinetic=self._kinetic,
            energy=sum(self._energies),
            energies=self._energies,
            gravity=(float(world.gravity[0]), float(world.gravity[1])),
            substeps=int(world.substeps),
            paused=self._paused,
            error=self._error,
        )

    def _make_shape(self) -> Shape:
        radius = np.concatenate([world.radius for world in self._worlds], dtype=np.float32)
        radius.flags.writeable = False
        bounded = any(world.boundary.extent() is not None for world in self._worlds)
        outlines: list[tuple[tuple[float, float], ...]] = []
        lines: list[tuple[tuple[float, float], tuple[float, float]]] = []
        panels: list[PanelShape] = []
        first = 0
        for k, (panel, world) in enumerate(zip(self._panels, self._worlds, strict=True)):
            dx, dy = self._layout.offset(k)
            outlines += [tuple((x + dx, y + dy) for x, y in line) for line in outline(world.boundary)]
            if self._panels.line is not None and (extent := world.boundary.extent()):
                lines.append(((extent[0] + dx, self._panels.line + dy), (extent[2] + dx, self._panels.line + dy)))
            if len(self._panels) > 1:
                panels.append(PanelShape(panel.name, first, len(world), self._start_energies[k], self._layout.strip(k)))
            first += len(world)
        return Shape(
            title=self._title,
            dt=self._dt,
            budget_ms=self._budget_ms,
            bounded=bounded,
            outlines=tuple(outlines),
            lines=tuple(lines),
            panels=tuple(panels),
            substeps_differ=self._substeps_differ,
            radius=radius,
        )
