"""Error messages for functions and classes that pickle cannot store by name, because no other process can import them."""

import sys
from collections.abc import Callable
from typing import Any

from pyverlet.common.errors import InputError

_BY_VALUE = {"cloudpickle", "dill"}  # packages that pickle functions by value, not by name


def by_name(thing: Any) -> bool:
    """Whether another process finds this function, class or object, or an equal one, by module and name."""
    found: Any = sys.modules.get(getattr(thing, "__module__", None) or "")
    for part in str(getattr(thing, "__qualname__", "")).split("."):
        found = getattr(found, part, None)
    return found is thing or (found is not None and bool(found == thing))


def is_by_value() -> bool:
    """Whether the current pickler stores functions by value."""
    frame = sys._getframe()
    while frame.f_back:
        frame = frame.f_back
        if str(frame.f_globals.get("__name__")).split(".")[0] in _BY_VALUE:
            return True
    return False


def check(what: str, *things: Callable[..., Any]) -> None:
    """Raise InputError for the first of these functions and classes that cannot be pickled; `what`: a description of them."""
    for thing in things:
        if not by_name(thing) and not is_by_value():
            name = f"{getattr(thing, '__module__', '?')}.{getattr(thing, '__qualname__', '?')}"
            raise InputError(
                f"{what} cannot be pickled, for no other process can import {name}; allowed are functions and classes defined at "
                "the top level of a module, and for others copy.deepcopy, pyverlet.save, or cloudpickle in place of pickle"
            )
