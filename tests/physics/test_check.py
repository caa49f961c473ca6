"""The promises of `pyverlet check physics`, by the same functions: the quick set always, the full one with `-m full`.

The dearest of the quick set are `slow`, and always run at a smaller size.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats
from tests.programs import python
from tests.worlds import refused

from pyverlet import force
from pyverlet.cli import main
from pyverlet.common.errors import NonFiniteError
from pyverlet.lab import fuzz, physics
from pyverlet.lab.fuzz import Broken, Program, check, look_at, random_program, shrink
from pyverlet.lab.physics import energy, friction, gas, lost
from pyverlet.world.world import World

# Settings at which a check takes a fraction of the processor time, where it takes one to thirty seconds as it is.
SMALLER: dict[str, dict[str, Any]] = {
    "repose": {"heaps": 2, "particles": 200, "frictions": (0.0, 0.5)},
    "energy-scenes": {"seconds": 0.5, "counts": (1, 8)},
    "energy-gas": {"seconds": 1},
    "energy-overlapped": {"seconds": 0.5},
    "energy-coincident": {"seconds": 0.5},
    "rest-cage": {"particles": 250},
    "rest-column": {"particles": 50},
    "left-alone": {"particles": 100},
    "left-alone-rough": {"particles": 120, "seconds": 30},
    "rest-substeps": {"particles": 100, "seconds": 10},
    "masses": {"particles": 150},
    "radii": {"particles": 150},
    "radii-masses": {"particles": 150},
    "heavy-on-rough-bed": {"seconds": 6},  # fewer are not deep enough: with 700 it sinks to a third of the bed
    "heavy-on-smooth-bed": {"particles": 700, "seconds": 6},
    "ball-in-box": {"steps": 10_000},
}


# Dear ones of which another shows the same at one number of substeps, or for one law.
DEAR = ("rebound-substeps", "gas-pressure")


# Dear ones even so: at any size with `--all` only.
DEARER = ("repose", "energy-scenes", "radii-masses")


def cases() -> list[Any]:
    """Each check as it is, at a smaller size if that is dear, and at its full size; whether it is the full one."""
    found = []
    for each in physics.CHECKS:
        found.append(pytest.param(each, False, id=each.name, marks=[pytest.mark.slow] * (each.name in (*SMALLER, *DEAR))))
        if smaller := SMALLER.get(each.name):
            other = replace(each, settings={**each.settings, **smaller})
            found.append(pytest.param(other, False, id=f"small-{each.name}", marks=[pytest.mark.slow] * (each.name in DEARER)))
        if each.full:
            found.append(pytest.param(each, True, id=f"full-{each.name}", marks=pytest.mark.full))
    return found


@pytest.mark.parametrize(("check", "full"), cases())
def test_promise(check: physics.Check, full: bool) -> None:
    row = check.run(full=full)
    assert row.passed, f"asked: {row.asked}; measured: {row.measured}"


# ---- the instruments themselves: each must see what it is there to see ----


def test_names_are_unique() -> None:
    names = [check.name for check in physics.CHECKS]
    assert len(set(names)) == len(names)
    assert {*SMALLER, *DEAR, *DEARER} <= set(names)
    assert all(check.summary.endswith(".") or ":" in check.summary for check in physics.CHECKS)


def test_kolmogorov_smirnov_agrees_with_scipy() -> None:
    rng = np.random.default_rng(0)
    for sample in (rng.rayleigh(2.0, 1000), rng.rayleigh(2.1, 1000), np.full(500, 2.0)):
        ours = gas.kolmogorov_smirnov(sample, mean_square=8.0)
        theirs = scipy.stats.kstest(sample, scipy.stats.rayleigh(scale=2.0).cdf)
        assert ours[0] == pytest.approx(theirs.statistic, rel=1e-12)
        assert ours[1] == pytest.approx(theirs.pvalue, abs=0.02)


@pytest.mark.parametrize("degrees", [5.0, 15.0, 25.0])
def test_surface_angle_of_a_drawn_heap(degrees: float) -> None:
    # A triangle filled with points at random: the slope of its sides is known.
    x, y = np.random.default_rng(0).uniform(0, 1, (2, 20_000))
    heap = np.column_stack((10 * (2 * x - 1), 10 * np.tan(np.radians(degrees)) * y))
    heap = heap[heap[:, 1] < (10 - np.abs(heap[:, 0])) * np.tan(np.radians(degrees))]
    assert friction.surface_angle(heap, 10.0) == pytest.approx(degrees, abs=0.5)


def test_a_rise_of_energy_is_seen() -> None:
    world = energy.elastic_gas(8)
    size = energy.scale(world, 0.5)

    assert energy.worst_rise(world, 0.5)[0] < 1e-5
    world.forces.append(force(lambda x, y, vx, vy, mass, t: (vx, vy)))
    # dE/dt = sum v . v: in a frame 2 K / 60, with K the kinetic energy
    assert energy.worst_rise(world, 0.5)[0] > 0.9 * 2 * world.energy().kinetic / 60 / size / 4


def test_contacts_by_hand() -> None:
    assert lost.contacts_by_hand(np.array([[0, 0], [0.9, 0], [3, 0], [3.4, 0], [2.1, 0]]), np.full(5, 0.5)) == 3


def test_the_command_prints_a_line_for_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "physics", "--only", "sliding-disc", "--only", "slope"]) == 0
    out = capsys.readouterr().out
    for word in ("asked", "measured", "seconds", "sliding-disc", "slope", "pass", "2 of 2 pass"):
        assert word in out
    assert max(map(len, out.splitlines())) < 140


def test_a_failure_shows_in_the_exit_code(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> physics.Result:
        """Nothing."""
        raise NonFiniteError(3, "contacts", 1.0)

    monkeypatch.setattr(physics, "CHECKS", (physics.Check("broken", broken),))
    assert main(["check", "physics", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["passed"], report["failed"], report["full"]) == (0, 1, False)
    assert report["checks"][0]["asked"] == "Nothing."
    assert "non-finite" in report["checks"][0]["measured"]


def test_json_has_the_figures(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "physics", "--only", "sliding-disc", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["checks"]
    assert set(row) == {"name", "asked", "measured", "passed", "seconds", "values"}
    assert row["passed"] is True
    assert row["values"]


def test_an_unknown_check_is_refused(refusal: Any) -> None:
    assert "did you mean 'slope'" in refusal("check", "physics", "--only", "slop")
    refused("known: rebound-box", physics.named, "nothing like it")


# ---- Random worlds: what is promised of all, seeds that once failed, and that a failing world is made small ----


QUICK, ALL = 24, 300


@pytest.mark.parametrize(
    ("seed", "small"),
    [(0, False), *(pytest.param(each, False, marks=pytest.mark.slow) for each in range(3, QUICK, 3))]
    + [pytest.param(each, True, marks=pytest.mark.slow) for each in range(QUICK, ALL, 3)],
)
def test_some_random_worlds(seed: int, small: bool) -> None:
    for each in range(seed, seed + 3):
        (finding,) = fuzz.fuzz(1, each, small=small)
        assert finding.check is None, f"seed {each}: {finding.check}\n{finding.program}"


# Light circles beside drag stiffer than a substep; pinned circles that move; circles lowered through a wall, pegs that push out;
# circles that start on top of each other and are pushed apart against springs, and what swings when they are; obstacles taken
# away under a ledger; a pinned one let go outside the room; a body that rests but for the rounding of its places; a cloth crushed
# between pinned circles and a wall; a crowd that is wedged in, and gains though it stays where it is; linked circles with lent
# inertia that hit a wall and touch nobody.
# Then what the checks themselves took for failures: a single stick that a wall stretches, masks, springs to a point too stiff
# for a substep, springs whose places are rounded, who rolls in coarse steps, who sleeps, a chain of stiff sticks,
# accounts that have been turned over, a cloth that begins in an obstacle, forces taken away, a linked circle moved, and an angle
# too stiff for a substep. And nets of springs that one pass does not solve, and stiff angles: soft links bring no energy.
@pytest.mark.parametrize(
    "seed",
    [
        *(18, 41, 88, 192, 1522, 2167, 61, 92, 100904, 105428, 116757, 400023, 410579, 700313, 700585, 702781, 43),
        # These take long.
        *(pytest.param(each, marks=pytest.mark.slow) for each in (411737, 48, 168, 960983)),
        *(pytest.param(each, marks=pytest.mark.slow) for each in (2146, 75, 256, 961085, 105154, 100674, 411340, 702660, 704622)),
        *(pytest.param(each, marks=pytest.mark.slow) for each in (102853, 103593, 104756, 104863, 106417, 106603, 107129)),
        *(pytest.param(each, marks=pytest.mark.slow) for each in (98, 100356)),
    ],
)
def test_seeds_that_once_failed(seed: int) -> None:
    (finding,) = fuzz.fuzz(1, seed, small=False)
    assert finding.check is None, finding.check


def test_a_seed_says_it_all() -> None:
    assert random_program(7) == random_program(7)
    assert len({random_program(seed).source() for seed in range(50)}) == 50


def test_everything_there_is_gets_its_turn() -> None:
    text = "\n".join(random_program(seed).source() for seed in range(2000))
    names = (
        "Circle Box Open BruteForce ledger events contacts sleep float64 PositionVerlet VelocityVerlet RK4 Yoshida4 "
        "ExplicitEuler Stick Rope Spring Pin( Angle chain( rope( cloth( soft_body( Segment Capsule Disc Polygon Chain( "
        "Drag Wind PointSpring "
        "Attractor Gravitation ConstantForce Emitter Sink breaking_force np.inf world.remove world.gravity world.substeps"
    )
    assert [name for name in names.split() if name not in text] == []


LIFTED = Program(3, 30, {"gravity": "(0, 0)"}, ("world.add(position=rng.random((n, 2)), radius=0.01, velocity=1)",), frames=12)


@pytest.mark.parametrize(
    ("change", "broken"),
    [
        ("world.position[0, 0] += 100", None),  # allowed: a user may
        ("world._state.velocity[0, 0] = np.nan", "finite"),
        ("world.step = lambda dt: world.velocity.__imul__(-1.0)", "momentum"),
    ],
)
def test_what_is_broken_is_seen_and_made_small(change: str, broken: str | None) -> None:
    program = replace(LIFTED, changes=((2, "world.spin[:] = 0"), (5, change)))
    finding = look_at(program)
    assert (finding.check or "none").split(",")[0] == (broken or "none")
    if finding.program:
        assert change in finding.program
        assert "world.spin" not in finding.program
        assert len(finding.program.splitlines()) <= 20


@pytest.mark.parametrize(("factor", "broken"), [(1.001, "links"), (1.0, "none")])
def test_energy_that_a_world_with_links_gains_is_seen(factor: float, broken: str) -> None:
    """A swinging rope whose speeds are multiplied after each frame: the kinetic energy grows by two thousandths in each."""
    lines = (
        "pv.rope(world, (0, 0), (2, 0), links=10)", "step = world.step",
        f"world.step = lambda dt: (step(dt), world.velocity.__imul__({factor}))",
    )  # fmt: skip
    finding = look_at(Program(3, 0, {"integrator": "pv.VelocityVerlet()"}, lines, frames=30), small=False)
    assert (finding.check or "none").split(",")[0] == broken


def test_what_is_printed_fails_by_itself(tmp_path: Path) -> None:
    finding = look_at(replace(LIFTED, changes=((5, "world._state.velocity[0, 0] = np.nan"),)))
    assert finding.program
    (tmp_path / "failing.py").write_text(finding.program)
    done = python("failing.py", cwd=tmp_path)
    assert done.returncode == 1
    assert "Broken: finite" in done.stderr


def test_leaving_out_stops_where_the_failure_would_go() -> None:
    program = Program(
        0, 40, {"substeps": "3", "dtype": '"float64"'}, ("a", "f(b=1, c=(2, 3), d=4)", "e"), ((3, "x"), (9, "y")), 20
    )

    def fails(simpler: Program) -> int | None:
        needed = simpler.count >= 7 and "c=(2, 3)" in "".join(simpler.lines) and (3, "x") in simpler.changes
        return 0 if needed else None

    least = shrink(program, fails)
    assert (least.count, least.settings, least.lines, least.changes, least.frames) == (7, {}, ("f(c=(2, 3))",), ((3, "x"),), 4)


def test_worlds_that_differ_between_runs_are_seen() -> None:
    runs: list[World] = []

    def build(threads: int | None) -> World:
        world = World(threads=threads)
        world.add(position=(0.0, float(len(runs))))
        runs.append(world)
        return world

    with pytest.raises(Broken, match="bits"):
        check(build, lambda world, frame: None, frames=2, dt=0.01)


# Nets of springs that one pass does not solve; stiff angles.
def test_on_the_command_line(report: Any) -> None:
    said = report("check", "fuzz", "--worlds", "2", "--seed", "0", "--without", "bits")
    assert (said["worlds"], said["failed"], said["findings"]) == (2, 0, [])
