"""Forces by user-defined functions, called with arrays, or particle by particle if they do not support that."""

from __future__ import annotations

import dis
import functools
import inspect
from collections.abc import Callable
from typing import Any, NoReturn, overload

import numpy as np

from pyverlet.common import pickling
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError, NonFiniteError
from pyverlet.laws.forces import native
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State

Function = Callable[[float, float, float, float, float, float], tuple[float, float]]
Potential = Callable[[float, float, float], float]


class Code:
    """A user-defined function of float64 numbers, with its name and the way it is called.

    It is called with columns of all particles at once. If that fails, for example because of an `if` on an argument or a call to
    `math`, it is called particle by particle. The choice depends only on the arguments, so repeated runs have the same bits.
    """

    def __init__(self, function: Any, kind: str, arguments: str, returns: str, kind_of_code: str) -> None:
        self.function, self.returns, self._kind_of_code = function, returns, kind_of_code
        if not inspect.isfunction(self.function):
            raise InputError(f"{kind} is {function!r}; allowed is a function of ({arguments}) that returns {returns}")
        code = self.function.__code__
        self.name = f"{kind} {self.function.__name__!r} ({code.co_filename}, line {code.co_firstlineno})"
        self._count = len(arguments.split(","))
        takes = inspect.signature(self.function).parameters.values()
        if len(takes) != self._count or any(p.kind not in (p.POSITIONAL_OR_KEYWORD, p.POSITIONAL_ONLY) for p in takes):
            raise InputError(f"{self.name} takes ({', '.join(map(str, takes))}); allowed are the arguments ({arguments})")
        self._results = 2 if returns.startswith("two") else 1
        self._columns = np.empty((self._count, 0))
        self._native: native.Native | None = None

    def names(self, *which: int) -> bool:
        """Whether the function's code uses one of these of its arguments."""
        wanted = {self.function.__code__.co_varnames[k] for k in which}
        return any(
            wanted & set(step.argval if isinstance(step.argval, tuple) else (step.argval,))
            for step in dis.get_instructions(self.function)
            if isinstance(step.argval, str | tuple)
        )

    def call(self, *given: float) -> Any:
        """Call for one particle; exceptions propagate."""
        with np.errstate(all="ignore"):
            return self.function(*map(np.float64, given))

    def add(self, state: Any, position: Array, t: float) -> int:
        """Add the two numbers returned for (x, y, vx, vy, mass, t) of every free particle to `state.force`.

        Returns for how many of them the function raised, or returned a number that is not finite.

        Raises:
            InputError: it returned something else.
        """
        if not len(position):
            return 0
        if self._native and self._native.holds():
            moving = position, state.velocity, state.mass
            return int(state.motion.add_compiled(state.force, *moving, self._native.address, t, *state.thread_team))
        if self._columns.shape != (5, len(position)):
            self._columns = np.empty((5, len(position)))
        columns = self._columns
        state.motion.function_arguments(position, state.velocity, state.mass, columns)
        values = self._values(columns, t)
        if self._native is None and len(position) > 1 and native.installed():
            self._native = native.Native(self.function)
            if self._native.address:
                self._native.agree(state.motion, columns, t, values)
        return int(state.motion.add_values(state.force, columns, *values))

    def potential(self, position: Array, mass: Array) -> float:
        """Sum of the numbers returned for (x, y, mass) of every free particle; NaN where the function raises.

        Raises:
            InputError: it returned something else.
        """
        free = np.isfinite(mass)
        columns = np.vstack((position[free].T, mass[free])).astype(np.float64)
        values = self._values(columns)[0] if free.any() else np.zeros(1)
        return float(values.sum()) if len(values) > 1 else float(values[0]) * int(free.sum())

    def _values(self, columns: Array, *more: float) -> list[Array]:
        """The numbers returned: (n,) each, or (1,) if equal for all."""
        with np.errstate(all="ignore"):
            try:
                returned = self.function(*columns, *more)
            except Exception:  # any exception of the user's code
                return self._one_by_one(columns, *more)
        return self.numbers(returned, columns.shape[1], "particles")

    def numbers(self, returned: Any, count: int, of: str) -> list[Array]:
        """Check what was returned for so many particles or pairs: (count,) numbers each, or (1,) if equal for all."""
        parts = self._parts(returned, count, of)
        for part in parts:
            if part.shape not in ((), (count,)):
                self.refuse(f"returns an array of shape {part.shape} for {count} {of}")
        return [np.ascontiguousarray(part, np.float64) for part in parts]

    def _parts(self, returned: Any, *whose: Any) -> list[Array]:
        parts = returned if self._results > 1 and isinstance(returned, tuple) else (returned,)
        arrays = [np.asarray(part) for part in parts]
        if len(arrays) != self._results:
            self.refuse(f"returns {len(arrays)} of them" if isinstance(returned, tuple) else "returns no tuple")
        for array in arrays:
            if array.dtype.kind not in "fiub":
                self.refuse(f"returns {returned!r}" + (f" for {whose[0]} {whose[1]}" if whose else ""))
        return arrays

    def _one_by_one(self, columns: Array, *more: float) -> list[Array]:
        values = np.zeros((self._results, columns.shape[1]))
        for k, (*given, mass) in enumerate(columns.T.tolist()):
            if mass < np.inf:
                try:
                    returned = self.function(*given, mass, *more)
                except Exception:  # any exception of the user's code
                    values[:, k] = np.nan
                    continue
                numbers = returned if isinstance(returned, tuple) else (returned,)
                if len(numbers) != self._results or not all(type(number) in (float, int) for number in numbers):
                    numbers = tuple(self._parts(returned))
                    if any(part.shape for part in numbers):
                        self.refuse(f"returns {returned!r}")
                values[:, k] = numbers
        return [*values]

    def refuse(self, did: str, error: Exception | None = None) -> NoReturn:
        """Raise InputError that says what the function did, and what is allowed."""
        raise InputError(f"{self.name} {did}; allowed is {self._kind_of_code} that returns {self.returns}") from error


class FunctionForce:
    """A force made of a function by `force`. It can still be called as a function."""

    is_function = True
    _kind_of_code = "numeric code"
    _settings: tuple[str, ...] = ("velocity_dependent",)
    """Names of arguments besides functions, and of attributes."""

    def __init__(
        self, function: Function, potential: Potential | None = None, *, velocity_dependent: bool | None = None
    ) -> None:  # fmt: skip
        self._code = Code(function, "force", "x, y, vx, vy, mass, t", "two numbers (fx, fy), newtons", self._kind_of_code)
        self.velocity_dependent = self._code.names(2, 3) if velocity_dependent is None else bool(velocity_dependent)
        self._hold(potential, "x, y, mass", "one number, joules")
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: float) -> Any:
        return self._code.function(*arguments)

    def __repr__(self) -> str:
        return self._code.name

    def __reduce__(self) -> Any:
        if pickling.by_name(self) and not pickling.is_by_value():
            return vars(self)["__qualname__"]  # a decorated function: its name refers to this object
        functions = tuple(code.function for code in (self._code, self._held) if code)
        pickling.check(self._code.name, *functions)
        return functools.partial(type(self), **{name: getattr(self, name) for name in self._settings}), functions

    def _hold(self, potential: Any, arguments: str, returns: str) -> None:
        """Store the potential, if there is one, which the world's energy then includes."""
        self._held = None if potential is None else Code(potential, "potential", arguments, returns, self._kind_of_code)
        if self._held:
            self.potential = self._potential

    def __deepcopy__(self, memo: Any) -> FunctionForce:
        return self  # stateless

    def __copy__(self) -> FunctionForce:
        return self

    def apply(self, state: SortedState, t: float) -> None:
        """Add the function's value for every free particle.

        Raises:
            InputError: it returns something other than two numbers.
            NonFiniteError: it returned NaN or infinity.
        """
        if self._code.add(state, state.periodic.wrapped(state.position), float(t)):
            self._blame(state, t)

    def _blame(self, state: SortedState, t: float) -> None:
        """Find the first particle for which it fails, and raise the error."""
        for particle in range(len(state)):
            sorted_index = int(state.sorted_index(particle))
            given = [
                float(v)
                for v in (
                    *state.periodic.wrapped(state.position)[sorted_index],
                    *state.velocity[sorted_index],
                    state.mass[sorted_index],
                    t,
                )
            ]
            try:
                value = tuple(map(float, self._code.call(*given)))
            except Exception as error:  # any exception of the user's code
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

    It is called once per evaluation, with float64 arrays of all particles for x, y, vx, vy and mass, if it supports arrays
    (arithmetic, functions of NumPy, `np.where` instead of `if`); else particle by particle, at about two microseconds each.

    Args:
        function: to be decorated.
        potential: function (x, y, mass) of the potential energy in J, which the world's energy includes.
        velocity_dependent: whether vx or vy matters; if not, integrators have less to do. None: whether the function uses one of
            them.

    Raises:
        InputError: the function takes other arguments.
    """
    make = functools.partial(FunctionForce, potential=potential, velocity_dependent=velocity_dependent)
    return make if function is None else make(function)
