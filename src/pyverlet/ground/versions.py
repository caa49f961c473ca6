"""The versions of what the engine keeps its arrays in: those that will do, and one sentence for others."""

from __future__ import annotations

import sys
from typing import Final

import numpy as np

from pyverlet.ground import loading

ALLOWED: Final = {"numpy": ((2, 0), (3, 0))}
"""By package: the first version that will do, and the first that may be incompatible."""


def _plain(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


def complaint(package: str, version: str) -> str | None:
    """What is wrong with this version; None if nothing is, or it cannot be told."""
    least, below = ALLOWED[package]
    number = tuple(int(part) for part in version.split(".")[:2] if part.isdigit())
    if len(number) < 2 or least <= number < below:
        return None
    allowed = f"{package}>={_plain(least)},<{_plain(below)}"
    return f"{package} is {version}; allowed is {allowed} (pip install {allowed!r})"


def check() -> None:
    """Refuse a NumPy that is too old or too new, with ImportError."""
    wrong = complaint("numpy", np.__version__)
    if wrong and loading.is_the_command():  # whose users get sentences, no tracebacks
        sys.stderr.write(f"pyverlet: {wrong}\n")
        sys.exit(1)
    if wrong:
        raise ImportError(wrong)


check()
