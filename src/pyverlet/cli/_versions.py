"""The command versions: what is installed, and which variant of the compiled core this processor uses."""

from __future__ import annotations

import platform
from importlib import metadata

from pyverlet import __version__, core
from pyverlet.cli import _print as out
from pyverlet.cli._app import app


@app.command()
def versions() -> None:
    """Print the versions of pyverlet, Python and NumPy, and which variant of the compiled core is in use."""
    others = ", ".join(name for name in core.variants() if name != core.variant())
    allowed = f" (PYVERLET_CORE allows {others}, too)" if others else ""
    out.write(f"pyverlet {__version__}")
    out.write(f"core {core.variant()}, compiled by {core.compiler()}{allowed}")
    out.write(f"Python {platform.python_version()}, {platform.system()} {platform.machine()}")
    out.write(f"NumPy {metadata.version('numpy')}")
