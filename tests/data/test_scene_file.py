"""Scene files: the same scene a name gives, frozen starts with the same bits, and one sentence for whatever is wrong."""

import importlib.util
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, refused

import pyverlet as pv
from pyverlet.cli import main
from pyverlet.data import toml
from pyverlet.data.scene_file import freeze, schema, validated

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "scenes").glob("*.*"))

SILO = {
    "format": 1,
    "room": {"type": "Box", "lower": [0, 0], "upper": [10, 10], "restitution": 0.5},
    "groups": [
        {"type": "fill", "name": "grains", "count": 30, "region": {"type": "Box", "lower": [0, 4], "upper": [10, 10]}, "seed": 3},
        {"type": "circles", "name": "pegs", "position": [[2, 2], [8, 2]], "pinned": True},
    ],
    "links": [{"type": "Spring", "ends": [["grains", [0, 1]], ["pegs", [0, 1]]], "stiffness": 10}],
    "forces": [{"type": "ConstantForce", "newtons": [1, 0], "group": "grains"}],
}


def written(tmp_path: Path, document: Any, name: str = "a.json") -> Path:
    (tmp_path / name).write_text(json.dumps(document), encoding="utf-8")
    return tmp_path / name


def changed(**values: Any) -> dict[str, Any]:
    return {**SILO, **values}


def group(**values: Any) -> dict[str, Any]:
    return changed(groups=[{**SILO["groups"][0], **values}], links=[], forces=[])  # type: ignore[index]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run_and_freeze_to_the_same_bits(path: Path, tmp_path: Path) -> None:
    scene = pv.scenes.read(path)
    assert scene.name == path.stem
    world = scene.world()
    extent = world.boundary.extent()
    # Nothing starts on top of another: the deepest overlap is that of planks, which touch.
    assert world.overlap().max < 0.05
    if extent:
        assert not world.escaped()
    frozen = tmp_path / "b.toml"
    scene.freeze(frozen)
    scene.write(tmp_path / "c.json")
    again = [pv.scenes.read(frozen).world(), pv.scenes.read(tmp_path / "c.json").world()]
    for each in (world, *again):
        each.run(seconds=0.25)
    assert len({each.state_hash() for each in (world, *again)}) == 1
    assert world.time > 0


def test_what_the_documentation_shows(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "data.md").read_text(encoding="utf-8")
    (document,) = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "silo.toml").write_text(document, encoding="utf-8")
    world = pv.scenes.read(tmp_path / "silo.toml").world()
    assert len(world) == 200
    assert not world.escaped()
    keys = set(re.findall(r"`(\w+)`", "".join(line.split("|")[1] for line in text.splitlines() if line.startswith("| `"))))
    assert set(schema()["properties"]) - {"joined"} <= keys


def test_five_examples() -> None:
    assert len(EXAMPLES) == 5
    assert {path.suffix for path in EXAMPLES} == {".toml", ".json"}


@pytest.mark.parametrize("name", ["cage", "conveyor", "newton-cradle", "soft-bodies", "particle-life", "boids", "droplets"])
def test_scenes_with_a_name_freeze_too(name: str, tmp_path: Path) -> None:
    count = {"newton-cradle": 10, "soft-bodies": 500}.get(name, 60)
    scene = pv.scenes.get(name)
    scene.freeze(tmp_path / "a.json", particles=count)
    frozen = pv.scenes.read(tmp_path / "a.json")
    assert frozen.settings().particles == count
    worlds = [scene.world(particles=count), frozen.world()]
    for world in worlds:
        world.run(seconds=0.25)
    assert worlds[0].state_hash() == worlds[1].state_hash()
    assert frozen.world(substeps=4, gravity=(0, -1)).substeps == 4
    refused("particles is 7; allowed is", frozen.world, particles=7)


def test_a_name_with_settings_is_that_scene(tmp_path: Path) -> None:
    document = {"format": 1, "scene": "cage", "settings": {"particles": 50, "friction": 0.3, "integrator": {"type": "RK4"}}}
    scene = pv.scenes.read(written(tmp_path, document))
    same = pv.scenes.get("cage").world(particles=50, friction=0.3, integrator=pv.RK4())
    assert scene.world().state_hash() == same.state_hash()
    assert scene.world().integrator.label == same.integrator.label
    scene.write(tmp_path / "b.toml")
    assert pv.scenes.read(tmp_path / "b.toml").world().state_hash() == same.state_hash()
    assert len(scene.world(particles=20)) == 20
    pv.scenes.get("cage").write(tmp_path / "c.toml")
    read, known = pv.scenes.read(tmp_path / "c.toml").settings(), pv.scenes.get("cage").settings()
    assert type(read.integrator) is type(known.integrator)
    assert replace(read, integrator=known.integrator) == known


def test_a_file_builds_what_it_says(tmp_path: Path) -> None:
    world = pv.scenes.read(written(tmp_path, SILO)).world()
    assert len(world) == 32
    assert isinstance(world.boundary, pv.Box)
    assert world.boundary.restitution == 0.5
    assert np.isinf(world.mass[30:]).all()
    assert np.array_equal(world.position[30:], [(2, 2), (8, 2)])
    assert world.position[:30, 1].min() > 4
    (link,) = world.links
    assert link.particles.tolist() == [[0, 30], [1, 31]]
    assert world.mass[0] == 1.0  # of half a metre
    world.step(1 / 60)
    # Only the grains are pushed.
    assert (world.velocity[2:30, 0] > 0).all()
    assert not world.velocity[30:].any()


def test_filters_sensors_one_way_lines_and_motors(tmp_path: Path) -> None:
    document = changed(
        room={"type": "Box", "lower": [0, 0], "upper": [10, 10], "category": 4, "mask": 3},
        builders=[{"type": "chain", "name": "links", "start": [1, 3], "end": [4, 3], "category": 2, "mask": 6}],
        obstacles=[
            {"type": "Segment", "start": [1, 2], "end": [9, 2], "one_way": [0, 1], "category": 4},
            {"type": "Disc", "center": [5, 5], "radius": 2, "sensor": True, "mask": 2},
            {"type": "Chain", "points": [[0, 1], [5, 0.5], [10, 1]], "mask": 6},
        ],
        links=[
            {"type": "Motor", "ends": [["grains", 0], ["grains", 1], ["pegs", 0]], "speed": -3.0, "max_torque": 2.0},
            {"type": "AngleLimit", "ends": [["grains", 0], ["grains", 1], ["pegs", 0]], "least": 1.0, "most": 4.0},
        ],
    )
    scene = pv.scenes.read(written(tmp_path, document))
    world = scene.world()
    floor, disc, chain = world.obstacles
    assert (floor.one_way, floor.category, disc.sensor, disc.mask, chain.one_way) == ((0.0, 1.0), 4, True, 2, None)
    assert isinstance(world.boundary, pv.Box)
    assert (world.boundary.category, world.boundary.mask) == (4, 3)
    assert (world.category[-1], world.mask[-1]) == (2, 6)
    motor, limit = tuple(world.links)[-2:]
    assert isinstance(motor, pv.Motor)
    assert (motor.speed.tolist(), motor.particles.tolist()) == ([-3.0], [[0, 1, 30]])
    assert isinstance(limit, pv.AngleLimit)
    assert (limit.least.tolist(), limit.most.tolist()) == ([1.0], [4.0])
    scene.freeze(tmp_path / "b.toml")
    again = pv.scenes.read(tmp_path / "b.toml").world()
    assert bits_after(again, 1.0) == bits_after(world, 1.0)


def test_settings_change_what_the_file_says(tmp_path: Path) -> None:
    scene = pv.scenes.read(written(tmp_path, SILO))
    assert scene.settings().particles == 30
    other = scene.world(particles=20, friction=0.7, restitution=0.1, seed=4, dtype=np.float64, substeps=3, gravity=(1, 0))
    assert len(other) == 22
    assert other.collisions is not None
    assert (other.collisions.friction, other.collisions.restitution) == (0.7, 0.1)
    assert isinstance(other.boundary, pv.Box)
    assert (other.boundary.friction, other.boundary.restitution) == (0.7, 0.1)
    assert (other.dtype.name, other.substeps, other.gravity) == ("float64", 3, (1.0, 0.0))
    assert not np.array_equal(scene.world(seed=4).position, scene.world().position)
    assert scene.world(collisions=False).collisions is None
    assert np.ptp(scene.world(radius_spread=3).radius[:30]) > 0.2


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (group(raduis=1), "groups[0] has no key 'raduis' (did you mean 'radius'?)"),
        (changed(grups=[]), "has no key 'grups' (did you mean 'groups'?)"),
        (changed(world={"subteps": 3}), "world has no key 'subteps' (did you mean 'substeps'?)"),
        (changed(room={"type": "Bx"}), "room has the type 'Bx' (did you mean 'Box'?)"),
        (changed(room={"type": "Circle", "radios": 3}), "room has no key 'radios' (did you mean 'radius'?)"),
        (changed(room={"type": "Circle"}), "room lacks 'radius'"),
        (changed(room={"lower": [0, 0]}), "room lacks 'type'"),
        (changed(format=2), "format is 2; input should be 1"),
        ({"room": {"type": "Open"}}, "the file lacks 'format'"),
        (group(count="many"), "groups[0].count is 'many'; input should be a valid integer"),
        (group(count=0), "groups[0].count is 0; input should be greater than or equal to 1"),
        (group(count=500), "groups[0]: count is 500, and so many circles do not fit into the region"),
        (group(radius=float("nan")), "groups[0].radius is nan; input should be a finite number"),
        (group(region={"type": "Box", "lower": [0, 4], "upper": [9, "x"]}), "groups[0].region.upper[1] is 'x'"),
        (changed(links=[{"type": "Stick", "ends": [["grans", 0], ["pegs", 0]]}]), "links[0]: ends is 'grans' (did you mean"),
        (changed(links=[{"type": "Stick", "ends": [["grains", 99], ["pegs", 0]]}]), "links[0]: "),
        (changed(forces=[{"type": "ConstantForce", "newtons": [1, 0], "group": "x"}]), "forces[0]: group is 'x'"),
        (changed(obstacles=[{"type": "Disc", "center": [5, 5], "radius": -1}]), "obstacles[0]: radius is -1"),
        (changed(obstacles=[{"type": "Disc", "center": [5, 5], "radius": 1, "one_way": 1}]), "obstacles[0] has no key 'one_way'"),
        (changed(obstacles=[{"type": "Segment", "start": [0, 0], "end": [1, 0], "mask": -1}]), "obstacles[0]: mask is -1"),
        (changed(scene="cage"), "names a scene and has"),
        (changed(settings={"particles": 3}), "has settings and names no scene"),
        ({"format": 1, "scene": "cge"}, "unknown scene 'cge' (did you mean 'cage'?)"),
        (changed(start_hash="0" * 16), "start_hash is 0000000000000000, and the start is"),
        (changed(collisions={"method": {"type": "Fats"}}), "collisions.method has the type 'Fats' (did you mean 'Fast'?)"),
        (changed(view={"part": [1, 0, 0, 1]}), "part is [1.0, 0.0, 0.0, 1.0]"),
        (changed(groups=[SILO["groups"][0]] * 2), "groups[1]: name is 'grains', which another group has"),  # type: ignore[index]
        (changed(links=[{"type": "Stick", "ends": [["a", 0], ["b", "c"]]}]), "links[0].ends[1][1] is 'c'; input should be"),
        (changed(links=[{"type": "Stick", "ends": [["a", 0], ["b"]]}]), "links[0].ends[1] lacks 1"),
        (
            changed(builders=[{"type": "soft_body", "outline": {"center": [0, 0], "radios": 1}}]),
            "builders[0].outline has no key 'radios' (did you mean 'radius'?)",
        ),
        (changed(builders=[{"type": "soft_body", "outline": "round"}]), "builders[0].outline is 'round'; input should be"),
        ([1, 2], "input should be"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_sentence(document: Any, said: str, tmp_path: Path, refusal: Any) -> None:
    assert said in refusal("scene", "check", str(written(tmp_path, document)))


def test_files_that_are_none(tmp_path: Path) -> None:
    for name, content, said in (
        ("a.toml", b"format = ", "is no TOML"),
        ("a.json", b"{", "is no JSON"),
        ("a.json", b"\xff\xfe", "is no JSON"),
        ("a.toml", b"format = 2020-01-01", "holds something else"),
        ("a.json", b"[" * 100_000, "is no JSON"),
    ):
        (tmp_path / name).write_bytes(content)
        refused(said, pv.scenes.read, tmp_path / name)
    refused("cannot be read", pv.scenes.get, str(tmp_path / "none.toml"))
    refused(r"ends in .toml or .json", pv.scenes.read, tmp_path / "none.yaml")
    refused("cannot be written", pv.scenes.get("cage").write, tmp_path / "none" / "a.toml")


def test_arrays_that_were_changed_are_refused(tmp_path: Path) -> None:
    pv.scenes.get("cage").freeze(tmp_path / "a.json", particles=10)
    content = bytearray((tmp_path / "a.npz").read_bytes())
    content[200] ^= 1
    (tmp_path / "a.npz").write_bytes(content)
    refused("the file of then", pv.scenes.read, tmp_path / "a.json")
    document = json.loads((tmp_path / "a.json").read_text())
    document["groups"][0]["file"] = "../a.npz"
    refused("the name of one beside", pv.scenes.read, written(tmp_path, document))


def test_a_frozen_one_takes_its_arrays_along(tmp_path: Path) -> None:
    pv.scenes.get("cage").freeze(tmp_path / "a.json", particles=10)
    (tmp_path / "b").mkdir()
    frozen = pv.scenes.read(tmp_path / "a.json")
    frozen.write(tmp_path / "b" / "c.json")
    frozen.freeze(tmp_path / "b" / "d.toml")
    (tmp_path / "a.npz").unlink()
    hashes = {pv.scenes.read(tmp_path / "b" / name).world().state_hash() for name in ("c.json", "d.toml")}
    assert hashes == {pv.scenes.get("cage").world(particles=10).state_hash()}


def test_objects_of_ones_own_are_in_no_file(tmp_path: Path) -> None:
    class Wall(pv.Open):
        """One's own."""

    scene = pv.scenes.Scene("own", "", lambda settings: pv.World(boundary=Wall()))
    refused("room has an object of a class of your own", scene.freeze, tmp_path / "a.json")


def test_scenes_of_ones_own_have_no_name_to_write(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("import pyverlet as pv\n\n\ndef build():\n    return pv.World()\n", encoding="utf-8")
    for scene in (pv.scenes.get(str(tmp_path / "mine.py")), pv.scenes.Scene("cage", "", lambda settings: pv.World())):
        refused(f"scene is '{scene.name}', which no name gives", scene.write, tmp_path / "a.toml")
        scene.freeze(tmp_path / "a.toml")
        assert pv.scenes.read(tmp_path / "a.toml").world().state_hash() == pv.World().state_hash()


def test_the_schema_knows_what_the_reader_knows() -> None:
    found = schema()
    assert set(found["properties"]) >= set(SILO)
    assert found["$defs"]["Fill"]["additionalProperties"] is False
    assert {"radius", "count", "region", "seed"} <= set(found["$defs"]["Fill"]["properties"])
    assert "angular_velocity" in found["$defs"]["Capsule"]["properties"]
    if importlib.util.find_spec("jsonschema"):
        import jsonschema

        jsonschema.validate(SILO, found)


def test_toml_is_read_as_it_was_written() -> None:
    value = {
        "a": 1,
        "b": [1.5, -0.0, 1e-300],
        "c": 'é\n"\x7f',
        "t": {"x y": True, "n": [[1, 2], [3, 4]]},
        "l": [{"u": {"v": 1}}, {}],
    }
    assert tomllib.loads(toml.dumps(value)) == value
    assert validated({"format": 1, "run": {"seconds": 3}}, "x") == {"format": 1, "run": {"seconds": 3.0}}


def test_a_file_wherever_a_name_goes(tmp_path: Path, capsys: pytest.CaptureFixture[str], report: Any) -> None:
    path = str(written(tmp_path, group(count=20)))
    assert report("run", path, "--frames", "2")["particles"] == 20
    found = report("run", path, "--frames", "2", "--particles", "5", "--substeps", "2")
    assert (found["particles"], found["substeps"]) == (5, 2)
    assert report("bench", path, "--frames", "2", "--settle", "0")["scene"] == "a"
    assert main(["compare", path, "--seconds", "0.1", "--integrators", "rk4", "--substeps", "1", "--json"]) == 0
    assert main(["record", path, str(tmp_path / "a.html"), "--seconds", "0.1"]) == 0
    assert main(["scene", "freeze", path, str(tmp_path / "frozen.toml")]) == 0
    capsys.readouterr()
    assert report("scene", "check", str(tmp_path / "frozen.toml"))["particles"] == 20
    assert main(["scene", "freeze", path, path]) == 2
    assert main(["scene", "schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "pyverlet scene"


def test_arrays_of_the_users_own_are_refused(tmp_path: Path) -> None:
    world = pv.World()
    world.add(position=(0, 0))
    world.data["age"] = 1.0
    with pytest.raises(
        pv.InputError, match=r"world.data has 'age'; allowed in scene files are no arrays, which pyverlet.save keeps"
    ):
        freeze(world, tmp_path / "scene.toml")
