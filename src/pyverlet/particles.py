"""The arrays of a world's particles, in the order they were added."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pyverlet.state import State

Array = NDArray[Any]


class Particles:
    """What a world shows of its particles: views, so that reading copies nothing and writing changes the world."""

    _state: State

    def __len__(self) -> int:
        return len(self._state)

    @property
    def position(self) -> Array:
        """(n, 2) centres of all particles in the order they were added, m; a view."""
        return self._state.position

    @property
    def velocity(self) -> Array:
        """(n, 2) m/s; a view."""
        return self._state.velocity

    @property
    def spin(self) -> Array:
        """(n,) angular velocity, rad/s, counter-clockwise; a view."""
        return self._state.spin

    @property
    def radius(self) -> Array:
        """(n,) m; a view."""
        return self._state.radius

    @property
    def mass(self) -> Array:
        """(n,) kg, infinite where pinned; a view."""
        return self._state.mass
