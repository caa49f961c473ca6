"""Circles pour into a box and settle into a picture.

Nothing steers them. A first, hidden run finds out where each circle ends, which determines its colour from the picture. The
second run, which is shown, starts equally and so ends equally, bit for bit.
"""

import functools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.outside import read_picture
from pyverlet.common.progress import OnProgress
from pyverlet.laws.boundaries import Box
from pyverlet.laws.forces import Drag
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

RADIUS = 0.5  # root mean square radius of the circles, m
PACKING = 0.84  # fraction of a heap's area that circles cover, that of random packings; determines the size of the box
JET = 0.25  # width of the jet over that of the box
SWAYS = 5.0  # number of times that the jet sways from side to side and back
PITCH = 1.15  # spacing of neighbours in the jet, in largest diameters
SHAKE = 0.12  # largest shift of a circle in the jet along each axis, in largest radii: less than half the gap between neighbours
FALLING = 45.0  # terminal speed of a circle of 1 kg in the air, m/s: it keeps long jets together
SETTLING_S = 6.0  # time from the last circle's arrival until the heap is at rest, s
HEAPED = 0.995  # fraction of the circles whose height the picture spans: a few may lie on top
MARGIN = 0.02  # margin of the shown picture, over its longer side
Pixels = NDArray[np.uint8]  # (height, width, 3) bytes R, G, B
MOST_ASPECT = 4.0  # most extreme width / height, or its inverse, of a picture


def build(settings: Settings) -> World:
    """10,000 circles pour into a box and form a picture (--picture), with colours from a first run.

    The width of the box follows from the picture's shape if the circles fill it to its height; the circles start in a jet above
    it, which sways from side to side. Air limits their speed to 45 m/s. The default picture is a boat at sunset.
    """
    rng, radii = settings.draw_radii(RADIUS)
    width, height = _shape(settings, radii)
    centres = _jet(rng, radii, width, height)
    top = float((centres[:, 1] + radii).max()) + RADIUS
    world = settings.empty_world(Box((-width / 2, 0), (width / 2, top), **settings.surface))
    world.forces.append(Drag(linear=float(np.hypot(*settings.gravity)) / FALLING))
    world.add(position=centres, velocity=0.0, radius=radii, mass=(radii / RADIUS) ** 2)
    return world


def colours(settings: Settings, dt: float, progress: OnProgress | None = None) -> Pixels:
    """(n, 3) bytes R, G, B of the picture where each circle ends, found by running the scene once.

    Frames of another length `dt` end elsewhere. progress(done, total) is called after every frame.
    """
    pixels = _pixels(settings)
    world = build(settings)
    frames = max(1, round(lasts(settings) / dt))
    for frame in range(frames):
        world.step(dt)
        if progress:
            progress(frame + 1, frames)
    x, y = world.position.astype(np.float64).T
    width, _ = _shape(settings, world.radius)
    top = float(np.quantile(y + world.radius, HEAPED))
    rows, columns = pixels.shape[:2]
    column = np.clip((x / width + 0.5) * columns, 0, columns - 1).astype(int)
    row = np.clip((1 - y / top) * rows, 0, rows - 1).astype(int)
    return np.asarray(pixels[row, column])


def lasts(settings: Settings) -> float:
    """Seconds until the picture is complete."""
    world = build(settings)
    extent = world.boundary.extent()
    assert extent is not None
    return extent[3] / FALLING + FALLING / max(float(np.hypot(*settings.gravity)), 1.0) + SETTLING_S


def view(settings: Settings) -> tuple[float, float, float, float]:
    """x0, y0, x1, y1 in metres: the picture, not the jet above it."""
    width, height = _shape(settings, settings.draw_radii(RADIUS)[1])
    margin = MARGIN * max(width, height)
    return (-width / 2 - margin, -margin, width / 2 + margin, height + margin)


def _shape(settings: Settings, radii: Floats) -> tuple[float, float]:
    """Width and height of the heap, m, with the picture's shape and the circles' area."""
    rows, columns = _pixels(settings).shape[:2]
    area = np.pi * float((radii.astype(np.float64) ** 2).sum()) / PACKING
    width = max(float(np.sqrt(area * columns / rows)), 4.0 * float(radii.max()))
    return width, area / width


def _jet(rng: np.random.Generator, radii: Floats, width: float, height: float) -> Floats:
    """Centres (n, 2) in metres, row by row from the bottom of the box, each row slightly shifted relative to the one below."""
    largest = float(radii.max())
    pitch = 2 * largest * PITCH
    abreast = max(1, int(JET * width / pitch))
    row, place = np.divmod(np.arange(len(radii)), abreast)
    sway = max(0.5 * (width - (abreast - 1) * pitch) - (1 + SHAKE) * largest, 0.0)
    rows = row[-1] + 1
    x = (place - 0.5 * (abreast - 1)) * pitch + sway * np.sin(2 * np.pi * SWAYS * row / rows)
    centres = np.column_stack((x, (1 + SHAKE) * largest + row * pitch))
    return np.asarray(centres + rng.uniform(-SHAKE * largest, SHAKE * largest, centres.shape))


def _pixels(settings: Settings) -> Pixels:
    return _boat() if settings.picture is None else read(settings.picture)


def read(path: Path) -> Pixels:
    """The picture in a file, on white; InputError if it cannot be read, or is too long and thin."""
    pixels = read_picture(path)
    height, width = pixels.shape[:2]
    if max(width, height) > MOST_ASPECT * min(width, height):
        longer = max(width, height) / min(width, height)
        raise InputError(f"picture is '{path}', {longer:.3g} times as long as wide; allowed is at most {MOST_ASPECT:g} times")
    cover = pixels[..., 3:] / 255
    return np.asarray((pixels[..., :3] * cover + 255 * (1 - cover)).round(), np.uint8)


def boat(width: int = 640, height: int = 480) -> Pixels:
    """The default picture: a sailing boat before the evening sun."""
    x, y = np.meshgrid(np.linspace(-4 / 3, 4 / 3, width), np.linspace(1, -1, height))  # y up
    picture = np.empty((height, width, 3))

    def paint(where: NDArray[np.bool_], colour: int) -> None:
        picture[where] = [(colour >> shift) & 255 for shift in (16, 8, 0)]

    def blend(where: NDArray[np.bool_], low: int, high: int, share: NDArray[np.float64]) -> None:
        for k, shift in enumerate((16, 8, 0)):
            a, b = (low >> shift) & 255, (high >> shift) & 255
            picture[..., k][where] = (a + (b - a) * share)[where]

    horizon = -0.25
    sky, sea = y > horizon, y <= horizon
    blend(sky, 0xFFB35C, 0x3D2F7F, np.clip((y - horizon) / 1.1, 0, 1))
    blend(sea, 0x17406D, 0x0B2447, np.clip((horizon - y) / 0.75, 0, 1))
    paint(sky & (np.hypot(x - 0.45, y + 0.02) < 0.42), 0xFFE28A)
    glint = np.abs(x - 0.45) < 0.36 - 0.3 * (horizon - y)
    paint(sea & glint & (np.sin(34 * np.sqrt(np.maximum(horizon - y, 0)) + 0.5) > 0.1), 0xFFC46B)
    deck = -0.36
    hull = (y < deck) & (y > -0.58) & (np.abs(x + 0.35) < 0.58 + 0.9 * (y + 0.36))
    paint(hull, 0xB3312C)
    paint(hull & (y > deck - 0.05), 0xF5F1E6)
    paint((np.abs(x + 0.35) < 0.02) & (y > deck) & (y < 0.86), 0x3A2418)
    sail = (y > deck + 0.1) & (y < 0.8) & (x < -0.38) & (x > -0.38 - 0.52 * (0.8 - y) / 1.06)
    paint(sail, 0xFFFFFF)
    jib = (y > deck + 0.1) & (y < 0.66) & (x > -0.31) & (x < -0.31 + 0.45 * (0.66 - y) / 0.92)
    paint(jib, 0xE9573F)
    return np.asarray(picture.round(), dtype=np.uint8)


_boat = functools.cache(boat)

SCENE = Scene(
    "image", "10,000 circles pour in and settle into a picture (--picture photo.png)", build,
    Settings(particles=10_000, restitution=0.5, radius_spread=1.5), show=Show(colours=colours, view=view, seconds=lasts),
)  # fmt: skip
