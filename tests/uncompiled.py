"""The core as plain Python, loaded once for all tests of a process: a unit takes a second or two."""

import functools

from pyverlet.core import reference

UNCOMPILED = functools.cache(reference.load)
"""`core.unit` of kernels that run as Python."""
