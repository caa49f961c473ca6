"""Records everything done to shown worlds in a file, enough to replay it bit for bit with `replay`.

Each entry is a line of JSON, written at once: first a header, then worlds as snapshots, and then commands, numbers that commands
depend on, and every second the hash of the state. Each line has the frame before which it happened, and `substep` if it was
between two substeps of that frame.
"""

import base64
import json
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pyverlet.common.errors import InputError
from pyverlet.common.outside import file_errors
from pyverlet.data import settings_json
from pyverlet.data.atomic_file import Closing
from pyverlet.data.snapshot import to_bytes
from pyverlet.scenes.sketch import Sketch
from pyverlet.viewers.commands import Command
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.view_state import ViewState
from pyverlet.world.panels import every_frame
from pyverlet.world.substep_snapshot import SubstepSnapshot
from pyverlet.world.world import World

_log = logging.getLogger(__name__)

FORMAT = 1

FIELDS = {"pointer": "hand"}  # command fields with another name in journals, for compatibility
HASH_S = 1.0  # simulated seconds between hashes


class Journal(Closing):
    """A file that grows while a session runs, by convention `session.pvlog`; an old one is replaced.

    Raises:
        InputError: the file cannot be written.
    """

    def __init__(self, path: str | Path, *, dt: float) -> None:
        self.path = Path(path)
        self.frame = 0
        self._every = max(1, round(HASH_S / dt))
        self._known: dict[str, Any] = {}
        self._broken = False
        self._view_state: ViewState | None = None
        with file_errors("journal", path, "written"):
            self._file = self.path.open("wb", buffering=0)
        self.note(pvlog=FORMAT, dt=dt)

    def view_state(self, presentation: Presentation) -> ViewState:
        """A view state whose worlds and commands are recorded."""
        self._view_state = _RecordedState(presentation, self)
        return self._view_state

    def note(self, **what: Any) -> None:
        """Write a line. A full disk ends the journal, not the session."""
        if self._broken:
            return
        try:
            self._file.write(json.dumps({**what, "frame": self.frame}, separators=(",", ":")).encode() + b"\n")
        except OSError as error:
            self._broken = True
            _log.warning("the journal '%s' ends here: %s", self.path, error.strerror or error)

    def note_news(self, **what: Any) -> None:
        """Write a line, unless it equals the last one of its kind."""
        news = {key: value for key, value in what.items() if self._known.get(key) != value}
        if news:
            self._known |= news
            self.note(**news)

    def passed(self, state_hash: Callable[[], str]) -> None:
        """Called after each frame."""
        self.frame += 1
        if self.frame % self._every == 0:
            self.note(hash=state_hash())

    def close(self) -> None:
        if self._view_state is not None:
            self.note(hash=self._view_state.panels.state_hash(), end=True)
        self._file.close()


class _RecordedState(ViewState):
    def __init__(self, presentation: Presentation, journal: Journal) -> None:
        if any(panel.pace is not every_frame for panel in presentation.panels):
            allowed = "a scene whose worlds make a frame for each of the screen's"
            raise InputError(
                f"journal is asked for with {presentation.title!r}, whose worlds keep a pace of their own; allowed is {allowed}"
            )
        super().__init__(presentation)
        self._journal, self._substep = journal, 0
        journal.note(
            worlds=[{"name": panel.name, **_described(presentation, panel.world)} for panel in presentation.panels],
            title=presentation.title,
            part=presentation.part,
            line=presentation.panels.line,
        )

    def do(self, command: Command) -> None:
        self._journal.note_news(room=self.layout.room)  # the range of a poke depends on it
        line = {"do": type(command).__name__} | {FIELDS.get(key, key): value for key, value in vars(command).items()}
        self._journal.note(**line, **({"substep": self._substep} if self._substep else {}))
        super().do(command)

    def step(self, dt: float, observer: Callable[[SubstepSnapshot], None] | None = None) -> None:
        self._journal.note_news(looked_on=observer is not None)  # then pointers also follow the mouse between substeps
        if self.pointers.busy:
            self._journal.note_news(room=self.layout.room)

        def counted(snapshot: SubstepSnapshot) -> None:
            self._substep += 1
            assert observer
            observer(snapshot)

        try:
            super().step(dt, observer and counted)
        except Exception as error:
            self._journal.note(stopped=str(error))
            raise
        finally:
            self._substep = 0
        self._journal.passed(self.panels.state_hash)


def _described(presentation: Presentation, world: World) -> dict[str, Any]:
    """How to get this world again."""
    sketch = presentation.callbacks
    if not isinstance(sketch, Sketch) or (len(presentation.panels) > 1 and not sketch.has_callbacks):
        return {"snapshot": base64.b64encode(to_bytes(world)).decode()}
    if len(presentation.panels) > 1:
        side_by_side = f"{len(presentation.panels)} worlds of {sketch.name} side by side"
        raise InputError(f"journal is asked for with {side_by_side}; allowed is one world of a sketch with functions or sliders")
    return {
        "sketch": {
            "name": sketch.name,
            "path": str(sketch.path.resolve()),
            "source": sketch.digest,
            "settings": settings_json.to_json(settings_json.overrides(sketch.settings)),
            "sliders": {name: slider.value for name, slider in sketch.sliders.items()},
        },
        "hash": world.state_hash(),
    }
