"""What stands at an import path of the user's own, `module:name`; the working folder is searched too."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

from pyverlet.ground.errors import InputError


def imported(option: str, path: str, allowed: str) -> Any:
    """The object at the path; `option` and `allowed` are for the sentence of the InputError if there is none."""
    module_name, _, attribute = path.partition(":")
    if not all(part.isidentifier() for part in (*module_name.split("."), attribute)):
        raise InputError(f"{option} is {path!r}; {allowed}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # whatever is wrong with the user's module
        raise InputError(f"{option} is {path!r}, whose module cannot be imported ({what(error)}); {allowed}") from error
    found = getattr(module, attribute, None)
    if found is None:
        raise InputError(f"{option} is {path!r}, but {module_name} has no {attribute}; {allowed}")
    return found


def what(error: Exception) -> str:
    """An error in a few words."""
    return f"{type(error).__name__}: {error}"
