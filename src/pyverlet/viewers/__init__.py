"""Live views of worlds. Importing this package loads only itself; the server is loaded when a viewer starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, overload

from pyverlet.common.submodules import lazily

if TYPE_CHECKING:
    from pyverlet.viewers.handle import Page
    from pyverlet.world.panels import Panels
    from pyverlet.world.world import World

__all__ = ["view", "widget"]

__getattr__, __dir__ = lazily(__name__)

DEFAULT_PORT = 8000


class _Options(TypedDict, total=False):
    port: int | None
    open_browser: bool
    title: str
    dt: float
    draw: Callable[..., Any] | None
    keys: Callable[..., Any] | None
    click: Callable[..., Any] | None


@overload
def view(world: World | Panels, *, block: Literal[True] = ..., **options: Unpack[_Options]) -> None: ...
@overload
def view(world: World | Panels, *, block: Literal[False], **options: Unpack[_Options]) -> Page: ...
def view(
    world: World | Panels,
    *,
    block: bool = True,
    port: int | None = None,
    open_browser: bool = True,
    title: str = "pyverlet",
    dt: float = 1 / 60,
    draw: Callable[..., Any] | None = None,
    keys: Callable[..., Any] | None = None,
    click: Callable[..., Any] | None = None,
) -> Page | None:
    """Show `world` on a live page, stepping it in real time.

    The page's reset returns to the current state of the world. Without a screen the address is printed instead. The page also has
    the program's sliders (`pyverlet.slider`) and the curves of `World.watch`.

    Args:
        world: the world, or the panels, to step and show.
        block: until Ctrl-C, while the program must not touch the world. False returns at once, and shares the world.
        port: TCP port on this machine, 1 to 65535; 0 for any free one. 8000 by default, any free one without `block`.
        open_browser: open a tab if there is a screen.
        title: heading of the page.
        dt: simulated seconds per frame.
        draw: of (world, pen), a `pyverlet.picture.Pen`: called for each picture, draws over it.
        keys: of (world, key): called when a key is pressed on the page, named as in browsers: "a", " ", "ArrowLeft".
        click: of (world, point, button): called on a click; (2,) m, and "left", "middle" or "right".

    Returns:
        None; without `block` a handle with `url` and `close()`.

    Raises:
        InputError: the port is taken or not a port, or another argument is outside what is allowed.
    """
    from pyverlet.viewers.presentation import CallbackFunctions, Presentation

    shown = Presentation.of(world, title)
    shown = replace(shown, callbacks=CallbackFunctions(draw=draw, keys=keys, click=click))
    if block:
        from pyverlet.viewers.launch import serve

        serve(lambda: shown, title=title, port=port, open_browser=open_browser, dt=dt)
        return None
    from pyverlet.viewers.handle import Page

    return Page(shown, port=0 if port is None else port, open_browser=open_browser, dt=dt)


def widget(world: World | Panels, *, title: str = "pyverlet", dt: float = 1 / 60, height: int = 480) -> Any:
    """Show `world` live in a cell of a notebook, with dragging and controls; it moves whenever the kernel is idle.

    Args:
        world: the world or panels to step and show. Reset returns to the current state.
        title: heading.
        dt: simulated seconds per frame.
        height: of the cell, pixels.

    Returns:
    An anywidget, for JupyterLab, marimo and others. Where widgets do not run, a picture of the world is shown.

    Raises:
        InputError: the extra `notebook` is missing, or an argument is outside what is allowed.
    """
    from pyverlet.common.outside import require

    require("a widget", "anywidget", "PIL", extra="notebook")
    from pyverlet.viewers.notebook import Widget

    return Widget(world, title=title, dt=dt, height=height)
