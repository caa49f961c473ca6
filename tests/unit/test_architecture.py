"""The house: each module imports only from lower layers, and `import pyverlet` stays light."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pyverlet

ROOT = Path(pyverlet.__file__).parent

# From the ground up. A room may use those below it; within a room, nothing goes in a circle.
LAYERS = (
    "ground",
    "core",
    "state",
    "laws",
    "world",
    "scenes",
    "data",
    "lab",
    "picture",
    "viewers",
    "record",
    "draw",
    "cli",
)
# Rooms on the same floor, which do not know each other, but for these: room -> what it may use beside it.
BESIDE = {
    "record": {"viewers"},
    "draw": {"viewers"},
}
# Doors up the house, for convenience: methods of one line that load what they name only when called.
DOORS = {"world/convenience.py": {"record"}, "scenes/__init__.py": {"data"}, "scenes/_scene.py": {"data"}}

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
        room = own.parts[0]
        allowed = {*LAYERS[: LAYERS.index(room) + 1]} | BESIDE.get(room, set()) | DOORS.get(own.as_posix(), set())
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


def test_doors_open_only_when_called() -> None:
    for module, names in DOORS.items():
        assert {name.split(".")[0] for name in imported(ROOT / module, at_once=True)}.isdisjoint(names)


def test_import_is_light() -> None:
    code = (
        "import sys, numpy; before = set(sys.modules); import pyverlet\n"
        "print(' '.join({name.split('.')[0] for name in set(sys.modules) - before}))"
    )
    added = set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())
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
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
