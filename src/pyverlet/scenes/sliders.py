"""Sliders that programs read and the page shows."""

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

from pyverlet.common import checks
from pyverlet.common.errors import InputError

Board = dict[str, "Slider"]  # sliders by name, in order of creation

_of_the_program: Board = {}
_board: ContextVar[Board] = ContextVar("pyverlet_sliders")

MOST = 24  # most sliders of a program


class Slider:
    """A number that can be changed on the page: made by `slider`.

    Attributes:
        name: label on the page.
        low, high: its ends.
        start: initial value.
        step: between values; 0 for none.
    """

    def __init__(self, name: str, low: float, high: float, start: float, step: float) -> None:
        self.name, self.low, self.high, self.start, self.step = name, low, high, start, step
        self._value = start

    @property
    def value(self) -> float:
        """The current value, from `low` to `high`; may be set."""
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
        """Its arguments."""
        return self.low, self.high, self.start, self.step


def slider(name: str, low: float, high: float, value: float | None = None, *, step: float = 0.0) -> Slider:
    """Make a slider on the page; without a page it keeps its initial value.

    Calling it again with the same name and numbers returns the same slider, with the user's value.

    Args:
        name: label on the page.
        low: its left end.
        high: its right end, above `low`.
        value: initial value; the middle by default.
        step: between values; 0 for none.

    Returns:
    A slider, whose `value` is current.

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
    """The sliders of the running sketch, or of the program."""
    return _board.get(_of_the_program)


@contextlib.contextmanager
def board(sliders: Board) -> Iterator[None]:
    """Context in which new sliders of this thread are added to these."""
    token = _board.set(sliders)
    try:
        yield
    finally:
        _board.reset(token)
