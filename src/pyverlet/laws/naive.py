"""Bounds as sketches write them, to be shown beside the real ones; never what a world should use.

`Box` and `Circle` find the moment of the impact and reflect there: with e = 1 a bounce keeps its energy to rounding. The two
here look only at where the step has ended, a depth d beyond the wall.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground.arrays import Array
from pyverlet.ground.errors import InputError
from pyverlet.laws.rooms import Boundary, Box, Circle, Extent, held_by
from pyverlet.state.slots import Slots


class Naive(Boundary):
    """A room of another boundary's shape.

    Args:
        room: Box or Circle without friction.
    """

    _flip: bool

    def __init__(self, room: Box | Circle) -> None:
        if not isinstance(room, Box | Circle):
            raise InputError(f"room is {room!r}; allowed are pyverlet.Box(...) and pyverlet.Circle(...)")
        if room.friction:
            raise InputError(f"friction of the room is {room.friction:g}; allowed is 0, since {type(self).__name__} has none")
        self.room = room

    @property
    def restitution(self) -> float:
        """e of the walls."""
        return self.room.restitution

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        room = self.room
        clamp: Any = state.motion.clamp_to_box if isinstance(room, Box) else state.motion.clamp_to_circle
        shape = (*room.lower, *room.upper) if isinstance(room, Box) else (*room.center, room.radius)
        moving = state.position, state.velocity, state.radius, held_by(room, state)
        clamp(*shape, *moving, h, room.restitution, self._flip)

    def extent(self) -> Extent:
        return self.room.extent()

    def outside(self, position: Array) -> Array:
        return self.room.outside(position)

    def holds(self, category: ArrayLike, mask: ArrayLike) -> NDArray[np.bool_]:
        return self.room.holds(category, mask)

    def check(self, radius: Array) -> None:
        self.room.check(radius)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.room!r})"


class ClampAndFlip(Naive):
    """Put the circle back on the wall and turn the normal velocity round, times e. For demonstration.

    Under gravity g even e = 1 does not keep the energy. A method whose velocity belongs to the time of the position gains m g d
    at each bounce: it was lifted by d and keeps the speed of below the wall. Semi-implicit Euler and position Verlet turn round
    w = (x_prev - x) / h, as the sketches do, and lose m g (w h - d). See `pyverlet truth`.

    Args:
        room: Box or Circle, with its restitution; without friction.
    """

    _flip = True


class ProjectOnly(Naive):
    """Put the circle back on the wall and nothing else, as if x - x_prev were all a particle knows. For demonstration.

    The shift d enters the velocity as d / h. An arriving circle ends at rest on the wall, whatever its speed: its restitution
    is 0, and that of `room` must be.

    Args:
        room: Box or Circle, without restitution and friction.
    """

    _flip = False

    def __init__(self, room: Box | Circle) -> None:
        super().__init__(room)
        if room.restitution:
            raise InputError(
                f"restitution of the room is {room.restitution:g}; allowed is 0, since projection alone never bounces"
            )
