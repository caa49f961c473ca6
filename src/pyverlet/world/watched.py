"""What a world shows of itself beside its energy: numbers with a name, read whenever somebody looks."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

from pyverlet.ground.errors import InputError

if TYPE_CHECKING:
    from pyverlet.world.world import World

MOST = 12
"""Curves beside each other that can be told apart."""


class Watched:
    """Numbers to watch."""

    @cached_property
    def watched(self) -> dict[str, Callable[[World], float]]:
        """What `watch` was told, by name; entries may be taken out."""
        return {}

    def watch(self, name: str, of: Callable[[World], float]) -> None:
        """Draw `of(world)` over time on the page, beside the energy.

        Args:
            name: of the curve; the same name again replaces it.
            of: called with the world some times a second; returns a number.

        Raises:
            InputError: it is no function, or there are more than twelve.
        """
        if not 0 < len(str(name).strip()) <= 60:
            raise InputError(f"name is {name!r}; allowed is a text of 1 to 60 letters")
        if not callable(of):
            raise InputError(f"of is {of!r}; allowed is a function of a world that returns a number")
        if len(self.watched) >= MOST and name not in self.watched:
            raise InputError(f"watch {name!r} would be the {MOST + 1}th; allowed are {MOST}")
        self.watched[name] = of

    def read_watched(self) -> dict[str, float]:
        """What is watched, now; NaN where a function returns no finite number, and what fails is not watched any more.

        Raises:
            InputError: a function has raised something.
        """
        found = {}
        for name, of in list(self.watched.items()):
            try:
                value = float(of(self))  # type: ignore[arg-type]  # it is mixed into World
            except Exception as error:
                del self.watched[name]
                raise InputError(f"what is watched as {name!r} has failed: {type(error).__name__}: {error}") from error
            found[name] = value if math.isfinite(value) else math.nan
        return found
