"""The versions of what the engine keeps its arrays in: those that will do, and one sentence for others."""

import sys

import numpy as np

from pyverlet.common import loading

LEAST, BELOW = (2, 0), (3, 0)  # the first version of NumPy that will do, and the first that may be incompatible
ALLOWED = "numpy>=2.0,<3.0"  # the same for pip


def complaint(version: str) -> str | None:
    """What is wrong with this version of NumPy; None if nothing is, or it cannot be told."""
    number = tuple(int(part) for part in version.split(".")[:2] if part.isdigit())
    if len(number) < 2 or LEAST <= number < BELOW:
        return None
    return f"numpy is {version}; allowed is {ALLOWED} (pip install {ALLOWED!r})"


def check() -> None:
    """Refuse a NumPy that is too old or too new, with ImportError."""
    wrong = complaint(np.__version__)
    if wrong and loading.is_the_command():  # whose users get sentences, no tracebacks
        sys.stderr.write(f"pyverlet: {wrong}\n")
        sys.exit(1)
    if wrong:
        raise ImportError(wrong)


check()
