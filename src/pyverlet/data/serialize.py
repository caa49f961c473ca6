"""Serialises the state of objects to JSON and arrays: numbers, text, None, lists, tuples, tables and NumPy arrays only.

JSON has no tuples and no infinity; these become tables with one key: `{"$tuple": [...]}`, `{"$number": "inf"}`.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from pyverlet.common.errors import InputError

TUPLE, NUMBER, ARRAY = "$tuple", "$number", "$array"
_MARKS = {TUPLE, NUMBER, ARRAY}
_NUMBERS = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def pack(value: Any) -> Any:
    """Convert tuples and infinities to their form in JSON; arrays stay arrays. InputError for other types."""
    if value is None or isinstance(value, bool | str | np.ndarray):
        return value
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if math.isfinite(number) else {NUMBER: str(number)}
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, tuple):
        return {TUPLE: [pack(part) for part in value]}
    if isinstance(value, list):
        return [pack(part) for part in value]
    if isinstance(value, dict):
        if wrong := [key for key in value if not isinstance(key, str) or key in _MARKS]:
            raise InputError(f"a key is {wrong[0]!r}; allowed are texts that are no marks")
        return {key: pack(part) for key, part in value.items()}
    raise InputError(f"{type(value).__name__} is neither a number, text, list, tuple, table nor array")


def unpack(value: Any) -> Any:
    """The inverse of `pack`."""
    if isinstance(value, list):
        return [unpack(part) for part in value]
    if isinstance(value, dict):
        if len(value) == 1:
            mark, inner = next(iter(value.items()))
            if mark == TUPLE and isinstance(inner, list):
                return tuple(unpack(part) for part in inner)
            if mark == NUMBER and inner in _NUMBERS:
                return _NUMBERS[inner]
        return {key: unpack(part) for key, part in value.items()}
    return value


def map_arrays(value: Any, change: Callable[[Any], Any]) -> Any:
    """Apply `change` to each array in a value."""
    if isinstance(value, np.ndarray):
        return change(value)
    if isinstance(value, list):
        return [map_arrays(part, change) for part in value]
    if isinstance(value, dict):
        return {key: map_arrays(part, change) for key, part in value.items()}
    return value


def plain(value: Any) -> Any:
    """Convert the arrays in a value to lists of numbers."""
    return map_arrays(value, lambda array: pack(array.tolist()))
