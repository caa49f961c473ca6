"""Decorators of functions that only kernels call: they run without Python's lock, and raise nothing.

`joining` writes in their places what Cython calls that; uncompiled they do nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]


def kernel(function: Function) -> Function:
    """cfunc, nogil and exceptval(check=False) of Cython."""
    return function


def inlined(function: Function) -> Function:
    """The same, and inline."""
    return function
