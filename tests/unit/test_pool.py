"""Numba's threads: nobody wakes them for a small world, they soon sleep, and a fork, or whatever runs them, is survived."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pyverlet.compile import jit

BEGIN = """
import os, sys, numpy as np, numba, pyverlet as pv
def world(n, threads=2):
    world = pv.World(boundary=pv.Circle(radius=60), threads=threads)
    world.add(position=np.stack(np.divmod(np.arange(n), 50), axis=-1) * 1.05 - 26.0)
    for _ in range(20): world.step(1 / 60)
    return world.state_hash()
"""


def run(code: str, **environment: str) -> str:
    env = {key: value for key, value in os.environ.items() if key not in ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")}
    env |= {"NUMBA_NUM_THREADS": "2", **environment}
    done = subprocess.run([sys.executable, "-c", BEGIN + code], env=env, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_small_world_starts_no_threads() -> None:
    told = run("""
world(100)
try: print(numba.threading_layer())
except ValueError: print("none")
""")
    assert told == "none"


SPINS = """
seen = []
from pyverlet.compile import pool
start = numba.get_num_threads
numba.get_num_threads = lambda: (seen.append(os.environ.get("GOMP_SPINCOUNT")), start())[1]
world(2500)
print(seen[0], os.environ.get("GOMP_SPINCOUNT"))
"""


@pytest.mark.slow
def test_who_waits_soon_sleeps() -> None:
    assert run(SPINS) == "5000 None"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "value", "said"), [("GOMP_SPINCOUNT", "7", "7 7"), ("OMP_WAIT_POLICY", "active", "None None")])
def test_unless_the_user_has_said_otherwise(name: str, value: str, said: str) -> None:
    assert run(SPINS, **{name: value}) == said


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("layer", ["default", pytest.param("workqueue", marks=pytest.mark.slow)])
@pytest.mark.parametrize("before", [pytest.param("world(2500)", marks=pytest.mark.slow), "None"])
def test_a_fork_goes_on(layer: str, before: str) -> None:
    # GNU's OpenMP ends a fork that uses its threads when its parent has; a lock held by a thread that is not there never opens.
    told = run(
        f"""
{before}
sys.stdout.flush()
child = os.fork()
if child == 0:
    print(world(2500), flush=True)
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
print(world(2500))
""",
        NUMBA_THREADING_LAYER=layer,
    ).split()
    assert len(told) == 2
    assert told[0] == told[1]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_processes_of_multiprocessing(method: str, tmp_path: Path) -> None:
    if sys.platform == "win32" and method == "fork":
        pytest.skip("no fork here")
    script = tmp_path / "script.py"
    script.write_text(
        BEGIN
        + f"""
import multiprocessing, warnings
if __name__ == "__main__":
    warnings.simplefilter("ignore")  # Python warns of a fork beside threads
    here = world(2500)
    with multiprocessing.get_context("{method}").Pool(2) as pool:
        print(set(pool.map(world, [2500, 2500])) == {{here}})
"""
    )
    env = {**os.environ, "NUMBA_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, str(script)], env=env, capture_output=True, text=True, timeout=300)
    assert done.stdout.strip() == "True", done.stderr


@pytest.mark.slow
@pytest.mark.skipif(jit.max_threads() < 2, reason="one core")
def test_beside_threads_of_numpy_and_of_the_users_own_kernels() -> None:
    told = run("""
import threading
from numba import njit, prange
@njit(parallel=True)
def total(x):
    s = 0.0
    for i in prange(len(x)): s += x[i]
    return s
stop, done = threading.Event(), []
def multiply():
    a = np.ones((300, 300))
    while not stop.is_set(): done.append(float((a @ a)[0, 0]))
other = threading.Thread(target=multiply); other.start()
first = world(2500)
sums = [total(np.ones(1000)) for _ in range(100)]
assert world(2500) == first and set(sums) == {1000.0}
stop.set(); other.join()
print(numba.get_num_threads(), set(done))
""")
    assert told == "2 {300.0}"
