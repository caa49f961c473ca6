"""Decorators of functions that only kernels call: they run without the GIL and raise nothing.

`joining` replaces them by Cython's decorators; uncompiled they do nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]


def kernel(function: Function) -> Function:
    """Replaced by cfunc, nogil and exceptval(check=False) of Cython."""
    return function


def inlined(function: Function) -> Function:
    """Replaced by the same and inline."""
    return function
