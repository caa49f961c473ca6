"""The command `replay`."""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.ground.errors import InputError
from pyverlet.ground.progress import Progress

__all__ = ["app"]


@app.command()
def replay(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A journal, as `pyverlet run --journal FILE` wrote it.")],
    headless: Annotated[bool, typer.Option("--headless", help="Without the page, as fast as it goes, and report.")] = False,
    as_json: options.Json = False,
    no_open: options.NoOpen = False,
    port: options.Port = None,
) -> None:
    """Go through a session again, on the page or without, and compare the state's hash with that of then every second.

    --json implies --headless. The exit code is 1 where a hash differs.
    """
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.replay import ReplayState, Script

    script = Script(path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        first = script.open()
    for warning in caught:
        out.note(f"note: {warning.message}")
    if not (headless or as_json):
        view_state = partial(ReplayState, script)
        serve(lambda: first, title=first.title, port=port, open_browser=not no_open, dt=script.dt, view_state=view_state)
        return
    if port is not None or no_open:
        raise InputError("port or no-open is given for a replay without a page; allowed is none of them")
    with Progress("frame") as progress:
        done = script.run(progress)
    if as_json:
        out.write_json(done)
        return
    end = "" if done["whole"] else "; it was cut off there"
    rows = [
        ("journal", str(path)),
        ("went through", f"{done['frames']:,} frames, {done['seconds']:.4g} s, {done['commands']} commands{end}"),
        ("hashes", f"{done['checked']} of {done['checked']} as they were"),
        ("state hash", done["state_hash"]),
    ]
    if done["stopped"]:
        rows.append(("stopped", f"{done['stopped']}, as in the session"))
    out.write(out.table(rows))
