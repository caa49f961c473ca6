"""Every registered scene: builds, starts without overlap inside its bounds, steps, repeats itself."""

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from tests.worlds import bits_after, each_frame, refused

import pyverlet as pv
from pyverlet import scenes
from pyverlet.scenes import Scene, bounce
from pyverlet.scenes.bounce import GRAVITY

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
    world = scene.world(particles=min(100, 10 * scene.defaults.particles), ledger=True)
    world.run(seconds=1.5, dt=1 / 60)
    assert world.ledger.limiter == 0
    assert world.escaped() == 0
    assert np.isfinite(world.position).all()
    assert np.isfinite(world.velocity).all()
    if world.collisions is not None:
        overlaps = []  # in a crash a single one may be deeper for a frame or two
        for _ in range(5):
            overlaps.append(world.overlap().max)
            world.run(seconds=0.1, dt=1 / 60)
        assert np.median(overlaps) < 0.1


@pytest.mark.slow
@EVERY
def test_the_energy_limiter_takes_nothing_at_full_size(scene: Scene) -> None:
    world = scene.world(ledger=True)
    world.run(seconds=1.5, dt=1 / 60)
    assert world.ledger.limiter == 0


@EVERY
def test_same_seed_same_bits(scene: Scene) -> None:
    def hash_after(seed: int) -> str:
        world = scene.world(particles=100, seed=seed)
        return bits_after(world, 0.1)

    first = hash_after(1)
    assert hash_after(1) == first
    assert (hash_after(2) == first) is (scene.name in NOTHING_RANDOM)


@pytest.mark.parametrize("name", [name for name in scenes.SCENES if not name.startswith(("bounce", "energy", "frame-rate"))])
def test_frames_of_any_length_make_nothing_faster(name: str) -> None:
    # PositionVerlet, which shows on purpose that it keeps x - x_prev, made what falls 1.3 to 1.6 times as fast, and the
    # attracting ones of `orbit` and `droplets` 3.6 and 3.9 times. Particles of a gas may meet faster by chance.
    def fastest(steps: list[float]) -> float:
        world, rng, most = scenes.get(name).world(particles=200), np.random.default_rng(0), 0.0
        while world.time < 1.5:
            world.step(float(rng.choice(steps)))
            most = max(most, float(np.hypot(*world.velocity.T).max()))
        return most

    assert fastest([1 / 60, 1 / 120]) < (1.3 if name == "droplets" else 1.15) * fastest([1 / 60])


@pytest.mark.parametrize("name", ["cage", "box", "image"])
@pytest.mark.parametrize("spread", [1.0, 4.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (1.3, 2.0))])
def test_any_number_fits(name: str, spread: float) -> None:
    for count in COUNTS if name != "image" else [1, 2, 3, 7, 50, 333]:  # which runs once to learn its colours
        world = scenes.get(name).world(particles=count, radius_spread=spread, seed=count)
        assert len(world) == count
        assert largest_excess(world) <= 0, count
        assert largest_overlap(world) <= 0, count
        world.step(1 / 60)
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
        refused(says, scene.world, **override)


def test_unknown_scene_suggests_the_nearest() -> None:
    refused(r"'cagee' \(did you mean 'cage'\?\); known: cage, box, fall,", scenes.get, "cagee")


# ---- The bouncing sketches: each shows what its docstring says is true ----


DT, G = 1 / 60, 9.81


def heights(name: str, seconds: float, **overrides: Any) -> Iterator[tuple[str, np.ndarray, pv.World]]:
    """(name, heights of the first ball frame by frame, the world at the end) of every panel."""
    panels = scenes.get(name).panels(**overrides)
    y = [[float(world.position[0, 1]) for world in panels.worlds] for _ in each_frame(panels, round(seconds / DT))]
    yield from zip([panel.name for panel in panels], np.array(y).T, panels.worlds, strict=True)


def apexes(y: np.ndarray) -> np.ndarray:
    """Local maxima of heights; of two equal neighbours one."""
    inner = y[1:-1]
    return inner[(inner > y[2:]) & (inner >= y[:-2])]


@pytest.mark.parametrize(
    ("name", "seconds", "ends", "changed"),
    [
        ("bounce-euler", 30, [(1.5, np.inf)], {}), ("bounce-order", 30, [(1.5, np.inf), (0, 0.9)], {}),
        # The least change of gravity, and rounding or the lattice takes energy at some bounces: it rests by coincidence.
        ("bounce-rest", 60, [(0, 0.8)], {"gravity": (0.0, -9.81)}),
    ],
)  # fmt: skip
def test_bounces_climb_or_lose(name: str, seconds: float, ends: list[tuple[float, float]], changed: dict[str, Any]) -> None:
    for (_, y, _), (least, most) in zip(heights(name, seconds, **changed), ends, strict=True):
        tops = apexes(y)
        assert least * bounce.HEIGHT < tops[-1] < most * bounce.HEIGHT
        assert name != "bounce-euler" or (np.diff(tops) > 0).all()


def test_bounce_rest_keeps_its_height_to_the_last_bit() -> None:
    ((_, y, _),) = heights("bounce-rest", 60)
    tops = apexes(y)
    assert len(tops) > 30
    assert set(tops) == {tops[0]}
    # The first bounce lands on the lattice: n (n + 1) / 2 of g h^2 above the wall.
    cells = (tops[0] - bounce.RADIUS) / (-GRAVITY * DT**2)
    n = round((np.sqrt(1 + 8 * cells) - 1) / 2)
    assert cells == pytest.approx(n * (n + 1) / 2, rel=1e-9)


def test_bounce_random_loses() -> None:
    (world,) = scenes.get("bounce-random").panels().worlds
    start = world.energy().total
    world.run(seconds=60, dt=DT)
    assert world.energy().total < 0.8 * start


def test_frame_rate_matters_raw_and_not_with_the_clock() -> None:
    raw, slow_raw, clock, slow_clock = (world for _, _, world in heights("frame-rate", 10))
    assert clock.frames == slow_clock.frames == 600
    assert slow_raw.frames == 100
    assert clock.state_hash() == slow_clock.state_hash() == raw.state_hash()
    assert slow_raw.time == pytest.approx(raw.time)
    assert abs(slow_raw.position[0, 1] - raw.position[0, 1]) > 0.1


def test_bounce_verlet() -> None:
    (_, flipped, _), (_, projected, _), (_, met, real) = heights("bounce-verlet", 20)
    assert apexes(flipped)[-1] < 0.95 * bounce.HEIGHT
    assert len(apexes(projected[60:])) == 0
    assert projected[-1] == pytest.approx(bounce.RADIUS)
    # A frame rarely falls on the apex: at most g dt^2 / 8 below it.
    assert apexes(met).min() == pytest.approx(bounce.HEIGHT, abs=G * DT**2 / 8 * 1.001)
    assert real.energy().total == pytest.approx(G * bounce.HEIGHT, rel=1e-9)


@pytest.mark.parametrize("name", ["energy-1-substep", "energy-10-substeps"])
def test_verlet_and_semi_implicit_euler_reach_the_same_heights(name: str) -> None:
    (_, verlet, a), (_, euler, b) = heights(name, 8)
    assert np.abs(verlet - euler).max() < 1e-10
    # Verlet's velocity is half a step further, v - g h / 2: the energies differ by (v^2 - (v - g h / 2)^2) / 2.
    h, v = DT / a.substeps, float(b.velocity[0, 1])
    difference = b.energy().total - a.energy().total
    assert difference == pytest.approx((v**2 - (v - G * h / 2) ** 2) / 2, rel=1e-6)


@pytest.mark.slow
def test_more_substeps_make_a_firmer_heap() -> None:
    # Overlap at rest goes with h^2: 6 substeps leave a 36th of 1, give or take what still moves. The largest of 400 is luck.
    overlaps = [world.overlap().mean for _, _, world in heights("cage-brute-force", 10)]
    assert overlaps[0] > 2 * overlaps[1] > 8 * overlaps[2]


def test_options_and_variants() -> None:
    order = scenes.get("bounce-order")
    assert [panel.name for panel in order.panels(particles=3)] == ["position first", "velocity first"]
    assert [len(world) for world in order.panels(particles=3).worlds] == [3, 3]
    assert [panel.name for panel in order.panels(integrators=[pv.RK4(), pv.Yoshida4()])] == ["rk4", "yoshida4"]
    # What the variants differ in, set by hand, leaves one world.
    (only,) = order.panels(integrators=[pv.RK4()])
    assert isinstance(only.world.integrator, pv.RK4)
    (only,) = scenes.get("cage-brute-force").panels(substeps=3, particles=20)
    assert only.world.substeps == 3


@pytest.mark.parametrize("name", ["bounce-euler", "bounce-order", "frame-rate"])
def test_the_sketches_have_no_friction(name: str) -> None:
    refused(r"friction of the room is 0\.1", scenes.get(name).panels, friction=0.1)
