"""The laboratory's commands: what they print, draw and refuse."""

import dataclasses
import inspect
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.physics.test_solve import Midpoint

import pyverlet as pv
from pyverlet import scenes
from pyverlet.lab import order
from pyverlet.lab.compare import Run, compare

MINE = f"from typing import Any\n\nimport pyverlet as pv\n\n\n{inspect.getsource(Midpoint)}"


def test_compare_in_numbers(report: Any) -> None:
    methods = "explicit-euler,velocity-verlet"
    found = report("compare", "fall", "--integrators", methods, "--substeps", "1,4", "--seconds", "1")
    assert (found["scene"], found["seconds"]) == ("fall", pytest.approx(1.0))
    assert [(each["substeps"], each["integrator"]) for each in found["runs"]] == [
        (n, name) for n in (1, 4) for name in methods.split(",")
    ]
    for each in found["runs"]:
        h, start = 1 / 60 / each["substeps"], 10 * 9.81
        # Explicit Euler gains g^2 h / 2 a second and kilogram, in a straight line, and is late by g t h / 2; order 2 is exact.
        exact = 0.0 if each["integrator"] == "velocity-verlet" else 9.81**2 * h / 2 / start
        assert each["energy"]["start"] == pytest.approx(start)
        assert each["drift"] == pytest.approx(exact, abs=1e-12)
        assert each["slope_per_s"] == pytest.approx(exact, abs=1e-12)
        assert each["amplitude"] == pytest.approx(0.0, abs=1e-11)
        assert each["largest_error_m"] == pytest.approx(9.81 * h / 2 if exact else 0.0, abs=1e-11)
        assert each["apex_heights"] == []
        assert each["ms_per_frame"] > 0


def test_apexes_are_those_of_parabolas() -> None:
    # Thrown up at 3 m/s from 0.7 m and back every second: the top lies between frames, a parabola through three hits it.
    t = np.arange(181) / 60
    y = 0.7 + 3 * (t % 1) - 9.81 / 2 * (t % 1) ** 2
    run = Run("", 1, t, np.ones(181), y, None, 1.0)
    times, heights = run.apexes
    assert times == pytest.approx(np.array([0, 1, 2]) + 3 / 9.81, abs=1e-9)
    assert heights == pytest.approx(0.7 + 3**2 / (2 * 9.81), abs=1e-12)


def test_drift_slope_and_amplitude() -> None:
    t = np.linspace(0, 100, 100_001)
    energy = -2.0 * (1 + 1e-3 * t + 0.05 * np.sin(2 * np.pi * t))
    run = Run("", 1, t, energy, t, None, 1.0)
    assert run.drift == pytest.approx(-0.1, rel=1e-6)  # of |E|: the energy is negative and sinks
    assert run.slope == pytest.approx(-1e-3, rel=1e-2)
    assert run.amplitude == pytest.approx(0.05, rel=1e-2)


def test_compare_as_a_table(run: Any) -> None:
    code, out, err = run("compare", "bounce-verlet", "--seconds", "2", "--substeps", "3", "--integrators", "rk4,yoshida4")
    assert code == 0, err
    title, _, head, *rows = out.splitlines()
    assert title == "bounce-verlet, 2 s: energy relative to 29.43 J at the start"
    assert head.split("  ")[0] == "substeps"
    assert [row.split()[:2] for row in rows] == [["3", "rk4"], ["3", "yoshida4"]]


@pytest.mark.parametrize("scene", ["fall", *(pytest.param(name, marks=pytest.mark.slow) for name in ("bounce-order", "box"))])
def test_compare_draws(run: Any, tmp_path: Path, scene: str) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "out.png"
    options = ["--integrators", "rk4,explicit-euler", "--substeps", "1,2", "--seconds", "1.5", "--plot", str(picture)]
    code, out, err = run("compare", scene, *options, "--json")
    assert code == 0, err
    assert json.loads(out)["scene"] == scene
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f"wrote {picture}" in err


def test_the_figure_of_a_comparison_has_units(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from pyverlet.lab.comparison_figure import figure

    runs = compare(scenes.get("bounce-order"), [pv.RK4(), pv.Yoshida4()], [1, 2, 4], frames=150, dt=1 / 60)
    picture = figure(runs, "title", 3.0)
    axes = picture.axes
    assert len(axes) == 2 * 3 + 2
    assert "(E - E₀) / |E₀|" in axes[0].get_ylabel()
    assert "tops of the path (m)" in axes[3].get_ylabel()
    assert axes[3].get_xlabel() == "time t (s)"
    assert axes[-1].get_ylabel() == "cost (ms a frame, median)"
    # Two curves with the colours of Okabe and Ito, and the line of conserved energy.
    assert len(axes[0].lines) == 3
    assert axes[0].lines[0].get_color() == "#0072B2"


def test_a_scene_without_energy_is_refused(refusal: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    flat = dataclasses.replace(scenes.get("fall"), name="flat", defaults=scenes.get("fall").settings(gravity=(0.0, 0.0)))
    monkeypatch.setitem(scenes.SCENES, "flat", flat)
    assert "'flat', which starts with an energy of 0 J" in refusal("compare", "flat", "--seconds", "1")


@pytest.fixture
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Orders are fitted to two runs instead of four: `test_order.py` has the figures."""
    monkeypatch.setattr(order.measure, "__kwdefaults__", {"jitter": 0.0, "frames": (80, 160)})


@pytest.mark.usefixtures("few_steps")
def test_order_in_numbers(report: Any) -> None:
    methods = report("order", "--integrators", "semi-implicit-euler,position-verlet")["methods"]
    assert [(each["method"], each["declared"], each["expected"]) for each in methods] == [
        ("semi-implicit-euler", 1, 1), ("position-verlet", 2, 2), ("position-verlet, naive start", 2, 1),
        ("position-verlet, jittering step", 2, None),
    ]  # fmt: skip
    for each in methods:
        assert each["as_expected"]
        assert set(each["problems"]) == {"oscillator", "pendulum", "kepler orbit", "fall with drag"}
        for found in each["problems"].values():
            assert len(found["h"]) == len(found["error"]) == 2
            if each["expected"]:
                assert found["order"] == pytest.approx(each["expected"], abs=0.1)


@pytest.mark.slow
def test_order_as_table_and_figure(run: Any, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "order.png"
    code, out, err = run("order", "--integrators", "rk4", "--plot", str(picture))
    assert code == 0, err
    head, row = out.splitlines()
    assert head.split("  ")[0] == "method"
    assert row.split()[:2] == ["rk4", "4"]
    assert row.endswith("as expected")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("command", [["order"], ["compare", "fall", "--substeps", "2", "--seconds", "0.5"]])
def test_an_integrator_of_the_users_own(run: Any, modules: Any, command: list[str]) -> None:
    modules(my_lab_methods=MINE)
    code, out, err = run(*command, "--integrators", "rk4,my_lab_methods:Midpoint")
    assert code == 0, err
    assert "midpoint" in out
    assert "NOT AS EXPECTED" not in out


MINE_TO_SOLVE = """
import numpy as np
from pyverlet.lab import Equation

three = Equation(lambda t, x, v: -4.0 * x, x0=[1.0, 2.0, 3.0], exact=lambda t: (
    np.cos(2 * t) * np.array([1.0, 2.0, 3.0]), -2 * np.sin(2 * t) * np.array([1.0, 2.0, 3.0])))
unknown = Equation(lambda t, x, v: -np.sin(x), x0=1.0, name="swing")
wrong = Equation(lambda t, x, v: -x / 0, x0=1.0)
short = Equation(lambda t, x, v: -x, x0=[1.0, 2.0], exact=lambda t: (1.0, 2.0))
"""


@pytest.fixture
def problems(modules: Any) -> str:
    modules(my_problems=MINE_TO_SOLVE)
    return "my_problems"


@pytest.mark.parametrize(("name", "called"), [("three", "three"), ("unknown", "swing")])
def test_order_on_a_problem_of_ones_own(report: Any, problems: str, name: str, called: str) -> None:
    methods = report("order", "--problem", f"{problems}:{name}", "--integrators", "velocity-verlet,rk4")["methods"]
    orders = {each["method"]: each["problems"][called]["order"] for each in methods}
    assert orders == pytest.approx({"velocity-verlet": 2.0, "rk4": 4.0}, abs=0.1)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("gone", "has no gone; allowed is module:name, a pyverlet.lab.Equation"),
        ("np", "a pyverlet.lab.Equation"),
        ("wrong", "whose functions fail (ZeroDivisionError"),
        ("short", "exact returns shapes () and (); allowed are two of the shape of x0, (2,)"),
    ],
)
def test_a_problem_that_is_none_is_refused(refusal: Any, problems: str, name: str, says: str) -> None:
    assert says in refusal("order", "--problem", f"{problems}:{name}", "--integrators", "rk4")


def test_a_figure_of_a_problem_of_ones_own(run: Any, problems: str, tmp_path: Path) -> None:
    code, _, err = run("order", "--problem", f"{problems}:three", "--integrators", "rk4", "--plot", "one.png")
    assert code == 0, err
    assert (tmp_path / "one.png").stat().st_size > 10_000
