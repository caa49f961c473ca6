"""Worlds side by side on the command line, and integrators from the user's own files."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from pyverlet import scenes

MINE = """
import pyverlet as pv
from pyverlet.state.moves import advance


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
def mine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A folder with the user's own integrators, as the working one."""
    (tmp_path / "my_methods.py").write_text(MINE)
    (tmp_path / "my_broken.py").write_text("1 / 0")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    for name in ("my_methods", "my_broken"):
        monkeypatch.delitem(sys.modules, name, raising=False)


def test_every_panel_reports(run: Any) -> None:
    code, out, err = run("run", "bounce-order", "--seconds", "0.5", "--json")
    assert code == 0, err
    report = json.loads(out)
    panels = scenes.get("bounce-order").panels()
    for _ in range(30):
        panels.step(1 / 60)
    assert report["scene"] == "bounce-order"
    assert [panel["panel"] for panel in report["panels"]] == ["position first", "velocity first"]
    assert [panel["integrator"] for panel in report["panels"]] == ["explicit-euler", "semi-implicit-euler"]
    assert [panel["state_hash"] for panel in report["panels"]] == [world.state_hash() for world in panels.worlds]
    assert report["state_hash"] == panels.state_hash()
    table = run("run", "bounce-order", "--frames", "2")[1]
    assert table.startswith("position first\n\nscene")
    assert "\n\nvelocity first\n\nscene" in table


def test_any_scene_under_several_integrators(run: Any) -> None:
    code, out, err = run("run", "box", "--particles", "9", "--integrators", "rk4, yoshida4", "--frames", "2", "--json")
    assert code == 0, err
    report = json.loads(out)
    assert [(panel["panel"], panel["integrator"], panel["particles"]) for panel in report["panels"]] == [
        ("rk4", "rk4", 9),
        ("yoshida4", "yoshida4", 9),
    ]


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize("path", ["my_methods:Leapfrog", "my_methods:ready"])
def test_an_integrator_of_the_users_own(run: Any, path: str) -> None:
    code, out, err = run("run", "fall", "--integrator", path, "--dtype", "float64", "--frames", "60", "--json")
    assert code == 0, err
    report = json.loads(out)
    assert report["integrator"] == "leapfrog"
    assert report["energy"]["total"] == pytest.approx(98.1, rel=1e-12)


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
def test_a_wrong_path_is_one_sentence(run: Any, path: str, says: str) -> None:
    code, out, err = run("run", "fall", "--integrators", path, "--frames", "1")
    assert (code, out) == (2, "")
    assert says in err
    assert err.startswith("pyverlet: ")
    assert err.count("\n") == 1


def test_one_at_a_time_where_only_one_makes_sense(run: Any, tmp_path: Path) -> None:
    code, _, err = run("run", "fall", "--integrators", "rk4,yoshida4", "--plot", str(tmp_path / "y.png"))
    assert code == 2
    assert "pyverlet compare" in err
    assert run("bench", "fall", "--integrators", "rk4,yoshida4", "--frames", "1")[0] == 2
