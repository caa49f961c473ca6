"""Archives: what comes back is what was written, and files that claim more than they hold are not believed."""

import io
import json
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pyverlet.data import archive
from pyverlet.ground.errors import InputError

ARRAYS = {
    "full": np.arange(200.0).reshape(100, 2) ** 2,
    "twin": np.arange(200.0).reshape(100, 2) ** 2,
    "alike": np.full((100, 2), 0.3, np.float32),
    "counting": np.arange(7, 107, dtype=np.int64),
    "empty": np.empty((0, 2), np.float32),
    "few": np.array([True, False]),
    "zeros": np.array([0.0] * 99 + [-0.0]),  # equal, but not in their bits
    "nan": np.full(100, np.nan),
    "drawn": np.array([(0.0, -9.81), (-0.0, -9.81), (np.nan, 3.0)], np.float32)[np.arange(100) % 7 % 3],
}


def written(table: dict[str, Any], arrays: dict[str, Any]) -> bytes:
    out = io.BytesIO()
    archive.write(out, lambda: table, arrays)
    return out.getvalue()


def test_there_and_back(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(written({"a": [1, "x"]}, ARRAYS))
    table, arrays = archive.read(path)
    assert table == {"a": [1, "x"]}
    assert list(arrays) == list(ARRAYS)
    for name, array in arrays.items():
        assert array.dtype == ARRAYS[name].dtype
        assert array.tobytes() == ARRAYS[name].tobytes()
        assert array.flags.writeable
    assert not np.shares_memory(arrays["full"], arrays["twin"])
    with zipfile.ZipFile(path) as file:
        assert {info.filename for info in file.infolist()} == {
            "full.npy", "alike.npy", "empty.npy", "few.npy", "zeros.npy", "zeros.rows.npy", "nan.npy", "drawn.npy",
            "drawn.rows.npy", "snapshot.json",
        }  # fmt: skip


def test_what_would_expand_too_much_is_stored_in_full(tmp_path: Path) -> None:
    path, arrays = tmp_path / "a", {f"a{k}": np.full(10_000, float(k)) for k in range(3)}
    path.write_bytes(written({}, arrays))
    assert path.stat().st_size > 3 * 80_000
    assert archive.read(path)[1]["a2"].tolist() == [2.0] * 10_000


def index(shape: Any, **how: Any) -> dict[str, Any]:
    return {"arrays": {"a": {"shape": shape, "dtype": "<f8", **how}}}


@pytest.mark.parametrize(
    "table",
    [
        index([10**12], repeated=True), index([10**12], counts_from=0), index([-1]), index([True]), index([2, 2, 2]), index("x"),
        index([4], same_as="a"), index([5]), {"arrays": {}}, {"arrays": 3}, [], {},
    ],
)  # fmt: skip
def test_tables_that_lie(table: Any, tmp_path: Path) -> None:
    path, member = tmp_path / "a", io.BytesIO()
    np.save(member, np.zeros(4))
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a.npy", member.getvalue())
        file.writestr("snapshot.json", json.dumps(table))
    with pytest.raises(InputError, match="no sound file"):
        archive.read(path)


@pytest.mark.parametrize(
    ("rows", "which", "there"),
    [(3, [0, 1, 3, 0], 3), (5, [0] * 4, 5), (0, [0] * 4, 0), (2, [0] * 4, 3), ("2", [0] * 4, 2), (True, [0] * 4, 1)],
)
def test_rows_that_are_not_there(rows: Any, which: list[int], there: int, tmp_path: Path) -> None:
    path = tmp_path / "a"
    with zipfile.ZipFile(path, "w") as file:
        for name, array in (("a", np.array(which, "<u2")), ("a.rows", np.zeros(there))):
            member = io.BytesIO()
            np.save(member, array)
            file.writestr(f"{name}.npy", member.getvalue())
        file.writestr("snapshot.json", json.dumps(index([4], rows=rows)))
    with pytest.raises(InputError, match="no sound file"):
        archive.read(path)


def test_files_that_are_odd(tmp_path: Path) -> None:
    whole, path = written({}, {"a": np.zeros(4)}), tmp_path / "a"
    for raw in (b"", b"PK", whole[:-1], whole[: len(whole) // 2], whole.replace(b"NUMPY", b"NUMPX")):
        path.write_bytes(raw)
        with pytest.raises(InputError, match="no sound file"):
            archive.read(path)
    deep = '{"arrays": {}, "a": ' + "[" * 100_000 + "]" * 100_000 + "}"
    for compressed, text in (
        (zipfile.ZIP_DEFLATED, '{"arrays": {}}'),
        (zipfile.ZIP_STORED, deep),
        (zipfile.ZIP_STORED, '{"a": NaN}'),
    ):
        with zipfile.ZipFile(path, "w", compressed) as file:
            file.writestr("snapshot.json", text)
        with pytest.raises(InputError, match="no sound file"):
            archive.read(path)
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w") as file:
        warnings.simplefilter("ignore")  # zipfile's own, of a member that is there twice
        file.writestr("snapshot.json", '{"arrays": {}}')
        file.writestr("snapshot.json", '{"arrays": {}}')
    with pytest.raises(InputError, match="twice"):
        archive.read(path)
    with pytest.raises(InputError, match="cannot be read"):
        archive.read(tmp_path)
