"""Building the core: which compiler, and what is said if there is none."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
