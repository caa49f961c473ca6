"""What a force of the user's own costs: worlds from one start, stepped in turn, without, with one of the library, and with it.

`python -m benchmarks.forces`; where Numba is installed, the function is compiled.
"""

from __future__ import annotations

import argparse
from functools import partial
from statistics import median

import pyverlet as pv
from benchmarks.tables import timed

DT = 1 / 60


@pv.force
def swirl(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    """A weak whirl about the origin, newtons."""
    return -1e-3 * y, 1e-3 * x


def ratios(particles: int, frames: int, seconds: float, threads: int | None) -> tuple[float, float, float]:
    """Median milliseconds of a frame without a force; medians of the ratios of neighbouring frames: to those with it, and with
    an attractor.
    """
    worlds = [pv.scenes.get("cage").world(particles=particles) for _ in range(3)]
    for world in worlds:
        world.threads = threads
        world.run(seconds=seconds, dt=DT)
    worlds[1].forces.append(pv.Attractor(strength=1e-3, softening=1.0))
    worlds[2].forces.append(swirl)
    times: list[list[float]] = [[], [], []]
    for frame in range(-10, frames):
        for k in (0, 1, 2) if frame % 2 else (2, 1, 0):
            ms = timed(partial(worlds[k].step, DT))
            if frame >= 0:
                times[k].append(ms)
    bare, built_in, own = times
    to_bare, to_built_in = (median(b / a for a, b in zip(each, own, strict=True)) for each in (bare, built_in))
    return median(bare), to_bare, to_built_in


def main() -> None:
    """Print one line for each number of particles."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.forces", description=__doc__)
    parser.add_argument("--particles", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--frames", type=int, default=60, help="frames measured of each world")
    parser.add_argument("--seconds", type=float, default=0.0, help="simulated before: 0 in the air, 10 a heap of 20,000")
    parser.add_argument("--threads", type=int, help="as many as pay off unless said otherwise; 1 on a busy machine")
    arguments = parser.parse_args()
    for particles in arguments.particles:
        ms, without, built_in = ratios(particles, arguments.frames, arguments.seconds, arguments.threads)
        print(f"{particles:>9,} circles: {ms:.2f} ms without, {without:.2f} times with, {built_in:.2f} times with an attractor")


if __name__ == "__main__":
    main()
