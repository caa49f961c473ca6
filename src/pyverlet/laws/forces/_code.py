"""Functions of the user's own, called with arrays of all particles, or one by one where they take none."""

from __future__ import annotations

import dis
import inspect
from typing import Any, NoReturn

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.ground.errors import InputError


class Code:
    """A function of the user's own, of float64 numbers: where it stands, and how it is called.

    It is called with columns of all particles at once. Where that fails, for it has an `if` on one of them, say, or calls `math`,
    it is called particle by particle. Which it is depends on nothing but the arguments, so that a run repeated has the same bits.
    """

    def __init__(self, function: Any, kind: str, arguments: str, returns: str) -> None:
        self.function = function
        self.returns = returns
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

    def names(self, *which: int) -> bool:
        """Whether the function's code names one of these of its arguments."""
        wanted = {self.function.__code__.co_varnames[k] for k in which}
        return any(
            wanted & set(step.argval if isinstance(step.argval, tuple) else (step.argval,))
            for step in dis.get_instructions(self.function)
            if isinstance(step.argval, str | tuple)
        )

    def call(self, *given: float) -> Any:
        """Of one particle, with the exceptions it raises."""
        with np.errstate(all="ignore"):
            return self.function(*map(np.float64, given))

    def add(self, state: Any, position: Array, t: float) -> int:
        """Add the two numbers returned for (x, y, vx, vy, mass, t) of every free particle to `state.force`.

        It returns for how many of them the function raised, or returned something that is not finite.

        Raises:
            InputError: it returned something else.
        """
        if not len(position):
            return 0
        if self._columns.shape != (5, len(position)):
            self._columns = np.empty((5, len(position)))
        columns = self._columns
        state.motion.function_arguments(position, state.velocity, state.mass, columns)
        return int(state.motion.add_values(state.force, columns, *self._values(columns, t)))

    def potential(self, position: Array, mass: Array) -> float:
        """Sum of the number returned for (x, y, mass) of every free particle; NaN where the function raises.

        Raises:
            InputError: it returned something else.
        """
        free = np.isfinite(mass)
        columns = np.vstack((position[free].T, mass[free])).astype(np.float64)
        values = self._values(columns)[0] if free.any() else np.zeros(1)
        return float(values.sum()) if len(values) > 1 else float(values[0]) * int(free.sum())

    def _values(self, columns: Array, *more: float) -> list[Array]:
        """The numbers returned: (n,) each, or (1,) if it is the same for all."""
        with np.errstate(all="ignore"):
            try:
                returned = self.function(*columns, *more)
            except Exception:  # whatever the user's code raises
                return self._one_by_one(columns, *more)
        parts = self._parts(returned)
        if wrong := [part for part in parts if part.shape not in ((), columns.shape[1:])]:
            self._refuse(f"returns arrays of shape {wrong[0].shape} for {columns.shape[1]} particles")
        return [np.ascontiguousarray(np.atleast_1d(part), np.float64) for part in parts]

    def _parts(self, returned: Any) -> list[Array]:
        parts = returned if self._results > 1 and isinstance(returned, tuple) else (returned,)
        arrays = [np.asarray(part) for part in parts]
        if len(arrays) != self._results:
            self._refuse(f"returns {len(arrays)} of them" if isinstance(returned, tuple) else "returns no tuple")
        if not all(array.dtype.kind in "fiub" for array in arrays):
            self._refuse(f"returns {returned!r}")
        return arrays

    def _one_by_one(self, columns: Array, *more: float) -> list[Array]:
        values = np.zeros((self._results, columns.shape[1]))
        for k, (*given, mass) in enumerate(columns.T.tolist()):
            if mass < np.inf:
                try:
                    returned = self.function(*given, mass, *more)
                except Exception:  # whatever the user's code raises
                    values[:, k] = np.nan
                    continue
                numbers = returned if isinstance(returned, tuple) else (returned,)
                if len(numbers) != self._results or not all(type(number) in (float, int) for number in numbers):
                    numbers = tuple(self._parts(returned))
                    if any(part.shape for part in numbers):
                        self._refuse(f"returns {returned!r}")
                values[:, k] = numbers
        return [*values]

    def _refuse(self, did: str) -> NoReturn:
        raise InputError(f"{self.name} {did}; allowed is numeric code that returns {self.returns}")
