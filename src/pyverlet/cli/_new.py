"""The command `new`: a sketch to start from."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import typer

from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.ground.errors import InputError
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
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text.replace("NAME", path.name))
    except FileExistsError:
        raise InputError(f"path is '{path}', which is there already; allowed is a new name") from None
    except OSError as error:
        raise InputError(f"path is '{path}', which cannot be written: {error.strerror or error}") from None
    out.note(f"wrote '{path}'; now: pyverlet run {path} --watch")
