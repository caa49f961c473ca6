"""The raster: every disc covers exactly its area, rims that meet add up, and equal worlds give equal bytes."""

import hashlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.uncompiled import UNCOMPILED

import pyverlet as pv
from pyverlet.core import unit
from pyverlet.picture import DARK, LIGHT, ByOrigin, BySpeed, Raster, View
from pyverlet.picture.colour import swapped
from pyverlet.viewers.frames import outline

WHITE = 0xFFFFFF
CACHE = UNCOMPILED("tools", np.float32)
CROWD, FINE, SIZES = CACHE.CROWD, CACHE.FINE, float(CACHE.SIZES)


def draw_discs(pixels: NDArray[Any], ground: NDArray[Any], position: NDArray[Any], *others: Any) -> None:
    unit("tools", position.dtype).draw_discs(pixels, ground, position, *others)


def draw_lines(pixels: NDArray[Any], ends: NDArray[Any], *others: Any) -> None:
    unit("tools", ends.dtype).draw_lines(pixels, ends, *others)


def covered(
    position: Any, radius: Any, size: tuple[int, int] = (100, 80), *, at_a_time: int | None = None
) -> NDArray[np.float64]:
    """(h, w) what part of each pixel these discs cover, in a picture of a pixel a metre with (0, 0) at its lower left."""
    width, height = size
    pixels = np.zeros((height, width), dtype=np.uint32)
    position = np.atleast_2d(np.asarray(position, dtype=np.float64))
    radius = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(position)).copy()
    colour = np.full(len(position), WHITE, dtype=np.uint32)
    ground = np.zeros_like(pixels)
    for k in range(0, len(radius), at_a_time or len(radius)):
        some = slice(k, k + (at_a_time or len(radius)))
        draw_discs(pixels, ground, position[some], radius[some], colour[some], 0.0, float(height), 1.0)
    return np.asarray((pixels >> 24) / 255)


def rounding(radius: float) -> float:
    """Largest error of the sum over a disc's pixels: each of at most 8 r + 8 on the rim is rounded to 1/255."""
    return (8 * radius + 8) * 0.5 / 255


@pytest.mark.parametrize("radius", [0.5, 0.7, 1.0, 1.6, 2.5, 6.0, 17.3, 37.0])
def test_a_disc_covers_its_area(radius: float) -> None:
    # The sum over all pixels is pi r^2 wherever the centre is. Off by the rounding to 255 levels, which averages out over places:
    # the mean of m errors, each uniform and independent, is within 4 standard deviations.
    rng = np.random.default_rng(1)
    errors = [covered(rng.uniform((49, 39), (51, 41)), radius).sum() - np.pi * radius**2 for _ in range(40)]
    assert np.abs(errors).max() < rounding(radius)
    deviation = np.sqrt((8 * radius + 8) / 12) / 255
    assert abs(np.mean(errors)) < 4 * deviation / np.sqrt(len(errors)) + 2e-6 * (8 * radius + 8)


def test_every_pixel_is_exact() -> None:
    # Against counting: 400 x 400 points in each pixel. A rim no longer than 2 crosses it: off by some 2 x 2 / 400.
    position, radius = np.array([4.3, 3.8]), 2.7
    grid = (np.arange(8 * 400) + 0.5) / 400
    inside = np.hypot(grid[None, :] - position[0], (8 - grid[:, None]) - position[1]) <= radius
    counted = inside.reshape(8, 400, 8, 400).mean(axis=(1, 3))
    assert covered(position, radius, (8, 8)) == pytest.approx(counted, abs=0.5 / 255 + 2 * 2 / 400)


def test_a_disc_across_the_edge_of_the_picture_is_the_same_inside() -> None:
    whole = covered((30.3, 20.6), 9.2)
    assert covered((0.3, 20.6), 9.2)[:, :20] == pytest.approx(whole[:, 30:50])
    assert covered((30.3, 79.6), 9.2)[:10] == pytest.approx(whole[59:69], abs=1e-9)
    assert covered((-9.3, 20.6), 9.2).sum() == 0


def test_rims_that_meet_add_up_in_any_order() -> None:
    # Two discs that touch cover 2 pi r^2, though their rims share pixels.
    a, b = (20.3, 30.2), (20.3 + 2 * 4.1 * np.cos(0.4), 30.2 + 2 * 4.1 * np.sin(0.4))
    both = covered([a, b], 4.1)
    assert both.sum() == pytest.approx(2 * np.pi * 4.1**2, abs=2 * rounding(4.1))
    assert covered([b, a], 4.1).tolist() == both.tolist()


def test_a_disc_over_another_hides_it() -> None:
    pixels = np.zeros((20, 20), dtype=np.uint32)
    colour = np.array([0x0000FF, 0x00FF00], dtype=np.uint32)  # red below, green above
    draw_discs(pixels, np.zeros_like(pixels), np.full((2, 2), 10.0), np.array([8.0, 5.0]), colour, 0.0, 20.0, 1.0)
    rgba = pixels.view(np.uint8).reshape(20, 20, 4).astype(int)
    red, green, alpha = rgba[..., 0], rgba[..., 1], rgba[..., 3]
    assert red[10, 10] == 0
    assert green[10, 10] == 255
    assert green.sum() / 255 == pytest.approx(np.pi * 5**2, abs=rounding(5))
    # Where both are, they share the pixel and leave no ground: red + green = A, each rounded once.
    assert np.abs(red + green - alpha).max() <= 2


def test_small_circles_keep_their_area_and_specks_stay_visible() -> None:
    assert covered((3.4, 3.6), 0.45).sum() == pytest.approx(np.pi * 0.45**2, abs=0.5 / 255)
    assert covered((3.4, 3.6), 1e-6).sum() == pytest.approx(np.pi * 0.35**2, abs=0.5 / 255)


@pytest.mark.parametrize("where", [np.nan, np.inf, -np.inf, 1e30, -1e30])
def test_what_is_nowhere_is_not_drawn(where: float) -> None:
    assert covered([(where, 5.0), (5.0, where)], 1.0).sum() == 0
    assert covered((5.0, 5.0), np.inf).sum() == 0


@pytest.mark.parametrize("radius", [1e6, pytest.param(1e7, marks=pytest.mark.slow)])
def test_a_huge_disc_fills_the_picture(radius: float) -> None:
    assert (covered((50.0, 40.0), radius) == 1).all()


def test_the_floor_of_a_cage_is_exact_and_its_wall_is_outside() -> None:
    world = pv.World(boundary=pv.Circle(radius=30.0))
    view = View(-50.0, 40.0, 1.0, 100, 80)
    picture = Raster((100, 80), theme=LIGHT)
    rgba = picture.draw(world, view, outlines=outline(world.boundary), colours=np.zeros(0, np.uint32))
    inside = (rgba[..., :3] == 255).all(axis=2)
    y, x = np.mgrid[39.5:-40:-1, -49.5:50]
    far = np.hypot(x, y)
    assert inside[far < 29].all()
    assert not inside[far > 30.8].any()
    wall = rgba[40 - 1, 50 + 31]  # a pixel and a half outside
    assert wall[0] < 200
    assert tuple(rgba[0, 0, :3]) == (0xF3, 0xF4, 0xF6)


def test_without_walls_there_is_a_grid() -> None:
    world = pv.World()
    rgba = Raster((400, 300)).draw(world, View(-2.0, 1.5, 100.0, 400, 300), colours=np.zeros(0, np.uint32))
    colours, counts = np.unique(rgba.view(np.uint32), return_counts=True)
    # A line a metre (100 pixels, the first round distance over 60): 4 upright and 3 level ones, which cross 12 times.
    assert dict(zip(colours.tolist(), counts.tolist(), strict=True)) == {
        swapped(DARK.grid): 4 * 300 + 3 * 400 - 12,
        swapped(DARK.ground): 400 * 300 - (4 * 300 + 3 * 400 - 12),
    }


def picture_hash(threads: int, frames: int) -> str:
    world = pv.scenes.get("cage").world(particles=3000, threads=threads)
    picture, colouring = Raster((320, 240)), BySpeed()
    lines = outline(world.boundary)
    view = View.fit((-36, -36, 36, 36), (320, 240))
    digest = hashlib.blake2b(digest_size=16)
    for _ in range(frames):
        world.step(1 / 60)
        digest.update(picture.draw(world, view, outlines=lines, colours=colouring.colours(world, DARK)).tobytes())
    return digest.hexdigest()


def test_equal_worlds_give_equal_bytes_for_any_number_of_threads() -> None:
    expected = picture_hash(1, 12)
    assert picture_hash(1, 12) == expected
    if pv.common.threads.max_threads() > 1:
        assert picture_hash(2, 12) == expected


def test_the_picture_follows_the_world() -> None:
    assert picture_hash(1, 5) != picture_hash(1, 6)


def test_obstacles_cover_the_area_they_have() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (20, 10)))
    world.obstacles += [
        pv.Disc((4, 5), 2.0),
        pv.Polygon([(8, 2), (12, 3), (9, 8)]),
        pv.Chain([(14, 2), (16, 8), (18, 2)], radius=0.25),
    ]
    view = View.fit((0, 0, 20, 10), (400, 200))
    canvas = Raster((400, 200))
    bare = pv.World(boundary=world.boundary)
    none = np.zeros(0, np.uint32)
    room = [((0, 0), (20, 0), (20, 10), (0, 10))]
    before = canvas.draw(bare, view, outlines=room, colours=none).copy()
    after = canvas.draw(world, view, outlines=room, colours=none).astype(float)
    red = (after - before)[..., 0] / ((canvas.theme.obstacle >> 16) - (canvas.theme.inside >> 16))
    # In pixels of 1/400 m^2: a disc drawn with 46 sides, a triangle, two bars that share one round end and cross there.
    # The rim is right on average except at corners: a pixel for each.
    assert red[:, :140].sum() / 400 == pytest.approx(np.pi * 4, rel=5e-3)
    assert red[:, 140:260].sum() / 400 == pytest.approx(0.5 * abs(4 * 6 - 1 * 1), rel=5e-3)
    length = np.hypot(2, 6)
    assert red[:, 260:].sum() / 400 == pytest.approx(2 * 0.5 * length + np.pi / 16, rel=2e-2)
    assert (canvas.draw(bare, view, outlines=room, colours=none) == before).all()


def test_lines_cover_their_width() -> None:
    # A line of width 2 and length L covers 2 L + pi; with rims a pixel soft, each pixel is right to a few hundredths.
    lines = [(20.3, 30.2, 70.1, 44.9), (20.5, 60.0, 20.5, 10.0), (10.0, 40.25, 80.0, 40.25), (50, 50, 50, 50)]
    for ends in np.array(lines, dtype=np.float32).reshape(-1, 2, 2):
        pixels = np.zeros((80, 100), dtype=np.uint32)
        draw_lines(pixels, ends[None], np.full(1, WHITE, dtype=np.uint32), 0.0, 80.0, 1.0, 1.0)
        length = float(np.hypot(*np.subtract(*ends)))
        assert (pixels & 0xFF).sum() / 255 == pytest.approx(2 * length + np.pi, abs=0.02 * length + 0.3)
        assert not (pixels >> 24).any()
    draw_lines(pixels, np.full((1, 2, 2), np.nan), np.full(1, WHITE, dtype=np.uint32), 0.0, 80.0, 1.0, 1.0)


def test_links_are_drawn_in_the_colour_of_their_pull() -> None:
    world = pv.World(boundary=pv.Box((-2, -4), (2, 1)), dtype=np.float64)
    group = world.add(position=[(-1, 0), (-1, -2), (1, 0), (1, -2)], radius=0.1, mass=(1.0, 9.0, 1.0, 1.0))
    group.pin([0, 2])
    links = world.links.append(pv.Stick(group, [0, 2], [1, 3], breaking_force=[200.0, 5.0]))
    view = View.fit((-2, -4, 2, 1), (200, 250))

    def between(x: float) -> Any:
        colours = ByOrigin().colours(world, DARK)
        picture = Raster((200, 250)).draw(world, view, outlines=outline(world.boundary), colours=colours)
        column, row = (int(value) for value in view.to_screen((x, -1.0)))
        return picture[row, column - 3 : column + 4, :3].astype(int).max(axis=0)

    bare = between(0.0)
    calm = between(1.0)
    assert (between(-1.0) == calm).all()  # nothing pulls yet
    assert (calm != bare).any()
    world.run(seconds=0.5)
    assert links.intact.tolist() == [True, False]
    assert (between(1.0) == bare).all()
    assert (between(-1.0) != bare).any()


def test_discs_that_have_turned_have_marks() -> None:
    # 20 pixels a metre: radii of 40, 4 and 3 pixels, of which the last is too small for one.
    world = pv.World(boundary=pv.Box((0, 0), (10, 8)))
    world.add(position=[(3, 4), (6, 2), (8, 2)], radius=[2.0, 0.2, 0.15])
    view, raster_ = View.fit((0, 0, 10, 8), (200, 160)), Raster((200, 160))
    colours = np.full(3, 0x4080C0, np.uint32)

    def picture() -> NDArray[np.int64]:
        return raster_.draw(world, view, colours=colours)[..., :3].astype(np.int64)

    plain = picture()
    world.angle[:] = np.deg2rad([90, 0, 0])
    marked = picture()
    rows, columns = np.nonzero((marked != plain).any(axis=2))
    # From the centre (60, 80) up to the rim and from (120, 120) to the right, each 1.4 pixels wide and half as bright.
    up = rows < 100
    assert (columns[up].min(), columns[up].max()) == (59, 60)
    assert (rows[up].min(), rows[up].max()) == (39, 80)
    assert np.abs(marked[60, 60] - plain[60, 60] / 2).max() < 0.35 * plain[60, 60].max()
    assert (columns[~up].min(), columns[~up].max()) == (119, 124)
    assert (rows[~up].min(), rows[~up].max()) == (119, 120)


def test_a_crowd_narrower_than_pixels_covers_their_sum_and_has_their_mean_colour_in_any_order() -> None:
    """A pixel has A = sum of 255 pi r^2, at most 255, and beside that its ground; the colour of what covers it is the mean."""
    rng = np.random.default_rng(3)
    count, size, r = 3000, 40, 0.4
    place = rng.uniform(0, size, (count, 2))
    colour = rng.integers(0, 1 << 24, count).astype(np.uint32)
    ground = np.full((size, size), 0x405060, dtype=np.uint32)
    pictures = []
    for order in (np.arange(count), rng.permutation(count)):
        pixels = ground.copy()
        draw_discs(pixels, ground, place[order], np.full(count, r), colour[order], 0.0, float(size), 1.0)
        pictures.append(pixels)
    assert (pictures[0] == pictures[1]).all()
    column, row = place[:, 0].astype(int), (size - place[:, 1]).astype(int)
    each = int(255 * np.pi * r * r + 0.5)
    covered = np.zeros((size, size))
    np.add.at(covered, (row, column), each)
    rgba = pictures[0].view(np.uint8).reshape(size, size, 4).astype(int)
    assert (rgba[..., 3] == np.minimum(covered, 255)).all()
    bare = np.maximum(1 - covered / 255, 0)
    for k, old in enumerate((0x60, 0x50, 0x40)):
        total = np.zeros((size, size))
        np.add.at(total, (row, column), each * ((colour >> (8 * k)) & 255).astype(float))
        expected = total * np.minimum(1 / np.maximum(covered, 1), 1 / 255) + bare * old
        assert np.abs(rgba[..., k] - expected).max() <= 0.5 + 1e-9


def test_a_few_narrow_discs_cover_what_a_crowd_would() -> None:
    """The same discs, one by one and together with many far away: the same pixels, each rounded once more."""
    rng = np.random.default_rng(4)
    place, colour = np.column_stack((np.arange(10) + 0.5, np.full(10, 0.5))), np.full(10, 0x3060C0, dtype=np.uint32)
    ground = np.full((20, 20), 0x202020, dtype=np.uint32)
    alone, crowd = ground.copy(), ground.copy()
    draw_discs(alone, ground, place, np.full(10, 0.3), colour, 0.0, 20.0, 1.0)
    others = rng.uniform((0, 10), (20, 20), (500, 2))
    all_of_them, colours = np.concatenate((place, others)), np.concatenate((colour, np.zeros(500, np.uint32)))
    draw_discs(crowd, ground, all_of_them, np.full(510, 0.3), colours, 0.0, 20.0, 1.0)
    few = [picture.view(np.uint8).reshape(20, 20, 4)[-1].astype(int) for picture in (alone, crowd)]
    assert (few[0][:10, 3] > 0).all()
    assert np.abs(few[0] - few[1]).max() <= 1


def one_by_one(position: Any, radius: Any, size: tuple[int, int]) -> NDArray[np.float64]:
    """`covered`, in parts too small to be a crowd."""
    return covered(position, radius, size, at_a_time=CROWD // 2)


def on_a_lattice(radius: Any, apart: float, rng: Any) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Places of so many discs that do not meet, and the size of a picture on which the outermost are cut off."""
    side = int(np.ceil(np.sqrt(len(radius))))
    row, column = np.divmod(np.arange(len(radius)), side)
    place = apart * np.column_stack((column, row)) + rng.uniform(0, 1, (len(radius), 2))
    return place, (int(apart * (side - 1)) + 1, int(apart * (side - 1)) + 1)


@pytest.mark.parametrize("radius", [0.5, 0.77, 1.3, 2.9, 8.0])
def test_discs_of_a_crowd_are_as_large_as_others_and_nearly_where_they_are(radius: float) -> None:
    # A stamp is aside by 1 / 2 FINE at most along each axis, so that the rim within a pixel, no longer than 2, shifts by no more
    # than its diagonal: sqrt(2) / 32 * 2, and rounding on both sides.
    rng = np.random.default_rng(5)
    radii = np.full(4 * CROWD, radius)
    place, size = on_a_lattice(radii, 2 * radius + 4, rng)
    crowd, others = covered(place, radii, size), one_by_one(place, radii, size)
    assert (crowd != others).any()
    assert np.abs(crowd - others).max() <= np.sqrt(2) / FINE + 1 / 255
    # Of those that are on the picture as a whole: the mean error of their areas is that of the rounding, as for single discs, but
    # of the FINE x FINE places eight at a time are mirror images with the same errors.
    whole = np.all((place > radius) & (place < np.array(size) - radius), axis=1)
    area = covered(place[whole], radii[whole], size).sum() / whole.sum()
    deviation = np.sqrt((8 * radius + 8) / 12) / 255
    assert abs(area - np.pi * radius**2) < 4 * deviation / np.sqrt(FINE**2 / 8) + 2e-6 * (8 * radius + 8)


@pytest.mark.slow
def test_discs_of_a_crowd_of_many_sizes_are_nearly_as_large_as_others() -> None:
    # One stamp serves radii within a factor exp(1 / 128), more stamps than there is room for: areas are within two of these.
    rng = np.random.default_rng(6)
    radii = rng.uniform(0.4, 9.0, 30 * CROWD)
    place, size = on_a_lattice(radii, 22, rng)
    crowd, others = covered(place, radii, size), one_by_one(place, radii, size)
    corner = (22 * np.arange(int(np.ceil(np.sqrt(len(radii))))) - 10).clip(0)
    sums = [np.add.reduceat(np.add.reduceat(picture[::-1], corner, 0), corner, 1) for picture in (crowd, others)]
    assert np.abs(sums[0] - sums[1]).max() > 0
    assert (np.abs(sums[0] - sums[1]) <= 2 / SIZES * sums[1] + rounding(9.0)).all()


def test_a_crowd_has_the_colours_of_others() -> None:
    # Centres are where stamps have them, so that each pixel is covered alike: A is one level off at most, R, G, B one more.
    rng = np.random.default_rng(7)
    count, size, radius = 3 * CROWD, 200, 2.3
    place = rng.integers(8, size - 8, (count, 2)) + (rng.integers(0, FINE, (count, 2)) + 0.5) / FINE
    colour, ground = rng.integers(0, 1 << 24, count).astype(np.uint32), np.full((size, size), 0x405060, dtype=np.uint32)
    crowd, others = ground.copy(), ground.copy()
    for pixels, part in ((crowd, count), (others, CROWD - 1)):
        for k in range(0, count, part):
            some = slice(k, k + part)
            radii = np.full(len(place[some]), radius)
            draw_discs(pixels, ground, place[some], radii, colour[some], 0.0, float(size), 1.0)
    rgba = [pixels.view(np.uint8).reshape(size, size, 4).astype(int) for pixels in (crowd, others)]
    assert np.abs(rgba[0] - rgba[1]).max() <= 2
    assert (crowd != ground).mean() > 0.5
