"""Converts the objects of a world to plain numbers and text, and back: `{"type": "Circle", "center": [0, 0], "radius": 3.0}`.

A description names one of our classes by `type`, with its constructor arguments; later changes are under `state`. It covers
rooms, collisions, integrators, forces, obstacles and actors; links are in `describe_links`. An object of a user's own class
becomes only `{"object": name}`: the caller passes such objects in, and nothing is ever imported because a file says so.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.fields import Field
from pyverlet.common.guess import did_you_mean
from pyverlet.common.shown import brief
from pyverlet.data import serialize
from pyverlet.laws import boundaries, forces, integrators, obstacles, textbook
from pyverlet.laws.collisions import BruteForce, Collisions, Fast
from pyverlet.laws.obstacles import Obstacle
from pyverlet.laws.surface import Surface
from pyverlet.scenes.boids import Flock
from pyverlet.scenes.particle_life import Likings
from pyverlet.state.group import Group, Picked
from pyverlet.world.actors import Actor, Emitter, Sink
from pyverlet.world.world import World

Description = dict[str, Any]

TYPE, OBJECT, STATE = "type", "object", "state"  # keys of a description that are not arguments


@dataclass(frozen=True)
class Kind:
    """How objects of a class are described."""

    cls: type
    arguments: Callable[[Any], dict[str, Any]]  # of an object: its constructor arguments, as numbers, text, arrays and objects
    state: Callable[[Any], dict[str, Any]]  # of an object: its other state, possibly empty
    recall: Callable[[Any, dict[str, Any]], None]  # sets that state in a new object
    known: tuple[str, ...]  # the names of all arguments of the class


KINDS: dict[str, Kind] = {}  # by class name


def _refuse(thing: Any, state: dict[str, Any]) -> None:
    if state:
        raise InputError(f"state of {type(thing).__name__} is {state!r}; allowed is none")


_HANDED_ON: dict[str, Any] = {"walls": Surface, "made": Surface, "surface": Obstacle}
"""Where arguments that a class takes by `**` are passed."""


def arguments_of(what: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """The arguments of a class or function by name, including those that it passes on."""
    taken: dict[str, inspect.Parameter] = {}
    for name, parameter in inspect.signature(what).parameters.items():
        if parameter.kind is parameter.VAR_KEYWORD:
            handed = arguments_of(_HANDED_ON[name]) if name in _HANDED_ON else {}
            taken |= {key: each for key, each in handed.items() if key not in (*taken, "points")}
        elif parameter.kind is not parameter.VAR_POSITIONAL:
            taken[name] = parameter
    return taken


def _kind(
    cls: type,
    *names: str,
    arguments: Callable[[Any], dict[str, Any]] | None = None,
    state: Callable[[Any], dict[str, Any]] = lambda thing: {},
    recall: Callable[[Any, dict[str, Any]], None] = _refuse,
) -> None:
    """Register a class whose arguments are attributes of these names, by default all, or what `arguments` returns."""
    taken = tuple(arguments_of(cls))
    usual = names or taken
    arguments = arguments or (lambda thing: {name: getattr(thing, name) for name in usual})
    KINDS[cls.__name__] = Kind(cls, arguments, state, recall, taken)


_cls: type
_kind(boundaries.Open)
for _cls in (
    boundaries.Circle,
    boundaries.Box,
    boundaries.Periodic,
    textbook.ClampAndFlip,
    textbook.ProjectOnly,
    Fast,
    BruteForce,
):
    _kind(_cls)


def _collisions(laws: Any) -> dict[str, Any]:
    own = {name: getattr(laws, name) for name in ("restitution", "friction", "rolling_resistance", "combine", "method")}
    return own | {"materials": {", ".join(names): dict(values) for names, values in laws.materials.items()}}


_kind(Collisions, arguments=_collisions)

for _cls in (
    *integrators.BY_NAME.values(), forces.Attractor, forces.ConstantForce, forces.Drag, forces.Wind, forces.Gravitation,
    forces.Fluid, forces.PointSpring, forces.LennardJones, forces.Yukawa, forces.SoftRepulsion, forces.Langevin,
):  # fmt: skip
    _kind(_cls)


def _recall_bonds(cohesion: forces.Cohesion, state: dict[str, Any]) -> None:
    if state:
        sizes: dict[str, int] = {}
        bonds = np.asarray(state["bonds"])
        Field(np.int64, "bonds", 2, least=0, most=2**31).check("bonds", bonds, np.dtype(np.float64), sizes)
        cohesion.restore(bonds)


_kind(forces.Cohesion, state=lambda force: {"bonds": force.bonds.copy()} if len(force.bonds) else {}, recall=_recall_bonds)
for _cls in (Likings, Flock, forces.Push):
    _kind(_cls)


def _grip(grip: forces.Grip) -> dict[str, Any]:
    # A grip whose particle was removed holds nothing.
    held = {"particle": max(grip.particle, 0)}
    return held | {name: getattr(grip, name) for name in ("target", "frequency", "strength")}


def _let_go(grip: forces.Grip, state: dict[str, Any]) -> None:
    if state not in ({}, {"holds": False}):
        raise InputError(f"state of Grip is {state!r}; allowed are none and that it holds nothing")
    if state:
        grip.particle = -1


_kind(forces.Grip, arguments=_grip, state=lambda grip: {} if grip.particle >= 0 else {"holds": False}, recall=_let_go)

_SURFACE = tuple(arguments_of(Obstacle))[1:]
_SHAPES: dict[type, tuple[str, ...]] = {
    obstacles.Chain: ("points", "closed", "radius", "one_way"),
    obstacles.Segment: ("start", "end", "one_way"),
    obstacles.Capsule: ("start", "end", "radius", "one_way"),
    obstacles.Disc: ("center", "radius"),
    obstacles.Polygon: ("points", "radius"),
}
_CORNERS = {"center": 0, "start": 0, "end": 1}


def _shape(obstacle: Any) -> dict[str, Any]:
    """Corners relative to the pivot, which loses no bits; the pivot is part of the state."""
    shape: dict[str, Any] = {}
    for name in _SHAPES[type(obstacle)]:
        if name in _CORNERS:
            shape[name] = tuple(map(float, obstacle._local[_CORNERS[name]]))
        else:
            shape[name] = obstacle._local if name == "points" else getattr(obstacle, name)
    return shape | {name: getattr(obstacle, name) for name in _SURFACE} | {"pivot": (0.0, 0.0)}


def _place(obstacle: Any, state: dict[str, Any]) -> None:
    if unknown := set(state) - {"pivot", "angle"}:
        raise InputError(f"state of {type(obstacle).__name__} has {sorted(unknown)[0]!r}; allowed are pivot and angle")
    for name, value in state.items():
        setattr(obstacle, name, value)


for _cls in _SHAPES:
    _kind(
        _cls, arguments=_shape, state=lambda obstacle: {"pivot": obstacle.pivot, "angle": obstacle.angle}, recall=_place,
    )  # fmt: skip


def _recall_emitter(emitter: Emitter, state: dict[str, Any]) -> None:
    if not state:
        return
    due, emitted = checks.number("due", state["due"], least=0.0), checks.integer("emitted", state["emitted"], least=0)
    emitter.restore((due, emitted, state["random"]))
    emitter._rng.random()  # an invalid state fails here, not in the middle of a frame
    emitter.restore((due, emitted, state["random"]))


_kind(
    Emitter, "region", "rate", "velocity", "radius", "mass", "density", "most",
    state=lambda emitter: dict(zip(("due", "emitted", "random"), emitter.save(), strict=True)), recall=_recall_emitter,
)  # fmt: skip
_kind(
    Sink, state=lambda sink: {"removed": sink.removed},
    recall=lambda sink, state: sink.restore(checks.integer("removed", state["removed"], least=0) if state else 0),
)  # fmt: skip


def describe(thing: Any) -> Description:
    """Describe a room, collisions, an integrator, a force, an obstacle or an actor.

    Values are numbers, text, lists, further descriptions and NumPy arrays; `serialize.plain` converts the arrays to lists.

    Raises:
        InputError: an object of a user's own class has state that a description cannot hold.
    """
    kind = KINDS.get(type(thing).__name__)
    if kind is None or kind.cls is not type(thing):
        return _own(thing)
    arguments = kind.arguments(thing)
    if any(callable(value) for value in arguments.values()):  # a wind that is a function
        return _own(thing)
    description = {TYPE: kind.cls.__name__} | {name: _value(value) for name, value in arguments.items()}
    state = {name: _value(value) for name, value in kind.state(thing).items()}
    return description | ({STATE: state} if state else {})


def _value(value: Any) -> Any:
    if isinstance(value, Picked):
        return {"numbers": value._numbers}
    if isinstance(value, Group):
        return {"first": value._first, "count": value._added}
    if type(value).__name__ in KINDS:
        return describe(value)
    return serialize.pack(list(value) if isinstance(value, tuple) else value)


def _own(thing: Any) -> Description:
    description: Description = {OBJECT: name_of(thing)}
    if isinstance(thing, Actor):
        kept = thing.save()
        if kept is not None:
            try:
                description[STATE] = serialize.pack(kept)
            except InputError as error:
                raise InputError(f"what {description[OBJECT]}.save() returns cannot be kept: {error}") from None
    return description


def name_of(thing: Any) -> str:
    """The name of an object of a user's own class, or of a function made a force, in descriptions."""
    return str(getattr(thing, "__qualname__", type(thing).__qualname__))


def describe_all(world: World) -> dict[str, list[Description]]:
    """Descriptions of the forces, obstacles and actors of a world."""
    world.forces.check(world._state)
    return {name: [describe(thing) for thing in things] for name, (things, _) in _collections(world).items()}


def _collections(world: World) -> dict[str, tuple[Any, type]]:
    """The lists of a world besides particles and links, by name, and the class of their entries."""
    return {"forces": (world.forces, object), "obstacles": (world.obstacles, Obstacle), "actors": (world.actors, Actor)}


class Builder:
    """Creates objects from descriptions.

    `objects`: the user's own objects, in the order in which descriptions name them; several of one name are used in turn.
    `world`: the world whose particles groups refer to.
    """

    def __init__(self, objects: Iterable[Any] = (), world: World | None = None) -> None:
        self._objects = list(objects)
        self.world = world

    def build(self, name: str, description: Any, wanted: Any) -> Any:
        """The described object; `name`: its name in errors, `wanted`: its allowed class.

        Raises:
            InputError: the description is invalid; the message says why and, for a name, suggests the nearest known one.
        """
        if not isinstance(description, Mapping):
            raise InputError(f"{name} is {brief(description)}; allowed is a table with a `type`")
        thing = self._taken(name, description) if OBJECT in description else self._made(name, description)
        if not isinstance(thing, wanted):
            known = [kind for kind, known in KINDS.items() if issubclass(known.cls, wanted)]
            raise InputError(f"{name} is {type(thing).__name__}; allowed are {', '.join(known)}")
        return thing

    def build_all(self, tables: Mapping[str, Any]) -> None:
        """Append the objects that `describe_all` described to the world."""
        assert self.world is not None
        for name, (things, wanted) in _collections(self.world).items():
            for k, description in enumerate(tables[name]):
                things.append(self.build(f"{name}[{k}]", description, wanted))

    def _made(self, name: str, description: Mapping[str, Any]) -> Any:
        kind = KINDS.get(called) if isinstance(called := description.get(TYPE), str) else None
        if kind is None:
            near = _nearest(called, tuple(KINDS)) if isinstance(called, str) else ""
            raise InputError(f"{name} has the type {brief(called)}{near}; known: {', '.join(KINDS)}")
        arguments = {key: value for key, value in description.items() if key not in (TYPE, STATE)}
        for key in arguments:
            if key not in kind.known:
                raise InputError(f"{name}: {kind.cls.__name__} has no {key!r}{_nearest(key, kind.known)}")
        with _one_sentence(name):
            values = {key: self._argument(f"{name}: {key}", key, value) for key, value in arguments.items()}
            thing = kind.cls(**values)
            kind.recall(thing, serialize.unpack(description.get(STATE, {})))
            return thing

    def _argument(self, name: str, key: str, value: Any) -> Any:
        if key == "group":
            return None if value is None else self._group(name, value)
        if isinstance(value, Mapping) and (TYPE in value or OBJECT in value):
            return self.build(name, value, object)
        value = serialize.unpack(value)
        return tuple(value) if isinstance(value, list) and not any(isinstance(part, list) for part in value) else value

    def _group(self, name: str, value: Any) -> Group:
        if isinstance(value, Group):
            return value
        if self.world is None:
            raise InputError(f"{name} is {brief(value)}; allowed is none where there is no world")
        if "numbers" in value:
            numbers = np.asarray(serialize.unpack(value["numbers"]))
            Field(np.int64, "numbers", least=0, most=2**31).check(f"{name}: numbers", numbers, self.world.dtype, {})
            return Picked(self.world._state, numbers, self.world.remove)
        first, count = checks.integer("first", value["first"], least=0), checks.integer("count", value["count"], least=0)
        return Group(self.world._state, first, count, self.world.remove)

    def _taken(self, name: str, description: Mapping[str, Any]) -> Any:
        wanted = description[OBJECT]
        for k, thing in enumerate(self._objects):
            if name_of(thing) == wanted:
                del self._objects[k]
                break
        else:
            raise InputError(f"{name} is of a class of your own, {wanted!r}; allowed is a file whose `objects` are handed in")
        if isinstance(thing, Actor) and self.world is not None:
            thing = thing.of(self.world)
        if isinstance(thing, Actor) and STATE in description:
            with _one_sentence(name):
                thing.restore(serialize.unpack(description[STATE]))
        return thing


@contextmanager
def _one_sentence(name: str) -> Iterator[None]:
    """Context that turns errors of wrong values into InputErrors of one sentence."""
    try:
        yield
    except InputError as error:
        said = str(error)
        raise InputError(said if said.startswith(name) else f"{name}: {said}") from None
    except (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError) as error:
        raise InputError(f"{name} has values of the wrong kind ({error}); allowed are those its class takes") from error


def _nearest(name: str, known: tuple[str, ...]) -> str:
    return did_you_mean(name, known, alike=0.5) or f"; known: {', '.join(known)}"
