"""Many worlds: each is what it would be alone, wherever it lives, and the arrays are those of the worlds themselves."""

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.programs import python
from tests.uncompiled import UNCOMPILED
from tests.worlds import refused

import pyverlet as pv
from pyverlet import core
from pyverlet.data.worlds import seed_of

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module", params=[1, 2])
def many(request: pytest.FixtureRequest) -> Iterator[pv.Worlds]:
    with pv.Worlds("box", 5, seed=3, processes=request.param, particles=41, friction=0.3) as worlds:
        yield worlds


@pytest.fixture
def start(many: pv.Worlds) -> Iterator[Any]:
    saved = many.save()
    yield saved
    many.restore(saved)


def alone(k: int, frames: int) -> pv.World:
    world = pv.scenes.get("box").world(particles=41, friction=0.3, seed=seed_of(3, k))
    world.run(seconds=frames / 60)
    return world


def test_heat_baths_take_the_seeds_of_many_worlds() -> None:
    with pv.Worlds("droplets", 4, seed=5, processes=1, particles=60) as worlds:  # seeds of 64 bits, half of them beyond 2^63
        worlds.step(1 / 60)
        velocity = worlds.velocity
        assert len({velocity[k].tobytes() for k in range(4)}) == 4


def test_each_is_what_it_would_be_alone(many: pv.Worlds, start: Any) -> None:
    many.run(seconds=0.25)
    for _ in range(5):
        many.step(1 / 60)
    for k, world in enumerate(many):
        expected = alone(k, 20)
        assert world.state_hash() == expected.state_hash()
        for name in ("position", "velocity", "spin", "radius", "mass"):
            assert np.array_equal(getattr(many, name)[k], getattr(expected, name))
        world.step(1 / 60)  # which goes on by itself
        expected.step(1 / 60)
        assert world.state_hash() == expected.state_hash()
    assert many.time == pytest.approx(np.full(5, 20 / 60))
    assert len(many) == 5


def test_seeds_are_of_each_world_alone() -> None:
    assert len({seed_of(seed, k) for seed in range(10) for k in range(100)}) == 1000
    # SeedSequence is a published algorithm whose numbers NumPy keeps: as long as this holds, so do all worlds made from it.
    assert seed_of(0, 0) == int(np.random.SeedSequence((0, 0)).generate_state(1, np.uint64)[0])


def test_going_back_and_on_again(many: pv.Worlds, start: Any) -> None:
    many.run(seconds=0.2)
    there = many.position.copy()
    half = many.save()
    many.run(seconds=0.2)
    end = many.position.copy()
    many.restore(half, [1, 4])
    assert np.array_equal(many.position[[1, 4]], there[[1, 4]])
    assert np.array_equal(many.position[[0, 2, 3]], end[[0, 2, 3]])
    many.restore(half, np.array([True, False, True, True, False]))
    many.run(seconds=0.2)
    assert np.array_equal(many.position, end)
    refused("which has 5", many.restore, half, 5)
    refused("saved", many.restore, pv.World().save())


@pytest.mark.slow
def test_uncompiled_they_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> tuple[list[str], bool]:
        many = pv.Worlds("box", 2, processes=1, particles=4)
        many.run(seconds=4 / 60)
        worlds = many._workers[0].worlds
        return [world.state_hash() for world in worlds], all(world.profile.plain[0, -1] for world in worlds)

    compiled = run()
    monkeypatch.setattr(core, "unit", UNCOMPILED)
    assert run() == compiled
    assert compiled[1]


def test_what_is_written_counts(many: pv.Worlds, start: Any) -> None:
    many.velocity[2, 0] = (0.0, 7.0)
    many.gravity[3] = (1.0, 0.0)
    many.step(1 / 60)
    pushed, turned = alone(2, 0), alone(3, 0)
    pushed.velocity[0] = (0.0, 7.0)
    turned.gravity = (1.0, 0.0)
    for k, world in ((2, pushed), (3, turned), (1, alone(1, 0))):
        world.step(1 / 60)
        assert many[k].state_hash() == world.state_hash()
    many.gravity[3] = (0.0, -9.81)


def test_a_world_that_fails_is_named_and_the_others_go_on(many: pv.Worlds, start: Any) -> None:
    many.velocity[3, 7] = np.nan
    with pytest.raises(pv.PyverletError, match=r"world 3: .*particle 7"):
        many.step(1 / 60)
    assert many[4].state_hash() == alone(4, 1).state_hash()
    many.restore(start)
    many.step(1 / 60)
    assert many[3].state_hash() == alone(3, 1).state_hash()


def test_bad_arguments_get_a_sentence() -> None:
    for options, said in (
        ({"scene": "cagee"}, "did you mean 'cage'"),
        ({"n": 0}, "n is 0"),
        ({"fricton": 0.1}, "no setting 'fricton'"),
        ({"processes": 9}, "processes is 9"),
        ({"seed": -1}, "seed is -1"),
        ({"particles": 0}, "particles is 0"),
    ):
        given: dict[str, Any] = {"scene": "box", "n": 2, "processes": 1} | options
        refused(said, pv.Worlds, given.pop("scene"), given.pop("n"), **given)


def emitting(settings: Any) -> pv.World:
    world = settings.empty_world(pv.Box((0, 0), (20, 20)))
    world.add(position=[(1, 1), (3, 1)])
    world.actors.append(pv.Emitter(pv.Box((1, 10), (19, 19)), rate=60, seed=settings.seed % 100))
    return world  # type: ignore[no-any-return]


def test_worlds_whose_particles_come_and_go() -> None:
    scene = pv.scenes.Scene("emitting", "", emitting)
    refused("to other processes", pv.Worlds, pv.scenes.Scene("inner", "", lambda settings: emitting(settings)), 2, processes=2)
    many = pv.Worlds(scene, 3, processes=1)
    start = many.save()
    many.velocity[0, 0] = (1.0, 0.0)
    many.run(seconds=0.2)
    assert (many.counts > 2).all()
    refused("many\\[k\\]", getattr, many, "position")
    assert len(many[1]) == many.counts[1]
    many.restore(start)
    assert many.position.shape == (3, 2, 2)
    many.velocity[:] = 3.0  # the arrays are the worlds' own again
    assert (many[2].velocity == 3.0).all()


@pytest.mark.slow
def test_a_process_that_is_killed_is_said_to_be() -> None:
    many = pv.Worlds("box", 2, processes=2, particles=5)
    assert many._pool is not None
    many._pool._processes[0].kill()
    with pytest.raises(pv.PyverletError, match="has ended"):
        many.step(1 / 60)


SCRIPT = """
import pyverlet as pv
many = pv.Worlds("box", 4, processes=2, particles=5)  # at the top of a script, without a guard
many.step(1 / 60)
print(many.position.shape)
"""


@pytest.mark.slow
def test_scripts_need_no_guard(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    run = python("script.py", cwd=tmp_path)
    assert (run.returncode, run.stdout.strip(), run.stderr) == (0, "(4, 5, 2)", "")


@pytest.mark.slow
def test_the_vector_env_of_the_examples() -> None:
    pytest.importorskip("gymnasium")
    made = runpy.run_path(str(EXAMPLES / "gym_vector_env.py"))
    env = made["Climb"](4, particles=20, near=3)
    first, _ = env.reset()
    assert first in env.observation_space
    for _ in range(10):
        observed, paid, ended, truncated, _ = env.step(env.action_space.sample())
        assert observed in env.observation_space
        assert paid.shape == ended.shape == truncated.shape == (4,)
    mask = np.array([True, False, False, True])
    again, _ = env.reset(options={"reset_mask": mask})
    assert np.array_equal(again[mask], first[mask])
    assert not (again[~mask] == first[~mask]).all(axis=1).any()
    env.close()
