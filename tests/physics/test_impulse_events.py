"""Events under the law of impulses: the same as those of the other law, which finds them by other means."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.collisions import Collisions


def bouncing(*, impulses: bool | None, room: pv.Boundary, **options: Any) -> pv.World:
    """Thirty discs that bounce among walls and obstacles; few meet at the same time."""
    rng = np.random.default_rng(3)
    laws = pv.Collisions(restitution=0.9, impulses=impulses)
    world = pv.World(boundary=room, collisions=laws, dtype=np.float64, threads=1, **{"events": True, **options})
    world.obstacles += [pv.Disc((0, 2), 0.5, restitution=0.7), pv.Segment((-3, -1), (-1, -2), restitution=0.9)]
    x, y = np.meshgrid(np.linspace(-3.5, 3.5, 6), np.linspace(-3.2, 3.4, 5))
    along = np.clip((2 * (x + 3) - (y + 1)) / 5, 0, 1)  # of the segment, the nearest point
    away = ((np.hypot(x, y - 2) > 1.2) & (np.hypot(x + 3 - 2 * along, y + 1 + along) > 0.5)).ravel()  # nobody begins at one
    place = np.column_stack((x.ravel(), y.ravel()))[away]
    world.add(position=place + 0.05, velocity=rng.normal(0, 2, place.shape), radius=0.15)
    return world


ROOMS = {
    "box": pv.Box((-4, -4), (4, 4), restitution=0.9),
    "cage": pv.Circle(radius=5.5, restitution=0.9),
    "periodic": pv.Periodic((-4, -4), (4, 4)),
}


@pytest.mark.parametrize("room", ROOMS)
def test_both_laws_tell_the_same(room: str) -> None:
    """Impacts are in closed form under both: a, b, wall, obstacle and speed of each, frame by frame, until chaos sets in."""
    one, other = (bouncing(impulses=impulses, room=ROOMS[room], gravity=(0, -1)) for impulses in (False, True))
    begun = 0
    for _ in range(30):
        one.step(1 / 60)
        other.step(1 / 60)
        for mine, theirs in ((one.events.begin, other.events.begin), (one.events.end, other.events.end)):
            for name in ("a", "b", "wall", "obstacle"):
                assert mine[name].tolist() == theirs[name].tolist()
        # The other law takes the speed of pairs along their line of centres when the substep begins: v h / r = 2 % of it, say.
        assert other.events.begin["speed"] == pytest.approx(one.events.begin["speed"], rel=0.05)
        begun += len(one.events.begin)
    assert begun > 5


def test_a_ball_is_heard_at_each_of_its_bounces() -> None:
    """After n bounces from a height H it has e^n of the speed sqrt(2 g H); in a frame of 0.25 s there are several."""
    e, height = 0.9, 0.05
    world = pv.World(
        boundary=pv.Box((-1, 0), (1, 9), restitution=e), collisions=pv.Collisions(), events=True, dtype=np.float64
    )
    world.add(position=(0, 0.1 + height), radius=0.1)
    speeds: list[float] = []
    counts = []
    for _ in range(3):
        world.step(0.25)
        counts.append(len(world.events.begin))
        speeds += [float(speed) for speed in world.events.begin["speed"]]
    assert max(counts) > 1
    # A contact of a frame is told with its largest speed, so many times as it has bounced.
    assert speeds[0] == pytest.approx(np.sqrt(2 * 9.81 * height), rel=1e-9)
    # T = 2 v / g between bounces: t_n = t_0 + 2 v_0 / g (e + ... + e^n), t_0 = v_0 / g.
    fall = np.sqrt(2 * height / 9.81)
    times = fall + 2 * fall * np.concatenate(([0], np.cumsum(e ** np.arange(1, 40))))
    assert len(speeds) == (times <= 0.75).sum()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_to_listen_changes_no_bit(dtype: type) -> None:
    hashes = set()
    for events in (False, True):
        rng = np.random.default_rng(5)
        world = pv.World(
            boundary=pv.Circle(radius=6, friction=0.3), events=events, dtype=dtype,
            collisions=pv.Collisions(restitution=0.3, friction=0.3),
        )  # fmt: skip
        world.add(position=rng.uniform(-3.5, 3.5, (300, 2)), radius=0.12)
        world.run(seconds=1.5)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


def test_new_lists_lose_and_double_nothing() -> None:
    """Two discs that stay together while a fast one has lists made anew in each frame: one beginning, no end."""
    world = pv.World(boundary=pv.Box((-9, 0), (9, 9)), collisions=pv.Collisions(), events=True, gravity=(0, -10))
    world.add(position=[(0, 0.5), (0, 1.5)], radius=0.5)
    fast = world.add(position=(-8, 8), velocity=(60, 0), radius=0.1)
    begun, ended = [], []
    for _ in range(60):
        fast.velocity[:, 1] = 0
        fast.position[:, 1] = 8
        fast.velocity[:, 0] = np.where(np.abs(fast.position[:, 0]) > 8, -60 * np.sign(fast.position[:, 0]), fast.velocity[:, 0])
        world.step(1 / 60)
        begun += [(int(a), int(b)) for a, b in world.events.begin[["a", "b"]].tolist() if a < 2]
        ended += [(int(a), int(b)) for a, b in world.events.end[["a", "b"]].tolist() if a < 2]
    assert world.rebuilds > 30
    assert sorted(begun) == [(0, -1), (0, 1)]
    assert ended == []


@pytest.mark.parametrize("name", ["explicit-euler", "semi-implicit-euler", "time-corrected-verlet", "velocity-verlet", "rk4"])
def test_worlds_without_collisions_fly_and_bounce_as_under_the_other_law(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Free flight is the integrator's own, impacts are in closed form; where velocities are off by g h / 2 they are, by that."""
    found = []
    for impulses in (False, None):
        monkeypatch.setattr(Collisions, "impulses", impulses)
        world = pv.World(
            boundary=pv.Box((0, 0), (5, 5), restitution=0.8), collisions=None, integrator=pv.integrators.BY_NAME[name](),
            dtype=np.float64,
        )  # fmt: skip
        world.add(position=[(1, 4), (2.5, 3)], velocity=[(2, 0), (-1, 1)], radius=0.2)
        world.forces.append(pv.Drag(linear=0.1))
        world.run(seconds=1.2)
        assert world._impulses.steps is (impulses is None)
        found.append(world.position.copy())
    assert found[1] == pytest.approx(found[0], abs=1e-2 if pv.integrators.BY_NAME[name].order == 1 else 2e-3)
