# mypy: ignore-errors
"""Which instructions the processor has, and what the core was compiled by: compiled for the baseline, so that it runs on any."""

from __future__ import annotations

from cython.cimports.processor import compiler_name, x86_64_level


def level():
    """The highest level of x86-64 of this processor and system that some variant is for: 1, 3 or 4; 0 for other processors."""
    return x86_64_level()


def compiled_by():
    """The compiler and its version."""
    return compiler_name().decode()
