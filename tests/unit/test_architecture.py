"""Layers: each module imports only from lower layers, and `import pyverlet` stays light."""

import ast
import functools
import os
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from tests.programs import python

import pyverlet
from pyverlet.common.versions import ALLOWED, BELOW, LEAST, complaint

ROOT = Path(pyverlet.__file__).parent

# From the lowest up. A layer may use those below it; within a layer, nothing goes in a circle.
LAYERS = (
    "common", "core", "state", "laws", "world", "scenes", "data", "lab", "picture", "viewers", "record", "draw",
    "cli",
)  # fmt: skip
# Packages of one layer do not know each other, but for these: package -> what it may use beside it.
SAME_LAYER = {"record": {"viewers"}, "draw": {"viewers"}}
# Convenience methods, of one line, that import what they name only when called.
CONVENIENCE = {"world/convenience.py": {"record"}, "scenes/__init__.py": {"data"}, "scenes/_scene.py": {"data"}}

MODULES = sorted(path for path in ROOT.rglob("*.py") if path.relative_to(ROOT).as_posix() not in ("__init__.py", "__main__.py"))


def dotted(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


NAMES = {dotted(path) for path in MODULES}


@functools.cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(path: Path, *, at_once: bool = False) -> set[str]:
    """Modules of pyverlet, by dotted name, that this file imports: anywhere, or only those that load `at_once` with it."""
    names = set()
    for node in parsed(path).body if at_once else ast.walk(parsed(path)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "pyverlet":
            module = node.module.removeprefix("pyverlet").removeprefix(".")
            for alias in node.names:
                name = f"{module}.{alias.name}".removeprefix(".")
                names.add(name if name in NAMES else module)
        elif isinstance(node, ast.Import):
            names |= {alias.name.removeprefix("pyverlet.") for alias in node.names if alias.name.startswith("pyverlet.")}
    return names - {""}


def test_layers_look_down() -> None:
    wrong = []
    for path in MODULES:
        own = path.relative_to(ROOT)
        layer = own.parts[0]
        allowed = {*LAYERS[: LAYERS.index(layer) + 1]} | SAME_LAYER.get(layer, set()) | CONVENIENCE.get(own.as_posix(), set())
        wrong += [f"{own} imports {name}" for name in imported(path) if name.split(".")[0] not in allowed]
    assert wrong == []


def test_nothing_is_imported_in_a_circle() -> None:
    graph = {dotted(path): imported(path, at_once=True) for path in MODULES}
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        assert name not in above, " -> ".join((*above, name))
        if name not in done:
            for below in graph.get(name, ()):
                visit(below, (*above, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def test_convenience_methods_import_only_when_called() -> None:
    for module, names in CONVENIENCE.items():
        assert {name.split(".")[0] for name in imported(ROOT / module, at_once=True)}.isdisjoint(names)


def test_import_is_light() -> None:
    code = (
        "import sys, numpy; before = set(sys.modules); import pyverlet\n"
        "print(' '.join({name.split('.')[0] for name in set(sys.modules) - before}))"
    )
    added = set(python("-c", code, check=True).stdout.split())
    assert "pyverlet" in added
    own = {"pyverlet", "numpy", "cython_runtime"}  # the last: a name in each compiled module
    third_party = {name for name in added - own if name not in sys.stdlib_module_names and not name.startswith("_cython_")}
    assert third_party == set()


def test_files_hold_one_idea() -> None:
    long = {path.name for path in ROOT.rglob("*.*") if path.suffix in {".py", ".js"} and len(path.read_text().splitlines()) > 400}
    assert long == set()


def test_world_step_fits_on_a_screen() -> None:
    tree = parsed(ROOT / "world" / "world.py")
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    first, last = functions["step"].lineno, functions["_accept"].end_lineno
    assert last is not None
    assert last - first < 60


SUBMODULES = ("data", "draw", "lab", "picture", "record", "viewers")


def test_submodules_load_when_they_are_named() -> None:
    code = f"""
import sys
import pyverlet as pv
names = {SUBMODULES}
assert not [name for name in names if f"pyverlet.{{name}}" in sys.modules], "import pyverlet loads them"
assert {{*names}} < {{*dir(pv)}}
assert not [name for name in names if f"pyverlet.{{name}}" in sys.modules], "dir loads them"
assert not hasattr(pv, "drawing") and not hasattr(pv.draw, "pigame")
assert [getattr(pv, name).__name__ for name in names] == [f"pyverlet.{{name}}" for name in names]
assert callable(pv.data.snapshot.save) and callable(pv.lab.order.measure) and pv.viewers.session.Session
assert {{"pygame", "pyglet", "arcade", "fit"}} <= {{*dir(pv.draw)}}
sys.modules["pygame"] = None  # as if it were not installed
try:
    pv.draw.pygame
except AttributeError as error:
    assert "pyverlet.draw.pygame needs 'pygame'" in str(error)
else:
    raise AssertionError("no library, and no error")
del sys.modules["pygame"]
from pyverlet import draw
assert callable(draw.pygame.draw) and draw is pv.draw
"""
    run = python("-c", code)
    assert run.returncode == 0, run.stderr


# ---- Versions of NumPy that are too old or too new are refused in a sentence ----


PROJECT = Path(__file__).parents[2] / "pyproject.toml"


def test_the_package_asks_for_the_same_versions() -> None:
    assert ALLOWED in tomllib.loads(PROJECT.read_text())["project"]["dependencies"]
    least, below = (".".join(map(str, version)) for version in (LEAST, BELOW))
    assert f"numpy>={least},<{below}" == ALLOWED


@pytest.mark.parametrize(
    ("version", "fine"),
    [("2.0.0", True), ("2.4.6", True), ("2.4.0rc1", True), ("2.17.0", True), ("1.26.4", False), ("3.0", False), ("?", True)],
)
def test_which_versions_will_do(version: str, fine: bool) -> None:
    assert (complaint(version) is None) == fine


def test_a_version_that_is_too_new_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_text("__version__ = '99.0'\n")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    sentence = "numpy is 99.0; allowed is numpy>=2.0,<3.0 (pip install 'numpy>=2.0,<3.0')"
    imported = python("-c", "import pyverlet", PYTHONPATH=path)
    assert imported.returncode == 1
    assert imported.stderr.splitlines()[-1] == f"ImportError: {sentence}"
    command = python("-m", "pyverlet", "list", PYTHONPATH=path)
    assert (command.returncode, command.stdout, command.stderr) == (1, "", f"pyverlet: {sentence}\n")


# ---- Building the core: which compiler, and what is said if there is none ----


SOURCES = Path(__file__).parents[2]
FROM_SOURCES = pytest.mark.skipif(not (SOURCES / "build_core").exists(), reason="not in a source folder")


@FROM_SOURCES
@pytest.mark.skipif(os.name == "nt", reason="false is a command of POSIX")
def test_a_compiler_that_fails_is_one_sentence() -> None:
    # Nothing is built or changed: the compiler is tried first.
    done = python("-m", "build_core", cwd=SOURCES, CC="false")
    assert done.returncode == 1
    assert done.stderr.startswith("pyverlet needs a C compiler to be built: false fails")
    assert done.stderr.count("\n") == 1


REQUIRED = """
import importlib.util, sys
sys.modules["ziglang"], importlib.util.find_spec = None, lambda name: None
from build_core.compiler import requirements
print(requirements())
"""


@pytest.mark.parametrize(
    ("environment", "required"),
    [
        ({"CC": "false"}, "[]"),  # who names a compiler gets that one, or is told
        ({"PATH": os.devnull}, "['ziglang>=0.13']"),
    ],
)
@FROM_SOURCES
def test_a_compiler_is_required_where_there_is_none(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, Any], required: str
) -> None:
    monkeypatch.delenv("CC", raising=False)
    done = python("-c", REQUIRED, cwd=SOURCES, **environment)
    assert done.stdout.strip() == required, done.stderr
