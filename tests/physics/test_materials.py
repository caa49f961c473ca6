"""Circles with restitution, friction, category and mask of their own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import H, each_frame, go_on_alike, on_ground, refused

import pyverlet as pv


@pytest.mark.parametrize("method", [pv.Fast(), pv.BruteForce()])
@pytest.mark.parametrize(
    ("a", "b", "collide"),
    [({}, {}, True), ({"category": 2}, {}, True), ({"category": 2, "mask": 2}, {}, False),
     ({"category": 2, "mask": 4}, {"category": 4}, True), ({"category": 2, "mask": 4}, {"category": 4, "mask": 1}, False),
     ({"category": 0}, {}, False)],
)  # fmt: skip
def test_circles_collide_if_each_accepts_the_other(method: object, a: dict[str, Any], b: dict[str, Any], collide: bool) -> None:
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=method), dtype=np.float64)  # type: ignore[arg-type]
    world.add(position=(-1, 0), velocity=(1, 0), **a)
    world.add(position=(1, 0), velocity=(-1, 0), **b)
    world.run(seconds=2)
    assert np.sign(world.velocity[0, 0]) == (-1 if collide else 1)


def test_a_filter_changed_while_running_counts_at_once() -> None:
    # Circles 1.2 m apart stand in the neighbour list from the first frame on.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=pv.Fast(skin=1.0)), dtype=np.float64)
    balls = world.add(position=[(-0.6, 0), (0.6, 0)], velocity=[(1, 0), (-1, 0)])
    world.step(1 / 60)
    balls.mask[0] = 2
    world.run(seconds=1)
    assert world.velocity[:, 0].tolist() == [1, -1]


# ---- The law of a contact (docs/design/contact-law.md) against closed forms, and that it is each pair's own ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_billiard_rack_keeps_momentum_and_energy(dtype: Any) -> None:
    # Fifteen discs that touch, struck off centre at 3 m/s; each of some 100 impacts rounds to a digit of float32 or float64.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1), dtype=dtype, threads=1)
    rows = [(k * np.sqrt(3) * 0.05, 0.1 * (j - k / 2)) for k in range(5) for j in range(k + 1)]
    discs = world.add(position=[(-0.3, 0.01), *rows], radius=0.05, mass=0.17)
    discs.velocity[0] = (3, 0)
    before = world.momentum(), world.energy().kinetic
    world.run(seconds=0.5)
    assert np.abs(discs.velocity[1:]).max(axis=0).min() > 0.1  # they have scattered
    digits = 1e-6 if dtype == np.float32 else 1e-13
    assert world.momentum() == pytest.approx(before[0], abs=10 * digits * 0.17 * 3)
    assert world.energy().kinetic == pytest.approx(before[1], rel=10 * digits)


@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("phase", [0.05, 0.3, 0.55, 0.8, 0.95])
@pytest.mark.parametrize("spin", [0.0, 4.0])
def test_an_impact_rubs_as_coulomb_says(restitution: float, phase: float, spin: float) -> None:
    # J_n = (1 + e) v_n / W; J_t = min(mu J_n, |slip| / (3 W)), for a disc has I = m r^2 / 2; it turns each disc by 2 J_t / (m r).
    # mu is the geometric mean of the discs' own, of which the collisions' stands in for one.
    speed, mu, radius, mass = 3.0, 0.3, 0.5, (1.0, 2.0)
    way = speed * H * (20 + phase)  # they meet within a substep, at 45 degrees
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=restitution, friction=0.1), dtype=np.float64, threads=1)
    along = np.sqrt(0.5)
    place, fly = (-1 - way * along, -way * along), (speed * along, speed * along)
    world.add(position=place, velocity=fly, spin=spin, radius=radius, mass=mass[0], friction=0.9)
    world.add(position=(0, 0), radius=radius, mass=mass[1], friction=0.1 if spin else None)
    world.run(seconds=0.1)
    w = 1 / mass[0] + 1 / mass[1]
    normal = (1 + restitution) * speed * along / w
    # Along t = (n_y, -n_x) = (0, -1): the struck disc's velocity less the other's, and what the rims add.
    slip = speed * along + spin * radius
    tangent = min(mu * normal, slip / (3 * w))
    assert world.spin == pytest.approx([spin - 2 * tangent / (mass[0] * radius), -2 * tangent / (mass[1] * radius)], rel=1e-6)
    assert world.velocity[1] == pytest.approx([normal / mass[1], tangent / mass[1]], rel=1e-6)


@pytest.mark.parametrize("walls", [0.5, pytest.param(0.0, marks=pytest.mark.slow)])
def test_what_one_circle_is_made_of_is_nothing_to_the_others(walls: float) -> None:
    # A heap that falls, crashes and settles, and one circle alone far from it: whatever that is, the others keep their bits. By
    # brute force, for when a list is made anew depends on how far anybody has moved, and another list has another order.
    def heap(**odd: float) -> bytes:
        rng = np.random.default_rng(2)
        law = pv.Collisions(method=pv.BruteForce())
        world = pv.World(boundary=pv.Box((-60, 0), (60, 60), restitution=walls), collisions=law, threads=1)
        row, column = np.divmod(np.arange(160), 20)
        heap = world.add(position=np.column_stack((column, row + 1)) * 1.05 + rng.uniform(0, 0.04, (160, 2)), radius=0.5)
        alone = world.add(position=(-50, 5), velocity=(3, 0), radius=0.5)
        for name, value in odd.items():
            setattr(alone, name, value)
        world.run(seconds=3)
        return heap.position.tobytes() + heap.velocity.tobytes()

    plain = heap()
    assert heap(restitution=0.8) == plain
    assert heap(friction=0.7) == plain
    assert heap(restitution=0.5, friction=0.5) == plain


@pytest.mark.parametrize("obstacle", [False, True])
def test_smooth_circles_come_to_rest_on_walls_that_bounce(obstacle: bool) -> None:
    # Smooth ones may slip to a better place once more, as late as after 15 s.
    room = pv.Box((-7, 0), (7, 30), restitution=0.0 if obstacle else 0.5)
    world = pv.World(boundary=room)
    if obstacle:
        world.obstacles.append(pv.Segment((-7, 0.5), (7, 0.5), restitution=0.5))
    row, column = np.divmod(np.arange(400), 20)
    start = np.column_stack((column * 0.5 - 4.75, row * 0.5 + 1))
    world.add(position=start + np.random.default_rng(1).uniform(-0.02, 0.02, (400, 2)), radius=0.22)
    world.run(seconds=25)
    assert world.energy().kinetic < 2e-6 * world.mass.sum() * 9.81 * 7
    # 0.2 % under its own weight; one start in four jams a row between the walls, which presses it by up to 1 %.
    assert world.overlap().max < 0.012


# ---- How the values of two that touch become one, and materials that have something together ----


A, B = 0.2, 0.6
RULES = {"geometric": np.sqrt(A * B), "mean": 0.5 * (A + B), "min": A, "max": B, "multiply": A * B}


def head_on(e: tuple[float, float] | None, *, material: Any = "", **laws: Any) -> float:
    """The restitution of two discs that meet at 1 m/s each."""
    world = pv.World(gravity=(0, 0), dtype=np.float64, collisions=pv.Collisions(**laws))
    place = [(0, 0), (1.3, 0)]
    pair = world.add(position=place, velocity=[(1, 0), (-1, 0)], radius=0.5, restitution=e, material=material)
    world.run(seconds=0.4)
    return float(pair.velocity[1, 0] - pair.velocity[0, 0]) / 2


@pytest.mark.parametrize("rule", RULES)
def test_restitutions_combine(rule: str) -> None:
    """Relative speed after an impact over that before it is e; with "geometric" it is the larger one, as in Box2D."""
    assert head_on((A, B), combine=rule) == pytest.approx(B if rule == "geometric" else RULES[rule], rel=1e-12)


def sliding(mu: float, own: float | None, surface: str, **laws: Any) -> float:
    """The friction at a floor, by what a disc loses that slides on it: mu g t."""
    world, top = on_ground(surface, friction=mu, collisions=pv.Collisions(**laws))
    disc = world.add(position=(0, top + 0.5), velocity=(20, 0), radius=0.5, friction=own)
    world.run(seconds=0.5)
    first = float(disc.velocity[0, 0])
    world.run(seconds=0.5)
    return (first - float(disc.velocity[0, 0])) / (9.81 * 0.5)


@pytest.mark.parametrize("surface", ["wall", "channel", "segment"])
@pytest.mark.parametrize("rule", RULES)
def test_frictions_combine(rule: str, surface: str) -> None:
    assert sliding(A, B, surface, combine=rule) == pytest.approx(RULES[rule], rel=1e-9)
    assert sliding(A, None, surface, combine=rule) == pytest.approx(A, rel=1e-9)  # the surface's alone


def test_the_table_counts_for_pairs() -> None:
    laws = {"restitution": 0.2, "materials": {("b", "a"): {"restitution": 1.0}, ("a", "a"): {"restitution": 0.5}}}
    for names, e in ((("a", "b"), 1.0), (("b", "a"), 1.0), (("a", "a"), 0.5), (("b", "b"), 0.2), (("a", ""), 0.2)):
        assert head_on(None, material=list(names), **laws) == pytest.approx(e, rel=1e-12), names


@pytest.mark.parametrize("what", ["wall", "segment", "disc", "pinned"])
def test_the_table_counts_for_surfaces(what: str) -> None:
    """A ball that is dropped from rest onto it bounces as high as e^2 of the height; the others do not bounce."""
    laws = pv.Collisions(materials={("ball", "trampoline"): {"restitution": 0.9}})
    world, top = on_ground(what, material="trampoline", collisions=laws)
    ball = world.add(position=(0, top + 3), radius=0.5, material="ball")
    height, highest = 2.5, 0.0
    world.run(seconds=np.sqrt(2 * height / 9.81) + 0.02)
    assert ball.velocity[0, 1] > 0
    for _ in each_frame(world, 200, 1 / 240):
        highest = max(highest, float(ball.position[0, 1]) - top - 0.5)
    assert highest == pytest.approx(0.81 * height, rel=1e-3)  # looked at 240 times a second: g / 8 / 240^2 of a metre


@pytest.mark.parametrize("what", ["wall", "segment", "pair"])
@pytest.mark.parametrize("rule", ["geometric", "multiply", "table"])
def test_events_tell_what_turned_them(rule: str, what: str) -> None:
    """The impulse of a hit is what it changes: m (1 + e) v at a surface, half of that for two alike."""
    table = {("a", "b"): {"restitution": 0.3}} if rule == "table" else {}
    laws = pv.Collisions(combine="geometric" if rule == "table" else rule, materials=table)
    own: dict[str, Any] = {"restitution": A} | ({"material": "a"} if table else {})
    other: dict[str, Any] = {"restitution": B} | ({"material": "b"} if table else {})
    room = pv.Box((-5, -5), (5, 5), **(other if what == "wall" else {}))
    world = pv.World(boundary=room, gravity=(0, 0), collisions=laws, dtype=np.float64, events=True)
    ball = world.add(position=(0, 0), velocity=(2, 0), radius=0.5, mass=3.0, **own)
    if what == "segment":
        world.obstacles.append(pv.Segment((2, -5), (2, 5), **other))
    elif what == "pair":
        world.add(position=(2, 0), velocity=(-2, 0), radius=0.5, mass=3.0, **other)
    while not len(world.events.begin):
        world.step(1 / 60)
    assert world.events.begin["impulse"][0] == pytest.approx(3.0 * (2.0 - ball.velocity[0, 0]), rel=1e-9)


def test_materials_change_in_flight_and_wake(tmp_path: Path) -> None:
    laws = pv.Collisions(friction=0.5, materials={("skate", "ice"): {"friction": 0.0}})
    slope = pv.Box((-50, 0), (50, 9), friction=0.5, material="ice")
    world = pv.World(boundary=slope, gravity=(2.0, -9.0), dtype=np.float64, collisions=laws, sleep=True)
    world.add(position=[(x, 0.5) for x in (0.0, 2.0)], radius=0.5, rolling_resistance=1.0, friction=0.5)
    room = slope
    room.rolling_resistance = 1.0
    world.run(seconds=5)
    assert world.asleep.all()
    group = world.add(position=(20, 0.5), radius=0.5)
    group.material = "skate"
    world.material = ["skate", "", "skate"]
    world.run(seconds=0.5)
    assert world.material.tolist() == ["skate", "", "skate"]
    assert world.velocity[0, 0] > 0.3
    assert abs(world.velocity[1, 0]) < 1e-6
    go_on_alike(world, tmp_path, 12)


def test_a_table_alone_makes_a_world_rough() -> None:
    laws = pv.Collisions(materials={("a", "floor"): {"friction": 0.5}})
    world = pv.World(boundary=pv.Box((-50, 0), (50, 9), material="floor"), dtype=np.float64, collisions=laws)
    world.add(position=[(0, 0.5), (5, 0.5)], velocity=(9, 0), radius=0.5, material=["a", ""])
    world.run(seconds=3)
    assert world.velocity[:, 0] == pytest.approx([6.0, 9.0])


def test_unknown_materials_get_a_sentence() -> None:
    world = pv.World(collisions=pv.Collisions(materials={("rubber", "ice"): {"friction": 0.1}}))
    with pytest.raises(pv.InputError, match=r"material is 'rubbr' \(did you mean 'rubber'\?\); allowed: 'ice', 'rubber'"):
        world.add(position=(0, 0), material="rubbr")
    world.obstacles.append(pv.Segment((0, 0), (1, 0), material="wood"))
    world.add(position=(0, 5))
    refused(r"material of obstacles\[0\] is 'wood'; allowed: 'ice', 'rubber'", world.step, 1 / 60)
    with pytest.raises(pv.InputError, match="material is 'ice'; allowed: none, since `collisions` has no materials"):
        pv.World().add(position=(0, 0), material="ice")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_world_with_a_table_may_be_empty(dtype: Any) -> None:
    # Steps without particles ended the process: materials of a first particle were looked up.
    table = {("rubber", "rubber"): {"restitution": 0.5}}
    world = pv.World(gravity=(0, 0), dtype=dtype, collisions=pv.Collisions(materials=table))
    world.run(seconds=0.1)
    for _ in range(2):
        pair = world.add(position=[(0, 0), (1.3, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5, material="rubber")
        world.run(seconds=0.4)
        assert pair.velocity[:, 0] == pytest.approx([-0.5, 0.5], rel=1e-6)
        pair.remove()
        world.run(seconds=0.1)
