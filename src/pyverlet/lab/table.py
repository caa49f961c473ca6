"""A table for a terminal, a page or a program."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pyverlet.ground.progress import OnProgress

T = TypeVar("T")
U = TypeVar("U")


@dataclass(frozen=True)
class Table:
    """A series of runs: head and rows of text for reading, and a mapping of values for each run."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    values: Sequence[Mapping[str, Any]]

    def markdown(self) -> str:
        lines = [self.head, ["---"] * len(self.head), *self.rows]
        return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def measured(
    head: str,
    rows: Mapping[str, T],
    columns: Mapping[str, U],
    measure: Callable[[T, U], tuple[str, Mapping[str, Any]]],
    progress: OnProgress | None = None,
) -> Table:
    """A table of `measure(row, column)`, the text and the values of a cell; rows and columns by their headings."""
    cells: list[list[str]] = []
    values: list[Mapping[str, Any]] = []
    for name, row in rows.items():
        cells.append([name])
        for column in columns.values():
            if progress:
                progress(len(values) + 1, len(rows) * len(columns))
            text, found = measure(row, column)
            cells[-1].append(text)
            values.append(found)
    return Table((head, *columns), cells, values)
