"""A session in a file: whatever was done to its worlds, going through it again ends in the same bits."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.cli import main
from pyverlet.viewers import commands as asked
from pyverlet.viewers.commands import Build, Delete, Drag, Key, Pause, Release, Reset, SetGravity, SetSlider, Spawn, Step
from pyverlet.viewers.journal import Journal
from pyverlet.viewers.presentation import Presentation, Repertoire
from pyverlet.viewers.replay import DivergedError, EndError, ReplayState, Script
from pyverlet.viewers.session import Session
from pyverlet.world.panels import Panel, Panels

from .browser import Served
from .sessions import after

DT = 1 / 60


def crowd() -> pv.World:
    """Without bounds, so that the camera follows, and how far pointers reach with it."""
    world = pv.World(collisions=pv.Collisions(restitution=0.3, friction=0.3))
    world.obstacles.append(pv.Segment((-20, 0), (20, 0)))
    rng = np.random.default_rng(5)
    world.add(position=rng.uniform((-4, 0.5), (4, 6), (40, 2)), velocity=rng.normal(0, 2, (40, 2)), radius=0.3)
    pv.rope(world, (-3, 8), (3, 8), links=8).group.pin([0, -1])
    return world


def session_of(path: Path, commands: list[Any], world: Any = None) -> str:
    """A session in which these are asked for one after the other; the hash at its end."""
    with Journal(path, dt=DT) as journal:
        session = Session(crowd() if world is None else world, dt=DT, view_state=journal.view_state)
        assert after(session, Pause(True), *commands).status.error is None
        return session._view_state.panels.state_hash()


def test_everything_a_mouse_can_do_is_done_again(tmp_path: Path) -> None:
    commands = [
        Step(20), SetGravity(1.0, -8.0), Step(10), Drag(0, 0.0, 1.0, 3.0), Step(5), Drag(0, 2.0, 5.0, 3.0), Step(40), Release(0),
        asked.Poke(1, -1.0, 1.0), Step(10), Release(1), Spawn(0, 0.0, 7.0), asked.Pin(0, 0.0, 3.0, 9.0), Step(30),
        asked.SetFriction(0.9), Step(5), Delete(0, 0.0, 0.5, 9.0), Step(100), Reset(), Step(7), Spawn(0, 1.0, 9.0),
    ]  # fmt: skip
    end = session_of(tmp_path / "a.pvlog", commands)
    script = Script(tmp_path / "a.pvlog")
    done = script.run()
    assert done["checked"] == script.checks == 4  # three seconds, and the end
    assert [done[name] for name in ("state_hash", "frames", "commands", "whole", "stopped")] == [end, 227, 12, True, None]


def test_what_was_done_between_substeps_is_done_there_again(tmp_path: Path) -> None:
    with Journal(tmp_path / "a.pvlog", dt=DT) as journal:
        view_state = journal.view_state(Presentation("crowd", Panels.of(crowd())))
        looks: list[float] = []

        def observer(snapshot: Any) -> None:
            looks.append(snapshot.time)
            if len(looks) % 5 == 0:
                view_state.do(Drag(0, 0.1 * len(looks), 3.0, 9.0))
            if len(looks) == 23:
                view_state.do(SetGravity(0.0, 3.0))

        view_state.do(Drag(0, 0.0, 3.0, 9.0))
        for frame in range(30):
            view_state.capture()  # somebody watches now and then, which moves the camera
            view_state.step(DT, observer if 5 < frame < 20 else None)
        end = view_state.panels.state_hash()
    lines = [json.loads(line) for line in (tmp_path / "a.pvlog").read_text().splitlines()]
    assert {line.get("substep") for line in lines} > {None, 5}
    assert Script(tmp_path / "a.pvlog").run()["state_hash"] == end


def test_the_format_has_the_field_names_of_older_journals(tmp_path: Path) -> None:
    session_of(tmp_path / "a.pvlog", [Step(2), Drag(7, 0, 3, 9), Step(5), Release(7), Step(3)])
    lines = [json.loads(line) for line in (tmp_path / "a.pvlog").read_text().splitlines()]
    kept = [line for line in lines if line.get("do") in ("Drag", "Release")]
    assert [line["hand"] for line in kept] == [7, 7]
    assert not any("pointer" in line for line in lines)


COMES_AND_GOES = [
    Step(3), Spawn(0, 1.0, 1.0), Step(3), Drag(1, 1.0, 1.0, 9.0), Step(3), Release(1), Delete(0, 1.0, 1.0, 9.0), Step(3)
]  # fmt: skip
OTHERS = [Step(3), SetGravity(0, -3), Build("box", 20), Step(4), Build(None, 40), SetGravity(0, 2), Step(5)]


@pytest.mark.parametrize(
    ("scene", "commands"), [(name, COMES_AND_GOES) for name in ("particle-life", "boids", "dam-break")] + [("cage", OTHERS)]
)
def test_scenes_with_forces_and_other_scenes_go_on_with_what_comes_and_goes(
    tmp_path: Path, scene: str, commands: list[Any]
) -> None:
    repertoire = Repertoire(pv.scenes.get(scene), dt=DT, overrides={"particles": 60})
    end = session_of(tmp_path / "a.pvlog", commands, repertoire.open())
    assert Script(tmp_path / "a.pvlog").run()["state_hash"] == end


def test_worlds_side_by_side(tmp_path: Path) -> None:
    panels = Panels([Panel("one", crowd()), Panel("two", crowd())], line=1.0)
    panels.worlds[1].substeps = 3
    end = session_of(tmp_path / "a.pvlog", [Step(10), Drag(0, 0, 1, 9), Step(20)], panels)
    assert Script(tmp_path / "a.pvlog").run()["state_hash"] == end


def test_a_world_that_stopped_stops_again(tmp_path: Path) -> None:
    world = pv.World(gravity=(0, 0))
    world.add(position=[(0, 0), (0, 9)], mass=1e-9)
    world.forces.append(pv.ConstantForce((1e38, 0)))  # over so small a mass it is infinite in float32
    with Journal(tmp_path / "a.pvlog", dt=DT) as journal:
        session = Session(world, dt=DT, view_state=journal.view_state)
        said = after(session, Pause(True), Step(50), SetGravity(0, 1), Reset(), Step(1)).status.error
        end = session._view_state.panels.state_hash()
    done = Script(tmp_path / "a.pvlog").run()
    assert said is not None
    assert (done["stopped"], done["state_hash"]) == (said, end)


def test_what_differs_is_told_with_its_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.pvlog"
    session_of(path, [Step(150)])
    lines = path.read_text().splitlines()
    for k, line in enumerate(lines):
        if '"hash"' in line and '"frame":120' in line:
            lines[k] = json.dumps({"hash": "0" * 16, "frame": 120})
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(DivergedError, match=r"after frame 120 \(2 s\) the hash"):
        Script(path).run()
    assert main(["replay", str(path), "--headless"]) == 1
    assert "after frame 120" in capsys.readouterr().err


def test_a_journal_that_was_cut_off_is_gone_through_as_far_as_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "a.pvlog"
    session_of(path, [Step(70), SetGravity(0, 5), Step(70)])
    content = path.read_bytes()
    path.write_bytes(content[: content.index(b'"frame":120') + 5])  # in the middle of a line
    done = Script(path).run()
    # To the last line that is whole: the command, or what a slow machine has noted since of who looks on between substeps.
    assert 70 <= done["frames"] < 120
    assert (done["checked"], done["whole"]) == (1, False)


def test_on_the_page_nobody_interferes_and_reset_starts_over(tmp_path: Path) -> None:
    end = session_of(tmp_path / "a.pvlog", [Step(30), SetGravity(2, -5), Step(40)])
    script = Script(tmp_path / "a.pvlog")
    session = Session(script.open(), dt=script.dt, view_state=lambda presentation: ReplayState(script, presentation))
    after(session, SetGravity(0, 0), Step(50), Spawn(0, 0, 9), Reset(), Step(70))
    assert session._view_state.panels.state_hash() == end
    error = after(session, Step(5)).status.error
    assert "the journal ends here, after 70 frames; 2 hashes are as they were" in str(error)
    with pytest.raises(EndError):
        session._view_state.step(DT)


@pytest.mark.parametrize(
    ("version", "lines", "said"),
    [
        ("one", ["nonsense"], "line 1"), (7, [], "pvlog is 7"), (1, [], "it has no worlds"),
        (1, ['{"worlds": [], "frame": 3}', '{"hash": "", "frame": 1}'], "frames in order"),
        (1, ['{"do": "Explode", "frame": 0}'], "a command is none of"),
        (1, ['{"do": "SetGravity", "x": "a", "y": 0, "frame": 0}'], "gravity x is 'a'"),
        (1, ['{"do": "SetGravity", "z": 1, "frame": 0}'], "line 2"),
    ],
)  # fmt: skip
def test_bad_journals_are_one_sentence(tmp_path: Path, version: Any, lines: list[str], said: str, refusal: Any) -> None:
    head = f'{{"pvlog": {version}, "dt": 0.1, "frame": 0}}'
    (tmp_path / "a.pvlog").write_text("\n".join([head, *lines]) + "\n")
    assert said in refusal("replay", str(tmp_path / "a.pvlog"), "--headless")


def test_bad_use_is_one_sentence(tmp_path: Path, refusal: Any) -> None:
    assert "cannot be read" in refusal("replay", str(tmp_path / "none.pvlog"))
    assert "allowed is one with the page" in refusal("run", "cage", "--headless", "--journal", str(tmp_path / "a.pvlog"))
    refused("cannot be written", Journal, tmp_path / "none" / "a.pvlog", dt=DT)
    with Journal(tmp_path / "a.pvlog", dt=DT) as journal, pytest.raises(pv.InputError, match="pace of their own"):
        Session(pv.scenes.get("frame-rate").panels(), view_state=journal.view_state)


@pytest.mark.slow
def test_from_the_command_line(tmp_path: Path, report: Any) -> None:
    path = tmp_path / "a.pvlog"
    command = ["-m", "pyverlet", "run", "cage", "--particles", "50", "--port", "0", "--no-open", "--journal", str(path)]
    with Served(*command) as served:
        deadline = time.monotonic() + 20
        while not (path.exists() and b'"hash"' in path.read_bytes()) and time.monotonic() < deadline:
            time.sleep(0.05)
        _, err = served.end()
    assert f"pyverlet replay '{path}'" in err
    done = report("replay", str(path))
    assert done["whole"]
    assert done["frames"] >= 60
    assert done["checked"] >= 2


SKETCH = """
import pyverlet as pv

push = pv.slider("push", -5, 5, 1)
breeze = pv.Wind((0, 0))
kicks = []

def build(particles=12, seed=0):
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
    world.forces.append(breeze)
    start = pv.fill(world.boundary, radius=0.3, count=particles, pattern="random", seed=seed)
    world.add(position=start.position, radius=0.3)
    return world

def update(world, dt):
    breeze.velocity = (push.value, len(kicks))
    if len(kicks) > 2:
        raise RuntimeError("three is too many")

def keys(world, key):
    kicks.append(key)
    world.velocity[:, 1] += len(kicks)

def click(world, point, button):
    world.add(position=point, radius=0.5)

def draw(world, pen):
    pen.text((1, 1), str(len(world)))
"""


def test_a_sketch_answers_as_it_did(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kicks.py").write_text(SKETCH)
    scene = pv.scenes.read("kicks.py")
    repertoire = Repertoire(scene, dt=DT, overrides={"particles": 9, "seed": 5, "substeps": 3})
    monkeypatch.setitem(pv.scenes.SCENES, scene.name, scene)  # as `pyverlet run` does it
    commands = [
        Step(30), SetSlider("push", 4.0), Step(20), Key("a"), Step(10), asked.Click(0, 5.0, 8.0, "left"), Step(30),
        Build("box", 20), Step(5), Build("kicks", 7), Step(5), SetSlider("push", -2.0), Step(30), Key("b"), Step(60), Reset(),
        Step(5), Key("c"), Step(3), Key("d"), Step(70),
    ]  # fmt: skip
    journal, file = tmp_path / "a.pvlog", tmp_path / "kicks.py"
    end = session_of(journal, commands, repertoire.open())
    script = Script(journal)
    for _ in range(2):  # and nothing of the first time is left
        done = script.run()
        assert done["state_hash"] == end
        assert done["checked"] == script.checks >= 4
        assert "three is too many (update is not called any more)" in done["stopped"]
    assert main(["replay", "a.pvlog", "--headless"]) == 0
    file.write_text(f"{SKETCH}# changed\n")
    refused("has changed since then", script.run)
    file.write_text(SKETCH)
    start = json.loads(journal.read_text().splitlines()[1])["worlds"][0]["hash"]
    journal.write_text(journal.read_text().replace(start, "0" * 16))
    with pytest.raises(DivergedError, match="draws by chance without a seed"):
        Script(journal).run()
    several = Presentation("kicks", scene.panels(integrators=(pv.RK4(), pv.Yoshida4())), callbacks=scene.sketch)
    with Journal(tmp_path / "b.pvlog", dt=DT) as fresh, pytest.raises(pv.InputError, match=r"2 worlds of kicks\.py side by side"):
        fresh.view_state(several)
