"""Random worlds: what is promised of all, seeds that once failed, and that a failing world is made small."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from pyverlet.cli import main
from pyverlet.lab import fuzz
from pyverlet.lab.fuzz import Broken, Program, check, random_program, shrink
from pyverlet.lab.fuzz.run import look_at
from pyverlet.world.world import World

QUICK, ALL = 24, 300


@pytest.mark.parametrize("seed", [0, *(pytest.param(each, marks=pytest.mark.slow) for each in range(3, QUICK, 3))])
def test_some_random_worlds(seed: int) -> None:
    for each in range(seed, seed + 3):
        (finding,) = fuzz.fuzz(1, each, small=False)
        assert finding.check is None, f"seed {each}: {finding.check}"


# Light circles beside drag stiffer than a substep; pinned circles that move; circles lowered through a wall, pegs that push out;
# circles that start on top of each other and are pushed apart against springs, and what swings when they are; obstacles taken
# away under a ledger; a pinned one let go outside the room; a body that rests but for the rounding of its places; a cloth crushed
# between pinned circles and a wall; a crowd that is wedged in, and gains though it stays where it is; linked circles with lent
# inertia that hit a wall and touch nobody.
# Then what the checks themselves took for failures: a single stick that a wall stretches, masks, springs to a point too stiff
# for a substep, springs whose places are rounded, who rolls in coarse steps, who sleeps, a chain of stiff sticks,
# accounts that have been turned over, a cloth that begins in an obstacle, forces taken away, a linked circle moved, and an angle
# too stiff for a substep.
@pytest.mark.parametrize(
    "seed",
    [
        *(18, 41, 88, 168, 192),
        *(1522, 2167, 61, 92, 100904, 105428, 116757, 400023, 410579, 411737),
        *(700313, 700585, 702781, 960983),
        # These take long.
        *(pytest.param(each, marks=pytest.mark.slow) for each in (2146, 75, 256, 961085, 105154, 100674, 411340, 702660, 704622)),
        *(pytest.param(each, marks=pytest.mark.slow) for each in (102853, 103593, 104756, 104863, 106417, 106603, 107129)),
    ],
)
def test_seeds_that_once_failed(seed: int) -> None:
    (finding,) = fuzz.fuzz(1, seed, small=False)
    assert finding.check is None, finding.check


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(QUICK, ALL, 12))
def test_random_worlds(seed: int) -> None:
    for each in range(seed, seed + 12):
        (finding,) = fuzz.fuzz(1, each)
        assert finding.check is None, f"seed {each}: {finding.check}\n{finding.program}"


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
    script = tmp_path / "failing.py"
    script.write_text(finding.program)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True)
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
@pytest.mark.parametrize("seed", [43, 48, *(pytest.param(each, marks=pytest.mark.slow) for each in (98, 100356))])
def test_soft_links_bring_no_energy(seed: int) -> None:
    (finding,) = fuzz.fuzz(1, seed, small=False)
    assert finding.check is None, finding.check


def test_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "fuzz", "--worlds", "2", "--seed", "0", "--without", "bits", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["worlds"], said["failed"], said["findings"]) == (2, 0, [])
