"""Integrators by name, `rk4`, and what stands at an import path of the user's own, `mymodule:MyIntegrator`."""

from __future__ import annotations

import importlib
import inspect
import sys
from pathlib import Path
from typing import Any

from pyverlet.ground.errors import InputError
from pyverlet.ground.guess import did_you_mean
from pyverlet.laws.integrators import BY_NAME, Integrator


def integrators(names: str | None) -> tuple[Integrator, ...]:
    """The integrators in a list with commas; none for None. InputError if one is unknown, or given twice."""
    if names is None:
        return ()
    found = tuple(integrator(name.strip()) for name in names.split(","))
    labels = [each.label for each in found]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise InputError(f"integrators names {twice[0]!r} twice; allowed is each once")
    return found


def single(name: str | None) -> Integrator | None:
    """The integrator of this name; None for None. InputError if it is unknown, or there are several."""
    found = integrators(name)
    if len(found) > 1:
        raise InputError(f"integrator is {name!r}; allowed is one")
    return found[0] if found else None


def integrator(name: str) -> Integrator:
    """The integrator called `name`, or the one at the import path `module:Class`; the working folder is searched too.

    Raises:
        InputError: there is none; the message suggests the nearest and names the known ones, or says what the path lacks.
    """
    if ":" in name:
        return _imported(name)
    if name in BY_NAME:
        return BY_NAME[name]()
    hint = did_you_mean(name.lower().replace("_", "-"), BY_NAME, alike=0.5)
    raise InputError(f"unknown integrator {name!r}{hint}; known: {', '.join(BY_NAME)}, or your own as module:Class")


def _imported(path: str) -> Integrator:
    allowed = "allowed is module:Class, a class deriving from pyverlet.Integrator"
    found = imported("integrator", path, allowed)
    try:
        made = found() if isinstance(found, type) else found
    except Exception as error:
        raise InputError(f"integrator is {path!r}, which cannot be made without arguments ({what(error)}); {allowed}") from error
    if not isinstance(made, Integrator):
        raise InputError(f"integrator is {path!r}, which is no Integrator; {allowed}")
    if lacks := [name for name in ("order", "symplectic") if inspect.getattr_static(type(made), name, None) is None]:
        raise InputError(f"integrator is {path!r}, which does not state {lacks[0]!r}; {allowed}, with order and symplectic")
    return made


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
