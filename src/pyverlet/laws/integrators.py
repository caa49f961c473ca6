"""Integrators: how positions and velocities advance over one substep of length h.

Each is made of one move, `advance(out, base, slope, h)`: out = base + h * slope.
A *kick* advances the velocity by the acceleration, a *drift* the position by the velocity.
`order` is the global order of unconstrained motion: halving h divides the error by 2 ** order.
`symplectic` integrators keep the energy of a conservative system bounded for ever; with others it drifts.

To add one: a class here or anywhere, with `order`, `symplectic` and `step`; a line in BY_NAME; a parameter in the order test.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

import numpy as np

from pyverlet import core
from pyverlet.common.arrays import Array
from pyverlet.state.sorted_state import SortedState

LEAST_PASSES, MOST_PASSES = 2, 8
"""Bounds on evaluations of velocity-dependent functions per step: two if they change little with velocity, a few more if they are
linear in it (`core.velocity_solving`)."""


class Forces(Protocol):
    """The interface of accelerations for integrators: fills `state.acceleration` for given positions, velocities and time."""

    @property
    def velocity_dependent(self) -> bool:
        """Whether the acceleration may depend on velocity."""

    @property
    def functions(self) -> bool:
        """Whether user-defined forces do; these are evaluated until they see the velocity that they lead to."""

    def __call__(self, state: SortedState, t: float) -> None:
        """Evaluate the accelerations."""


class Integrator(ABC):
    """Base class of integrators: one substep at a time, stateless, so that one object may serve many worlds.

    `step` of methods that consist of a kick and a drift is not called: the core runs these itself.

    Attributes:
        order: global order in h for unconstrained motion.
        symplectic: whether the map preserves phase space volume (for forces that do not depend on velocity).
        follows: c h / m up to which it is accurate for user-defined forces that change by c with the velocity; beyond, a world
            warns once (`CoarseStepsWarning`).
        velocity_lag: between steps the velocity belongs to this fraction of h before the position.
    """

    order: ClassVar[int]
    symplectic: ClassVar[bool]
    follows: ClassVar[float] = np.inf
    velocity_lag: ClassVar[float] = 0.0

    def begin(self, state: SortedState, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        """Prepare a step of h seconds; the velocity is at the time of the position. `h_last`: the last step, or None."""

    @abstractmethod
    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        """Advance `state.position` and `state.velocity` from t to t + h."""

    def end(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        """Finish the step, at time t: bring the velocity to the time of the position."""

    def full_step(self, state: SortedState, forces: Forces, t: float, h: float, h_last: float | None = None) -> None:
        """A whole step, from and to a velocity at the time of the position."""
        self.begin(state, forces, t, h, h_last)
        self.step(state, forces, t, h)
        self.end(state, forces, t + h, h)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    @classmethod
    def name(cls) -> str:
        """The name on the command line, such as position-verlet for PositionVerlet."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", cls.__name__).lower()

    @property
    def label(self) -> str:
        """The name, and the settings that differ from the defaults of its class."""
        return self.name()


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    core.unit("motion", out.dtype).advance(out, base, slope, h)


def solve_velocity(state: SortedState, forces: Forces, t: float, base: Array, ahead: float) -> None:
    """Solve for `state.velocity` v = base + ahead a(v), starting from the given one, and for `state.acceleration` a.

    With v in the middle of a kick, forces perpendicular to it do no work, and drag has its terminal speed, however strong.
    """
    for k in range(MOST_PASSES):
        forces(state, t)
        far = state.motion.next_velocity(state.velocity, base, state.acceleration, state.solving, ahead, k == 0)
        if k + 1 >= LEAST_PASSES and not far:
            break


def _drift(state: SortedState, h: float) -> None:
    advance(state.position, state.position, state.velocity, h)


def _kick(state: SortedState, h: float) -> None:
    advance(state.velocity, state.velocity, state.acceleration, h)


def _swap_acceleration(state: SortedState) -> None:
    """Keep the acceleration as scratch 0 and let the next evaluation write to another array."""
    spare = state.scratch(0)
    state._scratch[0], state.acceleration = state.acceleration, spare


class ExplicitEuler(Integrator):
    """Position first, with the old velocity: order 1. In free fall it gains m g^2 h^2 / 2 per step; for demonstration.

    Under a magnetic force it gains (B h / m)^2 of the kinetic energy per step: user-defined forces that change by c with the
    velocity are accurate up to c h / m = 0.01. From 2 on their drag is unstable.
    """

    order = 1
    symplectic = False
    follows = 0.01

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        forces(state, t)
        _drift(state, h)
        _kick(state, h)


class SemiImplicitEuler(Integrator):
    """Velocity first, then position with the new velocity (symplectic Euler): order 1.

    In uniform gravity it conserves v^2/2 + g y - (h/2) g v exactly (Hairer, Lubich, Wanner, Geometric Numerical Integration, IX).
    Under a magnetic force it gains (B h / m)^2 of the kinetic energy per step: user-defined forces that change by c with the
    velocity are accurate up to c h / m = 0.01. From 2 on their drag is unstable.
    """

    order = 1
    symplectic = True
    follows = 0.01

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        forces(state, t)
        _kick(state, h)
        _drift(state, h)


class _Stormer(Integrator):
    """Base class of the position Verlet methods.

    The state of the method is x - x_prev. Stored as a velocity u = (x - x_prev) / h it never subtracts large positions, and
    contacts may change it. The user sees v = u + a h / 2, the velocity at the time of x, which is stored between frames.
    User-defined forces that depend on velocity get v, the mean of u before and after the kick, which is solved for: a force
    perpendicular to it does no work, and drag has its terminal speed. For forces linear in the velocity, changing by c, that
    holds for any c h / m; for drag with the square of the speed up to 30.
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

    def begin(self, state: SortedState, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        # x_prev = x - v h + a h^2 / 2 makes u = v - a h / 2: order 2. The naive x_prev = x - v h makes u = v: order 1.
        if h_last is None and not self.naive_start:
            forces(state, t)
        elif h_last is None:
            state.acceleration.fill(0)
        advance(state.velocity, state.velocity, state.acceleration, -0.5 * (h if h_last is None else h_last))

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        self._evaluate(state, forces, t, h)
        _kick(state, h)
        _drift(state, h)

    def end(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        self._evaluate(state, forces, t, h)
        _kick(state, 0.5 * h)

    @staticmethod
    def _evaluate(state: SortedState, forces: Forces, t: float, h: float) -> None:
        """Evaluate forces; velocity-dependent ones get the velocity at time t, not the one half a substep earlier."""
        if not forces.velocity_dependent:
            forces(state, t)
            return
        before = state.velocity
        state.velocity = state.scratch(0)
        advance(state.velocity, before, state.acceleration, 0.5 * h)
        if forces.functions:
            solve_velocity(state, forces, t, before, 0.5 * h)
        else:
            forces(state, t)
        state.velocity = before


class PositionVerlet(_Stormer):
    """Stormer's x' = 2 x - x_prev + a h^2 (Verlet 1967): order 2, and no velocity enters it.

    The formula assumes a constant step: x' = x + (x - x_prev) + a h^2 is wrong when h differs from the step before
    (see TimeCorrectedVerlet). If the number of steps in a frame changes, by `world.substeps` or because long frames are divided,
    the method is restarted instead, as after editing a scene.

    Args:
        naive_start: start from x_prev = x - v h instead of x - v h + a h^2 / 2. Reduces the global order to 1; for demonstration.
    """

    def begin(self, state: SortedState, forces: Forces, t: float, h: float, h_last: float | None) -> None:
        super().begin(state, forces, t, h, h_last)
        if h_last is not None and h_last != h:
            state.velocity *= h_last / h  # x - x_prev is kept when the step changes: the error of this method, shown on purpose


class TimeCorrectedVerlet(_Stormer):
    """x' = x + (x - x_prev) h / h_prev + a h (h + h_prev) / 2: position Verlet that keeps order 2 under a varying step.

    With a constant step it is PositionVerlet, bit for bit.
    """

    def begin(self, state: SortedState, forces: Forces, t: float, h: float, h_last: float | None) -> None:
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

    a' is evaluated at the predicted velocity v + a h, which keeps drag at order 2. User-defined forces that depend on velocity
    are evaluated at v' itself, which is solved for: for those linear in it, changing by c, with any c h / m, for drag with the
    square of the speed up to 5.
    """

    order = 2
    symplectic = True

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
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
            solve_velocity(state, forces, t + h, half, 0.5 * h)


class RK4(Integrator):
    """The classical Runge-Kutta method: order 4, four evaluations, and a slow drift of energy (it is not symplectic).

    Under a magnetic force it loses (B h / m)^6 / 72 of the kinetic energy per step: user-defined forces that change by c with the
    velocity are accurate up to c h / m = 0.25. From 2.7 on their drag is unstable.
    """

    order = 4
    symplectic = False
    follows = 0.25

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        x0, v0, x_sum, v_sum = (state.scratch(k) for k in range(4))
        for start, current in ((x0, state.position), (v0, state.velocity), (x_sum, state.position), (v_sum, state.velocity)):
            start[:] = current
        # Offset of a slope, its weight in the sum, and how far it is followed to the next slope, in units of h.
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

    Order 4 needs each leapfrog to be symmetric in time; with velocity-dependent forces the kick is therefore the implicit
    midpoint rule, solved by the secant method, which is exact for forces linear in the velocity, however strong.
    """

    order = 4
    symplectic = True

    _W1: ClassVar[float] = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0))
    _W0: ClassVar[float] = 1.0 - 2.0 * _W1

    def step(self, state: SortedState, forces: Forces, t: float, h: float) -> None:
        for weight in (self._W1, self._W0, self._W1):
            part = weight * h
            _drift(state, 0.5 * part)
            self._symmetric_kick(state, forces, t + 0.5 * part, part)
            _drift(state, 0.5 * part)
            t += part

    @staticmethod
    def _symmetric_kick(state: SortedState, forces: Forces, t: float, h: float) -> None:
        if not forces.velocity_dependent:
            forces(state, t)
            _kick(state, h)
            return
        before = state.scratch(0)
        before[:] = state.velocity
        solve_velocity(state, forces, t, before, 0.5 * h)
        advance(state.velocity, before, state.acceleration, h)


BY_NAME: dict[str, type[Integrator]] = {
    cls.name(): cls
    for cls in (ExplicitEuler, SemiImplicitEuler, PositionVerlet, TimeCorrectedVerlet, VelocityVerlet, RK4, Yoshida4)
}
