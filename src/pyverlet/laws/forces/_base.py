"""What a force is, and the sum of all of them."""

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
    """Anything with this method is a force. One without `velocity_dependent` is taken to look at the velocity."""

    def apply(self, state: SortedState, t: float) -> None:
        """Add this force to `state.force` (n, 2), in N, at time t in s."""


@runtime_checkable
class Conservative(Protocol):
    """A force with a potential."""

    def potential(self, state: State) -> float:
        """Potential energy of all particles, J."""


def has_potential(force: Any) -> TypeGuard[Conservative]:
    """Whether it is Conservative, by the name of its method: `isinstance` takes 7 us to say no."""
    return hasattr(force, "potential")


@runtime_checkable
class Numbered(Protocol):
    """Something that holds particles by their index."""

    def renumber(self, now: NDArray[Any]) -> None:
        """Particles were removed: the one that was at k is at now[k], or is no more if that is -1."""


def swing_time(square: float) -> float:
    """1 / omega of what swings with so much omega^2; infinite of none."""
    return float(1.0 / np.sqrt(square)) if square > 0.0 else np.inf


class Substep(NamedTuple):
    """What forces are told of that act once at the end of each substep, by a method `end_substep(state, at)`.

    It may change velocities, and moves positions by `lag` times what it changes them by; it returns J that it has given.
    """

    number: NDArray[np.int64]
    """(n,) of each of the user's particles, for ever the same, also after `World.restore`: to draw random numbers from."""
    frame: int
    step: int
    h: float
    """s, its length."""
    lag: float
    """s by which velocities are behind positions."""


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
        """Raise InputError if one that `pyverlet` has acts on a group of particles of another state than this one."""
        for k, force in enumerate(self[:]):
            if "group" in getattr(force, "_shows", ()):
                check_home(f"group of forces[{k}]", getattr(force, "group", None), state)


class ForceSum:
    """Gravity and the world's forces together: what integrators call. Forces are summed, then a = F / m.

    Args:
        gravity: (x, y), m/s^2.
        forces: the world's list, read anew at each evaluation.

    Attributes:
        typical, strongest: mean and largest acceleration that free particles have felt in the last evaluation, m/s^2, without
            drag, which brings nothing together.
        t: the time of the last evaluation that asked forces, s.
    """

    def __init__(self, gravity: tuple[float, float], forces: list[Any]) -> None:
        self.gravity = gravity
        self.forces = forces
        self.typical = self.strongest = self.t = 0.0

    @property
    def velocity_dependent(self) -> bool:
        """Whether any of the forces may look at the velocity."""
        return any(map(_may_depend, self.forces[:]))

    @property
    def functions(self) -> bool:
        """Whether there are functions among those that look at the velocity, or others that say that they do."""
        return any(map(_is_solved, self.forces[:])) and self.velocity_dependent

    def turn(self, gravity: tuple[float, float], state: State) -> None:
        """Gravity is another from now on.

        Of particles in flight half of the last kick is taken back when a frame begins, for their velocity belongs to the end of
        the frame before: it is to be that of the new gravity. Those at rest, or new, have no acceleration to undo.
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
        """s, that all of those bear which say it by a method of this name."""
        return min((one.longest_substep(state) for one in self.forces[:] if hasattr(one, "longest_substep")), default=np.inf)

    def look(self, state: SortedState, t: float) -> None:
        """See how strong they are, without accelerating anything."""
        self._summed(state, t)
        soften(state, self.gravity)

    def _summed(self, state: SortedState, t: float) -> NDArray[Any]:
        """The sum of all forces but gravity (n, 2), N, not softened yet; (0, 2) if there are none."""
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
    """Once all have been applied: where drag is stronger than substeps are short, see `core/forces.py`."""
    if "resistance" in vars(state):
        state.motion.soften(state.force, state.resistance, state.inverse_mass, *gravity, state.h)


def _may_depend(force: Any) -> bool:
    """On the velocity."""
    return bool(getattr(force, "velocity_dependent", True))


def _is_solved(force: Any) -> bool:
    """Whether it is evaluated until it sees the velocity that it leads to, if it depends on that."""
    return _is_function(force) or (not hasattr(force, "is_drag") and getattr(force, "velocity_dependent", False))


def _is_function(force: Any) -> bool:
    """Functions of the user's own are added up after all others."""
    return hasattr(force, "is_function")
