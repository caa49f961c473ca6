"""Forces between particles within a range, along the line of centres: the base classes, and user-defined functions."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError, NonFiniteError
from pyverlet.common.shown import Shown
from pyverlet.laws.forces.function import Code, FunctionForce
from pyverlet.state.neighbours import Near, check_range, near
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State

Indices = NDArray[np.int32]
Law = Callable[[Array, Indices, Indices], Any]


class PairForce(Shown, ABC):
    """Base class of forces between every two particles closer than `range` m, along their line of centres.

    A derived class has `range` and `force`, and `PairLaw` as its base if it has an energy. Pinned particles exert forces but feel
    none; coincident particles, which have no line of centres, are ignored unless `parts_all` is set. In a periodic room the
    nearest images interact, and the range is at most half of the shortest period.
    """

    velocity_dependent = False
    symmetric = True  # if False, `force` is the force on i, and is also called with (j, i)
    looks_at_particles = True  # whether i and j matter; if False they may be rows, which is faster
    parts_all = False  # whether it is finite at distance 0, too; then it acts along x, with the lower of i and j on the left
    range: float

    @abstractmethod
    def force(self, distance: Array, i: Indices, j: Indices) -> Array:
        """(k,) N for k pairs of the user's particles i and j, (k,) each, at `distance` (k,) m; positive is repulsive."""

    def among(self, state: SortedState) -> Array:
        """Rows of particles whose mutual forces sum to zero."""
        return np.arange(len(state))

    def apply(self, state: SortedState, t: float) -> None:
        """Add the forces on both particles of each pair.

        Raises:
            InputError: a periodic room is narrower than twice the range, or a force is so strong that no substep can follow it.
        """
        pairs = state.near(self.range, together=self.parts_all)
        if len(pairs.i):
            which = (state.particle[pairs.i], state.particle[pairs.j]) if self.looks_at_particles else (pairs.i, pairs.j)
            on_i, on_j = self._both(pairs.distance, *which)
            most = max(on_i.max(), -on_i.min(), on_j.max(), -on_j.min())
            if not most * float(state.inverse_mass.max()) * state.h**2 <= self.range:
                self._refuse_throws(state, pairs, on_i, on_j)
            state.motion.add_along(state.force, pairs.i, pairs.j, pairs.way, on_i, on_j)

    def _refuse_throws(self, state: SortedState, pairs: Near, on_i: Array, on_j: Array) -> None:
        """Raise InputError if a force throws a pair farther apart in a substep than its range."""
        ease = state.inverse_mass.astype(float)
        way = state.h**2 * np.maximum(abs(on_i) * ease[pairs.i], abs(on_j) * ease[pairs.j])
        if not way[k := int(way.argmax())] <= self.range:
            i, j = sorted((int(state.particle[pairs.i[k]]), int(state.particle[pairs.j[k]])))
            raise InputError(
                f"{self!r} moves particles {i} and {j}, {pairs.distance[k]:.3g} m apart, by {way[k]:.3g} m in a substep; allowed "
                f"is at most its range, {self.range:g} m: let them begin farther apart, or take more substeps"
            )

    def _both(self, distance: Array, i: Indices, j: Indices) -> tuple[Array, Array]:
        """Forces on the first and on the second of each pair, N."""
        there = self._numbers(self.force(distance, i, j), distance)
        return there, there if self.symmetric else self._numbers(self.force(distance, j, i), distance)

    def _numbers(self, returned: Any, distance: Array) -> Array:
        """(k,) checked result of a law for k pairs: a number for each, or one for all."""
        try:
            return np.ascontiguousarray(np.broadcast_to(np.asarray(returned, np.float64), distance.shape))
        except (TypeError, ValueError):
            said = f"{self!r} returned {returned!r} for {len(distance)} pairs"
            raise InputError(f"{said}; allowed is one number for each, or one for all") from None

    def virial(self, state: State) -> float:
        """Sum over pairs of force times distance, J: their contribution to twice the pressure times the area."""
        distance, i, j = self._felt(state)
        return float((0.5 * sum(self._both(distance, i, j)) * distance).sum())

    def _felt(self, state: State) -> tuple[Array, Indices, Indices]:
        """distance, i, j of the current pairs that are not both pinned."""
        found = near(state.position, check_range(self.range, state.periodic), state.periodic, together=self.parts_all)
        free = np.isfinite(state.mass)
        felt = free[found.i] | free[found.j]
        return found.distance[felt], found.i[felt], found.j[felt]


class PairLaw(PairForce):
    """Base class of pair forces with an energy, which the world's energy includes."""

    @abstractmethod
    def energy(self, distance: Array, i: Indices, j: Indices) -> Array:
        """(k,) energies of these pairs, J; 0 at the range."""

    def potential(self, state: State) -> float:
        """Sum of the energy of all pairs, J."""
        felt = self._felt(state)
        return float(self._numbers(self.energy(*felt), felt[0]).sum())


class PairFunctionForce(PairForce, FunctionForce):
    """A force made of a function by `pair_force`. It can still be called as a function."""

    _kind_of_code = "code on arrays"
    _SAYS = "one number for each pair, newtons, positive for repulsion"

    _settings = "range", "symmetric"

    range = Checked(checks.number, above=0.0)
    symmetric = Checked(checks.flag)

    def __init__(
        self, function: Law, potential: Law | None = None, *, range: float, symmetric: bool = True  # noqa: A002
    ) -> None:  # fmt: skip
        self._code = Code(function, "pair force", "distance, i, j", self._SAYS, self._kind_of_code)
        self.range, self.symmetric = range, symmetric
        self._seen_symmetric, self._t = not self.symmetric, 0.0
        if potential is not None and not symmetric:
            raise InputError(f"potential is {potential!r}; allowed is None where forces are not symmetric, for they have none")
        self._hold(potential, "distance, i, j", "one number for each pair, joules")
        functools.update_wrapper(self, function)

    def __repr__(self) -> str:
        return self._code.name

    def apply(self, state: SortedState, t: float) -> None:
        self._t = t
        super().apply(state, t)

    def force(self, distance: Array, i: Indices, j: Indices) -> Array:
        """The values of the function.

        Raises:
            InputError: it raised, or returned something else than numbers for the pairs.
            NonFiniteError: it returned NaN or infinity.
        """
        there = self._values(self._code, distance, i, j)
        if not self._seen_symmetric and len(distance):
            back = self._values(self._code, distance, j, i)
            if (other := np.flatnonzero(~np.isclose(there, back, rtol=1e-6, atol=1e-300))).size:
                k = int(other[0])
                raise InputError(
                    f"{self._code.name} returns {there[k]:g} for particles {i[k]} and {j[k]}, and {back[k]:g} for {j[k]} and "
                    f"{i[k]}; allowed are equal forces, or pair_force(symmetric=False)"
                )
            self._seen_symmetric = True
        return there

    def _values(self, code: Code, distance: Array, i: Indices, j: Indices) -> Array:
        with np.errstate(all="ignore"):
            try:
                returned = code.function(distance.copy(), i, j)  # the function may keep its argument
            except Exception as error:  # any exception of the user's code
                code.refuse(f"raised {type(error).__name__} ({error}) for arrays of {len(distance)} pairs", error)
        value = np.array(np.broadcast_to(code.numbers(returned, len(distance), "pairs")[0], distance.shape))
        if (wrong := np.flatnonzero(~np.isfinite(value))).size:
            k = int(wrong[0])
            raise NonFiniteError(
                int(i[k]), "integrate", self._t,
                f"{code.name} returned {value[k]} for particles {i[k]} and {j[k]} at a distance of {distance[k]:g}; allowed are "
                f"finite numbers; the world holds the last good frame",
            )  # fmt: skip
        return value

    def energy(self, distance: Array, i: Indices, j: Indices) -> Array:
        """(k,) energies of these pairs, J, if there is a potential."""
        assert self._held
        return self._values(self._held, distance, i, j)

    _potential = PairLaw.potential


def pair_force(
    *, range: float, symmetric: bool = True, potential: Law | None = None  # noqa: A002
) -> Callable[[Law], PairFunctionForce]:  # fmt: skip
    """Make a force between particles of a function (distance, i, j) of arrays, one entry for each pair closer than `range`.

    It returns the force along the line of centres in N, positive for repulsion: an array, or one number for all. `distance` is in
    m, `i` and `j` are particle indices, so that `kind[i]` is that of each pair's first. It should be 0 at the range, to avoid
    jumps when pairs enter and leave it.

    Args:
        range: m.
        symmetric: whether forces on i and j are opposite, so that momentum is conserved. If not, the function is called for
            (i, j) and (j, i), and returns the force on the first; such forces may drive particles for ever, and the ledger has
            their work in `forces`.
        potential: function (distance, i, j) of the energy of each pair, J, 0 at the range. The world's energy includes it.

    Raises:
        InputError: the function takes other arguments, or has a potential without being symmetric.
    """
    return functools.partial(PairFunctionForce, potential=potential, range=range, symmetric=symmetric)
