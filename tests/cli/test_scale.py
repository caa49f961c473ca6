"""`python -m benchmarks scale`: its fits, what it prints, and its picture."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_fits_find_what_times_are_made_of() -> None:
    code = """
from math import isclose
from benchmarks.roofline import moved
from benchmarks.scale import exponent, line, serial_share
n = (1e3, 1e4, 1e5)
c0, c1 = line(n, [0.02 + 3e-4 * each for each in n])  # T = c0 + c1 n
assert isclose(c0, 0.02, rel_tol=1e-9) and isclose(c1, 3e-4, rel_tol=1e-9)
assert line(n, [3e-4 * each - 0.01 for each in n])[0] == 0.0  # no frame takes less than no time
assert isclose(exponent(n, [7 * each**1.25 for each in n]), 1.25, rel_tol=1e-9)  # T = 7 n^b
for s in (0.0, 0.01, 0.3, 1.0):  # T(p) = T(1) (s + (1 - s) / p)
    assert isclose(serial_share({p: 5 * (s + (1 - s) / p) for p in (1, 2, 4, 16)}), s, abs_tol=1e-9)
smaller, larger = (moved(f, 3.0, 2.5, 0.1, 8) for f in (4, 8))
assert all(smaller[stage] < larger[stage] <= 2 * smaller[stage] for stage in smaller)  # numbers twice as long, indices not
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, timeout=300, check=True)


@pytest.mark.slow
def test_costs_are_measured_fitted_and_drawn(tmp_path: Path) -> None:
    table, picture = tmp_path / "rows.csv", tmp_path / "scale.png"
    command = [sys.executable, "-m", "benchmarks", "scale", "--largest", "300", "--threads", "1"]
    run = subprocess.run(
        [*command, "--csv", str(table), "--plot", str(picture)], cwd=ROOT, capture_output=True, text=True, timeout=900, check=True
    )
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [(row["motion"], row["particles"], row["threads"]) for row in rows] == [
        ("settled", "300", "1"),
        ("falling", "300", "1"),
    ]
    for row in rows:
        # Nanoseconds a disc and substep are those of the frame over all of them.
        each = 1e6 * float(row["ms"]) / (300 * int(row["substeps"]))
        assert float(row["ns_per_particle_substep"]) == pytest.approx(each)
        assert 0 <= float(row["mean"]) <= float(row["largest"]) < 0.05
    assert "GB/s" in run.stdout
    assert "ns that memory takes" in run.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
