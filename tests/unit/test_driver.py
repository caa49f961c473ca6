"""A driver calls the stages of a loop from compiled code: all on one thread, or each with its loops over threads."""

from __future__ import annotations

import ast
import inspect
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from pyverlet.compile import jit

# Two stages, one of which only the driver's own driver calls, a stage kept on one thread, and who has done what.
PROGRAM = """
import sys, numba, numpy as np
from pyverlet.compile import jit
from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange

@kernel
def one(x):
    return x.dtype.type(1)

@parallel_kernel
def fill(out, who, value):
    for i in prange(out.shape[0]):
        who[i] = numba.get_thread_id()
        x = value
        for _ in range(2000):  # long enough for every thread to get some
            x = np.sqrt(x * x + one(out))
        out[i] = x / (i + 1)

@kernel
def scale(out, factor):
    for i in range(out.shape[0]):
        out[i] *= factor

fill_alone = fill.alone
numba.get_num_threads()  # starts the pool: code from the disk that asks which thread it is crashes without one

@driver
def inner(out, who, value):
    fill(out, who, value)
    scale(out, value)

@driver
def frame(out, who, value, times):
    for k in range(times):
        inner(out, who, value + k)
        fill_alone(out[:3], who[:3], value)
    return times

compiled = []
with jit.watch_compiling(lambda: compiled.append(1)):
    out, who, bits = np.zeros(4000), np.full(4000, -1), []
    for threads in range(1, jit.max_threads() + 1):
        jit.use_threads(threads)
        assert frame(out, who, 0.5, 3) == 3
        bits.append((out.tobytes(), len(np.unique(who))))
assert len({b for b, _ in bits}) == 1, "not the same bits"
print(*(workers for _, workers in bits), len(compiled))
"""


@pytest.mark.slow
@pytest.mark.skipif(jit.max_threads() < 2, reason="needs two threads")
def test_both_variants_are_kept_give_the_same_bits_and_use_their_threads(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)

    def run() -> list[int]:
        env = {**os.environ, "PYVERLET_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_NUM_THREADS": "2"}
        return [*map(int, subprocess.check_output([sys.executable, str(program)], env=env, text=True).split())]

    one, two, compiled = run()
    assert (one, two) == (1, 2)
    assert compiled >= 8  # five kernels of one thread, three for several
    assert run() == [1, 2, 0]


def loop(node: ast.AST) -> bool:
    return isinstance(node, ast.For) and ast.unparse(node.iter).startswith("prange(")


def fusible(source: str) -> list[int]:
    """Lines of loops over threads that come after another with as many turns, and nothing but sums in between."""
    found = []
    for node in ast.walk(ast.parse(source)):
        for block in (getattr(node, name, None) for name in ("body", "orelse")):
            before = ""
            for statement in block if isinstance(block, list) else ():
                if loop(statement):
                    turns = ast.unparse(statement.iter)
                    found += [statement.lineno] if turns == before else []
                    before = turns
                elif not isinstance(statement, ast.Assign | ast.AugAssign):
                    before = ""
    return found


def test_no_two_loops_over_threads_become_one() -> None:
    # Numba makes one loop of two neighbours that have as many turns, also where the second reads what the first has written.
    one = "def f():\n    for i in prange(3):\n        a(i)\n    {}\n    for i in prange(3):\n        b(i)\n"
    assert fusible(one.format("c = 1")) == [5]
    assert fusible(one.format("c(1)")) == []
    parallel = [kernel for kernel in jit.KERNELS.values() if kernel.parallel]
    assert len(parallel) > 20
    for kernel in parallel:
        assert fusible(textwrap.dedent(inspect.getsource(kernel.function))) == [], kernel.function
