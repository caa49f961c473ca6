"""Checks of arguments: each returns the value in the engine's form or raises InputError with one sentence."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pyverlet.common.errors import InputError


def number(
    name: str, value: SupportsFloat, *, above: float | None = None, least: float | None = None, most: float | None = None
) -> float:
    """A finite float; greater than `above`, at least `least` and at most `most` where given."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}; allowed is {_allowed(above, least, most)}") from None
    except OverflowError:  # an integer beyond all floats
        raise InputError(f"{name} is too large for a float; allowed is {_allowed(above, least, most)}") from None
    outside = (above is not None and result <= above) or (least is not None and result < least)
    if not math.isfinite(result) or outside or (most is not None and result > most):
        raise InputError(f"{name} is {result:g}; allowed is {_allowed(above, least, most)}")
    return result


def _allowed(above: float | None, least: float | None, most: float | None) -> str:
    if least is not None and most is not None:
        return f"a number from {least:g} to {most:g}"
    limits = ("greater than", above), ("of at least", least), ("of at most", most)
    return "a finite number" + "".join(f" {text} {limit:g}" for text, limit in limits if limit is not None)


def integer(name: str, value: Any, *, least: int = 1, most: int | None = None, most_is: str = "") -> int:
    """An int of at least `least` and at most `most` (`most_is` says where that limit comes from)."""
    allowed = f"a whole number of at least {least}"
    if most is not None:
        allowed = f"a whole number from {least} to {most}{most_is}"
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InputError(f"{name} is {value!r}; allowed is {allowed}")
    if value < least or (most is not None and value > most):
        raise InputError(f"{name} is {value}; allowed is {allowed}")
    return int(value)


def fraction(name: str, value: SupportsFloat) -> float:
    """A float from 0 to 1."""
    return number(name, value, least=0.0, most=1.0)


def vector(name: str, value: Sequence[SupportsFloat] | NDArray[Any]) -> tuple[float, float]:
    """Two finite floats (x, y)."""
    try:
        x, y = value
        result = (float(x) + 0.0, float(y) + 0.0)  # + 0.0 turns -0.0 into 0.0
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {value!r}; allowed are two numbers (x, y)") from None
    if not all(map(math.isfinite, result)):
        raise InputError(f"{name} is {result}; allowed are two finite numbers (x, y)")
    return result


def floating(name: str, value: DTypeLike) -> np.dtype[Any]:
    """float32 or float64 as a dtype."""
    try:
        result = np.dtype(value)
    except TypeError:
        raise InputError(f"{name} is {value!r}; allowed are float32 and float64") from None
    if result not in (np.dtype(np.float32), np.dtype(np.float64)):
        raise InputError(f"{name} is {result}; allowed are float32 and float64")
    return result


def rows(name: str, value: ArrayLike, dtype: np.dtype[Any], count: int | None = None) -> NDArray[Any]:
    """A finite (n, 2) array; one row (2,) is repeated `count` times, as is a scalar 0."""
    array = numeric(name, value, dtype)
    if count is None and array.shape == (2,):
        array = array[None, :]
    elif count is not None and array.shape in ((), (2,)):
        array = np.broadcast_to(array, (count, 2))
    wanted = "(n, 2)" if count is None else f"({count}, 2)"
    if array.ndim != 2 or array.shape[1] != 2 or (count is not None and array.shape[0] != count):
        raise InputError(f"{name} has shape {array.shape}; allowed is {wanted}, one row (x, y) for each particle")
    if not np.isfinite(array).all():
        first = int(np.argmin(np.isfinite(array).all(axis=1)))
        raise InputError(f"{name}[{first}] is {tuple(map(float, array[first]))}; allowed are finite numbers (x, y)")
    return array


def column(name: str, value: ArrayLike, dtype: np.dtype[Any], count: int) -> NDArray[Any]:
    """A (n,) array from `count` values or one scalar for all, each finite and greater than 0."""
    array = numeric(name, value, dtype)
    if array.ndim == 0:
        array = np.broadcast_to(array, (count,))
    if array.shape != (count,):
        raise InputError(f"{name} has shape {array.shape}; allowed is one number or ({count},), one for each particle")
    return array


def positive(name: str, array: NDArray[Any], *, infinite_is: str = "") -> None:
    """Refuse values that are not greater than 0, NaN, or infinite (unless `infinite_is` names the meaning of infinity)."""
    right = array > 0
    if infinite_is:
        _each(name, array, right, f"a number greater than 0 (infinity: {infinite_is})")
    else:
        _each(name, array, right & np.isfinite(array), "a finite number greater than 0")


def within(name: str, array: NDArray[Any], least: float, most: float) -> None:
    """Refuse values outside [least, most], NaN and infinity."""
    allowed = f"a number from {least:g} to {most:g}" if math.isfinite(most) else f"a finite number of at least {least:g}"
    _each(name, array, (array >= least) & (array <= most) & np.isfinite(array), allowed)


def at_most(name: str, array: NDArray[Any], most: float) -> None:
    """Refuse values above `most`, and NaN."""
    _each(name, array, array <= most, f"a number up to {most:g}")


def _each(name: str, array: NDArray[Any], right: NDArray[np.bool_], allowed: str) -> None:
    """Refuse the first value that is not `right`."""
    if not right.all():
        first = int(np.argmin(right))
        raise InputError(f"{name}[{first}] is {array[first]:g}; allowed is {allowed}")


def bits(name: str, value: ArrayLike, count: int) -> NDArray[np.uint32]:
    """A (n,) array of 32 bits each, from integers of 0 to 2^32 - 1, or bools: `count` of them or one for all."""
    is_flag = name == "fixed_rotation"
    most, allowed = (1, "are True and False") if is_flag else (2**32 - 1, "are whole numbers of 32 bits, 0 to 4294967295")
    array = _integers(name, value, allowed, flags=is_flag)
    if array.size and not (int(array.min()) >= 0 and int(array.max()) <= most):
        raise InputError(f"{name} is {value!r}; allowed {allowed}")
    return column(name, array, np.dtype(np.uint32), count)


def text(name: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise InputError(f"{name} is {value!r}; allowed is a text")
    return value


def path(name: str, value: Any) -> Path:
    """The path of a file or a folder."""
    try:
        return Path(value)
    except TypeError:
        raise InputError(f"{name} is {value!r}; allowed is a path, as text or a pathlib.Path") from None


def choice(name: str, value: Any, allowed: Sequence[str]) -> str:
    """One of these texts."""
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"{name} is {value!r}; allowed are {', '.join(map(repr, allowed))}")
    return value


def bit_set(name: str, value: Any) -> int:
    """32 bits, from an integer of 0 to 2^32 - 1."""
    return integer(name, value, least=0, most=2**32 - 1)


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} is {value!r}; allowed are True and False")
    return bool(value)


def direction(name: str, value: Sequence[SupportsFloat] | NDArray[Any] | None) -> tuple[float, float] | None:
    """Two finite floats (x, y) that are not both 0, or None."""
    if value is None:
        return None
    result = vector(name, value)
    if result == (0.0, 0.0):
        raise InputError(f"{name} is {result}; allowed is a direction other than 0, or None")
    return result


def indices(name: str, value: ArrayLike, count: int) -> NDArray[np.int64]:
    """Sorted indices without repetition, from an index, several, or a mask of `count` bools."""
    allowed = f"are whole numbers from 0 to {count - 1}, or {count} bools"
    array = np.atleast_1d(_integers(name, value, allowed, bools=count))
    if array.dtype == bool:
        return np.flatnonzero(array)
    if array.ndim != 1:
        raise InputError(f"{name} is {value!r}; allowed {allowed}")
    wrong = (array < 0) | (array >= count)
    if wrong.any():
        raise InputError(f"{name} has {array[wrong][0]}; allowed {allowed}")
    return np.unique(array).astype(np.int64)


def numbers(name: str, value: ArrayLike) -> NDArray[np.int64]:
    """An array of integers of any shape."""
    return _integers(name, value, "are whole numbers").astype(np.int64)


def _integers(name: str, value: ArrayLike, allowed: str, *, bools: int | None = None, flags: bool = False) -> NDArray[Any]:
    """An array of integers, or of `bools` bools; flags: or of bools of any shape."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{name} is {value!r}; allowed {allowed}") from None
    mask = array.dtype == bool and (flags or (bools is not None and np.atleast_1d(array).shape == (bools,)))
    if array.size and array.dtype.kind not in "iu" and not mask:
        raise InputError(f"{name} is {value!r}; allowed {allowed}")
    return array


def numeric(name: str, value: ArrayLike, dtype: np.dtype[Any]) -> NDArray[Any]:
    """An array of numbers of any shape."""
    try:
        if isinstance(value, np.ndarray | np.generic) and np.iscomplexobj(value):  # NumPy would drop the imaginary part
            raise TypeError
        with np.errstate(over="ignore"):
            array = np.asarray(value, dtype=dtype)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is not an array of numbers; allowed are numbers in the shape the docs give") from None
    if array.dtype.kind == "f" and np.isinf(array).any() and not np.isinf(np.asarray(value, float)[np.isinf(array)]).all():
        raise InputError(f"{name} is too large for {array.dtype}; allowed are numbers up to {np.finfo(array.dtype).max:.3g}")
    return array


def values_for(name: str, value: ArrayLike, target: NDArray[Any]) -> NDArray[Any]:
    """New values for an array of particles, or for one particle: of its shape, or one for all."""
    if target.dtype.kind == "u":
        return bits(name, value, np.size(target)).reshape(np.shape(target))
    array = numeric(name, value, target.dtype)
    try:
        np.broadcast_to(array, np.shape(target))
    except ValueError:
        raise InputError(f"{name} has shape {array.shape}; allowed is {np.shape(target)}, or one of all particles") from None
    if name == "angle" and not np.isfinite(array).all():  # others are checked at the start of a frame
        raise InputError(f"{name} is {value!r}; allowed are finite numbers")
    return array
