"""The command `new`: a sketch to start from."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import typer

from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.ground.errors import InputError
from pyverlet.ground.outside import file_errors
from pyverlet.scenes.sketch import SUFFIX

__all__ = ["app"]

Kind = Literal["cage", "cloth", "fountain", "cradle", "empty"]


@app.command()
def new(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="To write, such as mysketch.py.")],
    kind: Annotated[Kind, typer.Option(help="What it starts with.")] = "cage",
) -> None:
    """Write a sketch to start from: a scene of your own in 25 lines."""
    if path.suffix.lower() != SUFFIX or not path.stem.isidentifier():
        raise InputError(f"path is '{path}'; allowed is a name such as mysketch.py")
    text = (resources.files("pyverlet.cli") / "sketches" / f"{kind}.txt").read_text(encoding="utf-8")
    if path.exists():
        raise InputError(f"path is '{path}', which is there already; allowed is a new name")
    with file_errors("path", path, "written"), path.open("x", encoding="utf-8") as file:
        file.write(text.replace("NAME", path.name))
    out.note(f"wrote '{path}'; now: pyverlet run {path} --watch")
