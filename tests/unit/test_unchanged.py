"""Arrays are known again by a digest: whatever differs tells."""

import gc
import sys
import tracemalloc
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import grid

import pyverlet as pv
from pyverlet import scenes
from pyverlet.common import memory
from pyverlet.common.constants import KNOWN_FROM
from pyverlet.state.unchanged import Unchanged


def rows(dtype: type = np.float32, count: int = KNOWN_FROM + 7) -> Any:
    return np.random.default_rng(0).normal(size=(count, 2)).astype(dtype)


def flip(array: Any, *rows: int) -> None:
    array[list(rows), 1] *= -1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "change",
    [
        lambda a: a.__setitem__((0, 0), np.nextafter(a[0, 0], a.dtype.type(9))),
        lambda a: a.__setitem__((-1, 1), np.nextafter(a[-1, 1], a.dtype.type(9))),
        lambda a: a.__setitem__((5, 0), np.nan),
        lambda a: flip(a, 100),
        lambda a: flip(a, 100, 164),  # the same bit of two words that go into the same sum
        lambda a: flip(a, *range(len(a))),
        lambda a: a.__setitem__(slice(2), a[1::-1].copy()),
        lambda a: a.__imul__(2),
    ],
)
def test_whatever_differs_tells(change: Callable[[Any], object], dtype: type) -> None:
    array, known = rows(dtype), Unchanged()
    for _ in range(2):
        known.remember([array, array[:, 0].copy()])
        assert known.recall([array, array[:, 0].copy()])
        assert not known.recall([array, array[:, 0].copy()])  # once only
    known.remember([array])
    change(array)
    assert not known.recall([array])


def test_columns_of_an_odd_number_and_small_arrays() -> None:
    known, column = Unchanged(), rows()[:, 0].copy()
    assert len(column) % 2
    known.remember([column])
    column[-1] += 1
    assert not known.recall([column])
    known.remember([column[:10]])
    assert not known.recall([column[:10]])  # not worth it


def test_longer_arrays_are_not_those_of_before() -> None:
    known, array = Unchanged(), rows()
    known.remember([array])
    assert not known.recall([np.concatenate((array, array))])
    known.remember([array])
    known.forget_blocks()
    assert known.recall([array], touched=False)
    known.remember([array])
    known.forget_blocks()
    assert not known.recall([array])


SIDE = 182


def large(**options: Any) -> pv.World:
    """A grid of discs, more than KNOWN_FROM, that drift."""
    world = pv.World(gravity=(0, 0), collisions=None, **options)
    world.add(position=grid(SIDE, SIDE, 1.0, (0, 0), loose=0), radius=0.4)
    assert len(world) > KNOWN_FROM
    return world


@pytest.mark.parametrize("then", ["", "others come", "others go"])
@pytest.mark.parametrize("name", ["position", "velocity", "spin"])
def test_a_large_world_heeds_what_the_user_changes(name: str, then: str) -> None:
    world = large()
    for _ in range(3):
        world.step(0.1)
    assert not (getattr(world, name)[777] == 3.0).any()
    getattr(world, name)[777] = 3.0
    if then == "others come":
        world.add(position=(-3, -3), radius=0.4)
    elif then == "others go":
        world.remove(len(world) - 1)
    world.step(0.1)
    # Free flight: what was set moves the circle, or stays.
    y, x = divmod(777, SIDE)
    expected = {"position": (3.0, 3.0), "velocity": (x + 0.3, y + 0.3), "spin": (x, y)}
    assert world.position[777] == pytest.approx(expected[name], abs=1e-4)  # float32, at 50 m
    assert name != "spin" or world.spin[777] == 3.0


def test_what_no_one_has_touched_is_not_copied_in_again_when_others_come_and_go() -> None:
    world = large()
    world.add(position=(-3, -9), radius=0.4)  # from now on there is room for more
    world.step(0.1)
    world.remove([0, 3000])
    world.step(0.1)
    assert not world._sorted.copied
    come = world.add(position=[(-3, -3), (-5, -3)], velocity=(-1, 0), radius=0.4)
    world.step(0.1)
    assert not world._sorted.copied
    assert np.array_equal(world._sorted.where(), world.position)
    assert come.position == pytest.approx(np.array([(-3.1, -3), (-5.1, -3)]))
    y, x = divmod(2999, SIDE)
    assert world.position[2998] == pytest.approx((x, y))


def test_a_frame_that_failed_is_not_taken_for_the_truth() -> None:
    # The engine's arrays then hold what it failed with, the user's the last good frame.
    world = large(boundary=pv.Box((-1, -1), (SIDE, SIDE)))
    world.step(0.1)
    before = world.position.copy()
    room, world.boundary = world.boundary, _Broken()
    with pytest.raises(pv.NonFiniteError):
        world.step(0.1)
    world.boundary = room
    world.step(0.1)
    assert np.array_equal(world.position, before)


class _Broken(pv.Open):
    def confine(self, state: Any, h: float, lag: float, rest_speed: float) -> None:
        state.position[:] = np.nan


# ---- One warning where float32 is too coarse for what rests, and none elsewhere ----


def said(world: pv.World, frames: int = 70) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        world.run(seconds=frames / 60)
    return [str(each.message) for each in caught if each.category is pv.CoarseCoordinatesWarning]


def resting(place: tuple[float, float], radius: float = 0.2, kind: str = "box", **options: Any) -> pv.World:
    """Three circles that rest on a floor there."""
    x, y = place
    size = 10 * radius
    rooms: dict[str, pv.Boundary] = {
        "box": pv.Box((x - size, y - radius), (x + size, y + size)),
        "cage": pv.Circle(center=(x, y + size - radius), radius=size),
        "open": pv.Open(),
    }
    world = pv.World(boundary=rooms[kind], **options)
    if kind == "open":
        world.obstacles.append(pv.Segment((x - size, y - radius), (x + size, y - radius)))
    world.add(position=[(x + 2.1 * k * radius, y + 0.3 * radius) for k in (-1, 0, 1)], radius=radius)
    return world


@pytest.mark.parametrize("kind", ["box", "cage", "open"])
@pytest.mark.parametrize("place", [(1e4, 0.0), (0.0, -1e4), (-2e3, 2e3)])
def test_what_rests_far_away_is_warned_of_once(kind: str, place: tuple[float, float]) -> None:
    (message,) = said(resting(place, kind=kind), 160)
    assert "from the origin" in message
    assert "dtype=float64" in message
    assert " 7.3e+02 m" in message  # 0.03 h sqrt(g r) / eps


@pytest.mark.parametrize(
    ("place", "options"),
    [((300.0, 300.0), {}), ((0.0, 0.0), {}), ((1e4, 0.0), {"dtype": np.float64}), ((1e4, 0.0), {"gravity": (0, 0)})],
    ids=str,
)
def test_there_is_none_near_by_nor_in_float64_nor_without_weight(place: tuple[float, float], options: dict[str, Any]) -> None:
    assert said(resting(place, **options)) == []


def test_micrometres_are_fine_near_the_origin_and_too_small_a_metre_away() -> None:
    world = resting((0.0, 0.0), radius=1e-6)
    assert said(world) == []
    assert np.abs(world.velocity).max() < 1e-4
    assert len(said(resting((1.0, 0.0), radius=1e-6))) == 1
    (message,) = said(resting((1.0, 0.0), radius=1e-6, gravity=(0, 0)))
    assert "allowed are 0.17 m" in message  # 0.02 r / eps


@pytest.mark.parametrize("velocity", [(0, 0), (300, 200), (0, 5)])
def test_what_falls_flies_or_is_pinned_far_away_is_no_reason(velocity: tuple[float, float]) -> None:
    world = pv.World()
    world.add(position=[(9e3, 9e3), (9e3, 9.1e3), (8e3, 9e3)], velocity=velocity, mass=[1.0, 5.0, np.inf])
    world.velocity[2] = 0
    assert said(world, 200) == []


@pytest.mark.parametrize(
    ("place", "speed", "told"), [(1e4, 1.0, True), (1e4, 0.1, True), (1e4, 10.0, False), (1e3, 1.0, False), (10.0, 0.1, False)]
)
@pytest.mark.parametrize("linked", [False, True])
def test_what_moves_astray_far_away_is_warned_of_without_gravity(place: float, speed: float, told: bool, linked: bool) -> None:
    # Places are rounded to 0.98 mm at 10 km, in substeps in which 1 m/s moves by 2 mm.
    world = pv.World(gravity=(0, 0))
    ball = world.add(position=[(place, 0), (place + 2, 0)], radius=0.2, velocity=(speed, 0))
    if linked:
        world.links.append(pv.Stick(ball, 0, 1))
    messages = said(world, 120)
    assert len(messages) == told
    if not told:
        assert ball.position[0, 0] - place == pytest.approx(2 * speed, rel=0.05)


@pytest.mark.parametrize("stiffness", [10.0, 100.0])
def test_springs_far_away_keep_their_energy(stiffness: float) -> None:
    # What rounded places give, the energy limiter took back, and what they take it left: 7 % went in ten seconds, 37 % of swings
    # of 3 cm.
    world = pv.World(gravity=(0, 0))
    ends = world.add(position=[(1000, 0), (1001.3, 0)], radius=0.1)
    world.links.append(pv.Spring(ends, 0, 1, length=1.0, stiffness=stiffness))
    before = world.energy().total
    assert said(world, 600) == []
    assert world.energy().total == pytest.approx(before, rel=0.02)


# ---- Large arrays in memory of their own are arrays like any other ----


LARGE = 1 << 20  # of 4 bytes: 4 MB


@pytest.mark.parametrize("shape", [10, (10, 2), LARGE, (LARGE, 2), (2, LARGE + 3), 0])
@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint32])
def test_arrays_are_what_numpy_makes(shape: int | tuple[int, ...], dtype: type) -> None:
    array = memory.empty(shape, dtype)
    same: np.ndarray[Any, Any] = np.empty(shape, dtype)
    assert (array.shape, array.dtype, array.strides) == (same.shape, same.dtype, same.strides)
    assert array.flags.writeable
    assert array.flags.aligned
    assert array.flags.c_contiguous
    array[...] = 7
    assert (array == 7).all()
    assert not memory.zeros(shape, dtype).any()


@pytest.mark.parametrize("value", [0.0, -0.0, 3.0, np.nan])
@pytest.mark.parametrize("before", [0.0, -0.0, 5.0])
def test_rows_that_are_put_have_the_bits_of_what_was_put(value: float, before: float) -> None:
    rows = np.full(LARGE, before)
    memory.put(rows, np.broadcast_to(value, LARGE))
    assert rows.tobytes() == np.full(LARGE, value).tobytes()


def test_rows_taken_are_those_of_numpy() -> None:
    rng = np.random.default_rng(0)
    array, order = rng.normal(size=(LARGE, 2)), rng.permutation(LARGE)
    assert np.array_equal(memory.taken(array, order), array[order])
    assert np.array_equal(memory.taken(array[:, 0], order[:9]), array[order[:9], 0])


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere they come from NumPy")
def test_memory_is_counted_and_goes_back() -> None:
    gc.collect()
    before = memory.mapped()
    array = memory.empty(LARGE, np.float32)
    part = array[:5]
    assert memory.mapped() - before == array.nbytes
    del array
    assert memory.mapped() > before  # a view is left
    del part
    assert memory.mapped() == before
    assert memory.empty(10, np.float32).base is None
    assert memory.mapped() == before


# ---- What a world keeps in memory, and that what it lets go comes back when it is needed ----


def beyond(particles: int) -> float:
    """Bytes a particle that a world of the scene `cage` holds after a second, beyond the arrays its user sees."""
    world = scenes.get("cage").world(particles=particles)
    world.threads = 1
    world.run(seconds=1)
    gc.collect()
    seen = sum(array.nbytes for _, array in world._state.arrays())
    return (tracemalloc.get_traced_memory()[0] - seen) / particles


def test_a_particle_takes_no_more_than_350_bytes_beside_what_the_user_sees() -> None:
    # Of these some 130 are its pairs in the list.
    tracemalloc.start()
    try:
        beyond(1000)  # compiled code and its like are counted here
        held = tracemalloc.get_traced_memory()[0]
        assert beyond(10_000) - held / 10_000 <= 350
    finally:
        tracemalloc.stop()


def test_circles_that_learn_to_bounce_in_flight_do() -> None:
    # They come together at 1 m/s each, 0.1 m apart: for the list of pairs they are neighbours from the start.
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    pair = world.add(position=[(0, 0), (1.1, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5)
    world.step(1 / 60)
    pair.restitution[:] = 1
    world.run(seconds=0.1)
    assert pair.velocity == pytest.approx(np.array([(-1, 0), (1, 0)]), abs=1e-12)


@pytest.mark.parametrize("few", [True, False])
@pytest.mark.parametrize("width", [0, 2])
def test_rows_that_come_and_go_stay_what_they_are(few: bool, width: int) -> None:
    rng = np.random.default_rng(few)
    rows = memory.resized(rng.random((1000, width) if width else 1000), 1000)
    for _ in range(20):  # as masks and indices of NumPy have it
        before, kept = rows.copy(), rng.random(len(rows)) > (0.003 if few else 0.2)
        left, count, gone = int(kept.sum()), int(kept.sum()) + int(rng.integers(200)), np.flatnonzero(~kept)
        places, index = memory.places(gone, len(rows)), rng.permutation(len(rows))
        assert np.array_equal(places[kept], np.arange(left))
        assert (places[~kept] == -1).all()
        where, others = memory.without(index, gone)
        assert np.array_equal(where, np.flatnonzero(~kept[index]))
        assert np.array_equal(others, places[index[kept[index]]])
        rows = memory.moved(rows, gone, None, count, -1)
        assert np.array_equal(rows[:left], before[kept])
        assert (rows[left:] == -1).all()
        before, source = rows.copy(), rng.integers(-1, count, count)
        rows = memory.moved(rows, gone, source, count, 7)
        assert np.array_equal(rows, np.where((source < 0)[:, None] if width else source < 0, 7, before[source]))
