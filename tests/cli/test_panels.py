"""Worlds side by side on the command line, and integrators from the user's own files."""

import functools
from pathlib import Path
from typing import Any

import pytest

from pyverlet import scenes
from pyverlet.lab import truth
from pyverlet.lab.truth import EXPERIMENTS, Finding, Number

MINE = """
import pyverlet as pv
from pyverlet.laws.integrators import advance


class Leapfrog(pv.Integrator):
    order = 2
    symplectic = True

    def step(self, state, forces, t, h):
        advance(state.position, state.position, state.velocity, h / 2)
        forces(state, t + h / 2)
        advance(state.velocity, state.velocity, state.acceleration, h)
        advance(state.position, state.position, state.velocity, h / 2)


class Stateless(pv.Integrator):
    def step(self, state, forces, t, h):
        pass


class Needy(Leapfrog):
    def __init__(self, parameter):
        pass


ready = Leapfrog()
number = 7
"""


@pytest.fixture
def mine(modules: Any) -> None:
    """The user's own integrators."""
    modules(my_methods=MINE, my_broken="1 / 0")


def test_every_panel_reports(run: Any, report: Any) -> None:
    found = report("run", "bounce-order", "--seconds", "0.5")
    panels = scenes.get("bounce-order").panels()
    for _ in range(30):
        panels.step(1 / 60)
    assert found["scene"] == "bounce-order"
    assert [(panel["panel"], panel["integrator"], panel["state_hash"]) for panel in found["panels"]] == [
        ("position first", "explicit-euler", panels.worlds[0].state_hash()),
        ("velocity first", "semi-implicit-euler", panels.worlds[1].state_hash()),
    ]
    assert found["state_hash"] == panels.state_hash()
    table = run("run", "bounce-order", "--frames", "2")[1]
    assert table.startswith("position first\n\nscene")
    assert "\n\nvelocity first\n\nscene" in table


def test_any_scene_under_several_integrators(report: Any) -> None:
    found = report("run", "box", "--particles", "9", "--integrators", "rk4, yoshida4", "--frames", "2")
    seen = [(panel["panel"], panel["integrator"], panel["particles"]) for panel in found["panels"]]
    assert seen == [(name, name, 9) for name in ("rk4", "yoshida4")]


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize("path", ["my_methods:Leapfrog", "my_methods:ready"])
def test_an_integrator_of_the_users_own(report: Any, path: str) -> None:
    found = report("run", "fall", "--integrator", path, "--dtype", "float64", "--frames", "60")
    assert found["integrator"] == "leapfrog"
    assert found["energy"]["total"] == pytest.approx(98.1, rel=1e-12)


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("my_methods:Missing", "'my_methods:Missing', but my_methods has no Missing; allowed is module:Class"),
        ("no_such_module:Any", "module cannot be imported (ModuleNotFoundError: No module named 'no_such_module')"),
        ("my_broken:Any", "module cannot be imported (ZeroDivisionError: division by zero)"),
        ("my_methods:number", "which is no Integrator"),
        ("my_methods:Stateless", "does not state 'order'"),
        ("my_methods:Needy", "cannot be made without arguments"),
        ("pyverlet:Integrator", "cannot be made without arguments"),
        ("my_methods:", "integrator is 'my_methods:'; allowed is module:Class"),
        (":Leapfrog", "integrator is ':Leapfrog'"),
        ("my methods:Leapfrog", "integrator is 'my methods:Leapfrog'"),
        ("rk4,rk4", "'rk4' twice"),
        ("rk4,", "unknown integrator ''"),
    ],
)
def test_a_wrong_path_is_one_sentence(refusal: Any, path: str, says: str) -> None:
    assert says in refusal("run", "fall", "--integrators", path, "--frames", "1")


def test_one_at_a_time_where_only_one_makes_sense(run: Any, refusal: Any, tmp_path: Path) -> None:
    assert "pyverlet compare" in refusal("run", "fall", "--integrators", "rk4,yoshida4", "--plot", str(tmp_path / "y.png"))
    assert run("bench", "fall", "--integrators", "rk4,yoshida4", "--frames", "1")[0] == 2


# ---- The nine claims: every verdict borne out, and the page that says so up to date ----


PAGE = Path(__file__).resolve().parents[2] / "docs" / "truth.md"


@functools.cache
def finding_of(code: str) -> Finding:
    return EXPERIMENTS[code].run()


CODES = [f"J{n}" for n in range(1, 10)]


@pytest.mark.parametrize("code", [pytest.param(code, marks=pytest.mark.slow if code < "J4" else ()) for code in CODES])
def test_the_verdict_is_borne_out(code: str) -> None:
    finding = finding_of(code)
    assert [number for number in finding.numbers if not number.holds] == []
    assert finding.verdict == finding.experiment.verdict
    # A number without a bound or a value on paper is an illustration; each experiment has some that can fail.
    assert any((n.expected, n.below, n.above) != (None, None, None) for n in finding.numbers)


@pytest.mark.slow
def test_the_page_is_what_the_code_writes() -> None:
    assert list(EXPERIMENTS) == CODES
    found = truth.markdown([finding_of(code) for code in CODES])
    assert PAGE.read_text(encoding="utf-8") == found, "pyverlet truth --markdown > docs/truth.md"


@pytest.mark.parametrize(
    ("number", "holds", "text"),
    [
        (Number("", 1.0, "m", expected=1.0), True, "1.000 m (on paper 1.000 m)"),
        (Number("", 1.1, "m", expected=1.0), False, "1.100 m (on paper 1.000 m)"),
        (Number("", 1.01, "m", expected=1.0, within=0.02), True, "1.010 m (on paper 1.000 m)"),
        (Number("", -1e-15, "J", below=1e-12), True, "below 1e-12 J"),
        (Number("", -1e-3, "J", below=1e-12), False, "-0.001000 J"),
        (Number("", float("nan"), "J", below=1e-12), False, "nan J"),
        (Number("", float("nan"), "J", expected=1.0), False, "nan J (on paper 1.000 J)"),
        (Number("", 31, above=30), True, "31"),
        (Number("", 30, above=30), False, "30"),
    ],
)
def test_numbers_hold_or_not(number: Number, holds: bool, text: str) -> None:
    assert number.holds is holds
    assert number.text == text


def test_a_verdict_that_is_not_borne_out_is_told(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = EXPERIMENTS["J8"].verdict
    bouncing = truth.Experiment("J8", "", "", "", verdict, lambda: [Number("rise", 0.5, "m", below=1e-12)])
    monkeypatch.setitem(EXPERIMENTS, "J8", bouncing)
    code, out, _ = run("truth", "J8")
    assert code == 1
    assert "not borne out by these numbers" in out


def test_on_the_command_line(run: Any, report: Any) -> None:
    code, out, err = run("truth", "j4", "J5")
    assert code == 0, err
    assert out.startswith("J4  Claim        Explicit Euler gains energy")
    assert "mean gain of a step: 0.01337 J (on paper 0.01337 J)" in out
    assert "\n\nJ5  Claim" in out
    assert max(map(len, out.splitlines())) <= 110
    (finding,) = report("truth", "J4")
    assert (finding["code"], finding["holds"], finding["verdict"]) == ("J4", True, EXPERIMENTS["J4"].verdict)
    assert finding["numbers"][0]["value"] == pytest.approx(9.81**2 / 3600 / 2)
    assert "## J4. “Explicit Euler" in run("truth", "J4", "--markdown")[1]
