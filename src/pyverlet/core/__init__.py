"""The compiled core: units of kernels, built in advance for two precisions and several processor levels.

`unit("tools", dtype)` is the extension module of the kernels in `tools.py` and of what it imports from here, for arrays of
this type. It is loaded on first use, in the fastest variant that the processor runs. `PYVERLET_CORE=baseline` selects the
variant that runs on any processor.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import platform
import struct
import sys
import threading
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from pyverlet.common import loading
from pyverlet.common.errors import CoreError

VARIANTS: Final = {"x86_64_v4": 4, "x86_64_v3": 3, "baseline": 0}
"""Sub-folder with compiled units, the fastest first -> level of x86-64 that it needs."""

_FOLDER: Final = Path(__file__).resolve().parent

_REBUILD: Final = "install pyverlet again, or run `python -m build_core` in its source folder"


_LOADING: Final = threading.RLock()
"""Held while a unit is loaded; otherwise another thread could see a half-initialised module."""


def _extension(variant: str, name: str) -> Path | None:
    """The file of a compiled unit for this Python; None if there is none."""
    paths = (_FOLDER / variant / f"{name}{suffix}" for suffix in EXTENSION_SUFFIXES)
    return next((path for path in paths if path.exists()), None)


def _is_truncated(path: Path) -> bool:
    """Whether an ELF file is cut short: loading it would crash the process."""
    with path.open("rb") as file:
        header = file.read(64)
    if header[:6] != b"\x7fELF\x02\x01" or len(header) < 64:
        return path.stat().st_size < 64
    sections, size, count = struct.unpack_from("<Q", header, 40)[0], *struct.unpack_from("<HH", header, 58)
    return bool(path.stat().st_size < sections + size * count)


def _load(variant: str, name: str) -> ModuleType:
    """Load a compiled unit from its file."""
    path = _extension(variant, name)
    here = f"Python {platform.python_version()} on {platform.machine()}"
    if path is None:
        others = sorted(path.name for path in (_FOLDER / variant).glob(f"{name}.*"))
        has = f"only {', '.join(others)}" if others else "none"
        raise CoreError(f"pyverlet has no compiled core for {here} ({name} of {variant}: there is {has}); {_REBUILD}")
    if _is_truncated(path):
        raise CoreError(f"the compiled core {path} is damaged: its end is missing; {_REBUILD}")
    full = f"{__name__}.{name}"
    spec = importlib.util.spec_from_file_location(full, path, loader=ExtensionFileLoader(full, str(path)))
    assert spec is not None
    assert spec.loader is not None
    try:
        with _LOADING:
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
    except Exception as error:
        raise CoreError(f"the compiled core {path} cannot be loaded by {here} ({error}); {_REBUILD}") from error
    return module


@functools.cache
def _processor() -> Any:
    """The unit that detects the processor, compiled for any."""
    return _load("baseline", "processor")


@functools.cache
def variants() -> tuple[str, ...]:
    """The variants of the core that this processor runs, the fastest first.

    Raises:
        CoreError: the compiled core is damaged, missing, or made for another Python or processor.
    """
    has = _processor().level()
    return tuple(name for name, needs in VARIANTS.items() if needs <= has and _extension(name, "engine_f32"))


@functools.cache
def variant() -> str:
    """The variant in use: the fastest that the processor runs, or the one that `PYVERLET_CORE` names.

    Raises:
        CoreError: `PYVERLET_CORE` names none of `variants()`, or there is none.
    """
    wanted, allowed = os.environ.get("PYVERLET_CORE", ""), variants()
    if not allowed:
        raise CoreError(f"pyverlet has no compiled core in {_FOLDER}; {_REBUILD}")
    if wanted and wanted not in allowed:
        raise CoreError(f"PYVERLET_CORE is {wanted!r}; allowed on this processor is {' or '.join(allowed)}")
    return wanted or allowed[0]


def compiler() -> str:
    """The compiler that built the core, such as `Clang 21.1.0` or `GCC 14.2.0`."""
    return str(_processor().compiled_by())


@functools.cache
def unit(name: str, dtype: Any = np.float32) -> Any:
    """The compiled module of a unit, such as `engine`, for arrays of float32 or float64.

    Raises:
        CoreError: it is damaged, missing, or made for another Python or processor.
    """
    return _load(variant(), f"{name}_f{8 * np.dtype(dtype).itemsize}")


def _check() -> None:
    """Choose a variant at import, so that an installation for another Python or processor is reported at once."""
    try:
        variant()
    except CoreError as error:
        if loading.is_the_command():  # the command reports errors without a traceback
            sys.stderr.write(f"pyverlet: {error}\n")
            sys.exit(1)
        raise


_check()
