"""The view state: worlds on show and what is replaced together with them: saved start, mouse tools, camera, layout."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.constants import FRAME_BUDGET_MS
from pyverlet.common.errors import InputError
from pyverlet.common.time_limit import TimeLimit
from pyverlet.laws.obstacles import Outline
from pyverlet.picture import Pen
from pyverlet.picture.pen import Drawing
from pyverlet.scenes.sketch import Sketch, SketchError, Updates
from pyverlet.state.periodicity import Periodicity
from pyverlet.state.state import EVERYONE
from pyverlet.viewers import commands as asked
from pyverlet.viewers import controls
from pyverlet.viewers.commands import Command, Drag, Pin, Poke, SetGravity, Setting, name_of
from pyverlet.viewers.forces import Forces
from pyverlet.viewers.frames import Camera, Frame, OutlineCache, PanelShape, Shape, Status, outline
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.pointers import History, Pointers
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.task_queue import Item
from pyverlet.world.substep_snapshot import SubstepSnapshot

GREY = 0x9A  # R, G and B of circles added later


class ViewState:
    """The state of a presentation while it is viewed; reset returns to its initial state. Used by the physics thread only."""

    def __init__(self, presentation: Presentation) -> None:
        self.presentation = presentation
        if isinstance(presentation.callbacks, Sketch):
            presentation.callbacks.time_limit = TimeLimit()  # the screen waits for functions called with each picture
        self.panels = presentation.panels
        self.worlds = self.panels.worlds
        self.pointers = Pointers(*self.worlds)
        self.history, self.forces = History(self.panels), Forces(self.worlds)
        self.complaint: str | None = None  # error of the program while the world continues
        self._shape: Shape
        self._shape_of: object = None
        self._pinned = 0
        self._apart: list[NDArray[Any]] = []
        self._parted = 0  # counts changes of these
        self.differing = controls.differing(self.worlds)
        self._saved = self.panels.save()
        self._coloured = [np.array(world.number) for world in self.worlds]
        self._standing, self._moving = (OutlineCache(self.worlds, moving=moving) for moving in (False, True))
        self._start_energies = [float(each.energy().total) for each in self.worlds]
        self.reset_camera()

    def __len__(self) -> int:
        return sum(map(len, self.worlds))

    def reset_camera(self) -> None:
        """Reset the camera, which follows the particles."""
        self._camera = Camera(*self.worlds, part=self.presentation.part)
        self.capture()

    def capture(self) -> tuple[list[NDArray[np.float32]], NDArray[np.float32]]:
        """Update the camera; returns copies of each world's positions, and of all velocities (n, 2)."""
        positions = [np.array(world.position, dtype=np.float32) for world in self.worlds]
        velocities = [np.array(world.velocity, dtype=np.float32) for world in self.worlds]
        self.layout = Layout(self._camera.view(_joined(positions)), len(positions), self._bounded())
        return positions, _joined(velocities)

    def place(self, positions: list[NDArray[np.float32]]) -> NDArray[np.float32]:
        """(n, 2) positions in the picture, from those of each world."""
        return _joined([self.layout.place(k, position) for k, position in enumerate(positions)])

    def step(self, dt: float, observer: Callable[[SubstepSnapshot], None] | None = None) -> None:
        """Run one frame of every world, with pointers following the mouse.

        `observer` is called between the substeps of a single world, unless obstacles move, whose motion is known per frame.
        """
        self.pointers.move(self.layout.size)
        world = self.worlds[0]

        def between(snapshot: SubstepSnapshot) -> None:
            assert observer
            observer(snapshot)
            self.pointers.move(self.layout.size)  # the pointers may have moved

        if len(self.worlds) == 1 and not any(obstacle.moves for obstacle in world.obstacles):
            world.observer = observer and between
        try:
            with self.forces.look():
                self.panels.step(dt)
        finally:
            world.observer = None

    def do(self, command: Command) -> None:
        """Apply a command about the worlds; commands about time belong to the session."""
        match command:
            case Setting():
                if name_of(type(command)) not in self.differing:  # worlds are shown side by side because they differ in it
                    for world in self.worlds:
                        controls.change(world, command)
            case asked.Release(pointer):
                self.pointers.release(pointer)
                self.history.release(pointer)
            case asked.Undo() | asked.Redo():
                self.pointers.release_all()
                self._pinned += self.history.go(back=isinstance(command, asked.Undo))
            case asked.SetSlider(name, value):
                sliders = self.presentation.callbacks.sliders if self.presentation.callbacks else {}
                if slider := sliders.get(name):
                    slider.value = min(max(value, slider.low), slider.high)
            case asked.Key(key):
                self._call("keys", self.worlds[0], key)
            case asked.Click(_, x, y, button):
                panel = self.layout.at(x, y)
                dx, dy = self.layout.offset(panel)
                self._call("click", self.worlds[panel], np.array([x - dx, y - dy]), button)
            case asked.Reset():
                self.reset()
            case Drag() | Poke() | Pin() | asked.Spawn() | asked.Delete():
                self.history.open(command.pointer)
                changed = self.pointers.use(command, self.layout)
                self.history.close(command.pointer, changed=changed)
                if isinstance(command, Pin):
                    self._pinned += changed
                    self.history.release(command.pointer)

    def _call(self, hook: str, *arguments: Any) -> None:
        """Call a function of the program; one that fails is not called again, and the world continues."""
        if self.presentation.callbacks is None:
            return
        try:
            self.presentation.callbacks.call(hook, *arguments)
        except InputError as error:
            self.complaint = str(error)

    def drawing(self) -> Drawing:
        """The program's drawing over this picture."""
        if self.presentation.callbacks is None or not self.presentation.callbacks.has("draw"):
            return ()
        marks: Drawing = ()
        for k, world in enumerate(self.worlds):
            pen = Pen(self.layout.offset(k))
            self._call("draw", world, pen)
            marks += pen.drawing
        return marks

    def sliders(self) -> tuple[tuple[str, float, float, float, float], ...]:
        """Name, ends, step and value of each slider."""
        board = self.presentation.callbacks.sliders if self.presentation.callbacks else {}
        return tuple((each.name, each.low, each.high, each.step, each.value) for each in list(board.values()))

    def watched(self) -> dict[str, float]:
        """Values watched by the worlds; for equal names those of the first world."""
        found: dict[str, float] = {}
        for world in self.worlds:
            try:
                found = world.read_watched() | found
            except InputError as error:
                self.complaint = str(error)
        return found

    def mend(self, error: SketchError) -> bool:
        """Continue without the `update` of a sketch that has failed; returns whether that is possible."""
        self.complaint = str(error)
        before = sum(len(world.actors) for world in self.worlds)
        for world in self.worlds:
            world.actors[:] = [actor for actor in world.actors if not isinstance(actor, Updates)]
        return sum(len(world.actors) for world in self.worlds) < before

    def takes_at_once(self, command: Item) -> bool:
        """Whether a command may be applied between two substeps, which read gravity and pressed pointers each time.

        All else is read once per frame. Not in worlds with a ledger, whose heights depend on gravity at the start of the frame.
        """
        aims = isinstance(command, Drag | Poke) and self.pointers.is_down(command.pointer)
        return command is None or ((aims or isinstance(command, SetGravity)) and not self.worlds[0].keeps_ledger)

    @property
    def version(self) -> tuple[Any, ...]:
        """A value that changes whenever the shape does."""
        apart = [world.links.known_apart() for world in self.worlds]
        if len(apart) != len(self._apart) or any(a is not b for a, b in zip(apart, self._apart, strict=True)):
            self._apart, self._parted = apart, self._parted + 1
        return (*(world.version for world in self.worlds), id(self._standing.draw(self.layout)), self._pinned, self._parted)

    def moving(self) -> tuple[Outline, ...]:
        """The moving obstacles at their current places."""
        return self._moving.draw(self.layout)

    def links(self) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """(m, 2) circles joined by links, numbered as in the picture, and (m,) tensions, N."""
        pairs, force, first = [np.empty((0, 2), np.uint32)], [np.empty(0, np.float32)], 0
        for world in self.worlds:
            if len(world.links):
                joined, pull = world.links.pulls()
                pairs.append((joined + first).astype(np.uint32))
                force.append(pull.astype(np.float32))
            first += len(world)
        return np.concatenate(pairs), np.concatenate(force)

    def turned(self) -> NDArray[np.uint8]:
        """(n,) orientations of circles, in 1/256 of a turn; empty until one has turned."""
        angles = [world.angle for world in self.worlds]
        if not any(angle.any() for angle in angles):
            return np.empty(0, np.uint8)
        return np.concatenate([np.rint(angle * (128 / np.pi)).astype(np.int64).astype(np.uint8) for angle in angles])

    def reset(self) -> None:
        """Return to the start; settings stay."""
        self.pointers.release_all()
        self.panels.restore(self._saved)
        self.history = History(self.panels)
        self._pinned += 1  # masses have been restored
        self.reset_camera()

    def picture(
        self,
        seq: int,
        status: Status,
        between: Callable[[list[NDArray[np.float32]]], list[NDArray[np.float32]]] = lambda positions: positions,
    ) -> Frame:
        """The current picture; `between` maps the positions of each world to those shown."""
        positions, velocity = self.capture()
        shape, place = self.shape(), _kept(self.place(between(positions)))
        return Frame(
            seq, shape, self.layout.view, status, place, _kept(velocity), self.moving(), *self.links(), self.turned(),
            drawing=self.drawing(), contacts=self.forces.now(),
        )  # fmt: skip

    def shape(self) -> Shape:
        """The shape; the same object until something in it has changed."""
        if not self.shape_is_current:
            self._shape_of, self._shape = self.version, self._new_shape()
        return self._shape

    @property
    def shape_is_current(self) -> bool:
        """Whether the last shape is still valid."""
        return self._shape_of == self.version

    def _new_shape(self) -> Shape:
        outlines: list[tuple[tuple[float, float], ...]] = []
        lines: list[tuple[tuple[float, float], tuple[float, float]]] = []
        panels: list[PanelShape] = []
        periodicities: list[tuple[int, int, Periodicity]] = []
        first, apart = 0, []
        callbacks, worlds = self.presentation.callbacks, self.worlds
        for k, (panel, world) in enumerate(zip(self.panels, self.worlds, strict=True)):
            dx, dy = self.layout.offset(k)
            outlines += [tuple((x + dx, y + dy) for x, y in line) for line in outline(world.boundary)]
            if self.panels.line is not None and (extent := world.boundary.extent()):
                lines.append(((extent[0] + dx, self.panels.line + dy), (extent[2] + dx, self.panels.line + dy)))
            if len(self.panels) > 1:
                panels.append(PanelShape(panel.name, first, len(world), self._start_energies[k], self.layout.strip(k)))
            if periodic := world.boundary.periodic:
                periodicities.append((first, len(world), periodic._replace(low_x=periodic.low_x + dx, low_y=periodic.low_y + dy)))
            apart.append(self._apart[k] + first)
            first += len(world)
        kinds = np.concatenate(
            [np.column_stack((world.category, world.mask)) * np.uint32(world.collisions is not None) for world in worlds]
        )
        return Shape(
            title=self.presentation.title,
            budget_ms=FRAME_BUDGET_MS,
            bounded=self._bounded(),
            parted=self.presentation.part is not None,
            outlines=tuple(outlines),
            lines=tuple(lines),
            panels=tuple(panels),
            differing=self.differing,
            obstacles=self._standing.draw(self.layout),
            scene=self.presentation.scene,
            scenes=self.presentation.repertoire.summaries if self.presentation.repertoire else (),
            callbacks=tuple(name for name in ("keys", "click") if callbacks and callbacks.has(name)),
            countable=self.presentation.countable,
            radius=_kept(np.concatenate([world.radius for world in worlds], dtype=np.float32)),
            mass=_kept(np.concatenate([world.mass for world in worlds], dtype=np.float32)),
            number=_kept(np.concatenate([world.number for world in worlds], dtype=np.uint32, casting="unsafe")),
            group=_kept(np.concatenate([world.group_number for world in worlds])),
            kinds=None if (kinds == (1, EVERYONE)).all() else _kept(kinds),
            apart=_kept(np.concatenate(apart).astype(np.uint32)),
            colours=self._colours(),
            periodicities=tuple(periodicities),
        )

    def _bounded(self) -> bool:
        return any(world.boundary.extent() is not None for world in self.worlds)

    def _colours(self) -> NDArray[np.uint8] | None:
        """The particles' own colours, grey for those added later."""
        given = self.presentation.colours
        if given is None:
            return None
        (world,), (first,) = self.worlds, self._coloured
        row = np.searchsorted(first, world.number).clip(max=len(first) - 1)
        return _kept(np.where((first[row] == world.number)[:, None], given[row], np.uint8(GREY)))


def _joined(arrays: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def _kept(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
