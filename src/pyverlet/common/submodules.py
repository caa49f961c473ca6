"""Submodules as attributes of their package, imported on first use, such as `pv.draw.pygame` after `import pyverlet as pv`."""

import sys
from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from typing import Any


def lazily(package: str, listed: Callable[[], list[str]] | None = None) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` for a package that imports public submodules on first use; `listed`: its other names."""
    module = sys.modules[package]
    known = {found.name for found in iter_modules(module.__path__) if not found.name.startswith("_")}

    def get(name: str) -> Any:
        if name not in known:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=module)
        try:
            return import_module(f"{package}.{name}")
        except ModuleNotFoundError as error:  # AttributeError, so that `hasattr` works
            says = f"{package}.{name} needs {error.name!r}, which is not installed"
            raise AttributeError(says, name=name, obj=module) from error

    def names() -> list[str]:
        return sorted({*vars(module), *known, *(listed() if listed else ())})

    return get, names
