# mypy: ignore-errors
"""Detects the processor's instruction set and the core's compiler; compiled for the baseline, to run on any processor."""

from __future__ import annotations

from cython.cimports.processor import compiler_name, x86_64_level


def level():
    """The highest x86-64 level of this processor and system that has a variant: 1, 3 or 4; 0 for other processors."""
    return x86_64_level()


def compiled_by():
    """The compiler and its version."""
    return compiler_name().decode()
