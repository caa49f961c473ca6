"""Sliders that a program reads and the page shows."""

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

from pyverlet.common import checks
from pyverlet.common.errors import InputError

Board = dict[str, "Slider"]  # sliders by name, in the order they were made

_of_the_program: Board = {}
_board: ContextVar[Board] = ContextVar("pyverlet_sliders")

MOST = 24  # on one board


class Slider:
    """A number that may be changed on the page: made by `slider`.

    Attributes:
        name: beside it on the page.
        low, high: its ends.
        start: where it was first.
        step: from one value to the next; 0 for none in particular.
    """

    def __init__(self, name: str, low: float, high: float, start: float, step: float) -> None:
        self.name, self.low, self.high, self.start, self.step = name, low, high, start, step
        self._value = start

    @property
    def value(self) -> float:
        """What it says now, from `low` to `high`; may be set."""
        return self._value

    @value.setter
    def value(self, value: float) -> None:
        self._value = checks.number(self.name, value, least=self.low, most=self.high)

    def __float__(self) -> float:
        return self._value

    def __repr__(self) -> str:
        return f"Slider({self.name!r}, {self.low:g}, {self.high:g}, {self._value:g})"

    @property
    def made_as(self) -> tuple[float, float, float, float]:
        """What it was asked for with."""
        return self.low, self.high, self.start, self.step


def slider(name: str, low: float, high: float, value: float | None = None, *, step: float = 0.0) -> Slider:
    """A slider on the page; without a page it stays where it starts.

    Asked for again by the same name and with the same numbers, it is the same slider, where the user has left it.

    Args:
        name: beside it on the page.
        low: its left end.
        high: its right end, above `low`.
        value: where it starts; halfway unless said.
        step: from one value to the next; 0 for none in particular.

    Returns:
        Its `value` is what it says now.

    Raises:
        InputError: an argument is outside what is allowed.
    """
    if not 0 < len(str(name).strip()) <= 60:
        raise InputError(f"name is {name!r}; allowed is a text of 1 to 60 letters")
    low = checks.number("low", low)
    high = checks.number("high", high, above=low)
    start = checks.number("value", 0.5 * (low + high) if value is None else value, least=low, most=high)
    step = checks.number("step", step, least=0.0)
    name, board = str(name), on_board()
    made = Slider(name, low, high, start, step)
    known = board.get(name)
    if known is not None and known.made_as == made.made_as:
        return known
    if known is None and len(board) >= MOST:
        raise InputError(f"slider {name!r} would be the {MOST + 1}th; allowed are {MOST}")
    board[name] = made
    return made


def on_board() -> Board:
    """The sliders of the sketch that is at work, or of the program."""
    return _board.get(_of_the_program)


@contextlib.contextmanager
def board(sliders: Board) -> Iterator[None]:
    """Sliders that are made meanwhile, in this thread, go there."""
    token = _board.set(sliders)
    try:
        yield
    finally:
        _board.reset(token)
