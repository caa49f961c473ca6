"""The compiled core: how its modules are joined, that all variants and the reference agree, and what a damaged one says."""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.programs import python
from tests.uncompiled import UNCOMPILED
from tests.worlds import RECORDING, WORLDS, each_frame, grid, noted, of_ones_own

import pyverlet as pv
from pyverlet import core
from pyverlet.common.errors import CoreError
from pyverlet.core import joining
from pyverlet.viewers.frames import quantise

LOW = "from pyverlet.core.low import"
LOAD = core._load
PRECISIONS = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def modules(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    return folder


def test_modules_are_joined_after_what_they_import(tmp_path: Path) -> None:
    sibling = "from pyverlet.core."
    folder = modules(
        tmp_path,
        top=f"from __future__ import annotations\n{LOW} (\n    g,\n)\n{sibling}middle import f\ndef h(): return f() + g()\n",
        middle=f"{sibling}low import g\ndef f(): return 2 * g()\n",
        low="import math\ndef g(): return math.floor(1.5)\n",
    )
    text, origins = joining.joined("top", folder)
    assert list(dict.fromkeys(path.stem for path, _ in origins)) == ["low", "middle", "top"]
    assert "pyverlet.core" not in text
    names: dict[str, Any] = {}
    exec(text, names)
    assert names["h"]() == 3
    for (path, number), line in zip(origins, text.split("\n")[1:], strict=False):  # where messages of the compiler point to
        assert line in ("", path.read_text().split("\n")[number - 1])


@pytest.mark.parametrize(
    ("texts", "sentence"),
    [
        ({"top": f"{LOW} f\ndef f(): pass\n", "low": "def f(): pass\n"}, "f is defined in low.py and in top.py"),
        ({"top": f"{LOW} f as g\n", "low": "def f(): pass\n"}, "f is imported under another name"),
        ({"top": f"{LOW} f\n", "low": "from pyverlet.core.top import g\n"}, "top imports low imports top"),
    ],
)
def test_modules_that_cannot_be_joined_are_told_of(tmp_path: Path, texts: dict[str, str], sentence: str) -> None:
    with pytest.raises(joining.JoinError, match=sentence):
        joining.joined("top", modules(tmp_path, **texts))


def heap(dtype: Any) -> tuple[Any, ...]:
    """position, velocity, spin, radius, mass of some particles, one of them pinned."""
    rng = np.random.default_rng(1)
    position, velocity = rng.normal(0, 3, (2, 60, 2)).astype(dtype)
    spin, radius, mass = rng.uniform(0.2, 1, (3, 60)).astype(dtype)
    mass[7] = np.inf
    return position, velocity, spin, radius, mass


def whirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return mass * vy, 0.3 * x - mass * vx


def pushed(**options: Any) -> pv.World:
    """Particles on which forces of all kinds act, some of them at one place, two pinned, and a pool of a fluid."""
    chance = np.random.default_rng(2)
    world = pv.World(**{"integrator": pv.RK4(), **options}, collisions=None, substeps=2)
    place = chance.normal(0, 2, (40, 2))
    place[9:15] = place[0]
    stars = world.add(position=place, radius=0.02, mass=chance.uniform(1, 3, 40))
    stars.pin([3, 17])
    drops = world.add(position=grid(5, 4, 0.1, (0, 4), loose=0), radius=0.05, mass=10.0)
    world.obstacles += [pv.Segment((-3, 3.95), (3, 3.95)), pv.Disc((0.6, 4.2), 0.2)]
    world.forces += [
        pv.Gravitation(stars, strength=0.7, softening=0.1), pv.Attractor(strength=3.3, softening=0.2), pv.force(whirl),
        pv.PointSpring(stiffness=2.0), pv.Wind((1, 0.5), linear=0.3, quadratic=0.4), pv.Drag(linear=900.0),
        pv.SoftRepulsion(strength=0.3, range=0.8), pv.Cohesion(strength=5.0, break_distance=0.1),
        pv.Langevin(temperature=1.0, friction=1.0, seed=3),
        pv.Fluid(drops, rest_density=1000.0, stiffness=80.0, viscosity=0.05),
    ]  # fmt: skip
    return world


def crushed(**options: Any) -> pv.World:
    """Discs on top of each other, two of them linked, of whose energy a part is taken back."""
    world = pv.World(boundary=pv.Circle(radius=2), **options)
    discs = world.add(position=np.random.default_rng(1).uniform(-1, 1, (30, 2)), radius=0.4)
    world.links.append(pv.Stick(discs, 0, 1))
    return world


def confined(room: pv.Boundary, **options: Any) -> pv.World:
    """Fast rough discs in a room of a user's own."""
    world, chance = pv.World(boundary=of_ones_own(room), **options), np.random.default_rng(1)
    place, velocity = 0.6 * chance.normal(size=(21, 2)), 5 * chance.normal(size=(21, 2))
    world.add(position=place, velocity=velocity, radius=0.1, spin=3.0, on_overlap="push")
    return world


def watched(**options: Any) -> pv.World:
    """Discs of two sizes that obstacles hold, let through or watch."""
    world = WORLDS["gated"](**options)
    place = np.random.default_rng(1).uniform(-1.9, 1.9, (40, 2))
    group = world.add(position=place, radius=0.05, spin=3.0, on_overlap="push")
    world.links.append(pv.Stick(group, 0, 1))
    return world


ROUGH: dict[str, Any] = {"restitution": 0.3, "friction": 0.5}
CHANNEL = pv.Periodic((-2, -2), (2, 2), axes="x", mask=5)
THROWN: dict[str, dict[str, Any]] = {
    "thrown": {}, "thrown, springy": {"restitution": 0.3}, "thrown, smooth": {"friction": 0.0},
    "thrown, elastic": {"gravity": (0, 0), "restitution": 1.0, "friction": 0.0},
}  # fmt: skip
SMALL: dict[str, tuple[Callable[..., pv.World], int]] = {
    "watched": (watched, 2), "pushed": (pushed, 2), "crushed": (crushed, 2),
    "pushed, as Verlet has it": (partial(pushed, integrator=pv.VelocityVerlet()), 2),
    "box": (partial(confined, pv.Box((-0.7, -0.8), (0.9, 1.0), **ROUGH)), 2),
    "drum": (partial(confined, pv.Circle(center=(0.1, 0.2), radius=0.9, angular_velocity=2.0, **ROUGH)), 2),
    **{name: (partial(WORLDS[name], substeps=4), 3) for name in ("linked", "driven", "sieve", "by_pairs")},
    **{name: (partial(WORLDS["thrown"], substeps=4, **how), 15) for name, how in THROWN.items()},
    "gated": (partial(WORLDS["gated"], substeps=2), 6), "channel": (partial(WORLDS["gated"], substeps=2, boundary=CHANNEL), 6),
    "sleepers": (partial(WORLDS["sleepers"], substeps=2), 12), "bouncing": (partial(WORLDS["bouncing"], substeps=2), 18),
    "smooth sleepers": (partial(WORLDS["sleepers"], substeps=2, friction=0.0), 12),
}  # fmt: skip
"""Worlds, and how many frames they take for what they are there for."""


def answers(world: pv.World) -> Iterator[Any]:
    """To questions of all kinds; the last is a picture."""
    at, way = np.random.default_rng(1).normal(0, 1.5, (2, 50, 2))
    tools, sums, rows = core.unit("tools"), np.empty(9, np.uint64), np.empty((9, 2), np.float32)
    tools.checksums(np.arange(9000, dtype=np.uint64) << np.uint64(40), 1024, sums, np.empty(0, np.uint8), 0, 1)
    tools.put_rows(rows, at[:9].astype(np.float32), np.arange(9, dtype=np.int32)[::-1].copy())
    yield from (sums, rows, quantise(at.astype(np.float32), (-1.0, -1.0, 1.0, 1.0)), *world.ray(at, way))
    yield from (*world.circle_cast(at, way, 0.1), *world.nearest(at[:5], 3), world.at_point(at), world.is_free(at, 0.1))
    yield from (world.in_circle(at[0], 1.0), world.overlap(), world.momentum(), world.to_image(size=(64, 48)))


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., list[Any]]]:
    """What a small world comes to with units loaded so: all it says after each frame, what is seen of it, and its last error."""
    monkeypatch.setattr("pyverlet.laws.forces.pair_laws.FEW", 20)  # more are summed by a tree

    def of(load: Callable[[str], Any], name: str, dtype: Any) -> list[Any]:
        monkeypatch.setattr(core, "_load", lambda _, unit: load(unit))
        core.unit.cache_clear()
        make, frames = SMALL[name]
        world, seen = make(dtype=dtype, **RECORDING), list[Any]()
        if name == "watched":
            world.observer = lambda moment: seen.extend(moment.look())
        found: list[Any] = [noted(world) for _ in each_frame(world, frames)]
        world.remove(len(world) - 1)
        found += [np.asarray(each).tobytes() for each in (*seen, *(answers(world) if seen else ()))]
        world.obstacles.clear()
        world.position[1] = np.nan
        with pytest.raises(pv.NonFiniteError) as error:
            world.step(1 / 60)
        return [*found, str(error.value)]

    yield of
    core.unit.cache_clear()


def uncompiled(name: str) -> Any:
    unit, _, bits = name.rpartition("_f")
    return UNCOMPILED(unit, np.dtype(f"f{int(bits) // 8}"))


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        *((name, np.float32) for name in SMALL),
        *(pytest.param(name, np.float64, marks=pytest.mark.slow) for name in SMALL),
    ],
)
def test_uncompiled_and_compiled_kernels_have_the_same_bits(name: str, dtype: Any, results: Any) -> None:
    with np.errstate(all="ignore"):
        assert results(uncompiled, name, dtype) == results(partial(LOAD, core.variant()), name, dtype)


@pytest.mark.skipif(len(core.variants()) < 2, reason="the core was built for this processor only")
@PRECISIONS
@pytest.mark.parametrize("name", SMALL)
def test_all_variants_have_the_same_bits(name: str, dtype: Any, results: Any) -> None:
    found = [results(partial(LOAD, variant), name, dtype) for variant in core.variants()]
    assert all(each == found[0] for each in found)


class Called:
    """A unit that notes which of its kernels are called."""

    def __init__(self, unit: Any, kernels: set[str]) -> None:
        self.unit, self.kernels = unit, kernels

    def __getattr__(self, name: str) -> Any:
        self.kernels.add(name)
        return getattr(self.unit, name)


def test_all_kernels_are_compared(results: Any) -> None:
    elsewhere = {"settle", "add_compiled", "compiled_values"}  # the last two call code that Numba makes: test_native_force
    called = set[str]()
    for name in SMALL:
        results(lambda unit: Called(LOAD(core.variant(), unit), called), name, np.float32)
    assert {*LOAD(core.variant(), "tools_f32").__all__, *LOAD(core.variant(), "motion_f32").__all__} - called == elsewhere


def test_arrays_of_another_kind_are_refused() -> None:
    position, velocity, spin, radius, mass = heap(np.float32)
    energies = core.unit("engine").energies
    with pytest.raises(TypeError, match="items d of 8 bytes; allowed is float32"):
        energies(position.astype(float), velocity, spin, radius, mass, 0.0, 0.0)
    with pytest.raises(ValueError, match="not C-contiguous"):
        energies(position[:, ::-1], velocity, spin, radius, mass, 0.0, 0.0)
    pixels = np.zeros((4, 4), np.uint32)
    pixels.flags.writeable = False
    with pytest.raises(ValueError, match=r"read-only|not writable"):
        core.unit("tools").tint(pixels, np.ones((4, 4), np.float32), 5)


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the extension modules, which the core loads from."""
    for name in core.VARIANTS:
        if (core._FOLDER / name).exists():
            shutil.copytree(core._FOLDER / name, tmp_path / name)
    monkeypatch.setattr(core, "_FOLDER", tmp_path)
    return tmp_path


def test_a_damaged_extension_is_one_sentence(broken: Path) -> None:
    path = core._extension(core.variant(), "tools_f32")
    assert path is not None
    content = path.read_bytes()
    for damaged in (b"", b"not a library" * 100, content[: len(content) // 2], content[:-100]):
        path.write_bytes(damaged)
        with pytest.raises(CoreError) as told:
            core._load(core.variant(), "tools_f32")
        assert str(path) in str(told.value)
        assert "install pyverlet again" in str(told.value)
        assert "\n" not in str(told.value)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ELF")
def test_an_extension_for_another_processor_is_one_sentence(broken: Path) -> None:
    path = core._extension(core.variant(), "tools_f32")
    assert path is not None
    content = bytearray(path.read_bytes())
    content[18:20] = (243).to_bytes(2, "little")  # e_machine: RISC-V
    path.write_bytes(content)
    with pytest.raises(CoreError, match="cannot be loaded by Python"):
        core._load(core.variant(), "tools_f32")


def test_extensions_for_another_python_are_one_sentence(broken: Path) -> None:
    for path in (broken / "baseline").iterdir():
        path.rename(path.with_name(f"{path.name.partition('.')[0]}.cpython-399-sparc-linux-gnu.so"))
    with pytest.raises(CoreError, match=r"has no compiled core for Python .*only processor\.cpython-399-sparc-linux-gnu\.so"):
        core._load("baseline", "processor")


def test_the_environment_chooses_the_variant() -> None:
    slowest, allowed = core.variants()[-1], " or ".join(core.variants())
    says, wrong = (python("-m", "pyverlet", "versions", PYVERLET_CORE=chosen) for chosen in (slowest, "fast"))
    assert says.returncode == 0
    assert f"core {slowest}, compiled by " in says.stdout
    assert (wrong.returncode, wrong.stdout) == (1, "")
    assert wrong.stderr == f"pyverlet: PYVERLET_CORE is 'fast'; allowed on this processor is {allowed}\n"


@pytest.mark.skipif(shutil.which("objdump") is None, reason="there is no objdump, as where there is no compiler")
@pytest.mark.parametrize("variant", core.variants())
def test_nothing_is_contracted(variant: str) -> None:
    # a * b + c in one operation is rounded once, not twice: other bits than on processors without. gcc 12 made some of pairs of
    # statements, in spite of -ffp-contract=off.
    for unit in Path(core.__file__).parent.joinpath(variant).glob("*_f*.so"):
        code = subprocess.run(["objdump", "-d", "--no-show-raw-insn", unit], capture_output=True, text=True, check=True).stdout
        assert not re.findall(r"\bvfn?m\w+", code), unit.name
