"""Everything a viewer may ask of the world: a closed set of small values, checked when they are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from pyverlet import scenes
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.laws import integrators

MAX_SUBSTEPS = 64  # more substeps than this a frame help no scene and would let a slip of the mouse freeze it
MAX_GRAVITY = 1000.0  # m/s^2 in either direction. A hundred times the Earth's is play; beyond it is a typing error.
MAX_FRICTION = 10.0  # Coulomb's coefficient: rubber on rubber has 1.2
MAX_PARTICLES = 1_000_000  # as many as a page may ask for: some seconds of building
MAX_STEPS = 600  # frames one Step may ask for: ten seconds at 60 a second
FARTHEST = 1e9  # m. Pointers further out than this would leave what float32 can tell.
LONGEST_KEY = 24  # letters of a key's name
BUTTONS = ("left", "middle", "right")  # of a mouse
SLOWEST = 1 / 64  # least speed: a second takes a minute


@dataclass(frozen=True, slots=True)
class Pause:
    """Hold the world still (`on`) or let it run."""

    on: bool


@dataclass(frozen=True, slots=True)
class Step:
    """Pause, then advance by this many frames."""

    frames: int = 1

    def __post_init__(self) -> None:
        checks.whole("frames", self.frames, most=MAX_STEPS)


@dataclass(frozen=True, slots=True)
class Reset:
    """Go back to the state the session started with; settings keep what the sliders say."""


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """How fast the world's time passes: 1 is real time, less is slow motion. The frames and their bits stay the same."""

    value: float

    def __post_init__(self) -> None:
        checks.number("speed", self.value, least=SLOWEST, most=1.0)


@dataclass(frozen=True, slots=True)
class Build:
    """Replace the worlds by a scene's (None: the same scene) with so many particles (None: the scene's own number)."""

    scene: str | None
    particles: int | None

    def __post_init__(self) -> None:
        if self.scene is not None and self.scene not in scenes.SCENES:
            raise InputError(f"scene is {self.scene[:40]!r}; allowed are {', '.join(scenes.SCENES)}")
        if self.particles is not None:
            checks.whole("particles", self.particles, most=MAX_PARTICLES)


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting of the worlds that a viewer may change."""


@dataclass(frozen=True, slots=True)
class SetGravity(Setting):
    """Set the gravity vector, m/s^2, y up."""

    x: float
    y: float

    def __post_init__(self) -> None:
        checks.number("gravity x", self.x, least=-MAX_GRAVITY, most=MAX_GRAVITY)
        checks.number("gravity y", self.y, least=-MAX_GRAVITY, most=MAX_GRAVITY)


@dataclass(frozen=True, slots=True)
class SetSubsteps(Setting):
    """Set the substeps of a frame."""

    value: int

    def __post_init__(self) -> None:
        checks.whole("substeps", self.value, most=MAX_SUBSTEPS)


@dataclass(frozen=True, slots=True)
class SetRestitution(Setting):
    """Set the restitution of circles and bounds."""

    value: float

    def __post_init__(self) -> None:
        checks.fraction("restitution", self.value)


@dataclass(frozen=True, slots=True)
class SetFriction(Setting):
    """Set the friction of circles and bounds."""

    value: float

    def __post_init__(self) -> None:
        checks.number("friction", self.value, least=0.0, most=MAX_FRICTION)


@dataclass(frozen=True, slots=True)
class SetIntegrator(Setting):
    """Set how the circles move between contacts, by the method's name."""

    name: str

    def __post_init__(self) -> None:
        if self.name not in integrators.BY_NAME:
            raise InputError(f"integrator is {self.name[:40]!r}; allowed are {', '.join(integrators.BY_NAME)}")


@dataclass(frozen=True, slots=True)
class _AtPoint:
    """Something a pointer does at (x, y), metres."""

    pointer: int
    x: float
    y: float

    def __post_init__(self) -> None:
        checks.number("x", self.x, least=-FARTHEST, most=FARTHEST)
        checks.number("y", self.y, least=-FARTHEST, most=FARTHEST)


@dataclass(frozen=True, slots=True)
class _Picking(_AtPoint):
    """Something a pointer does to the particle whose rim is nearest to (x, y), if it is within `reach` metres."""

    reach: float = 0.0

    def __post_init__(self) -> None:
        _AtPoint.__post_init__(self)
        checks.number("reach", self.reach, least=0.0, most=FARTHEST)


@dataclass(frozen=True, slots=True)
class Drag(_Picking):
    """Pull a particle towards (x, y). The first one of a pointer picks it; if there is none within reach, the pointer stays empty
    until it is released.
    """


@dataclass(frozen=True, slots=True)
class Pin(_Picking):
    """Hold a particle where it is, whatever pushes it; let go of one that is held so."""


@dataclass(frozen=True, slots=True)
class Delete(_Picking):
    """Take a particle out of the world, until reset."""


@dataclass(frozen=True, slots=True)
class Poke(_AtPoint):
    """Push everything near (x, y) away from it until the pointer is released."""


@dataclass(frozen=True, slots=True)
class Spawn(_AtPoint):
    """Add a circle, as large as most are, at rest."""


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of whatever this pointer drags or pokes."""

    pointer: int


@dataclass(frozen=True, slots=True)
class Undo:
    """Go back to before the last thing that a pointer did; time goes back, too."""


@dataclass(frozen=True, slots=True)
class Redo:
    """Go to where the last Undo was asked for."""


@dataclass(frozen=True, slots=True)
class SetSlider:
    """Move a slider of the user's program."""

    name: str
    value: float

    def __post_init__(self) -> None:
        checks.number("value", self.value)


@dataclass(frozen=True, slots=True)
class Key:
    """Tell the user's program of a key, called as browsers do: "a", " ", "ArrowLeft"."""

    key: str

    def __post_init__(self) -> None:
        if not 0 < len(self.key) <= LONGEST_KEY:
            raise InputError(f"key is {self.key[:40]!r}; allowed is the name of one, such as 'a' or 'ArrowLeft'")


@dataclass(frozen=True, slots=True)
class Click(_AtPoint):
    """Tell the user's program of a click at (x, y), metres, with the "left", "middle" or "right" button."""

    button: str = "left"

    def __post_init__(self) -> None:
        _AtPoint.__post_init__(self)
        if self.button not in BUTTONS:
            raise InputError(f"button is {self.button[:40]!r}; allowed are {', '.join(BUTTONS)}")


Settings = SetGravity | SetSubsteps | SetRestitution | SetFriction | SetIntegrator
PointerTool = Drag | Poke | Pin | Spawn | Delete
UserInput = SetSlider | Key | Click
Command = Pause | Step | Reset | SetSpeed | Build | Settings | PointerTool | Release | Undo | Redo | UserInput


def name_of(kind: type[Command]) -> str:
    """What pages call commands of this kind, and worlds this setting: "gravity" for SetGravity."""
    return kind.__name__.removeprefix("Set").lower()


COMMANDS: dict[str, type[Command]] = {name_of(kind): kind for kind in get_args(Command)}
