"""Worlds as data: kept in files, many at once, and in sweeps over one machine or a cluster.

Importing this loads nothing but the engine; libraries that write a format are loaded when it is asked for.
"""

from pyverlet.common.submodules import lazily

__getattr__, __dir__ = lazily(__name__)
