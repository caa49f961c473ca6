"""A motor: what turns the wheel of a car."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.ground.errors import InputError
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import Link, Numbers, finite, several
from pyverlet.laws.links._pool import MOTOR
from pyverlet.state.group import Group


class Motor(Link):
    """Turns disc i at a speed, with a torque of at most `max_torque`. `Motor(group, i, j, k)`, or pairs `(group, index)`.

    `Motor(group, i)` turns it against the world. `Motor(group, i, j, k)` turns it against the arm from j to k: spins are counted
    from that arm, which gets the opposite torque, as a couple of forces on j and k. So a chassis pitches when its wheels are
    driven, and disc and arm together keep their angular momentum. `Motor(group, i, j)` takes the arm from i to j.

    Below `max_torque` the speed is held, against friction and slopes, and a motor of speed 0 is a brake. Its work is the account
    `motors` of the ledger. A world with a motor has no energy limiter. `force` is the torque on the disc, N m.

    Args:
        ends: what it joins; i, j and k are indices in the group, or arrays of them for many motors.
        speed: of the disc, rad/s, counter-clockwise: a car that drives to the right has negative ones.
        max_torque: N m; 0 lets it turn freely, infinity holds the speed whatever comes.

    Raises:
        InputError: an index is outside its group, a particle comes twice, nothing turns disc i, or a number is outside what is
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
