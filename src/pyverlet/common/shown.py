"""One-line `repr`s of objects, such as `Drag(linear=0.1, quadratic=0)`: class and essential attributes."""

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np

_WIDEST = 80  # most characters of a value
_FIRST = 3  # entries of a list that are shown


def cut(text: str, most: int = 60) -> str:
    """The text, cut to at most so many characters."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def brief(value: Any) -> str:
    """The `repr` of a value, cut."""
    return cut(repr(value))


def text(value: Any) -> str:
    """A short single-line text of a value."""
    if isinstance(value, float | np.floating):
        return f"{value:g}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}"
    if isinstance(value, tuple):
        return f"({', '.join(map(text, value))}{',' * (len(value) == 1)})"
    name = getattr(value, "__qualname__", None)
    words = " ".join((name if isinstance(name, str) else repr(value)).split())
    return cut(words, _WIDEST)


def line(kind: str, /, **values: Any) -> str:
    """`Kind(name=value, ...)`, without values that are None."""
    return f"{kind}({', '.join(f'{name}={text(value)}' for name, value in values.items() if value is not None)})"


def count(number: int, one: str) -> str:
    """`1 link`, `2 links`."""
    return f"{number} {one}{'s' * (number != 1)}"


def listed(name: str, things: Iterable[Any]) -> str:
    """`2 obstacles: Disc at (0, 0) m, Disc at (1, 0) m`, with only the first few."""
    entries = list(things)
    first = ", ".join(map(text, entries[:_FIRST])) + (", ..." if len(entries) > _FIRST else "")
    return count(len(entries), name) + (f": {first}" if entries else "")


class Shown:
    """Base class of objects whose `repr` shows the attributes in `_shows`."""

    _shows: ClassVar[tuple[str, ...]] = ()

    def __repr__(self) -> str:
        return line(type(self).__name__, **{name: getattr(self, name) for name in self._shows})


class Records(np.ndarray[Any, Any]):
    """A structured array with a one-line `repr`."""

    def __repr__(self) -> str:
        if self.ndim != 1 or self.dtype.names is None:
            return repr(self.view(np.ndarray))
        return f"{count(len(self), 'record')} of ({', '.join(self.dtype.names)})"
