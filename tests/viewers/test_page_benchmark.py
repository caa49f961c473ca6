"""The measurement of the page runs and accounts for all of a frame's time."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from .browser import chromium

ROOT = Path(__file__).resolve().parents[2]

PARTS = ("physics ran", "queued", "waited", "a frame every")
"""Of a frame's time, as the benchmark of the page prints them, and the whole."""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="who had the processor is read off Linux's /proc")
def test_the_page_is_measured_watched_and_unwatched() -> None:
    chromium()
    command = [sys.executable, "-m", "benchmarks", "page", "--particles", "300", "--seconds", "2"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=True)
    _, unwatched, alone, watched, shared, pictures, costs, late = run.stdout.splitlines()
    for which, pace, times in (("unwatched", unwatched, alone), ("watched", watched, shared)):
        assert pace.split()[:2] == ["300", which]
        ran, queued, waited, every = (float(re.findall(rf"{part} ([\d.]+)", pace + times)[0]) for part in PARTS)
        assert ran > 0
        assert ran + queued + waited == pytest.approx(every, abs=0.05)  # a frame's time, all accounted for
    assert 0 < float(pictures.split()[0]) < 70
    each, whole = costs.split(": in all ")
    assert {"web", "renderer"} <= set(re.findall(r"[a-z-]+(?= [\d.]+)", each))
    assert float(whole.split(",")[0]) == pytest.approx(sum(map(float, re.findall(r"\d+\.\d", each))), abs=0.5)
    assert float(late.split()[3]) > 0
