"""What is left out on the way to a kernel is missing nowhere, and only there."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from pyverlet.compile import lean

COMPILE = """
import numpy as np, numba
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary
from pyverlet.compile import jit
from pyverlet.kernels import motion
made, finalise = [], JITCodeLibrary._finalize_specific
JITCodeLibrary._finalize_specific = lambda self: (made.append(self.name), finalise(self))[1]
jit.use_threads(THREADS)
x, y, f = np.zeros((3, 2)), np.zeros((3, 2)), np.ones(3)
x[1] = 2.0
motion.newton_kick_drift(x, y, np.zeros((3, 2)), np.zeros((0, 2)), f, 0.0, -1.0, 0.5, 0.25)
print(x[1, 1], sum("newton" in name or "gufunc" in name.lower() for name in made))
print(motion.strayed.alone(x, y, 1.0), numba.njit(lambda a, b: max(a, b) + np.zeros(3).size)(1.0, 2.0))
"""


def run(code: str, cache: Path) -> list[str]:
    env = {**os.environ, "PYVERLET_CACHE_DIR": str(cache), "NUMBA_NUM_THREADS": "2"}
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize("threads", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_machine_code_is_made_of_the_kernel_alone(threads: int, tmp_path: Path) -> None:
    code = COMPILE.replace("THREADS", str(threads))
    assert run(code, tmp_path) == ["1.75", "1", "True", "5.0"]
    assert run(code, tmp_path) == ["1.75", "1", "True", "5.0"]  # what is found on disk has all it calls in it


@pytest.mark.slow
def test_a_helper_found_on_disk_serves_another_kernel(tmp_path: Path) -> None:
    run(COMPILE.replace("THREADS", "1").replace("newton_kick_drift(x, y, ", "newton(").replace(", 0.5, 0.25)", ")"), tmp_path)
    assert run(COMPILE.replace("THREADS", "1"), tmp_path) == ["1.75", "1", "True", "5.0"]


def test_numba_is_as_it_was_afterwards() -> None:
    def methods() -> list[Any]:
        return [vars(owner)[method] for owner, method, _ in lean._CHANGES]

    def fail() -> None:
        raise ValueError

    before = methods()
    with contextlib.suppress(ValueError), lean.only("a"):
        with lean.only(""):
            assert lean._wanted == ""
        assert not set(methods()) & set(before)
        fail()
    assert methods() == before
    assert lean._wanted is None


def test_another_numba_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    class Other:
        pass

    def never(*_: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(lean, "_CHANGES", ((Other, "finish", never),))
    with lean.only("a"):
        assert not hasattr(Other, "finish")


def test_options_are_equal_that_were() -> None:
    from numba.core.compiler import Flags

    plain, other, same = Flags(), Flags(), Flags()
    other.release_gil = True
    same.release_gil = False  # set, to what it is by default
    before = [hash(flags) for flags in (plain, other, same)]
    with lean.only("a"):
        assert [hash(flags) for flags in (plain, other, same)] == before
        assert plain == same
        assert plain != other
        assert plain != 1
    assert numba.njit(lambda: np.arange(3).sum())() == 3
