"""A force from a function of one's own, called with arrays, or particle by particle where it cannot take them."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NoReturn, overload

import numpy as np

from pyverlet.ground import pickling
from pyverlet.ground.errors import NonFiniteError
from pyverlet.laws.forces._code import Code
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Function = Callable[[float, float, float, float, float, float], tuple[float, float]]
Potential = Callable[[float, float, float], float]


class FunctionForce:
    """What `force` makes of a function. It can still be called like one."""

    is_function = True
    _settings: tuple[str, ...] = ("velocity_dependent",)
    """Arguments beside functions, and attributes of the same names."""

    def __init__(
        self, function: Function, potential: Potential | None = None, *, velocity_dependent: bool | None = None
    ) -> None:  # fmt: skip
        self._code = Code(function, "force", "x, y, vx, vy, mass, t", "two numbers (fx, fy), newtons")
        self.velocity_dependent = self._code.names(2, 3) if velocity_dependent is None else bool(velocity_dependent)
        self._hold(potential, "x, y, mass", "one number, joules")
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: float) -> Any:
        return self._code.function(*arguments)

    def __repr__(self) -> str:
        return self._code.name

    def __reduce__(self) -> Any:
        if pickling.by_name(self) and not pickling.is_by_value():
            return vars(self)["__qualname__"]  # the decorator has put it in the place of its function
        functions = tuple(code.function for code in (self._code, self._held) if code)
        pickling.check(self._code.name, *functions)
        return functools.partial(type(self), **{name: getattr(self, name) for name in self._settings}), functions

    def _hold(self, potential: Any, arguments: str, returns: str) -> None:
        """Have a potential, if that is known: the world's energy includes it."""
        self._held = None if potential is None else Code(potential, "potential", arguments, returns)
        if self._held:
            self.potential = self._potential

    def __deepcopy__(self, memo: Any) -> FunctionForce:
        return self  # it remembers nothing

    def __copy__(self) -> FunctionForce:
        return self

    def apply(self, state: Slots, t: float) -> None:
        """Add the function's value for every free particle.

        Raises:
            InputError: it returns something other than two numbers.
            NonFiniteError: it returned NaN or infinity.
        """
        if self._code.add(state, state.seam.wrapped(state.position), float(t)):
            self._blame(state, t)

    def _blame(self, state: Slots, t: float) -> None:
        """Find the first particle it fails for, and say what it did there."""
        for particle in range(len(state)):
            slot = int(state.slots_of(particle))
            given = [float(v) for v in (*state.seam.wrapped(state.position)[slot], *state.velocity[slot], state.mass[slot], t)]
            try:
                value = tuple(map(float, self._code.call(*given)))
            except Exception as error:  # whatever the user's code raises
                self._refuse(f"raised {type(error).__name__} ({error})", particle, given)
            else:
                if np.isfinite(given[:4]).all() and np.isfinite(given[4]) and not np.isfinite(value).all():
                    self._refuse(f"returned {value}", particle, given)

    def _refuse(self, did: str, particle: int, given: list[float]) -> NoReturn:
        t = given[-1]
        raise NonFiniteError(
            particle, "integrate", t,
            f"{self._code.name} {did} for particle {particle} at x = {given[0]:g}, y = {given[1]:g}, t = {t:g}; allowed are "
            "two finite numbers (fx, fy), newtons; the world holds the last good frame",
        )  # fmt: skip

    def _potential(self, state: State) -> float:
        """Sum of the potential over all free particles, J."""
        assert self._held
        return self._held.potential(state.position, state.mass)


@overload
def force(function: Function, /) -> FunctionForce: ...


@overload
def force(
    *, potential: Potential | None = None, velocity_dependent: bool | None = None
) -> Callable[[Function], FunctionForce]: ...


def force(
    function: Function | None = None, /, *, potential: Potential | None = None, velocity_dependent: bool | None = None
) -> FunctionForce | Callable[[Function], FunctionForce]:
    """Make a force of a function (x, y, vx, vy, mass, t) -> (fx, fy) of plain numbers, in SI units.

    At every evaluation it is called once, with float64 arrays of all particles for x, y, vx, vy and mass, if it is written so
    that it takes them (arithmetic, functions of NumPy, `np.where` in place of `if`); else particle by particle, which takes about
    two microseconds for each.

    Args:
        function: to be decorated.
        potential: function (x, y, mass) of the potential energy in J. The world's energy includes it.
        velocity_dependent: whether vx or vy matters; if not, the integrators have less to do. None is whether the function
            names one of them.

    Raises:
        InputError: the function takes other arguments.
    """
    make = functools.partial(FunctionForce, potential=potential, velocity_dependent=velocity_dependent)
    return make if function is None else make(function)
