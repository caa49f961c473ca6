"""How many threads a world uses, on machines that are made up: quiet, busy, and one after the other."""

from collections.abc import Callable

import numpy as np
import pytest

from pyverlet.world.team import Team, ladder

Machine = Callable[[int, np.random.Generator], float]
"""ms of a frame on so many threads."""


def quiet(threads: int, rng: np.random.Generator) -> float:
    """Amdahl's law with a tenth that is not shared; one frame in twenty makes the list of pairs anew, one in 300 stands still."""
    work = 3.0 * (0.1 + 0.9 / threads) * rng.normal(1.0, 0.05)
    return float(work * rng.choice([1.0, 2.0], p=[0.95, 0.05]) + rng.choice([0.0, 30.0], p=[1 - 1 / 300, 1 / 300]))


def busy(cores: int, threads_that_gain: int) -> Machine:
    """Up to so many threads all is quiet; those beyond wait for a core, now and then for long."""

    def frame(threads: int, rng: np.random.Generator) -> float:
        late = threads > threads_that_gain
        return quiet(min(threads, threads_that_gain), rng) * (1 + late * rng.lognormal(0.5, 1.2))

    assert threads_that_gain <= cores
    return frame


def run(team: Team, cores: int, machine: Machine, frames: int, seed: int) -> tuple[list[int], list[float]]:
    rng = np.random.default_rng(seed)
    used, times = list[int](), [0.0]
    for _ in range(frames):
        used.append(team.size(cores, times[-1]))
        times.append(machine(used[-1], rng))
    return used, times[1:]


def test_a_trial_is_put_off_while_frames_say_nothing() -> None:
    team, frames = Team(), 0
    while team.size(2, 1.0) == 2:  # until one thread is tried
        frames += 1
        assert frames < 100
    assert team.size(2, 1.9) == 1
    assert [team.size(2, 0.0) for _ in range(5)] == [2] * 5
    assert team.size(2, 1.0) == 1  # it begins anew
    used = [team.size(2, 1.9) for _ in range(20)]
    assert used == sorted(used)
    assert used[-1] == 2


@pytest.mark.parametrize(("cores", "most"), [(2, 1.05), (4, 1.1), (16, 1.1)])
@pytest.mark.parametrize("seed", [0, *(pytest.param(each, marks=pytest.mark.slow) for each in range(1, 5))])
def test_a_quiet_machine_is_used(cores: int, most: float, seed: int) -> None:
    _, times = run(Team(), cores, quiet, 4000, seed)
    rng = np.random.default_rng(seed)
    all_of_them = [quiet(cores, rng) for _ in range(4000)]
    assert np.median(times) < most * np.median(all_of_them)
    assert np.mean(times) < most * np.mean(all_of_them)


@pytest.mark.parametrize(("cores", "gain"), [(2, 1), (4, 3), (16, 15), (16, 4)])
@pytest.mark.parametrize("seed", [0, *(pytest.param(each, marks=pytest.mark.slow) for each in range(1, 5))])
def test_beside_other_programs_late_threads_are_left_out(cores: int, gain: int, seed: int) -> None:
    machine = busy(cores, gain)
    team = Team()
    run(team, cores, machine, 600, seed)
    _, times = run(team, cores, machine, 4000, seed + 100)
    rng = np.random.default_rng(seed)
    best = [machine(gain, rng) for _ in range(4000)]
    assert np.median(times) < 1.25 * np.median(best)
    assert np.quantile(times, 0.95) < 2.0 * np.quantile(best, 0.95)


def test_when_the_other_program_ends_threads_come_back() -> None:
    team = Team()
    run(team, 2, busy(2, 1), 2000, 1)
    used, _ = run(team, 2, quiet, 8000, 2)
    assert np.mean(np.array(used[-1000:]) == 2) > 0.95


def test_when_another_program_begins_they_go_at_once() -> None:
    team = Team()
    run(team, 2, quiet, 2000, 1)
    used, times = run(team, 2, busy(2, 1), 300, 2)
    late = np.array(times) > 2 * 3.0 * 2  # twice a frame of one thread that makes its list
    assert np.flatnonzero(np.array(used) == 1)[0] < 30
    assert late.sum() < 30


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(each, marks=pytest.mark.slow) for each in range(2, 5))])
def test_a_machine_that_is_now_a_little_slower_is_tried_anew(seed: int) -> None:
    # Not by so much that a few frames say so: two threads, 0.55 times one until then, are 1.4 times as slow from now on.
    def crowded(threads: int, rng: np.random.Generator) -> float:
        return quiet(1, rng) * (1.4 if threads > 1 else 1.0)

    team = Team()
    run(team, 2, quiet, 12_000, seed)
    used, _ = run(team, 2, crowded, 600, seed + 100)
    assert np.mean(np.array(used[100:]) == 1) > 0.9


def test_one_thread_is_never_a_matter_of_trials() -> None:
    used, _ = run(Team(), 1, quiet, 500, 0)
    assert set(used) == {1}


def test_numbers_that_are_tried() -> None:
    tried = {1: [1], 2: [1, 2], 3: [1, 2, 3], 4: [1, 2, 3, 4], 8: [1, 2, 4, 7, 8], 12: [1, 2, 4, 8, 11, 12]}
    assert {n: ladder(n) for n in tried} == tried
