# mypy: ignore-errors
"""The unit of the tools: kernels that Python calls by themselves, outside of a frame."""

from __future__ import annotations

from pyverlet.core.digest import digest

__all__ = ["digest"]
