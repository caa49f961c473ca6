"""Links that turn or bend: rigid or elastic angles, as in a beam, limited angles, as in a knee, and motors, as in wheels."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import GIVES, Link, Numbers, compliance, damping, finite, several, strength
from pyverlet.laws.links._pool import ANGLE, MOTOR
from pyverlet.state.group import Group


class Angle(Link):
    """Keeps the angle at j between i and k. `Angle(group, i, j, k)`, or three pairs `(group, index)`.

    Args:
        ends: the joined particles; i, j and k are indices in the group, or arrays of them for many angles.
        angle: from j -> i to j -> k, counter-clockwise, rad; None for the current angle.
        compliance: rad/(N m); 0 is rigid.
        damping: N m s/rad; for angles that yield.
        breaking_torque: torque at which it breaks, N m.

    Raises:
        InputError: an index is outside its group, a particle occurs twice, or a number is outside what is allowed.
    """

    _kind = ANGLE
    _columns: ClassVar = {"angle": "rest", **GIVES}
    angle = Numbers(finite, "(k,) rad; assign one number or (k,) to change it while the world runs.", unit="radians")
    compliance, damping, breaking_torque = compliance("rad/(N m)"), damping("N m s/rad"), strength("N m")

    def __init__(
        self,
        *ends: Any,
        angle: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_torque: ArrayLike = np.inf,
    ) -> None:
        super().__init__(*parse("Angle", ends, ("i", "j", "k")))
        if angle is None:
            i, j, k = self._state.position[self.particles.T].astype(np.float64)
            (ax, ay), (bx, by) = self._state.periodic.nearest(i - j).T, self._state.periodic.nearest(k - j).T
            angle = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
        self.angle = angle
        self._set_give(compliance=compliance, damping=damping, breaking_torque=breaking_torque)


class AngleLimit(Link):
    """Keeps the angle at j between i and k within a range. `AngleLimit(group, i, j, k)`, or three pairs `(group, index)`.

    Within the range it does nothing; at its ends it pushes back, and stops the angle's motion. The angle is from j -> i to
    j -> k, counter-clockwise. Only differences of angles count, modulo 2 pi: from 3 to 3.5 rad is a range across pi. An angle
    outside is pushed to the nearer end, so a narrow forbidden range may be jumped across in a substep.

    Args:
        ends: the joined particles; i, j and k are indices in the group, or arrays of them for many limits.
        least: start of the range, rad.
        most: its end, rad; from `least` to less than 2 pi more.
        breaking_torque: torque at which it breaks, N m.

    Raises:
        InputError: an index is outside its group, a particle occurs twice, or a number is outside what is allowed.
    """

    _kind, _upper = ANGLE, 0.0
    _columns: ClassVar = {"least": "rest", "range": "slack", "strength": "strength"}
    breaking_torque = strength("N m")

    def __init__(self, *ends: Any, least: ArrayLike, most: ArrayLike, breaking_torque: ArrayLike = np.inf) -> None:
        super().__init__(*parse("AngleLimit", ends, ("i", "j", "k")))
        self._least, self._range = self._checked(least, most)
        self.breaking_torque = breaking_torque

    def _checked(self, least: ArrayLike, most: ArrayLike) -> tuple[Floats, Floats]:
        start = finite("AngleLimit", "least", least, len(self), unit="radians")
        end = finite("AngleLimit", "most", most, len(self), unit="radians")
        wide = end - start
        if (wrong := np.flatnonzero((wide < 0.0) | (wide >= 2.0 * np.pi))).size:
            row = int(wrong[0])
            said = f"most[{row}] is {end[row]:g}, least[{row}] {start[row]:g}"
            raise InputError(f"AngleLimit: {said}; allowed is a most from least to less than 2 pi more")
        return start, wide

    @property
    def least(self) -> Floats:
        """(k,) lower limits, rad; `limits` changes them while the world runs."""
        return self._least.copy()

    @property
    def most(self) -> Floats:
        """(k,) upper limits, rad."""
        return self._least + self._range

    def limits(self, least: ArrayLike, most: ArrayLike) -> None:
        """Set both limits, one number for all or (k,), rad, while the world runs.

        Raises:
            InputError: a number is outside what is allowed.
        """
        self._least, self._range = self._checked(least, most)
        self._change("rest", self._least)
        self._change("slack", self._range)


class Motor(Link):
    """Turns disc i at a speed, with a torque of at most `max_torque`. `Motor(group, i, j, k)`, or pairs `(group, index)`.

    `Motor(group, i)` turns it relative to the world. `Motor(group, i, j, k)` turns it relative to the arm from j to k, which gets
    the opposite torque, as a couple of forces on j and k. So a chassis pitches when its wheels are driven, and disc and arm
    together keep their angular momentum. `Motor(group, i, j)` takes the arm from i to j.

    Up to `max_torque` the speed is held, against friction and slopes; a motor of speed 0 is a brake. Its work is the account
    `motors` of the ledger. A world with a motor has no energy limiter. `force` is the torque on the disc, N m.

    Args:
        ends: the joined particles; i, j and k are indices in the group, or arrays of them for many motors.
        speed: of the disc, rad/s, counter-clockwise: negative for a car that drives to the right.
        max_torque: N m; 0 lets it turn freely, infinity always holds the speed.

    Raises:
        InputError: an index is outside its group, a particle occurs twice, disc i has fixed rotation, or a number is outside what
            is
            allowed.
    """

    _kind = MOTOR
    _columns: ClassVar = {"speed": "rest", "max_torque": "upper"}
    speed = Numbers(finite, "(k,) rad/s; assign one number or (k,) to change it while the world runs.", unit="rad/s")
    max_torque = Numbers(several, "(k,) N m; assign one number or (k,), while the world runs, too.", infinite=True)

    def __init__(self, *ends: Any, speed: ArrayLike, max_torque: ArrayLike) -> None:
        count = len(ends) - bool(ends and isinstance(ends[0], Group))
        state, particles = parse("Motor", ends, ("i", "j", "k")[: max(count, 1)])
        super().__init__(state, particles)
        fixed = state.fixed_rotation[particles[:, 0]] if len(state.fixed_rotation) else np.zeros(0)
        if fixed.any():
            raise InputError(f"Motor: particle {particles[fixed.argmax(), 0]} has fixed_rotation; allowed is one that can turn")
        self.speed, self.max_torque = speed, max_torque
