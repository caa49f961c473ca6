"""What tests of several folders share."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pyverlet.cli import main

CommandLine = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def no_numba(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Call functions by NumPy where there is Numba, too, but in tests of it: results do not depend on what is installed."""
    if "numba" not in request.keywords:
        monkeypatch.setattr("pyverlet.laws.forces.native.installed", lambda: False)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Run a command line: (exit code, standard output, standard error)."""

    def call(*arguments: str) -> tuple[int, str, str]:
        code = main(list(arguments))
        out, err = capsys.readouterr()
        return code, out, err

    return call


@pytest.fixture
def report(run: CommandLine) -> Callable[..., Any]:
    """Run a command line that succeeds: what it prints as JSON."""

    def call(*arguments: str) -> Any:
        code, out, err = run(*arguments, "--json")
        assert code == 0, err
        return json.loads(out)

    return call


@pytest.fixture
def refusal(run: CommandLine) -> Callable[..., str]:
    """Run a command line that is refused, or fails with another code: the one sentence that says why, and nothing else."""

    def call(*arguments: str, code: int = 2) -> str:
        got, out, err = run(*arguments)
        assert (got, out) == (code, ""), err
        assert err.startswith("pyverlet: ")
        assert err.endswith("\n")
        assert err.count("\n") == 1
        assert "Traceback" not in err
        assert "Usage" not in err
        return err

    return call


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Write modules, by name, into a folder that is the working one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def write(**sources: str) -> None:
        for name, source in sources.items():
            (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
            monkeypatch.delitem(sys.modules, name, raising=False)

    return write
