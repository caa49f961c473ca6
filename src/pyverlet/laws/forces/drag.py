"""Resistance of the medium, at rest or in motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.ground.checked import Checked
from pyverlet.ground.errors import InputError
from pyverlet.ground.shown import Shown
from pyverlet.state.slots import Slots

Field = Callable[[NDArray[Any], NDArray[Any], float], Any]


def _flow(name: str, value: Any) -> Field | tuple[float, float]:
    """A function, or (x, y)."""
    return value if callable(value) else checks.vector(name, value)


class Drag(Shown):
    """Resistance of a medium at rest: F = -(linear + quadratic |v|) v.

    A fall ends at m g / linear or at sqrt(m g / quadratic), m/s, with any integrator and however strong it is. Where c h / m,
    with c the derivative of F by v, is beyond 1/2, that takes some substeps instead of the time m / c.

    Args:
        linear: N s/m (Stokes).
        quadratic: N s^2/m^2 (Newton).
    """

    _shows: ClassVar[tuple[str, ...]] = ("linear", "quadratic")

    velocity_dependent = True
    account = "drag"
    is_drag = True  # strong drag is softened when all forces are summed
    only_slows = True

    linear = Checked(checks.number, least=0.0)
    quadratic = Checked(checks.number, least=0.0)

    def __init__(self, *, linear: float = 0.0, quadratic: float = 0.0) -> None:
        self.linear, self.quadratic = linear, quadratic

    def apply(self, state: Slots, t: float) -> None:
        self._add(state, np.zeros((1, 2), state.dtype))

    def _add(self, state: Slots, wind: NDArray[Any]) -> None:
        """wind: (n, 2) m/s at each particle, or (1, 2)."""
        state.motion.add_drag(state.force, state.velocity, state.resistance, wind, self.linear, self.quadratic)


class Wind(Drag):
    """Resistance of a medium that moves: F = -(linear + quadratic |u|) u with u = v - velocity.

    Args:
        velocity: (x, y) of the medium, m/s, or a function of (x, y, t) that returns its two components there: x and y are
            arrays in metres, t is in seconds, each component is an array as long or a number.
        linear: N s/m.
        quadratic: N s^2/m^2.
    """

    _shows = ("velocity", "linear", "quadratic")
    only_slows = False

    velocity = Checked(_flow)

    def __init__(self, velocity: Sequence[float] | Field, *, linear: float = 0.0, quadratic: float = 0.0) -> None:
        super().__init__(linear=linear, quadratic=quadratic)
        self.velocity = velocity

    def apply(self, state: Slots, t: float) -> None:
        if callable(self.velocity):
            self._add(state, self._field(self.velocity, state, t))
        else:
            self._add(state, np.array([self.velocity], state.dtype))

    @staticmethod
    def _field(velocity: Field, state: Slots, t: float) -> NDArray[Any]:
        """(n, 2) m/s, of the medium at each particle."""
        wind = np.empty((len(state), 2), state.dtype)
        x, y = np.ascontiguousarray(state.position.T)
        try:
            wind[:, 0], wind[:, 1] = velocity(x, y, t)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"velocity of the wind is a function that fails ({error}); allowed is one of (x, y, t) that returns two "
                f"components, each a number or an array of shape {x.shape}"
            ) from error
        return wind
