"""What benchmarks share: how a call is timed, and rows as files."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import Any


def timed(act: Callable[[], object]) -> float:
    """Milliseconds of a call."""
    start = perf_counter()
    act()
    return 1e3 * (perf_counter() - start)


def write(rows: Sequence[Any], path: Path | None) -> None:
    """Dataclasses as CSV in `path`, and as JSON beside it; nothing without a path."""
    if path is None:
        return
    columns = [asdict(row) for row in rows]
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(columns[0]))
        writer.writeheader()
        writer.writerows(columns)
    path.with_suffix(".json").write_text(json.dumps(columns, indent=1))
