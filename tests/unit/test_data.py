"""Arrays of the user's own: they follow the particles wherever these go."""

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import worlds

import pyverlet as pv
from pyverlet.common.fields import Field

KINDS: dict[str, Any] = {
    "bool": np.array([True, False, True]), "int8": np.array([1, -2, 3], np.int8),
    "uint64": np.array([2**63, 1, 2], np.uint64), "float16": np.array([0.5, -1, 2], np.float16),
    "float32": np.array([[0.5, 1, 2], [3, 4, 5], [6, 7, 8]], np.float32),
    "big-endian": np.array([1.5, 2.5, 3.5], ">f8"), "complex": np.array([1 + 2j, 3, 4j]),
    "text": np.array(["red", "grün", ""]), "bytes": np.array([b"a", b"bcd", b""]),
    "date": np.array(["2024-02-29", "1970-01-01", "NaT"], "M8[D]"),
    "record": np.array([(1, (2.0, 3.0)), (4, (5.0, 6.0)), (7, (8.0, 9.0))], [("team", np.int32), ("aim", np.float64, (2,))]),
    "no columns": np.zeros((3, 0)),
}  # fmt: skip


def three(**options: Any) -> pv.World:
    world = pv.World(gravity=(0, 0), **options)
    world.add(position=[(0, 0), (2, 0), (4, 0)])
    return world


def test_it_is_a_mapping_of_views() -> None:
    world = three()
    world.data["age"] = 0.0
    age = world.data["age"]
    age += 0.5
    world.data["age"] += 1.0
    world.data["age"][1] = 7
    assert age.tolist() == [1.5, 7.0, 1.5]  # a view still
    world.data["age"][:] = world.data["age"]
    world.step(1 / 60)
    assert world.data["age"].tolist() == [1.5, 7.0, 1.5]  # frames leave it alone
    assert dict(world.data).keys() == {"age"}
    assert "age" in world.data
    assert "mass" not in world.data
    assert world.data.get("mass") is None
    assert repr(world.data) == "Data of 1 array: 'age' float64 (3,)"
    world.data.update(team=1, place=np.ones((3, 2)))
    assert list(world.data) == ["age", "team", "place"]
    del world.data["team"]
    assert len(world.data) == 2
    world.data.clear()
    assert repr(world.data) == "Data of 0 arrays"


def test_groups_and_particles_see_their_rows() -> None:
    world = three()
    late = world.add(position=[(0, 4), (2, 4)])
    world.data["heat"] = np.arange(10.0).reshape(5, 2)
    assert late.data["heat"].tolist() == [[6, 7], [8, 9]]
    assert np.shares_memory(late.data["heat"], world.data["heat"])
    late.data["heat"][0] = 1, 2
    late[1].data["heat"] = 3.0
    late[1].data["heat"][1] = 4.0
    first = world.groups[0]
    first[[2, 0]].data["heat"] = [[20, 21], [0.5, 1.5]]
    assert world.data["heat"].tolist() == [[0.5, 1.5], [2, 3], [20, 21], [1, 2], [3, 4]]
    assert first[[2, 0]].data["heat"].tolist() == [[20, 21], [0.5, 1.5]]
    with pytest.raises(ValueError, match="read-only"):
        first[[2, 0]].data["heat"][0] = 1
    world.data["level"] = np.arange(5)
    assert late[0].data["level"] == 3
    late.data["level"] = 0.5  # takes up a dtype that holds it, for all
    assert world.data["level"].tolist() == [0, 1, 2, 0.5, 0.5]
    first.remove()
    assert late.data["level"].tolist() == [0.5, 0.5]
    worlds.refused("group is one of 3 particles that were all removed", first.data.__getitem__, "level")
    for write in (late.data.clear, lambda: late.data.pop("level")):
        worlds.refused(r"data\['(level|heat)'\] is of all particles; allowed is del world.data\[", write)


def test_dtypes_hold_what_is_set_and_new_particles_get_what_all_had() -> None:
    world = three()
    world.data["small"] = np.float32(2)
    world.data["small"] = 0.1  # a plain number changes no dtype
    world.data["byte"] = np.array([1, 2, 3], np.int8)
    world.data["byte"] = [3, 4, 5]
    assert world.data["byte"].dtype == np.int8
    world.data["byte"] = 300  # does not fit
    assert world.data["byte"].tolist() == [300] * 3
    world.data["count"] = 5
    world.data["name"] = "ab"
    world.data["tag"] = np.array(["x", "yy", "zzz"])
    world.data["row"] = [(1, 2), (3, 4), (5, 6)]
    world.data["row"] = (7, 8)
    world.add(position=(8, 8), data={"name": "longer", "count": 1.5})
    world.add(position=(9, 9))
    assert world.data["small"].dtype == np.float32
    assert world.data["small"].tolist() == [np.float32(0.1)] * 5
    assert world.data["count"].tolist() == [5, 5, 5, 1.5, 5]
    assert world.data["name"].tolist() == ["ab"] * 3 + ["longer", "ab"]
    assert world.data["tag"].tolist() == ["x", "yy", "zzz", "", ""]
    assert world.data["row"].tolist() == [[7, 8]] * 5
    world.data["count"] = np.arange(5)
    world.add(position=(7, 7))
    assert world.data["count"].tolist() == [0, 1, 2, 3, 4, 5]  # what was set for all last


def restored(world: pv.World, _: Path) -> pv.World:
    kept = world.save()
    for name in world.data:
        world.data[name][:] = world.data[name][0]
    world.data["other"] = 1
    world.remove(1)
    world.restore(kept)
    return world


WAYS: dict[str, Callable[[pv.World, Path], pv.World]] = {**worlds.WAYS, "restore": restored}


@pytest.mark.parametrize("way", WAYS)
def test_every_dtype_is_kept(way: str, tmp_path: Path) -> None:
    world = three()
    for name, values in KINDS.items():
        world.data[name] = values
    world.data["new"] = 4.5
    again = WAYS[way](world, tmp_path)
    assert list(again.data) == [*KINDS, "new"]
    for name, values in KINDS.items():
        assert again.data[name].dtype == values.dtype.newbyteorder("=")
        assert again.data[name].tobytes() == values.astype(values.dtype.newbyteorder("=")).tobytes()
    if again is not world:
        assert not np.shares_memory(again.data["new"], world.data["new"])
    again.add(position=(9, 9))
    again.remove(0)
    again.run(seconds=0.1)
    assert again.data["new"].tolist() == [4.5] * 3
    assert again.data["int8"].tolist() == [-2, 3, 0]


def test_objects_are_kept_but_in_files(tmp_path: Path) -> None:
    world = three()
    world.data["thing"] = np.array([{"a": 1}, None, "text"], object)
    for again in (copy.deepcopy(world), pickle.loads(pickle.dumps(world))):
        assert again.data["thing"].tolist() == [{"a": 1}, None, "text"]
        assert again.data["thing"][0] is not world.data["thing"][0]
    says = r"data\['thing'\] holds Python objects; allowed in files are numbers, texts and dates of NumPy's dtypes"
    worlds.refused(says, pv.save, world, tmp_path / "world.pvsnap")
    assert not (tmp_path / "world.pvsnap").exists()


def aged(settings: pv.scenes.Settings) -> pv.World:
    world = three()
    world.data["age"] = float(settings.seed % 100)
    world.data["name"] = ["a", "b", "c"]
    return world


@pytest.mark.parametrize("processes", [1, 2])
def test_many_worlds_have_theirs(processes: int) -> None:
    with pv.Worlds(pv.scenes.Scene("aged", "", aged), 2, processes=processes) as many:
        many.run(seconds=0.1)
        for world in many:
            assert world.data["name"].tolist() == ["a", "b", "c"]
        ages = [world.data["age"].tolist() for world in many]
        assert ages[0] != ages[1]
        many.restore(many.save(), [0])
        assert [world.data["age"].tolist() for world in many] == ages


def test_emitters_and_sinks() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (20, 20)))
    world.data["born"] = -1.0
    world.actors += [pv.Emitter(pv.Box((1, 15), (19, 19)), rate=60, radius=0.2), pv.Sink(pv.Box((0, 0), (20, 10)))]
    for _ in range(120):
        world.data["born"][world.data["born"] < 0] = world.time
        world.step(1 / 60)
    assert len(world) < world.actors[0].emitted  # type: ignore[attr-defined]
    born = world.data["born"]
    assert len(born) == len(world)
    assert (np.diff(np.where(born < 0, world.time, born)) >= 0).all()  # in the order in which they came


# ---- Fields: what they let through, and the sentence for what they do not ----


REAL = np.dtype(np.float32)


def check(field: Field, values: Any, dtype: Any = None, **sizes: int) -> None:
    field.check("it", np.array(values, REAL if dtype is None else dtype), REAL, dict(sizes))


@pytest.mark.parametrize(
    ("field", "values", "dtype"),
    [
        (Field(None, "n", above=0), [1, 2.5], None), (Field(None, "n", above=0, infinite=True), [1, np.inf], None),
        (Field(None, "n", 2, nan=True), [(1, 2), (np.nan, np.nan)], None), (Field(None, "n", 2), np.empty((0, 2)), None),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [2, 0, 1], np.int32),
        (Field(np.int64, "n", order="ascending"), [-1, 3, 7], np.int64),
        (Field(np.int64, "n", order="rising"), [3, 3, 7], np.int64),
    ],
)  # fmt: skip
def test_what_is_right(field: Field, values: Any, dtype: Any) -> None:
    check(field, values, dtype)


@pytest.mark.parametrize(
    ("field", "values", "dtype", "said"),
    [
        (Field(None, "n", above=0), [1, 0], None, "it has 0; allowed is greater than 0"),
        (Field(None, "n", above=0), [1, np.nan], None, r"it\[1\] is nan"),
        (Field(None, "n"), [-np.inf, 1], None, r"it\[0\] is -inf"),
        (Field(None, "n", above=0, infinite=True), [-np.inf, np.inf], None, "it has -inf"),
        (Field(None, "n", infinite=True), [np.inf, np.nan], None, r"it\[1\] is nan"),
        (Field(None, "n", 2, nan=True), [(1, np.nan), (np.nan, np.nan)], None, r"it\[0\]"),
        (Field(None, "n", 2, nan=True), [(np.inf, 1), (np.nan, np.nan)], None, r"it\[0\]"),
        (Field(None, "n"), [1, 2], np.float64, "float64 of shape .2,.; allowed is float32"),
        (Field(None, "n", 2), [1, 2], None, r"shape \(2,\); allowed is float32 of shape \(2, 2\)"),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [2, 0, 2], np.int32, "it lacks 1"),
        (Field(np.int32, "n", least=0, below="n", order="permutation"), [3, 0, 1], np.int32, "it has 3; allowed is .*at most 2"),
        (Field(np.int64, "n", order="ascending"), [3, 3], np.int64, r"it\[1\] is less"),
        (Field(np.int64, "n", order="rising"), [3, 2], np.int64, r"it\[1\] is less"),
    ],
)
def test_what_is_wrong(field: Field, values: Any, dtype: Any, said: str) -> None:
    worlds.refused(said, check, field, values, dtype)


def test_equal_names_are_equal_lengths() -> None:
    sizes: dict[str, int] = {}
    Field(None, "n").check("one", np.zeros(3, REAL), REAL, sizes)
    worlds.refused("other is", Field(None, "n").check, "other", np.zeros(4, REAL), REAL, sizes)
    assert sizes == {"n": 3}
