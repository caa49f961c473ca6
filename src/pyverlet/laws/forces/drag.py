"""Resistance of a medium at rest, in motion, or at a temperature."""

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
    """A checked flow: a function, or (x, y)."""
    return value if callable(value) else checks.vector(name, value)


class Drag(Shown):
    """Resistance of a medium at rest: F = -(linear + quadratic |v|) v.

    The terminal speed is m g / linear or sqrt(m g / quadratic), m/s, with any integrator and however strong the drag is. If
    c h / m, with c the derivative of F by v, exceeds 1/2, it is reached within some substeps instead of the time m / c.

    Args:
        linear: N s/m (Stokes).
        quadratic: N s^2/m^2 (Newton).
    """

    _shows: ClassVar[tuple[str, ...]] = ("linear", "quadratic")

    velocity_dependent = True
    account = "drag"
    is_drag = True  # strong drag is softened after all forces are summed
    only_slows = True

    linear = Checked(checks.number, least=0.0)
    quadratic = Checked(checks.number, least=0.0)

    def __init__(self, *, linear: float = 0.0, quadratic: float = 0.0) -> None:
        self.linear, self.quadratic = linear, quadratic

    def apply(self, state: SortedState, t: float) -> None:
        self._add(state, np.zeros((1, 2), state.dtype))

    def _add(self, state: SortedState, wind: NDArray[Any]) -> None:
        """Add the drag; wind: (n, 2) m/s at each particle, or (1, 2)."""
        state.motion.add_drag(state.force, state.velocity, state.resistance, wind, self.linear, self.quadratic)


class Wind(Drag):
    """Resistance of a medium that moves: F = -(linear + quadratic |u|) u with u = v - velocity.

    Args:
        velocity: (x, y) of the medium, m/s, or a function of (x, y, t) that returns its two components there: x and y are
            arrays in metres, t is in seconds, each component is an array of the same length or a number.
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
        """(n, 2) m/s, the velocity of the medium at each particle."""
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

    dv = -friction v dt + sqrt(2 friction temperature / m) dW. Each direction of motion has temperature / 2 on average, for any
    mass, forces and room. Spins are not affected. Friction and kicks are solved exactly over a substep of any length
    (Ornstein-Uhlenbeck): v' = c v + sqrt((1 - c^2) temperature / m) N, with c = exp(-friction h), N normal. With position Verlet
    methods the distribution of positions is right to order 2 in h, and exact in a harmonic well (Leimkuhler and Matthews 2013:
    the kick is in the middle of the drift).

    Random numbers are a function of the seed, the frame and substep, and the particle's permanent number (SplitMix64): repeated
    or restored runs, and any number of threads, give the same bits. Between systems the last bits of logarithms and sines may
    differ. The bath's energy is the ledger's account `thermostat`. Particles in a heat bath never sleep. Collisions with a
    restitution below 1 take heat for ever.

    Args:
        temperature: k T, J; 0 leaves friction only.
        friction: 1/s; a velocity is forgotten after about 1 / friction. 0 does nothing.
        seed: integer of at least 0, of which 64 bits are used; different for each heat bath of a world.
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
        """Add no force: the bath acts once per substep."""

    def end_substep(self, state: SortedState, at: Substep) -> float:
        """Kick each free particle; returns the energy given, J."""
        keeps = float(np.exp(-self.friction * at.h))
        when, law = ((self.seed + 2**63) % 2**64 - 2**63, at.frame, at.step), (keeps, self.temperature, at.lag)
        return float(
            state.motion.thermalize(state.velocity, state.position, state.inverse_mass, state.particle, at.number, when, *law)
        )
