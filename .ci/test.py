"""Set up an environment of its own and run the tests in it: `python3 .ci/test.py [--all] [pytest arguments]`.

Needs Python >= 3.11 and the network, nothing else. The package is built as a wheel and installed from it, so that what
is tested is what a user gets: a data file missing from the wheel shows.

What runs takes three to four minutes on two cores and looks at everything: every module, every scene, equal bits on any
number of threads, the physics at small sizes, the live page in a browser if there is one. `--all` adds the tests marked
`slow`: larger worlds, every combination, the core for other processors. `--setup` stops before the tests. Three processes
share them, two with `--all`; with `-n0` one does all.
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


def pip(python: Path, *arguments: str | Path) -> list[str]:
    """A command of pip. Python compiles what is imported; compiling all of it beforehand takes far longer."""
    return [str(each) for each in (python, "-m", "pip", "--disable-pip-version-check", "-q", *arguments)]


def needed(*extras: str) -> list[str]:
    """What the package with these extras needs, without the package."""
    import tomllib  # Python >= 3.11, which `main` asks for

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found, waiting = list(project["dependencies"]), list(extras)
    while waiting:
        for each in project["optional-dependencies"][waiting.pop()]:
            if each.startswith("pyverlet["):
                waiting += each.removeprefix("pyverlet[").removesuffix("]").split(",")
            else:
                found.append(each)
    return found


def setup(variants: str) -> None:
    """Build the wheel and put it, with everything the tests need, into the environment: at the same time, as far as can be."""
    in_ci = bool(os.environ.get("CI"))  # elsewhere, tests in programs that are not installed are skipped
    environments = [(PYTHON, ["test", *(["bench", "programs", "native"] if in_ci else [])])]
    if in_ci or WITH_ARCADE.exists():
        environments.append((WITH_ARCADE, ["arcade"]))
    for python, _ in environments:
        if not python.exists():
            venv.create(python.parent.parent, with_pip=True, clear=True)
    os.environ["PYVERLET_VARIANTS"] = variants
    with tempfile.TemporaryDirectory() as folder:
        installing = [
            subprocess.Popen(pip(python, "install", "--no-compile", *needed(*extras)), cwd=ROOT)
            for python, extras in environments
        ]
        run(*pip(PYTHON, "wheel", "--no-deps", "--wheel-dir", folder, "."))
        (wheel,) = Path(folder).glob("*.whl")
        for each in installing:
            if code := each.wait():
                sys.exit(code)
        for python, extras in environments:
            # The version may be the same as last time while the code is not.
            run(*pip(python, "install", "--no-compile", "--force-reinstall", "--no-deps", wheel))
            run(*pip(python, "install", "--no-compile", f"{wheel}[{','.join(extras)}]"))  # as the wheel itself says


def main(arguments: list[str]) -> None:
    if sys.version_info < (3, 11):
        sys.exit(f"pyverlet needs Python 3.11 or newer, this is {sys.version.split()[0]}")
    os.environ.pop("PYTHONPATH", None)  # what is tested is the installed package
    # Hundreds of processes are started, and nothing is compiled at installation: without it each takes three times as long.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    print("setting up .venv-test (a minute or two the first time)", flush=True)
    # With all tests the core for all processors, which they compare; else that for this one, in a third of the time.
    setup("all" if "--all" in arguments else "")
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
