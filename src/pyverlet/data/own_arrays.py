"""Arrays of the user's own in files: bytes, and which dtype they are of."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import InputError

Array = NDArray[Any]


def kind_of(name: str, column: Array) -> tuple[Any, list[int]]:
    """The dtype of a column, as `numpy.lib.format` describes it, and the shape of a row.

    Raises:
        InputError: it holds Python objects.
    """
    if column.dtype.hasobject:
        raise InputError(f"data[{name!r}] holds Python objects; allowed in files are numbers, texts and dates of NumPy's dtypes")
    return np.lib.format.dtype_to_descr(column.dtype.newbyteorder("<")), list(column.shape[1:])


def to_bytes(column: Array) -> NDArray[np.uint8]:
    """(rows, bytes of each) of a column."""
    little = column.astype(column.dtype.newbyteorder("<"))
    return np.frombuffer(little.tobytes(), np.uint8).reshape(len(column), little.nbytes // len(column))


def from_bytes(content: NDArray[np.uint8], described: Any, row: list[int]) -> Array:
    """The column again.

    Raises:
        InputError: it cannot be one.
    """
    dtype = np.lib.format.descr_to_dtype(described)
    if dtype.hasobject:
        raise InputError(f"an array of data is of dtype {dtype}; allowed are dtypes without Python objects")
    return np.frombuffer(content.tobytes(), dtype).reshape(len(content), *row).astype(dtype.newbyteorder("="))
