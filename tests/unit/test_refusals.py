"""Arguments that cannot be are refused in one sentence, which names them, their value and what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

TRIANGLE, MOUTH, NAN = [(0, 0), (1, 0), (0, 1)], pv.Box((-5, 8), (5, 10)), float("nan")
STAR = [(np.sin(k * 0.8 * np.pi), np.cos(k * 0.8 * np.pi)) for k in range(5)]
BATH: dict[str, Any] = {"temperature": 1.0, "friction": 1.0, "seed": 0}
WRONG: Any = 3
lib: Any = pv  # untyped, for arguments of wrong types


def two() -> pv.Group:
    return pv.World().add(position=[(0, 0), (1, 0)], radius=0.1)


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: lib.Drag(linear=-1), r"linear is -1; allowed is a finite number of at least 0"),
    (lambda: lib.Drag(linear=10**400), r"linear is too large for a float; allowed is a finite number of at least 0"),
    (lambda: lib.World().add(position=(0, 0), mass=10**400), r"mass is not an array of numbers"),
    (lambda: lib.Spring(two(), 0, 1, stiffness=10**400), r"Spring: stiffness is not an array of numbers"),
    (lambda: lib.Rope(two(), 0, 1, length=1.0, breaking_force=10**400), r"Rope: breaking_force is not an array of numbers"),
    (lambda: lib.World().add(position=(0, 0), radius=np.array(1 + 1j)), r"radius is not an array of numbers"),
    (lambda: lib.World().add(position=(0, 0), data=[1, 2]), r"data is \[1, 2\]; allowed is a dict"),
    (lambda: lib.World().add(position=(0, 0), fixed_rotation="x"), r"fixed_rotation is 'x'; allowed are whole numbers"),
    (lambda: lib.Wind((1, NAN)), r"velocity is \(1.0, nan\)"),
    (lambda: lib.Attractor(strength=np.inf), r"strength is inf"),
    (lambda: lib.Gravitation(strength=1, softening=-1), r"softening is -1"),
    *((lambda theta=theta: lib.Gravitation(strength=1.0, theta=theta), "theta is") for theta in (-0.1, 1.5, NAN)),
    (lambda: lib.ConstantForce(WRONG), r"newtons is 3; allowed are two numbers"),
    (lambda: lib.Langevin(**BATH | {"temperature": -1}), "temperature is -1"),
    (lambda: lib.Langevin(**BATH | {"friction": NAN}), "friction is nan"),
    (lambda: lib.Langevin(**BATH | {"seed": -1}), "seed is -1"),
    # obstacles and rooms
    (lambda: lib.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), r"points of the polygon are \(0, 0\), .*allowed are .*convex"),
    (lambda: lib.Polygon(STAR), r"points of the polygon are .* sides do not cross"),
    (lambda: lib.Polygon([(0, 0), (2, 0), (1, 0.5), (0, 2)]), r"convex polygon"),
    (lambda: lib.Polygon([(0, 0), (1, 0), (2, 0)]), r"convex polygon"),
    (lambda: lib.Polygon([(0, 0), (1, 0)]), r"points has 2 rows; allowed are at least 3 points"),
    (lambda: lib.Segment((1, 1), (1, 1)), r"points\[0\] and points\[1\] are both \(1.0, 1.0\)"),
    (lambda: lib.Chain([(0, 0), (NAN, 1)]), r"points\[1\] is \(nan, 1.0\)"),
    (lambda: lib.Disc((0, 0), 0), r"radius is 0; allowed is a finite number greater than 0"),
    (lambda: lib.Capsule((0, 0), (1, 0), radius=-1), r"radius is -1"),
    (lambda: lib.Polygon(TRIANGLE, restitution=2), r"restitution is 2; allowed is a number from 0 to 1"),
    (lambda: setattr(lib.Polygon(TRIANGLE), "friction", -1), r"friction is -1"),
    (lambda: setattr(lib.Polygon(TRIANGLE), "velocity", 3), r"velocity is 3; allowed are two numbers"),
    (
        lambda: lib.Segment((0, 0), (1, 0), one_way=(0, 0)),
        r"one_way is \(0.0, 0.0\); allowed is a direction other than 0",
    ),
    (lambda: lib.Segment((0, 0), (1, 0), one_way="up"), "one_way is 'up'; allowed are two"),
    (lambda: lib.Circle(radius=1, angular_velocity=NAN), "angular_velocity is"),
    (lambda: lib.Circle(radius=1, angular_velocity="fast"), "angular_velocity is"),
    # particles and their laws
    *(
        (lambda i=i: lib.World().add(position=(0, 0), inertia=i), r"inertia\[0\] is .* greater than 0")
        for i in (0.0, -1.0, np.inf, NAN)
    ),
    (lambda: lib.Collisions(combine="sum"), "combine is 'sum'; allowed are 'geometric', 'mean', 'min', 'max', 'multiply'"),
    (lambda: lib.Collisions(materials={"a": {}}), "materials has the key 'a'; allowed are two names, such as"),
    (lambda: lib.Collisions(materials=[1]), r"materials is \[1\]; allowed is a table"),
    (
        lambda: lib.Collisions(materials={("a", "b"): {"mass": 1}}),
        "allowed is a table of restitution, friction, rolling_resist",
    ),
    (
        lambda: lib.Collisions(materials={("a", "b"): {"restitution": 2}}),
        r"restitution of \('a', 'b'\) is 2; allowed is a number",
    ),
    (lambda: lib.Collisions(rolling_resistance=-1), "rolling_resistance is -1; allowed is a finite number of at least 0"),
    # emitters and sinks
    (lambda: lib.Emitter(lib.Open(), rate=1), r"region is Open\(\); allowed is a pyverlet.Box or a pyverlet.Circle"),
    (lambda: lib.Emitter(MOUTH, rate=-1), r"rate is -1"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=0), r"radius is 0; allowed is a finite number greater than 0"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=(2, 1)), r"radius is 1; allowed is a finite number of at least 2"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=3), r"radius\[0\] is 3 m; allowed is at most .* 1 m"),
    (lambda: lib.Emitter(MOUTH, rate=1, most=-1), r"most is -1"),
    (lambda: lib.Sink(WRONG), r"region is 3; allowed is an object such as"),
]


@pytest.mark.parametrize(("make", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_arguments_that_cannot_be_get_one_sentence(make: Callable[[], object], says: str) -> None:
    with pytest.raises(pv.InputError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)
