"""Output of the command line."""

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import typer

FAILED = 1  # exit code of a command with a negative result


write = typer.echo  # a line on standard output
note = partial(typer.echo, err=True)  # a line on standard error


def write_json(value: Any) -> None:
    """Print `value` as JSON; NaN and infinity, which JSON lacks, are refused."""
    write(json.dumps(value, indent=2, allow_nan=False))


def tell(value: Any, text: str, *, as_json: bool) -> None:
    """Print a command's result as JSON, or as text."""
    if as_json:
        write_json(value)
    else:
        write(text)


def fail_if(failed: object) -> None:
    """Exit with the code FAILED if `failed` is true."""
    if failed:
        raise typer.Exit(FAILED)


def table(rows: Iterable[tuple[str, str]]) -> str:
    """Names on the left, values on the right."""
    lines = list(rows)
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {value}".rstrip() for name, value in lines)


def columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Rows under headings: text left-aligned, numbers right-aligned."""
    cells = [list(head), *map(list, rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
    numeric = [all(not row[k] or row[k][0] in "+-.0123456789" for row in rows) for k in range(len(head))]
    aligned = (
        "  ".join(f"{cell:{'>' if number else '<'}{width}}" for cell, width, number in zip(row, widths, numeric, strict=True))
        for row in cells
    )
    return "\n".join(line.rstrip() for line in aligned)


def report(values: Mapping[str, Any]) -> str:
    """A report's dictionary as a table."""
    frame, energy, overlap, budget = (values[name] for name in ("ms_per_frame", "energy", "overlap", "budget"))
    method = f"{values['integrator']}, {values['substeps']} substeps, {values['dtype']}, {_many(values['threads'], 'thread')}"
    rows = [
        ("scene", values["scene"]),
        ("particles", f"{values['particles']:,}"),
        ("method", method),
        ("simulated", f"{values['seconds']:.4g} s in {values['frames']:,} frames of {1e3 * values['dt']:.4g} ms"),
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
    if values["ledger"]:
        booked = ", ".join(f"{account} {joules:.4g}" for account, joules in values["ledger"].items() if joules)
        rows.append(("ledger", f"{booked} J"))
    rows.append(("overlap", f"{100 * overlap['mean']:.3f} % mean, {100 * overlap['max']:.2f} % largest"))
    rows.append(("contacts", f"{values['contacts']:,}"))
    rows.append(("escaped", f"{values['escaped']:,}"))
    rows.append(("state hash", values["state_hash"]))
    return table(rows)


def stages(values: Mapping[str, Any]) -> str:
    """The stages of a frame in a report, the longest first."""
    whole, each = sum(values["stages"].values()), values["particles"] * values["substeps"]
    rows = [
        (name, f"{ms:.3f}", f"{100 * ms / whole:.1f}", f"{1e6 * ms / each:.2f}", f"{values['stage_threads'][name]}")
        for name, ms in sorted(values["stages"].items(), key=lambda stage: -stage[1])
    ]
    return columns(("stage", "ms a frame", "% of it", "ns a circle and substep", "threads at most"), rows)


def _many(count: int, noun: str) -> str:
    return f"{count:,} {noun}" + ("" if count == 1 else "s")
