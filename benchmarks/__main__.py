"""Run a comparison and print it.

`python -m benchmarks --particles 2000 20000` beside other engines, `python -m benchmarks physics` and `law` what their physics
is worth, `python -m benchmarks own` what pyverlet promises about its own speed, `python -m benchmarks materials` what
restitution, friction, masses and services cost, `python -m benchmarks links` what hangs together costs and how far it is
stretched, `python -m benchmarks page` how fast the live page is, `python -m benchmarks data` what it costs to keep worlds, to
step many, and to sweep settings, `python -m benchmarks scale` what frames cost against the number of discs and of threads,
`python -m benchmarks busy` what frames take beside other programs, `python -m benchmarks soak` whether anything grows in a page
that is served for long, and `python -m benchmarks beside --checkout FOLDER` this version beside another one.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import pyverlet as pv
from benchmarks import beside, busy, changes, data, law, linked_frames, links, materials, own, page, physics, scale, soak
from benchmarks.engines import CAREFUL, DT, ENGINES, Engine, Heap, overlap
from benchmarks.tables import write
from pyverlet.common.threads import max_threads
from pyverlet.scenes import report

SETTLE_SECONDS = 10.0
"""Simulated before anything is measured, by pyverlet: one settled heap for all."""

OWN_FRAMES = 60
"""Frames each engine then gets to come to terms with the heap in its own way."""


@dataclass(frozen=True)
class Row:
    """One engine on one heap."""

    particles: int
    engine: str
    settings: str
    ms_per_frame: float
    ratio: float
    overlap_mean: float
    overlap_max: float
    outside: int


def settled_heap(particles: int) -> Heap:
    """That of a settled cage."""
    world = pv.scenes.get("cage").world(particles=particles)
    world.run(seconds=SETTLE_SECONDS, dt=DT)
    extent = world.boundary.extent()
    assert extent is not None
    return Heap(world.position.copy(), extent[2])


def measure(engines: list[type[Engine]], heap: Heap, frames: int) -> list[Row]:
    """Step all engines in turn, some frames each, so that the machine's moods hit them alike."""
    worlds = [engine(heap) for engine in engines]
    for world in worlds:
        for _ in range(OWN_FRAMES):
            world.step()
    settled = [world.position().copy() for world in worlds]  # all after the same time, whoever makes more frames when timed
    times = own.in_turn([world.step for world in worlds], max(frames // own.ROUNDS, 1))
    ours = min(ms for world, ms in zip(worlds, times, strict=True) if world.settings.startswith("8 substeps"))
    rows = []
    for world, ms, now in zip(worlds, times, settled, strict=True):
        found, outside = overlap(now), int((np.hypot(*now.astype(float).T) > heap.cage).sum())
        rows.append(Row(len(now), world.name, world.settings, ms, ms / ours, found.mean, found.max, outside))
    return rows


def installed(engine: type[Engine]) -> bool:
    """Whether this engine can be built here; says on standard error why not."""
    try:
        engine(Heap(np.zeros((1, 2)), 10.0))
    except ImportError as error:
        sys.stderr.write(f"left out: {engine.name} ({error}; pip install 'pyverlet[bench]')\n")
    except pv.InputError as error:  # two threads on one core
        sys.stderr.write(f"left out: {engine.name} ({error})\n")
    else:
        return True
    return False


def machine() -> str:
    """What this was measured on."""
    versions = []
    for name in ("pyverlet", "numpy", "pymunk", "pyb2d3"):
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    triad = report.triad()
    return (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"{', '.join(versions)}; NumPy triad {triad['ns_per_element']:.2f} ns an element"
    )


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("table", nargs="?", choices=TABLES, default="speed", help="what to compare")
    parser.add_argument("--particles", type=int, nargs="+", help="discs in the cage: 2000 20000 for speed, 2000 for physics")
    parser.add_argument("--frames", type=int, default=60, help="frames measured for each engine")
    parser.add_argument("--csv", type=Path, help="write the rows to this file too")
    parser.add_argument("--plot", type=Path, help="speed, scale: draw the cost against the number of discs into this file")
    parser.add_argument("--million", action="store_true", help="own, materials: a million discs too, half an hour")
    parser.add_argument("--scene", default="cage", help="page: what is shown")
    parser.add_argument("--seconds", type=float, default=12.0, help="page: how long each is watched")
    parser.add_argument("--threads", type=int, help="page, beside, scale: that the physics may use")
    parser.add_argument(
        "--largest", type=int, default=scale.LARGEST, help="scale: most discs, from 1,000 on; a million: half an hour"
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="soak: how long")
    parser.add_argument("--checkout", type=Path, help="beside: the folder of another version's sources")
    parser.add_argument("--turns", type=int, default=60, help="beside: of each version")
    parser.add_argument("--busy-frames", type=int, default=1200, help="busy: frames of each world")
    arguments = parser.parse_args()
    if arguments.table == "beside" and arguments.checkout is None:
        parser.error("beside needs --checkout FOLDER: which version to run beside this one")
    print(machine())
    try:
        if TABLES[arguments.table](arguments) is False:
            sys.exit(1)
    except pv.InputError as error:
        parser.error(str(error))


def others(arguments: argparse.Namespace) -> None:
    """This version beside the one in another folder."""
    threads = [arguments.threads] if arguments.threads else sorted({1, max_threads()})
    beside.main(arguments.checkout, arguments.particles or [20_000, 100_000], threads, arguments.turns)


def linked(arguments: argparse.Namespace) -> None:
    """What hangs together: beside other engines, and ours alone."""
    links.main(arguments.csv)
    linked_frames.main(arguments.csv)


TABLES: dict[str, Callable[[argparse.Namespace], bool | None]] = {
    "speed": lambda given: speed(given),
    "law": lambda _: law.main([each for each in CAREFUL if installed(each)]),
    "physics": lambda given: physics.main([each for each in CAREFUL if installed(each)], (given.particles or [2_000])[0]),
    "own": lambda given: own.main(report.triad()["ns_per_element"], given.million),
    "page": lambda given: page.main(given.scene, given.particles or [20_000, 100_000, 1_000_000], given.seconds, given.threads),
    "materials": lambda given: materials.main((given.particles or [20_000])[0], given.csv, million=given.million),
    "links": linked,
    "data": lambda given: data.main((given.particles or [1_000_000])[0]),
    "busy": lambda given: busy.main((given.particles or [20_000])[0], given.busy_frames),
    "soak": lambda given: soak.main(given.minutes),
    "beside": others,
    "changes": lambda given: changes.main(),
    "scale": lambda given: scale.main(given.largest, given.threads, given.csv, given.plot),
}
"""Name, and what prints it; False if something does not hold."""


def speed(arguments: argparse.Namespace) -> None:
    """Every engine with one table for each number of particles."""
    engines = [engine for engine in ENGINES if installed(engine)]
    rows: list[Row] = []
    for particles in arguments.particles or [2_000, 20_000]:
        heap = settled_heap(particles)
        print(f"\n{particles:,} discs settled for {SETTLE_SECONDS:g} s")
        print(f"{'engine':<28}{'settings':<34}{'ms a frame':>11}{'ratio':>8}{'mean overlap':>14}{'max':>8}{'outside':>9}")
        for row in measure([e for e in engines if particles <= e.most], heap, arguments.frames):
            rows.append(row)
            print(
                f"{row.engine:<28}{row.settings:<34}{row.ms_per_frame:>11.2f}{row.ratio:>8.1f}"
                f"{row.overlap_mean:>14.3%}{row.overlap_max:>8.2%}{row.outside:>9}"
            )
    write(rows, arguments.csv)
    if arguments.plot:
        plot(rows, arguments.plot)


def plot(rows: list[Row], path: Path) -> None:
    """Milliseconds a frame against the number of discs, both on logarithmic axes, a line for each engine."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    colours = ("#0072B2", "#56B4E9", "#CC79A7", "#D55E00", "#009E73", "#999999")
    styles = zip(("o-", "s-", "p-", "^--", "D--", "v:"), colours, strict=True)
    for (mark, colour), name in zip(styles, dict.fromkeys(row.engine for row in rows), strict=False):
        mine = [row for row in rows if row.engine == name]
        axes.loglog([row.particles for row in mine], [row.ms_per_frame for row in mine], mark, color=colour, label=name)
    axes.axhline(1e3 / 60, color="k", linewidth=0.7)
    axes.annotate("60 frames a second", (rows[0].particles, 1e3 / 60), xytext=(0, 3), textcoords="offset points", fontsize=8)
    axes.set(xlabel="discs in the cage", ylabel="ms a frame of 1/60 s", title="A settled heap, whole frames")
    axes.grid(which="major", alpha=0.3)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
