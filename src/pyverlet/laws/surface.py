"""Surfaces of walls and obstacles: their material, and which particles they hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypedDict

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.state.state import EVERYONE


class Fixed:
    """An attribute that can be set only during construction."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # for type checkers it is an ordinary attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Any: ...

    def __set__(self, owner: Any, value: Any) -> None:
        if owner._is_made:
            raise InputError(f"{self._name} of a {type(owner).__name__} cannot be set; allowed is a new one in its place")
        vars(owner)[self._name] = value


class Made(TypedDict, total=False):
    """The arguments of `Surface`."""

    restitution: float
    friction: float
    rolling_resistance: float
    material: str
    category: int
    mask: int


class Surface:
    """Base class of walls and obstacles: the properties of their surface.

    Args:
        restitution: e, 0 to 1.
        friction: mu, 0 or more.
        rolling_resistance: c, 0 or more; see `Collisions`.
        material: a name in `Collisions(materials=...)`, or "".
        category: 32 bits, its categories; all by default.
        mask: 32 bits; it and a particle collide if each has a bit of its category in the other's mask.
    """

    restitution = Checked(checks.fraction)
    friction = Checked(checks.number, least=0.0)
    rolling_resistance = Checked(checks.number, least=0.0)
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
        """Called after an attribute of this name was set."""
