"""Former names of attributes and methods, which work for one version."""

import warnings
from typing import Any


class Renamed:
    """An attribute under its former name: getting or setting it warns, and acts on the attribute of the new name."""

    def __init__(self, now: str) -> None:
        self._now = now

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, one: Any, owner: type | None = None) -> Any:
        if one is None:
            return self
        self._warn()
        return getattr(one, self._now)

    def __set__(self, one: Any, value: Any) -> None:
        self._warn()
        setattr(one, self._now, value)

    def _warn(self) -> None:
        warnings.warn(f"{self._name} is deprecated; it is called {self._now} now", DeprecationWarning, stacklevel=3)
