"""The core's list of pairs against all pairs against all, and what contacts remember across new lists."""

import copy
from typing import Any

import numpy as np
import pytest
from tests.uncompiled import UNCOMPILED
from tests.worlds import bits_after, grid

import pyverlet as pv
from pyverlet import core
from pyverlet.state.sorted_state import SortedState
from pyverlet.world.team import Team

Array = np.ndarray[Any, Any]


def brute_force(sorted_state: SortedState, listed: Array, skin: float) -> set[tuple[int, int]]:
    """Pairs of slots whose rims are nearer than the skin, of which one is free and which take each other's category.

    listed: (n, 2) where they were when the list was made; pinned circles then push out at once what overlaps them.
    """
    place, n = listed.astype(float), len(sorted_state)
    i, j = np.triu_indices(n, 1)
    way = sorted_state.periodic.nearest(place[j] - place[i])
    near = np.hypot(*way.T) < sorted_state.radius[i].astype(float) + sorted_state.radius[j] + skin
    near &= (sorted_state.inverse_mass[i] > 0) | (sorted_state.inverse_mass[j] > 0)
    if len(sorted_state.category):
        near &= (sorted_state.category[i] & sorted_state.mask[j]) != 0
        near &= (sorted_state.category[j] & sorted_state.mask[i]) != 0
    return set(zip(i[near].tolist(), j[near].tolist(), strict=True))


def listed(world: pv.World) -> tuple[set[tuple[int, int]], Array]:
    """The pairs of a list, and its lanes (k, 2) group by group; each batch of eight shares no particle.

    Behind the batches of a group are pairs of which one is pinned: they are no part of the sweeps.
    """
    first, count, i, j = world._frames.listed()
    swept, free = world._frames.held.engine.arrays["swept"], world._sorted.inverse_mass > 0
    pairs: list[tuple[int, int]] = []
    for a, n, whole in zip(first.tolist(), swept[: len(first)].tolist(), count.tolist(), strict=True):
        assert n % 8 == 0
        pinned = list(zip(i[a + n : a + whole].tolist(), j[a + n : a + whole].tolist(), strict=True))
        assert all(free[p] != free[q] for p, q in pinned)
        pairs += pinned
        for k in range(a, a + n, 8):
            batch = list(dict.fromkeys(zip(i[k : k + 8].tolist(), j[k : k + 8].tolist(), strict=True)))
            assert len({p for pair in batch for p in pair}) == 2 * len(batch)
            pairs += batch
    assert len(set(pairs)) == len(pairs)
    return {(min(p), max(p)) for p in pairs}, np.array(pairs)


def room(kind: str, size: float) -> pv.Boundary:
    return {
        "open": pv.Open(),
        "box": pv.Box((-size, -size), (size, size)),
        "cage": pv.Circle(radius=size),
        "periodic": pv.Periodic((-size, -size), (size, size)),
        "tube": pv.Periodic((-size, -size), (size, size), axes="x"),
        "shaft": pv.Periodic((-size, -size), (size, size), axes="y"),
        "channel": pv.Box((-8 * size, -0.5 * size), (8 * size, 0.5 * size)),
        "ring": pv.Periodic((-8 * size, -0.5 * size), (8 * size, 0.5 * size), axes="x"),
    }[kind]


def radii(kind: str, n: int, chance: np.random.Generator) -> Array:
    equal = np.full(n, 0.1)
    equal[0] = 2.0 if kind == "giant" else 0.1
    equal[:3] = 1.5 if kind == "giants" else equal[:3]
    return {"1:5": chance.uniform(0.05, 0.25, n), "1:50": 0.01 * 50 ** chance.random(n)}.get(kind, equal)


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("sizes", ["equal", "1:5", "1:50", "giant", "giants"])
@pytest.mark.parametrize("kind", ["open", "box", "periodic", "tube", "shaft", "channel", "ring"])
def test_the_list_is_that_of_all_pairs_against_all(kind: str, sizes: str, dtype: Any) -> None:
    for seed, n in ((1, 2), (2, 60), (3, 400)):
        chance = np.random.default_rng(seed)
        size = max(0.12 * np.sqrt(n), 4.5)
        world = pv.World(
            boundary=room(kind, size), collisions=pv.Collisions(method=pv.Fast(skin=0.3)), gravity=(0, 0), dtype=dtype
        )
        wide, high = (8 * size, 0.5 * size) if kind in ("channel", "ring") else (size, size)
        place = chance.uniform(-1, 1, (n, 2)) * (wide, high)
        place[n // 2] = place[0]  # coincident
        if kind == "open" and n > 2:
            place[1] = 1e5, -3e4  # far away
        mass = np.where(chance.random(n) < 0.1, np.inf, 1.0)
        world.add(position=place, radius=radii(sizes, n, chance), mass=mass)
        if seed == 3:
            world.category[: n // 3], world.mask[: n // 2] = 2, 1
        world.step(1e-9)
        sorted_state, skin = world._sorted, world._frames.held.engine.save_list()[2][1] * 2
        found, _ = listed(world)
        # Rounding of coordinates, and of periods, decides about pairs at the very rim of the skin.
        slack = 1e-5 if dtype == np.float32 else 1e-12
        then = world._frames.held.engine.arrays["listed"]
        assert brute_force(sorted_state, then, skin - slack) <= found, (kind, sizes, n)
        far = set(reaching_farther(world).tolist())  # those that overlaps throw farther than the skin
        for pair in found - brute_force(sorted_state, then, skin + 30 * slack):
            assert not far.isdisjoint(pair), (kind, sizes, n)


def reaching_farther(world: pv.World) -> Array:
    """Slots of those that the list takes to reach farther than their radius, and of very large ones."""
    arrays, radius = world._frames.held.engine.arrays, world._sorted.radius
    order, cell = arrays["order"], arrays["cell"]
    return np.union1d(order[arrays["spot_r"][: len(radius)] > radius[order]], np.flatnonzero(cell == cell.max()))


@pytest.mark.parametrize("common", [0.0, 30.0])
@pytest.mark.parametrize("kind", ["open", "box", "periodic", "tube"])
@pytest.mark.parametrize("sizes", ["equal", "1:5"])
def test_fine_discs_that_are_fast_are_listed_by_the_way_they_go(kind: str, sizes: str, common: float) -> None:
    # Those meet in a substep of h whose rims are nearer than |v_i - v_j| h. All move so far that the skin says nothing of them.
    chance, n, h = np.random.default_rng(1), 1500, 1.0 / 480.0
    world = pv.World(boundary=room(kind, 1.0), gravity=(0, 0), substeps=1, dtype=np.float64)
    radius = radii(sizes, n, chance) / 50
    place, velocity = chance.uniform(-0.98, 0.98, (n, 2)), chance.normal((common, 0.0), 5.0, (n, 2))
    world.add(position=place, velocity=velocity, radius=radius, on_overlap="push")
    world.step(h)
    found, _ = listed(world)
    sorted_state = world._sorted
    place, velocity, radius = place[sorted_state.particle], velocity[sorted_state.particle], radius[sorted_state.particle]
    i, j = np.triu_indices(n, 1)
    apart = np.hypot(*sorted_state.periodic.nearest(place[j] - place[i]).T) - radius[i] - radius[j]
    meet = apart < np.hypot(*(velocity[j] - velocity[i]).T) * h
    assert set(zip(i[meet].tolist(), j[meet].tolist(), strict=True)) <= found
    cell = world._frames.held.engine.arrays["cell"]
    assert len(reaching_farther(world)) > n / 4
    assert np.count_nonzero(cell == cell.max()) <= 17  # in no cell: each of these is compared with all others


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", ["open", "box", "cage"])
def test_without_cells_every_pair_is_listed_once_and_for_all(kind: str, dtype: Any) -> None:
    # But those that are pinned, both, and those that filters keep apart.
    world = pv.World(boundary=room(kind, 9.0), collisions=pv.Collisions(method=pv.BruteForce()), dtype=dtype)
    chance = np.random.default_rng(3)
    velocity, radius = chance.normal(0, 1, (40, 2)), chance.uniform(0.3, 0.6, 40)
    world.add(position=grid(8, 5, 1.3, (-5, -5)), velocity=velocity, radius=radius)
    world.mass[:2], world.velocity[:2] = np.inf, 0.0
    world.category[2], world.mask[2] = 2, 2
    world.run(seconds=1)
    found, _ = listed(world)
    assert found == brute_force(world._sorted, world._sorted.position, np.inf)
    assert len(found) == 39 * 38 // 2 - 1
    assert world.rebuilds == 1


def crowd(
    kind: str, sizes: str, n: int, dtype: Any = np.float32, *, restitution: float = 0.3, friction: float = 0.25
) -> pv.World:
    """Discs that are thrown about, and fall."""
    chance, size = np.random.default_rng(n), 0.2 * np.sqrt(n)
    size = max(size, 4.5) if sizes == "giants" else size
    world = pv.World(
        boundary=room(kind, size), collisions=pv.Collisions(friction=friction, restitution=restitution),
        gravity=(0, -9.81 if kind in ("box", "channel") else 0), dtype=dtype, substeps=4,
    )  # fmt: skip
    place = chance.uniform(-0.9, 0.9, (n, 2)) * ((8 * size, 0.5 * size) if kind in ("channel", "ring") else (size, size))
    world.add(position=place, velocity=chance.normal(0, 0.4, (n, 2)), radius=radii(sizes, n, chance))
    return world


SMOOTH: dict[str, float] = {"friction": 0.0, "restitution": 0.0}


def come_and_go(world: pv.World, seed: int) -> None:
    """Some discs are removed, some added and one is moved, each in some frames."""
    chance = np.random.default_rng(seed)
    if seed % 3:
        world.remove(chance.choice(len(world), 1 + seed % 4, replace=False))
    if seed % 2:
        world.add(position=chance.uniform(-0.5, 0.5, (2, 2)), radius=chance.uniform(0.08, 0.12, 2), on_overlap="push")
    if seed % 5 == 0:
        world.groups[0][int(chance.integers(20))].move_to(chance.uniform(-0.5, 0.5, 2))


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("box", "giants"),
        ("periodic", "1:50"),
        pytest.param("box", "equal", marks=pytest.mark.slow),
        pytest.param("ring", "1:5", marks=pytest.mark.slow),
    ],
)
def test_lists_follow_particles_that_come_and_go(kind: str, sizes: str) -> None:
    # All pairs nearer than the skin where they were listed. A copy has but these places, and makes all of the list anew.
    world = crowd(kind, sizes, 1000)
    world.run(seconds=5 / 60)
    for seed in range(1, 16):
        come_and_go(world, seed)
        twin = copy.deepcopy(world)
        for each in (world, twin):
            each.step(1 / 240)
        (found, lanes), (_, others) = listed(world), listed(twin)
        assert world.state_hash() == twin.state_hash(), seed
        assert np.array_equal(lanes, others), seed
        engine = world._frames.held.engine
        if len(engine.save_list()[0]):
            pairs = brute_force(world._sorted, engine.arrays["listed"], engine.save_list()[2][1] * 2 - 1e-5)
            assert pairs <= found, seed


def test_a_heap_keeps_its_list_as_particles_come_and_go() -> None:
    # At rest no two come nearer by the skin, and where nothing is added above all others, the grid is the same.
    world = crowd("box", "equal", 1500, restitution=0.0)
    world.run(seconds=6)
    world.add(position=(0.0, 7.0), radius=0.1, mass=np.inf)
    world.run(seconds=0.2)
    made, chance = world.rebuilds, np.random.default_rng(1)
    for k in range(12):
        world.remove(int(chance.integers(1400)))
        world.add(position=(0.3 * k - 2.0, 6.5), radius=0.1)
        world.step(1 / 480)
    assert world.rebuilds <= made + 2


@pytest.mark.filterwarnings("ignore:invalid value")  # 0 inf, of walls that are not there
@pytest.mark.parametrize(("kind", "sizes"), [("periodic", "1:50"), ("tube", "giants"), ("channel", "1:5"), ("open", "equal")])
def test_uncompiled_the_list_has_the_same_lanes(kind: str, sizes: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> tuple[str, Array, int]:
        world = crowd(kind, sizes, 40)
        world.run(seconds=2 / 60)
        come_and_go(world, 1)
        return bits_after(world, 4 / 60), listed(world)[1], world.rebuilds

    compiled = run()
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    plain = run()
    assert plain[0] == compiled[0]
    assert np.array_equal(plain[1], compiled[1])
    assert plain[2] == compiled[2] > 1


@pytest.mark.parametrize(
    ("kind", "sizes", "law"),
    [
        *((*each, {}) for each in (("box", "equal"), ("box", "giants"), ("shaft", "1:5"), ("ring", "1:5"), ("periodic", "1:50"))),
        *(("shaft", "equal", SMOOTH), ("periodic", "equal", {"friction": 0.0, "restitution": 0.9})),
        ("tube", "equal", {"friction": 0.3, "restitution": 0.0}),
    ],
)
def test_lists_do_not_depend_on_the_number_of_threads_nor_on_being_taken_up(
    kind: str, sizes: str, law: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Saved after some frames, and once more after others have gone.
    ends = set()
    for threads in (1, 2, 3):
        monkeypatch.setattr(Team, "size", lambda team, most, frame_ms, threads=threads: threads)
        world, seen = crowd(kind, sizes, 3000, **law), []
        for removes in (False, True):
            world.run(seconds=5 / 60)
            if removes:
                world.remove(range(0, 1500, 7))
            saved = world.save()
            for _ in range(2):
                world.restore(saved)
                seen.append((bits_after(world, 8 / 60), listed(world)[1].tobytes()))
            assert seen[-1] == seen[-2]
        assert world.rebuilds > 1
        ends.add((*seen, world.rebuilds))
    assert len(ends) == 1


def test_impulses_survive_new_lists() -> None:
    # A heap at rest whose list is made anew in every frame stays at rest, with the loads of one that keeps its list. What differs
    # is the rounding of places, 1e-16 / 1e-9 of depths of that many metres; without its impulses all of it would fall by g h =
    # 0.04 m/s in a substep.
    worlds = [crowd("box", "equal", 300, np.float64) for _ in range(2)]
    for _ in range(900):
        for world in worlds:
            world.step(1 / 60)
    loads = []
    for anew, world in enumerate(worlds):
        before = world.rebuilds
        for _ in range(60):
            if anew:
                world._frames.held.engine.forget_list()
            world.step(1 / 60)
            assert np.hypot(*world.velocity.T).max() < 1e-6
        assert world.rebuilds - before == (60 if anew else 0)
        memory = world._frames.save()
        loads.append(dict(zip(map(tuple, memory.pairs.tolist()), memory.values[:, 0].tolist(), strict=True)))
    carried = {pair: load for pair, load in loads[0].items() if load > 0.1}
    assert len(carried) > 300
    assert all(loads[1][pair] == pytest.approx(load, rel=1e-5) for pair, load in carried.items())


def test_an_empty_world_and_a_lone_disc_have_no_pairs() -> None:
    world = pv.World(collisions=pv.Collisions())
    world.step(1 / 60)
    world.add(position=(0, 0), radius=1.0)
    world.step(1 / 60)
    assert listed(world)[0] == set()


@pytest.mark.parametrize(("kind", "sizes"), [("box", "giants"), ("periodic", "1:50"), ("tube", "1:5"), ("open", "equal")])
def test_who_touches_is_always_listed(kind: str, sizes: str) -> None:
    # While particles move, come, go, grow, and change whom they collide with.
    chance, world = np.random.default_rng(8), crowd(kind, sizes, 300)
    for frame in range(40):
        if frame % 10 == 3:
            world.add(position=chance.uniform(-1, 1, (5, 2)), radius=0.08, velocity=chance.normal(0, 3, (5, 2)))
        if frame % 10 == 6:
            world.remove(chance.choice(len(world), 4, replace=False))
        if frame % 20 == 9:
            world.radius[5:8] *= 1.1
            world.velocity[20:30] += chance.normal(0, 2, (10, 2))
        if frame == 25:
            world.mask[:20] = 2
        world.step(1 / 60)
        assert brute_force(world._sorted, world._sorted.position, -1e-6) <= listed(world)[0]
