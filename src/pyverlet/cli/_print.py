"""What the command line prints: results on standard output, progress on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from time import monotonic
from typing import Any

QUIET_S = 0.4
"""Work that is over sooner shows no progress."""

EVERY_S = 0.1
"""Time between updates on a terminal."""

EVERY_LOGGED_S = 5.0
"""Time between lines where standard error is a file or a pipe."""


class Progress:
    """A line on standard error saying how much of some work is done; used as a context manager.

    On a terminal it rewrites itself and disappears at the end. Elsewhere a line is written now and then.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._started = monotonic()
        self._live = sys.stderr.isatty()
        self._next = self._started + QUIET_S
        self._width = 0

    def __enter__(self) -> Progress:
        return self

    def __call__(self, done: int, total: int) -> None:
        """Say that `done` of `total` are done."""
        now = monotonic()
        if now < self._next:
            return
        self._next = now + (EVERY_S if self._live else EVERY_LOGGED_S)
        line = f"{self._text}: {done} of {total}"
        sys.stderr.write(f"\r{line:<{self._width}}" if self._live else f"{line}\n")
        sys.stderr.flush()
        self._width = max(self._width, len(line))

    def __exit__(self, *_: object) -> None:
        if self._live and self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()


def note(text: str) -> None:
    """A line on standard error."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def write(text: str) -> None:
    """A line on standard output."""
    sys.stdout.write(f"{text}\n")


def write_json(value: Any) -> None:
    """`value` as JSON on standard output; NaN and infinity, which JSON does not know, are refused."""
    write(json.dumps(value, indent=2, allow_nan=False))


def table(rows: Iterable[tuple[str, str]]) -> str:
    """Names on the left, values on the right."""
    lines = list(rows)
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {value}".rstrip() for name, value in lines)


def report(values: Mapping[str, Any]) -> str:
    """A report's dictionary as a table for reading."""
    frame, energy, overlap = values["ms_per_frame"], values["energy"], values["overlap"]
    budget = values["budget"]
    rows = [
        ("scene", values["scene"]),
        ("particles", f"{values['particles']:,}"),
        (
            "method",
            f"{values['integrator']}, {values['substeps']} substeps, {values['dtype']}, {_many(values['threads'], 'thread')}",
        ),
        ("simulated", f"{values['seconds']:.4g} s in {values['frames']:,} frames of {1e3 * values['dt']:.4g} ms"),
        ("compiling", f"{values['compile_s']:.2f} s"),
        ("ms per frame", f"{frame['median']:.3f} median, {frame['p95']:.3f} for 95 % of frames"),
        ("budget", f"{_many(budget['frames_over'], 'frame')} over {budget['limit_ms']:g} ms"),
        ("per circle", f"{values['ns_per_particle_substep']:.1f} ns a substep"),
    ]
    if "triad" in values:
        triad = values["triad"]
        rows.append(("memory here", f"{triad['ns_per_element']:.2f} ns an element of a = b + s c, {triad['gb_per_s']:.1f} GB/s"))
        rows.append(("ratio", f"{values['ratio_to_triad']:.1f} elements of it a circle and substep"))
    rows.append(("", ""))
    rows += [(f"  {name}", f"{ms:8.3f} ms a frame") for name, ms in values["stages"].items()]
    rows.append(("", ""))
    rows.append(("energy", ", ".join(f"{name} {joules:.6g}" for name, joules in energy.items()) + " J"))
    rows.append(("overlap", f"{100 * overlap['mean']:.3f} % mean, {100 * overlap['max']:.2f} % largest"))
    rows.append(("contacts", f"{values['contacts']:,}"))
    rows.append(("escaped", f"{values['escaped']:,}"))
    rows.append(("state hash", values["state_hash"]))
    return table(rows)


def _many(count: int, noun: str) -> str:
    return f"{count:,} {noun}" + ("" if count == 1 else "s")
