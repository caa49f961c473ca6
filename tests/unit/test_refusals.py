"""Arguments that cannot be are refused in one sentence, which names them, their value and what is allowed."""

import copy
import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.common.checked import Checked
from pyverlet.lab.figures import check_can_plot
from pyverlet.viewers.window import Window

NO_NUMBERS, WHOLE = (0.5, "one", [True], [[1], [1, 2]], None), "allowed are whole numbers"
TRIANGLE, MOUTH, NAN = [(0, 0), (1, 0), (0, 1)], pv.Box((-5, 8), (5, 10)), float("nan")
STAR = [(np.sin(k * 0.8 * np.pi), np.cos(k * 0.8 * np.pi)) for k in range(5)]
BATH: dict[str, Any] = {"temperature": 1.0, "friction": 1.0, "seed": 0}
NO_COLOURS = ((1, 2), [(1, 2, 3, 4)], 7, (0, 0, 256), (0, 0, -1), ("a", "b", "c"), (0, 0, NAN))
NO_SIZES = ((0, 10), (10.5, 10), (10, 10, 10), 7, (1 << 20, 1 << 20))
BOOL = "allowed are True and False"
OF_WORLDS, OF_RAYS = ("events", "ledger", "contacts", "sleep"), ("particles", "obstacles", "walls")
WRONG: Any = 3
lib: Any = pv  # untyped, for arguments of wrong types
PLAIN: Any = pv.World()


def no_force(distance: Any, i: Any, j: Any) -> float:
    return 0.0


def still(x: Any, y: Any, vx: Any, vy: Any, mass: Any, t: Any) -> tuple[float, float]:
    return 0.0, 0.0


def two() -> pv.Group:
    return pv.World().add(position=[(0, 0), (1, 0)], radius=0.1)


def five() -> pv.Group:
    place = [(0, 0), (2, 0), (2, 2), (0, 2), (5, 5)]
    return pv.World().add(position=place, radius=0.5, fixed_rotation=[False] * 3 + [True, False])


def periodic() -> pv.World:
    """A room whose shorter period is 9 m."""
    return pv.World(boundary=pv.Periodic((0, 0), (12, 9)))


def roped(length: float) -> Any:
    two = periodic().add(position=[(0, 3), (1, 3)], radius=0.1)
    return two.world.links.append(pv.Rope(two, 0, 1, length=length))


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: lib.Drag(linear=-1), r"linear is -1; allowed is a finite number of at least 0"),
    (lambda: lib.Drag(linear=10**400), r"linear is too large for a float; allowed is a finite number of at least 0"),
    (lambda: lib.World().add(position=(0, 0), mass=10**400), r"mass is not an array of numbers"),
    (lambda: lib.Spring(two(), 0, 1, stiffness=10**400), r"Spring: stiffness is not an array of numbers"),
    (lambda: lib.Rope(two(), 0, 1, length=1.0, breaking_force=10**400), r"Rope: breaking_force is not an array of numbers"),
    (lambda: lib.World().add(position=(0, 0), radius=np.array(1 + 1j)), r"radius is not an array of numbers"),
    (lambda: lib.World().add(position=(0, 0), data=[1, 2]), r"data is \[1, 2\]; allowed is a dict"),
    *((lambda flag=flag: lib.World().add(position=(0, 0), fixed_rotation=flag), "fixed_rotation is .*; allowed are True and")
      for flag in ("x", 2, -1, 0.5)),
    (lambda: lib.Wind((1, NAN)), r"velocity is \(1.0, nan\)"),
    (lambda: lib.Attractor(strength=np.inf), r"strength is inf"),
    (lambda: lib.Gravitation(strength=1, softening=-1), r"softening is -1"),
    *((lambda theta=theta: lib.Gravitation(strength=1.0, theta=theta), "theta is") for theta in (-0.1, 1.5, NAN)),
    (lambda: lib.ConstantForce(WRONG), r"newtons is 3; allowed are two numbers"),
    (lambda: lib.Langevin(**BATH | {"temperature": -1}), "temperature is -1"),
    (lambda: lib.Langevin(**BATH | {"friction": NAN}), "friction is nan"),
    (lambda: lib.Langevin(**BATH | {"seed": -1}), "seed is -1"),
    (lambda: lib.pair_force(range=-1)(no_force), "range is -1"),
    (lambda: lib.pair_force(range=1, symmetric=False, potential=no_force)(no_force), "potential is .* not symmetric"),
    (lambda: lib.pair_force(range=1.0)(lambda x: x), "takes .x.; allowed are the arguments .distance, i, j."),
    (lambda: lib.LennardJones(epsilon=1, sigma=0), "sigma is 0"),
    (lambda: lib.Yukawa(strength=1, screening_length=1, cutoff=NAN), "cutoff is nan"),
    (lambda: lib.Cohesion(strength=-1, break_distance=1), "strength is -1"),
    (lambda: lib.Cohesion(strength=1, break_distance=0), "break_distance is 0"),
    # obstacles and rooms
    (lambda: lib.ClampAndFlip(lib.Open()), r"room is Open\(\); allowed"),
    (lambda: lib.ClampAndFlip(lib.Box((0, 0), (1, 1), friction=0.1)), r"friction of the room is 0.1; allowed is 0"),
    (lambda: lib.ProjectOnly(lib.Circle(radius=1, restitution=0.5)), r"restitution of the room is 0.5; allowed is 0"),
    (lambda: lib.World(boundary=lib.ClampAndFlip(lib.Circle(radius=1))).add(position=(0, 0), radius=2.0), r"radius\[0\] is 2 m"),
    (lambda: lib.Periodic((0, 0), (0, 4)), r"upper is \(0.0, 4.0\); allowed is a corner above and to the right of lower"),
    (lambda: lib.Periodic((0, 0), (4, 4), axes="z"), r"axes is 'z'; allowed are 'xy', 'x', 'y'"),
    (lambda: periodic().add(position=(0, 3), radius=2.3), r"radius\[0\] is 2.3 m; allowed is at most a quarter of the"),
    (lambda: roped(5.0), r"Rope: length\[0\] is 5 m; allowed is at most half a period of the room, 4.5 m"),
    (lambda: setattr(roped(4.0), "length", 4.6), r"Rope: length\[0\] is 4.6 m; allowed is at most half a period of the room"),
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
    (lambda: lib.Segment((0, 0), (1, 0), one_way=(0, 0)), r"one_way is \(0.0, 0.0\); allowed is a direction other than 0"),
    (lambda: lib.Segment((0, 0), (1, 0), one_way="up"), "one_way is 'up'; allowed are two"),
    (lambda: lib.Circle(radius=1, angular_velocity=NAN), "angular_velocity is"),
    (lambda: lib.Circle(radius=1, angular_velocity="fast"), "angular_velocity is"),
    # particles and their laws
    (lambda: lib.World().add(position=(0, 0), angle=NAN), r"angle\[0\]"),
    (lambda: lib.World().add(position=(0, 0), density=2.0, mass=1.0), r"density is 2.0 and mass is 1.0; allowed is one of them"),
    (lambda: lib.World().add(position=[(0, 0), (3, 0)], density=[1, -1]), r"density\[1\] is -1; allowed is a finite number gr"),
    *((lambda i=i: lib.World().add(position=(0, 0), inertia=i), r"inertia\[0\] is .* greater tha") for i in (0, -1, np.inf, NAN)),
    (lambda: lib.Collisions(combine="sum"), "combine is 'sum'; allowed are 'geometric', 'mean', 'min', 'max', 'multiply'"),
    (lambda: lib.Collisions(materials={"a": {}}), "materials has the key 'a'; allowed are two names, such as"),
    (lambda: lib.Collisions(materials=[1]), r"materials is \[1\]; allowed is a table"),
    (lambda: lib.Collisions(materials={("a", "b"): {"mass": 1}}), "allowed is a table of restitution, friction, rolling_resist"),
    (lambda: lib.Collisions(materials={("a", "b"): {"restitution": 2}}), r"restitution of \('a', 'b'\) is 2; allowed is a numb"),
    (lambda: lib.Collisions(combine=np.ones(2)), r"combine is array\(.*; allowed are 'geometric', 'mean'"),
    (lambda: lib.Collisions(materials={("a", "b"): {}, ("b", "a"): {}}), r"materials has \('b', 'a'\) twice; allowed is one"),
    (lambda: lib.World().add(position=(0, 0), on_overlap=np.ones(2)), "on_overlap is .*; allowed are 'push', 'skip', 'error'"),
    *((lambda name=name: lib.World(**{name: "no"}), f"{name} is 'no'; {BOOL}") for name in OF_WORLDS),
    *((lambda name=name: lib.World().ray((0, 0), (1, 0), **{name: 1}), f"{name} is 1; {BOOL}") for name in OF_RAYS),
    (lambda: lib.World().circle_cast((0, 0), (1, 0), "wide"), "radius is not an array of numbers"),
    (lambda: lib.World().overlap_area((0, 0), [[1], [1, 2]]), "radius is not an array of numbers"),
    (lambda: lib.Chain(TRIANGLE, closed="yes"), "closed is 'yes'; allowed are True and False"),
    (lambda: lib.soft_body(lib.World(), TRIANGLE, spacing=0.2, filled=2), "filled is 2; allowed are True and False"),
    (lambda: lib.Collisions(rolling_resistance=-1), "rolling_resistance is -1; allowed is a finite number of at least 0"),
    # worlds and what is added to them
    (lambda: lib.World().add(position=[(0, 0), (np.nan, 1)]), r"position\[1\].*nan.*finite"),
    (lambda: lib.World().add(position=(np.inf, 1)), r"position\[0\].*inf.*finite"),
    (lambda: lib.World().add(position=np.zeros((3, 3))), r"position.*\(3, 3\).*\(n, 2\)"),
    (lambda: lib.World().add(position=np.zeros((3, 2)), velocity=np.zeros((2, 2))), r"velocity.*\(2, 2\).*\(3, 2\)"),
    (lambda: lib.World().add(position=(0, 0), velocity=(0, np.nan)), r"velocity\[0\].*nan"),
    (lambda: lib.World().add(position=(0, 0), spin=np.nan), r"spin\[0\].*nan"),
    (lambda: lib.World().add(position=np.zeros((3, 2)), radius=[1, 2]), r"radius.*\(2,\).*\(3,\)"),
    (lambda: lib.World().add(position=(0, 0), radius=-0.5), r"radius\[0\] is -0\.5.*greater than 0"),
    (lambda: lib.World().add(position=(0, 0), radius=np.inf), r"radius\[0\] is inf.*finite"),
    (lambda: lib.World().add(position=(0, 0), mass=-1), r"mass\[0\] is -1.*greater than 0"),
    (lambda: lib.World().add(position=(0, 0), mass=np.nan), r"mass\[0\] is nan"),
    (lambda: lib.World().add(position="here"), r"position.*numbers"),
    (lambda: lib.World(boundary=lib.Circle(radius=1)).add(position=(0, 0), radius=[2.0]), r"radius\[0\] is 2 m.*cage, 1 m"),
    (lambda: lib.World(boundary=lib.Box((0, 0), (1, 9))).add(position=(0, 0), radius=0.6), r"radius\[0\] is 0\.6 m.*box, 0\.5 m"),
    (lambda: setattr(two().world, "boundary", lib.Circle(radius=0.05)), r"radius\[0\].*cage"),
    (lambda: lib.World(substeps=0), r"substeps is 0.*from 1 to 100000"),
    (lambda: lib.World(substeps=1.5), r"substeps is 1\.5.*whole"),
    (lambda: two().world.step(0), r"dt is 0.*greater than 0"),
    (lambda: two().world.step(-0.1), r"dt is -0\.1.*greater than 0"),
    (lambda: two().world.step(float("nan")), r"dt is nan.*finite"),
    (lambda: two().world.run(seconds=-1), r"seconds is -1.*at least 0"),
    (lambda: lib.World(threads=10_000), r"threads is 10000.*from 1 to.*cores"),
    (lambda: lib.World(gravity=(0, np.nan)), r"gravity.*nan.*finite"),
    (lambda: lib.World(gravity=9.81), r"gravity is 9\.81.*\(x, y\)"),
    (lambda: lib.World(dtype=np.int32), r"dtype is int32.*float32"),
    (lambda: lib.World(dtype="float16x"), r"dtype.*float16x.*float32"),
    (lambda: lib.World(integrator="rk4"), r"integrator is 'rk4'.*PositionVerlet\(\)"),
    (lambda: lib.World(boundary=5), r"boundary is 5.*Circle"),
    (lambda: lib.World(collisions=True), r"collisions is True.*None"),
    (lambda: lib.Collisions(restitution=1.5), r"restitution is 1\.5.*0 to 1"),
    (lambda: lib.Collisions(friction=-1), r"friction is -1.*at least 0"),
    (lambda: lib.Collisions(method="brute"), r"method is 'brute'.*BruteForce\(\)"),
    (lambda: lib.Circle(radius=0), r"radius is 0.*greater than 0"),
    (lambda: lib.Box((0, 0), (-1, 1)), r"upper is \(-1\.0, 1\.0\).*lower"),
    (lambda: lib.Box((0, 0), (1, 1), restitution=2), r"restitution is 2"),
    (lambda: lib.forces.Grip(-1, target=(0, 0)), r"particle is -1.*at least 0"),
    (lambda: lib.Clock(dt=0), r"dt is 0.*greater than 0"),
    (lambda: lib.Clock().advance(-1), r"elapsed is -1.*at least 0"),
    (lambda: lib.Fast(skin=-0.1), r"skin is -0\.1.*at least 0"),
    # questions
    (lambda: two().world.at_point((1, 2, 3)), r"points has shape \(3,\); allowed is \(n, 2\)"),
    (lambda: two().world.nearest((np.nan, 0)), r"points\[0\] is \(nan, 0.0\)"),
    (lambda: two().world.nearest((0, 0), 0), r"k is 0; allowed is a whole number of at least 1"),
    (lambda: two().world.in_box((0, 0), (-1, 1)), r"upper\[0\] is \(-1.0, 1.0\); allowed is a corner above"),
    (lambda: two().world.in_box(np.zeros((2, 2)), np.ones((3, 2))), r"upper has 3 rows; allowed are 1 or 2"),
    (lambda: two().world.in_circle((0, 0), -1), r"radius\[0\] is -1; allowed is a finite number of at least 0"),
    (lambda: two().world.ray((0, 0), (0, 0)), r"direction\[0\] is \(0.0, 0.0\); allowed is a direction other than 0"),
    (lambda: two().world.ray((0, 0), (1, 0), -2), r"length\[0\] is -2; allowed is a number of at least 0"),
    (lambda: two().world.circle_cast((0, 0), (1, 0), -1.0), r"radius\[0\] is -1; allowed is a finite number of at least 0"),
    (lambda: two().world.overlap_area((0, 0), np.nan), r"radius\[0\] is nan; allowed is a finite number of at least 0"),
    (lambda: two().world.is_free((0, np.inf), 1.0), r"position\[0\] is \(0.0, inf\); allowed are finite numbers"),
    (lambda: two().world.ray((0, 0), (1, 0), mask=-1), r"mask is -1; allowed are whole numbers of 32 bits"),
    (lambda: two().world.ray((0, 0), (1, 0), category=[1, 2]), r"category has shape \(2,\); allowed is one number or \(1,\)"),
    # links
    (lambda: lib.Stick(five(), 0, 9), r"Stick: j is 9; allowed is 0 to 4 for a group of 5 particles"),
    (lambda: lib.Stick(five(), [0, 7], [1, 2]), r"Stick: i\[1\] is 7; allowed is 0 to 4"),
    (lambda: lib.Rope(five(), 2, 2), r"Rope: i\[0\] and j\[0\] are the same particle, 2"),
    (lambda: lib.Rope(five(), 0.5, 2), r"Rope: i is 0.5; allowed is an index in the group"),
    (lambda: lib.Stick(five(), [0, 1, 2], [1, 2]), r"Stick: i has 3 and j has 2 indices; allowed are equally many"),
    (lambda: lib.Stick(five(), 0), r"Stick was given \(.*\); allowed are \(group, i, j\) or \(\(group_a, i\), \(group_b, j\)\)"),
    (lambda: lib.Stick(0, 1, 2), r"Stick was given \(0, 1, 2\)"),
    (lambda: lib.Stick((five(), 0), (3, 1)), r"Stick: the group of j is 3; allowed is what world.add returns"),
    (lambda: lib.Stick(five(), 0, 1, compliance=-1.0), r"Stick: compliance is -1; allowed is a finite number of at least 0"),
    (lambda: lib.Stick(five(), 0, 1, compliance=np.nan), r"Stick: compliance is nan"),
    (lambda: lib.Spring(five(), 0, 1, stiffness=-5.0), r"Spring: stiffness is -5; allowed is a finite number of at least 0"),
    (lambda: lib.Spring(five(), 0, 1, stiffness=np.inf), r"Spring: stiffness is inf"),
    (lambda: lib.Spring(five(), 0, 1, stiffness=1.0, damping=-1.0), r"Spring: damping is -1"),
    (lambda: lib.Rope(five(), [0, 1], [1, 2], length=[1.0, -1.0]), r"Rope: length\[1\] is -1; allowed is a finite number"),
    (lambda: lib.Rope(five(), 0, 1, length="long"), r"Rope: length is not an array of numbers"),
    (lambda: lib.Rope(five(), [0, 1], [1, 2], length=[1.0, 1.0, 1.0]), r"Rope: length has shape \(3,\)"),
    (lambda: lib.Stick(five(), 0, 1, breaking_force=0.0), r"Stick: breaking_force is 0; allowed is a number greater than 0"),
    (lambda: lib.Stick(five(), 0, 1, collide="no"), r"Stick: collide is 'no'; allowed are True and False"),
    (lambda: lib.Pin(five(), 8), r"Pin: i is 8; allowed is 0 to 4"),
    (lambda: lib.Pin(five(), 0, point=(0, np.nan)), r"Pin: point\[0\] is \(0.0, nan\); allowed are finite numbers"),
    (lambda: lib.Angle(five(), 0, 1, 0), r"Angle: i\[0\] and k\[0\] are the same particle, 0"),
    (lambda: lib.Angle(five(), 0, 1, 2, angle=np.inf), r"Angle: angle is inf; allowed is a finite number of radians"),
    (lambda: lib.Area(five(), [0, 1]), r"Area: ring has 2 particles; allowed are at least 3"),
    (lambda: lib.Area(five(), [0, 1, 1]), r"Area: ring has a particle twice"),
    (lambda: lib.Area(five(), [0, 2, 1, 3]), r"the ring crosses itself, its sides 0 and 2 meet; allowed is a simple polygon"),
    (lambda: lib.Area(five(), [0, 1, 2, 3], area=-1.0), r"Area: area is -1"),
    (lambda: lib.Motor(five(), 0, max_torque=1.0, speed=np.inf), r"Motor: speed is inf; allowed is a finite number of rad/s"),
    (lambda: lib.Motor(five(), 0, max_torque=-1.0, speed=1.0), r"Motor: max_torque is -1"),
    (lambda: lib.Motor(five(), 0, 1, 1, max_torque=1.0, speed=1.0), r"Motor: j\[0\] and k\[0\] are the same particle, 1"),
    (lambda: lib.Motor(five(), 3, max_torque=1.0, speed=1.0), r"Motor: particle 3 has fixed_rotation; allowed is one that can"),
    (lambda: lib.Motor(five(), 0, 1, 2, 3, max_torque=1.0, speed=1.0), r"Motor was given"),
    (lambda: lib.Motor(five(), max_torque=1.0, speed=1.0), r"Motor was given"),
    (lambda: lib.AngleLimit(five(), 0, 1, 2, least=1, most=0.5), r"AngleLimit: most\[0\] is 0.5, least\[0\] 1; allowed is"),
    (lambda: lib.AngleLimit(five(), 0, 1, 2, least=0.0, most=6.3), r"AngleLimit: most\[0\] is 6.3"),
    (lambda: lib.AngleLimit(five(), 0, 1, 2, least=NAN, most=6.3), r"AngleLimit: least is nan; allowed is a finite number"),
    # emitters and sinks
    (lambda: lib.Emitter(MOUTH, rate=1, density=1, mass=2), "density is 1 and mass is 2"),
    (lambda: lib.Emitter(lib.Open(), rate=1), r"region is Open\(\); allowed is a pyverlet.Box or a pyverlet.Circle"),
    (lambda: lib.Emitter(MOUTH, rate=-1), r"rate is -1"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=0), r"radius is 0; allowed is a finite number greater than 0"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=(2, 1)), r"radius is 1; allowed is a finite number of at least 2"),
    (lambda: lib.Emitter(MOUTH, rate=1, radius=3), r"radius\[0\] is 3 m; allowed is at most .* 1 m"),
    (lambda: lib.Emitter(MOUTH, rate=1, most=-1), r"most is -1"),
    (lambda: lib.Sink(WRONG), r"region is 3; allowed is an object such as"),
    # groups and what belongs together
    *((lambda which=which: lib.World().index_of(which), f"numbers is .*; {WHOLE}") for which in NO_NUMBERS),
    *((lambda which=which: lib.World().group_of(which), f"numbers is .*; {WHOLE}") for which in NO_NUMBERS),
    *(
        (lambda make=make, group=group: make(group), r"^group is .*; allowed is what `add` has returned")
        for group in (3, pv.World(), "water")
        for make in (
            lambda group: lib.Fluid(group, rest_density=1, stiffness=1), lambda group: lib.Gravitation(group, strength=1),
            lambda group: lib.PointSpring(group, stiffness=1), lambda group: lib.ConstantForce((1, 0), group=group),
        )
    ),
    (lambda: lib.World().forces.append(pv.LennardJones), r"^force is <class .*LennardJones.>; allowed is an object with a me"),
    (lambda: lib.World().obstacles.append(pv.Circle(radius=3)), r"obstacle is a Circle; allowed is an object such as .*Disc"),
    (lambda: lib.World().ledger, r"allowed is a world built with World\(ledger=True\)"),
    (lambda: PLAIN.contacts, r"allowed is a world built with World\(contacts=True\)"),
    (lambda: PLAIN.pressure(), r"allowed is a world built with World\(contacts=True\)"),
    (lambda: PLAIN.force_on(PLAIN.boundary), r"allowed is a world built with World\(contacts=True\)"),
    (lambda: lib.World(contacts=True).force_on(pv.Segment((0, 0), (1, 0))), "allowed is an obstacle of this world, or its bound"),
    (lambda: lib.World(contacts=True).pressure(), "to have a pressure"),
    (lambda: lib.contact_rule(3), "function is 3; allowed is a function of the world and its new contacts"),
    (lambda: lib.World().events, r"allowed is a world built with World\(events=True\)"),
    (lambda: setattr(lib.World(events=True).events, "hit_speed", -1), "hit_speed is -1; allowed is a finite number of at least"),
    (lambda: lib.Stick((two(), 0), (two(), 1)), "Stick joins groups of different worlds"),
    (lambda: two().world.links.append(lib.Stick(two(), 0, 1)), "Stick x 1 joins particles of another world"),
    (lambda: (pair := two()).world.links.remove(lib.Stick(pair, 0, 1)), "is not among this world's links"),
    (lambda: (pair := two()).world.links.extend([lib.Stick(pair, 0, 1)] * 2), "is in a world already"),
    (lambda: lib.World().links.append(3), "link is 3; allowed is an object such as"),
    (lambda: setattr(lib.World().links, "iterations", 0), "iterations is 0"),
    (lambda: two().pin(3), "index is 3; allowed are indices of this group's 2 particles"),
    # pictures
    *((lambda rgb=rgb: lib.picture.Fixed(rgb), "rgb.*allowed") for rgb in NO_COLOURS),
    (lambda: lib.picture.Fixed([(1, 2, 3)]).colours(two().world, pv.picture.DARK), "rgb has 1 rows; allowed are 2"),
    (lambda: lib.picture.Groups(two(), 3), r"groups\[1\] is 3; allowed is what world.add returns"),
    *((lambda x=x: lib.picture.View.fit((x[0], 0, x[1], 1), (10, 10)), "allowed") for x in ((0, 0), (1, 0), (0, NAN))),
    *((lambda size=size: lib.picture.Raster(size), "allowed") for size in NO_SIZES),
    (
        lambda: lib.picture.Raster((64, 48)).draw(pv.World(), pv.picture.View(0, 0, 1, 100, 80), colours=np.zeros(0, np.uint32)),
        r"100 x 80 pixels; allowed is this raster's \(64, 48\)",
    ),
    # worlds together
    (lambda: lib.World().restore(pv.World().save()), "saved is the state of another world"),
    (lambda: lib.Panels([]), "panels is empty"),
    (lambda: lib.force(lambda x, y: (x, y)), r"force '<lambda>' \(.*, line \d+\) takes \(x, y\); allowed are .* \(x, y, vx"),
    (lambda: lib.force(3), "force is 3; allowed is a function of"),
    (lambda: lib.force(potential=lambda x, y: x)(still), r"potential '<lambda>' .* takes \(x, y\); allowed are .*\(x, y, mass\)"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_arguments_that_cannot_be_get_one_sentence(make: Callable[[], object], says: str) -> None:
    with pytest.raises(pv.InputError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)


WRITTEN = [
    *((name, value) for name in ("radius", "mass", "inertia") for value in (-1.0, NAN)),
    *((name, value) for name in ("restitution", "friction", "rolling_resistance") for value in (np.inf, NAN)),
    ("radius", 0.0), ("radius", np.inf), ("mass", 0.0), ("inertia", np.inf), ("restitution", 2.0),
]  # fmt: skip


@pytest.mark.parametrize("all_have_it", [False, True])
@pytest.mark.parametrize(("name", "value"), WRITTEN)
def test_what_no_particle_may_have_is_refused_until_it_is_mended(name: str, value: float, all_have_it: bool) -> None:
    world = pv.World(collisions=pv.Collisions(friction=0.3))
    group = world.add(position=[(0, 0), (0.9, 0.3)], radius=0.5)
    world.step(1 / 60)
    before, good = world.state_hash(), getattr(group, name).copy()
    if all_have_it:
        setattr(group, name, value)
    else:
        getattr(world, name)[1] = value
    for _ in range(2):
        refused(rf"^{name}\[{0 if all_have_it else 1}\] is {value:g}; allowed is a", world.step, 1 / 60)
    setattr(group, name, good)
    assert world.state_hash() == before
    world.step(1 / 60)


# ---- Rooms and shapes ----

ROOMS: dict[str, Callable[[], Any]] = {
    "box": lambda: lib.Box((0, 0), (9, 9)), "circle": lambda: lib.Circle(radius=9),
    "periodic": lambda: lib.Periodic((0, 0), (9, 9)), "channel": lambda: lib.Periodic((0, 0), (9, 9), axes="x"),
}  # fmt: skip
SET: list[tuple[str, str, Any, str]] = [
    ("box", "upper", (-1, 5), r"upper is \(-1.0, 5.0\); allowed is a corner above and to the right of lower, \(0.0, 0.0\)"),
    ("box", "lower", (5, 9), r"lower is \(5.0, 9.0\); allowed is a corner below and to the left of upper, \(9.0, 9.0\)"),
    ("box", "upper", (NAN, 9), "upper is .*; allowed are two finite numbers"), ("box", "lower", 3, "lower is 3; allowed are two"),
    ("circle", "radius", -1, "radius is -1; allowed is a finite number greater than 0"), ("circle", "radius", NAN, "radius is"),
    ("circle", "radius", "a", "radius is 'a'; allowed"), ("circle", "center", 3, "center is 3; allowed are two numbers"),
    ("circle", "angular_velocity", NAN, "angular_velocity is nan; allowed"),
    *((room, name, value, f"{name} of a periodic room cannot be set; allowed is another room, world.boundary = ")
      for room in ("periodic", "channel") for name, value in (("upper", (5, 5)), ("lower", (-5, -5)), ("axes", "y"))),
]  # fmt: skip


@pytest.mark.parametrize(("room", "name", "value", "says"), SET)
def test_rooms_are_checked_when_they_are_set(room: str, name: str, value: Any, says: str) -> None:
    made = ROOMS[room]()
    before = getattr(made, name)
    refused(says, setattr, made, name, value)
    assert getattr(made, name) == before


def test_a_room_that_is_set_is_another() -> None:
    box, circle = ROOMS["box"](), ROOMS["circle"]()
    box.upper, box.lower, circle.radius, circle.center = [5, 6], (-1, -1), "2", np.array([1, 1])
    assert box.extent() == (-1.0, -1.0, 5.0, 6.0)
    assert circle.extent() == (-1.0, -1.0, 3.0, 3.0)


# ---- What a world refuses leaves it as it was ----


def three() -> pv.World:
    """Three particles with an array of their own and an obstacle, in a box."""
    world = pv.World(boundary=pv.Box((-20, -20), (20, 20)))
    world.obstacles.append(pv.Disc((5, 5), 1.0))
    world.add(position=[(0, 0), (2, 0), (4, 0)])
    world.data["row"] = np.arange(6.0).reshape(3, 2)
    return world


def fit(world: pv.World, position: Any) -> pv.Group:
    return world.add(position=position, on_overlap="error")


ONE = "allowed is one value for all, or "
INSIDE: list[tuple[Callable[[Any], object], str]] = [
    (lambda w: w.add(position=[(9, 9), (2, np.nan)]), r"position\[1\] is \(2.0, nan\)"),
    # on top of others
    (lambda w: fit(w, [(9, 9), (0.3, 0)]), r"position\[1\] is \(0.3, 0\) m, on top of particle 0; allowed are free places"),
    (lambda w: fit(w, [(9, 9), (8.5, 9)]), r"position\[1\] is \(8.5, 9\) m, on top of position\[0\]; allowed are free"),
    (lambda w: fit(w, (5, 5)), r"position\[0\] is \(5, 5\) m, inside the Disc .*, and all with on_overlap='push'"),
    (lambda w: fit(w, (30, 5)), r"position\[0\] is \(30, 5\) m, outside the room"),
    (lambda w: w.add(position=(9, 9), on_overlap="shove"), r"on_overlap is 'shove'; allowed are 'push', 'skip', 'error'"),
    # made of what is none
    (lambda w: w.add(position=(9, 9), restitution=1.5), r"^restitution\[0\] is 1.5; allowed is a number from 0 to 1$"),
    (lambda w: w.add(position=(9, 9), restitution=NAN), r"^restitution\[0\] is nan; allowed is a number from 0 to 1$"),
    (lambda w: w.add(position=(9, 9), friction=-0.1), r"^friction\[0\] is -0.1; allowed is a finite number of at least 0$"),
    (lambda w: w.add(position=(9, 9), mask=2**32), r"^mask is 4294967296; allowed are whole numbers of 32 bits, 0 to 429"),
    (lambda w: w.add(position=(9, 9), category=0.5), r"^category is 0.5; allowed are whole numbers of 32 bits, 0 to 42949672"),
    (lambda w: w.add(position=(9, 9), mask=[1, 2, 3]), r"^mask has shape \(3,\); allowed is one number or \(1,\), one for each"),
    # moved
    (lambda w: w.groups[0].move_to([(1, 1), (2, 2)]), r"position has shape \(2, 2\); allowed is \(2,\), for their centre, or"),
    (lambda w: w.groups[0].move_to("there"), r"position is not an array of numbers"),
    (lambda w: w.groups[0].move_to((NAN, 0)), r"position\[0\] is \(nan, 0.0\); allowed are finite numbers"),
    (lambda w: w.groups[0].move_to((30, 0)), r"position\[0\] is \(28, 0\) m, outside the room, Box"),
    (lambda w: w.groups[0].move_to([(0, 3), (5, 5.2), (9, 9)]), r"position\[1\] is .* m, inside the Disc .*, and any for pinned"),
    # removed
    (lambda w: w.groups[0].remove(3), r"which has 3; allowed are whole numbers from 0 to 2, or 3 bools"),
    (lambda w: w.remove(-1), r"which has -1; allowed are whole numbers from 0 to 2"),
    (lambda w: w.remove(0.5), r"which is 0.5; allowed are whole numbers"),
    (lambda w: w.remove(np.ones(7, bool)), r"which is .*; allowed are whole numbers from 0 to 2, or 3 bools"),
    (lambda w: w.groups[0].remove("first"), r"which is 'first'; allowed"),
    # arrays of the user's own
    (lambda w: w.data.update(age=[1, 2]), rf"data\['age'\] has shape \(2,\); {ONE}\(3,\) or \(n, k\)"),
    (lambda w: w.data.update(age=np.zeros((3, 2, 2))), r"data\['age'\] has shape \(3, 2, 2\); allowed is one value"),
    (lambda w: w.data.update(row=np.zeros((3, 4))), rf"data\['row'\] has shape \(3, 4\); {ONE}\(3, 2\)"),
    (lambda w: w.data.update(row=[1, 2, 3]), rf"data\['row'\] has shape \(3,\); {ONE}\(3, 2\)"),
    (lambda w: w.data.update(age=[[1], [1, 2], 3]), r"data\['age'\] is no array; allowed is one value for all"),
    (lambda w: w.data.update(row="red"), r"data\['row'\] is <U3; allowed is what goes together with float64"),
    (lambda w: w.data.update(row=np.datetime64("2024-01-01")), r"data\['row'\] is datetime64\[D\]; allowed is what goes"),
    (lambda w: w.data.__setitem__(3, 1), r"name is 3; allowed is a text"),
    (lambda w: w.data.__setitem__("", 1), r"name is ''; allowed is a text"),
    (lambda w: w.data["rwo"], r"data has no 'rwo' \(did you mean 'row'\?\); there are 'row', and world.data\['rwo'\] = "),
    (lambda w: w.data[:2], r"data has no slice\(None, 2, None\); there are 'row'"),
    (lambda w: w.data.pop("age"), r"data has no 'age'"),
    (lambda w: w.groups[0].data.update(age=1), r"data has no 'age'; there are 'row'"),
    (lambda w: w.groups[0][1:].data.update(row=np.zeros((3, 2))), rf"has shape \(3, 2\); {ONE}\(2, 2\)"),
    (lambda w: w.add(position=(0, 9), data={"age": 1}), r"data has no 'age'"),
    (lambda w: w.add(position=(0, 9), data={"row": [1, 2, 3]}), rf"has shape \(3,\); {ONE}\(1, 2\)"),
    # what is built in it
    (lambda w: lib.chain(w, (0, 0), (0, 0)), r"end is \(0.0, 0.0\), where start is; allowed is another point"),
    (lambda w: lib.chain(w, (0, 0), (1, np.nan)), r"end is \(1.0, nan\); allowed are two finite numbers"),
    (lambda w: lib.chain(w, (0, 0), (1, 0), links=0), r"links is 0; allowed is a whole number of at least 1"),
    (lambda w: lib.chain(w, (0, 0), (1, 0), mass=-1), r"mass is -1"),
    (lambda w: lib.rope(w, (0, 0), (5, 0), length=4), r"length is 4 m; allowed is at least the distance from start to end, 5 m"),
    (lambda w: lib.bridge(w, (0, 0), (5, 0), slack=-0.1), r"slack is -0.1"),
    (lambda w: lib.net(w, (0, 0), width=0, height=1), r"width is 0; allowed is a finite number greater than 0"),
    (lambda w: lib.cloth(w, (0, 0), width=1, height=1, rows=1), r"rows is 1; allowed is a whole number of at least 2"),
    (lambda w: lib.cloth(w, (0, 0), width=1, height=1, shear=-1), r"shear is -1"),
    (lambda w: lib.soft_body(w, [(0, 0), (1, 1), (1, 0), (0, 1)], spacing=0.1), r"outline crosses itself, its sides 0 and 2 me"),
    (lambda w: lib.soft_body(w, [(0, 0), (1, 1)], spacing=0.1), r"outline has 2 corners; allowed are at least 3"),
    (lambda w: lib.soft_body(w, [(0, 0), (1, 1), (2, 2)], spacing=0.1), r"outline "),
    (lambda w: lib.soft_body(w, pv.builders.disc((0, 0), 1), spacing=3), r"spacing is 3 m; allowed is less"),
    (lambda w: lib.soft_body(w, pv.builders.disc((0, 0), 1), spacing=0.1, stiffness=-2), r"stiffness is -2"),
    (lambda w: lib.soft_body(w, pv.builders.disc((0, 0), 1), spacing=0.1, bulk=-2), r"bulk is -2"),
    (lambda w: lib.builders.box((1, 0), (0, 1)), r"upper is \(0.0, 1.0\); allowed is a corner above"),
]  # fmt: skip


@pytest.mark.parametrize(("act", "says"), INSIDE, ids=[says for _, says in INSIDE])
def test_what_is_refused_changes_nothing(act: Callable[[pv.World], object], says: str) -> None:
    world, same = three(), three()
    refused(says, act, world)
    assert world.state_hash() == same.state_hash()
    assert (len(world), len(world.links), list(world.data)) == (3, 0, ["row"])
    assert world.data["row"].dtype == np.float64
    assert world.data["row"].tolist() == same.data["row"].tolist()


# ---- What is set later is checked as what an object is made with ----


def settable(thing: Any) -> list[str]:
    """Names of its checked attributes."""
    return [name for kind in type(thing).__mro__ for name, held in vars(kind).items() if isinstance(held, Checked)]


MADE: list[Any] = [
    pv.Drag(), pv.Wind((1, 0)), pv.ConstantForce((1, 0)), pv.PointSpring(stiffness=1), pv.Attractor(strength=1),
    pv.Gravitation(strength=1), pv.Langevin(**BATH), pv.Fluid(rest_density=1, stiffness=1), pv.LennardJones(epsilon=1, sigma=1),
    pv.Yukawa(strength=1, screening_length=1), pv.SoftRepulsion(strength=1, range=1), pv.Cohesion(strength=1, break_distance=1),
    pv.forces.Grip(0, target=(0, 0)), pv.forces.Push(center=(0, 0), radius=1, acceleration=1), pv.pair_force(range=1)(no_force),
    pv.Emitter(MOUTH, rate=1), pv.Sink(MOUTH), pv.Clock(), MOUTH, pv.Disc((0, 0), 1),
]  # fmt: skip


@pytest.mark.parametrize("thing", MADE, ids=lambda thing: type(thing).__name__)
def test_what_is_set_is_checked(thing: Any) -> None:
    results = {"emitted", "removed", "dropped", "seam"}
    assert set(getattr(thing, "_shows", ())) - results <= set(settable(thing))
    for name in settable(thing):
        before = getattr(thing, name)
        for value in (NAN, np.inf, object(), (1.0, 2.0, 3.0), -1):
            if value != -1 or type(before) is not float:  # which some may be
                refused(f"^{name} .*allowed", setattr, thing, name, value)


ARRAYS: list[tuple[str, Any]] = [
    *((name, value) for name in ("position", "velocity", "radius", "mass", "angle") for value in ("a", [1, 2, 3, 4], 1j)),
    *((name, value) for name in ("category", "mask", "fixed_rotation") for value in (NAN, -1, 1.5, "a", [1, 2, 3, 4])),
    *((name, 1e39) for name in ("mass", "radius", "position")),
    ("angle", NAN),
    ("fixed_rotation", 2),
]


@pytest.mark.parametrize(("name", "value"), ARRAYS)
def test_arrays_of_particles_are_checked_when_they_are_set(name: str, value: Any) -> None:
    world = three()
    for of in (world, world.groups[0], world.groups[0][1]):
        refused(rf"^{name} (is|has) .*; allowed (is|are) ", setattr, of, name, value)
    world.step(0.01)


def test_numbers_beyond_single_precision_are_no_infinity() -> None:
    refused("mass is too large for float32; allowed are numbers up to", pv.World().add, position=(0, 0), mass=1e39)
    assert pv.World(dtype=np.float64).add(position=(0, 0), mass=[1e39]).mass == [1e39]


def test_a_room_that_has_become_too_small_is_refused_until_it_is_mended() -> None:
    world = pv.World(boundary=pv.Box((-5, -5), (5, 5)))
    world.add(position=(0, 0), radius=0.5)
    world.step(0.01)
    world.boundary.upper = (-4.5, 5)  # type: ignore[attr-defined]
    refused(r"radius\[0\] is 0.5 m; allowed is at most half the shorter side", world.step, 0.01)
    world.boundary.upper = (5, 5)  # type: ignore[attr-defined]
    world.step(0.01)


def test_a_moving_obstacle_is_of_one_world() -> None:
    lift, (first, second) = pv.Segment((0, 0), (1, 0), velocity=(0, 1)), (pv.World(), pv.World())
    first.obstacles.append(lift)
    refused("moves, and is one of another world", second.obstacles.append, lift)
    second.obstacles.append(copy.copy(lift))
    first.obstacles.remove(lift)
    second.obstacles.append(lift)


def test_a_hand_holds_a_particle_that_there_is() -> None:
    world = three()
    hand = world.forces.append(pv.forces.Grip(7, target=(0, 0)))
    refused("particle of a Grip is 7; allowed is a whole number from 0 to 2", world.step, 0.01)
    hand.particle = 2
    world.step(0.01)


# ---- What needs a package that is not installed says which command brings it ----


def shot(name: str) -> None:
    pv.record.to_video(pv.World(), name, size=(160, 120))


NEEDS: list[tuple[str, Callable[[], object], str]] = [
    ("av", lambda: shot("a.mp4"), "record"),
    *(("PIL", lambda name=name: shot(name), "record") for name in ("a.gif", "a.png", "f{}.png")),
    *((module, lambda: pv.widget(pv.World()), "notebook") for module in ("anywidget", "PIL")),
    ("pygame", lambda: Window(pv.World()), "window"),
    ("matplotlib", lambda: check_can_plot(Path("y.png")), "plot"),
]  # fmt: skip


@pytest.mark.parametrize(("missing", "act", "extra"), NEEDS)
def test_a_missing_extra_names_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str, act: Callable[[], object], extra: str
) -> None:
    find = importlib.util.find_spec
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *rest: None if name == missing else find(name, *rest))
    refused(rf"'{missing}'.*pip install 'pyverlet\[{extra}\]'", act)
