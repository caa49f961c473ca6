"""Everything a viewer may ask of the world, and how it looks at it: a closed set of small values, checked when they are made.

A field's annotation holds its type, which messages of pages are read by, and a check of its value. They are evaluated here.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from types import UnionType
from typing import Annotated, Any, Self, cast, dataclass_transform, get_args, get_origin

from pyverlet import scenes
from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.shown import brief
from pyverlet.laws import integrators
from pyverlet.picture import colour
from pyverlet.picture.view import Rect

MAX_SUBSTEPS = 64  # more substeps than this a frame help no scene and would let a slip of the mouse freeze it
MAX_GRAVITY = 1000.0  # m/s^2 in either direction. A hundred times the Earth's is play; beyond it is a typing error.
MAX_FRICTION = 10.0  # Coulomb's coefficient: rubber on rubber has 1.2
MAX_PARTICLES = 1_000_000  # as many as a page may ask for: some seconds of building
MAX_STEPS = 600  # frames one Step may ask for: ten seconds at 60 a second
FARTHEST = 1e9  # m. Pointers further out than this would leave what float32 can tell.
LONGEST_KEY = 24  # letters of a key's name
BUTTONS = ("left", "middle", "right")  # of a mouse
SLOWEST = 1 / 64  # least speed: a second takes a minute


def one_of(name: str, known: Iterable[str], value: str) -> None:
    """Refuse a text that is none of these."""
    if value not in known:
        raise InputError(f"{name} is {value[:40]!r}; allowed are {', '.join(known)}")


def _key(value: str) -> None:
    if not 0 < len(value) <= LONGEST_KEY:
        raise InputError(f"key is {value[:40]!r}; allowed is the name of one, such as 'a' or 'ArrowLeft'")


def _within(name: str, low: float, high: float) -> Callable[[Any], float]:
    return partial(checks.number, name, least=low, most=high)


ALLOWED = {
    float: "is a number", int: "is a whole number", bool: "are true and false", str: "is a text",
    tuple: "are four numbers [x0, y0, x1, y1], and null",
}  # fmt: skip
"""Of the types of fields, in the sentences of refusals."""


@dataclass_transform(frozen_default=True)
class Message:
    """What a viewer says: its subclasses are frozen dataclasses, held to the checks in their annotations; None is not checked."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    def __post_init__(self) -> None:
        for field in fields(cast(Any, self)):
            value = getattr(self, field.name)
            for check in getattr(field.type, "__metadata__", ()) if value is not None else ():
                check(value)

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> Self:
        """A message of the fields that JSON has; InputError unless each is of the type in its annotation."""
        return cls(**{field.name: typed(field.name, said.get(field.name), field.type) for field in fields(cast(Any, cls))})


def typed(name: str, value: Any, kind: Any) -> Any:
    """A value of JSON as one of this type, as in annotations."""
    kind = kind.__origin__ if get_origin(kind) is Annotated else kind
    if isinstance(kind, UnionType):
        if value is None:
            return None
        kind = get_args(kind)[0]
    if get_origin(kind) is tuple and isinstance(value, list) and len(value) == len(get_args(kind)):
        return tuple(typed(name, part, each) for part, each in zip(value, get_args(kind), strict=True))
    kind = get_origin(kind) or kind
    if not isinstance(value, int | float if kind is float else kind) or isinstance(value, bool) != (kind is bool):
        raise InputError(f"{name} is {brief(value)}; allowed {ALLOWED[kind]}")
    try:
        return float(value) if kind is float else value
    except OverflowError:
        raise InputError(f"{name} is {brief(value)}; allowed is a number that fits a float") from None


class Pause(Message):
    """Hold the world still (`on`) or let it run."""

    on: bool


class Step(Message):
    """Pause, then advance by this many frames."""

    frames: Annotated[int, partial(checks.integer, "frames", most=MAX_STEPS)] = 1


class Reset(Message):
    """Go back to the state the session started with; settings keep what the sliders say."""


class SetSpeed(Message):
    """How fast the world's time passes: 1 is real time, less is slow motion. The frames and their bits stay the same."""

    value: Annotated[float, _within("speed", SLOWEST, 1.0)]


class Build(Message):
    """Replace the worlds by a scene's (None: the same scene) with so many particles (None: the scene's own number)."""

    scene: Annotated[str | None, partial(one_of, "scene", scenes.SCENES)]
    particles: Annotated[int | None, partial(checks.integer, "particles", most=MAX_PARTICLES)]


class Setting(Message):
    """A setting of the worlds that a viewer may change."""


class SetGravity(Setting):
    """Set the gravity vector, m/s^2, y up."""

    x: Annotated[float, _within("gravity x", -MAX_GRAVITY, MAX_GRAVITY)]
    y: Annotated[float, _within("gravity y", -MAX_GRAVITY, MAX_GRAVITY)]


class SetSubsteps(Setting):
    """Set the substeps of a frame."""

    value: Annotated[int, partial(checks.integer, "substeps", most=MAX_SUBSTEPS)]


class SetRestitution(Setting):
    """Set the restitution of circles and bounds."""

    value: Annotated[float, partial(checks.fraction, "restitution")]


class SetFriction(Setting):
    """Set the friction of circles and bounds."""

    value: Annotated[float, _within("friction", 0.0, MAX_FRICTION)]


class SetIntegrator(Setting):
    """Set how the circles move between contacts, by the method's name."""

    name: Annotated[str, partial(one_of, "integrator", integrators.BY_NAME)]


class _AtPoint(Message):
    """Something a pointer does at (x, y), metres."""

    pointer: int
    x: Annotated[float, _within("x", -FARTHEST, FARTHEST)]
    y: Annotated[float, _within("y", -FARTHEST, FARTHEST)]


class _Picking(_AtPoint):
    """Something a pointer does to the particle whose rim is nearest to (x, y), if it is within `reach` metres."""

    reach: Annotated[float, _within("reach", 0.0, FARTHEST)] = 0.0


class Drag(_Picking):
    """Pull a particle towards (x, y). The first one of a pointer picks it; if there is none within reach, the pointer stays empty
    until it is released.
    """


class Pin(_Picking):
    """Hold a particle where it is, whatever pushes it; let go of one that is held so."""


class Delete(_Picking):
    """Take a particle out of the world, until reset."""


class Poke(_AtPoint):
    """Push everything near (x, y) away from it until the pointer is released."""


class Spawn(_AtPoint):
    """Add a circle, as large as most are, at rest."""


class Release(Message):
    """Let go of whatever this pointer drags or pokes."""

    pointer: int


class Undo(Message):
    """Go back to before the last thing that a pointer did; time goes back, too."""


class Redo(Message):
    """Go to where the last Undo was asked for."""


class SetSlider(Message):
    """Move a slider of the user's program."""

    name: str
    value: Annotated[float, partial(checks.number, "value")]


class Key(Message):
    """Tell the user's program of a key, called as browsers do: "a", " ", "ArrowLeft"."""

    key: Annotated[str, _key]


class Click(_AtPoint):
    """Tell the user's program of a click at (x, y), metres, with the "left", "middle" or "right" button."""

    button: Annotated[str, partial(one_of, "button", BUTTONS)] = "left"


Settings = SetGravity | SetSubsteps | SetRestitution | SetFriction | SetIntegrator
PointerTool = Drag | Poke | Pin | Spawn | Delete
UserInput = SetSlider | Key | Click
Command = Pause | Step | Reset | SetSpeed | Build | Settings | PointerTool | Release | Undo | Redo | UserInput


def name_of(kind: type[Command]) -> str:
    """What pages call commands of this kind, and worlds this setting: "gravity" for SetGravity."""
    return kind.__name__.removeprefix("Set").lower()


COMMANDS: dict[str, type[Command]] = {name_of(kind): kind for kind in get_args(Command)}


COLOURINGS = (*colour.COLOURINGS, "force", "picture")
"""What a circle's colour may say: its place in the order of adding, speed, mass, group, kinetic energy, what it is pushed with,
or what it was given."""

LARGEST_SIDE = 4096  # pixels: no screen is larger, and a slip must not ask for gigabytes
MOST_PIXELS = 2_560 * 1_600  # of a picture that the server draws
CLOSEST = 1e-6  # least width and height of the part, m


class Ack(Message):
    """The page has drawn frame `seq`, and with it all before."""

    seq: int


class ViewOptions(Message):
    """A tab's view."""

    part: Rect | None = None  # of the plane, (x0, y0, x1, y1) in metres; None leaves it to the camera
    width: Annotated[int, partial(checks.integer, "width", most=LARGEST_SIDE)] = 960  # pixels it may take on the screen
    height: Annotated[int, partial(checks.integer, "height", most=LARGEST_SIDE)] = 720
    colour: Annotated[str, partial(one_of, "colour", COLOURINGS)] = "order"
    dark: bool = True  # whether the page is
    velocity: bool = False  # whether the tab needs to know velocities
    force: bool = False  # whether it shows what circles push each other with

    @property
    def pushes(self) -> bool:
        """Whether what is drawn depends on forces between circles."""
        return self.force or self.colour == "force"

    @property
    def moving(self) -> bool:
        """Whether what is drawn depends on velocities."""
        return self.velocity or self.colour in ("speed", "energy")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.part is not None:
            for value in self.part:
                checks.number("part", value, least=-FARTHEST, most=FARTHEST)
            x0, y0, x1, y1 = self.part
            if x1 - x0 < CLOSEST or y1 - y0 < CLOSEST:
                raise InputError(f"part is {x1 - x0:g} x {y1 - y0:g} m; allowed is at least {CLOSEST:g} m each way")
