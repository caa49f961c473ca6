"""Resistance of the medium, at rest, in motion or warm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.laws.forces._base import Substep
from pyverlet.state.sorted_state import SortedState

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

    def apply(self, state: SortedState, t: float) -> None:
        self._add(state, np.zeros((1, 2), state.dtype))

    def _add(self, state: SortedState, wind: NDArray[Any]) -> None:
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

    def apply(self, state: SortedState, t: float) -> None:
        if callable(self.velocity):
            self._add(state, self._field(self.velocity, state, t))
        else:
            self._add(state, np.array([self.velocity], state.dtype))

    @staticmethod
    def _field(velocity: Field, state: SortedState, t: float) -> NDArray[Any]:
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


class Langevin(Shown):
    """A heat bath: friction slows every free particle, and random kicks warm it to the temperature (Langevin 1908).

    dv = -friction v dt + sqrt(2 friction temperature / m) dW. Each direction of motion comes to hold temperature / 2 on average,
    whatever the mass, the forces and the room. Spins are left alone. The part of friction and kicks is solved exactly over a
    substep of any length (Ornstein-Uhlenbeck): v' = c v + sqrt((1 - c^2) temperature / m) N, with c = exp(-friction h), N normal.
    With the position Verlet methods positions are then distributed as the temperature says to order 2 in h, and exactly in a
    harmonic well (Leimkuhler and Matthews 2013: the kick stands in the middle of the drift).

    The random numbers are a function of the seed, the number of the frame and of the substep, and the particle's own number
    (SplitMix64): a run repeated, saved and restored, or with other threads has the same bits. Between systems the last bits of
    logarithms and sines may differ. What the bath gives and takes is in
    the ledger's `thermostat`. Nothing sleeps in a heat bath. Collisions with a restitution below 1 take heat for ever.

    Args:
        temperature: k T, J; 0 leaves the friction alone.
        friction: 1/s; the velocity is forgotten after about 1 / friction. 0 does nothing.
        seed: a whole number of at least 0, of which 64 bits count; another one for each heat bath of a world.
    """

    _shows = ("temperature", "friction", "seed")

    velocity_dependent = False
    account = "thermostat"

    temperature = Checked(checks.number, least=0.0)
    friction = Checked(checks.number, least=0.0)
    seed = Checked(checks.integer, least=0)

    def __init__(self, *, temperature: float, friction: float, seed: int = 0) -> None:
        self.temperature, self.friction, self.seed = temperature, friction, seed

    def apply(self, state: SortedState, t: float) -> None:
        """No force: all is done once for each substep."""

    def end_substep(self, state: SortedState, at: Substep) -> float:
        """Kick each free particle; returns what that has given, J."""
        keeps = float(np.exp(-self.friction * at.h))
        when, law = ((self.seed + 2**63) % 2**64 - 2**63, at.frame, at.step), (keeps, self.temperature, at.lag)
        return float(
            state.motion.thermalize(state.velocity, state.position, state.inverse_mass, state.particle, at.number, when, *law)
        )
