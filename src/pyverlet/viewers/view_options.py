"""The view options of one tab: which part of a frame, how large, in which colours."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.picture import colour
from pyverlet.picture.view import Rect
from pyverlet.viewers.commands import FARTHEST, Checked, one_of

COLOURINGS = (*colour.COLOURINGS, "force", "picture")
"""What a circle's colour may say: its place in the order of adding, speed, mass, group, kinetic energy, what it is pushed with,
or what it was given."""

LARGEST_SIDE = 4096  # pixels: no screen is larger, and a slip must not ask for gigabytes
MOST_PIXELS = 2_560 * 1_600  # of a picture that the server draws
CLOSEST = 1e-6  # least width and height of the part, m


@dataclass(frozen=True, slots=True)
class ViewOptions(Checked):
    """A tab's view."""

    part: Rect | None = None  # of the plane, (x0, y0, x1, y1) in metres; None leaves it to the camera
    width: Annotated[int, partial(checks.whole, "width", most=LARGEST_SIDE)] = 960  # pixels it may take on the screen
    height: Annotated[int, partial(checks.whole, "height", most=LARGEST_SIDE)] = 720
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
        Checked.__post_init__(self)
        if self.part is not None:
            for value in self.part:
                checks.number("part", value, least=-FARTHEST, most=FARTHEST)
            x0, y0, x1, y1 = self.part
            if x1 - x0 < CLOSEST or y1 - y0 < CLOSEST:
                raise InputError(f"part is {x1 - x0:g} x {y1 - y0:g} m; allowed is at least {CLOSEST:g} m each way")
