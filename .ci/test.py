"""Set up an environment of its own and run the tests in it: `python3 .ci/test.py [--all] [pytest arguments]`.

Needs Python >= 3.11 and the network, nothing else. The package is built as a wheel and installed from it, so that what
is tested is what a user gets: a data file missing from the wheel shows.

What runs is meant to take five minutes on two cores and looks at everything: every module, every scene, equal bits on any number
of threads, the physics at small sizes, the live page in a browser if there is one. `--all` adds the tests marked `slow`: larger
worlds, every combination. `--setup` stops before the tests. Three processes share them, two with `--all`;
with `-n0` one does all.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BIN = "Scripts" if os.name == "nt" else "bin"


def python_of(environment: str) -> Path:
    """The interpreter of one of our environments."""
    return ROOT / environment / BIN / ("python.exe" if os.name == "nt" else "python")


PYTHON = python_of(".venv-test")
WITH_ARCADE = python_of(".venv-arcade")
COSTS = "tests/unit/test_costs.py"


def run(*command: str | Path) -> None:
    """Run a command in the project folder; its failure ends this script with the same code."""
    code = subprocess.call([str(part) for part in command], cwd=ROOT)
    if code:
        sys.exit(code)


def install(python: Path, wheel: Path, extras: str) -> None:
    """Put the wheel and what its extras name into the environment of this interpreter."""
    if not python.exists():
        venv.create(python.parent.parent, with_pip=True, clear=True)
    pip = (python, "-m", "pip", "--disable-pip-version-check", "-q")
    # Python compiles what is imported; compiling all of it beforehand is two fifths of the time this takes.
    run(*pip, "install", "--no-compile", f"{wheel}[{extras}]")
    # The version may be the same as last time while the code is not.
    run(*pip, "install", "--no-compile", "--force-reinstall", "--no-deps", wheel)


def setup() -> None:
    """Build the wheel and put it, with everything the tests need, into the environment."""
    if not PYTHON.exists():
        venv.create(PYTHON.parent.parent, with_pip=True, clear=True)
    os.environ["PYVERLET_VARIANTS"] = "all"  # tests compare them
    with tempfile.TemporaryDirectory() as folder:
        run(PYTHON, "-m", "pip", "--disable-pip-version-check", "-q", "wheel", "--no-deps", "--wheel-dir", folder, ".")
        (wheel,) = Path(folder).glob("*.whl")
        # Elsewhere, tests in programs that are not installed are skipped.
        in_ci = bool(os.environ.get("CI"))
        install(PYTHON, wheel, "test,bench,programs" if in_ci else "test")
        if in_ci or WITH_ARCADE.exists():
            install(WITH_ARCADE, wheel, "arcade")


def main(arguments: list[str]) -> None:
    if sys.version_info < (3, 11):
        sys.exit(f"pyverlet needs Python 3.11 or newer, this is {sys.version.split()[0]}")
    os.environ.pop("PYTHONPATH", None)  # what is tested is the installed package
    print("setting up .venv-test (a minute or two the first time)", flush=True)
    setup()
    if "--setup" in arguments:
        return
    if WITH_ARCADE.exists():
        os.environ["PYVERLET_TEST_ARCADE"] = str(WITH_ARCADE)
    everything = ["-m", "not full"] if "--all" in arguments else []
    # With two, half a core was idle while the page was waited for. For all tests three would need more memory.
    processes = "-n2" if everything else "-n3"
    chosen = [each for each in arguments if each != "--all"]
    if not chosen:
        # Calls are counted by Python's profiler, which twice did not come back in a process that had run thousands of tests.
        run(PYTHON, "-m", "pytest", *everything, COSTS)
        chosen = [f"--ignore={COSTS}"]
    # One soon has all tests of the page; whoever is through takes over what the others have left.
    run(PYTHON, "-m", "pytest", processes, "--dist=worksteal", *everything, *chosen)


if __name__ == "__main__":
    main(sys.argv[1:])
