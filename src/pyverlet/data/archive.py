"""Named arrays and a table in one file: npz without pickles, with the table as JSON.

`numpy.load` reads it, too. Arrays are stored as they are, with four exceptions: arrays of equal rows are stored as one row,
arrays that count up by their first number, arrays equal to others by name, and arrays with few different rows as these rows and
the index of each. The table's `arrays` tells how each is stored. Nothing is allocated before the file is known to be large enough
for it, and nothing is used before its checksum has been verified.
"""

import json
import math
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.shown import cut

INDEX = "arrays"  # key of the table for how arrays are stored

_TABLE = "snapshot.json"
_WHEN = (1980, 1, 1, 0, 0, 0)  # a fixed date, so that equal worlds give equal files
_EXPANDS = 64  # larger expansions are stored in full, which limits the memory that a file can claim
_FEW = 16  # arrays with fewer rows are stored in full
_PALETTE = 4096  # most different rows stored once each; and rows sampled to decide that

_CODE = np.dtype("<u2")
_ROWS = ".rows"  # suffix of the entry with an array's different rows

_DTYPES = {"|b1", "|u1", "<u4", "<i4", "<i8", "<f4", "<f8"}
_CHUNK = 1 << 18  # bytes per step, which stay in a core's cache between checksum and copy
BROKEN = (
    zipfile.BadZipFile, zlib.error, KeyError, TypeError, ValueError, EOFError, OSError, NotImplementedError, RuntimeError,
    RecursionError, OverflowError, AttributeError, IndexError, SyntaxError,
)  # fmt: skip


def write(file: BinaryIO, table: Callable[[], Mapping[str, Any]], arrays: Mapping[str, Array]) -> None:
    """Write arrays and then a table, which must have no key `arrays` of its own."""
    little = {name: np.ascontiguousarray(array, array.dtype.newbyteorder("<")) for name, array in arrays.items()}
    index, stored = _shared(little)
    if sum(a.nbytes for a in little.values()) > _EXPANDS * sum(a.nbytes for a in stored.values()):
        index, stored = {name: _whole(array) for name, array in little.items()}, little
    with zipfile.ZipFile(file, "w") as archive:
        for name, array in stored.items():
            info = zipfile.ZipInfo(f"{name}.npy", _WHEN)
            info.file_size = array.nbytes + 256  # lets zipfile decide whether it needs 64 bits
            with archive.open(info, "w") as member:
                np.lib.format.write_array_header_1_0(member, np.lib.format.header_data_from_array_1_0(array))
                if array.size:
                    member.write(array.reshape(-1).view(np.uint8).data)
        text = json.dumps({**table(), INDEX: index}, allow_nan=False, ensure_ascii=False, indent=1)
        archive.writestr(zipfile.ZipInfo(_TABLE, _WHEN), text.encode())


def _whole(array: Array) -> dict[str, Any]:
    return {"shape": list(array.shape), "dtype": array.dtype.str}


def _shared(arrays: dict[str, Array]) -> tuple[dict[str, dict[str, Any]], dict[str, Array]]:
    """How each array is stored, and the arrays to store."""
    index: dict[str, dict[str, Any]] = {}
    stored: dict[str, Array] = {}
    first: dict[str, Array] = {}
    for name, array in arrays.items():
        index[name], kept = _whole(array), array
        if len(array) > _FEW:
            twin = next((other for other, old in first.items() if _equal(old, array)), None)
            if twin is not None:
                index[name]["same_as"] = twin
                continue
            first[name] = array
            if _equal(array[1:], array[:-1]):
                index[name]["repeated"], kept = True, array[:1]
            elif (
                array.dtype.kind == "i"
                and array.ndim == 1
                and array[-1] - array[0] == len(array) - 1
                and (np.diff(array) == 1).all()
            ):
                index[name]["counts_from"] = int(array[0])
                continue
            elif (rows := _palette(array)) is not None:
                index[name]["rows"], kept = len(rows), np.searchsorted(rows, _as_numbers(array)).astype(_CODE)
                stored[name + _ROWS] = rows.view(array.dtype).reshape(-1, *array.shape[1:])
        stored[name] = kept
    return index, stored


def _as_numbers(array: Array) -> Array:
    """(n,) rows as integers; empty if a row has other than 4 or 8 bytes."""
    size = array.nbytes // len(array)
    return array.reshape(-1).view(f"<u{size}") if size in (4, 8) else np.empty(0, np.uint64)


def _palette(array: Array) -> Array | None:
    """The sorted different rows as integers; None if there are more than _PALETTE, or too many to save space."""
    numbers = _as_numbers(array)
    if not len(numbers) or len(np.unique(numbers[:: max(len(numbers) // _PALETTE, 1)])) > _PALETTE // 4:
        return None
    rows = np.unique(numbers)
    fits = len(rows) <= _PALETTE and rows.nbytes + _CODE.itemsize * len(numbers) < 0.9 * array.nbytes
    return rows if fits else None


def _equal(one: Array, other: Array) -> bool:
    """Whether all bits are equal."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return False
    bits = np.dtype(f"u{one.dtype.itemsize}")
    parts = (slice(0, 64), slice(None))  # most differ early
    return all(np.array_equal(one[part].view(bits), other[part].view(bits)) for part in parts)


def read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    """The table, without the entry about arrays, and the arrays: writable, in native byte order.

    Raises:
        InputError: the file is missing, or not a complete and unchanged result of `write`.
    """
    try:
        with path.open("rb") as file:
            return read_from(file, os.fstat(file.fileno()).st_size)
    except FileNotFoundError:
        raise InputError(f"'{path}' is not there; allowed is a file that pyverlet wrote") from None
    except (IsADirectoryError, PermissionError) as error:
        raise InputError(f"'{path}' cannot be read ({error.strerror}); allowed is a file that pyverlet wrote") from None
    except BROKEN as error:
        why = cut(" ".join(str(error).split()) or type(error).__name__, 100)
        raise InputError(f"'{path}' is no sound file of pyverlet's ({why}); allowed is one as it was written") from None


def read_from(file: BinaryIO, size: int) -> tuple[dict[str, Any], dict[str, Array]]:
    """As `read`, from an open file of this size whose integrity is known."""
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        names = {info.filename for info in members}
        if len(names) < len(members) or any(info.compress_type != zipfile.ZIP_STORED for info in members):
            raise ValueError("it has a member twice, or a compressed one")
        if sum(info.file_size for info in members) > size:
            raise ValueError("its members are larger than the file")
        table = json.loads(archive.read(_TABLE), parse_constant=_no_number)
        index = table.pop(INDEX)
        if sum(map(_bytes, index.values())) > _EXPANDS * size:
            raise ValueError("its arrays are too large for such a file")
        arrays: dict[str, Array] = {}
        for name, how in index.items():
            if "same_as" in how:
                arrays[name] = arrays[how["same_as"]].copy()
            elif "counts_from" in how:
                arrays[name] = np.arange(how["shape"][0], dtype=how["dtype"]) + np.dtype(how["dtype"]).type(how["counts_from"])
            elif "rows" in how:
                names -= {f"{name}.npy", f"{name}{_ROWS}.npy"}
                arrays[name] = _drawn(archive, name, how)
            else:
                names.discard(f"{name}.npy")
                shape = tuple(how["shape"])
                stored = (1, *shape[1:]) if how.get("repeated") else shape
                array = _member(archive, name, stored, np.dtype(how["dtype"]))
                arrays[name] = np.broadcast_to(array, shape).copy() if how.get("repeated") else array
            if arrays[name].shape != tuple(how["shape"]) or arrays[name].dtype.str != how["dtype"]:
                raise ValueError(f"{name} is not as the table says")
        if names != {_TABLE}:
            raise ValueError(f"it has the unknown member {min(names - {_TABLE})!r}")
    return table, {name: array.astype(array.dtype.newbyteorder("="), copy=False) for name, array in arrays.items()}


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _bytes(how: dict[str, Any]) -> int:
    if how["dtype"] not in _DTYPES or not all(type(n) is int and n >= 0 for n in how["shape"]) or len(how["shape"]) > 2:
        raise ValueError(f"an array is of {how['dtype']!r} and shape {how['shape']!r}")
    return int(np.dtype(how["dtype"]).itemsize * math.prod(how["shape"]))


def _drawn(archive: zipfile.ZipFile, name: str, how: dict[str, Any]) -> Array:
    """Expand an array of which each different row is stored once."""
    shape, rows = tuple(how["shape"]), how["rows"]
    if type(rows) is not int or not 0 < rows <= min(_PALETTE, shape[0]):
        raise ValueError(f"{name} has {rows!r} different rows")
    which = _member(archive, name, shape[:1], _CODE)
    if which.max() >= rows:
        raise ValueError(f"{name} has a row that is none of its {rows}")
    return _member(archive, name + _ROWS, (rows, *shape[1:]), np.dtype(how["dtype"]))[which]


def _member(archive: zipfile.ZipFile, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
    with archive.open(f"{name}.npy") as member:
        if np.lib.format.read_magic(member) != (1, 0):
            raise ValueError(f"{name} is of another version")
        header = np.lib.format.read_array_header_1_0(member)
        if header != (shape, False, dtype) or not shape:
            raise ValueError(f"{name} is not as the table says")
        array: Array = np.empty(shape, dtype)
        buffer, at = array.reshape(-1).view(np.uint8).data, 0
        while at < len(buffer):
            piece = member.read(min(_CHUNK, len(buffer) - at))
            if not piece:
                raise ValueError(f"{name} ends early")
            buffer[at : at + len(piece)] = piece
            at += len(piece)
        if member.read(1):
            raise ValueError(f"{name} goes on too long")
    return array
