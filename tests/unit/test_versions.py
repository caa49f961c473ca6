"""Versions that nobody has tried are refused in a sentence."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pyverlet.ground.versions import TRIED, complaint

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


@pytest.mark.parametrize("package", TRIED)
def test_the_package_asks_for_the_same_versions(package: str) -> None:
    least, below = (".".join(map(str, version)) for version in TRIED[package])
    wanted = tomllib.loads(PROJECT.read_text())["project"]["dependencies"]
    assert f"{package}>={least},<{below}" in wanted


@pytest.mark.parametrize(
    ("version", "fine"),
    [("0.61.0", True), ("0.68.1", True), ("0.68.0rc1", True), ("0.69.0", False), ("0.60.2", False), ("1.0", False), ("?", True)],
)
def test_which_versions_will_do(version: str, fine: bool) -> None:
    assert (complaint("numba", version) is None) == fine


def test_a_version_that_is_too_new_is_one_sentence(tmp_path: Path) -> None:
    info = tmp_path / "numba-99.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: numba\nVersion: 99.0\n")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": path}
        return subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True)

    sentence = "numba is 99.0; allowed is numba>=0.61,<0.69 (pip install 'numba>=0.61,<0.69')"
    imported = run("-c", "import pyverlet")
    assert imported.returncode == 1
    assert imported.stderr.splitlines()[-1] == f"ImportError: {sentence}"
    command = run("-m", "pyverlet", "list")
    assert (command.returncode, command.stdout, command.stderr) == (1, "", f"pyverlet: {sentence}\n")
