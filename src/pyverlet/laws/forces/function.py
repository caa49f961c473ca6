"""A force from a function of one's own, called with arrays, or particle by particle where it cannot take them."""

from __future__ import annotations

import dis
import functools
import inspect
from collections.abc import Callable
from typing import Any, NoReturn, overload

import numpy as np

from pyverlet.ground import pickling
from pyverlet.ground.errors import InputError, NonFiniteError
from pyverlet.laws.forces._arrays import NotNumbers, OnArrays
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Function = Callable[[float, float, float, float, float, float], tuple[float, float]]
Potential = Callable[[float, float, float], float]


class FunctionForce:
    """What `force` makes of a function. It can still be called like one."""

    is_function = True

    def __init__(self, function: Function, *, velocity_dependent: bool | None = None) -> None:
        self._code = _Code(function, "force", "x, y, vx, vy, mass, t", "two numbers (fx, fy), newtons")
        self.velocity_dependent = self._code.names(2, 3) if velocity_dependent is None else bool(velocity_dependent)
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: float) -> Any:
        return self._code.function(*arguments)

    def __repr__(self) -> str:
        return self._code.name

    def __reduce__(self) -> Any:
        if pickling.by_name(self) and not pickling.is_by_value():
            return vars(self)["__qualname__"]  # the decorator has put it in the place of its function
        functions = [code.function for code in (self._code, getattr(self, "_potential", None)) if isinstance(code, _Code)]
        pickling.check(self._code.name, *functions)
        return _again, (self.velocity_dependent, *functions)

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
        if self._code.run("add", state, state.seam.wrapped(state.position), float(t)):
            self._blame(state, t)

    def _blame(self, state: Slots, t: float) -> None:
        """Find the first particle it fails for, and say what it did there."""
        for particle in range(len(state)):
            slot = state.slot_of(particle)
            given = [float(v) for v in (*state.seam.wrapped(state.position)[slot], *state.velocity[slot], state.mass[slot], t)]
            try:
                value = tuple(map(float, self._code.evaluator().call(*given)))
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


class ConservativeFunctionForce(FunctionForce):
    """One whose potential is known: the world's energy includes it."""

    def __init__(self, function: Function, potential: Potential, *, velocity_dependent: bool | None = None) -> None:
        super().__init__(function, velocity_dependent=velocity_dependent)
        self._potential = _Code(potential, "potential", "x, y, mass", "one number, joules")

    def potential(self, state: State) -> float:
        """Sum of the potential over all free particles, J."""
        return float(self._potential.run("potential", state.position, state.mass))


def _again(velocity_dependent: bool, function: Function, potential: Potential | None = None) -> FunctionForce:
    """One that was pickled."""
    return _make(potential, velocity_dependent, function)


class _Code:
    """A user's function: where it stands, and what calls it."""

    def __init__(self, function: Any, kind: str, arguments: str, returns: str) -> None:
        self.function = function
        self._returns = returns
        if not inspect.isfunction(self.function):
            raise InputError(f"{kind} is {function!r}; allowed is a function of ({arguments}) that returns {returns}")
        code = self.function.__code__
        self.name = f"{kind} {self.function.__name__!r} ({code.co_filename}, line {code.co_firstlineno})"
        self._count = len(arguments.split(","))
        takes = inspect.signature(self.function).parameters.values()
        if len(takes) != self._count or any(p.kind not in (p.POSITIONAL_OR_KEYWORD, p.POSITIONAL_ONLY) for p in takes):
            raise InputError(f"{self.name} takes ({', '.join(map(str, takes))}); allowed are the arguments ({arguments})")
        self._evaluator: OnArrays | None = None

    def names(self, *which: int) -> bool:
        """Whether the function's code names one of these of its arguments."""
        wanted = {self.function.__code__.co_varnames[k] for k in which}
        return any(
            wanted & set(step.argval if isinstance(step.argval, tuple) else (step.argval,))
            for step in dis.get_instructions(self.function)
            if isinstance(step.argval, str | tuple)
        )

    def evaluator(self) -> OnArrays:
        """What calls it, kept."""
        if self._evaluator is None:
            self._evaluator = OnArrays(self.function, self._count, 2 if self._returns.startswith("two") else 1)
        return self._evaluator

    def run(self, method: str, *arguments: Any) -> Any:
        """Call a method of what calls it. Raises InputError if the function returns something else than it should."""
        try:
            return getattr(self.evaluator(), method)(*arguments)
        except NotNumbers as error:
            raise InputError(f"{self.name} {error}; allowed is numeric code that returns {self._returns}") from None


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
    if function is None:
        return functools.partial(_make, potential, velocity_dependent)
    return _make(potential, velocity_dependent, function)


def _make(potential: Potential | None, velocity_dependent: bool | None, function: Function) -> FunctionForce:
    if potential is None:
        return FunctionForce(function, velocity_dependent=velocity_dependent)
    return ConservativeFunctionForce(function, potential, velocity_dependent=velocity_dependent)
