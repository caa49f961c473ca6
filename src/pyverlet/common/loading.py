"""Ctrl-C while the command is loading: one sentence, without a traceback from within an import.

It is imported before anything that takes long, and acts only if the process is the command, `pyverlet` or `python -m pyverlet`;
imported as a library, it leaves signals unchanged.
"""

import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

INTERRUPTED = 130  # 128 + the signal number


def _leave(number: int, frame: Any) -> None:
    os.write(2, b"pyverlet: interrupted\n")
    os._exit(INTERRUPTED)  # an exception might be caught by a module being imported


def done() -> None:
    """After loading: Ctrl-C raises KeyboardInterrupt again."""
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def is_the_command() -> bool:
    """Whether this process is the command, not a program that imports the library."""
    if not sys.argv or sys.argv[0] != "-m":
        return bool(sys.argv) and Path(sys.argv[0]).stem == "pyverlet"
    # During start-up, find out from the command line which module Python will run.
    words = sys.orig_argv
    return "-m" in words and words[words.index("-m") + 1] == "pyverlet"


if (
    is_the_command()
    and threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, _leave)
