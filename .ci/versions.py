#!/usr/bin/env python3
"""The suite on other versions: `python3 .ci/versions.py [--python 3.12] [--only oldest|newest|generic] [pytest arguments]`.

On every Python from 3.11 on that is found, with the oldest and the newest NumPy that pyproject.toml allows, and once with the
core for any processor: without browsers, and the bits are the same. Not part of `.ci/run`: each takes as long as the suite. Needs
the network.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TESTED = ["unit", "equivalence", "physics", "data", "cli", "scenes", "picture", "record"]
"""Folders of tests that need no browser."""

NEEDED = ["pytest>=8.3", "hypothesis>=6.100", "scipy>=1.13", "pytest-xdist>=3.6", "httpx>=0.27", "ase>=3.23", "cython>=3.1"]

GENERIC = {"PYVERLET_CORE": "baseline"}

HASHES = """
import numpy as np, pyverlet as pv
for name in ("cage", "box", "cloth", "soft-bodies"):
    for dtype in ("float32", "float64"):
        world = pv.scenes.get(name).world(particles=300, dtype=dtype)
        world.run(seconds=1.0)
        print(name, dtype, world.state_hash(), flush=True)
"""


def bounds(name: str) -> tuple[str, str]:
    """(oldest, newest) of a dependency as requirements: `numpy>=2.0,<3.0` is 2.0.* and the newest below 3.0."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (wanted,) = (line for line in project["dependencies"] if re.match(rf"{name}\b", line))
    (least,) = re.findall(r">=([\d.]+)", wanted)
    return f"{name}=={least}.*", wanted


def pythons(only: str | None) -> list[tuple[str, str]]:
    """(version, interpreter) of every Python that is found, by the names `python3.11` and so on."""
    found = []
    for minor in range(11, 30):
        version = f"3.{minor}"
        command = shutil.which(f"python{version}")
        if command and only in (None, version) and subprocess.run([command, "-c", ""], capture_output=True).returncode == 0:
            found.append((version, command))
    return found


def environment(folder: Path, python: str, requirement: str) -> Path | None:
    """An interpreter with this NumPy, and this project; None if there is no such release for it."""
    subprocess.run([python, "-m", "venv", folder], check=True)
    inside = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip: list[str | Path] = [
        inside,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "-q",
        "install",
        "--only-binary=numpy",
    ]
    extras = f"{ROOT}[record,data,page,plot]"
    done = subprocess.run([*pip, requirement, *NEEDED, extras], capture_output=True, text=True)
    if done.returncode:
        print("   ", done.stderr.strip().splitlines()[-1])
        return None
    return inside


def hashes(python: Path, extra: dict[str, str]) -> str:
    """State hashes of some scenes, by the core for this processor or for any."""
    env = {**os.environ, **extra}
    env.pop("PYTHONPATH", None)
    return subprocess.run([python, "-c", HASHES], env=env, capture_output=True, text=True, check=True).stdout


def suite(python: Path, arguments: list[str]) -> tuple[bool, str]:
    """Run the tests; whether they pass, and what pytest says last."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    tests = arguments or [f"tests/{folder}" for folder in TESTED]
    done = subprocess.run([python, "-m", "pytest", "-q", "-n2", *tests], cwd=ROOT, env=env, capture_output=True, text=True)
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return done.returncode == 0, "\n    ".join([*failed, done.stdout.strip().splitlines()[-1]])


def main() -> None:
    """Go through them; exit code 1 if one fails or bits differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", help="only this version, such as 3.12")
    parser.add_argument("--only", choices=("oldest", "newest", "generic"))
    options, arguments = parser.parse_known_args()
    oldest, newest = bounds("numpy")
    good, told = True, dict[str, str]()
    for version, command in pythons(options.python):
        for age, requirement in (("oldest", oldest), ("newest", newest)):
            if options.only not in (None, "generic", age) or (options.only == "generic" and age == "oldest"):
                continue
            with tempfile.TemporaryDirectory() as folder:
                print(f"== Python {version}, {age}: {requirement}", flush=True)
                start, inside = time.monotonic(), environment(Path(folder, "venv"), command, requirement)
                if inside is None:
                    print("    no such release for this Python: left out", flush=True)
                    continue
                told[f"{version} {age}"] = hashes(inside, {})
                if age == "newest":
                    told[f"{version} generic"] = hashes(inside, GENERIC)
                if options.only != "generic":
                    passed, last = suite(inside, arguments)
                    good &= passed
                    print(f"    {last}", flush=True)
                print(f"    {time.monotonic() - start:.0f} s", flush=True)
    if len(set(told.values())) > 1:
        good = False
        print("bits differ:", *(f"{name}\n{text}" for name, text in told.items()), sep="\n")
    elif told:
        print(f"the same bits on all of: {', '.join(told)}")
    sys.exit(0 if good and told else 1)


if __name__ == "__main__":
    main()
