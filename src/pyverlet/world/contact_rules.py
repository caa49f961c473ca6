"""User-defined rules for circles that are about to touch: ignore the contact, break, merge or split them."""

from __future__ import annotations

import functools
import importlib
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import pickling
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.shown import count
from pyverlet.laws.collisions import find_contacts
from pyverlet.world.actors import Actor

if TYPE_CHECKING:
    from pyverlet.world.world import World


NUMBERS = 1 << 31
"""Above any particle number: the key of a pair is its lower number times this, plus the higher one."""


class NewContacts(NamedTuple):
    """Pairs of circles that do not touch yet but may in the coming frame."""

    a: NDArray[np.int64]
    """(k,) index of one circle."""
    b: NDArray[np.int64]
    """(k,) index of the other, a < b."""
    meets: NDArray[np.bool_]
    """(k,) whether they will touch on straight paths. Other pairs touch only if they are deflected within the frame."""
    speed: NDArray[np.float64]
    """(k,) approach speed at contact, or now if they will not touch, m/s."""
    point: NDArray[np.float64]
    """(k, 2) point of contact on the rim of a, m."""
    normal: NDArray[np.float64]
    """(k, 2) unit normal out of a."""

    def __repr__(self) -> str:
        return f"NewContacts of {count(len(self.a), 'pair')}"


Rule = Callable[["World", NewContacts], Any]


class ContactRule(Actor):
    """A rule made of a function by `contact_rule`; append it to `world.actors`. It can still be called as a function.

    Rules of the same function are equal. The state of a rule belongs to one world; other worlds use copies of it.
    """

    def __init__(self, function: Rule) -> None:
        if not callable(function):
            raise InputError(f"function is {function!r}; allowed is a function of the world and its new contacts")
        functools.update_wrapper(self, function)
        self._function = function
        self._world: weakref.ref[World] | None = None
        # Keys of pairs that have met, and of pairs that do not collide.
        self._met = self._ignored = np.empty(0, np.int64)

    def __call__(self, world: World, new: NewContacts) -> Any:
        return self._function(world, new)

    def __repr__(self) -> str:
        return f"contact_rule({getattr(self._function, '__qualname__', self._function)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ContactRule) and self._function is other._function

    def __hash__(self) -> int:
        return id(self._function)

    def __reduce__(self) -> Any:
        if pickling.by_name(self) and not pickling.is_by_value():  # a decorated function: its name refers to this rule
            return _named, (self.__module__, vars(self)["__qualname__"]), self.save()
        pickling.check(repr(self), self._function)
        return ContactRule, (self._function,), self.save()

    def __deepcopy__(self, memo: Any = None) -> ContactRule:
        rule = ContactRule(self._function)
        rule.restore(self.save())
        return rule

    __copy__ = __deepcopy__

    def of(self, world: World) -> ContactRule:
        self._world = self._world or weakref.ref(world)
        return self if self._world() is world else ContactRule(self._function).of(world)

    def act(self, world: World, dt: float) -> None:
        pairs, meets, *where = _near(world, dt)
        near = world.number[pairs] @ np.array([NUMBERS, 1])
        met = np.isin(near, self._met)
        kept, fresh = near[met & np.isin(near, self._ignored)], ~met
        self._met = near[met | meets]
        if fresh.any():
            new = NewContacts(pairs[fresh, 0], pairs[fresh, 1], meets[fresh], *(column[fresh] for column in where))
            answer = self._function(world, new)
            if answer is not None:
                kept = np.concatenate((kept, near[fresh][self._checked(answer, len(new.a))]))
        self._ignored = kept

    def _checked(self, answer: Any, pairs: int) -> Array:
        ignored = np.asarray(answer)
        if ignored.dtype != bool or ignored.shape not in ((), (pairs,)):
            raise InputError(f"{self} returned {answer!r}; allowed are None, and {pairs} bools: which of the contacts to ignore")
        return np.broadcast_to(ignored, pairs)

    def apart(self, world: World) -> Array:
        """(k, 2) indices of the pairs that do not collide."""
        place = world._state.index_of(np.column_stack(np.divmod(self._ignored, NUMBERS)))
        return place[(place >= 0).all(axis=1)]

    def save(self) -> Any:
        return self._met, self._ignored

    def restore(self, saved: Any) -> None:
        self._met, self._ignored = saved

    __setstate__ = restore


def contact_rule(function: Rule) -> ContactRule:
    """Make a rule for contacts of a function; also a decorator. `world.actors.append(rule)` activates it.

    The function is called before each frame in which circles may begin to touch, as `rule(world, new)`, with `NewContacts`. It
    may change the world: remove or add circles, or join two by a link. It returns the contacts to ignore, (k,) bools or one for
    all, or None. Ignored pairs pass through each other in this frame, or, if they meet, until they are apart again. Each frame
    costs a search for nearby pairs; a change of the ignored pairs costs a new pair list.
    """
    return ContactRule(function)


def _named(module: str, name: str) -> ContactRule:
    """The rule of a module's function, by name (for unpickling)."""
    return ContactRule(functools.reduce(getattr, name.split("."), importlib.import_module(module))._function)


def _near(world: World, dt: float) -> tuple[Array, Array, Array, Array, Array]:
    """(k, 2) indices of circles that touch or may within dt; whether they do on straight paths; speed, point and normal there."""
    state = world._state
    common = np.median(state.velocity, axis=0) if len(state) else 0.0  # a common velocity brings no pair closer
    pairs = find_contacts(state, (state.radius + dt * np.hypot(*(state.velocity - common).T)).astype(state.dtype))
    i, j = pairs.T
    way = state.periodic.nearest(state.position[j].astype(float) - state.position[i])
    against = state.velocity[j].astype(float) - state.velocity[i]
    # The first time at which |way + against t| = r_i + r_j.
    square, along = (against**2).sum(axis=1), (way * against).sum(axis=1)
    apart = (way**2).sum(axis=1) - (state.radius[i].astype(float) + state.radius[j]) ** 2
    root = along**2 - square * apart
    with np.errstate(invalid="ignore", divide="ignore"):
        first = apart / (np.sqrt(np.maximum(root, 0)) - along)
    touch = (apart > 0) & (root >= 0) & (along < 0)
    meets = (apart <= 0) | (touch & (first <= dt))
    time = np.where(touch & meets, first, 0.0)[:, None]
    line = way + against * time
    far = np.hypot(*line.T)[:, None]
    normal = np.divide(line, far, out=np.tile((1.0, 0.0), (len(line), 1)), where=far > 0)
    point = state.position[i] + state.velocity[i] * time + normal * state.radius[i, None]
    return pairs, meets, -(against * normal).sum(axis=1), point, normal
