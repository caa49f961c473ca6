"""Integrators: how positions and velocities advance over one substep of length h.

Each is a few calls of one move, `advance(out, base, slope, h)`: out = base + h * slope.
A *kick* advances the velocity by the acceleration, a *drift* the position by the velocity.
`order` is the global order of unconstrained motion: halving h divides the error by 2 ** order.
`symplectic` integrators keep the energy of a conservative system bounded for ever; the others drift.

To add one: a class here or anywhere, with `order`, `symplectic` and `step`; a line in BY_NAME; a parameter in the order test.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

from pyverlet import core
from pyverlet.ground.arrays import Array
from pyverlet.state.slots import Slots

PASSES = 4
"""Evaluations of functions that look at the velocity: each brings the one that they see nearer to that of the middle of the kick,
(before + after) / 2, by h / 2 times what they change by with it. With that a force across the velocity does no work (Boris)."""


class Forces(Protocol):
    """What an integrator may ask of the world: fill `state.acceleration` for the positions, velocities and time given."""

    @property
    def velocity_dependent(self) -> bool:
        """Whether the acceleration may depend on the velocity."""

    @property
    def functions(self) -> bool:
        """Whether forces of the user's own may: they are evaluated until they see the velocity that they lead to."""

    def __call__(self, state: Slots, t: float) -> None:
        """Evaluate."""


class Integrator(ABC):
    """One substep at a time; stateless, so that one object may serve many worlds (memory lives in the state).

    Worlds do not call `step` of methods that are a kick and a drift: these the core makes itself.

    Attributes:
        order: global order in h for unconstrained motion.
        symplectic: whether the map preserves phase space volume (for forces that do not depend on velocity).
        velocity_lag: between steps the velocity belongs to this fraction of h before the position.
    """

    order: ClassVar[int]
    symplectic: ClassVar[bool]
    velocity_lag: ClassVar[float] = 0.0

    def begin(self, state: Slots, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        """Before a step of h seconds; the velocity is at the time of the position. `h_last`: of the step before, or None."""

    @abstractmethod
    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        """Advance `state.position` and `state.velocity` from t to t + h."""

    def end(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        """After it, at time t: leave the velocity at the time of the position."""

    def full_step(self, state: Slots, forces: Forces, t: float, h: float, h_last: float | None = None) -> None:
        """From a velocity at the time of the position to one at the time of the position."""
        self.begin(state, forces, t, h, h_last)
        self.step(state, forces, t, h)
        self.end(state, forces, t + h, h)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    @classmethod
    def name(cls) -> str:
        """The name on the command line: PositionVerlet is position-verlet."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", cls.__name__).lower()

    @property
    def label(self) -> str:
        """The name, and what sets this object apart from others of its class."""
        return self.name()


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    core.unit("motion", out.dtype).advance(out, base, slope, h)


def _drift(state: Slots, h: float) -> None:
    advance(state.position, state.position, state.velocity, h)


def _kick(state: Slots, h: float) -> None:
    advance(state.velocity, state.velocity, state.acceleration, h)


def _swap_acceleration(state: Slots) -> None:
    """Keep the acceleration as scratch 0 and let the next evaluation write elsewhere."""
    spare = state.scratch(0)
    state._scratch[0], state.acceleration = state.acceleration, spare


class ExplicitEuler(Integrator):
    """Position first, with the old velocity: order 1, and in free fall it gains m g^2 h^2 / 2 a step. Kept to show that.

    Under a magnetic force it gains (B h / m)^2 of the kinetic energy a step.
    """

    order = 1
    symplectic = False

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        forces(state, t)
        _drift(state, h)
        _kick(state, h)


class SemiImplicitEuler(Integrator):
    """Velocity first, then position with the new velocity (symplectic Euler): order 1.

    In uniform gravity it conserves v^2/2 + g y - (h/2) g v exactly (Hairer, Lubich, Wanner, Geometric Numerical Integration, IX).
    Under a magnetic force it gains (B h / m)^2 of the kinetic energy a step.
    """

    order = 1
    symplectic = True

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        forces(state, t)
        _kick(state, h)
        _drift(state, h)


class _Stormer(Integrator):
    """What the position Verlet methods share.

    The method's memory is x - x_prev. Kept as a velocity u = (x - x_prev) / h it never subtracts large positions, and contacts
    may change it. The user sees v = u + a h / 2, the velocity at the time of x; between frames that is what is stored.
    Forces of the user's own that depend on the velocity see v, the mean of u before and after the kick, by fixed-point iteration:
    a force across the velocity does no work. That converges while h times their derivative by the velocity is below 2 m.
    """

    order = 2
    symplectic = True
    velocity_lag = 0.5

    def __init__(self, *, naive_start: bool = False) -> None:
        self.naive_start = naive_start

    def __repr__(self) -> str:
        return f"{type(self).__name__}({'naive_start=True' if self.naive_start else ''})"

    @property
    def label(self) -> str:
        return self.name() + (", naive start" if self.naive_start else "")

    def begin(self, state: Slots, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        # x_prev = x - v h + a h^2 / 2 makes u = v - a h / 2: order 2. The naive x_prev = x - v h makes u = v: order 1.
        if h_last is None and not self.naive_start:
            forces(state, t)
        elif h_last is None:
            state.acceleration.fill(0)
        advance(state.velocity, state.velocity, state.acceleration, -0.5 * (h if h_last is None else h_last))

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        self._evaluate(state, forces, t, h)
        _kick(state, h)
        _drift(state, h)

    def end(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        self._evaluate(state, forces, t, h)
        _kick(state, 0.5 * h)

    @staticmethod
    def _evaluate(state: Slots, forces: Forces, t: float, h: float) -> None:
        """Forces that look at the velocity get the one at time t, not the one half a substep behind."""
        if not forces.velocity_dependent:
            forces(state, t)
            return
        before = state.velocity
        state.velocity = state.scratch(0)
        for _ in range(PASSES if forces.functions else 1):
            advance(state.velocity, before, state.acceleration, 0.5 * h)
            forces(state, t)
        state.velocity = before


class PositionVerlet(_Stormer):
    """Stormer's x' = 2 x - x_prev + a h^2 (Verlet 1967): order 2, and no velocity enters it.

    The formula assumes a constant step: x' = x + (x - x_prev) + a h^2 is wrong when h differs from the step before
    (TimeCorrectedVerlet mends that). Another number of steps in a frame, by `world.substeps` or since a world cuts long frames,
    restarts the method instead, as does editing a scene.

    Args:
        naive_start: start from x_prev = x - v h instead of x - v h + a h^2 / 2. Drops the global order to 1; for demonstration.
    """

    def begin(self, state: Slots, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        super().begin(state, forces, t, h, h_last)
        if h_last is not None and h_last != h:
            state.velocity *= h_last / h  # x - x_prev is kept, whatever the new step: the flaw, shown on purpose


class TimeCorrectedVerlet(_Stormer):
    """x' = x + (x - x_prev) h / h_prev + a h (h + h_prev) / 2: position Verlet that keeps order 2 under a varying step.

    With a constant step it is PositionVerlet, bit for bit.
    """

    def begin(self, state: Slots, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        if h_last in (None, h):
            super().begin(state, forces, t, h, h_last)
            return
        # u' = u + a (h + h_prev) / 2 differs from the constant step's u + a h by a (h_prev - h) / 2, with the a of time t.
        kept, state.acceleration = state.acceleration, state.scratch(0)
        forces(state, t)
        now, state.acceleration = state.acceleration, kept
        super().begin(state, forces, t, h, h_last)
        assert h_last is not None
        advance(state.velocity, state.velocity, now, 0.5 * (h_last - h))


class VelocityVerlet(Integrator):
    """Position and velocity at the same time: x' = x + v h + a h^2 / 2, v' = v + (a + a') h / 2 (Swope et al. 1982): order 2.

    a' is evaluated at the predicted velocity v + a h, so that drag keeps order 2 too; where forces of the user's own depend on
    the velocity, at v' itself, found by fixed-point iteration.
    """

    order = 2
    symplectic = True

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        forces(state, t)
        _drift(state, h)
        advance(state.position, state.position, state.acceleration, 0.5 * h * h)
        _kick(state, h)
        _swap_acceleration(state)
        forces(state, t + h)
        _kick(state, 0.5 * h)
        advance(state.velocity, state.velocity, state.scratch(0), -0.5 * h)
        if forces.functions:
            half = state.scratch(1)
            advance(half, state.velocity, state.acceleration, -0.5 * h)
            for _ in range(PASSES - 1):
                forces(state, t + h)
                advance(state.velocity, half, state.acceleration, 0.5 * h)


class RK4(Integrator):
    """The classical Runge-Kutta method: order 4, four evaluations, and a slow drift of energy (it is not symplectic)."""

    order = 4
    symplectic = False

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        x0, v0, x_sum, v_sum = (state.scratch(k) for k in range(4))
        for start, current in ((x0, state.position), (v0, state.velocity), (x_sum, state.position), (v_sum, state.velocity)):
            start[:] = current
        # Where a slope is taken, what it weighs in the sum, how far it is followed to the next slope; all in units of h.
        for offset, weight, reach in ((0.0, 1 / 6, 0.5), (0.5, 1 / 3, 0.5), (0.5, 1 / 3, 1.0), (1.0, 1 / 6, 0.0)):
            forces(state, t + offset * h)
            advance(x_sum, x_sum, state.velocity, weight * h)
            advance(v_sum, v_sum, state.acceleration, weight * h)
            advance(state.position, x0, state.velocity, reach * h)
            advance(state.velocity, v0, state.acceleration, reach * h)
        state.position[:] = x_sum
        state.velocity[:] = v_sum


class Yoshida4(Integrator):
    """Three leapfrog steps of lengths w1 h, w0 h, w1 h (Yoshida 1990): order 4 and symplectic.

    Order 4 needs each leapfrog to be symmetric in time; with forces that depend on velocity the kick is therefore the implicit
    midpoint rule, solved by fixed-point iteration (each pass gains one order in h, so four passes suffice).
    """

    order = 4
    symplectic = True

    _W1: ClassVar[float] = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0))
    _W0: ClassVar[float] = 1.0 - 2.0 * _W1

    def step(self, state: Slots, forces: Forces, t: float, h: float) -> None:
        for weight in (self._W1, self._W0, self._W1):
            part = weight * h
            _drift(state, 0.5 * part)
            self._symmetric_kick(state, forces, t + 0.5 * part, part)
            _drift(state, 0.5 * part)
            t += part

    @staticmethod
    def _symmetric_kick(state: Slots, forces: Forces, t: float, h: float) -> None:
        if not forces.velocity_dependent:
            forces(state, t)
            _kick(state, h)
            return
        before = state.scratch(0)
        before[:] = state.velocity
        for _ in range(4):
            forces(state, t)
            advance(state.velocity, before, state.acceleration, 0.5 * h)
        forces(state, t)
        advance(state.velocity, before, state.acceleration, h)


BY_NAME: dict[str, type[Integrator]] = {
    cls.name(): cls
    for cls in (ExplicitEuler, SemiImplicitEuler, PositionVerlet, TimeCorrectedVerlet, VelocityVerlet, RK4, Yoshida4)
}
