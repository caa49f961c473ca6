"""Runs a world without showing it and reports time per frame and stage, energy, overlap and state hash."""

import statistics
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.constants import FRAME_BUDGET_MS
from pyverlet.common.errors import InputError
from pyverlet.common.progress import OnProgress
from pyverlet.world.world import World

MAX_FRAMES = 10_000_000  # longest run: more is almost surely a mistyped duration (46 hours of simulated time at 60 Hz)

DEFAULT_SECONDS = 5.0

TRIAD_ELEMENTS = 1 << 22  # elements of each array of the triad: 32 MiB each in float64, too large for most caches


def frame_count(*, seconds: float | None, dt: float, frames: int | None = None) -> int:
    """Number of frames of `dt` seconds in `seconds`, DEFAULT_SECONDS if that is None, or `frames` if that is given.

    Raises:
        InputError: a value is not positive and finite, both are given, or the run would be longer than MAX_FRAMES.
    """
    checks.number("dt", dt, above=0.0)
    if frames is not None:
        if seconds is not None:
            raise InputError(f"frames is {frames} and seconds is {seconds:g}; allowed is one of them, not both")
        return checks.integer("frames", frames, most=MAX_FRAMES)
    wanted = checks.number("seconds", DEFAULT_SECONDS if seconds is None else seconds, above=0.0) / dt
    if wanted > MAX_FRAMES:
        raise InputError(f"seconds / dt is {wanted:.4g} frames; allowed are at most {MAX_FRAMES:,}")
    return max(1, round(wanted))  # as in World.run


def run(
    world: World,
    *,
    scene: str,
    frames: int,
    dt: float,
    progress: OnProgress | None = None,
    observe: Callable[[World], None] | None = None,
    step: Callable[[float], None],
) -> dict[str, Any]:
    """Step `world` by `frames` frames of `dt` seconds, each by calling `step`.

    progress(frames done, frames) and observe(world) are called after every frame and not measured.

    Returns:
    A report of plain numbers, texts and tables, for JSON. Times in milliseconds unless named otherwise, energies in J.

    Raises:
        NonFiniteError: the state turned NaN or infinite.
    """
    frame_ms: list[float] = []
    stage_ms: dict[str, list[float]] = {}
    stage_threads: dict[str, int] = {}
    for done in range(1, frames + 1):
        before, start = world.frames, perf_counter()
        step(dt)
        frame_ms.append(1e3 * (perf_counter() - start))
        # A panel that is drawn less often does not step its world in every frame.
        for stage, ms in world.profile.stages.items() if world.frames != before else ():
            stage_ms.setdefault(stage, []).append(ms)
            stage_threads[stage] = max(stage_threads.get(stage, 1), world.profile.threads.get(stage, 1))
        if observe:
            observe(world)
        if progress:
            progress(done, frames)
    median = statistics.median(frame_ms)
    energy = world.energy()
    overlap = world.overlap()
    return {
        "scene": scene,
        "particles": len(world),
        "substeps": int(world.substeps),
        "integrator": type(world.integrator).name(),
        "dtype": np.dtype(world.dtype).name,
        "threads": int(world.threads),
        "dt": dt,
        "frames": frames,
        "seconds": frames * dt,
        "ms_per_frame": {"median": median, "p95": float(np.percentile(frame_ms, 95))},
        "budget": {"limit_ms": FRAME_BUDGET_MS, "frames_over": sum(ms > FRAME_BUDGET_MS for ms in frame_ms)},
        "ns_per_particle_substep": 1e6 * median / (max(len(world), 1) * world.substeps),
        # Means over all frames, with 0 for stages that did not run, so that they add up.
        "stages": {stage: sum(ms) / frames for stage, ms in stage_ms.items()},
        "stage_threads": stage_threads,
        "energy": {name: float(getattr(energy, name)) for name in ("kinetic", "potential", "links", "total")},
        "ledger": world.ledger.as_dict() if world.keeps_ledger else None,
        "overlap": {"mean": float(overlap.mean), "max": float(overlap.max)},
        "contacts": int(overlap.contacts),
        "escaped": int(world.escaped()),
        "state_hash": world.state_hash(),
    }


def triad(repeats: int = 15) -> dict[str, float]:
    """Time NumPy's a = b + s c on large arrays: the speed of this machine's memory, for comparison.

    Returns:
    ns_per_element: median over `repeats`; gb_per_s: the corresponding traffic, five passes over float64 arrays.
    """
    a, b, c = (np.full(TRIAD_ELEMENTS, value) for value in (0.0, 1.0, 2.0))
    times = []
    for _ in range(repeats):
        start = perf_counter()
        np.multiply(c, 3.0, out=a)
        np.add(a, b, out=a)
        times.append(perf_counter() - start)
    ns = 1e9 * statistics.median(times) / TRIAD_ELEMENTS
    return {"ns_per_element": ns, "gb_per_s": 5 * 8 / ns}
