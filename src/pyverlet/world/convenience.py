"""Doors up the house, for convenience: methods of a world that load what they name only when they are called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.ground.shown import count, text
from pyverlet.world.watched import Watched

if TYPE_CHECKING:
    from pyverlet.world.world import World


class Doors(Watched):
    """What a world offers besides physics. Nothing is loaded before it is asked for."""

    def run(self: World, *, seconds: float, dt: float = 1 / 60) -> None:  # type: ignore[misc]
        """Advance by as many frames of dt as come nearest to `seconds`."""
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

        copies.take_up(self, state)

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
