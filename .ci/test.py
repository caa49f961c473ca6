"""Set up an environment of its own and run the tests in it: `python3 .ci/test.py [pytest arguments]`.

Needs Python >= 3.11 and the network, nothing else. The package is built as a wheel and installed from it, so that what
is tested is what a user gets: a data file missing from the wheel shows. `--setup` stops before the tests.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = ROOT / ".venv-test"
BIN = ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")


def run(*command: str | Path) -> None:
    """Run a command in the project folder; its failure ends this script with the same code."""
    code = subprocess.call([str(part) for part in command], cwd=ROOT)
    if code:
        sys.exit(code)


def install() -> None:
    """Build the wheel and put it, with everything the tests need, into the environment."""
    if not PYTHON.exists():
        venv.create(ENVIRONMENT, with_pip=True, clear=True)
    pip = (PYTHON, "-m", "pip", "--disable-pip-version-check", "-q")
    with tempfile.TemporaryDirectory() as folder:
        run(*pip, "wheel", "--no-deps", "--wheel-dir", folder, ".")
        (wheel,) = Path(folder).glob("*.whl")
        # Elsewhere, tests in programs that are not installed are skipped.
        run(*pip, "install", f"{wheel}[{'test,programs' if os.environ.get('CI') else 'test'}]")
        # The version may be the same as last time while the code is not.
        run(*pip, "install", "--force-reinstall", "--no-deps", wheel)


def main(arguments: list[str]) -> None:
    if sys.version_info < (3, 11):
        sys.exit(f"pyverlet needs Python 3.11 or newer, this is {sys.version.split()[0]}")
    os.environ.pop("PYTHONPATH", None)  # what is tested is the installed package
    print("setting up .venv-test (a minute or two the first time)", flush=True)
    install()
    if "--setup" not in arguments:
        sys.stdout.flush()
        run(PYTHON, "-m", "pytest", *arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
