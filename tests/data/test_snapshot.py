"""Snapshots: the same bits afterwards in another process, whole files whatever happens, a sentence for bad ones."""

import json
import os
import stat
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.programs import python
from tests.worlds import WORLDS, bits_after, from_file, points, refused

import pyverlet as pv
from pyverlet.data import archive, snapshot

HERE = Path(__file__).parent

GO_ON = """
import json, sys
import pyverlet as pv
hashes = {}
for path in sys.argv[2:]:
    world = pv.load(path, exact=True)
    world.threads = int(sys.argv[1])
    for _ in range(10):
        world.step(1 / 60)
    hashes[path] = world.state_hash()
json.dump(hashes, sys.stdout)
"""


def written(path: Path, table: dict[str, Any], arrays: dict[str, Any]) -> Path:
    """The path, at which there is a file of these now."""
    with path.open("wb") as file:
        archive.write(file, lambda: table, arrays)
    return path


def in_another_process(paths: list[str], threads: int) -> dict[str, str]:
    """Hashes ten frames after what these files hold."""
    run = python("-c", GO_ON, str(threads), *paths, PYVERLET_THREADS="2")
    assert run.returncode == 0, run.stderr
    hashes: dict[str, str] = json.loads(run.stdout)
    return hashes


def follow(name: str, world: pv.World, folder: Path, frames: int, every: int) -> dict[str, str]:
    """Save a world at every so many frames of its run; the hash that each file is to come to in ten frames, by its path."""
    paths: dict[int, str] = {}
    hashes = {}
    for frame in range(frames + 10):
        if frame % every == 0 and frame < frames:
            paths[frame + 10] = str(folder / f"{name}-{frame}.pvsnap")
            pv.save(world, paths[frame + 10])
        world.step(1 / 60)
        if frame + 1 in paths:
            hashes[paths[frame + 1]] = world.state_hash()
    return hashes


def worlds(most: int) -> dict[str, pv.World]:
    """All worlds of all scenes, with at most so many circles."""
    found: dict[str, pv.World] = {}
    for name, scene in pv.scenes.SCENES.items():
        panels = scene.panels(particles=min(scene.defaults.particles, most))
        found |= {f"{name}-{number}": world for number, world in enumerate(panels.worlds)}
    return found


@pytest.mark.parametrize(
    ("most", "frames", "every", "threads"),
    [
        (46, 16, 15, 2), pytest.param(46, 16, 15, 1, marks=pytest.mark.slow),  # worlds this small have had one thread
        *(pytest.param(3000, 200, 10, threads, marks=pytest.mark.full) for threads in (1, 2)),
    ],
)  # fmt: skip
def test_every_scene_goes_on_with_the_same_bits(most: int, frames: int, every: int, threads: int, tmp_path: Path) -> None:
    expected: dict[str, str] = {}
    for name, world in worlds(most).items():
        expected |= follow(name, world, tmp_path, frames, every)
    assert len(expected) > 2 * len(pv.scenes.SCENES)
    assert in_another_process(list(expected), threads) == expected


def test_sums_over_all_do_not_depend_on_the_order_of_slots(tmp_path: Path) -> None:
    # The last bit of the mass of all decided how much energy was taken back: a world with wind, saved and loaded, had another
    # last bit of all its velocities. Slots have another order when they are made anew than when masses were set.
    world = pv.World(boundary=pv.Box((-10, -10), (10, 10)), dtype=np.float64)
    pv.rope(world, (-2.04, 2.15), (-2.94, 3.54))
    pv.soft_body(world, [(-2, -1), (1, -1), (1, 2)], spacing=0.4, filled=True)
    world.run(seconds=3 / 60)
    again = from_file(world, tmp_path)
    again.step(1 / 60)
    assert again._sorted.total_mass == world._sorted.total_mass


def test_links_are_solved_alike_whoever_was_pinned_on_the_way(tmp_path: Path) -> None:
    """Ropes with heavy loads are solved beside those with pins; a world that is loaded packs them as they are pinned by then."""
    columns, rows = 24, 40
    world, number = pv.World(), np.arange(rows * columns).reshape(rows, columns)
    place = np.column_stack((number.ravel() % columns, -0.5 * (number.ravel() // columns)))
    group = world.add(position=place, radius=0.1, mass=np.where(number.ravel() < (rows - 1) * columns, 0.1, 40.0))
    world.links.append(pv.Rope(group, number[:-1].T.ravel(), number[1:].T.ravel(), collide=False))
    group.pin(number[0, ::3])
    world.run(seconds=0.3)
    group.pin(number[0, 1::3])
    group.pin(number[5, 2::3])
    world.run(seconds=0.3)
    again = from_file(world, tmp_path)
    assert bits_after(again, 0.5) == bits_after(world, 0.5)


def test_groups_go_on_naming_their_particles(tmp_path: Path) -> None:
    world = WORLDS["machine"]()
    gone, left = world.add(position=(1, 18)), world.add(position=[(3, 18), (5, 18)], radius=0.2)
    world.remove(gone)
    again = from_file(world, tmp_path)
    groups = again.groups
    assert [len(group) for group in groups] == [2, 192, 0, 2]
    assert groups[3].index.tolist() == left.index.tolist()
    groups[3].velocity[:] = 1.0
    assert (again.velocity[-2:] == 1.0).all()
    assert again.add(position=(-3, 18)).index.tolist() == [196]


class Blower(pv.Actor):
    def __init__(self) -> None:
        self.blown = 0

    def act(self, world: pv.World, dt: float) -> None:
        self.blown += 1
        world.velocity[:, 0] += 0.001 * self.blown

    def save(self) -> int:
        return self.blown

    def restore(self, saved: Any) -> None:
        self.blown = saved


@pv.force
def swirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return -mass * y, mass * x


def test_a_users_own_objects_are_handed_in(tmp_path: Path) -> None:
    path = tmp_path / "a.pvsnap"
    world = WORLDS["machine"]()
    world.actors.append(Blower())
    world.forces.append(swirl)
    world.run(seconds=0.2)
    pv.save(world, path)
    again = pv.load(path, objects=[swirl, Blower()])
    assert bits_after(again, 0.2) == bits_after(world, 0.2)
    refused(r"forces\[0\].*'swirl'.*objects", pv.load, path, objects=[Blower()])


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    world = WORLDS["linked"]()
    world.run(seconds=0.3)
    path: Path = tmp_path_factory.mktemp("saved") / "heap.pvsnap"
    pv.save(world, path, scene={"scene": "heap", "format": 1})
    return path


def test_numpy_reads_it_and_what_it_says(saved: Path) -> None:
    with np.load(saved) as file:  # no pickles: the default
        assert file["particles.position"].shape == (len(pv.load(saved)), 2)
    about, _ = archive.read(saved)
    assert about["scene"] == {"scene": "heap", "format": 1}
    assert about["state_hash"] == pv.load(saved).state_hash()
    assert about["made_by"]["pyverlet"] == pv.__version__


def test_equal_worlds_are_equal_files(saved: Path, tmp_path: Path) -> None:
    pv.save(pv.load(saved), tmp_path / "again.pvsnap", scene={"scene": "heap", "format": 1})
    assert (tmp_path / "again.pvsnap").read_bytes() == saved.read_bytes()


def test_equal_columns_are_stored_once(tmp_path: Path) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (110, 110)))
    world.add(position=points(np.arange(1, 101.0), np.arange(1, 101.0)), radius=0.5)
    pv.save(world, tmp_path / "new.pvsnap")
    # A position, twice four bytes, and some thousands for names and the table; the order of slots counts up.
    assert (tmp_path / "new.pvsnap").stat().st_size < 8 * len(world) + 12_000
    again = pv.load(tmp_path / "new.pvsnap")
    assert again.radius.tolist() == world.radius.tolist()
    again.radius[0] = 0.4  # an array of its own
    assert again.radius[1] == np.float32(0.5)


def test_other_kernels_are_told(saved: Path, tmp_path: Path) -> None:
    table, arrays = archive.read(saved)
    table["kernels"] = "0" * 16
    path = written(tmp_path / "other.pvsnap", table, arrays)
    with pytest.warns(snapshot.OtherBits, match="last bits"):
        assert pv.load(path).state_hash() == table["state_hash"]
    refused("exact is True", pv.load, path, exact=True)


def test_arrays_of_the_law_of_projection_are_ignored(tmp_path: Path) -> None:
    world = WORLDS["machine"]()
    world.run(seconds=0.3)
    pv.save(world, tmp_path / "new.pvsnap")
    table, arrays = archive.read(tmp_path / "new.pvsnap")
    count, real = len(world), world.dtype
    arrays["particles.grown"], arrays["slots.fed"] = np.full(count, 0.5, real), np.full(count, 3, np.uint8)
    arrays |= {f"contacts.{name}": np.zeros((count, 2), real) for name in ("built", "checked")}
    arrays |= {f"contacts.{name}": np.zeros(2, np.int32) for name in ("low", "high", "lent_particle")}
    arrays |= {f"contacts.{name}": np.zeros(2, real) for name in ("slip", "lent", "busy")}
    arrays |= {"contacts.held": np.zeros(2, np.uint8), "linked.number": np.arange(2), "linked.calm": np.zeros(2)}
    arrays |= {"linked.start": np.zeros((2, 2)), "linked.left": np.zeros((2, 2), real)}
    old = pv.load(written(tmp_path / "old.pvsnap", table, arrays))
    assert bits_after(old, 0.1) == bits_after(world, 0.1)
    arrays["linked.other"] = np.zeros(2)
    refused(r"linked\.other", pv.load, written(tmp_path / "bad.pvsnap", table, arrays))


@pytest.mark.parametrize("kind", ["impulses", "asleep"])
def test_surfaces_that_are_not_there_are_refused(tmp_path: Path, kind: str) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)), sleep=kind == "asleep")
    world.obstacles.append(pv.Segment((2, 3), (8, 3)))
    world.add(position=[(1, 0.5), (5, 3.5)], radius=0.5)
    world.run(seconds=4)
    path = tmp_path / "a.pvsnap"
    pv.save(world, path)
    table, arrays = archive.read(path)
    surfaces = arrays[f"{kind}.surfaces"]
    assert sorted(surfaces[:, 1]) == [2, 4]  # the floor, and the segment behind four sides
    arrays[f"{kind}.surfaces"] = surfaces + np.array([0, 1], surfaces.dtype)
    written(path, table, arrays)
    refused(rf"{kind}.surfaces has surface 5; allowed are those of the room and its obstacles, 5", pv.load, path)


def test_formats(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table, arrays = archive.read(saved)
    table["format"] = snapshot.FORMAT + 1
    refused("newer pyverlet", pv.load, written(tmp_path / "newer.pvsnap", table, arrays))
    # An older one goes through all migrations from its own on.
    monkeypatch.setattr(snapshot, "FORMAT", 3)
    turned: list[Any] = []
    for older in (1, 2):
        monkeypatch.setitem(snapshot.MIGRATIONS, older, lambda table, arrays: turned.append(table["format"]))
    assert len(pv.load(saved)) > 0
    assert turned == [1, 1]  # it is theirs to know from which, and nobody's to write down
    refused("older format", pv.load, saved, exact=True)


def test_bad_paths_and_values_lose_nothing(saved: Path, tmp_path: Path) -> None:
    world = WORLDS["machine"]()
    refused("cannot be written", pv.save, world, tmp_path / "nowhere" / "a.pvsnap")
    refused("is not there", pv.load, tmp_path / "nowhere.pvsnap")
    refused("objects is 3; allowed is a list", pv.load, saved, objects=3)
    table, arrays = archive.read(saved)  # an array where a table is to be
    path = written(tmp_path / "kept.pvsnap", {**table, "world": {"$array": next(iter(arrays))}}, arrays)
    refused("lacks something", pv.load, path)
    refused(r"world is 3", pv.save, 3, tmp_path / "a.pvsnap")
    path.write_bytes(saved.read_bytes())
    world.position[3, 1] = np.nan
    refused(r"particles.position\[3\]", pv.save, world, path)
    world.actors.append(Blower())
    world.actors[0].blown = {1}  # type: ignore[attr-defined]
    refused("Blower", pv.save, world, path)
    assert path.read_bytes() == saved.read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["kept.pvsnap"]


@pytest.mark.parametrize(("seed", "count"), [(7, 60), pytest.param(8, 2000, marks=pytest.mark.full)])
def test_mutated_files_are_refused_or_sound(seed: int, count: int, tmp_path: Path) -> None:
    here = os.pathsep.join([str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")])  # where tests.worlds is
    command = ("-X", "faulthandler", str(HERE / "mutants.py"), str(seed), str(count), str(tmp_path))
    run = python(*command, timeout=1200, PYTHONPATH=here)
    assert run.returncode == 0, f"mutant {(tmp_path / 'number').read_text()} of seed {seed}: {run.stderr}"
    became: dict[str, int] = json.loads(run.stdout)
    assert sum(became.values()) == count
    assert set(became) <= {"refused", "went on", "turned non-finite", "refused in a frame"}
    assert became["refused"] > count / 2


KILLED = """
import os, signal, sys
from pathlib import Path
import pyverlet as pv
from pyverlet.data import archive, atomic_file, snapshot
path = Path(sys.argv[1])
world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
world.add(position=[(1, 1), (3, 1), (5, 1)])
world.step(1 / 60)
pv.save(world, path)
old = world.state_hash()
world.step(1 / 60)
new = world.state_hash()
files = {archive.__file__, atomic_file.__file__, snapshot.__file__}
seen, lines, done = [], 0, False
while not done:
    child = os.fork()
    if child == 0:
        left = lines
        def trace(frame, event, argument):
            global left
            if frame.f_code.co_filename not in files:
                return None
            if event == "line":
                left -= 1
                if left < 0:
                    os.kill(os.getpid(), signal.SIGKILL)
            return trace
        sys.settrace(trace)
        pv.save(world, path)
        sys.settrace(None)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    done = os.WIFEXITED(status)
    assert done or os.WTERMSIG(status) == signal.SIGKILL, status
    seen.append(pv.load(path).state_hash())
    assert seen[-1] in (old, new), lines
    lines += 7
assert seen[-1] == new
print(lines, seen.count(old), seen.count(new))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="forks")
def test_killed_in_any_step_of_saving_leaves_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a.pvsnap"
    run = python("-c", KILLED, str(path))
    assert run.returncode == 0, run.stderr
    lines, old, _ = map(int, run.stdout.split())
    assert lines > 100
    assert old > 10
    assert len(list(tmp_path.iterdir())) > 1  # what those that were killed had begun


def test_a_world_without_particles_goes_into_a_file_and_back(tmp_path: Path) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (4, 4)))
    world.obstacles.append(pv.Disc((1, 1), 0.5))
    world.run(seconds=0.1, dt=1 / 60)
    back = from_file(world, tmp_path)
    assert (len(back), len(back.obstacles), back.state_hash()) == (0, 1, world.state_hash())


@pytest.mark.skipif(sys.platform == "win32", reason="permissions, links and pipes")
def test_what_stands_at_the_path_is_replaced_only_if_it_is_a_file(tmp_path: Path) -> None:
    world, real, link = pv.World(), tmp_path / "folder" / "real.pvsnap", tmp_path / "link.pvsnap"
    real.parent.mkdir()
    link.symlink_to(real)
    for time, mode in ((1.0, 0o640), (2.0, 0o600)):  # first where the link leads to nothing
        world.time = time
        pv.save(world, link)
        assert link.is_symlink()
        assert pv.load(real).time == time
        real.chmod(mode)
        pv.save(world, real)
        assert real.stat().st_mode & 0o777 == mode
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "pipe link").symlink_to(tmp_path / "pipe")
    for name in ("pipe", "pipe link", "folder"):
        refused("is no plain file; allowed is a new name", pv.save, world, tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert len(list(tmp_path.rglob("*"))) == 5
