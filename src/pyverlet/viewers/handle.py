"""The handle of a page beside a running program: the result of `pyverlet.view(world, block=False)`."""

import contextlib
from contextlib import ExitStack
from typing import Any, Self

from pyverlet.viewers import launch
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.session import Session


class Page:
    """A live page. A thread of its own steps the world, which is shared with the program.

    Adding and removing particles, `step`, `save` and `restore` wait for the end of the current frame by themselves. For any other
    change hold the world between two frames: `with page: balls.velocity[:] = 0`.

    Attributes:
        url: its address.
    """

    def __init__(self, presentation: Presentation, *, port: int, open_browser: bool, dt: float) -> None:
        self._worlds = presentation.panels.worlds
        self._held: list[contextlib.AbstractContextManager[None]] = []
        with ExitStack() as opening:
            listener = opening.enter_context(launch.take_port(port))
            self._session = Session(presentation, dt=dt)
            opening.enter_context(launch.on_air(self._session, listener))
            self.url = launch.address(listener)
            for world in self._worlds:
                world.held_by(self._session.held)
            self._session.start()
            self._stack = opening.pop_all()
        self._stack.callback(self._session.stop)
        launch.announce(presentation.title, self.url, open_browser, blocks=False)

    @property
    def open(self) -> bool:
        """Whether it is still served."""
        return any(world.has_page for world in self._worlds)

    def close(self) -> None:
        """End it and return the world to the program. Repeated calls do nothing."""
        if not self.open:
            return
        self._session.stop()
        for world in self._worlds:
            world.held_by(None)
        self._stack.close()

    def __enter__(self) -> Self:
        hold = self._session.held()
        hold.__enter__()
        self._held.append(hold)
        return self

    def __exit__(self, *error: Any) -> None:
        self._held.pop().__exit__(*error)

    def __repr__(self) -> str:
        return f"Page({self.url})" if self.open else "Page(closed)"
