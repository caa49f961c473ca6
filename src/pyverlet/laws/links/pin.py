"""A pin: a particle held at a point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.ground import checks
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import Array, Floats, Link, several, stiffness_of
from pyverlet.laws.links._pool import Pool, held
from pyverlet.laws.links._work import Work
from pyverlet.state.seam import Seam


class Pin(Link):
    """Holds particles at points. `Pin(group, i)` or `Pin(group, i, point=(x, y))`.

    `group.pin(i)` makes a particle immovable, for good and for all. A pin can be soft, can break, can be moved and taken out.

    Args:
        ends: a group and an index in it or a (k,) array of them; or `(group, i)`.
        point: (x, y) or (k, 2), m; None takes where the particles are.
        compliance: what it gives under a newton, m/N; 0 is rigid.
        damping: N s/m against motion; for pins that give.
        breaking_force: pull it breaks at, N.

    Raises:
        InputError: an index is outside its group, or a number is outside what is allowed.
    """

    def __init__(
        self,
        *ends: Any,
        point: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_force: ArrayLike = np.inf,
    ) -> None:
        state, particles = parse("Pin", ends, ("i",))
        super().__init__(state, particles)
        count = len(particles)
        where = state.position[particles[:, 0]] if point is None else point
        self._point = self._points(where)
        self._stiffness = stiffness_of("Pin", count, None, compliance)
        self._damping = several("Pin", "damping", damping, count)
        self._strength = several("Pin", "breaking_force", breaking_force, count, above=0.0, infinite=True)

    def _points(self, value: ArrayLike) -> Floats:
        return np.array(checks.rows("Pin: point", value, np.dtype(np.float64), len(self)))

    @property
    def point(self) -> Floats:
        """(k, 2) m; assign (x, y) or (k, 2) to move the pins while the world runs."""
        return self._point.copy()

    @point.setter
    def point(self, value: ArrayLike) -> None:
        self._point = self._points(value)
        self._change("point", self._point)

    @property
    def _family(self) -> Any:
        return Pin

    def _new_pool(self) -> Pool:
        return PinPool()

    def _columns(self) -> dict[str, Any]:
        return {
            "point": self._point, "stiffness": self._stiffness, "damping": self._damping, "strength": self._strength,
            "collide": 1,
        }  # fmt: skip


class PinPool(Pool):
    """Pins act on their particles alone, before the rows, which then feel a particle as heavy as its pin is stiff."""

    drawn = False

    def __init__(self) -> None:
        super().__init__(point=(np.float64, (2,)))

    def pack(self, work: Work) -> None:
        self.stale, self.changed = False, True
        self._particle = work.compact[self.entries["particle"]]
        self._give, self._lam, self._last, self._force = np.zeros((4, len(self.rows)))
        self._left, self._way, self._kept = np.zeros((3, len(self.rows), 2))
        self._intact = np.zeros(len(self.rows), np.uint8)
        self._given = tuple(self.rows[name] for name in ("point", "stiffness", "damping", "strength"))

    def begin(self) -> None:
        if self.changed:
            self.gives, self.changed = bool(np.isfinite(self.rows["stiffness"]).any()), False
        self._intact[:] = self.rows["intact"]
        self._force[:] = self.rows["force"]

    def arrays(self) -> tuple[Array, ...]:
        """As `kernels.linked.Linked` has them."""
        return (
            self._particle, *self._given, self._intact, self._give, self._left, self._way, self._kept, self._lam, self._last,
            self._force,
        )  # fmt: skip

    def broken(self) -> Array:
        return np.flatnonzero(self._intact != self.rows["intact"])

    def pulled(self) -> Array:
        return self._force

    def end(self) -> None:
        self.rows["intact"][:] = self._intact
        self.rows["force"][:] = np.where(self._intact, self._force, 0.0)

    def stored(self, position: Array, seam: Seam) -> float:
        return float(self._energies(position, self._particle, self._intact, seam).sum())

    def energy(self, position: Array, seam: Seam) -> float:
        return float(self.energies(position, seam).sum())

    def energies(self, position: Array, seam: Seam) -> Array:
        return self._energies(position, self.entries["particle"], self.rows["intact"], seam)

    def _energies(self, position: Array, particle: Array, intact: Array, seam: Seam) -> Array:
        away = np.hypot(*seam.nearest(position[particle].astype(float) - self.rows["point"]).T)
        return held(self.rows["stiffness"], np.inf, intact, away)
