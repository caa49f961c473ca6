"""The commands through their own door, `main`: what they print, where, and what they refuse."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import __version__, scenes
from pyverlet.viewers import launch

KEYS = {
    "scene", "particles", "substeps", "integrator", "dtype", "threads", "frames", "seconds", "ms_per_frame",
    "ns_per_particle_substep", "stages", "stage_threads", "energy", "overlap", "contacts", "escaped", "state_hash",
}  # fmt: skip
SMALL = ["cage", "--particles", "60", "--frames", "5"]


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """In place of the live page: what it would have been asked to show."""
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(launch, "serve", lambda build, **options: asked.append({"world": build(), **options}))
    return asked


def test_json_is_one_object_with_the_promised_keys(report: Any) -> None:
    found = report("run", *SMALL, "--headless")
    assert set(found) >= KEYS
    assert set(found["ms_per_frame"]) == {"median", "p95"}
    assert set(found["overlap"]) == {"mean", "max"}
    assert (found["scene"], found["particles"], found["frames"], found["substeps"]) == ("cage", 60, 5, 8)
    assert (found["integrator"], found["dtype"], found["escaped"]) == ("time-corrected-verlet", "float32", 0)
    assert found["seconds"] == pytest.approx(5 / 60)
    assert found["ns_per_particle_substep"] == pytest.approx(1e6 * found["ms_per_frame"]["median"] / (60 * 8))
    assert found["stages"]
    assert 0 < sum(found["stages"].values()) < 5 * found["ms_per_frame"]["p95"]
    assert set(found["energy"]) == {"kinetic", "potential", "links", "total"}
    assert found["energy"]["total"] == pytest.approx(sum(found["energy"][k] for k in ("kinetic", "potential", "links")))


def test_table_says_the_same(run: Any) -> None:
    code, out, _ = run("run", *SMALL, "--headless")
    assert code == 0
    words = "cage", "60", "time-corrected-verlet", "8 substeps", "ms per frame", "energy", "overlap", "escaped", "state hash"
    for word in words:
        assert word in out


def test_bench_has_a_table_of_stages(run: Any) -> None:
    code, out, _ = run("bench", "--particles", "3000", "--threads", "2", "--settle", "0", "--frames", "30", "--stages")
    head, *rows = [line.split() for line in out.splitlines()]
    assert code == 0
    assert head[0] == "stage"
    assert {"gather", "lists", "integrate", "surfaces", "pairs", "relax"} <= {row[0] for row in rows}
    assert sum(float(row[2]) for row in rows) == pytest.approx(100, abs=0.1 * len(rows))


@pytest.mark.parametrize("name", scenes.SCENES)
def test_every_scene_runs_headless(report: Any, name: str) -> None:
    few = "46" if name == "car" else "20"  # a car has so many at least
    found = report("run", name, "--particles", few, "--frames", "3")
    assert found["scene"] == name
    variants = scenes.get(name).variants
    assert [panel["panel"] for panel in found.get("panels", [])] == [variant.name for variant in variants]


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_every_integrator_by_name(report: Any, name: str) -> None:
    assert report("run", *SMALL, "--integrator", name)["integrator"] == name


def test_options_reach_the_world(report: Any) -> None:
    options = ["--substeps", "3", "--restitution", "0.5", "--friction", "0.1", "--radius-spread", "2", "--seed", "4"]
    options += ["--threads", "1", "--dtype", "float64", "--collisions", "brute", "--dt", "1/100", "--seconds", "0.05"]
    found = report("run", "box", "--particles", "30", *options)
    assert (found["substeps"], found["threads"], found["dtype"], found["frames"]) == (3, 1, "float64", 5)
    world = scenes.get("box").world(
        particles=30, substeps=3, restitution=0.5, friction=0.1, radius_spread=2.0, seed=4, dtype=np.float64,
        collisions=pv.BruteForce(),
    )  # fmt: skip
    world.run(seconds=0.05, dt=0.01)
    assert found["state_hash"] == world.state_hash()


def test_collisions_none_lets_circles_overlap(report: Any) -> None:
    assert report("run", "cage", "--particles", "100", "--seconds", "3", "--collisions", "none")["overlap"]["max"] > 0.5


def test_bench_measures_beside_the_machine(run: Any, report: Any) -> None:
    found = report("bench", *SMALL, "--settle", "0.1")
    assert set(found) >= KEYS | {"triad", "ratio_to_triad", "settle_seconds"}
    assert found["triad"]["ns_per_element"] > 0
    assert found["ratio_to_triad"] == pytest.approx(found["ns_per_particle_substep"] / found["triad"]["ns_per_element"])
    table = run("bench", *SMALL, "--settle", "0")[1]
    assert "a = b + s c" in table
    assert "ratio" in table


def test_list(run: Any, report: Any) -> None:
    code, out, _ = run("list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(scenes.SCENES)
    assert report("list") == [{"name": s.name, "summary": s.summary} for s in scenes.SCENES.values()]


def test_version_and_help(run: Any) -> None:
    assert run("--version")[:2] == (0, f"pyverlet {__version__}\n")
    code, out, _ = run("--help")
    assert code == 0
    for command in ("run", "bench", "list"):
        assert command in out
        assert run(command, "--help")[0] == 0
    assert "explicit-euler" in run("run", "--help")[1]


def test_run_without_more_opens_the_page(run: Any, served: list[dict[str, Any]]) -> None:
    code, _, err = run("run", "box", "--particles", "30", "--port", "8123", "--no-open", "--dt", "0.02")
    assert code == 0, err
    (asked,) = served
    assert [len(world) for world in asked["world"].panels.worlds] == [30]
    assert (asked["title"], asked["port"], asked["open_browser"], asked["dt"]) == ("box", 8123, False, 0.02)
    run("run")
    assert [len(world) for world in served[1]["world"].panels.worlds] == [5_000]
    assert (served[1]["title"], served[1]["port"], served[1]["open_browser"]) == ("cage", 8000, True)


def test_plot_of_a_fall(run: Any, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "y.png"
    code, out, err = run("run", "fall", "--seconds", "1", "--dtype", "float64", "--plot", str(picture), "--json")
    assert code == 0, err
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert json.loads(out)["largest_error_m"] < 1e-11
    assert "largest error" in err
    # x is late by g t h / 2 when the position moves with the old velocity.
    late = run(
        "run", "fall", "--seconds", "1", "--integrator", "explicit-euler", "--dtype", "float64", "--plot", str(picture), "--json"
    )
    assert json.loads(late[1])["largest_error_m"] == pytest.approx(9.81 / 60 / 8 / 2, rel=1e-6)


def test_figure_has_labels_with_units(run: Any) -> None:
    pytest.importorskip("matplotlib")
    from pyverlet.lab import figures

    y = np.ones((10, 20))
    top, bottom = figures.heights_figure(np.arange(10) / 60, y, y, "title").axes
    assert (top.get_ylabel(), bottom.get_xlabel()) == ("height y (m)", "time t (s)")
    assert bottom.get_ylabel() == "error in y (m)"
    assert len(top.lines) == 2 * figures.MOST_CURVES


# ---- what is refused: one sentence, exit code 2 ----

REFUSED = [
    ("run nowhere", "unknown scene 'nowhere'; known: cage, box, fall,"),
    ("run cagee --headless", "did you mean 'cage'"),
    ("run --integrator position-verle --headless", "did you mean 'position-verlet'"),
    ("run --integrator zzz --headless", "known: explicit-euler"),
    ("run --particles 0 --headless", "particles is 0"), ("run --particles -5", "particles is -5"),
    ("run --particles many", "'many' is not a whole number"),
    ("run --particles 1.5", "'1.5' is not a whole number"),
    ("run --particles 99999999999999999999 --headless", "particles is 99999999999999999999"),
    ("run --seconds soon", "'soon' is not a number"), ("run --port http", "'http' is not a whole number"),
    ("run --substeps 0 --headless", "substeps is 0"), ("run --restitution 1.5 --headless", "restitution is 1.5"),
    ("run --restitution nan --headless", "restitution is nan"), ("run --friction -1 --headless", "friction is -1"),
    ("run --friction inf --headless", "friction is inf"),
    ("run --radius-spread 0 --headless", "radius_spread is 0"),
    ("run --radius-spread nan --headless", "radius_spread is nan"), ("run --seed -1 --headless", "seed is -1"),
    ("run --threads 0 --headless", "threads is 0"), ("run --threads 4096 --headless", "threads is 4096"),
    ("run --dtype float16 --headless", "'float16' is not one of 'float32', 'float64'"),
    ("run --collisions slow --headless", "'slow' is not one of 'fast', 'brute', 'none'"),
    ("run --dt 1/0 --headless", "'1/0' is not a number"), ("run --dt 0 --headless", "dt is 0"),
    ("run --dt -0.1 --headless", "dt is -0.1"), ("run --dt nan --headless", "dt is nan"),
    ("run --seconds 0", "seconds is 0"), ("run --seconds nan", "seconds is nan"),
    ("run --seconds inf", "seconds is inf"), ("run --seconds 1e300", "at most 10,000,000"),
    ("run --frames 0", "frames is 0"), ("run --frames 5 --seconds 1", "not both"),
    ("run --headless --port 8000", "port is 8000"), ("run --port 99999", "port is 99999"),
    ("run --nonsense", "--nonsense"), ("run cage box", "box"), ("run cage --plot y.png", "closed form"),
    ("run fall --plot no-such-folder/y.png", "folder that exists"), ("run fall --plot y.doc", ".png"),
    ("run fall --plot .", "folder"), ("bench nowhere", "unknown scene"), ("bench --settle -1", "settle is -1"),
    ("bench --settle nan", "settle is nan"), ("bench --dt 0", "dt is 0"), ("rnu", "rnu"),
    ("compare nowhere", "unknown scene 'nowhere'"),
    ("compare fall --integrators verlet", "unknown integrator 'verlet'"),
    ("compare fall --integrators rk5", "did you mean 'rk4'"),
    ("compare fall --integrators no.such:Thing", "cannot be imported"),
    ("compare fall --seconds 0", "seconds is 0; allowed is a finite number greater than 0"),
    ("compare fall --seconds nan", "seconds is nan"), ("compare fall --substeps 0", "substeps is 0"),
    ("compare fall --substeps 1,x", "'x' is not a whole number"),
    ("compare fall --substeps 2,2", "substeps names 2 twice"), ("compare fall --dt 0", "dt is 0"),
    ("compare fall --plot y.doc", ".png"), ("order --integrators rk5", "did you mean 'rk4'"),
    ("order --plot no-such-folder/y.png", "folder that exists"),
    ("truth J10", "unknown claim 'J10'; known: J1, J2"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "says"), REFUSED, ids=[line for line, _ in REFUSED])
def test_bad_input_is_one_sentence(refusal: Any, line: str, says: str) -> None:
    assert says in refusal(*line.split())


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (pv.errors.NonFiniteError(3, "contacts", 0.5), 1, "particle 3"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (MemoryError("Unable to allocate 3 TiB"), 1, "not enough memory"),
        (ZeroDivisionError("a bug"), 1, "unexpected ZeroDivisionError: a bug"),
        (OSError(28, "No space left on device"), 1, "No space left"),
    ],
)
def test_failures_are_one_sentence(
    run: Any, refusal: Any, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, says: str
) -> None:
    def fail(self: pv.World, dt: float) -> None:
        raise error

    monkeypatch.setattr(pv.World, "step", fail)
    assert says in refusal("run", *SMALL, "--json", code=code)
    monkeypatch.setenv("PYVERLET_TRACEBACK", "1")
    assert ("Traceback" in run("run", *SMALL)[2]) == isinstance(error, ZeroDivisionError | OSError)  # it shows where on request


def test_nothing_in_the_report_is_not_a_number(run: Any) -> None:
    out = run("run", "fall", "--frames", "2", "--json")[1]
    json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} in {out}"))  # NaN, Infinity, -Infinity


def test_a_report_keeps_a_ledger_if_asked(report: Any) -> None:
    without, with_it = (report("run", *SMALL, *more) for more in ((), ("--ledger",)))
    assert without["ledger"] is None
    assert with_it["ledger"]["limiter"] == 0
    assert sum(with_it["ledger"].values()) == pytest.approx(with_it["energy"]["total"], rel=1e-9)
    assert without["energy"] == with_it["energy"]


@pytest.mark.slow
def test_the_tables_of_the_physics_page(run: Any, report: Any, refusal: Any) -> None:
    small = ("check", "limiter", "--scene", "newton-cradle", "--particles", "10", "--seconds", "0.1")
    rows = report(*small)
    assert [(row["scene"], row["substeps"], row["frames"]) for row in rows] == [("newton-cradle", n, 6) for n in (2, 4, 8, 16)]
    assert run(*small, "--markdown")[1].startswith("| scene | 2 substeps |")
    assert {row["fraction"] for row in report("check", "pressure", "--seconds", "1")} == {0.1, 0.3, 0.6}
    refusal("check", "limiter", "--scene", "nowhere")
