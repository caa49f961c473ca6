"""Worlds in which something of each kind moves, each built alike whenever it is asked for; what tests lay out and measure."""

import copy
import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.state.sorted_state import SortedState

G, FRAME, H = 9.81, 1 / 60, 1 / 480
"""m/s^2; s, and that of a substep as worlds are by themselves."""

RECORDING = {"events": True, "contacts": True, "ledger": True}


def points(x: Any, y: Any) -> Any:
    """(len(x) * len(y), 2) m: every x at the first y, then at the next."""
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def each_frame(world: pv.World | pv.Panels, lengths: int | Iterable[float], dt: float = 1 / 60) -> Iterator[int]:
    """Step a world by so many frames of dt, or by frames of these lengths: the number of each, from 0, once it is over."""
    for number, length in enumerate([dt] * lengths if isinstance(lengths, int) else lengths):
        world.step(float(length))
        yield number


def worst_rise(world: pv.World, lengths: int | Iterable[float], dt: float = 1 / 60) -> float:
    """The largest rise of energy in a frame, J."""
    return float(np.diff([world.energy().total, *(world.energy().total for _ in each_frame(world, lengths, dt))]).max())


def bits_after(world: pv.World, seconds: float, dt: float = 1 / 60) -> str:
    """The hash of a world that goes on for so long."""
    world.run(seconds=seconds, dt=dt)
    return world.state_hash()


def refused(says: str, ask: Callable[..., object], *given: Any, **named: Any) -> None:
    """Asked so, it is refused in a sentence that matches."""
    with pytest.raises(pv.InputError, match=says):
        ask(*given, **named)


def forces_of(law: Any, world: pv.World) -> Any:
    """(n, 2) N of a force alone, in the user's order."""
    sorted_state = SortedState(world.dtype)
    sorted_state.gather(world._state)
    law.apply(sorted_state, 0.0)
    out = np.empty_like(sorted_state.force)
    out[sorted_state.particle] = sorted_state.force
    return out.astype(float)


def pull_of(energy: Callable[[], float], world: pv.World, particle: int, step: float = 1e-6) -> Any:
    """(2,) N, minus the slope of an energy along the place of a particle: central differences, off by step^2 / 6 of its bend."""
    sides = np.zeros((2, 2))
    for axis, way in np.ndindex(2, 2):
        shift = (step, -step)[way]
        world.position[particle, axis] += shift
        sides[axis, way] = energy()
        world.position[particle, axis] -= shift
    return (sides[:, 1] - sides[:, 0]) / (2 * step)


def grid(columns: int, rows: int, spacing: float, lower: tuple[float, float], *, loose: float = 0.02) -> Any:
    """(columns * rows, 2) m: a grid whose left lower corner is there, shaken by up to `loose`."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    place = np.array(lower) + spacing * np.column_stack((x.ravel(), y.ravel()))
    return place + np.random.default_rng(5).uniform(-loose, loose, place.shape)


def world_with(*obstacles: pv.Obstacle, **options: Any) -> pv.World:
    """A world of doubles with these obstacles."""
    world = pv.World(**{"dtype": np.float64, "threads": 1, **options})
    world.obstacles.extend(obstacles)
    return world


def empty(*forces: Any, **options: Any) -> pv.World:
    """A world of doubles with these forces, without gravity and collisions."""
    world = pv.World(**{"gravity": (0, 0), "collisions": None, "dtype": np.float64} | options)
    world.forces += forces
    return world


def slope(angle: float, *, friction: float = 2.0, rolling_resistance: float = 0.0, **options: Any) -> pv.World:
    """A rough floor under gravity that is turned by `angle`: a ledger of what rolls down to the right, or up to the left."""
    room = pv.Box((-1000, 0), (1000, 50), friction=friction, rolling_resistance=rolling_resistance)
    gravity = (G * np.sin(angle), -G * np.cos(angle))
    return pv.World(**{"boundary": room, "gravity": gravity, "dtype": np.float64, "ledger": True, **options})


def of_ones_own(room: Any) -> Any:
    """A room as one of a user's own, whose walls are the library's: it counts how often it is `asked` to confine."""
    kind = type(room)

    class Own(kind):  # type: ignore[misc,valid-type]
        asked = 0

        def confine(self, *about: Any) -> None:
            kind.confine(self, *about)
            self.asked += 1

    room.__class__ = Own
    return room


def linked_rows(group: pv.Group, number: Any, kind: str, every: int = 4) -> None:
    """Links in every so many rows of a grid of particles, (rows, columns) their numbers: pairs, whole chains, or ropes."""
    if kind == "dumb-bells":
        group.world.links.append(pv.Stick(group, number[::every, :-1:4].ravel(), number[::every, 1::4].ravel()))
    elif kind:
        link = pv.Stick if kind == "chains" else pv.Rope
        group.world.links.append(link(group, number[::every, :-1].ravel(), number[::every, 1:].ravel()))


def on_ground(kind: str, *, large: float = 1.0, **options: Any) -> tuple[pv.World, float]:
    """A world with one surface made of what else is given, and how high its top is: level, or round with a radius `large`."""
    own = {name: options.pop(name) for name in ("restitution", "friction", "rolling_resistance", "material") if name in options}
    room: pv.Boundary = pv.Box((-100, 0), (100, 90), **(own if kind == "wall" else {}))
    if kind == "channel":
        room = pv.Periodic((-100, 0), (100, 90), axes="x", **own)
    world, top = world_with(**{"boundary": room, **options}), 0.0 if kind in ("wall", "channel") else 5.0
    if kind == "segment":
        world.obstacles.append(pv.Segment((-99, top), (99, top), **own))
    elif kind == "polygon":
        world.obstacles.append(pv.Polygon([(-99, top - 1), (99, top - 1), (99, top), (-99, top)], **own))
    elif kind == "disc":
        world.obstacles.append(pv.Disc((0, top - large), large, **own))
    elif kind == "pinned":
        world.add(position=(0, top - large), radius=large, mass=np.inf, **own)
    return world, top


def rolling(**options: Any) -> pv.World:
    """Rough discs of all sizes and masses, some with an inertia of their own, that resist rolling."""
    chance = np.random.default_rng(2)
    law = pv.Collisions(friction=0.5, restitution=0.2, rolling_resistance=0.1)
    world = pv.World(boundary=pv.Box((0, 0), (21, 60), friction=0.5), collisions=law, **options)
    group = world.add(
        position=grid(19, 16, 1.05, (0.6, 0.6)), radius=0.5 * 3 ** -chance.random(304), mass=1000 ** chance.random(304)
    )
    group.inertia[::7] = 0.1 * group.mass[::7]
    return world


def crowded(**options: Any) -> pv.World:
    """Discs on top of each other, which are pushed apart, and whose surplus of energy is taken back."""
    world = pv.World(boundary=pv.Circle(radius=14), **options)
    world.add(position=np.random.default_rng(1).uniform(-7, 7, (320, 2)), radius=0.5)
    return world


def machine(**options: Any) -> pv.World:
    """A heap in a funnel over a turning paddle, with pinned discs and a polygon in it."""
    law = pv.Collisions(restitution=0.3, friction=0.3)
    world = pv.World(boundary=pv.Box((-6, -4), (6, 20)), collisions=law, **options)
    world.obstacles += [
        pv.Chain([(-6, 6), (-0.8, 1), (0.8, 1), (6, 6)], friction=0.4),
        pv.Polygon([(-2, 3), (-1, 3), (-1.5, 4)], restitution=0.5, friction=0.2, velocity=(0.5, 0)),
        pv.Capsule((-1.5, 0), (1.5, 0), radius=0.2, angular_velocity=3, pivot=(0, 2.5), friction=0.5),
    ]
    world.add(position=[(-3, 6.5), (3, 6.5)], radius=0.3).pin()
    world.add(position=grid(16, 12, 0.53, (-4, 7)), radius=0.25)
    return world


def one_way(**options: Any) -> pv.World:
    """A heap on a line that others pass from below."""
    chance = np.random.default_rng(3)
    law = pv.Collisions(restitution=0.2, friction=0.4)
    world = pv.World(boundary=pv.Box((-2.5, -30), (2.5, 30)), collisions=law, **options)
    world.obstacles.append(pv.Chain([(-3, 0.4), (-1, 0), (1, 0.1), (3, 0.4)], one_way=(0, 1), friction=0.4))
    world.add(position=grid(9, 8, 0.5, (-2.1, 0.5)), radius=0.02 * 10 ** chance.random(72), density=1.0)
    below = np.column_stack((np.linspace(-2, 2, 9), np.full(9, -0.8)))
    world.add(position=below, velocity=np.column_stack((np.zeros(9), chance.uniform(2, 9, 9))), radius=0.1)
    return world


def linked(**options: Any) -> pv.World:
    """Links of every kind over a floor: a net, one rope of which tears, a soft pin, a ring, a beam."""
    world = pv.World(boundary=pv.Box((-2, -1), (9, 6), friction=0.3), collisions=pv.Collisions(), **options)
    n = np.arange(20).reshape(4, 5)
    net = world.add(position=0.3 * np.column_stack((n.ravel() % 5, n.ravel() // 5)), radius=0.1, mass=1.0)
    world.links.append(pv.Stick(net, n[:, :-1].ravel(), n[:, 1:].ravel()))
    world.links.append(pv.Spring(net, n[:-1].ravel(), n[1:].ravel(), stiffness=300.0, damping=1.0))
    world.links.append(pv.Pin(net, 19, compliance=1e-3, damping=20.0))
    ring = world.add(position=[(2, 0), (2.3, 0), (2.3, 0.4), (2, 0.3)], velocity=(1, 2), radius=0.1, mass=0.5)
    world.links.append(pv.Area(ring, compliance=1e-3))
    world.links.append(pv.Rope(ring, [0, 1, 2, 3], [1, 2, 3, 0]))
    world.links.append(pv.Angle(ring, 0, 1, 2, compliance=0.1))
    torn = world.add(position=[(4 + 0.8 * k, 2) for k in range(5)], velocity=[(0, 5 * k) for k in range(5)], radius=0.1)
    world.links.append(pv.Stick(torn, range(4), range(1, 5), breaking_force=1e3))
    world.links.append(pv.Spring(torn, 0, 4, stiffness=30.0, damping=0.5, collide=False))
    world.links.iterations = 2
    return world


def driven(**options: Any) -> pv.World:
    """Motors of all kinds, and what they meet."""
    law, room = pv.Collisions(friction=0.5), pv.Box((-100, 0), (100, 50), friction=2.0)
    world = pv.World(boundary=room, gravity=(-2, -9.6), collisions=law, **options)
    car = world.add(position=[(0, 0.3), (2, 0.3), (1, 1.0)], radius=[0.3, 0.3, 0.2], mass=[1.0, 1.5, 2.0])
    world.links.append(pv.Stick(car, [0, 1, 0], [2, 2, 1], collide=False))
    world.links.append(pv.Motor(car, [0, 1], [2, 2], [1, 0], speed=[-20.0, -15.0], max_torque=[3.0, np.inf]))
    world.links.append(pv.AngleLimit(car, 0, 2, 1, least=0.2, most=2.5, breaking_torque=1e5))
    hub = world.add(position=[(6, 3), (6, 4)], radius=0.2, mass=0.5)
    hub.pin(0)
    world.links.append(pv.Stick(hub, 0, 1))
    world.links.append(pv.Motor(hub, 0, 1, speed=7.0, max_torque=4.0))
    world.links.append(pv.Motor(hub, 1, speed=3.0, max_torque=0.1))
    return world


def stars(**options: Any) -> pv.World:
    """So many that gravitation is summed by a tree."""
    world = pv.World(gravity=(0, 0), collisions=None, substeps=2, **options)
    world.add(position=np.random.default_rng(1).normal(0, 5, (600, 2)), radius=0.01)
    world.forces.append(pv.Gravitation(strength=0.01, softening=0.1))
    return world


def water(**options: Any) -> pv.World:
    """A fluid in the corner of a room, and a disc that it meets."""
    world = pv.World(boundary=pv.Box((0, 0), (9, 6), friction=0.0), **options)
    drops = world.add(position=grid(20, 12, 0.1, (0.05, 0.05), loose=0.0), radius=0.05, mass=10.0, friction=0.0)
    world.forces.append(pv.Fluid(drops, rest_density=1000.0, stiffness=800.0, viscosity=0.1))
    world.add(position=(2.6, 0.5), radius=0.5, mass=100.0)
    return world


def sticky(**options: Any) -> pv.World:
    """A crowd in a periodic room under several laws between pairs; some are pinned."""
    room = pv.Periodic((0, 0), (12, 12))
    world = pv.World(gravity=(0, 0), boundary=room, collisions=pv.Collisions(), **options)
    speed = np.random.default_rng(20).normal(0, 2, (400, 2))
    crowd = world.add(position=grid(20, 20, 0.6, (0.3, 0.3)), velocity=speed, radius=0.1)
    crowd.pin(np.arange(0, 400, 37))
    world.forces += [
        pv.SoftRepulsion(strength=0.3, range=0.8), pv.LennardJones(epsilon=0.1, sigma=0.15),
        pv.Cohesion(strength=5.0, break_distance=0.1), pv.Langevin(temperature=1.0, friction=1.0, seed=3),
    ]  # fmt: skip
    return world


def stream(**options: Any) -> pv.World:
    """Discs that come, slide down a slope and go, in a heat bath: the arrays of contacts grow meanwhile."""
    world = pv.World(collisions=pv.Collisions(restitution=0.4), **{"integrator": pv.VelocityVerlet(), **options})
    world.obstacles.append(pv.Segment((-6, 2), (6, 0), restitution=0.5, friction=0.2))
    source = pv.Emitter(pv.Box((-1, 6), (1, 8)), rate=400, radius=(0.06, 0.12), velocity=(0, -2), seed=5)
    world.forces += [pv.Drag(quadratic=0.1), pv.PointSpring(stiffness=0.1), pv.Gravitation(strength=0.01, softening=1.0)]
    world.forces.append(pv.Langevin(temperature=0.3, friction=0.1))
    world.actors += [source, pv.Sink(pv.Box((-50, -50), (50, 0.5)))]
    return world


def sieve(**options: Any) -> pv.World:
    """A disc that falls between two pinned ones and is too large to pass."""
    world = pv.World(collisions=pv.Collisions(restitution=0.1, friction=0.2), **options)
    world.add(position=[(-0.4, 0.0), (0.4, 0.0)], radius=0.3).pin()
    world.add(position=(0.001, 2), velocity=(0, -8), radius=0.105)
    return world


def by_pairs(**options: Any) -> pv.World:
    """Discs of several sizes whose pairs are looked at one by one, without lists."""
    law = pv.Collisions(method=pv.BruteForce(), restitution=0.5, friction=0.3)
    world = pv.World(boundary=pv.Box((0, 0), (8, 40)), collisions=law, **options)
    rng = np.random.default_rng(3)
    world.add(position=grid(5, 4, 1.3, (1.5, 2)), velocity=rng.normal(0, 4, (20, 2)), radius=rng.uniform(0.3, 0.6, 20))
    return world


def thrown(*, friction: float = 0.3, restitution: float = 0.5, **options: Any) -> pv.World:
    """Twenty discs of all sizes and masses in a cage, thrown about."""
    chance, law = np.random.default_rng(1), pv.Collisions(restitution=restitution, friction=friction)
    world = pv.World(boundary=pv.Circle(radius=3, restitution=0.4, friction=friction), collisions=law, **options)
    world.add(
        position=grid(5, 4, 0.75, (-1.5, -1.5)), velocity=chance.normal(0, 2, (20, 2)), radius=chance.uniform(0.2, 0.35, 20),
        mass=chance.uniform(0.5, 3, 20),
    )  # fmt: skip
    return world


def gated(**options: Any) -> pv.World:
    """Discs that walls and obstacles hold, or let through by filters and from below, and sensors that watch."""
    world = pv.World(**{"boundary": pv.Box((-2, -2), (2, 2), mask=5), **options})
    world.obstacles += [
        pv.Chain([(-2, -0.5), (0, -0.8), (1.9, -0.3)], one_way=(0, 1)), pv.Segment((-2, 0.5), (2, 0.5), sensor=True),
        pv.Polygon([(-1, -1), (1, -1), (0, 1)], sensor=True, angular_velocity=2.0), pv.Disc((1, 0), 0.3, mask=2),
    ]  # fmt: skip
    y = np.linspace(-1.5, 1.5, 6)
    speed = np.column_stack((0 * y, np.where(y < 0, 9, -40)))
    world.add(position=np.column_stack((y, y)), velocity=speed, radius=0.15, category=[1, 2, 3, 4, 5, 6])
    return world


def sleepers(*, friction: float = 0.3, **options: Any) -> pv.World:
    """Four asleep in a row, two of them on the floor of a room without gravity, and one that comes to hit them."""
    law = pv.Collisions(restitution=0.7, friction=friction)
    world = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (9, 3)), collisions=law, sleep=True, **options)
    world.add(position=[(2, 0.5), (3, 0.5), (4.2, 0.6), (5.3, 0.7)], radius=0.5)
    world.run(seconds=0.55)
    assert world.asleep.all()
    world.add(position=(0.6, 1.0), velocity=(15, -1.0), radius=0.4)
    return world


def bouncing(**options: Any) -> pv.World:
    """A square and a dumb-bell of sticks that bounce, and a disc between them."""
    room, law = pv.Box((0, 0), (2, 2), restitution=0.9), pv.Collisions(restitution=1.0)
    world = pv.World(boundary=room, collisions=law, **options)
    square = world.add(position=[(0.3, 1), (0.7, 1), (0.7, 1.4), (0.3, 1.4)], radius=0.1, velocity=(3, -4))
    world.links.append(pv.Stick(square, [0, 1, 2, 3, 0], [1, 2, 3, 0, 2]))
    bell = world.add(position=[(1.3, 1), (1.8, 1.1)], radius=0.1, velocity=(-2, -3))
    world.links.append(pv.Stick(bell, 0, 1))
    world.add(position=[(1, 0.2)], radius=0.1)
    return world


def crossing(**options: Any) -> pv.World:
    """Obstacles that move, and a link that breaks, across the boundary of a periodic room."""
    world = pv.World(boundary=pv.Periodic((0, 0), (12, 12), axes="x"), **options)
    world.add(position=pv.fill(pv.Box((1, 5), (11, 11)), radius=0.4, count=60).position, radius=0.4)
    world.obstacles += [pv.Capsule((3, 1), (9, 1), radius=0.3, angular_velocity=1.0), pv.Disc((6, 3), 0.5, velocity=(0.5, 0))]
    pair = world.add(position=[(0.5, 2.0), (11.5, 2.0)], radius=0.1, on_overlap="push")
    world.links.append(pv.Rope(pair, 0, 1, length=1.0, breaking_force=3.0))
    world.forces.append(pv.ConstantForce((0, 2), group=pair[[1, 0]]))
    return world


KINDS: tuple[Callable[..., pv.World], ...] = (
    rolling, crowded, machine, one_way, linked, driven, stars, water, sticky, stream, sieve, by_pairs, thrown, gated, sleepers,
    bouncing, crossing,
)  # fmt: skip
WORLDS: dict[str, Callable[..., pv.World]] = {make.__name__: make for make in KINDS}


def from_file(world: pv.World, folder: Path) -> pv.World:
    """The world, saved and loaded."""
    pv.save(world, folder / "world.pvsnap")
    return pv.load(folder / "world.pvsnap", exact=True)


WAYS: dict[str, Callable[[pv.World, Path], pv.World]] = {
    "file": from_file, "pickle": lambda world, _: pickle.loads(pickle.dumps(world)),
    "copy": lambda world, _: copy.deepcopy(world),
}  # fmt: skip


def said(world: pv.World) -> dict[str, Any]:
    """The bits of a world, and all that it says besides but numbers, of which what comes after a restore has others."""
    found: dict[str, Any] = {
        "bits": world.state_hash(), "unwrapped": world.unwrapped.tobytes(), "frames": world.frames, "energy": world.energy(),
        "material": world.material.tolist(),
        "groups": [group.index.tolist() for group in world.groups if len(group)], "asleep": world.asleep.tolist(),
        "links": [(repr(link), link.force.tobytes(), link.intact.tolist()) for link in world.links],
        "broken": world.links.broken.tobytes(), "obstacles": [(each.pivot, each.angle) for each in world.obstacles],
        "bonds": [force.bonds.tolist() for force in world.forces if isinstance(force, pv.Cohesion)],
        "actors": [vars(actor).get("emitted", vars(actor).get("removed")) for actor in world.actors],
    }  # fmt: skip
    if world.keeps_ledger:
        found["ledger"] = world.ledger.as_dict()
    if world.records_events:
        for name in ("begin", "hit", "end"):
            each = getattr(world.events, name)
            found[name] = {field: each[field].tobytes() for field in each.dtype.names if field != "number"}
        found["hit_speed"] = world.events.hit_speed
    return found


def noted(world: pv.World) -> dict[str, Any]:
    """The same, and the contacts of its last frame, which copies of it do not have."""
    return said(world) | {"contacts": world.contacts.tobytes()}


def go_on_alike(world: pv.World, folder: Path, count: int = 6, objects: Sequence[Any] = ()) -> list[dict[str, Any]]:
    """What a world says after each of so many frames: copies, one from a pickle and one from a file share nothing with it and say
    the same from now on, and so does the world itself when it is taken up again.
    """

    def on(world: pv.World) -> list[dict[str, Any]]:
        return [said(world) for _ in each_frame(world, count)]

    pv.save(world, folder / "world.pvsnap")
    again = pv.load(folder / "world.pvsnap", objects=objects, exact=True)
    others, saved, before = (
        [copy.deepcopy(world), copy.copy(world), pickle.loads(pickle.dumps(world)), again],
        world.save(),
        said(world),
    )
    parts = {id(each) for each in (*world.actors, *world.obstacles, *world.links)}
    for other in others:
        assert said(other) == before
        assert (other.number.tolist(), other.group_number.tolist()) == (world.number.tolist(), world.group_number.tolist())
        assert not np.shares_memory(other.position, world.position)
        assert parts.isdisjoint(map(id, (*other.actors, *other.obstacles, *other.links)))
    expected = on(world)
    assert [on(other) for other in others] == [expected] * 4
    world.obstacles.clear()
    world.restore(saved)
    assert on(world) == expected
    return expected


class Thing(NamedTuple):
    """Segments from a to b, (n, 2), thick by `radius`; of a polygon its faces, counter-clockwise."""

    a: Any
    b: Any
    radius: float
    solid: bool = False

    def gap(self, at: Any) -> Any:
        """(q,) distance of points (q, 2) from its rim, m; negative inside."""
        side, way = self.b - self.a, at[:, None] - self.a
        part = np.clip((way * side).sum(axis=2) / np.maximum((side * side).sum(axis=1), 1e-300), 0, 1)
        far = np.hypot(*np.moveaxis(way - part[..., None] * side, 2, 0)).min(axis=1) - self.radius
        inside = (side[:, 0] * way[..., 1] - side[:, 1] * way[..., 0] > 0).all(axis=1)
        return np.where(inside & self.solid, -np.abs(far), far)

    def image(self, shift: Any) -> "Thing":
        return self._replace(a=self.a + shift, b=self.b + shift)


def thing_of(obstacle: pv.Obstacle, ahead: float = 0.0) -> Thing:
    """An obstacle where it will be in `ahead` seconds."""
    points, (_, closed, rounding, convex, _) = obstacle.points, obstacle._parts()
    turned, pivot = ahead * obstacle.angular_velocity, np.array(obstacle.pivot)
    turn = np.array([(np.cos(turned), -np.sin(turned)), (np.sin(turned), np.cos(turned))])
    points = (points - pivot) @ turn.T + pivot + ahead * np.array(obstacle.velocity) if ahead else points
    ends = np.roll(points, -1, axis=0) if closed or len(points) == 1 else points[1:]
    return Thing(points[: len(ends)], ends, rounding, convex)
