"""What a check is: a name, a function that measures one promise, and how large it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from pyverlet.ground.errors import NonFiniteError


@dataclass(frozen=True)
class Result:
    """What a check found.

    Attributes:
        asked: the promise, with its figures.
        measured: what came out, in words.
        passed: whether the promise holds.
        values: the figures in `measured` as numbers, by name.
        name, seconds: of the check, and what it took.
    """

    asked: str
    measured: str
    passed: bool
    values: Mapping[str, float] = field(default_factory=dict)
    name: str = ""
    seconds: float = 0.0


@dataclass(frozen=True)
class Check:
    """One promise about the physics.

    Attributes:
        name: on the command line.
        measure: the function that measures it.
        settings: its arguments.
        full: arguments that differ in the full run: the size the promise is made for, where that takes long.
    """

    name: str
    measure: Callable[..., Result]
    settings: Mapping[str, Any] = field(default_factory=dict)
    full: Mapping[str, Any] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """The first line of the measuring function's documentation."""
        return (self.measure.__doc__ or "").partition("\n")[0]

    def run(self, *, full: bool = False) -> Result:
        """Measure. A world that turns non-finite is a failure, not an error."""
        start = perf_counter()
        try:
            result = self.measure(**{**self.settings, **(self.full if full else {})})
        except NonFiniteError as error:
            result = Result(self.summary, str(error), False)
        return replace(result, name=self.name, seconds=perf_counter() - start)
