"""The library's contract: what goes in, what comes out, and what a wrong argument is told."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from tests.worlds import grid, refused

import pyverlet as pv
from pyverlet.common.threads import max_threads
from pyverlet.scenes import report


def test_the_first_example_of_the_library() -> None:
    xy = np.array([(0.0, 0.0), (0.5, 0.2), (-1.0, 3.0)])
    world = pv.World(
        gravity=(0, -9.81),
        integrator=pv.PositionVerlet(),
        boundary=pv.Circle(center=(0, 0), radius=10, restitution=0.0),
        collisions=pv.Collisions(restitution=0.0, friction=0.0),
        substeps=8,
        dtype=np.float32,
    )
    balls = world.add(position=xy, velocity=(1, 0), radius=0.05, mass=1.0)
    world.step(1 / 60)
    world.run(seconds=1.0, dt=1 / 60)
    assert len(balls) == len(world) == 3
    assert balls.position.shape == (3, 2)
    assert balls.position.dtype == np.float32
    assert world.time == pytest.approx(1 + 1 / 60)
    assert world.frames == 61
    assert world.energy().total == pytest.approx(world.energy().kinetic + world.energy().potential)
    assert world.momentum().shape == (2,)
    assert {"gather", "integrate", "contacts", "finish", "scatter"} <= set(world.profile.stages)
    assert 0 < sum(world.profile.stages.values()) <= 1.01 * world.profile.frame_ms
    assert len(world.state_hash()) == 16


@pytest.mark.parametrize("n", [200, 2100])
def test_the_profile_divides_contacts_of_larger_worlds_and_counts_threads(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (60, 60), restitution=0.5), threads=min(2, max_threads()))
    monkeypatch.setattr(world._team, "gather", lambda *_: setattr(world._team, "now", world.threads))
    k = np.arange(n)
    balls = world.add(position=np.column_stack((1 + 1.1 * (k % 50), 1 + 1.1 * (k // 50))), radius=0.5)
    world.links.append(pv.Stick(balls, 0, 1))
    divided, seen = {"lists", "surfaces", "pairs", "relax", "links"}, set[int]()
    for _ in range(500):
        world.step(1 / 60)
        assert divided & set(world.profile.stages) == (divided if n >= 256 else set())
        assert 0 < sum(world.profile.stages.values()) <= 1.01 * world.profile.frame_ms
        # Five blocks of particles are shared out; a thread that comes late finds nothing left, but not in each of many frames.
        if seen := seen | set(world.profile.threads.values()):
            break
    assert seen == ({2} if world.threads == 2 else set())


def test_groups_are_views_in_the_order_added() -> None:
    rng = np.random.default_rng(0)
    world = pv.World(gravity=(0, 0), boundary=pv.Box((0, 0), (50, 50)))
    first = world.add(position=rng.uniform(1, 49, (400, 2)), radius=np.linspace(0.1, 0.2, 400))
    second = world.add(position=(25, 25), velocity=(3, 0), radius=0.5)
    assert np.shares_memory(first.position, world.position)
    start = first.position.copy()
    world.step(1e-6)
    # The engine has sorted its own copy; nobody else sees that.
    assert np.abs(first.position - start).max() < 0.2
    assert first.radius == pytest.approx(np.linspace(0.1, 0.2, 400))
    assert second.index.tolist() == [400]
    assert repr(second) == "Group of 1 particles, 400 to 400"
    first.velocity[7] = (0, 5)
    second.position = (10, 10)
    assert world.velocity[7].tolist() == [0, 5]
    assert world.position[400].tolist() == [10, 10]
    second.mass, second.radius, second.spin = 2.0, 0.25, 1.0
    second.velocity = (0, 0)
    assert (world.mass[400], world.radius[400], world.spin[400]) == (2.0, 0.25, 1.0)


def test_adding_while_running_keeps_what_is_there() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (40, 40)), dtype=np.float64)
    groups = []
    for k in range(30):
        groups.append(world.add(position=(1 + k, 5), radius=0.4))
        world.step(1 / 60)
    assert len(world) == 30
    # Each fell freely since it was added: y = 5 - g t^2 / 2, exact for Verlet from its second-order start.
    for k, group in enumerate(groups):
        t = (30 - k) / 60
        assert group.position[0, 1] == pytest.approx(max(5 - 9.81 * t * t / 2, 0.4), abs=1e-9)


def test_escaped_counts_centres_outside() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
    world.add(position=[(5, 5), (-1, 5), (5, 11)], on_overlap="push")
    assert world.escaped() == 2
    world.step(1 / 60)
    assert world.escaped() == 0


def test_an_empty_world_runs() -> None:
    world = pv.World(boundary=pv.Circle(radius=5))
    made = report.run(world, scene="none", frames=6, dt=1 / 60, step=world.step)
    assert (made["particles"], made["energy"]["total"], made["escaped"]) == (0, 0.0, 0)
    assert world.overlap() == (0.0, 0.0, 0)


FORCES = [
    pv.Attractor(strength=1), pv.ConstantForce((1, 2)), pv.Cohesion(strength=1, break_distance=0.1), pv.Drag(linear=0.1),
    pv.Fluid(rest_density=1000, stiffness=100), pv.Gravitation(strength=1, softening=0.1), pv.Langevin(temperature=1, friction=1),
    pv.LennardJones(epsilon=1, sigma=1), pv.PointSpring(stiffness=1), pv.SoftRepulsion(strength=1, range=1),
    pv.Wind((1, 0), linear=1), pv.Yukawa(strength=1, screening_length=1, cutoff=2),
]  # fmt: skip


@pytest.mark.parametrize("force", FORCES, ids=lambda force: type(force).__name__)
@pytest.mark.parametrize("boundary", [pv.Open(), pv.Box((0, 0), (9, 9)), pv.Periodic((0, 0), (9, 9))], ids=repr)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("removed", [False, True])
def test_a_force_may_act_on_nobody(force: Any, boundary: Any, dtype: Any, removed: bool) -> None:
    world = pv.World(boundary=boundary, dtype=dtype, ledger=True, contacts=True, collisions=None)
    world.forces.append(copy.deepcopy(force))
    if removed:
        balls = world.add(position=[(3, 3), (5, 5)], radius=0.1)
        world.step(1 / 60)
        world.remove(balls)
    world.run(seconds=0.05)
    assert (len(world), world.energy().total, world.momentum().tolist()) == (0, 0.0, [0.0, 0.0])
    assert world.add(position=[(1, 1)], radius=0.1).position.shape == (1, 2)
    world.step(1 / 60)
    assert np.isfinite(world.ledger.residual)


def test_grip_pulls_one_particle_to_its_target() -> None:
    world = pv.World(boundary=pv.Box((-5, -5), (5, 5)))
    balls = world.add(position=[(0, 0), (3, -4.5)], radius=0.5)
    grip = pv.forces.Grip(0, target=(2, 3), frequency=5.0)
    world.forces.append(grip)
    world.run(seconds=2)
    # A spring of frequency f sags by g / (2 pi f)^2 = 1 cm.
    assert balls.position[0] == pytest.approx([2, 3 - 9.81 / (10 * np.pi) ** 2], abs=1e-3)
    grip.target = (-2, 0)
    world.run(seconds=2)
    assert balls.position[0, 0] == pytest.approx(-2, abs=1e-3)
    assert balls.position[1] == pytest.approx([3, -4.5], abs=1e-3)


def test_push_clears_a_hole() -> None:
    world = pv.World(gravity=(0, 0), collisions=None)
    balls = world.add(position=grid(13, 13, 0.5, (-3, -3), loose=0), radius=0.1)
    far = np.hypot(*balls.position.T) > 2
    before = balls.position[far].copy()
    world.forces.append(pv.forces.Push(center=(0, 0), radius=2, acceleration=200))
    world.run(seconds=0.2)
    assert balls.position[far].tolist() == before.tolist()
    near = np.hypot(*balls.position[~far].T)
    assert np.sort(near)[1] > 1.5  # all but the one at the very centre


class Explode:
    """A force that turns NaN at a given time, for one particle."""

    velocity_dependent = False

    def apply(self, state: Any, t: float) -> None:
        if t > 0.5:
            state.force[state.sorted_index(3)] = np.nan


def test_a_non_finite_state_stops_the_world_and_keeps_the_last_good_frame() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (20, 20)))
    rng = np.random.default_rng(0)
    world.add(position=rng.uniform(1, 19, (50, 2)), radius=0.2)
    world.forces.append(Explode())
    with pytest.raises(pv.NonFiniteError, match="particle 3 turned non-finite in stage 'integrate'") as caught:
        world.run(seconds=2)
    assert (caught.value.particle, caught.value.stage) == (3, "integrate")
    assert 0.4 < world.time <= 0.51
    assert np.isfinite(world.position).all()
    assert np.isfinite(world.energy().total)
    world.forces.clear()
    world.run(seconds=0.5)
    assert np.isfinite(world.position).all()


@pytest.mark.parametrize("gravity", [(0, 0), (0, -9.81), (3, 0)])
@pytest.mark.parametrize("what", ["position", "velocity"])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_it_is_found_where_the_energy_is_watched(what: str, axis: int, value: float, gravity: tuple[float, float]) -> None:
    # That a frame of contacts is finite is known from its energy, sum(m v^2 / 2 - m g x): no row may be missing in it.
    world = pv.World(gravity=gravity)
    world.add(position=[(0, 0), (1, 0), (2, 0)], radius=0.5)
    world.step(1 / 60)
    getattr(world, what)[2, axis] = value
    with pytest.raises(pv.NonFiniteError, match=r"particle 2 .* stage 'gather'"):
        world.step(1 / 60)


def test_errors_travel_between_processes() -> None:
    error = pickle.loads(pickle.dumps(pv.NonFiniteError(3, "contacts", 1.5)))
    assert "particle 3" in str(error)
    assert isinstance(error, pv.PyverletError)


@pytest.mark.parametrize("wrong", [3, None])
def test_what_is_no_path_no_world_and_no_link_is_refused(wrong: Any) -> None:
    world = pv.World()
    for ask in (pv.load, pv.Trajectory, pv.read_trajectory, pv.scenes.read, lambda path: pv.save(world, path),
                lambda path: pv.record.to_video(world, path), pv.scenes.get("cage").write):  # fmt: skip
        refused(f"path is {wrong}; allowed is a path, as text or", ask, wrong)
    refused(f"world is {wrong}; allowed are a pyverlet.World and pyverlet.Panels", pv.view, wrong)
    refused(f"saved is {wrong}; allowed is what save", world.restore, wrong)
    refused(f"name is {wrong}; allowed is a text", pv.scenes.get, wrong)
    refused(f"{wrong} is not among this world's links", world.links.remove, wrong)
