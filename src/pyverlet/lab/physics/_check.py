"""What a check is: a name, a function that measures one promise, and how large it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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
    """

    asked: str
    measured: str
    passed: bool
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """A line of the table: the result of a check, and what it took."""

    name: str
    asked: str
    measured: str
    passed: bool
    seconds: float
    values: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """As plain values, ready for JSON."""
        return vars(self) | {"values": dict(self.values)}


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

    def run(self, *, full: bool = False) -> Row:
        """Measure. A world that turns non-finite is a failure, not an error."""
        start = perf_counter()
        try:
            result = self.measure(**{**self.settings, **(self.full if full else {})})
        except NonFiniteError as error:
            result = Result(self.summary, str(error), False)
        return Row(self.name, result.asked, result.measured, result.passed, perf_counter() - start, result.values)
