"""Supported versions of NumPy, and an error message for others."""

import sys

import numpy as np

from pyverlet.common import loading

LEAST, BELOW = (2, 0), (3, 0)  # first supported version of NumPy, and first that may be incompatible
ALLOWED = "numpy>=2.0,<3.0"  # for pip


def complaint(version: str) -> str | None:
    """The complaint about this version of NumPy; None if it is supported or unknown."""
    number = tuple(int(part) for part in version.split(".")[:2] if part.isdigit())
    if len(number) < 2 or LEAST <= number < BELOW:
        return None
    return f"numpy is {version}; allowed is {ALLOWED} (pip install {ALLOWED!r})"


def check() -> None:
    """Refuse a NumPy that is too old or too new, with ImportError."""
    wrong = complaint(np.__version__)
    if wrong and loading.is_the_command():  # the command reports errors without a traceback
        sys.stderr.write(f"pyverlet: {wrong}\n")
        sys.exit(1)
    if wrong:
        raise ImportError(wrong)


check()
