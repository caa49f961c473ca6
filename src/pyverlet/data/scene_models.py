"""Pydantic models of scene files, derived from the signatures of the engine's classes and builders.

Loaded only when a file is read: pydantic is installed with the command.
"""

import inspect
from collections.abc import Callable
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Field, create_model

from pyverlet.common.constants import MOST_SUBSTEPS, STANDARD_GRAVITY
from pyverlet.data.describe import KINDS, arguments_of
from pyverlet.data.scene_build import LINKS
from pyverlet.laws import boundaries, textbook
from pyverlet.laws.collisions import BruteForce, Fast
from pyverlet.laws.forces import Force
from pyverlet.laws.integrators import Integrator
from pyverlet.laws.links import Area
from pyverlet.laws.obstacles import Obstacle
from pyverlet.scenes import Settings
from pyverlet.state.state import EVERYONE
from pyverlet.world import builders
from pyverlet.world.actors import Actor

Vector = tuple[float, float]
Bits = Annotated[int, Field(ge=0, le=EVERYONE)]


class Part(BaseModel):
    """Base class of all tables: no unknown keys, no text for numbers, no NaN."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


MODELS: dict[str, type[BaseModel]] = {}  # by the `type` of a table or its key, to suggest the nearest key


def _named(name: str, fields: dict[str, Any], doc: str | None) -> type[BaseModel]:
    tag: Any = Literal[name]
    MODELS[name] = create_model(name, __base__=Part, __doc__=doc, type=(tag, ...), **fields)
    return MODELS[name]


def _one_of(models: list[Any]) -> Any:
    return Annotated[Union[tuple(models)], Field(discriminator="type")]  # noqa: UP007  (of as many as there are)


# ---- classes and functions as tables -----------------------------------------------------------------------------------

# Types of arguments by their annotation; for links and outlines, which take any array, by name.
_ANNOTATED: dict[str, Any] = {
    "str": str,
    "float": float,
    "float | None": float | None,
    "int": int,
    "int | None": int | None,
    "bool": bool,
    "Point": Vector,
    "Sequence[float]": Vector,
    "Sequence[float] | None": Vector | None,
    "Sequence[float] | Field": Vector,
    "float | tuple[float, float]": float | Vector,
    "Group | None": str | None,
    "ArrayLike": float | list[float],
    "ArrayLike | None": float | list[float] | None,
}


class OutlineDisc(Part):
    """An outline: a circle."""

    center: Vector
    radius: Annotated[float, Field(gt=0)]


_BY_NAME: dict[str, Any] = {
    "points": list[Vector],
    "outline": list[Vector] | OutlineDisc,
    "point": Vector | list[Vector] | None,
    "axes": Literal["xy", "x", "y"],
    "likes": list[list[float]],
    "kind": list[int],
}


def _fields(what: Callable[..., Any], *, skip: tuple[str, ...] = ()) -> dict[str, Any]:
    """The arguments of a class or a function as fields of a model."""
    fields: dict[str, Any] = {}
    for name, parameter in arguments_of(what).items():
        if name in skip:
            continue
        kind = _BY_NAME.get(name) or _ANNOTATED[str(parameter.annotation)]
        default = parameter.default
        if default is parameter.empty:
            fields[name] = (kind, ...)
        elif isinstance(default, int | float | tuple | str | None):
            # Infinity is a missing key, as JSON has none.
            fields[name] = (kind, default) if default not in (float("inf"),) else (kind | None, None)
        else:
            fields[name] = (kind, None)
    return fields


def _models(base: type | tuple[type, ...]) -> list[type[BaseModel]]:
    """A model for each class of the engine that derives from `base`."""
    found = []
    for name, kind in KINDS.items():
        if issubclass(kind.cls, base):
            fields = _fields(kind.cls)
            fields["state"] = (dict[str, Any] | None, None)
            found.append(_named(name, fields, inspect.getdoc(kind.cls)))
    return found


_walls = _models((boundaries.Box, boundaries.Circle))
Walls: Any = _one_of(_walls)
_ANNOTATED["Box | Circle"] = Walls
BoundaryModel: Any = _one_of(
    [*_walls, *_models((boundaries.Open, boundaries.Periodic, textbook.ClampAndFlip, textbook.ProjectOnly))]
)
_ANNOTATED["Boundary"] = BoundaryModel
Method: Any = _one_of(_models((Fast, BruteForce)))
Integrators: Any = _one_of(_models(Integrator))
Forces: Any = _one_of(_models(Force))
Obstacles: Any = _one_of(_models(Obstacle))
Actors: Any = _one_of(_models(Actor))


class Collisions(Part):
    """How circles collide."""

    type: Literal["Collisions"] = "Collisions"
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    friction: Annotated[float, Field(ge=0)] = 0.0
    rolling_resistance: Annotated[float, Field(ge=0)] = 0.0
    combine: Literal["geometric", "mean", "min", "max", "multiply"] = "geometric"
    materials: dict[str, dict[str, Annotated[float, Field(ge=0)]]] = Field(default_factory=dict)
    """What two materials have together: "rubber, ice" -> restitution, friction, rolling_resistance."""
    method: Method = Field(default_factory=lambda: MODELS["Fast"](type="Fast"))


# ---- groups ------------------------------------------------------------------------------------------------------------


class Group(Part):
    """Circles that are added together."""

    name: str | None = None
    velocity: Vector = (0.0, 0.0)
    spin: float = 0.0
    mass: Annotated[float, Field(gt=0)] | None = None
    """kg, of each; unless said, 1 kg for a radius of 0.5 m, and others by their area."""
    restitution: Annotated[float, Field(ge=0, le=1)] | None = None
    friction: Annotated[float, Field(ge=0)] | None = None
    rolling_resistance: Annotated[float, Field(ge=0)] | None = None
    inertia: Annotated[float, Field(gt=0)] | None = None
    material: str = ""
    fixed_rotation: bool = False
    category: Bits = 1
    mask: Bits = EVERYONE
    pinned: bool = False


class Fill(Group):
    """Circles spread evenly over a region, a little shaken, none on top of another."""

    type: Literal["fill"]
    region: Walls
    count: Annotated[int, Field(ge=1)]
    radius: Annotated[float, Field(gt=0)] = 0.5  # root mean square, m
    spread: Annotated[float, Field(ge=1)] = 1.0  # bound on largest / smallest radius
    seed: Annotated[int, Field(ge=0)] = 0


class Lattice(Group):
    """Circles in rows and columns, up and to the right of the first."""

    type: Literal["lattice"]
    origin: Vector
    columns: Annotated[int, Field(ge=1)]
    rows: Annotated[int, Field(ge=1)] = 1
    spacing: Vector
    radius: Annotated[float, Field(gt=0)] = 0.5


class Circles(Group):
    """Circles one by one."""

    type: Literal["circles"]
    position: list[Vector]
    radius: Annotated[float, Field(gt=0)] | list[Annotated[float, Field(gt=0)]] = 0.5


class Arrays(Part):
    """Circles from arrays in a .npz file beside this one: NAME.position, NAME.radius and so on."""

    type: Literal["arrays"]
    name: str
    file: str
    hash: str  # of the file, by `pyverlet scene freeze`: other files are refused


MODELS |= {"fill": Fill, "lattice": Lattice, "circles": Circles, "arrays": Arrays}
Groups: Any = _one_of([Fill, Lattice, Circles, Arrays])


# ---- builders and links ------------------------------------------------------------------------------------------------

BUILDERS: dict[str, Any] = {name: getattr(builders, name) for name in ("chain", "rope", "net", "cloth", "bridge", "soft_body")}
_built: dict[str, Any] = {"name": (str | None, None), "pinned": (list[int], []), "category": (int, 1), "mask": (int, EVERYONE)}
Builders: Any = _one_of(
    [_named(name, _fields(build, skip=("world",)) | _built, inspect.getdoc(build)) for name, build in BUILDERS.items()]
)

End = tuple[str, int | list[int]]  # group name and index, or several indices

_ends = {"ends": (list[End], ...)}
_ring = {"group": (str, ...), "ring": (list[int] | None, None)}
Links: Any = _one_of(
    [
        _named(name, (_ring if cls is Area else _ends) | _fields(cls, skip=("group", "ring")), inspect.getdoc(cls))
        for name, cls in LINKS.items()
    ]
)


# ---- the whole ---------------------------------------------------------------------------------------------------------


class World(Part):
    """The laws and how they are computed; see `pyverlet.World`."""

    gravity: Vector = STANDARD_GRAVITY
    integrator: Integrators | None = None
    substeps: Annotated[int, Field(ge=1, le=MOST_SUBSTEPS)] = 8
    dtype: Literal["float32", "float64"] = "float32"
    ledger: bool = False
    events: bool = False
    sleep: bool = False


class Run(Part):
    """How long it is worth watching."""

    seconds: Annotated[float, Field(gt=0)]


class View(Part):
    """What is shown."""

    part: tuple[float, float, float, float]  # x0, y0, x1, y1, m


class SceneSettings(Part):
    """Settings of a scene with a name; see `pyverlet.scenes.Settings`."""

    particles: Annotated[int, Field(ge=1)] | None = None
    substeps: Annotated[int, Field(ge=1, le=MOST_SUBSTEPS)] | None = None
    integrator: Integrators | None = None
    restitution: Annotated[float, Field(ge=0, le=1)] | None = None
    friction: Annotated[float, Field(ge=0)] | None = None
    radius_spread: Annotated[float, Field(ge=1)] | None = None
    seed: Annotated[int, Field(ge=0)] | None = None
    dtype: Literal["float32", "float64"] | None = None
    collisions: Method | Literal[False] | None = None
    gravity: Vector | None = None
    ledger: bool | None = None


assert set(SceneSettings.model_fields) <= set(Settings.__dataclass_fields__)


class Document(Part):
    """A scene of pyverlet: a world from scratch, or one with a name and other settings. SI units, y up."""

    format: Literal[1]
    name: str | None = None
    summary: str = ""
    scene: str | None = None  # name from `pyverlet list`; then only `settings`, `run` and `view` may follow
    settings: SceneSettings | None = None
    world: World = Field(default_factory=World)
    room: BoundaryModel | None = None  # Open by default
    collisions: Collisions | Literal[False] = Field(default_factory=Collisions)
    groups: list[Groups] = []
    builders: list[Builders] = []
    links: list[Links] = []
    joined: list[dict[str, Any]] = []  # links of a frozen scene, in pyverlet's own form; not to be written by hand
    forces: list[Forces] = []
    obstacles: list[Obstacles] = []
    actors: list[Actors] = []
    run: Run | None = None
    view: View | None = None
    start_hash: str | None = None  # `World.state_hash` of the start: the file is refused if its start differs


MODELS |= {
    "world": World, "run": Run, "view": View, "settings": SceneSettings, "collisions": Collisions, "OutlineDisc": OutlineDisc,
}  # fmt: skip
