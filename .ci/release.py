"""Everything that must hold before a version is published, in one command: `python3 .ci/release.py`. It publishes nothing.

1. The version in `pyverlet.__version__` has a section with a date in CHANGELOG.md, and pyproject.toml names the Pythons tried.
2. `python -m build` makes a sdist, and from it, where there is no git, a wheel; one made from this folder holds the same files.
3. The wheel, for the Python that runs this, is at most 12 MB, and `twine check --strict` finds nothing.
4. Installed in an empty environment, from the sdist by every Python named that is on this machine, from the wheel by the one
   it is for, the command runs a scene.
5. `pip install ".[test,bench,programs]"`, and each other extra, can be resolved.
6. `.ci/run`: style, types, documentation, all tests.

`--packages` stops before the last. The files are left in dist/.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import venv
import zipfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
DIST = ROOT / "dist"
MOST_BYTES = 12_000_000
BIN = "Scripts" if os.name == "nt" else "bin"


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """What a command prints; its failure ends this script with all that it has said."""
    told = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=told, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def environment(folder: Path, python: str | Path = sys.executable) -> Path:
    """The interpreter of an empty environment made in this folder."""
    if python == sys.executable:
        venv.create(folder, with_pip=True, clear=True)
    else:
        run(python, "-m", "venv", folder)
    return folder / BIN / ("python.exe" if os.name == "nt" else "python")


def pip(python: Path, *arguments: str | Path) -> None:
    """Run pip in an environment."""
    run(python, "-m", "pip", "--disable-pip-version-check", "-q", *arguments)


def project() -> dict[str, Any]:
    """What pyproject.toml says of the project."""
    told: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return told


def stated() -> tuple[str, list[str]]:
    """The version, which the changelog has, and the Pythons it was tried on."""
    source = (ROOT / "src" / "pyverlet" / "__init__.py").read_text(encoding="utf-8")
    version = re.findall(r'^__version__ = "(.+)"$', source, re.MULTILINE)[0]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    if not re.search(rf"^## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d$", changes, re.MULTILINE):
        sys.exit(f"CHANGELOG.md has no section '## [{version}] - YYYY-MM-DD'; allowed is one of each version")
    pythons = re.findall(r"Python :: (3\.\d+)$", "\n".join(project()["classifiers"]), re.MULTILINE)
    if not pythons:
        sys.exit("pyproject.toml has no classifier 'Programming Language :: Python :: 3.N'; allowed is one of each Python tried")
    if "urls" not in project():
        print("note: pyproject.toml names no [project.urls]: say where the project lives before it is published")
    return version, pythons


def built(version: str, python: Path) -> tuple[Path, Path]:
    """The sdist and the wheel made from it."""
    shutil.rmtree(DIST, ignore_errors=True)
    run(python, "-m", "build", "--outdir", DIST)
    sdist, wheels = DIST / f"pyverlet-{version}.tar.gz", list(DIST.glob(f"pyverlet-{version}-cp*.whl"))
    if not sdist.exists() or len(wheels) != 1:
        made = ", ".join(path.name for path in DIST.iterdir())
        sys.exit(f"a sdist and a wheel of {version} were to be made; there are {made}")
    wheel = wheels[0]
    with tempfile.TemporaryDirectory() as folder:
        run(python, "-m", "build", "--wheel", "--outdir", folder)
        here, there = (set(zipfile.ZipFile(path).namelist()) for path in (Path(folder) / wheel.name, wheel))
    if here != there:
        sys.exit(f"the wheels made from the folder and from the sdist differ in {sorted(here ^ there)}")
    if wheel.stat().st_size > MOST_BYTES:
        sys.exit(f"{wheel.name} has {wheel.stat().st_size} bytes; allowed are at most {MOST_BYTES}")
    with tarfile.open(sdist) as content:
        inside = {part for name in content.getnames() for part in Path(name).parts[1:2]}
    lacks = {"README.md", "LICENSE", "tests", "docs", ".ci", "build_core"} - inside
    if lacks:
        sys.exit(f"{sdist.name} lacks {', '.join(sorted(lacks))}")
    run(python, "-m", "twine", "check", "--strict", sdist, wheel)
    return sdist, wheel


def works(what: Path, python: str, version: str) -> None:
    """Install it in an empty environment, from where neither the sources nor git are, and run a scene."""
    with tempfile.TemporaryDirectory() as folder:
        inside = environment(Path(folder) / "env", python)
        pip(inside, "install", what)
        command = inside.parent / ("pyverlet.exe" if os.name == "nt" else "pyverlet")
        says = run(command, "--version", cwd=Path(folder))
        if says.strip() != f"pyverlet {version}":
            sys.exit(f"{what.name} installed says it is {says.strip()!r}; allowed is version {version}")
        report = json.loads(run(command, "run", "cage", "--particles", "200", "--frames", "60", "--json", cwd=Path(folder)))
        if report["escaped"] or report["frames"] != 60:
            sys.exit(f"{what.name} installed runs a scene to {report}")


def main(arguments: list[str]) -> None:
    version, named = stated()
    print(f"== pyverlet {version}", flush=True)
    pythons = {name: found for name in named if (found := answers(name))}
    with tempfile.TemporaryDirectory() as folder:
        python = environment(Path(folder) / "env")
        pip(python, "install", "build", "twine")
        sdist, wheel = built(version, python)
        print(f"== {sdist.name} {sdist.stat().st_size:,} bytes, {wheel.name} {wheel.stat().st_size:,} bytes: checked", flush=True)
        for name, interpreter in pythons.items():
            for what in (wheel, sdist) if interpreter == sys.executable else (sdist,):
                works(what, interpreter, version)
                print(f"== {what.name} installs and runs on Python {name}", flush=True)
        if absent := [name for name in named if name not in pythons]:
            print(f"note: not tried here, for it is not on this machine: Python {', '.join(absent)}")
        extras = set(project()["optional-dependencies"])
        for wanted in ("test,bench,programs", *sorted(extras - {"test", "bench", "programs"})):
            pip(python, "install", "--dry-run", f"{wheel}[{wanted}]")
        print(f"== the extras can be resolved: {', '.join(sorted(extras))}", flush=True)
    if "--packages" not in arguments:
        sys.exit(subprocess.call(["bash", ROOT / ".ci" / "run"], cwd=ROOT))
    print("== all but .ci/run holds")


def answers(name: str) -> str:
    """The path of that Python; empty if there is none, or one that only stands there."""
    if sys.version_info[:2] == tuple(map(int, name.split("."))):
        return sys.executable
    path = shutil.which(f"python{name}")
    if path and subprocess.run([path, "--version"], capture_output=True, check=False).returncode == 0:
        return path
    return ""


if __name__ == "__main__":
    main(sys.argv[1:])
