"""How far frames are from what memory allows: bytes that stages move, counted, beside times and bandwidth, measured.

What is counted, and what is derived from it for many cores: docs/design/many-cores.md.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from time import process_time

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT

FRAMES = 12
TRAFFIC = 2e8
"""Bytes that a measurement of the bandwidth moves at least: it takes some hundredths of a second."""


def stream(threads: int, size: float, tries: int = 5) -> float:
    """GB/s on so many threads over arrays of `size` bytes in all: STREAM's sum a = b + c, the best of some tries.

    Each element is 16 bytes: b and c are read, a is read before it is written, as caches do. By processor time over threads.
    """
    count = max(int(size / (12 * threads)), 1)
    arrays = [np.ones((3, count), np.float32) for _ in range(threads)]
    turns = max(1, int(TRAFFIC / (16 * count * threads)))

    def add(rows: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> None:
        for _ in range(turns):
            np.add(rows[0], rows[1], out=rows[2])

    best = np.inf
    for _ in range(tries):
        workers = [threading.Thread(target=add, args=(rows,)) for rows in arrays]
        spent = process_time()
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        best = min(best, (process_time() - spent) / threads)
    return 16e-9 * count * threads * turns / best


def moved(f: int, lanes: float, active: float, rebuilds: float, substeps: int) -> dict[str, float]:
    """Bytes a disc and substep by stage, of smooth discs of one size in numbers of f bytes, each array once a stage.

    What is written without being read counts twice, for caches read it first.

    Args:
        lanes, active: pairs of the list a disc; those in batches of eight of which one carries load.
        rebuilds: lists made, a substep.
    """
    made = lanes * (78 + 8 * f) + active * (24 + 12 * f) + 29 * f + 120
    return {
        "gather": (28 + 21 * f) / substeps,
        "integrate": 28 * f + 20 + 26 * f / substeps,
        "pairs": (lanes + active) * (8 + 8 * f) + 10 * f + 8 * f / substeps,
        "relax": 2 * (lanes * f + active * (8 + 3 * f) + 4 * f),
        "lists": rebuilds * made + 6 * f / substeps,
        "finish": 14 * f / substeps,
        "scatter": (4 + 28 * f) / substeps,
    }


def pairs_of(world: pv.World) -> tuple[float, float]:
    """Lanes of the list a disc, and those in batches of eight of which one carries load."""
    engine = world._frames.held.engine
    first, count, *_ = engine.pairs()
    impulse = engine.arrays["impulse"]
    batches = np.concatenate([impulse[a : a + n // 8 * 8].reshape(-1, 8) for a, n in zip(first, count, strict=True)])
    return float(count.sum()) / len(world), 8.0 * float((batches > 0).any(axis=1).sum()) / len(world)


def spent(world: pv.World, threads: int) -> tuple[dict[str, float], float]:
    """Nanoseconds a disc and substep by stage, each the shortest of some frames, or for lists their mean; lists a substep."""
    world.threads = threads
    world.step(DT)
    seen: dict[str, list[float]] = {}
    rebuilds = world.rebuilds
    for _ in range(FRAMES):
        world.step(DT)
        for stage, ms in world.profile.stages.items():
            seen.setdefault(stage, []).append(1e6 * ms / (len(world) * world.substeps))
    made = (world.rebuilds - rebuilds) / (FRAMES * world.substeps)
    return {stage: float(np.mean(ns) if stage == "lists" else np.min(ns)) for stage, ns in seen.items()}, made


def main(world: pv.World, counts: Sequence[int]) -> None:
    """Print the bandwidth of memory, and of each stage of a settled heap on one thread how much of it its bytes come to."""
    f, shares = world.dtype.itemsize, pairs_of(world)
    ns, rebuilds = spent(world, 1)
    bytes_moved = moved(f, *shares, rebuilds, world.substeps)
    held = len(world) * sum(bytes_moved.values())
    print(f"\nGB/s by processor time; arrays of {'':<10}" + "".join(f"{f'{p} threads':>12}" for p in counts))
    bandwidth = {}
    for size in (1e6, 1e7, held, 1e9):
        bandwidth[size] = [stream(p, size) for p in counts]
        print(f"{size / 1e6:>30,.0f} MB{'':<10}" + "".join(f"{each:>12.1f}" for each in bandwidth[size]))
    best = bandwidth[held][0]
    print(
        f"\n{len(world):,} settled discs, {shares[0]:.2f} lanes a disc, {shares[1]:.2f} in loaded batches, one thread\n"
        f"{'stage':<12}{'bytes':>8}{'ns':>8}{'GB/s':>8}{'ns that memory takes':>22}   a disc and substep"
    )
    for stage, each in bytes_moved.items():
        took = ns.get(stage, 0.0)
        print(f"{stage:<12}{each:>8.0f}{took:>8.2f}{each / took if took else 0.0:>8.1f}{each / best:>22.2f}")
    whole, took = sum(bytes_moved.values()), sum(ns.values())
    print(f"{'all':<12}{whole:>8.0f}{took:>8.2f}{whole / took:>8.1f}{whole / best:>22.2f}")
