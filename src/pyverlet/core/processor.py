# mypy: ignore-errors
"""Which instructions the processor has, and what the core was compiled by: compiled for the baseline, so that it runs on any."""

from __future__ import annotations

from cython.cimports.processor import compiler_name, has_x86_64_v3


def supports_x86_64_v3():
    """Whether code compiled for x86-64-v3 (AVX2 and its companions) runs on this processor and system."""
    return has_x86_64_v3()


def compiled_by():
    """The compiler and its version."""
    return compiler_name().decode()
