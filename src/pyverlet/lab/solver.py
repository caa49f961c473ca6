"""Solves x'' = F(t, x, x') for any F and dimension with the integrators that worlds use."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError, NonFiniteError
from pyverlet.laws.integrators import Integrator, TimeCorrectedVerlet
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State

Acceleration = Callable[[float, Any, Any], ArrayLike]
"""F(t, x, v): the acceleration at time t, position x and velocity v, all in the shape of x0; floats if that is a number."""

_MOST_NUMBERS = 1e9  # in the result: 8 GB; more is a typing error in h


class Solution(NamedTuple):
    """The solution, at the start and after each step.

    Attributes:
        times: (n,) s.
        positions: (n, *shape of x0).
        velocities: (n, *shape of x0).
    """

    times: Floats
    positions: Floats
    velocities: Floats

    def __repr__(self) -> str:
        times = self.times
        return f"Solution of {len(times)} times from {times[0]:g} to {times[-1]:g} s, of positions {self.positions.shape[1:]}"


def solve(
    F: Acceleration,  # noqa: N803  (as in x'' = F(t, x, x'))
    *,
    x0: ArrayLike,
    v0: ArrayLike = 0.0,
    until: float | None = None,
    h: float | ArrayLike,
    integrator: Integrator | None = None,
    start: float = 0.0,
) -> Solution:
    """Solve x'' = F(t, x, x') from x(start) = x0 and x'(start) = v0, in float64.

    Args:
        F: called as F(t, x, v), returns the acceleration in the shape of x0, in any consistent units. It may keep and change its
            arguments.
        x0: a number or an array of any shape.
        v0: in the shape of x0, or one number for all.
        until: end time, s, later than `start`. None if `h` is an array, which determines it.
        h: length of a step, s, slightly reduced so that a step ends at `until`. Or (n,) of each step.
        integrator: as for a world, or your own; None: `TimeCorrectedVerlet()`.
        start: s.

    Returns:
        times, positions and velocities, at the start and after each step.

    Raises:
        InputError: an argument is outside what is allowed, or F returns something other than numbers in the shape of x0.
        NonFiniteError: positions have grown without bounds.
    """
    if not callable(F):
        raise InputError(f"F is {F!r}; allowed is a function F(t, x, v) that returns an acceleration")
    method = TimeCorrectedVerlet() if integrator is None else integrator
    if not isinstance(method, Integrator):
        raise InputError(f"integrator is {integrator!r}; allowed is an object such as pyverlet.RK4()")
    x, v = _phase("x0", x0), _phase("v0", v0)
    if v.shape not in ((), x.shape):
        raise InputError(f"v0 has shape {v.shape}; allowed is that of x0, {x.shape}, or one number")
    start = checks.number("start", start)
    times = _times(start, until, h)
    if len(times) * max(x.size, 1) > _MOST_NUMBERS:
        raise InputError(f"h makes {len(times) - 1} steps; allowed are at most {_MOST_NUMBERS:g} numbers in what is returned")
    v = np.broadcast_to(v, x.shape)
    found = Solution(times, np.empty((len(times), *x.shape)), np.empty((len(times), *x.shape)))
    sorted_state, forces = _sorted_rows(x, v), _Accelerations(F, x.shape)
    found.positions[0], found.velocities[0] = x, v
    h_last = None
    # Exactly equal, which differences of times are not: methods restart where the step changes.
    steps = np.asarray(h, float) if np.ndim(h) else np.full(len(times) - 1, (times[-1] - times[0]) / (len(times) - 1))
    for k, step in enumerate(map(float, steps)):
        method.full_step(sorted_state, forces, times[k], step, h_last)
        found.positions[k + 1] = forces.shaped(sorted_state.position)
        found.velocities[k + 1] = forces.shaped(sorted_state.velocity)
        h_last = step
        if not np.isfinite(sorted_state.position).all():
            component = int(np.flatnonzero(~np.isfinite(sorted_state.position.ravel()))[0])
            says = f"x has left the finite numbers at time {times[k + 1]:.6g}; steps are {step:g} long, shorter ones may do"
            raise NonFiniteError(component, "integrate", float(times[k + 1]), says)
    return found


def _phase(name: str, value: ArrayLike) -> Floats:
    try:
        array = np.array(value, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}; allowed is a number or an array of numbers") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} is {value!r}; allowed are finite numbers")
    return array


def _times(start: float, until: float | None, h: float | ArrayLike) -> Floats:
    """(n + 1,) start and end times of steps."""
    try:
        lengths = np.asarray(h, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"h is {h!r}; allowed is a number, or an array of the length of each step") from None
    if lengths.ndim == 0:
        if until is None:
            raise InputError("until is None; allowed is a number, unless h is an array of the length of each step")
        step, span = checks.number("h", float(lengths), above=0.0), checks.number("until", until, above=start) - start
        if span / step > _MOST_NUMBERS:
            raise InputError(f"h is {step:g}; allowed is at least {span / _MOST_NUMBERS:g}, a billionth of the whole")
        # A span of so many h, up to rounding, has that many steps.
        return np.linspace(start, start + span, max(1, int(np.ceil(span / step * (1 - 1e-12)))) + 1)
    if until is not None:
        raise InputError(f"until is {until} beside an array for h; allowed is None, for h says when to end")
    if lengths.ndim != 1 or not len(lengths):
        raise InputError(f"h has shape {lengths.shape}; allowed is a number, or (n,) lengths of steps")
    checks.positive("h", lengths)
    return start + np.concatenate(([0.0], np.cumsum(lengths)))


def _sorted_rows(x: Floats, v: Floats) -> SortedState:
    """The components of x, two per row, as particles; the last one is padded with 0."""
    rows = {"position": x, "velocity": v}
    count = max(1, (x.size + 1) // 2)
    for name, given in rows.items():
        rows[name] = np.zeros((count, 2))
        rows[name].reshape(-1)[: x.size] = given.reshape(-1)
    state, sorted_state = State(np.dtype(np.float64)), SortedState(np.dtype(np.float64))
    rows["acceleration"] = np.full((count, 2), np.nan)
    state.append(rows | {"spin": np.zeros(count), "mass": np.ones(count), "radius": np.ones(count)})
    sorted_state.gather(state)
    return sorted_state


class _Accelerations:
    """Accelerations for integrators, in the role that `laws.forces.ForceSum` has for a world."""

    velocity_dependent, functions = True, False

    def __init__(self, F: Acceleration, shape: tuple[int, ...]) -> None:  # noqa: N803
        self._function, self._shape, self._size = F, shape, int(np.prod(shape))

    def shaped(self, rows: Floats) -> Any:
        """A copy of these rows in the shape of x0; a float if that is a number."""
        flat = rows.reshape(-1)[: self._size]
        return flat.reshape(self._shape).copy() if self._shape else float(flat[0])

    def __call__(self, state: SortedState, t: float) -> None:
        given = self._function(float(t), self.shaped(state.position), self.shaped(state.velocity))
        try:
            a = np.asarray(given, np.float64)
        except (TypeError, ValueError):
            raise InputError(
                f"F returns {given!r} at time {t:g}; allowed are numbers in the shape of x0, {self._shape}"
            ) from None
        if a.shape != self._shape:
            raise InputError(f"F returns an array of shape {a.shape} at time {t:g}; allowed is the shape of x0, {self._shape}")
        state.acceleration.fill(0)
        state.acceleration.reshape(-1)[: self._size] = a.reshape(-1)
