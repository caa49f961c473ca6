"""The promises of `pyverlet check physics`, by the same functions: the quick set always, the full one with `-m full`.

The dearest of the quick set are `slow`, and always run at a smaller size.
"""

import dataclasses
import json
from typing import Any

import numpy as np
import pytest
import scipy.stats

from pyverlet.cli import main
from pyverlet.ground.errors import InputError, NonFiniteError
from pyverlet.lab import physics
from pyverlet.lab.physics import energy, friction, gas, lost

# Promises that do not hold yet. Strict: the first run in which one holds fails until its line here is removed.
BROKEN: dict[str, str] = {}

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


def parameters() -> list[Any]:
    marks: dict[str, Any] = dict.fromkeys((*SMALLER, *DEAR), pytest.mark.slow)
    marks |= {name: pytest.mark.xfail(strict=True, reason=f"{name}: {reason}") for name, reason in BROKEN.items()}
    return [pytest.param(check, id=check.name, marks=marks.get(check.name, ())) for check in physics.CHECKS]


@pytest.mark.parametrize("check", parameters())
def test_promise(check: physics.Check) -> None:
    row = check.run()
    assert row.passed, f"asked: {row.asked}; measured: {row.measured}"


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name in DEARER else name for name in SMALLER])
def test_promise_at_a_smaller_size(name: str) -> None:
    check = physics.named(name)
    row = dataclasses.replace(check, settings={**check.settings, **SMALLER[name]}).run()
    assert row.passed, f"asked: {row.asked}; measured: {row.measured}"


@pytest.mark.full
@pytest.mark.parametrize("check", [pytest.param(c, id=c.name) for c in physics.CHECKS if c.full])
def test_promise_at_its_full_size(check: physics.Check) -> None:
    row = check.run(full=True)
    assert row.passed, f"asked: {row.asked}; measured: {row.measured}"


# ---- the instruments themselves: each must see what it is there to see ----


def test_names_are_unique_and_broken_ones_exist() -> None:
    names = [check.name for check in physics.CHECKS]
    assert len(set(names)) == len(names)
    assert set(BROKEN) <= set(names)
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

    class Warming:
        def apply(self, state: Any, t: float) -> None:
            state.force += state.velocity

    assert energy.worst_rise(world, 0.5)[0] < 1e-5
    world.forces.append(Warming())
    # dE/dt = sum v . v: in a frame 2 K / 60, with K the kinetic energy
    assert energy.worst_rise(world, 0.5)[0] > 0.9 * 2 * world.energy().kinetic / 60 / size / 4


def test_contacts_by_hand() -> None:
    assert lost.contacts_by_hand(np.array([[0, 0], [0.9, 0], [3, 0], [3.4, 0], [2.1, 0]]), np.full(5, 0.5)) == 3


# ---- the command ----


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


def test_an_unknown_check_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "physics", "--only", "slop"]) == 2
    assert "did you mean 'slope'" in capsys.readouterr().err
    with pytest.raises(InputError, match="known: rebound-box"):
        physics.named("nothing like it")
