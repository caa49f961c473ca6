"""The compiled core: how its modules are joined, that all variants and the reference agree, and what a damaged one says."""

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.programs import python
from tests.uncompiled import UNCOMPILED

from pyverlet import core
from pyverlet.core import joining
from pyverlet.ground.errors import CoreError

LOW = "from pyverlet.core.low import"
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


def results(unit_of: Any, dtype: Any) -> list[Any]:
    """What kernels of all kinds make of the same input: numbers, and bytes of arrays."""
    engine, tools = unit_of("engine", dtype), unit_of("tools", dtype)
    position, velocity, spin, radius, mass = heap(dtype)
    bits = np.full(60, 3, np.uint32)
    ground = np.arange(40 * 60, dtype=np.uint32).reshape(40, 60)
    pixels, colour = ground.copy(), np.arange(60, dtype=np.uint32) * 0x10203
    tools.draw_discs(pixels, ground, position, radius, colour, -3.0, 2.0, 10.0)
    tools.draw_lines(pixels, position.reshape(30, 2, 2), colour[:30], -3.0, 2.0, 10.0, 0.8)
    cells = (-20.0, -20.0, 40.0, 1, 1, np.array([0, 60], np.int32), np.arange(60, dtype=np.int32))
    nearest, square = np.full((5, 3), -1), np.full((5, 3), np.inf)
    points, heading = np.ascontiguousarray(position[:5], float), np.tile([0.6, 0.8], (5, 1))
    tools.nearest_to(points, cells, position, nearest, square)
    segments = np.tile([0.0, 0.0, 0.6, 0.8, 2.0, 0.5, 0.0, 0.0, 0.0, 0.0, 3.0, 6.0], (6, 1))
    segments[:, :2], segments[:, 7] = np.arange(12).reshape(6, 2) % 5, np.arange(6)
    heads, links = np.empty(64, np.int32), np.zeros((999, 2), np.int32)
    where, row, gap, normal = position.astype(float), np.zeros((3, 240), np.int64), np.zeros(240), np.zeros((240, 2))
    used = tools.list_segments(segments, 1.0, 1.0, heads, links)
    about, few = (segments, 6, 1.0, heads, links, where, np.full(60, 0.3)), (*row[:2], gap, normal, row[2])
    touched = [tools.segments_near(*about, of, *few) for of in (np.arange(60) % 7, row[0, :0].copy())]
    begin, member, size = np.empty(42 * 42 + 2, np.int32), np.empty(9999, np.int32), np.array([0.0, 0.1, 0.3, 0.0, 0.2])
    listed = tools.list_discs(position, radius, 0.3, -21.0, -21.0, 1.0, 42, 42, begin, member)
    cells_of_discs, both = (-21.0, -21.0, 1.0, 42, 42, begin, member), (bits, bits)
    rays = points + 2.0, heading, np.full(1, 9.0), size, bits, bits[:1]
    box, cage = (0, 4, np.array([-9.0, -8.0, 9.0, np.inf]), 5, 6), (4, 5, np.array([0.0, 0.0, 8.0]), 5, 6)
    hits = [*np.empty((3, 5), np.int64), np.empty(5), np.empty((5, 2)), np.empty((5, 2))]
    casts = [
        array.copy() for array in (tools.cast(rays, None, None, cage, (0.0, 0.0, 3.0, 0.0), 1, *hits), *hits) if array is not None
    ]
    extent = np.array([-1.0, -1.0, 6.0, 7.0])
    tools.cast(
        rays, (*cells_of_discs, position, radius, *both), (segments, 1.0, heads, links, extent, 6), box,
        (0.0, 0.0, 0.0, 0.0), 1, *hits,
    )  # fmt: skip
    absent = np.empty(60, bool)
    sums, some = np.empty(9, np.uint64), np.arange(9, dtype=np.uint8) % 2
    tools.checksums(np.arange(9000, dtype=np.uint64) << np.uint64(40), 1024, sums, some[:0], 0, 1)
    tools.checksums(np.arange(8999, dtype=np.uint32), 1024, sums, some, 0, 1)
    tools.mark_absent(np.arange(0, 180, 3), np.arange(0, 180, 2), absent)
    arrays = (
        absent, pixels, *casts, *hits, begin, member[:listed], nearest, square, heads, links[:used], row,
        gap, normal,
    )  # fmt: skip
    return [
        *engine.energies(position, velocity, spin, radius, mass, 0.5, -9.81),
        *engine.momenta(position, velocity, spin, radius, mass),
        engine.pinned_move(mass, velocity, spin),
        touched, sums.tobytes(),
        *(array.tobytes() for array in arrays),
    ]  # fmt: skip


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
def test_uncompiled_and_compiled_kernels_have_the_same_bits(dtype: Any) -> None:
    with np.errstate(over="ignore"):
        assert results(UNCOMPILED, dtype) == results(core.unit, dtype)


@pytest.mark.skipif(len(core.variants()) < 2, reason="the core was built for this processor only")
@PRECISIONS
def test_all_variants_have_the_same_bits(dtype: Any) -> None:
    bits = 8 * np.dtype(dtype).itemsize
    found = [results(lambda name, _, of=each: core._load(of, f"{name}_f{bits}"), dtype) for each in core.variants()]
    assert all(each == found[0] for each in found)


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
