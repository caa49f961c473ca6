"""Versions of NumPy that are too old or too new are refused in a sentence."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pyverlet.ground.versions import ALLOWED, BELOW, LEAST, complaint

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

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": path}
        return subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True)

    sentence = "numpy is 99.0; allowed is numpy>=2.0,<3.0 (pip install 'numpy>=2.0,<3.0')"
    imported = run("-c", "import pyverlet")
    assert imported.returncode == 1
    assert imported.stderr.splitlines()[-1] == f"ImportError: {sentence}"
    command = run("-m", "pyverlet", "list")
    assert (command.returncode, command.stdout, command.stderr) == (1, "", f"pyverlet: {sentence}\n")


# ---- Building the core: which compiler, and what is said if there is none ----


ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(not (ROOT / "build_core").exists(), reason="not in a source folder")


def run(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if name not in ("CC", "PATH")}
    return subprocess.run([sys.executable, *command], env=plain | environment, cwd=ROOT, capture_output=True, text=True)


@pytest.mark.skipif(os.name == "nt", reason="false is a command of POSIX")
def test_a_compiler_that_fails_is_one_sentence() -> None:
    # Nothing is built or changed: the compiler is tried first.
    done = run("-m", "build_core", CC="false", PATH=os.environ["PATH"])
    assert done.returncode == 1
    assert done.stderr.startswith("pyverlet needs a C compiler to be built: false fails")
    assert done.stderr.count("\n") == 1


REQUIRED = "from build_core.compiler import requirements; print(requirements())"


@pytest.mark.parametrize(
    ("environment", "required"),
    [
        ({"CC": "false", "PATH": os.environ.get("PATH", "")}, []),  # who names a compiler gets that one, or is told
        ({"PATH": os.devnull}, ["ziglang>=0.13"]),
    ],
)
def test_a_compiler_is_required_where_there_is_none(environment: dict[str, str], required: list[str]) -> None:
    without_zig = (
        "import sys; sys.modules['ziglang'] = None; import importlib.util; importlib.util.find_spec = lambda name: None; "
    )
    done = run("-c", without_zig + REQUIRED, **environment)
    assert done.stdout.strip() == str(required), done.stderr
