"""The installed command as a process of its own: streams, signals, what it loads."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

COMMAND = [sys.executable, "-m", "pyverlet"]
SMALL = ["run", "cage", "--particles", "60", "--frames", "5"]


def call(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(  # type: ignore[call-overload, no-any-return]
        [*COMMAND, *arguments], capture_output=True, text=True, timeout=120, **options
    )


def test_json_alone_on_standard_output() -> None:
    done = call(*SMALL, "--headless", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["particles"] == 60
    assert "Traceback" not in done.stderr


def test_script_is_installed() -> None:
    script = Path(sysconfig.get_path("scripts")) / ("pyverlet.exe" if os.name == "nt" else "pyverlet")
    if not script.exists():
        pytest.skip("the package is not installed here, only importable")
    done = subprocess.run([script, "list"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert "cage" in done.stdout


def test_bad_input_in_a_real_process() -> None:
    done = call("run", "cagee")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Children take SIGINT even if this process was started to ignore it, as a shell starts its background jobs."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows")
def test_ctrl_c_ends_a_run_with_130() -> None:
    command = [*COMMAND, "run", "cage", "--particles", "200", "--seconds", "100000", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            first = process.stderr.readline()  # progress: it is running
            assert "of" in first
            time.sleep(0.2)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 130
    assert out == ""
    assert err.splitlines()[-1] == "pyverlet: interrupted"
    assert "Traceback" not in err


USER = """
import os, signal, pyverlet
try:
    os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    print("mine")
"""
INTERRUPTED_IMPORT = """
import os, signal, time
os.kill(os.getpid(), signal.SIGINT)
time.sleep(10)
"""


@pytest.mark.usefixtures("interruptible")
@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows")
@pytest.mark.parametrize("module", ["numpy", "typer"])
@pytest.mark.parametrize("script", [False, True], ids=["module", "script"])
def test_ctrl_c_while_the_command_loads_is_a_sentence(tmp_path: Path, module: str, script: bool) -> None:
    (tmp_path / f"{module}.py").write_text(INTERRUPTED_IMPORT)  # the library whose import is interrupted
    installed = tmp_path / "scripts" / "pyverlet"
    installed.parent.mkdir()
    installed.write_text("import sys\nfrom pyverlet.cli import main\nsys.exit(main())\n")
    command = [sys.executable, str(installed)] if script else COMMAND
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path}
    done = subprocess.run([*command, "list"], capture_output=True, text=True, timeout=60, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "pyverlet: interrupted\n")


@pytest.mark.usefixtures("interruptible")
@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows")
@pytest.mark.parametrize("start", [["-c", "import user"], ["-m", "user"]])
def test_who_imports_the_library_keeps_ctrl_c(tmp_path: Path, start: list[str]) -> None:
    user = tmp_path / "user"
    user.mkdir()
    # The package itself imports the library, while Python still looks for what it is to run.
    (user / "__init__.py").write_text(USER)
    (user / "__main__.py").write_text("")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path}
    done = subprocess.run([sys.executable, *start], capture_output=True, text=True, timeout=60, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "mine\n", "")


@pytest.mark.skipif(os.name == "nt", reason="a POSIX shell's pipe")
def test_a_closed_pipe_is_no_drama() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    process = subprocess.Popen([*COMMAND, "list", "--json"], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    _, err = process.communicate(timeout=60)
    assert "Traceback" not in err
    assert "Error" not in err


LOADED = """
import sys
def look(*never): print("loaded:", *(name for name in never if name in sys.modules), file=sys.stderr)
import pyverlet
look("starlette", "uvicorn", "websockets", "typer", "matplotlib", "pyverlet.viewers.launch")
from pyverlet.cli import main
main(["list"])
look("starlette", "uvicorn", "websockets", "matplotlib")
main(["run", "fall", "--frames", "1"])
look("starlette", "uvicorn", "matplotlib")
"""


def test_loads_only_what_it_needs() -> None:
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if line.startswith("loaded:")] == ["loaded:"] * 3
