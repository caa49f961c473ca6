"""Rebuilds a shown sketch whenever it is saved, while the page stays open."""

import contextlib
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from pyverlet.common.errors import PyverletError
from pyverlet.common.time_limit import TimeLimit, TooLong, interrupt
from pyverlet.scenes.sketch import Sketch
from pyverlet.viewers.presentation import Presentation, Repertoire
from pyverlet.viewers.session import Session
from pyverlet.world.panels import Panel, Panels
from pyverlet.world.world import World

LOOK_S = 0.05  # poll interval of the files
SAY_S = 1.0  # builds that take longer are shown on the page
BUILD_LIMIT_S = 10.0  # longest build of a sketch; see --patience
Stamp = tuple[int, int]  # modification time and size of a file


class SketchBuilder:
    """Builds the sketch in a file repeatedly, each in at most `time_limit` s; other arguments as for `Repertoire`."""

    def __init__(self, path: Path, *, time_limit: float = BUILD_LIMIT_S, **repertoire: Any) -> None:
        self.path, self._time_limit, self._repertoire = path, time_limit, repertoire
        self._sketch: Sketch | None = None
        self.fault: str | None = None  # why the last build failed

    def build(self) -> Presentation | None:
        """The sketch as it is now; None if that fails: see `fault`."""
        try:
            sketch = Sketch.read(self.path, self._sketch)
            self._sketch = sketch
            with TimeLimit().within(self._time_limit):
                built = replace(Repertoire(sketch.scene(), **self._repertoire).open(), repertoire=None)
            self.fault = None
            return built
        except TooLong:
            self.fault = f"{self.path.name} is not built after {self._time_limit:g} s"
        except PyverletError as error:
            self.fault = str(error)
        except MemoryError:
            self.fault = f"{self.path.name} needs more memory than there is"
        return None

    def first(self) -> Presentation:
        """The sketch, or an empty world until it can be built."""
        return self.build() or Presentation(self.path.stem, Panels([Panel("", World())]))

    def file_times(self) -> dict[Path, Stamp]:
        """Times of the sketch's files; without missing and empty ones, which are being saved."""
        found: dict[Path, Stamp] = {}
        for file in self._sketch.files if self._sketch else [self.path]:
            with contextlib.suppress(OSError):  # some editors first remove the old file
                if (about := file.stat()).st_size:
                    found[file] = about.st_mtime_ns, about.st_size
        return found


class Watcher:
    """Watches the files of a shown sketch, and rebuilds it in its own thread when one is saved."""

    def __init__(self, builder: SketchBuilder, session: Session) -> None:
        self._builder, self._session = builder, session
        self._ended = threading.Event()
        self._building_thread: threading.Thread | None = None
        self._lock, self._interruptible, self._building = threading.Lock(), False, False
        self._turn = 0

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Context in which the files are watched."""
        if self._builder.fault:
            self._session.tell(complaint=self._builder.fault)
        thread = threading.Thread(target=self._look, name="pyverlet-watch", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._ended.set()
            thread.join(20 * LOOK_S)

    def _look(self) -> None:
        known, began = self._builder.file_times(), 0.0
        while not self._ended.wait(LOOK_S):
            now = self._builder.file_times()
            if any(known[file] != stamp for file, stamp in now.items() if file in known):
                began = time.monotonic()
                self._build()
            known |= now  # files that a build has added are new, but not changed
            if began and time.monotonic() - began > SAY_S:
                began = 0.0
                with self._lock:  # a message shown after the build has ended would stay
                    if self._building:
                        self._session.tell(complaint=self._builder.fault, busy=f"building {self._builder.path.name}")

    def _build(self) -> None:
        with self._lock:
            if self._interruptible and self._building_thread is not None:
                interrupt(self._building_thread)  # it builds an outdated version
            self._turn, self._building = self._turn + 1, True
        self._building_thread = threading.Thread(target=self._put_on, args=(self._turn,), name="pyverlet-build", daemon=True)
        self._building_thread.start()

    def _put_on(self, turn: int) -> None:
        with contextlib.suppress(TooLong):
            self._interruptible = True
            try:
                built = self._builder.build()
            finally:
                with self._lock:
                    self._interruptible = False
            fault = self._builder.fault
            with self._lock:
                if turn != self._turn:
                    return
                self._building = False
                if built:
                    self._session.put_on(built)
                else:
                    self._session.tell(complaint=fault)
