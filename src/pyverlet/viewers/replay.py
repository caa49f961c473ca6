"""Replays a journal: the same worlds, commands and frames, with the state hashes checked."""

import base64
import binascii
import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pyverlet.common import checks
from pyverlet.common.errors import InputError, PyverletError
from pyverlet.common.outside import file_errors
from pyverlet.common.progress import OnProgress
from pyverlet.data import settings_json
from pyverlet.data.settings_json import find
from pyverlet.data.snapshot import from_bytes
from pyverlet.scenes.sketch import Sketch, SketchError
from pyverlet.viewers import commands
from pyverlet.viewers.commands import Command, Reset
from pyverlet.viewers.journal import FIELDS, FORMAT
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.view_state import ViewState
from pyverlet.world.panels import Panel, Panels
from pyverlet.world.substep_snapshot import SubstepSnapshot
from pyverlet.world.world import World

_COMMANDS: dict[str, Any] = {command.__name__: command for command in commands.COMMANDS.values()}


class EndError(PyverletError):
    """The journal has ended."""


class StoppedError(PyverletError):
    """The worlds stopped here, as they did in the session."""


class DivergedError(PyverletError):
    """The state differs from the journal's."""


@dataclasses.dataclass(frozen=True)
class Event:
    """A line of a journal: frame before which, substep after which (0: none), and content."""

    frame: int
    substep: int
    what: dict[str, Any]
    command: Command | None


class Script:
    """A journal that was read; InputError if the file is missing or not a journal.

    Worlds of a sketch are rebuilt by it; the sketch is run only if it is unchanged.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with file_errors("journal", path, "read"):
            lines = self.path.read_bytes().split(b"\n")
        self.events: list[Event] = []
        for number, line in enumerate(lines[:-1]):  # after the last newline is nothing, or an incomplete line
            try:
                what = json.loads(line)
                frame = checks.integer("frame", what.pop("frame"), least=0)
                if number == 0:
                    if what["pvlog"] != FORMAT:
                        raise InputError(f"pvlog is {what['pvlog']!r}; allowed is {FORMAT}")
                    self.dt = checks.number("dt", what["dt"], above=0.0)
                    continue
                if self.events and frame < self.events[-1].frame:
                    raise InputError(f"frame is {frame} after {self.events[-1].frame}; allowed are frames in order")
                substep = checks.integer("substep", what.pop("substep", 0), least=0)
                command = _command(dict(what)) if "do" in what else None
                self.events.append(Event(frame, substep, what, command))
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:  # InputError is a ValueError
                raise InputError(f"'{path}' is no journal of pyverlet's: line {number + 1}: {error}") from None
        if not self.events or "worlds" not in self.events[0].what:
            raise InputError(f"'{path}' is no journal of pyverlet's: it has no worlds")
        self.frames = self.events[-1].frame
        self.checks = sum("hash" in event.what for event in self.events)  # number of hashes
        self.whole = "end" in self.events[-1].what  # whether the session ended normally

    def presentation(self, event: Event) -> Presentation:
        """The worlds of an event that contains any."""
        what = event.what
        try:
            sketch = self._sketch(what["worlds"][0]) if "sketch" in what["worlds"][0] else None
            if sketch is None:
                panels = [
                    Panel(str(each["name"]), from_bytes(base64.b64decode(each["snapshot"], validate=True)))
                    for each in what["worlds"]
                ]
            else:
                panels = [Panel(str(what["worlds"][0]["name"]), self._built(sketch, what["worlds"][0]))]
            part = what.get("part") and tuple(checks.number("part", value) for value in what["part"])
            line = what.get("line") if what.get("line") is None else checks.number("line", what["line"])
            return Presentation(str(what["title"]), Panels(panels, line=line), part=part, callbacks=sketch)
        except (KeyError, TypeError, IndexError, AttributeError, binascii.Error) as error:
            raise InputError(f"'{self.path}' is no journal of pyverlet's: its worlds lack something ({error})") from None

    def _sketch(self, about: dict[str, Any]) -> Sketch:
        """The original sketch with its slider values; searched in its old folder, the current one and beside the journal."""
        about = about["sketch"]
        sketch = find(str(about["name"]), about["source"], Path(about["path"]), Path(), self.path.parent)
        _ = sketch.module
        for name, value in about["sliders"].items():
            sketch.sliders[name].value = value
        return sketch

    def _built(self, sketch: Sketch, about: dict[str, Any]) -> World:
        world = sketch.scene().world(**settings_json.from_json(about["sketch"]["settings"]))
        if world.state_hash() != about["hash"]:
            raise DivergedError(
                f"{sketch.name} builds a world with the hash {world.state_hash()}, and built {about['hash']} in the session: "
                "it draws by chance without a seed, or what it imports or reads has changed"
            )
        return world

    def open(self) -> Presentation:
        """The first worlds, for a viewer."""
        return self.presentation(self.events[0])

    def run(self, progress: OnProgress | None = None) -> dict[str, Any]:
        """Replay the whole journal without a viewer.

        Returns:
        frames, seconds, commands, hashes checked, state_hash at the end, and what stopped the session, if anything.

        Raises:
            DivergedError: a hash differs.
        """
        view_state, stopped = ReplayState(self, self.open()), None
        try:
            while True:
                try:
                    view_state.step(self.dt)
                except StoppedError as error:
                    stopped = str(error)
                if progress:
                    progress(view_state.frame, max(self.frames, 1))
        except EndError:
            pass
        return {
            "frames": view_state.frame,
            "seconds": view_state.frame * self.dt,
            "commands": sum(event.command is not None for event in self.events),
            "checked": view_state.checked,
            "state_hash": view_state.panels.state_hash(),
            "stopped": stopped or view_state.complaint,
            "whole": self.whole,
        }


class ReplayState(ViewState):
    """A view state that plays a script: commands of viewers are ignored, except reset."""

    def __init__(self, script: Script, presentation: Presentation) -> None:
        self._script = script
        self._begin()
        super().__init__(presentation)

    def _begin(self) -> None:
        self.frame, self.checked = 0, 0
        self._at = 1  # index of the next event; the first are the worlds
        self._substep = 0
        self._observed = False
        self._room: Any = None

    def do(self, command: Command) -> None:
        if isinstance(command, Reset):
            changes = self._pinned
            self._begin()
            super().__init__(self._script.open())
            self._pinned = changes + 1

    def step(self, dt: float, observer: Callable[[SubstepSnapshot], None] | None = None) -> None:
        self._substep = 0
        self._apply()
        events = self._script.events
        if self._at == len(events) and self.frame >= self._script.frames:
            raise EndError(f"the journal ends here, after {self.frame:,} frames; {self.checked} hashes are as they were")
        self._set_room()

        def between(snapshot: SubstepSnapshot) -> None:
            self._substep += 1
            self._apply()
            self._set_room()
            if observer:
                observer(snapshot)

        stop = next((k for k in range(self._at, len(events)) if "stopped" in events[k].what), None)
        stops = stop is not None and events[stop].frame == self.frame
        try:
            super().step(self._script.dt, between if self._observed else None)
        except Exception as error:
            if stop is None or not stops:
                raise
            self._at = stop + 1
            if isinstance(error, SketchError) and self.mend(error):  # as in the session
                return
            raise StoppedError(str(error)) from error
        if stop is not None and stops:
            said = events[stop].what["stopped"]
            raise DivergedError(f"frame {self.frame + 1} goes well here, and in the session it stopped: {said}")
        self.frame += 1
        self._substep = 0
        while self._at < len(events) and events[self._at].frame == self.frame and "hash" in events[self._at].what:
            self._check(events[self._at].what["hash"])
            self._at += 1

    def _apply(self) -> None:
        """Apply all events before this frame, or up to this substep of it."""
        events = self._script.events
        while self._at < len(events):
            event = events[self._at]
            if (event.frame, event.substep) > (self.frame, self._substep) or "stopped" in event.what:
                return
            self._at += 1
            what = event.what
            if event.command is not None:
                self._set_room()
                super().do(event.command)
            elif "worlds" in what:
                changes = self._pinned
                super().__init__(self._script.presentation(event))
                self._pinned = changes + 1
            elif "hash" in what:
                self._check(what["hash"])
            self._observed = what.get("looked_on", self._observed)
            self._room = what.get("room", self._room)

    def _set_room(self) -> None:
        """Use the recorded range of pointers, whatever the current view."""
        if self._room is not None:
            self.layout = Layout(tuple(map(float, self._room)), len(self.worlds), self.layout.bounded)  # type: ignore[arg-type]

    def _check(self, known: str) -> None:
        found = self.panels.state_hash()
        if found != known:
            raise DivergedError(
                f"after frame {self.frame} ({self.frame * self._script.dt:.4g} s) the hash of the state is {found}, and was "
                f"{known} in the session: other kernels or another machine may go another way"
            )
        self.checked += 1


def _command(what: dict[str, Any]) -> Command:
    kind = _COMMANDS.get(what.pop("do"))
    if kind is None:
        raise InputError(f"a command is none of {', '.join(_COMMANDS)}")
    names = {old: new for new, old in FIELDS.items()}
    command: Command = kind(**{names.get(name, name): value for name, value in what.items()})
    return command
