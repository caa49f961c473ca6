"""setuptools' PEP 517 backend, which asks for a C compiler from PyPI where the machine has none."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403  (its other hooks are those of this backend, too)

from build_core.compiler import requirements

Settings = dict[str, Any] | None


def get_requires_for_build_wheel(config_settings: Settings = None) -> list[str]:
    """What pip installs before it builds a wheel."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *requirements()]


def get_requires_for_build_editable(config_settings: Settings = None) -> list[str]:
    """What pip installs before it builds an editable install."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *requirements()]


def build_wheel(wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None) -> str:
    """Build a wheel; not with what an earlier build left in setuptools' folder, which may have been deleted since."""
    for old in Path("build").glob("lib*"):
        shutil.rmtree(old)
    return str(build_meta.build_wheel(wheel_directory, config_settings, metadata_directory))
