"""Sketches: a Python file wherever a scene's name goes, and a sentence with its line where something is wrong."""

import json
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, refused

import pyverlet as pv
from pyverlet.common.time_limit import TimeLimit, TooLong
from pyverlet.data.sweep import open_study
from pyverlet.picture import LIGHT, Pen
from pyverlet.picture.pen import Lettering, Stroke
from pyverlet.scenes.sketch import Sketch, SketchError
from pyverlet.scenes.sliders import board

BALLS = """
"Balls in a box."
import pyverlet as pv

push = pv.slider("push", -5, 5, 1)
COUNTED = []

def build(particles=12, dtype="float32"):
    COUNTED.append(1)
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)), dtype=dtype)
    world.add(position=pv.fill(world.boundary, radius=0.3, count=particles).position, radius=0.3)
    return world

def update(world, dt):
    world.gravity = (push.value, -9.81 - len(COUNTED))
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(folder: Path, source: str, name: str = "balls.py") -> Path:
    (folder / name).write_text(source, encoding="utf-8")
    return folder / name


def test_pyverlet_alone_says_what_to_type(run: Any) -> None:
    code, out, _ = run()
    assert code == 0
    lines = out.splitlines()
    assert len(lines) == 5
    assert all(line.startswith("pyverlet ") for line in lines)


@pytest.mark.parametrize("kind", ["cage", "cloth", "fountain", "cradle", "empty"])
def test_a_new_sketch_runs(run: Any, refusal: Any, folder: Path, kind: str) -> None:
    code, _, err = run("new", "mine.py", "--kind", kind)
    assert code == 0
    assert "pyverlet run mine.py --watch" in err
    text = (folder / "mine.py").read_text()
    assert 20 <= len(text.splitlines()) <= 33
    assert "mine.py" in text.splitlines()[0]
    world = pv.scenes.get("mine.py").world()
    world.run(seconds=3 / 60)
    sketch = Sketch.read("mine.py")
    scene = sketch.scene()
    world = scene.build(scene.settings())
    pen = Pen()
    sketch.call("draw", world, pen)
    sketch.call("keys", world, "b")
    sketch.call("click", world, np.array([1.0, 3.0]), "left")
    assert bool(pen.drawing) == (kind in ("cage", "fountain", "cradle"))
    assert all(np.isfinite(value) for value in world.read_watched().values())
    assert "is there already" in refusal("new", "mine.py", "--kind", kind)


def test_it_goes_wherever_a_scene_goes(run: Any, report: Any, folder: Path) -> None:
    written(folder, BALLS)
    found = report("run", "balls.py", "--frames", "5", "--particles", "7", "--substeps", "3")
    assert (found["scene"], found["particles"], found["substeps"]) == ("balls", 7, 3)
    assert run("bench", "balls.py", "--frames", "3", "--settle", "0")[0] == 0
    code, out, err = run(
        "compare", "balls.py", "--seconds", "0.1", "--integrators", "position-verlet", "--substeps", "1", "--json"
    )
    assert code == 0, err
    assert json.loads(out)["runs"][0]["integrator"] == "position-verlet"
    code, _, err = run("record", "balls.py", "balls.png", "--seconds", "0.1", "--size", "64x48")
    assert code == 0, err
    study = ["sweep", "run", "balls.py", "--vary", "particles=3,5", "--out", "study", "--seconds", "0.1", "--processes", "1"]
    code, _, err = run(*study)
    assert code == 0, err
    assert "2 of 2 runs" in run("sweep", "status", "study")[1]
    code, out, err = run("sweep", "verify", "study", "--rows", "2")
    assert (code, out) == (0, "made again: runs 0, 1; all as they were\n"), err
    written(folder, BALLS.replace("-9.81", "-5"))  # another sketch now: not the same study
    assert run(*study)[0] == 2
    assert "has changed since then" in run("sweep", "verify", "study")[2]
    assert "2 of 2 runs" in run("sweep", "status", "study")[1]  # which needs no world


def test_a_study_knows_its_sketch_and_its_defaults_wherever_that_is_now(folder: Path) -> None:
    (folder / "there").mkdir()
    path = written(folder / "there", BALLS.replace("particles=12", "seed=0, particles=4"))
    study = pv.sweep(pv.scenes.read(path), {"seed": [1, 2], "dtype": ["float64"]}, seconds=0.1, out=folder / "study")
    study.run(processes=1)
    again = open_study(folder / "study")
    assert again.verify(2).differ == []
    world = again.world(1)
    assert len(world) == 4
    assert world.dtype.name == "float64"
    path.rename(folder / "balls.py")
    assert len(open_study("study").world(0)) == 4  # in this folder now
    (folder / "balls.py").unlink()
    refused(r"the sketch '.*balls.py' is not there any more", open_study("study").world, 0)


def test_every_build_starts_anew(folder: Path) -> None:
    # What stands at the top of the file is part of it: else the second run of a sweep would go on where the first ended.
    written(folder, BALLS)
    scene = pv.scenes.read("balls.py")
    hashes = set()
    for _ in range(3):
        world = scene.world()
        hashes.add(bits_after(world, 0.1))
    assert len(hashes) == 1
    again = pickle.loads(pickle.dumps(scene))  # as another process gets it
    world = again.world()
    assert {bits_after(world, 0.1)} == hashes


def test_settings_go_where_the_sketch_takes_them_or_the_world(folder: Path) -> None:
    written(folder, BALLS)
    scene = pv.scenes.read("balls.py")
    world = scene.world(
        particles=5, restitution=0.5, friction=0.1, integrator=pv.RK4(), gravity=(0.0, 1.0), collisions=pv.BruteForce()
    )
    assert len(world) == 5
    assert world.collisions is not None
    assert (world.collisions.restitution, world.collisions.friction) == (0.5, 0.1)
    assert isinstance(world.collisions.method, pv.BruteForce)
    assert isinstance(world.integrator, pv.RK4)
    assert world.gravity == (0.0, 1.0)
    assert scene.world(dtype=np.float64).dtype == np.float64
    assert scene.world(collisions=False).collisions is None
    refused(r"seed is 3, which build\(\) of balls.py does not take; allowed is `def build\(seed", scene.world, seed=3)


def test_restitution_reaches_the_room_inside_a_naive_bound(folder: Path) -> None:
    room = "pv.ClampAndFlip(pv.Box((0, 0), (1, 1)))"
    (folder / "naive.py").write_text(f"import pyverlet as pv\n\ndef build():\n    return pv.World(boundary={room})\n")
    world = pv.scenes.read(folder / "naive.py").world(restitution=0.5)
    assert isinstance(world.boundary, pv.ClampAndFlip)
    assert world.boundary.restitution == 0.5


def test_a_scene_of_its_own(folder: Path) -> None:
    written(
        folder,
        """
import pyverlet as pv
from pyverlet.scenes import Scene, Settings

def build(settings):
    world = settings.empty_world(pv.Box((0, 0), (4, 4)))
    world.add(position=(2, 2), radius=0.2)
    return world

SCENE = Scene("mine", "one ball", build, Settings(particles=1, substeps=5))
""",
    )
    scene = pv.scenes.read("balls.py")
    assert (scene.name, scene.world().substeps, scene.world(substeps=2).substeps) == ("mine", 5, 2)


def test_modules_beside_it_are_read_again(folder: Path) -> None:
    written(folder, "SIZE = 0.3\n", "sizes_beside.py")
    written(
        folder,
        BALLS.replace("radius=0.3)", "radius=sizes_beside.SIZE)").replace(
            "import pyverlet", "import sizes_beside\nimport pyverlet"
        ),
    )
    first = Sketch.read("balls.py")
    assert first.scene().world().radius[0] == np.float32(0.3)
    assert [path.name for path in first.files] == ["balls.py", "sizes_beside.py"]
    written(folder, "SIZE = 0.125  # an eighth\n", "sizes_beside.py")
    assert Sketch.read("balls.py", first).scene().world().radius[0] == 0.125


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("def build(:\n    pass", "balls.py, line 1: "),
        ("import nothing_like_that", "balls.py, line 1: ModuleNotFoundError: No module named 'nothing_like_that'"),
        ("x = 3", "balls.py has no build(); allowed is"),
        ("def biuld():\n    pass", "balls.py has no build() (did you mean 'biuld'?)"),
        ("def build():\n    return 3", "balls.py: build() returned 3"),
        ("def build():\n    pass", "balls.py: build() returned nothing"),
        ("import pyverlet as pv\n\ndef build():\n    return pv.World(substeps=0)", "balls.py, line 4: substeps is 0"),
        ("def build(balls):\n    pass", "balls.py: build takes 'balls'"),
        ("SCENE = 3", "SCENE is 3"),
        ("draw = 3\ndef build():\n    pass", "draw is 3; allowed is a function"),
        ("import sys\nsys.exit(3)", "balls.py, line 2 ends the program"),
        ("def build():\n    return 1 / 0", "balls.py, line 2: ZeroDivisionError"),
    ],
)
def test_what_is_wrong_is_one_sentence_with_its_line(refusal: Any, folder: Path, source: str, said: str) -> None:
    written(folder, source)
    assert said in refusal("run", "balls.py", "--frames", "1")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "nowhere.py"], "path is 'nowhere.py', which cannot be read"),
        (["run", "cage", "--watch"], "watch is asked for with 'cage'; allowed is a sketch"),
        (["run", "balls.py", "--watch", "--seconds", "1"], "allowed is the page alone"),
        (["run", "balls.py", "--patience", "3", "--frames", "1"], "allowed is none without --watch"),
        (["new", "mine.txt"], "allowed is a name such as mysketch.py"),
        (["new", "nowhere/mine.py"], "cannot be written"),
        (["new", "mine.py", "--kind", "heap"], "'heap'"),
    ],
)
def test_bad_input_on_the_command_line(refusal: Any, folder: Path, arguments: list[str], said: str) -> None:
    written(folder, BALLS)
    assert said in refusal(*arguments)


def test_update_that_fails_stops_a_run_that_ends(refusal: Any, folder: Path) -> None:
    written(folder, BALLS.replace("push.value", "push.valeu"))
    assert "balls.py, line 15: AttributeError" in refusal("run", "balls.py", "--frames", "2")


# -- sliders, pens, time limits----------------------------------------------------------------------------------------------


def test_a_slider_is_the_same_when_asked_for_again() -> None:
    mine: dict[str, pv.Slider] = {}
    with board(mine):
        wind = pv.slider("wind", -5, 5, 0)
        wind.value = 3
        assert pv.slider("wind", -5, 5, 0) is wind
        assert float(pv.slider("wind", -5, 5, 0)) == 3.0
        wider = pv.slider("wind", -10, 10)
        assert (wider.value, wider.low) == (0.0, -10.0)
        refused("wind is 11; allowed is a number from -10 to 10", setattr, wider, "value", 11)
        refused("high is 1", pv.slider, "calm", 2, 1)
        refused("value is 9", pv.slider, "calm", 2, 3, 9)
        refused("name is ''", pv.slider, "", 0, 1)
    assert list(mine) == ["wind"]


def test_a_pen_writes_down_what_it_draws() -> None:
    pen = Pen((10.0, 0.0))
    pen.line((0, 0), (1, 2), colour=(255, 128, 0), width=3)
    pen.circle((1, 1), 0.5, fill=True, colour="#00ff7f")
    pen.text((2, 2), "here", size=20)
    line, disc, text = pen.drawing
    assert line == Stroke(((10.0, 0.0), (11.0, 2.0)), False, False, 0xFF8000, 3.0)
    assert isinstance(disc, Stroke)
    assert (disc.closed, disc.filled, disc.colour) == (True, True, 0x00FF7F)
    assert np.hypot(*(np.array(disc.points) - (11, 1)).T) == pytest.approx(np.full(64, 0.5))
    assert text == Lettering(12.0, 2.0, "here", None, 20.0)
    for wrong in ("red", (1, 2), (1, 2, 300), "#12345"):
        refused(re.escape(f"colour is {wrong!r}"), pen.line, (0, 0), (1, 1), colour=wrong)
    refused("radius is -1", pen.circle, (0, 0), -1)
    refused("allowed are 50,000", pen.polyline, np.zeros((60_000, 2)))


def test_what_is_drawn_is_in_the_picture(tmp_path: Path) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)), gravity=(0, 0))
    world.add(position=(1, 1), radius=0.2)

    def draw(world: pv.World, pen: Pen) -> None:
        pen.circle((5, 5), 2, colour="#ff0000", fill=True)
        pen.line((0, 9), (10, 9), colour="#00ff00", width=4)
        pen.text((1, 3), "where", colour="#0000ff", size=24)

    part = (0.0, 0.0, 10.0, 10.0)
    plain, drawn = (world.to_image(size=(200, 200), theme=LIGHT, part=part, draw=how) for how in (None, draw))
    red = (drawn == (255, 0, 0)).all(axis=-1)
    # A disc of 2 m is one of 40 pixels. Those its rim goes through are mixed: about 8 r / 2 of them are more than half covered.
    assert red.sum() == pytest.approx(np.pi * 40**2 - 4 * 40, abs=40)
    rows, columns = np.nonzero(red)
    assert (rows.mean(), columns.mean()) == pytest.approx((99.5, 99.5), abs=0.6)
    assert ((drawn == (0, 255, 0)).all(axis=-1).sum(axis=1) > 150).sum() in (3, 4)  # rows of a line 4 pixels wide
    blue = (drawn[..., 2] > 200) & (drawn[..., 0] < 60) & (drawn[..., 1] < 60)
    assert blue.sum() > 60
    assert not (plain == (255, 0, 0)).all(axis=-1).any()
    refused("draw is 3", world.to_image, draw=3)
    world.to_video(tmp_path / "film.html", seconds=0.1, draw=draw)
    assert (tmp_path / "film.html").stat().st_size > 10_000


def test_watched_numbers() -> None:
    world = pv.World()
    world.add(position=[(0, 1), (0, 3)])
    world.watch("height", lambda world: world.position[:, 1].mean())
    world.watch("nothing", lambda world: float("inf"))
    found = world.read_watched()
    assert found["height"] == 2.0
    assert np.isnan(found["nothing"])
    world.watch("wrong", lambda world: 1 / 0)
    refused("what is watched as 'wrong' has failed: ZeroDivisionError", world.read_watched)
    assert list(world.read_watched()) == ["height", "nothing"]
    refused("of is 3", world.watch, "three", 3)
    for k in range(10):
        world.watch(str(k), len)
    refused("allowed are 12", world.watch, "more", len)


def test_a_time_limit_ends_what_loops_and_nothing_else() -> None:
    limit = TimeLimit()

    def forever() -> None:
        while True:
            pass

    with limit.within(0.01), pytest.raises(TooLong):
        forever()
    with limit.within(60):
        total = sum(range(1000))
    assert total == 499_500
    for _ in range(50):
        with limit.within(1e-9):  # over before anybody looks, or just then
            pass
    sketch = Sketch(Path("loops.py"), b"def build():\n    while True:\n        pass\n")
    scene = sketch.scene()
    with pytest.raises(SketchError, match=r"loops.py, line [23] does not come back; does it loop for ever\?"), limit.within(0.01):
        scene.world()
