"""What kernels of the contact laws in Python ask of rooms."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np

from pyverlet.kernels import bounds, cage, frame, leaving, meetings
from pyverlet.laws.contacts._held import circles
from pyverlet.laws.rooms import Boundary, Box, Circle, Open, Periodic
from pyverlet.laws.turning import surface
from pyverlet.state.slots import Slots

NOWHERE = (0.0,) * 6
"""The numbers of no walls."""


def compiled(room: Boundary, state: Slots) -> tuple[int, tuple[float, ...]] | None:
    """What `confine` does: of the rooms of `kernels.frame`, and the six numbers of one; None: Python has to call it."""
    if isinstance(room, Circle) and type(room) is Circle and not room.moves:
        if room.restitution == 0.0 == room.friction and state.smooth:  # then its walls take nothing that an account would note
            return frame.SMOOTH_CAGE, (*room.center, room.radius, 0.0, 0.0, 0.0)
        return frame.CAGE, (*room.center, room.radius, 0.0, room.restitution, room.friction)
    if isinstance(room, Box) and type(room) is Box:
        return frame.FOUR_WALLS, (*room.lower, *room.upper, room.restitution, room.friction)
    if isinstance(room, Periodic) and type(room) is Periodic and room.axes != "xy":
        return frame.FOUR_WALLS, (*room._box, room.restitution, room.friction)
    return (frame.OPEN, NOWHERE) if type(room) in (Open, Periodic) else None


def walls(room: Boundary) -> Sequence[float]:
    """Its shape as seven numbers (`kernels.meetings`), so that obstacles push nobody through it; none, if it cannot say."""
    if isinstance(room, Circle):
        # Whom an obstacle pushes to a wall that turns is held there, and rubbed where the wall itself is met.
        return (meetings.ROUND, *room.center, room.radius, 0.0, room.restitution, 0.0 if room.moves else room.friction)
    if isinstance(room, Box | Periodic):
        corners = (*room.lower, *room.upper) if isinstance(room, Box) else room._box
        return (meetings.RECTANGLE, *corners, room.restitution, room.friction)
    return (meetings.OPEN, 0, 0, 0, 0, 0, 0)


def confine(room: Boundary, state: Slots, h: float, lag: float, rest_speed: float) -> None:
    """`Boundary.confine`, in rooms without one of their own by the kernels of this law."""
    kinds = {each.confine: each for each in (Open, Circle, Box, Periodic)}
    kind = kinds.get(type(room).confine)
    if kind is None:
        room.confine(state, h, lag, rest_speed)
    elif isinstance(room, Open) or (isinstance(room, Periodic) and room.axes == "xy"):
        state.resting[:] = 0
    elif isinstance(room, Circle):
        with surface(state, room.angular_velocity * room.radius, h) if room.moves else nullcontext():
            law = map(state.real, (*room.center, room.radius, h, lag, room.restitution, room.friction, rest_speed))
            cage.confine(circles(state), *law)
    elif isinstance(room, Box | Periodic):
        corners = (*room.lower, *room.upper) if isinstance(room, Box) else room._box
        bounds.box(circles(state), *map(state.real, (*corners, h, lag, room.restitution, room.friction, rest_speed)))


def leave(room: Any, state: Slots) -> None:
    """At the end of a frame: note in `state.along` the acceleration that is left to those whom a wall holds."""
    # Where there are obstacles it may be one of them that holds. Whom a wall rubs is not left all that drives it.
    if not isinstance(room, Circle | Box | Periodic) or len(state.along):
        return
    if leaving.anybody_slides(state.resting, state.friction, room.friction):
        what, x0, y0, x1, y1 = map(float, walls(room)[:5])
        state.along = np.empty_like(state.position)
        about = (state.position, state.radius, state.friction, state.resting, state.acceleration)
        leaving.note_along(what, x0, y0, x1, y1, room.friction, *about, state.along)
