"""The house: each module imports only from lower layers, kernels from next to nothing, and `import pyverlet` stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import pyverlet

ROOT = Path(pyverlet.__file__).parent

# From the ground up. A module may import from its own layer only within its own package (the first part of its name).
LAYERS = (
    {
        "_loading",
        "errors",
        "constants",
        "_entry",
        "_jit",
        "_claims",
        "_lanes",
        "_lean",
        "_memory",
        "_native",
        "_stopwatch",
        "_turns",
        "_trace",
        "checks",
        "progress",
    },
    {"unchanged", "state", "group", "moves", "kernels"},
    {
        "integrators",
        "forces",
        "bounds",
        "obstacles",
        "naive",
        "grids",
        "broadphase",
        "events",
        "loans",
        "packs",
        "sleep",
        "slips",
        "collisions",
        "energy",
        "ledger",
        "growth",
        "links",
        "passivity",
    },
    {
        "world",
        "actors",
        "particles",
        "measures",
        "queries",
        "moments",
        "repeats",
        "fused",
        "saved",
        "doors",
        "profile",
        "clock",
        "warmup",
        "rehearsals",
        "panels",
        "builders",
    },
    {"scenes", "report", "lab", "picture"},
    {"viewers", "record", "draw"},
    {"cli"},
)
# Steps within a layer: module -> what it may use beside it.
BESIDE = {
    "checks": {"errors"},
    "_jit": {"_entry", "_lean", "_turns"},
    "_claims": {"_jit"},
    "_stopwatch": {"_entry", "_jit"},
    "_trace": {"_entry", "_jit"},
    "unchanged": {"kernels"},
    "state": {"kernels", "unchanged"},
    "group": {"state"},
    "moves": {"state", "kernels"},
    "broadphase": {"grids"},
    "collisions": {"broadphase", "events", "growth", "loans", "packs", "sleep", "slips"},
    "slips": {"broadphase"},
    "sleep": {"broadphase", "forces"},
    "loans": {"broadphase"},
    "packs": {"broadphase"},
    "events": {"broadphase"},
    "ledger": {"forces", "links"},
    "energy": {"forces"},
    "growth": {"broadphase"},
    "naive": {"bounds"},
    "passivity": {"bounds", "forces", "links"},
    "links": {"broadphase"},
    "fused": {"repeats"},
    "world": {"fused", "profile", "doors", "measures", "moments", "actors", "queries", "repeats", "saved", "sleep"},
    "saved": {"actors"},
    "measures": {"particles"},
    "actors": {"world"},
    "doors": {"world"},
    "warmup": {"world", "rehearsals"},
    "rehearsals": {"world"},
    "panels": {"world", "saved"},
    "builders": {"world"},
    "report": {"scenes"},
    "lab": {"scenes"},
    "record": {"viewers"},
    "draw": {"viewers"},
}
# Doors up the house, for convenience: methods of one line that load what they name only when called.
DOORS = {"doors": {"record"}}


MODULE_NAMES = set().union(*LAYERS)


def layer(module: str) -> int:
    (found,) = [k for k, names in enumerate(LAYERS) if module in names]
    return found


def imported(path: Path) -> set[str]:
    """First parts, below pyverlet, of every module this file imports, wherever in the file it does so."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "pyverlet":
            parts = node.module.split(".")
            names |= {parts[1]} if len(parts) > 1 else {alias.name for alias in node.names} & MODULE_NAMES
        elif isinstance(node, ast.Import):
            names |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("pyverlet.")}
    return names


MODULES = sorted(path for path in ROOT.rglob("*.py") if path.relative_to(ROOT).as_posix() not in ("__init__.py", "__main__.py"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_layers_look_down(path: Path) -> None:
    own = path.relative_to(ROOT).parts[0].removesuffix(".py")
    for name in imported(path) - {own}:
        allowed = layer(name) < layer(own) or name in BESIDE.get(own, set()) | DOORS.get(own, set())
        assert allowed, f"{own} imports {name}, which is not below it"


@pytest.mark.parametrize("path", sorted((ROOT / "kernels").glob("*.py")), ids=lambda path: path.stem)
def test_kernels_stand_on_the_compiler_alone(path: Path) -> None:
    # The cache of compiled kernels is keyed by these sources; one more import and it would miss edits.
    assert imported(path) <= {"_jit", "_claims", "_lanes", "constants", "kernels"}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_few_places_compile(path: Path) -> None:
    compiles = path.name in ("_jit.py", "_entry.py", "_trace.py", "_native.py")
    assert ("import numba" in path.read_text(encoding="utf-8")) == compiles


def test_doors_open_only_when_called() -> None:
    for module, names in DOORS.items():
        top = ast.parse((ROOT / f"{module}.py").read_text(encoding="utf-8")).body
        loaded = {node.module for node in top if isinstance(node, ast.ImportFrom)}
        assert loaded.isdisjoint(f"pyverlet.{name}" for name in names)


def test_import_is_light() -> None:
    # Numba brings SciPy along where it is installed: what counts is what pyverlet adds to NumPy and Numba.
    code = (
        "import sys, numpy, numba; before = set(sys.modules); import pyverlet\n"
        "print(' '.join({name.split('.')[0] for name in set(sys.modules) - before}))"
    )
    added = set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())
    assert "pyverlet" in added
    third_party = {
        name for name in added - {"pyverlet", "numpy", "numba", "llvmlite", "scipy"} if name not in sys.stdlib_module_names
    }
    assert third_party == set()


def test_files_hold_one_idea() -> None:
    long = {path.name for path in ROOT.rglob("*.*") if path.suffix in {".py", ".js"} and len(path.read_text().splitlines()) > 400}
    assert long == set()


def test_world_step_fits_on_a_screen() -> None:
    tree = ast.parse((ROOT / "world.py").read_text(encoding="utf-8"))
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    first, last = functions["step"].lineno, functions["_frame"].end_lineno
    assert last is not None
    assert last - first < 60
