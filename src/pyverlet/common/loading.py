"""Ctrl-C while the command still loads: one sentence, as at any later time, and no traceback from within an import.

Imported before anything that takes long. It does something only in a process that is the command, `pyverlet` or
`python -m pyverlet`; imported as a library, it leaves the signals alone.
"""

import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

INTERRUPTED = 130  # exit code: 128 + the number of the signal


def _leave(number: int, frame: Any) -> None:
    os.write(2, b"pyverlet: interrupted\n")
    os._exit(INTERRUPTED)  # an exception might be caught by whatever is being imported


def done() -> None:
    """Everything is loaded: from now on Ctrl-C raises KeyboardInterrupt again."""
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def is_the_command() -> bool:
    """Whether this process is the command, or a program that imports the library."""
    if not sys.argv or sys.argv[0] != "-m":
        return bool(sys.argv) and Path(sys.argv[0]).stem == "pyverlet"
    # Python looks for the module that it is to run: is it this one, or one that uses it?
    words = sys.orig_argv
    return "-m" in words and words[words.index("-m") + 1] == "pyverlet"


if (
    is_the_command()
    and threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, _leave)
