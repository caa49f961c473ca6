"""Commands and view options of viewers: a closed set of small values, checked on construction.

The annotation of a field holds its type, by which messages of pages are read, and a check of its value. They are evaluated
here.
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

MAX_SUBSTEPS = 64  # per frame; more help no scene, and a slip of the mouse would freeze it
MAX_GRAVITY = 1000.0  # m/s^2 per component: a hundred times the Earth's; more is a typing error
MAX_FRICTION = 10.0  # Coulomb's coefficient: rubber on rubber has 1.2
MAX_PARTICLES = 1_000_000  # most that a page may ask for, which takes seconds to build
MAX_STEPS = 600  # frames per Step: ten seconds at 60 per second
FARTHEST = 1e9  # m; pointers farther out are beyond the precision of float32
LONGEST_KEY = 24  # letters of a key's name
BUTTONS = ("left", "middle", "right")  # of a mouse
SLOWEST = 1 / 64  # least speed: a second takes a minute


def one_of(name: str, known: Iterable[str], value: str) -> None:
    """Refuse a text that is not in `known`."""
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
"""Descriptions of field types for error messages."""


@dataclass_transform(frozen_default=True)
class Message:
    """Base class of messages: frozen dataclasses, checked by their annotations; None is not checked."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    def __post_init__(self) -> None:
        for field in fields(cast(Any, self)):
            value = getattr(self, field.name)
            for check in getattr(field.type, "__metadata__", ()) if value is not None else ():
                check(value)

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> Self:
        """A message from JSON fields; InputError unless each has the type in its annotation."""
        return cls(**{field.name: typed(field.name, said.get(field.name), field.type) for field in fields(cast(Any, cls))})


def typed(name: str, value: Any, kind: Any) -> Any:
    """A JSON value converted to an annotated type."""
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
    """Pause the world (`on`) or let it run."""

    on: bool


class Step(Message):
    """Pause, then advance by this many frames."""

    frames: Annotated[int, partial(checks.integer, "frames", most=MAX_STEPS)] = 1


class Reset(Message):
    """Return to the state at the start of the session; settings stay as the sliders show."""


class SetSpeed(Message):
    """Set the speed of time: 1 is real time, less is slow motion. Frames and their bits are unchanged."""

    value: Annotated[float, _within("speed", SLOWEST, 1.0)]


class Build(Message):
    """Replace the worlds by a scene's (None: the same scene) with this many particles (None: the scene's default)."""

    scene: Annotated[str | None, partial(one_of, "scene", scenes.SCENES)]
    particles: Annotated[int | None, partial(checks.integer, "particles", most=MAX_PARTICLES)]


class Setting(Message):
    """Base class of settings of worlds that a viewer may change."""


class SetGravity(Setting):
    """Set gravity, m/s^2, y up."""

    x: Annotated[float, _within("gravity x", -MAX_GRAVITY, MAX_GRAVITY)]
    y: Annotated[float, _within("gravity y", -MAX_GRAVITY, MAX_GRAVITY)]


class SetSubsteps(Setting):
    """Set the number of substeps per frame."""

    value: Annotated[int, partial(checks.integer, "substeps", most=MAX_SUBSTEPS)]


class SetRestitution(Setting):
    """Set the restitution of circles and walls."""

    value: Annotated[float, partial(checks.fraction, "restitution")]


class SetFriction(Setting):
    """Set the friction of circles and walls."""

    value: Annotated[float, _within("friction", 0.0, MAX_FRICTION)]


class SetIntegrator(Setting):
    """Set the integrator, by name."""

    name: Annotated[str, partial(one_of, "integrator", integrators.BY_NAME)]


class _AtPoint(Message):
    """Base class of pointer tools at (x, y), metres."""

    pointer: int
    x: Annotated[float, _within("x", -FARTHEST, FARTHEST)]
    y: Annotated[float, _within("y", -FARTHEST, FARTHEST)]


class _Picking(_AtPoint):
    """Base class of pointer tools for the particle whose rim is nearest to (x, y), if it is within `reach` metres."""

    reach: Annotated[float, _within("reach", 0.0, FARTHEST)] = 0.0


class Drag(_Picking):
    """Pull a particle towards (x, y). The first command of a pointer picks the particle; if there is none within reach, the
    pointer stays empty until it is released.
    """


class Pin(_Picking):
    """Pin a particle where it is; or release a pinned one."""


class Delete(_Picking):
    """Remove a particle, until reset."""


class Poke(_AtPoint):
    """Push everything near (x, y) away until the pointer is released."""


class Spawn(_AtPoint):
    """Add a circle of the most common size, at rest."""


class Release(Message):
    """Release what this pointer drags or pushes."""

    pointer: int


class Undo(Message):
    """Undo the last action of a pointer; time goes back, too."""


class Redo(Message):
    """Redo the last undone action."""


class SetSlider(Message):
    """Move a slider of the user's program."""

    name: str
    value: Annotated[float, partial(checks.number, "value")]


class Key(Message):
    """Pass a key to the user's program, named as in browsers: "a", " ", "ArrowLeft"."""

    key: Annotated[str, _key]


class Click(_AtPoint):
    """Pass a click at (x, y), metres, with the "left", "middle" or "right" button, to the user's program."""

    button: Annotated[str, partial(one_of, "button", BUTTONS)] = "left"


Settings = SetGravity | SetSubsteps | SetRestitution | SetFriction | SetIntegrator
PointerTool = Drag | Poke | Pin | Spawn | Delete
UserInput = SetSlider | Key | Click
Command = Pause | Step | Reset | SetSpeed | Build | Settings | PointerTool | Release | Undo | Redo | UserInput


def name_of(kind: type[Command]) -> str:
    """The name of a kind of command on pages, and of a setting of worlds: "gravity" for SetGravity."""
    return kind.__name__.removeprefix("Set").lower()


COMMANDS: dict[str, type[Command]] = {name_of(kind): kind for kind in get_args(Command)}


COLOURINGS = (*colour.COLOURINGS, "force", "picture")
"""What colours of circles show: order of adding, speed, mass, group, kinetic energy, contact force, or their own colours."""

LARGEST_SIDE = 4096  # pixels, larger than any screen; limits memory
MOST_PIXELS = 2_560 * 1_600  # of a picture drawn by the server
CLOSEST = 1e-6  # least width and height of the visible part, m


class Ack(Message):
    """Acknowledge that the page has drawn frame `seq`, and all before it."""

    seq: int


class ViewOptions(Message):
    """View options of one tab."""

    part: Rect | None = None  # of the plane, (x0, y0, x1, y1) in metres; None leaves it to the camera
    width: Annotated[int, partial(checks.integer, "width", most=LARGEST_SIDE)] = 960  # of the picture on the screen, pixels
    height: Annotated[int, partial(checks.integer, "height", most=LARGEST_SIDE)] = 720
    colour: Annotated[str, partial(one_of, "colour", COLOURINGS)] = "order"
    dark: bool = True  # dark theme
    velocity: bool = False  # whether the tab needs velocities
    force: bool = False  # whether it shows contact forces

    @property
    def pushes(self) -> bool:
        """Whether the view shows forces between circles."""
        return self.force or self.colour == "force"

    @property
    def moving(self) -> bool:
        """Whether the view depends on velocities."""
        return self.velocity or self.colour in ("speed", "energy")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.part is not None:
            for value in self.part:
                checks.number("part", value, least=-FARTHEST, most=FARTHEST)
            x0, y0, x1, y1 = self.part
            if x1 - x0 < CLOSEST or y1 - y0 < CLOSEST:
                raise InputError(f"part is {x1 - x0:g} x {y1 - y0:g} m; allowed is at least {CLOSEST:g} m each way")
