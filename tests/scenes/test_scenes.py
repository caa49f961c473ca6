"""Every registered scene: builds, starts without overlap inside its bounds, steps, repeats itself."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.spatial import cKDTree

import pyverlet as pv
from pyverlet import scenes
from pyverlet.scenes import Scene

EVERY = pytest.mark.parametrize("scene", scenes.SCENES.values(), ids=scenes.SCENES)
NOTHING_RANDOM = {
    "fall", "bounce-euler", "bounce-order", "bounce-rest", "frame-rate", "bounce-verlet", "energy-1-substep",
    "energy-10-substeps", "cloth", "newton-cradle", "wrecking-ball",
}  # fmt: skip
COUNTS = [*range(1, 40), 57, 100, 199, 200, 333, 1000, 5000]


@functools.cache
def at_the_start(name: str) -> pv.World:
    """The scene of this name as it is, not stepped yet: to look at."""
    return scenes.get(name).world()


def largest_overlap(world: pv.World) -> float:
    """Largest depth of two circles in each other, m; negative: the smallest distance between two near ones."""
    position = world.position.astype(np.float64)
    radius = world.radius.astype(np.float64)
    pairs = cKDTree(position).query_pairs(2 * radius.max() * 1.01, output_type="ndarray")
    if not len(pairs):
        return -np.inf
    a, b = pairs.T
    return float((radius[a] + radius[b] - np.hypot(*(position[a] - position[b]).T)).max())


def largest_excess(world: pv.World) -> float:
    """How far the rim of some circle is outside the bounds, m; negative inside."""
    position, radius = world.position.astype(np.float64), world.radius.astype(np.float64)
    bounds = world.boundary
    if isinstance(bounds, pv.Circle):
        return float((np.hypot(*(position - bounds.center).T) + radius).max() - bounds.radius)
    extent = bounds.extent()
    if extent is None:
        return -np.inf
    x0, y0, x1, y1 = extent
    x, y = position.T
    return float(np.max([x0 - x + radius, y0 - y + radius, x - x1 + radius, y - y1 + radius]))


@EVERY
def test_says_what_it_is(scene: Scene) -> None:
    assert scenes.SCENES[scene.name] is scene is scenes.get(scene.name)
    assert scene.summary
    assert "\n" not in scene.summary
    assert len(scene.summary) < 90
    assert scene.description
    assert len(at_the_start(scene.name)) == scene.defaults.particles


@EVERY
def test_starts_inside_without_overlap(scene: Scene) -> None:
    world = at_the_start(scene.name)
    assert world.time == 0.0
    assert world.escaped() == 0
    assert largest_excess(world) <= 0
    assert largest_overlap(world) <= 0
    assert world.overlap().max == 0.0


@EVERY
def test_steps_and_keeps_everything_inside(scene: Scene) -> None:
    world = scene.world(particles=min(100, 10 * scene.defaults.particles))
    world.run(seconds=2.0, dt=1 / 60)
    assert world.escaped() == 0
    assert np.isfinite(world.position).all()
    assert np.isfinite(world.velocity).all()
    if world.collisions is not None:
        overlaps = []  # in a crash a single one may be deeper for a frame or two
        for _ in range(5):
            overlaps.append(world.overlap().max)
            world.run(seconds=0.1, dt=1 / 60)
        assert np.median(overlaps) < 0.1


@EVERY
def test_same_seed_same_bits(scene: Scene) -> None:
    def hash_after(seed: int) -> str:
        world = scene.world(particles=100, seed=seed)
        world.run(seconds=0.1, dt=1 / 60)
        return world.state_hash()

    first = hash_after(1)
    assert hash_after(1) == first
    assert (hash_after(2) == first) is (scene.name in NOTHING_RANDOM)


@pytest.mark.parametrize("name", ["cage", "box"])
@pytest.mark.parametrize("spread", [1.0, 4.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (1.3, 2.0))])
def test_any_number_fits(name: str, spread: float) -> None:
    for count in COUNTS:
        world = scenes.get(name).world(particles=count, radius_spread=spread, seed=count)
        assert len(world) == count
        assert largest_excess(world) <= 0, count
        assert largest_overlap(world) <= 0, count
        assert world.radius.max() / world.radius.min() <= spread * (1 + 1e-6)


@pytest.mark.parametrize("spread", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("count", [31, 100, 5000])
def test_cage_is_sixty_percent_full(count: int, spread: float) -> None:
    world = scenes.get("cage").world(particles=count, radius_spread=spread)
    assert isinstance(world.boundary, pv.Circle)
    assert world.boundary.radius == pytest.approx(np.sqrt(0.25 * count / 0.6), rel=1e-6)
    assert (world.radius.astype(float) ** 2).sum() / world.boundary.radius**2 == pytest.approx(0.6, rel=1e-5)
    if spread == 1.0:
        assert world.radius == pytest.approx(0.5)
        assert world.mass == pytest.approx(1.0)


def test_cage_start_fills_the_cage() -> None:
    world = scenes.get("cage").world()
    x0, y0, x1, y1 = -45.6, -45.6, 45.6, 45.6
    assert world.position.min(axis=0) == pytest.approx((x0, y0), abs=1.5)
    assert world.position.max(axis=0) == pytest.approx((x1, y1), abs=1.5)


def test_fall_is_the_closed_form() -> None:
    scene = scenes.get("fall")
    settings = scene.settings(particles=5, dtype=np.float64)
    world = scene.build(settings)
    world.run(seconds=2.0, dt=1 / 60)
    assert scene.closed_form is not None
    exact = scene.closed_form(settings, np.array([world.time]))[0]
    assert world.position[:, 1] == pytest.approx(exact, abs=1e-11)


def test_settings_reach_the_world() -> None:
    world = scenes.get("box").world(
        particles=7, substeps=3, integrator=pv.RK4(), restitution=0.25, dtype=np.float64, gravity=(1.0, -2.0)
    )
    assert len(world) == 7
    assert world.substeps == 3
    assert isinstance(world.integrator, pv.RK4)
    assert world.dtype == np.float64
    assert tuple(world.gravity) == (1.0, -2.0)
    assert world.collisions is not None
    assert world.collisions.restitution == 0.25
    assert scenes.get("box").world(collisions=False).collisions is None


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ({"particles": 0}, "particles is 0"),
        ({"radius_spread": 0.5}, "radius_spread is 0.5"),
        ({"radius_spread": float("nan")}, "radius_spread is nan"),
        ({"seed": -1}, "seed is -1"),
        ({"restitution": 1.5}, "restitution is 1.5"),
        ({"friction": -0.1}, "friction is -0.1"),
        ({"substeps": 0}, "substeps is 0"),
        ({"substeps": 2**31}, "substeps is 2147483648; allowed is a whole number from 1 to 100000"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_bad_settings_are_refused(override: dict[str, object], says: str) -> None:
    for scene in scenes.SCENES.values():
        with pytest.raises(pv.errors.InputError, match=says):
            scene.world(**override)


def test_unknown_scene_suggests_the_nearest() -> None:
    with pytest.raises(pv.errors.InputError, match=r"'cagee' \(did you mean 'cage'\?\); known: cage, box, fall,"):
        scenes.get("cagee")
