"""Rolling resistance: the torque of a contact is at most c r N."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import on_ground

import pyverlet as pv

G, K = 9.81, 0.5  # m/s^2; I / (m r^2) of a disc
STEPS = [(1 / 60, 8), (1 / 240, 4), (1 / 30, 16)]


def floor(c: float, **settings: Any) -> pv.World:
    room = pv.Box((-100, 0), (100, 50), friction=1.0, rolling_resistance=c)
    return pv.World(**{"boundary": room, "dtype": np.float64, **settings})


@pytest.mark.parametrize(("dt", "substeps"), STEPS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("c", "r"), [(0.02, 0.1), (0.1, 0.5), (0.3, 1.0)])
def test_a_disc_stops_after_its_way(c: float, r: float, dtype: Any, dt: float, substeps: int) -> None:
    """m (1 + k) a = -c m g: it stops after v0^2 (1 + k) / (2 c g). The way is off by that of a substep at c g h."""
    world, v0 = floor(c, dtype=dtype, substeps=substeps), 2.0
    disc = world.add(position=(0, r), velocity=(v0, 0), spin=-v0 / r, radius=r)
    way = v0**2 * (1 + K) / (2 * c * G)
    world.run(seconds=1.05 * (1 + K) * v0 / (c * G) + 0.1, dt=dt)
    h = dt / substeps
    assert disc.position[0, 0] == pytest.approx(way, abs=c * G * h * h + way * (2e-4 if dtype == np.float32 else 1e-9))
    assert np.abs(disc.velocity).max() < 1e-6
    assert abs(disc.spin[0]) * r < 1e-6


@pytest.mark.parametrize("angle", [0.05, 0.15, 0.4])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_on_a_slope_it_rests_or_rolls(angle: float, dtype: Any) -> None:
    """It rests if tan(angle) <= c, else a = g (sin - c cos) / (1 + k)."""
    c, t = 0.1, 2.0
    world = floor(c, dtype=dtype, gravity=(G * np.sin(angle), -G * np.cos(angle)))
    disc = world.add(position=(0, 0.5), radius=0.5)
    world.run(seconds=t)
    a = max(0.0, G * (np.sin(angle) - c * np.cos(angle)) / (1 + K))
    # The first substep has no load yet: friction and resistance begin with the second.
    assert disc.velocity[0, 0] == pytest.approx(a * t, abs=G * np.sin(angle) / 480 + 1e-5 * a * t)


@pytest.mark.parametrize("what", ["wall", "segment", "polygon", "pinned", "own", "material"])
def test_all_surfaces_resist(what: str) -> None:
    c, v0, r = 0.1, 1.0, 0.25
    surface: dict[str, Any] = {"friction": 1.0, "rolling_resistance": c, "collisions": pv.Collisions(friction=1.0)}
    own: dict[str, Any] = {}
    if what == "own":  # the geometric mean of 0.4 and of 0.025
        surface["rolling_resistance"], own = 0.4, {"rolling_resistance": c * c / 0.4}
    elif what == "material":
        laws = pv.Collisions(friction=1.0, materials={("ball", "floor"): {"rolling_resistance": c}})
        surface, own = {"friction": 1.0, "material": "floor", "collisions": laws}, {"material": "ball"}
    elif what == "pinned":  # so large that its top is level
        surface |= {"large": 1e4, "boundary": None, "collisions": pv.Collisions(friction=1.0, rolling_resistance=c)}
    world, top = on_ground("wall" if what in ("own", "material") else what, **surface)
    disc = world.add(position=(0, top + r), velocity=(v0, 0), spin=-v0 / r, radius=r, **own)
    world.run(seconds=3)
    way = v0**2 * (1 + K) / (2 * c * G)
    assert disc.position[0, 0] == pytest.approx(way, rel=3e-3 if what == "pinned" else 1e-4)  # the top falls away by x^2 / 2 R


def test_a_turning_drum_takes_along_what_resists_rolling() -> None:
    """The wall turns more slowly than the disc: it takes it up to where tan(angle) = c, by a torque c N r = m g sin(angle) r."""
    turns, radius, r, c = 0.5, 2.0, 0.2, 0.05
    room = pv.Circle(radius=radius, friction=1.0, rolling_resistance=c, angular_velocity=turns)
    world = pv.World(boundary=room, dtype=np.float64)
    angle, far = np.arctan(c), radius - r
    disc = world.add(position=(far * np.sin(angle), -far * np.cos(angle)), radius=r, spin=turns * radius / r)
    world.run(seconds=10)
    x, y = disc.position[0]
    assert np.arctan2(x, -y) == pytest.approx(angle, rel=1e-3)
    assert disc.spin[0] == pytest.approx(turns * radius / r, rel=1e-3)


@pytest.mark.parametrize(("mu", "error"), [(0.0, 1e-12), (1.0, 5e-4)])
def test_two_free_discs_keep_their_angular_momentum(mu: float, error: float) -> None:
    """Pressed together, one spinning: what one loses the other gains. Friction is along tangents of before the drift: order h."""
    laws = pv.Collisions(friction=mu, rolling_resistance=0.5)
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=laws)
    pair = world.add(position=[(-0.5, 0), (0.7, 0)], radius=[0.5, 0.7], mass=[1.0, 3.0], spin=[3.0, 0.0])
    world.forces.append(pv.Gravitation(strength=40.0))

    def turning() -> float:
        x, v, m, r = pair.position, pair.velocity, pair.mass, pair.radius
        return float((m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + 0.5 * m * r * r * pair.spin).sum())

    before = turning()
    world.run(seconds=6)
    assert turning() == pytest.approx(before, rel=error)
    assert pair.spin[0] == pytest.approx(pair.spin[1], rel=1e-3)
    if mu:  # they turn as one body: the centres turn around each other as fast as they turn
        way, speed = np.diff(pair.position, axis=0)[0], np.diff(pair.velocity, axis=0)[0]
        assert pair.spin[0] == pytest.approx((way[0] * speed[1] - way[1] * speed[0]) / (way @ way), rel=1e-2)


def heap(c: float, **settings: Any) -> pv.World:
    """Poured through a narrow place, disc by disc."""
    world = pv.World(
        boundary=pv.Box((-30, 0), (30, 60), friction=0.8, rolling_resistance=c),
        collisions=pv.Collisions(friction=0.8, rolling_resistance=c), **settings,
    )  # fmt: skip
    rng = np.random.default_rng(3)
    for _ in range(100):
        world.add(position=(rng.uniform(-0.5, 0.5), 9.0), radius=rng.uniform(0.2, 0.3))
        world.run(seconds=0.1)
    world.run(seconds=20)  # after 9 m of fall and at c = 0.1 a disc rolls for up to 3 v / (2 c g) = 20 s
    return world


def test_a_heap_is_steeper_the_more_it_resists() -> None:
    worlds = [heap(c) for c in (0.0, 0.1, 0.3)]
    heights = [float(world.position[:, 1].mean()) for world in worlds]
    assert heights[0] < 0.8 * heights[1] < 0.8 * 0.95 * heights[2]
    # One without it rolls apart on a floor. With it a disc or two may still come down its side after six seconds: of twelve heaps
    # whose starts differ by 1e-6 m, two had one.
    for world in worlds[1:]:
        assert np.sort(np.hypot(*world.velocity.T))[-4] < 1e-3
