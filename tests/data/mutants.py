"""Loads mutated snapshots, in a process of its own, for one that gets through might end it: `mutants.py SEED COUNT FOLDER`.

Prints what became of them as JSON. A mutant is refused with InputError, or loads and takes two frames.
"""

import collections
import copy
import io
import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from tests.worlds import WORLDS

import pyverlet as pv
from pyverlet.data import archive, snapshot


def subjects() -> list[tuple[dict[str, Any], dict[str, Any], bytes]]:
    """Worlds that have everything, as tables and arrays and as files."""
    worlds = [
        WORLDS["linked"](ledger=True, events=True),
        *(WORLDS[name](substeps=2) for name in ("stream", "sleepers", "thrown")),
    ]
    worlds[0].data["age"], worlds[0].data["name"] = 0.5, "abc"
    worlds[0].data["place"] = np.ones((len(worlds[0]), 2), np.float32)
    found = []
    for world in (*worlds, pv.scenes.get("cage").world(particles=60)):
        world.run(seconds=0.5)
        pv.save(world, FOLDER / "whole.pvsnap")
        found.append((*archive.read(FOLDER / "whole.pvsnap"), (FOLDER / "whole.pvsnap").read_bytes()))
    return found


ODD: list[Any] = [None, -1, 0, 1, 2**31, 2**63, -(2**70), 1e308, 0.5, "", "x", [], {}, True, [1, 2, 3], {"type": "Open"}]
ODD += [{"$number": "nan"}, {"$number": "inf"}, {"$array": "slots.particle"}, {"$tuple": [1]}]


def mutate_table(rng: np.random.Generator, table: Any) -> None:
    """Change, remove or swap something somewhere in it."""
    inner = [part for part in (table.values() if isinstance(table, dict) else table) if isinstance(part, dict | list) and part]
    if inner and rng.random() < 0.8:
        mutate_table(rng, inner[rng.integers(len(inner))])
        return
    key = rng.choice(list(table)) if isinstance(table, dict) else int(rng.integers(len(table)))
    kind = rng.integers(3)
    if kind == 0 and isinstance(table[key], int | float):
        table[key] = table[key] * float(rng.choice([-1, 0.5, 2, 1e9])) if rng.random() < 0.5 else int(table[key]) + 1
    elif kind == 1:
        del table[key]
    else:
        table[key] = copy.deepcopy(ODD[rng.integers(len(ODD))])  # it may be mutated, too


def mutate_arrays(rng: np.random.Generator, arrays: dict[str, Any]) -> None:
    """Change a number or a shape of one of them."""
    name = rng.choice([name for name, array in arrays.items() if array.size])
    array = arrays[name] = arrays[name].copy()
    flat = array.reshape(-1)
    kind = rng.integers(5)
    if kind == 0:  # a bit
        raw = flat.view(np.uint8)
        raw[rng.integers(len(raw))] ^= np.uint8(1 << rng.integers(8))
    elif kind == 1:
        limits = np.iinfo(array.dtype) if array.dtype.kind in "iu" else np.finfo(array.dtype) if array.dtype.kind == "f" else None
        odd = [0, 1] if limits is None else [limits.min, limits.max, 0, 1, len(array)]
        flat[rng.integers(flat.size)] = rng.choice(np.array(odd).astype(array.dtype))
    elif kind == 2:
        a, b = rng.integers(flat.size, size=2)
        flat[a], flat[b] = flat[b], flat[a]
    elif kind == 3:
        arrays[name] = array[:-1] if rng.random() < 0.5 else np.concatenate((array, array[-1:]))
    else:
        arrays[name] = array.astype(rng.choice(["<f4", "<f8", "<i8", "<i4", "|u1"]))


def mutant(rng: np.random.Generator, table: dict[str, Any], arrays: dict[str, Any], whole: bytes) -> bytes:
    """A file that is not quite the one."""
    kind = rng.integers(6)
    if kind == 0:
        return whole[: rng.integers(len(whole))]
    if kind == 1:
        raw = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            raw[rng.integers(len(raw))] ^= 1 << rng.integers(8)
        return bytes(raw)
    table, arrays = json.loads(json.dumps(table)), dict(arrays)
    for _ in range(rng.integers(1, 3)):
        mutate_table(rng, table) if kind <= 3 else mutate_arrays(rng, arrays)
    out = io.BytesIO()
    archive.write(out, lambda: table, {name: np.atleast_1d(array) for name, array in arrays.items()})
    return out.getvalue()


def main(seed: int, count: int) -> None:
    warnings.simplefilter("ignore")
    vars(snapshot)["hash_of"] = lambda time, arrays: "0"  # no lock: whoever forges a file forges it, too
    rng, became, worlds = np.random.default_rng(seed), collections.Counter[str](), subjects()
    path = FOLDER / "mutant.pvsnap"
    for number in range(count):
        path.write_bytes(mutant(rng, *worlds[rng.integers(len(worlds))]))
        (FOLDER / "number").write_text(str(number))
        try:
            world = pv.load(path)
        except pv.InputError as error:
            became["refused" if str(path) in str(error) else "refused without its name"] += 1
            continue
        try:
            world.step(1 / 60)
            world.step(1 / 60)
            became["went on"] += 1
        except pv.NonFiniteError:
            became["turned non-finite"] += 1
        except pv.InputError:
            became["refused in a frame"] += 1
    json.dump(became, sys.stdout)


if __name__ == "__main__":
    FOLDER = Path(sys.argv[3])
    main(int(sys.argv[1]), int(sys.argv[2]))
