"""Convenience methods of `World` whose modules are imported on first use."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.shown import count, text

if TYPE_CHECKING:
    from pyverlet.world.world import World


MOST = 12
"""Most curves of a graph that can be told apart."""


class ConvenienceMethods:
    """Methods of a world for running, pictures and films; their modules are imported on first use."""

    def run(self: World, *, seconds: float, dt: float = 1 / 60) -> None:  # type: ignore[misc]
        """Advance by the number of frames of dt that is nearest to `seconds`."""
        seconds = checks.number("seconds", seconds, least=0.0)
        for _ in range(round(seconds / checks.number("dt", dt, above=0.0))):
            self.step(dt)

    def __repr__(self: World) -> str:  # type: ignore[misc]
        held: dict[str, Any] = {"link": self.links, "force": self.forces, "obstacle": self.obstacles, "actor": self.actors}
        counts = [count(len(self), "particle"), *(count(len(things), name) for name, things in held.items() if len(things))]
        return f"{type(self).__name__} of {', '.join(counts)} in {text(self.boundary)}, {self.dtype}, {self.time:.4g} s"

    def __getstate__(self: World) -> dict[str, Any]:  # type: ignore[misc]
        from pyverlet.world import copies

        with self.held():
            copies.check(self)
            return copies.contents(self)

    def __setstate__(self: World, state: dict[str, Any]) -> None:  # type: ignore[misc]
        from pyverlet.world import copies

        copies.restore_state(self, state)

    def __deepcopy__(self: World, memo: dict[Any, Any]) -> World:  # type: ignore[misc]
        from pyverlet.world import copies

        return copies.copied(self, memo)

    def __copy__(self: World) -> World:  # type: ignore[misc]
        return self.__deepcopy__({})

    def to_image(self: World, path: Any = None, **options: Any) -> NDArray[Any]:  # type: ignore[misc]
        """A picture of the world now, (height, width, 3) bytes R, G, B; see `pyverlet.record.to_image` for path and options."""
        from pyverlet.record import to_image

        return to_image(self, path, **options)

    def to_video(self: World, path: Any, **options: Any) -> Any:  # type: ignore[misc]
        """Step the world and record it; see `pyverlet.record.to_video` for the options."""
        from pyverlet.record import to_video

        return to_video(self, path, **options)

    # ---- numbers that are watched --------------------------------------------------------------------------------------

    @cached_property
    def watched(self) -> dict[str, Callable[[World], float]]:
        """The functions passed to `watch`, by name; entries may be deleted."""
        return {}

    def watch(self, name: str, of: Callable[[World], float]) -> None:
        """Draw `of(world)` over time on the page, beside the energy.

        Args:
            name: label of the curve; an existing name is replaced.
            of: called with the world a few times per second; returns a number.

        Raises:
            InputError: `of` is no function, or there are more than twelve curves.
        """
        if not 0 < len(str(name).strip()) <= 60:
            raise InputError(f"name is {name!r}; allowed is a text of 1 to 60 letters")
        if not callable(of):
            raise InputError(f"of is {of!r}; allowed is a function of a world that returns a number")
        if len(self.watched) >= MOST and name not in self.watched:
            raise InputError(f"watch {name!r} would be the {MOST + 1}th; allowed are {MOST}")
        self.watched[name] = of

    def read_watched(self) -> dict[str, float]:
        """Current values of the watched functions, NaN where not finite. A function that raises is no longer watched.

        Raises:
            InputError: a function raised an exception.
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
