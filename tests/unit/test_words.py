"""The code and its documentation use the field's own terms: words of our own that were retired do not come back.

A word is looked for in every text of src and docs, identifiers split at underscores and capitals: `WholeFile` is "whole file".
"""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SUFFIXES = {".py", ".pxd", ".h", ".js", ".html", ".css", ".txt", ".md"}

RETIRED = {
    # a word of ours: the term
    "lends": "mass scaling", "lending": "mass scaling", "loans": "mass scaling", "borrowed": "scaled mass",
    "even up": "restore_momentum", "tell weights": "set_link_masses", "burden": "load",
    "note calm": "at_rest", "unsettled": "settling", "meetings": "time_of_impact", "strayed": "displacement",
    "rehearse": "warm up", "rehearsals": "warm-up runs", "leapt": "integrated",
    "crew": "process_pool", "keeper": "Worker", "durable": "atomic_file", "known sketch": "resolve_sketch",
    "errand": "task", "errands": "task_queue", "inbox": "task_queue", "exhibit": "Presentation", "artist": "JpegRenderer",
    "painter": "Renderer", "levers": "controls", "gauge": "readout", "gauges": "readouts", "rhythm": "frame_pacing",
    "stamps": "disc_cache", "bowed": "sagging", "hardly": "rarely",
    "course": "ObstacleArrays", "bookkeeper": "EnergyLedger",
    "slips": "slip, tangent_impulse", "rubs": "friction", "rubbed": "friction", "take back": "limit_energy, undo",
    "hear": "record_events", "take up": "restore", "doors": "convenience methods", "ink": "rasterizer, mask", "picky": "strict",
    "torn": "broken", "somebody": "a caller, a particle", "nobody": "no particle, no thread", "anybody": "any particle",
    "everybody": "all particles", "whoever": "the caller", "lately": "recently", "blows": "impacts", "volley": "stamp",
    "booking": "records_work", "loaned": "warmed",
}  # fmt: skip

STILL_USED: dict[str, tuple[str, set[str]]] = {
    # a word of ours that has to stay somewhere: the term, and the folders that have it
    "lent": ("mass scaling", {"world"}),  # arrays in files of older versions
    "calm": ("at_rest, sleep_timer", {"world"}),  # what files call it
    "books": ("ledger", {"world"}),  # what files call it
    "onlooker": ("observer", {"world"}),  # the former name of `World.observer`
    "patience": ("time_limit", {"cli", "viewers", "docs"}),  # `pyverlet run --patience` is public
}


def _words(text: str) -> str:
    """The words of a text in lower case, a space between and around them."""
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", text)
    return f" {' '.join(re.findall(r'[a-z0-9]+', apart.lower()))} "


def _files() -> Iterator[tuple[str, Path]]:
    """Each text with the folder it counts for: that in src/pyverlet, or docs."""
    for path in sorted((ROOT / "src/pyverlet").rglob("*")):
        if path.suffix in SUFFIXES and "__pycache__" not in path.parts:
            inside = path.relative_to(ROOT / "src/pyverlet").parts
            yield inside[0] if len(inside) > 1 else "pyverlet", path
    for path in (
        *sorted((ROOT / "docs").rglob("*")),
        *(ROOT / f"{name}.md" for name in ("README", "ARCHITECTURE", "CONTRIBUTING")),
    ):
        if path.suffix in SUFFIXES:
            yield "docs", path


@cache
def _texts() -> dict[Path, tuple[str, str]]:
    """Folder and words of each file."""
    return {path: (folder, f"{_words(path.stem)}{_words(path.read_text(encoding='utf-8'))}") for folder, path in _files()}


def _found(word: str) -> dict[str, list[str]]:
    """Files that have the word, by folder."""
    found: dict[str, list[str]] = {}
    for path, (folder, words) in _texts().items():
        if f" {word} " in words:
            found.setdefault(folder, []).append(str(path.relative_to(ROOT)))
    return found


def test_words_are_split() -> None:
    assert _words("class WholeFile: note_calm(x2)") == " class whole file note calm x2 "


@pytest.mark.parametrize("word", sorted(RETIRED.keys() - STILL_USED.keys()))
def test_retired_words_stay_retired(word: str) -> None:
    assert _found(word) == {}, f"{word!r} is retired; write {RETIRED[word]}"


@pytest.mark.parametrize("word", sorted(STILL_USED))
def test_words_that_have_to_stay_do_not_spread(word: str) -> None:
    term, folders = STILL_USED[word]
    spread = {folder: files for folder, files in _found(word).items() if folder not in folders}
    assert spread == {}, f"{word!r} is retired here; write {term}"
