"""The compiled core: units of kernels, each compiled before the program starts, for two precisions and some processors.

`unit("tools", dtype)` is the extension module of the kernels in `tools.py` and what it imports from here, for arrays of this
type, loaded on first use in the variant that suits the processor. `PYVERLET_CORE=baseline` has the variant that runs on any.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import platform
import sys
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from pyverlet.ground.errors import CoreError

VARIANTS: Final = ("x86_64_v3", "baseline")
"""Sub-folders with compiled units, the fastest first."""

_FOLDER: Final = Path(__file__).resolve().parent

_REBUILD: Final = "install pyverlet again, or run `python -m build_core` in its source folder"


def _extension(variant: str, name: str) -> Path | None:
    """The file of a compiled unit for this Python; None if there is none."""
    paths = (_FOLDER / variant / f"{name}{suffix}" for suffix in EXTENSION_SUFFIXES)
    return next((path for path in paths if path.exists()), None)


def _load(variant: str, name: str) -> ModuleType:
    """Load a compiled unit."""
    path = _extension(variant, name)
    here = f"Python {platform.python_version()} on {platform.machine()}"
    if path is None:
        others = sorted(path.name for path in (_FOLDER / variant).glob(f"{name}.*"))
        has = f"only {', '.join(others)}" if others else "none"
        raise CoreError(f"pyverlet has no compiled core for {here} ({name} of {variant}: there is {has}); {_REBUILD}")
    full = f"{__name__}.{variant}.{name}"
    spec = importlib.util.spec_from_file_location(full, path, loader=ExtensionFileLoader(full, str(path)))
    assert spec is not None
    assert spec.loader is not None
    try:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except Exception as error:
        raise CoreError(f"the compiled core {path} cannot be loaded by {here} ({error}); {_REBUILD}") from error
    sys.modules[full] = module
    return module


@functools.cache
def variant() -> str:
    """Which variant of the core this process uses: one of `VARIANTS`, the fastest that the processor runs.

    Raises:
        CoreError: `PYVERLET_CORE` names none, or one that the processor cannot run; the compiled core is damaged or missing.
    """
    runs = ["baseline"]
    if _load("baseline", "processor").supports_x86_64_v3():
        runs.insert(0, "x86_64_v3")
    present = [name for name in runs if (_FOLDER / name).is_dir()]
    wanted = os.environ.get("PYVERLET_CORE", "")
    if wanted and wanted not in present:
        raise CoreError(f"PYVERLET_CORE is {wanted!r}; allowed on this processor is {' or '.join(present)}")
    return wanted or present[0]


@functools.cache
def unit(name: str, dtype: Any = np.float32) -> Any:
    """The compiled module of a unit, such as `engine`, for arrays of float32 or float64.

    Raises:
        CoreError: it is damaged, missing, or made for another Python or processor.
    """
    return _load(variant(), f"{name}_f{8 * np.dtype(dtype).itemsize}")
