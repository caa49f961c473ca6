"""Trajectories: what other programs read of them, that every bit comes back, and that a killed program leaves them whole."""

import json
import sys
from pathlib import Path
from typing import Any

import ase.io
import gsd.hoomd
import h5py
import numpy as np
import pytest
from tests.programs import Program, python
from tests.worlds import bits_after, refused

import pyverlet as pv
from pyverlet.cli import main
from pyverlet.data.trajectory import FORMATS

SUFFIXES = [".gsd", ".xyz", ".vtkhdf"]


def changing(dtype: Any = np.float32) -> pv.World:
    """Circles of many sizes that rub, so that they spin, with a rope among them."""
    world = pv.World(boundary=pv.Box((-3, 0), (3, 8)), collisions=pv.Collisions(friction=0.5), dtype=dtype)
    world.add(
        position=[(-2, 1), (0, 1), (2, 1)], velocity=[(3, 0), (0, 0), (-3, 0)], radius=[0.3, 0.5, 0.7],
        mass=[1, np.inf, 3], spin=2,
    )  # fmt: skip
    pv.rope(world, (-2, 5), (2, 5), links=4, radius=0.1)
    return world


def kept(path: Path, dtype: Any = np.float32) -> list[dict[str, Any]]:
    """Write a trajectory in which circles come and go; what the world had at each moment."""
    world, had = changing(dtype), []
    with pv.Trajectory(path) as film:
        for frame in range(10):
            if frame == 4:
                world.add(position=(0, 7), radius=0.2)
            if frame == 7:
                world.remove([0, 2])
            film.add(world)
            names = ("position", "velocity", "spin", "radius", "mass", "number")
            had.append(
                {name: np.array(getattr(world, name)) for name in names} | {"hash": world.state_hash(), "time": world.time}
            )
            world.step(1 / 60)
    assert film.frames == 10
    return had


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_bit_comes_back(tmp_path: Path, suffix: str, dtype: Any) -> None:
    had = kept(tmp_path / f"a{suffix}", dtype)
    with pv.read_trajectory(tmp_path / f"a{suffix}") as film:
        assert len(film) == 10
        assert film.state_hash == [moment["hash"] for moment in had]
        assert film.time.tolist() == [moment["time"] for moment in had]
        assert film.particles.tolist() == [len(moment["radius"]) for moment in had]
        for frame, moment in zip(film, had, strict=True):
            for name in ("position", "velocity", "spin", "radius", "mass", "number"):
                # Text reads back as float64; rounded to the world's own precision it is what it was.
                assert np.array_equal(getattr(frame, name).astype(moment[name].dtype), moment[name]), name
        assert np.any(film[3].spin)
        refused("particles came or went before frame 4", getattr, film, "position")


def test_gsd_as_its_own_library_reads_it(tmp_path: Path) -> None:
    had = kept(tmp_path / "a.gsd")
    with gsd.hoomd.open(str(tmp_path / "a.gsd"), "r") as file:
        assert len(file) == 10
        for frame, moment in zip(file, had, strict=True):
            assert frame.configuration.dimensions == 2
            assert np.array_equal(frame.particles.position[:, :2], moment["position"])
            assert np.array_equal(frame.particles.diameter, 2 * moment["radius"])
            assert np.array_equal(frame.particles.velocity[:, :2], moment["velocity"])
            assert frame.log["state_hash"] == moment["hash"]
            assert frame.log["time"] == moment["time"]
            # Nobody is outside the box, whose middle is the origin of the format.
            assert np.all(np.abs(frame.particles.position) <= np.array(frame.configuration.box[:3]) / 2)
        assert file[0].bonds.N == 4


def test_xyz_as_ase_reads_it(tmp_path: Path) -> None:
    had = kept(tmp_path / "a.xyz")
    frames = ase.io.read(tmp_path / "a.xyz", index=":", format="extxyz")
    for frame, moment in zip(frames, had, strict=True):
        # ASE keeps doubles, the text has the 9 digits that tell all float32 apart.
        assert frame.positions[:, :2] == pytest.approx(moment["position"], rel=1e-8)
        assert frame.arrays["radius"] == pytest.approx(moment["radius"], rel=1e-8)
        assert frame.info["state_hash"] == moment["hash"]
        assert frame.info["Time"] == moment["time"]


def test_vtkhdf_has_what_the_format_asks_for(tmp_path: Path) -> None:
    had = kept(tmp_path / "a.vtkhdf")
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        root = file["VTKHDF"]
        assert (root.attrs["Type"], root["Steps"].attrs["NSteps"]) == (b"PolyData", 10)
        for k, moment in enumerate(had):
            steps = {
                name: root["Steps"][name][k] for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets")
            }
            part, first, cell = steps["PartOffsets"], steps["PointOffsets"], steps["CellOffsets"][0]
            count = root["NumberOfPoints"][part]
            assert np.array_equal(root["Points"][first : first + count, :2], moment["position"])
            # Each part has one offset more than cells: those of part p begin p further on.
            offsets = root["Vertices/Offsets"][cell + part : cell + part + count + 1]
            assert offsets.tolist() == list(range(count + 1))
            vertices = root["Vertices/Connectivity"][steps["ConnectivityIdOffsets"][0] :][:count]
            assert vertices.tolist() == list(range(count))


def test_paraview_and_ovito_open_them(tmp_path: Path) -> None:
    for suffix in SUFFIXES:
        kept(tmp_path / f"a{suffix}")
    program = """if True:
        import json, sys
        found = {}
        from vtkmodules.vtkIOHDF import vtkHDFReader
        reader = vtkHDFReader()
        reader.SetFileName(sys.argv[1] + "/a.vtkhdf")
        reader.UpdateInformation()
        def points(step):
            reader.SetStep(step)
            reader.Update()
            found = reader.GetOutputDataObject(0)
            return [found.GetNumberOfPoints(), found.GetNumberOfVerts(), found.GetPointData().GetArray("radius").GetValue(1)]
        found[".vtkhdf"] = [points(step) for step in range(reader.GetNumberOfSteps())]
        from ovito.io import import_file
        for suffix in (".gsd", ".xyz"):
            film = import_file(sys.argv[1] + "/a" + suffix)
            frames = [film.compute(k) for k in range(film.source.num_frames)]
            found[suffix] = [
                [f.particles.count, float(f.particles["Radius"][1]), str(f.attributes["state_hash"])] for f in frames
            ]
        print(json.dumps(found))
    """
    pytest.importorskip("vtkmodules")
    pytest.importorskip("ovito")
    found = json.loads(python("-c", program, str(tmp_path), check=True).stdout)
    hashes = pv.read_trajectory(tmp_path / "a.gsd").state_hash
    counts = [8] * 4 + [9] * 3 + [7] * 3
    assert [row[0] for row in found[".vtkhdf"]] == [row[1] for row in found[".vtkhdf"]] == counts
    assert [row[2] for row in found[".vtkhdf"]] == pytest.approx([0.5] * 7 + [0.1] * 3)
    for suffix in (".gsd", ".xyz"):
        assert [row[0] for row in found[suffix]] == counts
        assert [row[1] for row in found[suffix]] == pytest.approx([0.5] * 7 + [0.1] * 3)
        assert [row[2] for row in found[suffix]] == hashes


ENDLESS = """
import itertools, sys
import pyverlet as pv
films = [pv.Trajectory(sys.argv[1] + "/a" + suffix) for suffix in sys.argv[2:]]
world = pv.World(gravity=(0, 0))
world.add(position=[(2.0 * k, 0.0) for k in range(100)], velocity=(1, 2))
for count in itertools.count(1):
    for film in films:
        film.add(world)
    print(count, flush=True)
    world.time += 1
    world.position[0, 1] += 1
"""


def test_killed_at_any_moment_what_was_added_is_there(tmp_path: Path) -> None:
    with Program("-c", ENDLESS, str(tmp_path), *SUFFIXES) as program:
        last = [program.line() for _ in range(20)][-1]
        program.process.kill()
        out, err = program.process.communicate()
    said = int((out.split() or [last])[-1])
    assert "Traceback" not in err
    assert said >= 20
    for suffix in SUFFIXES:
        with pv.read_trajectory(tmp_path / f"a{suffix}") as film:
            assert len(film) >= said
            assert film.time.tolist() == list(range(len(film)))
            assert film.position[:, 0, 1].tolist() == list(range(len(film)))


def test_run_keeps_every_so_many_frames_and_the_first(tmp_path: Path) -> None:
    world = changing()
    with pv.Trajectory(tmp_path / "a.gsd", every=5) as film:
        film.run(world, seconds=0.5)
        film.run(world, seconds=0.5)
    again = changing()
    with pv.read_trajectory(tmp_path / "a.gsd") as moments:
        assert moments.time == pytest.approx(np.arange(13) / 12)
        assert moments[-1].state_hash == bits_after(again, 1.0) == world.state_hash()
        assert moments.position.shape == (13, 8, 2)
        assert moments.mass.shape == moments.radius.shape == moments.spin.shape == (13, 8)
        assert len(moments[2:4]) == 2


def test_a_world_that_breaks_leaves_what_was_before(tmp_path: Path) -> None:
    world = changing()

    with pytest.raises(ZeroDivisionError), pv.Trajectory(tmp_path / "a.xyz") as film:  # noqa: PT012
        film.run(world, seconds=0.1)
        _ = 1 / 0
    assert len(pv.read_trajectory(tmp_path / "a.xyz")) == 7
    with (tmp_path / "a.xyz").open("ab") as file:
        file.write(b'3\nLattice="1 0 0 0 1 0 0 0 1" Prop')  # cut while it was written
    assert len(pv.read_trajectory(tmp_path / "a.xyz")) == 7


def test_an_empty_world_and_one_without_walls(tmp_path: Path) -> None:
    for suffix in SUFFIXES:
        world = pv.World()
        with pv.Trajectory(tmp_path / f"a{suffix}") as film:
            film.add(world)
            world.add(position=(100.0, -1000.0))
            film.add(world)
        assert pv.read_trajectory(tmp_path / f"a{suffix}").particles.tolist() == [0, 1]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_frame_without_particles_has_none_of_the_first(tmp_path: Path, suffix: str, dtype: Any) -> None:
    world = pv.World(dtype=dtype, gravity=(0, 0))
    rope = pv.rope(world, (0, 0), (2, 0), links=1).group
    rope.spin = 7
    with pv.Trajectory(tmp_path / f"a{suffix}") as film:
        film.add(world)
        rope.remove()
        film.add(world)
        world.add(position=[(5, 5), (8, 8)], radius=0.25)
        film.add(world)
    frames = pv.read_trajectory(tmp_path / f"a{suffix}")
    for name in ("position", "velocity", "spin", "radius", "mass", "number"):
        assert len(getattr(frames[1], name)) == 0
        assert len(getattr(frames[0], name)) == len(getattr(frames[2], name)) == 2
    assert frames[2].radius.tolist() == [0.25, 0.25]


FULL = """
import resource, sys
import pyverlet as pv
path, most = sys.argv[1], int(sys.argv[2])
world = pv.World(gravity=(0, 0))
world.add(position=[(2.0 * k, 0.0) for k in range(300)])
resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
try:
    with pv.Trajectory(path) as film:
        while True:
            film.add(world)
            world.time += 1
            world.position += 0.01
except pv.PyverletError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of the size of files")
@pytest.mark.parametrize("most", [100, 5_000, 40_000, 300_000])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_full_disk_is_told_in_a_sentence_and_keeps_what_was_there(tmp_path: Path, suffix: str, most: int) -> None:
    path = tmp_path / f"a{suffix}"
    run = python("-c", FULL, str(path), str(most))
    assert (run.returncode, run.stderr) == (0, "")
    assert "File too large" in run.stdout
    if "it holds" in run.stdout:
        frames = int(run.stdout.split()[-2])
        assert frames > 0 or most < 300_000
        if frames:
            assert pv.read_trajectory(path).time.tolist() == list(range(frames))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.csv", "allowed for a trajectory is a name that ends in .gsd"), ("none/a.gsd", "cannot be written"),
        ("none/a.xyz", "cannot be written"), ("none/a.vtkhdf", "cannot be written"),
    ],
)  # fmt: skip
def test_bad_names_are_told_in_a_sentence(tmp_path: Path, name: str, said: str) -> None:
    refused(said, pv.Trajectory, tmp_path / name)


@pytest.mark.parametrize("suffix", [*FORMATS])
def test_files_of_another_kind_are_told_in_a_sentence(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"no trajectory at all" * 50)
    for name in (f"a{suffix}", f"none{suffix}"):
        refused("cannot be read as a trajectory", pv.read_trajectory, tmp_path / name)


def test_a_closed_one_and_bad_numbers_are_refused(tmp_path: Path) -> None:
    with pv.Trajectory(tmp_path / "a.gsd") as film:
        refused("seconds is -1", film.run, changing(), seconds=-1)
        refused("dt is 0", film.run, changing(), seconds=1, dt=0)
    refused("is closed", film.add, changing())
    refused("every is 0", pv.Trajectory, tmp_path / "a.gsd", every=0)


def test_run_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], refusal: Any) -> None:
    path = tmp_path / "a.gsd"
    run = ["run", "cage", "--particles", "50", "--frames", "10", "--json", "--trajectory", str(path)]
    assert main([*run, "--every", "5"]) == 0
    with pv.read_trajectory(path) as film:
        assert film.time == pytest.approx([0, 5 / 60, 10 / 60])
        assert film[-1].state_hash == json.loads(capsys.readouterr().out)["state_hash"]
    assert "every is 5; allowed is none without --trajectory" in refusal("run", "cage", "--every", "5", "--frames", "1")
    assert "worlds side by side" in refusal("run", "bounce-order", "--frames", "1", "--trajectory", str(path))
