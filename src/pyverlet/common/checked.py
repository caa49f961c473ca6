"""Attributes that are checked when set."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

Value = TypeVar("Value")

_numbers = itertools.count(1)
changes = SimpleNamespace(latest=0)
"""`latest` is another number whenever a checked attribute of any object of this process has been set."""


class Checked(Generic[Value]):
    """An attribute that is checked when set; if its value changes, its owner's method `_changed` is called, if there is one.

    Args:
        check: called with the name, the value and `how`; returns the value in the engine's form or raises InputError.
        none: whether None is allowed.
    """

    def __init__(self, check: Callable[..., Value], *, none: bool = False, **how: Any) -> None:
        self._check, self._none, self._how = check, none, how

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # for type checkers it is an ordinary attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Value: ...

    def __set__(self, owner: Any, value: Any) -> None:
        value = None if self._none and value is None else self._check(self._name, value, **self._how)
        held, vars(owner)[self._name] = vars(owner).get(self._name, Checked), value
        changes.latest = next(_numbers)
        if (isinstance(value, np.ndarray) or held != value) and (changed := getattr(owner, "_changed", None)):
            changed(self._name)
