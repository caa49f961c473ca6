"""A world in a cell of a notebook: the live page as an anywidget. Needs the extra `notebook`.

The world is stepped in the kernel's thread and only when the page asks, between two cells: other cells may use it safely. While
one of them runs, or no page is visible, the world stands still.
"""

import base64
import io
from collections.abc import Sequence
from typing import Any

import anywidget
import traitlets
from PIL import Image

from pyverlet.common import checks
from pyverlet.viewers import bundle
from pyverlet.viewers.commands import Release
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.protocol import Display, Encoder
from pyverlet.viewers.renderer import Renderer
from pyverlet.viewers.session import Session
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

LONGEST_S = 0.1  # most seconds made up for at once: after a long cell the world continues where it was
MOST_WORDS = 256  # most messages in one; normally a dozen
MOST_VIEWS = 32  # most displays of one widget at a time; displays closed without notice are dropped
STILL_WIDTH = 720  # width of the fallback picture, pixels


class Widget(anywidget.AnyWidget):
    """A widget that shows and steps a world, or panels, in a cell of `height` pixels. Made by `pyverlet.widget`."""

    _esm = bundle.script()
    height = traitlets.Int(480).tag(sync=True)

    def __init__(self, world: World | Panels, *, title: str, dt: float, height: int) -> None:
        self.world = world
        self._session = Session(Presentation.of(world, title), dt=dt)
        self._encoder = Encoder()
        self._displays: dict[str, Display] = {}
        self._pointers = 0
        super().__init__(height=checks.integer("height", height, least=100, most=4096))
        self.on_msg(self._on_message)

    def _on_message(self, widget: Any, content: Any, buffers: Sequence[Any]) -> None:
        """Apply a message of a page, step the world up to now, and answer with what is new."""
        if not isinstance(content, dict) or not isinstance(content.get("view"), str):
            return
        if content.get("gone"):
            self._forget(content["view"])
            return
        display = self._display_of(content["view"])
        words = content.get("words")
        replies = [reply for text in (words[:MOST_WORDS] if isinstance(words, list) else []) for reply in display.obey(text)]
        self._session.run_once(longest=LONGEST_S)
        if news := display.news():
            frame, options, shape = news
            replies += [*shape, self._encoder.frame(frame, options)]
        self.send({"view": content["view"]}, buffers=replies)

    def _display_of(self, view: str) -> Display:
        if view not in self._displays:
            while len(self._displays) >= MOST_VIEWS:
                self._forget(next(iter(self._displays)))
            self._pointers += 1
            self._displays[view] = Display(self._session, self._encoder, self._pointers)
        return self._displays[view]

    def _forget(self, view: str) -> None:
        if display := self._displays.pop(view, None):
            self._session.submit(Release(display.pointer))

    def _repr_png_(self) -> bytes:
        """A picture of the first world."""
        world = Panels.of(self.world).worlds[0]
        pixels = Renderer(world, (STILL_WIDTH, self.height)).paint()
        file = io.BytesIO()
        Image.fromarray(pixels[..., :3]).save(file, "PNG", optimize=True)
        return file.getvalue()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget and a fallback picture where widgets do not run (printed notebooks, code hosts)."""
        given: Any = super()._repr_mimebundle_(**options)
        if given is None:
            return None
        data, metadata = given if isinstance(given, tuple) else (given, {})
        return {**data, "image/png": base64.b64encode(self._repr_png_()).decode()}, metadata
