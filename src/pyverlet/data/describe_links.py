"""Converts links to tables and back: their particles, their numbers as columns, and their state. See `describe` for all else."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from pyverlet.common.errors import InputError
from pyverlet.common.fields import Field
from pyverlet.data import serialize
from pyverlet.data.describe import OBJECT, STATE, TYPE
from pyverlet.laws.links import Angle, AngleLimit, Area, Link, Motor, Pin, Rope, Spring, Stick
from pyverlet.laws.links._link import REMEMBERED
from pyverlet.world.world import World

_KINDS: tuple[Any, ...] = (Stick, Rope, Spring, Angle, AngleLimit, Motor, Area, Pin)
_ARITY: dict[Any, tuple[int, ...]] = {
    **dict.fromkeys((Stick, Rope, Spring), (2,)), Angle: (3,), AngleLimit: (3,), Motor: (1, 2, 3), Pin: (1,),
}  # fmt: skip

_ANY, _LEAST_0, _PAIR = Field(np.float64, "rows"), Field(np.float64, "rows", least=0), Field(np.float64, "rows", 2)
_LEAST_0_OR_INFINITE = Field(np.float64, "rows", least=0, infinite=True)
_COLUMNS = {
    "length": _LEAST_0, "angle": _ANY, "area": _LEAST_0, "least": _ANY, "range": _LEAST_0, "speed": _ANY,
    "max_torque": _LEAST_0_OR_INFINITE, "point": _PAIR, "stiffness": _LEAST_0_OR_INFINITE, "damping": _LEAST_0,
    "strength": Field(np.float64, "rows", above=0, infinite=True),
}  # fmt: skip
"""Specifications of the columns that links name in `_columns`."""

_MOVING = {"intact": Field(np.uint8, "rows", least=0, most=1), "force": _ANY, **dict.fromkeys(REMEMBERED, _PAIR)}


def describe(world: World) -> list[dict[str, Any]]:
    """A table for each link of a world, in order; `strength` is the breaking load, N or N m."""
    return [_described(link) for link in world.links]


def _described(link: Link) -> dict[str, Any]:
    cls = type(link)
    kind: Any = next((base for base in cls.__mro__ if base in _KINDS), None)
    if kind is None:
        raise InputError(
            f"a link is of the class {cls.__qualname__}; allowed are {', '.join(known.__name__ for known in _KINDS)}"
        )
    assert link._pool is not None
    rows = link._pool.rows
    named = {TYPE: kind.__name__} if cls is kind else {TYPE: kind.__name__, OBJECT: cls.__qualname__}
    columns: dict[str, Any] = {name: rows[column][link._where].copy() for name, column in kind._columns.items()}
    if kind in (Stick, Rope, Spring):
        columns["collide"] = bool(link._collide)
    moving = {name: rows[name][link._where].copy() for name in _MOVING}
    return named | {"particles": link.particles.copy()} | columns | {STATE: moving}


def build(world: World, tables: Any, objects: Iterable[Any] = ()) -> None:
    """Append links from tables that `describe` returned to a world; `objects`: the user's own link classes.

    Raises:
        InputError: a table is incomplete, or a number is outside what is allowed.
    """
    if not isinstance(tables, list):
        raise InputError("links is not a list; allowed is one of tables")
    own = {thing.__qualname__: thing for thing in objects if isinstance(thing, type)}
    for number, table in enumerate(tables):
        name = f"links[{number}]"
        try:
            _append(world, name, table, own)
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{name} lacks something ({error}); allowed is what describes a link") from error


def _append(world: World, name: str, table: dict[str, Any], own: dict[str, type]) -> None:
    kind = next((known for known in _KINDS if known.__name__ == table[TYPE]), None)
    if kind is None:
        raise InputError(f"{name} has the type {table[TYPE]!r}; known: {', '.join(known.__name__ for known in _KINDS)}")
    cls: type = kind
    if OBJECT in table:
        if table[OBJECT] not in own or not issubclass(own[table[OBJECT]], kind):
            raise InputError(f"{name} is of a class of your own, {table[OBJECT]!r}; allowed is a file whose `objects` hold it")
        cls = own[table[OBJECT]]
    sizes = {"particles": len(world)}
    particles = table["particles"]
    joined = Field(np.int64, "rows", particles.shape[1], least=0, below="particles")
    joined.check(f"{name}: particles", particles, world.dtype, sizes)
    wanted = _ARITY.get(kind)
    if (particles.shape[1] not in wanted) if wanted else (particles.shape[1] < 3 or len(particles) != 1):
        raise InputError(f"{name}: particles has shape {particles.shape}; allowed are those a {kind.__name__} joins")
    if not len(particles) or (np.diff(np.sort(particles, axis=1), axis=1) == 0).any():
        raise InputError(f"{name}: particles names one twice, or none; allowed are different ones")
    # The constructor is not called, as it checks current positions: a ring may have crossed itself since.
    link: Any = object.__new__(cls)
    Link.__init__(link, world._state, particles)
    columns = {key: _column(name, key, table, _COLUMNS[key], world, sizes) for key in kind._columns}
    for key, column in columns.items():
        setattr(link, f"_{key}", column)
    if kind in (Stick, Rope, Spring):
        link._collide = table["collide"]
        if not isinstance(link._collide, bool):
            raise InputError(f"{name}: collide is {link._collide!r}; allowed are true and false")
    moving = {key: _column(name, key, table[STATE], field, world, sizes) for key, field in _MOVING.items() if key in table[STATE]}
    world.links.append(link)
    for key, column in moving.items():
        link._pool.rows[key][link._where] = column


def _column(name: str, key: str, table: dict[str, Any], field: Field, world: World, sizes: dict[str, int]) -> Any:
    column = serialize.unpack(table[key])
    if not isinstance(column, np.ndarray):
        raise InputError(f"{name}: {key} is {column!r}; allowed is an array")
    field.check(f"{name}: {key}", column, world.dtype, sizes)
    return column
