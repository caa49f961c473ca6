"""What walls of a room and obstacles are made of, and which particles they hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypedDict, TypeVar

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.state.state import EVERYONE

Value = TypeVar("Value")


class Checked(Generic[Value]):
    """An attribute that is checked when it is set; its owner is told if it has changed."""

    def __init__(self, check: Callable[[str, Any], Value]) -> None:
        self._check = check

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # it is read as any other attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Value: ...

    def __set__(self, owner: Any, value: Any) -> None:
        held, value = vars(owner).get(self._name, Checked), self._check(self._name, value)
        if isinstance(value, np.ndarray) or held != value:
            vars(owner)[self._name] = value
            owner._changed(self._name)


class Fixed:
    """An attribute that is set while its owner is made, if at all; later that is refused."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # it is read as any other attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Any: ...

    def __set__(self, owner: Any, value: Any) -> None:
        if owner._is_made:
            raise InputError(f"{self._name} of a {type(owner).__name__} cannot be set; allowed is a new one in its place")
        vars(owner)[self._name] = value


def at_least_0(name: str, value: Any) -> float:
    """A finite float of at least 0."""
    return checks.number(name, value, least=0.0)


def above_0(name: str, value: Any) -> float:
    """A finite float greater than 0."""
    return checks.number(name, value, above=0.0)


class Made(TypedDict, total=False):
    """The arguments of `Surface`."""

    restitution: float
    friction: float
    rolling_resistance: float
    material: str
    category: int
    mask: int


class Surface:
    """What walls and obstacles are made of.

    Args:
        restitution: e, 0 to 1.
        friction: mu, 0 or more.
        rolling_resistance: c, 0 or more; see `Collisions`.
        material: a name of `Collisions(materials=...)`, or none.
        category: 32 bits, what it is; all of them unless said.
        mask: 32 bits; it and a particle collide if each has a bit of its category in the other's mask.
    """

    restitution = Checked(checks.fraction)
    friction = Checked(at_least_0)
    rolling_resistance = Checked(at_least_0)
    material = Checked(checks.text)
    category = Checked(checks.bit_set)
    mask = Checked(checks.bit_set)

    def __init__(
        self,
        *,
        restitution: float = 0.0,
        friction: float = 0.0,
        rolling_resistance: float = 0.0,
        material: str = "",
        category: int = EVERYONE,
        mask: int = EVERYONE,
    ) -> None:
        self.restitution, self.friction, self.rolling_resistance = restitution, friction, rolling_resistance
        self.material, self.category, self.mask = material, category, mask

    def _changed(self, name: str) -> None:
        """An attribute of this name has been set."""
