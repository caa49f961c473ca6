"""Builds the world of a scene document, with settings that override it."""

import copy
import hashlib
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.common.outside import file_errors
from pyverlet.data import describe_links, serialize
from pyverlet.data.atomic_file import replacing
from pyverlet.data.describe import Builder, describe
from pyverlet.laws.boundaries import Boundary, Box, Circle
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import Integrator
from pyverlet.laws.links import Angle, AngleLimit, Area, Motor, Pin, Rope, Spring, Stick
from pyverlet.scenes import Settings, _start
from pyverlet.state.group import Group
from pyverlet.world import builders
from pyverlet.world.world import World

Table = dict[str, Any]

LATER = ("rolling_resistance", "inertia", "material", "fixed_rotation")
COLUMNS = ("position", "velocity", "spin", "radius", "mass", "restitution", "friction", *LATER, "category", "mask")
"""Arrays of a group stored as arrays; files of older versions lack the later ones."""

HALF = 0.5  # m: circles of this radius have 1 kg by default

LINKS: dict[str, Any] = {cls.__name__: cls for cls in (Stick, Rope, Spring, Pin, Angle, AngleLimit, Motor, Area)}
_COMMON = ("velocity", "spin", "restitution", "friction", *LATER, "category", "mask")


class Recipe:
    """Builds the world of a validated document from the file at `path`."""

    def __init__(self, document: Table, path: Path) -> None:
        self._document, self._path = document, path
        world = document.get("world", {})
        with self._explained():
            collisions = self._collisions(document)
            boundary = self._boundary(document)
            method = collisions.method if collisions else None
            laws = collisions or boundary
            self.defaults = Settings(
                substeps=world.get("substeps", 8),
                integrator=Builder().build("integrator", world.get("integrator") or {"type": "TimeCorrectedVerlet"}, Integrator),
                restitution=float(getattr(laws, "restitution", 0.0)),
                friction=float(getattr(laws, "friction", 0.0)),
                seed=next((int(group.get("seed", 0)) for group in self._fills(document)), 0),
                dtype=np.float64 if world.get("dtype") == "float64" else np.float32,
                collisions=method,
                gravity=tuple(world.get("gravity", Settings().gravity)),
                ledger=world.get("ledger", False),
                radius_spread=max((float(group.get("spread", 1.0)) for group in self._fills(document)), default=1.0),
                particles=sum(group["count"] for group in self._fills(document)) or 1,
            )
        if not self._fills(document):  # no fill whose number could change
            count = len(self._world(document, self.defaults))
            self.defaults = Settings(**vars(self.defaults) | {"particles": max(count, 1)})

    def build(self, settings: Settings) -> World:
        """Build the world of this scene file."""
        document = copy.deepcopy(self._document)
        with self._explained():
            changed = self._change(document, settings)
        world = self._world(document, settings)
        known = document.get("start_hash")
        if known is not None and not changed and world.state_hash() != known:
            raise InputError(
                f"'{self._path}': start_hash is {known}, and the start is {world.state_hash()}; allowed is the start of then "
                "(other versions may draw other numbers: `pyverlet scene freeze` keeps the numbers themselves)"
            )
        return world

    def copy_arrays(self, folder: Path) -> None:
        """Copy the array files beside the scene file to another folder."""
        for name in {group["file"] for group in self._document.get("groups", []) if group["type"] == "arrays"}:
            if (self._path.parent / name).resolve() != (folder / name).resolve():
                content = self._read_beside(name)
                with replacing(folder / name) as file:
                    file.write(content)

    def _read_beside(self, name: str) -> bytes:
        if Path(name).name != name:
            raise InputError(f"file is {name!r}; allowed is the name of one beside '{self._path}'")
        path = self._path.parent / name
        with file_errors("file", path, "read"):
            return path.read_bytes()

    def _fills(self, document: Table) -> list[Table]:
        return [group for group in document.get("groups", []) if group["type"] == "fill"]

    def _change(self, document: Table, settings: Settings) -> bool:
        """Apply settings to the document. Returns whether that changes the start."""
        usual, fills = self.defaults, self._fills(document)
        changed = settings.dtype is not usual.dtype
        if settings.particles != usual.particles:
            if not fills:
                raise InputError(f"particles is {settings.particles}; allowed is {usual.particles}, since no group is a fill")
            share, left = settings.particles / usual.particles, settings.particles
            for group in fills[:-1]:
                group["count"] = min(round(group["count"] * share), left)
                left -= group["count"]
            fills[-1]["count"] = left
            document["groups"] = [group for group in document["groups"] if group.get("count", 1)]
            changed = True
        if settings.radius_spread != usual.radius_spread:
            if not fills:
                raise InputError(f"radius_spread is {settings.radius_spread:g}; allowed is none, since no group is a fill")
            for group in fills:
                group["spread"] = settings.radius_spread
            changed = True
        if settings.seed != usual.seed:
            for seeded in (*fills, *(actor for actor in document.get("actors", []) if actor["type"] == "Emitter")):
                seeded["seed"] = (seeded.get("seed", 0) + settings.seed - usual.seed) % 2**63
            changed = True
        for name in ("restitution", "friction"):
            value = getattr(settings, name)
            if value == getattr(usual, name):
                continue
            if document.get("collisions", {}) is not False:
                document.setdefault("collisions", {})[name] = value
            room = document.get("room", {})
            room = room.get("room", room)  # the textbook ones contain theirs
            for surface in (room, *document.get("obstacles", [])):
                if surface.get("type", "Open") != "Open":
                    surface[name] = value
        if settings.collisions is None:
            document["collisions"] = False
        elif document.get("collisions", {}) is not False or usual.collisions is not settings.collisions:
            laws = document.get("collisions") or {"restitution": settings.restitution, "friction": settings.friction}
            document["collisions"] = laws | {"method": describe(settings.collisions)}
        return changed

    @contextmanager
    def _explained(self, where: str = "") -> Iterator[None]:
        """Context that prefixes errors with the file, and the place in it."""
        try:
            yield
        except InputError as error:
            said = str(error)
            place = f"'{self._path}': " + (f"{where}: " if where and not said.startswith(where) else "")
            raise InputError(said if said.startswith(f"'{self._path}'") else place + said) from None

    def _boundary(self, document: Table) -> Boundary:
        boundary: Boundary = Builder().build("room", document.get("room") or {"type": "Open"}, Boundary)
        return boundary

    def _collisions(self, document: Table) -> Collisions | None:
        table = document.get("collisions", {})
        return None if table is False else Builder().build("collisions", {**table, "type": "Collisions"}, Collisions)

    def _world(self, document: Table, settings: Settings) -> World:
        said = document.get("world", {})
        with self._explained():
            own = {name: said.get(name, False) for name in ("events", "sleep")}
            world = settings.empty_world(self._boundary(document), collisions=self._collisions(document), **own)
        named: dict[str, Group] = {}
        for k, table in enumerate(document.get("groups", [])):
            with self._explained(f"groups[{k}]"):
                self._name(named, table, self._group(world, table))
        for k, table in enumerate(document.get("builders", [])):
            with self._explained(f"builders[{k}]"):
                options = {key: value for key, value in table.items() if key not in ("type", "name", "pinned")}
                if isinstance(options.get("outline"), dict):
                    options["outline"] = builders.disc(**options["outline"])
                built = getattr(builders, table["type"])(world, **options)
                if table.get("pinned"):
                    built.group.pin(table["pinned"])
                self._name(named, table, built.group)
        for k, table in enumerate(document.get("links", [])):
            with self._explained(f"links[{k}]"):
                world.links.append(_link(table, named))
        with self._explained():
            if document.get("joined"):
                describe_links.build(world, [_columns(table) for table in document["joined"]])
            tables: dict[str, list[Table]] = {}
            for key in ("forces", "obstacles", "actors"):
                tables[key] = [{n: v for n, v in table.items() if v is not None} for table in document.get(key, [])]
                for k, table in enumerate(tables[key]):
                    if isinstance(table.get("group"), str):
                        table["group"] = _named(named, f"{key}[{k}]: group", table["group"])
            Builder(world=world).build_all(tables)
        return world

    def _name(self, named: dict[str, Group], table: Table, group: Group) -> None:
        name = table.get("name")
        if name in named:
            raise InputError(f"name is {name!r}, which another group has; allowed is one of its own")
        if name is not None:
            named[name] = group

    def _group(self, world: World, table: Table) -> Group:
        if table["type"] == "arrays":
            return self._from_arrays(world, table)
        radius = np.asarray(table.get("radius", HALF), float)
        if table["type"] == "fill":
            position, radius = _fill(table)
        elif table["type"] == "lattice":
            column, row = np.meshgrid(np.arange(table["columns"]), np.arange(table["rows"]))
            position = np.array(table["origin"]) + np.column_stack((column.ravel(), row.ravel())) * np.array(table["spacing"])
        else:
            position = np.array(table["position"], float).reshape(-1, 2)
        mass = table.get("mass")
        common = {key: table[key] for key in _COMMON if table.get(key) is not None}
        group = world.add(position=position, radius=radius, mass=(radius / HALF) ** 2 if mass is None else mass, **common)
        if table.get("pinned"):
            group.pin()
        return group

    def _from_arrays(self, world: World, table: Table) -> Group:
        path, content = self._path.parent / table["file"], self._read_beside(table["file"])
        if hash_of(content) != table["hash"]:
            raise InputError(f"file '{path}' has the hash {hash_of(content)}; allowed is {table['hash']}, the file of then")
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                places = {key: f"{table['name']}.{key}" for key in COLUMNS}
                columns = {key: arrays[place] for key, place in places.items() if place in arrays or key not in LATER}
        except (ValueError, KeyError, OSError) as error:
            raise InputError(f"file '{path}' lacks the arrays of {table['name']!r} ({error})") from None
        own = {key: columns.pop(key) for key in ("restitution", "friction", "rolling_resistance", "inertia") if key in columns}
        group = world.add(**columns)
        for key, column in own.items():  # negative: the world's default
            setattr(group, key, column)
        return group


def _fill(table: Table) -> tuple[Any, Any]:
    """Centres and radii of circles that fill a region."""
    rng = np.random.default_rng(table.get("seed", 0))
    radii = _start.draw_radii(rng, table["count"], table.get("spread", 1.0), table.get("radius", HALF))
    region = Builder().build("region", table["region"], (Box, Circle))
    if isinstance(region, Box):
        (x0, y0), (x1, y1) = region.lower, region.upper
        centres, corner = _start.in_box(rng, radii, x1 - x0, y1 - y0), np.array([(x0 + x1) / 2, y0])
    else:
        centres, corner = _start.in_circle(rng, radii, region.radius), np.array(region.center)
    if centres is None:
        raise InputError(
            f"count is {table['count']}, and so many circles do not fit into the region; allowed are fewer, or smaller"
        )
    return centres + corner, radii


def _link(table: Table, named: dict[str, Group]) -> Any:
    options = {key: value for key, value in table.items() if key not in ("type", "ends", "group", "ring") and value is not None}
    if table["type"] == "Area":
        return Area(_named(named, "group", table["group"]), table.get("ring"), **options)
    ends = [(_named(named, "ends", name), index) for name, index in table["ends"]]
    return LINKS[table["type"]](*ends, **options)


def _named(named: dict[str, Group], key: str, name: str) -> Group:
    if name not in named:
        hint = did_you_mean(name, named)
        raise InputError(
            f"{key} is {name!r}{hint}; allowed are the groups and builders with a name: {', '.join(named) or 'none'}"
        )
    return named[name]


def _columns(table: Table) -> Table:
    """Convert the lists of a frozen link to arrays."""
    found = serialize.unpack(table)
    kinds = {"intact": np.uint8, "particles": np.int64}

    def arrays(values: Table) -> Table:
        return {key: np.array(each, kinds.get(key, float)) if isinstance(each, list) else each for key, each in values.items()}

    return arrays(found) | {"state": arrays(found.get("state", {}))}


def hash_of(content: bytes) -> str:
    """The hash of an array file, 16 hex digits."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()
