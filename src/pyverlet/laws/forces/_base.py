"""The interface of forces, and the sum of all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeGuard, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError
from pyverlet.common.lists import CheckedList
from pyverlet.common.shown import listed
from pyverlet.state.group import check_home
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State


@runtime_checkable
class Force(Protocol):
    """Anything with this method is a force. Without `velocity_dependent` it is assumed to depend on velocity."""

    def apply(self, state: SortedState, t: float) -> None:
        """Add this force to `state.force` (n, 2), in N, at time t in s."""


@runtime_checkable
class Conservative(Protocol):
    """A force with a potential."""

    def potential(self, state: State) -> float:
        """Potential energy of all particles, J."""


def has_potential(force: Any) -> TypeGuard[Conservative]:
    """Whether a force is Conservative, by the name of its method: a negative `isinstance` takes 7 us."""
    return hasattr(force, "potential")


@runtime_checkable
class Numbered(Protocol):
    """An object that stores particle indices."""

    def renumber(self, now: NDArray[Any]) -> None:
        """Renumber after particles were removed: k is now at now[k], or removed if that is -1."""


def swing_time(square: float) -> float:
    """1 / omega of an oscillation with this omega^2; infinite if it is not positive."""
    return float(1.0 / np.sqrt(square)) if square > 0.0 else np.inf


class Substep(NamedTuple):
    """Data for forces that act once at the end of each substep, by a method `end_substep(state, at)`.

    The method may change velocities, and must then move positions by `lag` times the change; it returns the energy given, J.
    """

    number: NDArray[np.int64]
    """(n,) permanent numbers of the user's particles, unchanged by `World.restore`: keys for random numbers."""
    frame: int
    step: int
    h: float
    """Length of the substep, s."""
    lag: float
    """Time by which velocities are behind positions, s."""


AnyForce = TypeVar("AnyForce", bound=Force)


class ForceList(CheckedList[Force]):
    """The forces of a world: a list."""

    if TYPE_CHECKING:

        def append(self, thing: AnyForce) -> AnyForce: ...  # type: ignore[override]

    def __repr__(self) -> str:
        return listed("force", self)

    def check_one(self, thing: Any) -> None:
        if isinstance(thing, type) or not isinstance(thing, Force):
            raise InputError(f"force is {thing!r}; allowed is an object with a method apply(state, t), such as pyverlet.Drag()")

    def check(self, state: State) -> None:
        """Raise InputError if one of `pyverlet`'s own forces acts on a group of another world."""
        for k, force in enumerate(self[:]):
            if "group" in getattr(force, "_shows", ()):
                check_home(f"group of forces[{k}]", getattr(force, "group", None), state)


class ForceSum:
    """Gravity and the world's forces: the acceleration that integrators evaluate. Forces are summed, then a = F / m.

    Args:
        gravity: (x, y), m/s^2.
        forces: the world's list, read at each evaluation.

    Attributes:
        typical, strongest: mean and largest acceleration of free particles in the last evaluation, m/s^2, without drag, which
            presses nothing together.
        t: the time of the last evaluation of forces, s.
    """

    def __init__(self, gravity: tuple[float, float], forces: list[Any]) -> None:
        self.gravity = gravity
        self.forces = forces
        self.typical = self.strongest = self.t = 0.0

    @property
    def velocity_dependent(self) -> bool:
        """Whether any of the forces may depend on velocity."""
        return any(map(_may_depend, self.forces[:]))

    @property
    def functions(self) -> bool:
        """Whether any of those are functions, or other forces that ask for the velocity they lead to."""
        return any(map(_is_solved, self.forces[:])) and self.velocity_dependent

    def turn(self, gravity: tuple[float, float], state: State) -> None:
        """Change gravity from now on.

        At the start of a frame half of the last kick is removed from moving particles, whose velocities belong to the end of the
        frame before; that half must use the new gravity. Particles at rest or new have no acceleration to remove.
        """
        change = np.subtract(gravity, self.gravity)
        self.gravity = gravity
        if change.any():
            flies = state.acceleration.any(axis=1) & np.isfinite(state.mass)
            state.acceleration[flies] += change.astype(state.dtype)

    def __call__(self, state: SortedState, t: float) -> None:
        force = self._summed(state, t)  # acceleration = gravity + force / mass
        about = force, vars(state).get("resistance"), state.inverse_mass
        state.motion.newton(state.acceleration, *about, *self.gravity, state.h)

    def longest_substep(self, state: SortedState) -> float:
        """The longest substep that all forces with a method of this name allow, s."""
        return min((one.longest_substep(state) for one in self.forces[:] if hasattr(one, "longest_substep")), default=np.inf)

    def look(self, state: SortedState, t: float) -> None:
        """Evaluate how strong the forces are, without changing accelerations."""
        self._summed(state, t)
        soften(state, self.gravity)

    def _summed(self, state: SortedState, t: float) -> NDArray[Any]:
        """The sum of all forces without gravity (n, 2), N, not softened; (0, 2) if there are none."""
        forces, drags, force = self.forces[:], [], state.acceleration[:0]
        if forces:
            self.t, force = t, state.force
            force.fill(0)
            if len(forces) > 1:
                forces.sort(key=_is_function)
        for one in forces:
            if getattr(one, "only_slows", False):
                drags.append(one)
            else:
                one.apply(state, t)
        self.typical, self.strongest = state.motion.strengths(state.strength, force, state.inverse_mass, *self.gravity)
        for one in drags:
            one.apply(state, t)
        return force


def soften(state: SortedState, gravity: tuple[float, float]) -> None:
    """After all forces: soften them where drag is too strong for the substep, see `core/forces.py`."""
    if "resistance" in vars(state):
        state.motion.soften(state.force, state.resistance, state.inverse_mass, *gravity, state.h)


def _may_depend(force: Any) -> bool:
    """Whether a force may depend on velocity."""
    return bool(getattr(force, "velocity_dependent", True))


def _is_solved(force: Any) -> bool:
    """Whether a velocity-dependent force is evaluated repeatedly until it sees the velocity that it leads to."""
    return _is_function(force) or (not hasattr(force, "is_drag") and getattr(force, "velocity_dependent", False))


def _is_function(force: Any) -> bool:
    """Whether a force is a user's function; these are added after all others."""
    return hasattr(force, "is_function")
