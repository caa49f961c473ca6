"""Specifications of arrays from outside, checked before kernels use them: kernels check no bounds."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError


@dataclass(frozen=True)
class Field:
    """The specification of one array."""

    dtype: DTypeLike | None  # of its numbers; None: the world's, float32 or float64
    rows: str  # name of its number of rows, shared by arrays of equal length
    width: int = 0  # 0 for (rows,), else (rows, width)
    least: float | None = None  # bounds of the values, like `most` and `above`
    most: float | None = None
    above: float | None = None
    below: str = ""  # name of a number of rows that limits the values, which are indices
    infinite: bool = False  # whether infinity is allowed
    nan: bool = False  # whether whole rows may be NaN
    order: str = ""  # "ascending" (strictly), "rising" (with equal values), or "permutation" of 0 to rows - 1

    def check(self, name: str, array: Array, real: np.dtype[Any], sizes: dict[str, int]) -> None:
        """Refuse an array that does not match; `sizes`: known numbers of rows, to which its own is added.

        Raises:
            InputError: in one sentence that starts with `name`.
        """
        dtype = real if self.dtype is None else np.dtype(self.dtype)
        shape = (sizes.setdefault(self.rows, len(array) if array.ndim else 0), *((self.width,) if self.width else ()))
        if array.dtype != dtype or array.shape != shape:
            raise InputError(f"{name} is {array.dtype} of shape {array.shape}; allowed is {dtype} of shape {shape}")
        if not array.size:
            return
        low, high = array.min(), array.max()
        if dtype.kind == "f" and not (np.isfinite(low) and np.isfinite(high)):
            self._check_floats(name, array)
            if self.nan and np.isnan(low):
                return
        most = sizes[self.below] - 1 if self.below else self.most
        if (self.least is not None and low < self.least) or (self.above is not None and low <= self.above):
            raise InputError(f"{name} has {low:g}; allowed is {self._allowed(most)}")
        if most is not None and high > most:
            raise InputError(f"{name} has {high:g}; allowed is {self._allowed(most)}")
        self._check_order(name, array)

    def _check_floats(self, name: str, array: Array) -> None:
        bad = ~np.isfinite(array)
        if self.infinite:
            bad = np.isnan(array)
        if self.nan:
            lost = np.isnan(array)
            bad &= ~(lost.all(axis=1, keepdims=True) if array.ndim > 1 else lost)
        if bad.any():
            row = int(np.flatnonzero(bad.any(axis=1) if bad.ndim > 1 else bad)[0])
            raise InputError(f"{name}[{row}] is {array[row]}; allowed are finite numbers")

    def _check_order(self, name: str, array: Array) -> None:
        if self.order == "permutation":
            seen = np.zeros(len(array), bool)
            seen[array] = True  # already checked to be within bounds
            if not seen.all():
                raise InputError(f"{name} lacks {int(np.argmin(seen))}; allowed is each of 0 to {len(array) - 1} once")
        elif self.order:
            rises = array[1:] > array[:-1] if self.order == "ascending" else array[1:] >= array[:-1]
            if not rises.all():
                raise InputError(f"{name}[{int(np.argmin(rises)) + 1}] is less than the number before; allowed is {self.order}")

    def _allowed(self, most: float | None) -> str:
        limits = ("greater than", self.above), ("at least", self.least), ("at most", most)
        return " and ".join(f"{text} {limit:g}" for text, limit in limits if limit is not None)
