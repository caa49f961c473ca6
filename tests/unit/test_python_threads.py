"""Worlds stepped from several Python threads at once: no crash, and the bits of one after the other."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import pyverlet as pv

# Four Python threads, each with its first world. Large enough, or told, to use two threads each.
FIRST_WORLDS = """
import sys, threading
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import pyverlet as pv

def first(k):
    start.wait()
    world = pv.World(boundary=pv.Circle(radius=60), threads=2)
    place = np.stack(np.divmod(np.arange(2500), 50), axis=-1) * 1.05 - 26.0
    world.add(position=place, radius=0.5)
    for _ in range(5):
        world.step(1 / 60)
    return world.state_hash()

start = threading.Barrier(4)
with ThreadPoolExecutor(4) as pool:
    hashes = set(pool.map(first, range(4)))
import numba
start = threading.Barrier(1)
assert hashes == {first(0)}, "not the same bits"
print(numba.threading_layer())
"""


# Four Python threads that all need the same kernels at once, and nothing is compiled yet.
FIRST_KERNELS = """
import threading
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from pyverlet.compile import clock, jit
from pyverlet.kernels import motion

def first(k):
    jit.use_threads(2)
    x = np.arange(20000.0).reshape(-1, 2)
    start.wait()
    for _ in range(50):
        clock.seconds(clock.address(), clock.tick())
        motion.advance(x, x, np.ones_like(x), 0.5)
    return x.tobytes(), bool(motion.any_non_finite(x))

start = threading.Barrier(4)
with ThreadPoolExecutor(4) as pool:
    assert set(pool.map(first, range(4))) == {((np.arange(20000.0) + 25).tobytes(), False)}
"""


@pytest.mark.parametrize("layer", ["default", pytest.param("workqueue", marks=pytest.mark.slow)])
def test_each_thread_may_compile_the_first_kernels(layer: str, tmp_path: Path) -> None:
    env = {**os.environ, "NUMBA_THREADING_LAYER": layer, "NUMBA_NUM_THREADS": "2", "PYVERLET_CACHE_DIR": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", FIRST_KERNELS], env=env, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


@pytest.mark.slow
@pytest.mark.parametrize("layer", ["default", "workqueue"])
def test_each_thread_may_step_its_first_world(layer: str) -> None:
    env = {**os.environ, "NUMBA_THREADING_LAYER": layer, "NUMBA_NUM_THREADS": "2"}
    run = subprocess.run([sys.executable, "-c", FIRST_WORLDS], env=env, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert layer in ("default", run.stdout.strip())


def small(seed: int) -> pv.World:
    world = pv.World(boundary=pv.Box((0, 0), (6, 6)))
    rng = np.random.default_rng(seed)
    place = np.stack(np.divmod(np.arange(16), 4), axis=-1) * 1.3 + 1.0
    world.add(position=place + 0.1 * rng.random(place.shape), velocity=rng.normal(0, 1, place.shape), radius=0.5)
    return world


@pytest.mark.slow
def test_a_pool_of_threads_steps_a_hundred_worlds() -> None:
    def run(seed: int) -> str:
        world = small(seed)
        for _ in range(10):
            world.step(1 / 60)
        return world.state_hash()

    expected = [run(seed) for seed in range(100)]
    with ThreadPoolExecutor(4) as pool:
        assert [*pool.map(run, range(100))] == expected
