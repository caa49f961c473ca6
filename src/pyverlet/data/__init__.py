"""Worlds as data: files, many worlds at once, and sweeps over one machine or a cluster.

Importing this loads only the engine; libraries for file formats are loaded when needed.
"""

from pyverlet.common.submodules import lazily

__getattr__, __dir__ = lazily(__name__)
