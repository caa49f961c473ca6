"""Converts a saved world to named arrays and plain numbers, and back, in another world or another process.

Everything that `World.save` keeps has a line here: a field for each array, checked before any kernel sees it, and a check for
each number. Rooms, forces, obstacles, actors and links are objects and are described elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.fields import Field
from pyverlet.laws.events import CONTACT, HIT, Events
from pyverlet.laws.ledger import EnergyLedger, Ledger
from pyverlet.laws.links._set import BROKEN
from pyverlet.laws.sleep import OTHER_LAWS, Sleep, laws
from pyverlet.state.data import Columns
from pyverlet.world.contact_memory import STEP, Memory
from pyverlet.world.obstacle_rows import SIDES
from pyverlet.world.saved import Saved
from pyverlet.world.sleepers import ASLEEP, Remembered
from pyverlet.world.world import World

Facts = Mapping[str, Any]

_MOST = 2**53
"""Larger counts are refused."""

_WHO, _HOW = ("a", "b", "wall", "obstacle"), ("speed", "point", "normal", "impulse")
"""Fields of `events.HIT`."""

_HELD = ("resting", "rolled", "driven")
"""Names of the numbers of `EnergyLedger._held` in files."""

PARTICLES = {
    "position": Field(None, "particles", 2),
    "velocity": Field(None, "particles", 2),
    "acceleration": Field(None, "particles", 2, nan=True),
    "spin": Field(None, "particles"),
    "angle": Field(np.float64, "particles"),
    "radius": Field(None, "particles", above=0),
    "mass": Field(None, "particles", above=0, infinite=True),
    "restitution": Field(None, "particles", most=1),
    "friction": Field(None, "particles"),
    "rolling_resistance": Field(None, "particles"),
    "inertia": Field(None, "particles", least=0),
    "category": Field(np.uint32, "particles"),
    "mask": Field(np.uint32, "particles"),
    "material": Field(np.uint32, "particles"),
    "fixed_rotation": Field(np.uint32, "particles"),
    "crossed": Field(np.float64, "particles", 2),
    "number": Field(np.int64, "particles", least=0, most=2**31, order="ascending"),
    "begun": Field(np.int64, "groups", least=0, most=2**31, order="rising"),
}
"""The user's arrays, and the first particle of each group. Files of older versions lack `crossed`."""

SORTED_STATE = {
    "particle": Field(np.int32, "slots", least=0, below="slots", order="permutation"),
    "island": Field(np.int64, "sleepers", least=-1),
    "calm": Field(np.float32, "sleepers", least=0),
    "void": Field(np.bool_, "one"),
    "placed": Field(np.bool_, "particles"),
}
"""State in the engine's order; the sleep timer is called `calm` in files."""

_IN_FILES = {"sleep_timer": "calm"}

NEWS = {
    "touching": Field(np.int64, "touching", least=0, order="ascending"),
    "begin": Field(np.int64, "begin", 4, least=-1),
    "begin_how": Field(np.float64, "begin", 6),
    "begin_number": Field(np.int64, "begin", 2, least=-1),
    "end": Field(np.int64, "end", 2, least=-1),
    "end_at": Field(np.int64, "end", 2, least=-1),
    "end_number": Field(np.int64, "end", 2, least=-1),
    "broken": Field(np.int64, "broken", 4, least=-1),
    "broken_number": Field(np.int64, "broken", 2, least=-1),
    "broken_force": Field(np.float64, "broken", infinite=True),
    "islands": Field(np.int64, "islands", least=0, order="ascending"),
    "members": Field(np.int64, "islands", least=1),
}
"""Events of the last frame, and sleep. `begin` has a, b, wall and obstacle; speed, point (2), normal (2), impulse. `end` has a
and b; wall and obstacle. Files of older versions lack these, and particle numbers."""

IMPULSES = {
    "pairs": Field(np.int32, "impulses", 2, least=0, below="particles"),
    "values": Field(None, "impulses", 4),
    "surfaces": Field(np.int32, "surfaces", 2, least=0),
    "pushes": Field(np.float64, "surfaces", 3),
    "given": Field(None, "remembered", 3),
    "listed": Field(None, "neighbours", 2, nan=True),
    "checked": Field(None, "neighbours", 2, nan=True),
}
"""Impulses of contacts in the last substep (`world.contact_memory.Memory`), and the positions at which they were listed."""

_GROUPS = {"particles": PARTICLES, "slots": SORTED_STATE, "news": NEWS, "impulses": IMPULSES, "asleep": ASLEEP}
FIELDS = {f"{group}.{name}": field for group, fields in _GROUPS.items() for name, field in fields.items()}

OWN = "data."
"""Prefix of the user's own arrays, whose names are in `facts["data"]`; see `state.data.Columns`."""

RETIRED = frozenset({
    "particles.grown", "slots.fed",
    *(f"contacts.{name}" for name in ("built", "checked", "low", "high", "slip", "lent_particle", "lent", "busy", "held")),
    *(f"linked.{name}" for name in ("number", "start", "left", "calm")),
})  # fmt: skip
"""Arrays in files of the former projection-based contact law, which are ignored."""


class Parts(NamedTuple):
    """The state of a world: numbers as JSON has them, and arrays by the names of `FIELDS`."""

    facts: dict[str, Any]
    arrays: dict[str, Array]


def take_apart(world: World) -> Parts:
    """The current state of a world. The arrays are copies."""
    saved = world.save()
    facts: dict[str, Any] = {
        "time": float(saved.time), "frames": saved.frames, "numbers": world._state.numbers,
        "materials": world._state.materials, "rewound": world._state.rewound.tolist(),
    }  # fmt: skip
    arrays = {f"particles.{name}": array for name, array in saved.arrays.items()}
    arrays["particles.begun"] = np.array(world._state.begun, np.int64)
    arrays |= {f"slots.{_IN_FILES.get(name, name)}": column for name, column in saved.sorted_state.items()}
    memory = saved.impulses
    facts["impulses"] = {name: float(getattr(memory, name)) for name in STEP}
    if memory.kick:
        facts["impulses"]["skin"] = list(memory.skin)
        arrays |= {f"impulses.{name}": getattr(memory, name) for name in IMPULSES}
        if len(memory.asleep.particle):
            arrays |= {f"asleep.{name}": getattr(memory.asleep, name) for name in ASLEEP}
    if saved.energy_ledger:
        held = dict(zip(_HELD, saved.energy_ledger._held, strict=True))
        facts["books"] = {"energy": saved.energy_ledger._energy, **held, "ledger": saved.energy_ledger.ledger.as_dict()}
    if saved.events:
        facts["hit_speed"] = saved.events.hit_speed
        saved.events.name_after(list(world.obstacles))
        _events_apart(saved.events, arrays)
    if saved.sleep:
        known = saved.sleep._laws
        facts["sleep"] = {"next": saved.sleep._next, "laws": known and ("others" if known is OTHER_LAWS else "same")}
        members = dict(sorted(saved.sleep._members.items()))
        arrays["news.islands"] = np.array(list(members), np.int64)
        arrays["news.members"] = np.array(list(members.values()), np.int64)
    facts["data"] = list(saved.data)
    arrays |= {f"{OWN}{k}": column for k, column in enumerate(saved.data.values())}
    broken = saved.links[2]
    if len(broken):
        arrays["news.broken"] = np.column_stack([broken[name] for name in ("link", "row", "i", "j")])
        arrays["news.broken_force"], arrays["news.broken_number"] = broken["force"].copy(), broken["number"].copy()
    return Parts(facts, arrays)


def check(parts: Parts, real: np.dtype[Any]) -> None:
    """Refuse arrays that do not match `FIELDS`.

    Raises:
        InputError: an array does not match; the message names it.
    """
    sizes = {"one": 1}
    _bring_up_to_date(parts.arrays, real)
    for name, array in parts.arrays.items():
        if not name.startswith(OWN):
            FIELDS[name].check(name, array, real, sizes)


def _bring_up_to_date(arrays: dict[str, Array], real: np.dtype[Any]) -> None:
    """Add columns that older files lack: no rolling, no materials, moments of inertia of discs."""
    for name, width in (("impulses.values", 4), ("asleep.values", 4), ("impulses.pushes", 3), ("asleep.pushes", 3)):
        if name in arrays and arrays[name].ndim == 2 and arrays[name].shape[1] == width - 1:
            arrays[name] = np.column_stack((arrays[name], np.zeros(len(arrays[name]), arrays[name].dtype)))
    if "particles.friction" in arrays and "particles.rolling_resistance" not in arrays:
        arrays["particles.rolling_resistance"] = np.full(len(arrays["particles.friction"]), -1, real)
        for name in ("material", "fixed_rotation"):
            arrays[f"particles.{name}"] = np.zeros(len(arrays["particles.friction"]), np.uint32)
    if "particles.friction" in arrays and "particles.inertia" not in arrays:
        arrays["particles.inertia"] = np.zeros(len(arrays["particles.friction"]), real)


def fill(world: World, parts: Parts) -> None:
    """Give an empty world the particles, with their numbers and groups, before `put_together`. The world keeps the arrays.

    Raises:
        InputError: an array is invalid.
    """
    parts.arrays.setdefault("particles.crossed", np.zeros((len(parts.arrays.get("particles.number", ())), 2)))
    check(parts, world.dtype)
    try:
        arrays = {name: parts.arrays[f"particles.{name}"] for name, _ in world._state.arrays()}
        begun = parts.arrays["particles.begun"]
    except KeyError as error:
        raise InputError(f"the array {error} is missing; allowed are files that have all") from None
    world._state.restore(arrays, _data(parts), own=True)
    most = int(arrays["number"][-1]) + 1 if len(world) else 0
    world._state.numbers = checks.integer("numbers", parts.facts.get("numbers"), least=most, most=2**31)
    rewound = np.array(parts.facts.get("rewound") or np.zeros((0, 2)))
    Field(np.int64, "rewound", 2, least=0, most=2**31).check("rewound", rewound.astype(np.int64), world.dtype, {})
    world._state.begun, world._state.rewound = begun.tolist(), rewound.astype(np.int64)
    world._state.materials = _names(parts.facts.get("materials", [""]), int(arrays["material"].max(initial=0)))
    world.boundary.check(world.radius)


def _names(names: Any, most: int) -> list[str]:
    if not (isinstance(names, list) and names[:1] == [""] and len(names) > most and all(isinstance(name, str) for name in names)):
        raise InputError(f"materials is {names!r}; allowed is a list of names, the first '', for each number up to {most}")
    return names


def _data(parts: Parts) -> Columns:
    data = {name: parts.arrays[f"{OWN}{k}"] for k, name in enumerate(parts.facts.get("data", ()))}
    count = len(parts.arrays["particles.number"])
    for name, column in data.items():
        if len(column) != count + 1:
            raise InputError(
                f"data[{name!r}] has {len(column)} rows; allowed are {count + 1}, one for each particle and for new ones"
            )
    return data


def put_together(world: World, parts: Parts) -> Saved:
    """The state that `world.restore` takes, for a world with the particles by `fill` and its obstacles, actors and links.

    Raises:
        InputError: a number is invalid.
    """
    facts = parts.facts
    *links, _ = world.links.save()
    return Saved(
        world=world._state,
        arrays={name: parts.arrays[f"particles.{name}"] for name, _ in world._state.arrays()},
        time=checks.number("time", facts["time"]),
        frames=checks.integer("frames", facts.get("frames"), least=0, most=_MOST),
        next_birth=world._state.next_birth,
        sorted_state=_sorted_rows(world, parts.arrays),
        impulses=_impulses(world, facts.get("impulses") or {}, parts.arrays),
        energy_ledger=_energy_ledger(facts["books"]) if world.keeps_ledger else None,
        events=_events(world, facts, parts.arrays) if world.records_events else None,
        sleep=_sleep(world, facts["sleep"], parts.arrays) if world._sleep else None,
        obstacles=world.obstacles.save(),
        actors=[(actor, actor.save()) for actor in world.actors],
        links=(*links, _broken(parts.arrays)),
        forces=world._memories(),
        data=_data(parts),
    )


def _sorted_rows(world: World, arrays: dict[str, Array]) -> dict[str, Array]:
    now = {old: new for new, old in _IN_FILES.items()}
    there = (name for name in SORTED_STATE if name != "placed" or f"slots.{name}" in arrays)
    sorted_state = {now.get(name, name): arrays[f"slots.{name}"] for name in there}
    count = len(sorted_state["particle"])
    if count > len(world) or len(sorted_state["island"]) != (count if world._sleep else 0):
        raise InputError(f"slots.particle has {count} rows; allowed are at most {len(world)}, one for each particle")
    return sorted_state


def _impulses(world: World, facts: Facts, arrays: dict[str, Array]) -> Memory:
    numbers: dict[str, Any] = {name: checks.number(name, facts.get(name, 0.0), least=0.0) for name in STEP}
    if not numbers["kick"]:
        return Memory.empty(world.dtype)
    try:
        kept: dict[str, Any] = {
            name: arrays[f"impulses.{name}"].copy() for name in ("pairs", "values", "surfaces", "pushes", "given")
        }
    except KeyError as error:
        raise InputError(f"the array {error} is missing; allowed are files that have all") from None
    pairs, surfaces, given = kept["pairs"], kept["surfaces"], kept["given"]
    if not (pairs[:, 0] < pairs[:, 1]).all() or not (np.diff(pairs[:, 0]) >= 0).all():
        raise InputError("impulses.pairs are not sorted; allowed are pairs low < high, by the lower")
    if len(surfaces) and not (surfaces[:, 0] < len(given)).all():
        raise InputError(
            f"impulses.surfaces has particle {surfaces[:, 0].max()}; allowed are those of impulses.given, {len(given)}"
        )
    if len(given) > len(world):
        raise InputError(f"impulses.given has {len(given)} rows; allowed are at most {len(world)}, one for each particle")
    none = np.empty((0, 2), world.dtype)
    listed, checked = (arrays.get(f"impulses.{name}", none).copy() for name in ("listed", "checked"))
    skin = tuple(checks.number("skin", number, least=0.0) for number in facts.get("skin") or ())
    if len(skin) not in (0, 6) or (len(listed) and not skin) or len(listed) not in (0, len(given)):
        raise InputError(
            f"impulses.skin has {len(skin)} numbers and impulses.listed {len(listed)} rows; allowed are 6 and one "
            "for each row of impulses.given, or none"
        )
    for number in skin[4:]:  # counts
        checks.integer("skin", int(number), least=0, most=_MOST)
    asleep = Remembered.taken_up(arrays, len(world), world.dtype)
    world._obstacle_arrays.begin()
    there = SIDES + len(world._obstacle_arrays.segments)
    for name, rows in (("impulses", surfaces), ("asleep", asleep.surfaces)):
        if (most := rows[:, 1].max(initial=-1)) >= there:
            raise InputError(f"{name}.surfaces has surface {most}; allowed are those of the room and its obstacles, {there}")
    return Memory(**kept | numbers, asleep=asleep, listed=listed, checked=checked, skin=skin)


# ---- ledger, events and sleep -------------------------------------------------------------------------------------------


def _energy_ledger(facts: Facts) -> EnergyLedger:
    kept = EnergyLedger()
    kept._energy = checks.number("energy", facts["energy"])
    resting, rolled, driven = (checks.number(name, facts.get(name, 0.0)) for name in _HELD)
    kept._held = resting, rolled, driven
    accounts = Ledger().as_dict()
    kept.ledger = Ledger(**{name: checks.number(name, facts["ledger"].get(name, 0.0)) for name in accounts})
    return kept


def _events_apart(events: Events, arrays: dict[str, Array]) -> None:
    arrays["news.touching"] = events._touching
    arrays["news.end"], arrays["news.end_at"] = np.hsplit(np.column_stack([events.end[name] for name in _WHO]), 2)
    arrays["news.begin"] = np.column_stack([events.begin[name] for name in _WHO])
    arrays["news.begin_how"] = np.column_stack([events.begin[name] for name in _HOW])
    arrays["news.begin_number"], arrays["news.end_number"] = events.begin["number"].copy(), events.end["number"].copy()


def _numbers(name: str, first: Array, second: Array, arrays: dict[str, Array]) -> Array:
    """(k, 2) particle numbers in records of this name; for files without them, the numbers of these indices, -1 for none."""
    number = np.append(arrays["particles.number"], -1)
    return arrays.get(f"news.{name}_number", np.column_stack((number[first], number[second])))


def _events(world: World, facts: Facts, arrays: dict[str, Array]) -> Events:
    events = Events()
    events._obstacles = list(world.obstacles)
    events.hit_speed = facts["hit_speed"]
    events._touching = arrays["news.touching"]
    events.end = np.zeros(len(arrays["news.end"]), CONTACT)
    surfaces = arrays.get("news.end_at", np.full(arrays["news.end"].shape, -1))
    for name, column in zip(_WHO, (*arrays["news.end"].T, *surfaces.T), strict=True):
        events.end[name] = column
    events.begin, how = np.zeros(len(arrays["news.begin"]), HIT), arrays["news.begin_how"]
    for name, column in zip(_WHO, arrays["news.begin"].T, strict=True):
        events.begin[name] = column
    events.begin["speed"], events.begin["point"], events.begin["normal"] = how[:, 0], how[:, 1:3], how[:, 3:5]
    events.begin["impulse"] = how[:, 5]
    for name, records in (("begin", events.begin), ("end", events.end)):
        records["number"] = _numbers(name, records["a"], records["b"], arrays)
    world._obstacle_arrays.begin()
    events.find_hits(world._obstacle_arrays)
    return events


def _broken(arrays: dict[str, Array]) -> Array:
    rows = arrays.get("news.broken", np.zeros((0, 4), np.int64))
    broken = np.zeros(len(rows), BROKEN)
    for name, column in zip(("link", "row", "i", "j"), rows.T, strict=True):
        broken[name] = column
    broken["force"] = arrays.get("news.broken_force", 0.0)
    broken["number"] = _numbers("broken", broken["i"], broken["j"], arrays)
    return broken


def _sleep(world: World, facts: Facts, arrays: dict[str, Array]) -> Sleep:
    sleep = Sleep()
    sleep._next = checks.integer("next", facts["next"], least=0, most=_MOST)
    sleep._members = dict(zip(arrays["news.islands"].tolist(), arrays["news.members"].tolist(), strict=True))
    asleep = np.unique(arrays["slots.island"])
    if lost := set(asleep[asleep >= 0].tolist()) - sleep._members.keys():
        raise InputError(f"slots.island has {min(lost)}; allowed are numbers of news.islands, and -1")
    if max(sleep._members, default=-1) >= sleep._next:
        raise InputError(f"news.islands has {max(sleep._members)}; allowed is less than `next`, {sleep._next}")
    # Laws hold objects of the world: only whether they were those of the frame before is stored.
    sleep._laws = {"same": laws(world), "others": OTHER_LAWS}.get(facts["laws"])
    return sleep
