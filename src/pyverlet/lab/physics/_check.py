"""What a check is: a name, a function that measures one promise, and how large it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from pyverlet.ground.errors import NonFiniteError


@dataclass(frozen=True)
class Result:
    """What a check found."""

    asked: str  # the promise, with its figures
    measured: str  # what came out, in words
    passed: bool  # whether the promise holds
    values: Mapping[str, float] = field(default_factory=dict)  # the figures in `measured` as numbers, by name
    name: str = ""  # of the check
    seconds: float = 0.0  # that it took


@dataclass(frozen=True)
class Check:
    """One promise about the physics."""

    name: str  # on the command line
    measure: Callable[..., Result]  # measures it
    settings: Mapping[str, Any] = field(default_factory=dict)  # arguments of `measure`
    full: Mapping[str, Any] = field(default_factory=dict)  # those that differ in the full run, of the size that is promised

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
