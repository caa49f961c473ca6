"""This version beside another one: `python -m benchmarks beside --checkout ../pyverlet-before`.

Each steps a settled heap of equal smooth discs in a process of its own, some frames in turn, so that a machine whose pace changes
by the minute, as shared ones do, meets both alike: what is compared is the ratio of each pair of turns.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import pyverlet as pv

FRAMES = 60
"""Of a turn; some more come first, and are not counted: a turn begins with what the other one has left in the caches."""

_WORKER = """
import sys, time
import pyverlet as pv
particles, threads, frames = map(int, sys.argv[1:])
world = pv.scenes.get("cage").world(particles=particles)
world.threads = threads
world.run(seconds=25.0)
overlap = world.overlap()
print(overlap.mean, overlap.max, world.substeps, flush=True)
for _ in sys.stdin:
    times = []
    for frame in range(frames + 20):
        start = time.perf_counter()
        world.step(1 / 60)
        times.append(time.perf_counter() - start)
    print(1e3 * sorted(times[20:])[frames // 2], flush=True)
"""


@contextmanager
def _heap(source: Path, particles: int, threads: int) -> Iterator[subprocess.Popen[str]]:
    """A process that has a settled heap, made by the pyverlet in this folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", _WORKER, str(particles), str(threads), str(FRAMES)],
        env={**os.environ, "PYTHONPATH": str(source)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    with process:
        try:
            yield process
        finally:
            process.kill()


def _ask(process: subprocess.Popen[str], question: str = "") -> list[float]:
    """The numbers of its next line, which it writes when it is asked to."""
    assert process.stdin
    assert process.stdout
    if question:
        process.stdin.write(question)
        process.stdin.flush()
    line = process.stdout.readline()
    if not line:
        raise pv.InputError("checkout is of a pyverlet that could not step the scene 'cage'; its own words are above")
    return [float(word) for word in line.split()]


@contextmanager
def _installed(checkout: Path) -> Iterator[Path]:
    """A folder with the package of this checkout, its core compiled."""
    if not (checkout / "src" / "pyverlet").is_dir():
        raise pv.InputError(f"checkout is {str(checkout)!r}; allowed is a folder with src/pyverlet in it")
    with tempfile.TemporaryDirectory() as folder:
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q", "install", "--no-deps", "--target", folder]
        if subprocess.run([*pip, str(checkout)]).returncode:
            raise pv.InputError(f"checkout is {str(checkout)!r}, which pip could not install; its own words are above")
        yield Path(folder)


def compare(there: Path, particles: int, threads: int, turns: int) -> str:
    """A line with both: medians, their quiet tenth, the median and the quartiles of the ratio of turns that follow each other."""
    here = Path(pv.__file__).parents[1]
    with _heap(there, particles, threads) as other, _heap(here, particles, threads) as ours:
        before, now = _ask(other), _ask(ours)
        times = np.empty((turns, 2))
        for turn in range(turns):
            for which in (0, 1) if turn % 2 else (1, 0):
                times[turn, which] = _ask((other, ours)[which], "on\n")[0]
    low, middle, high = np.quantile(times[:, 1] / times[:, 0], (0.25, 0.5, 0.75))
    quiet, median = np.quantile(times, 0.1, axis=0), np.median(times, axis=0)
    return (
        f"{particles:>10,}{threads:>8}  {quiet[0]:>8.3f}{quiet[1]:>9.3f}{median[0]:>10.3f}{median[1]:>9.3f}"
        f"{middle:>9.3f} ({low:.2f} to {high:.2f})  {before[0]:.3%}, {now[0]:.3%}; {before[2]:.0f}, {now[2]:.0f} substeps"
    )


def main(checkout: Path, particles: list[int], threads: list[int], turns: int) -> None:
    """Print a line for each number of particles and of threads."""
    print(f"settled for 25 s; {turns} turns of {FRAMES} frames each; ms a frame; there, here; overlap in the mean")
    print(f"{'particles':>10}{'threads':>8}  {'quiet tenth':>17}{'median':>19}{'ratio':>9}")
    with _installed(checkout) as there:
        for number in particles:
            for count in threads:
                print(compare(there, number, count, turns), flush=True)
