"""Descriptions: every kind of object there and back, also through JSON, and what is refused."""

import io
import json
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.data import archive, serialize
from pyverlet.data.describe import KINDS, Builder, arguments_of, describe
from pyverlet.laws.forces import Grip, Push
from pyverlet.scenes.boids import Flock
from pyverlet.scenes.particle_life import Likings

ROOM = pv.Box((0, 0), (2, 1), restitution=0.5, friction=0.25)


def bonded() -> pv.Cohesion:
    cohesion = pv.Cohesion(strength=1, break_distance=0.1)
    cohesion.bonds = np.array([(0, 1), (1, 4)])
    return cohesion


THINGS: list[Any] = [
    pv.Periodic((0, 1), (4, 3), axes="x", restitution=0.2),
    pv.Open(), pv.Circle(center=(1, 2), radius=3.0, restitution=0.1, friction=0.2), ROOM, pv.ClampAndFlip(pv.Box((0, 0), (1, 1))),
    pv.ProjectOnly(pv.Circle(radius=2, angular_velocity=1.5)), pv.Fast(), pv.Fast(skin=0.1), pv.BruteForce(),
    pv.Collisions(restitution=0.3, friction=0.6, method=pv.BruteForce()),
    *(cls() for cls in pv.integrators.BY_NAME.values()), pv.PositionVerlet(naive_start=True),
    pv.Attractor(strength=2, softening=0.1), pv.ConstantForce((1, 2)), pv.Drag(linear=0.1), pv.Wind((1, 0), quadratic=0.5),
    pv.Gravitation(strength=1.5, theta=0.3), pv.Fluid(rest_density=9, stiffness=7),
    pv.PointSpring(stiffness=3), Push(center=(1, 1), radius=2, acceleration=9),
    pv.LennardJones(epsilon=1, sigma=0.1), pv.Yukawa(strength=2, screening_length=0.1, cutoff=0.5), bonded(),
    pv.SoftRepulsion(strength=3, range=0.2), pv.Langevin(temperature=1e-3, friction=2, seed=5),
    Likings(likes=[[0.1, -0.5], [1.0, 0.0]], kind=[0, 1, 1], pull=2.0, range=0.5), Flock(sight=1.0, apart=0.5, speed=2.0),
    Grip(3, target=(1, 2)), pv.Sink(ROOM, outside=True), pv.Emitter(ROOM, rate=10, radius=(0.1, 0.2), most=7, seed=3),
    pv.Segment((0.1, 0.2), (1.3, 0.7), friction=0.3), pv.Capsule((0, 0), (1, 1 / 3), radius=0.1, surface_speed=2),
    pv.Disc((1 / 3, 2), 0.5, velocity=(1, 0)), pv.Polygon([(0, 0), (0, 1), (1 / 7, 0)], radius=0.1, angular_velocity=1.0),
    pv.Chain([(0, 0), (1, 0.3), (2, 0)], closed=True, pivot=(0.1, 0)),
    pv.Box((0, 0), (1, 1), category=6, mask=2**32 - 2), pv.Circle(radius=2, mask=4), pv.Periodic((0, 0), (4, 4), mask=0),
    pv.Disc((0, 0), 1, sensor=True, category=5), pv.Segment((0, 0), (1, 2), one_way=(0.3, 0.1)),
    pv.Chain([(0, 0), (1, 0.3), (2, 0)], one_way=(0, 1), mask=9), pv.Capsule((0, 0), (1, 1), radius=0.1, one_way=(0, -2)),
]  # fmt: skip


def test_every_kind_is_tried() -> None:
    assert {type(thing).__name__ for thing in THINGS} == set(KINDS)


@pytest.mark.parametrize("thing", THINGS, ids=lambda thing: type(thing).__name__)
def test_every_argument_of_a_class_is_described(thing: Any) -> None:
    # The numbers that a seed leads to are the state of an emitter.
    taken = set(arguments_of(type(thing))) - ({"seed"} if isinstance(thing, pv.Emitter) else set())
    assert taken <= set(describe(thing))


@pytest.mark.parametrize("thing", THINGS, ids=lambda thing: type(thing).__name__)
def test_there_and_back(thing: Any) -> None:
    described = json.loads(json.dumps(serialize.plain(describe(thing)), allow_nan=False))
    again = Builder().build("it", described, object)
    assert type(again) is type(thing)
    assert serialize.plain(describe(again)) == described
    if isinstance(thing, pv.Obstacle):
        assert again.points.tobytes() == thing.points.tobytes()
        assert again.one_way == thing.one_way
    for name in ("category", "mask", "sensor"):
        assert getattr(again, name, None) == getattr(thing, name, None)


class Storm(pv.Actor):
    def __init__(self) -> None:
        self.gusts: Any = (1, [2.0, float("inf")], {"a": np.arange(3)})

    def act(self, world: pv.World, dt: float) -> None:
        pass

    def save(self) -> Any:
        return self.gusts

    def restore(self, saved: Any) -> None:
        self.gusts = saved


def test_own_classes_are_handed_in_with_what_they_remember() -> None:
    described = describe(Storm())
    storm, other = Storm(), Storm()
    storm.gusts = None
    assert Builder([other, storm]).build("actor", describe(other), Storm) is other
    again = Builder([storm]).build("actor", described, pv.Actor)
    assert again is storm
    assert storm.gusts[:2] == (1, [2.0, float("inf")])
    assert list(storm.gusts[2]["a"]) == [0, 1, 2]
    refused(r"Storm.*objects", Builder().build, "actor", described, pv.Actor)


def test_what_cannot_be_kept_is_named() -> None:
    storm = Storm()
    storm.gusts = {1, 2}
    refused(r"Storm.save\(\).*set", describe, storm)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"type": "Circel", "radius": 1}, "did you mean 'Circle'"),
        ({"type": "Circle", "radios": 1}, "did you mean 'radius'"),
        ({"type": "Circle", "radius": -1}, "room: radius is -1"),
        ({"type": "Circle", "radius": [1, 2]}, "radius"),
        ({"type": "Circle"}, "radius"),
        ({"type": ["Circle"]}, "known"),
        ({"type": "Drag"}, "allowed are Open"),
        ({"type": "Open", "state": {"a": 1}}, "state"),
        (7, "room is 7"),
    ],
)
def test_wrong_descriptions_get_a_sentence(wrong: Any, said: str) -> None:
    refused(said, Builder().build, "room", wrong, pv.Boundary)


# ---- Archives: what comes back is what was written, and files that claim more than they hold are not believed ----


ARRAYS = {
    "full": np.arange(200.0).reshape(100, 2) ** 2,
    "twin": np.arange(200.0).reshape(100, 2) ** 2,
    "alike": np.full((100, 2), 0.3, np.float32),
    "counting": np.arange(7, 107, dtype=np.int64),
    "empty": np.empty((0, 2), np.float32),
    "few": np.array([True, False]),
    "zeros": np.array([0.0] * 99 + [-0.0]),  # equal, but not in their bits
    "nan": np.full(100, np.nan),
    "drawn": np.array([(0.0, -9.81), (-0.0, -9.81), (np.nan, 3.0)], np.float32)[np.arange(100) % 7 % 3],
}


def written(table: dict[str, Any], arrays: dict[str, Any]) -> bytes:
    out = io.BytesIO()
    archive.write(out, lambda: table, arrays)
    return out.getvalue()


def test_archives_go_there_and_back(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(written({"a": [1, "x"]}, ARRAYS))
    table, arrays = archive.read(path)
    assert table == {"a": [1, "x"]}
    assert list(arrays) == list(ARRAYS)
    for name, array in arrays.items():
        assert array.dtype == ARRAYS[name].dtype
        assert array.tobytes() == ARRAYS[name].tobytes()
        assert array.flags.writeable
    assert not np.shares_memory(arrays["full"], arrays["twin"])
    with zipfile.ZipFile(path) as file:
        assert {info.filename for info in file.infolist()} == {
            "full.npy", "alike.npy", "empty.npy", "few.npy", "zeros.npy", "zeros.rows.npy", "nan.npy", "drawn.npy",
            "drawn.rows.npy", "snapshot.json",
        }  # fmt: skip


def test_what_would_expand_too_much_is_stored_in_full(tmp_path: Path) -> None:
    path, arrays = tmp_path / "a", {f"a{k}": np.full(10_000, float(k)) for k in range(3)}
    path.write_bytes(written({}, arrays))
    assert path.stat().st_size > 3 * 80_000
    assert archive.read(path)[1]["a2"].tolist() == [2.0] * 10_000


def index(shape: Any, **how: Any) -> dict[str, Any]:
    return {"arrays": {"a": {"shape": shape, "dtype": "<f8", **how}}}


@pytest.mark.parametrize(
    "table",
    [
        index([10**12], repeated=True), index([10**12], counts_from=0), index([-1]), index([True]), index([2, 2, 2]), index("x"),
        index([4], same_as="a"), index([5]), {"arrays": {}}, {"arrays": 3}, [], {},
    ],
)  # fmt: skip
def test_tables_that_lie(table: Any, tmp_path: Path) -> None:
    path, member = tmp_path / "a", io.BytesIO()
    np.save(member, np.zeros(4))
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a.npy", member.getvalue())
        file.writestr("snapshot.json", json.dumps(table))
    refused("no sound file", archive.read, path)


@pytest.mark.parametrize(
    ("rows", "which", "there"),
    [(3, [0, 1, 3, 0], 3), (5, [0] * 4, 5), (0, [0] * 4, 0), (2, [0] * 4, 3), ("2", [0] * 4, 2), (True, [0] * 4, 1)],
)
def test_rows_that_are_not_there(rows: Any, which: list[int], there: int, tmp_path: Path) -> None:
    path = tmp_path / "a"
    with zipfile.ZipFile(path, "w") as file:
        for name, array in (("a", np.array(which, "<u2")), ("a.rows", np.zeros(there))):
            member = io.BytesIO()
            np.save(member, array)
            file.writestr(f"{name}.npy", member.getvalue())
        file.writestr("snapshot.json", json.dumps(index([4], rows=rows)))
    refused("no sound file", archive.read, path)


def test_files_that_are_odd(tmp_path: Path) -> None:
    whole, path = written({}, {"a": np.zeros(4)}), tmp_path / "a"
    for raw in (b"", b"PK", whole[:-1], whole[: len(whole) // 2], whole.replace(b"NUMPY", b"NUMPX")):
        path.write_bytes(raw)
        refused("no sound file", archive.read, path)
    deep = '{"arrays": {}, "a": ' + "[" * 100_000 + "]" * 100_000 + "}"
    for compressed, text in (
        (zipfile.ZIP_DEFLATED, '{"arrays": {}}'),
        (zipfile.ZIP_STORED, deep),
        (zipfile.ZIP_STORED, '{"a": NaN}'),
    ):
        with zipfile.ZipFile(path, "w", compressed) as file:
            file.writestr("snapshot.json", text)
        refused("no sound file", archive.read, path)
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w") as file:
        warnings.simplefilter("ignore")  # zipfile's own, of a member that is there twice
        file.writestr("snapshot.json", '{"arrays": {}}')
        file.writestr("snapshot.json", '{"arrays": {}}')
    refused("twice", archive.read, path)
    refused("cannot be read", archive.read, tmp_path)
