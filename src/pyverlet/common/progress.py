"""Progress of long work on standard error, which leaves standard output alone."""

import sys
from collections.abc import Callable, Iterator, Sequence
from time import monotonic
from typing import Self, TypeVar

T = TypeVar("T")

OnProgress = Callable[[int, int], None]  # called as progress(done, total) during long work
QUIET_S = 0.4  # shorter work shows no progress
EVERY_S = 0.1  # update interval on a terminal
EVERY_LOGGED_S = 5.0  # interval of lines if standard error is a file or a pipe
BAR = 20  # characters of the bar on a terminal


class Progress:
    """A progress line on standard error with the part done and the remaining time; a context manager.

    On a terminal it is rewritten, with a bar, and removed at the end. Elsewhere lines are written at intervals.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._live = sys.stderr.isatty()
        self._next = monotonic() + QUIET_S
        self._first: tuple[float, int] | None = None
        self._width = 0

    def __enter__(self) -> Self:
        return self

    def __call__(self, done: int, total: int) -> None:
        """Report that `done` of `total` are done."""
        now = monotonic()
        # Measured from the first call, since earlier work, such as building worlds, has another speed.
        then, before = self._first = self._first or (now, done)
        if now < self._next:
            return
        self._next = now + (EVERY_S if self._live else EVERY_LOGGED_S)
        left = ""
        if done > before:
            seconds = round((now - then) * (total - done) / (done - before))
            left = f", {seconds} s left" if seconds < 60 else f", {seconds // 60} min {seconds % 60} s left"
        bar = f" [{'#' * (BAR * done // max(total, 1)):.<{BAR}}]" if self._live else ""
        line = f"{self._text}: {done} of {total}{bar}{left}"
        sys.stderr.write(f"\r{line:<{self._width}}" if self._live else f"{line}\n")
        sys.stderr.flush()
        self._width = max(self._width, len(line))

    @classmethod
    def over(cls, text: str, things: Sequence[T]) -> Iterator[T]:
        """Yield each of these objects, with a progress line."""
        with cls(text) as progress:
            for done, thing in enumerate(things):
                yield thing
                progress(done + 1, len(things))

    def __exit__(self, *_: object) -> None:
        if self._live and self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()
