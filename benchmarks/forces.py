"""What a force of the user's own costs: two worlds from one start, stepped in turn, one with it and one without.

`python -m benchmarks.forces`
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


def ratio(particles: int, frames: int, seconds: float, threads: int | None) -> tuple[float, float, float]:
    """Median milliseconds of a frame without and with the force, and the median of the ratios of neighbouring frames."""
    worlds = [pv.scenes.get("cage").world(particles=particles) for _ in range(2)]
    for world in worlds:
        world.threads = threads
        world.run(seconds=seconds, dt=DT)
    worlds[1].forces.append(swirl)
    times: list[list[float]] = [[], []]
    for frame in range(-10, frames):
        for k in (0, 1) if frame % 2 else (1, 0):
            ms = timed(partial(worlds[k].step, DT))
            if frame >= 0:
                times[k].append(ms)
    return median(times[0]), median(times[1]), median(b / a for a, b in zip(*times, strict=True))


def main() -> None:
    """Print one line for each number of particles."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.forces", description=__doc__)
    parser.add_argument("--particles", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--frames", type=int, default=60, help="frames measured of each world")
    parser.add_argument("--seconds", type=float, default=0.0, help="simulated before: 0 in the air, 10 a heap of 20,000")
    parser.add_argument("--threads", type=int, help="as many as pay off unless said otherwise; 1 on a busy machine")
    arguments = parser.parse_args()
    for particles in arguments.particles:
        without, with_force, costs = ratio(particles, arguments.frames, arguments.seconds, arguments.threads)
        print(f"{particles:>9,} circles: {without:.2f} ms a frame without, {with_force:.2f} ms with, ratio {costs:.2f}")


if __name__ == "__main__":
    main()
