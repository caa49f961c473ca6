"""The `pyverlet` command: it converts strings to objects and errors to messages."""

import os
import platform
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata

import typer

from pyverlet import __version__, core
from pyverlet.cli import _lab, _saved  # noqa: F401  (they register their commands)
from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.cli._print import FAILED
from pyverlet.common import loading
from pyverlet.common.errors import InputError, Interrupted, PyverletError

__all__ = ["app", "main"]

BAD_INPUT = 2


@app.command()
def versions() -> None:
    """Print the versions of pyverlet, Python and NumPy, and which variant of the compiled core is in use."""
    others = ", ".join(name for name in core.variants() if name != core.variant())
    allowed = f" (PYVERLET_CORE allows {others}, too)" if others else ""
    out.write(f"pyverlet {__version__}")
    out.write(f"core {core.variant()}, compiled by {core.compiler()}{allowed}")
    out.write(f"Python {platform.python_version()}, {platform.system()} {platform.machine()}")
    out.write(f"NumPy {metadata.version('numpy')}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 done, 2 bad input, 1 failed, 130 interrupted.

    Errors are one sentence on standard error. With PYVERLET_TRACEBACK=1 in the environment the traceback of an unexpected error
    is printed, too.
    """
    loading.done()
    try:
        code = app(args=arguments, prog_name="pyverlet", standalone_mode=False)
        sys.stdout.flush()
    except typer.TyperException as error:
        return _complain(error.format_message(), error.exit_code)
    except PyverletError as error:
        code = BAD_INPUT if isinstance(error, InputError) else loading.INTERRUPTED if isinstance(error, Interrupted) else FAILED
        return _complain(str(error), code)
    except KeyboardInterrupt:
        return _complain("interrupted", loading.INTERRUPTED)
    except BrokenPipeError:
        # The reader of the output (`| head`) is gone; Python would report that again when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except MemoryError as error:
        return _complain(f"not enough memory for this many particles ({error})", FAILED)
    except Exception as error:
        if os.environ.get("PYVERLET_TRACEBACK"):
            traceback.print_exc()
        if isinstance(error, OSError):  # of the machine, not of the program
            return _complain(f"{error.strerror or error}{f': {error.filename!r}' if error.filename else ''}", FAILED)
        hint = "PYVERLET_TRACEBACK=1 in the environment shows where"
        return _complain(f"unexpected {type(error).__name__}: {error} ({hint})", FAILED)
    if code == loading.INTERRUPTED:  # typer's exit code for Ctrl-C
        return _complain("interrupted", loading.INTERRUPTED)
    return code if isinstance(code, int) else 0


def _complain(message: str, code: int) -> int:
    sentence = " ".join(message.split()).rstrip(".")
    sys.stderr.write(f"pyverlet: {sentence}\n")
    return code
