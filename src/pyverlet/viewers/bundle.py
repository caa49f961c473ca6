"""The page as a single script, for places that take no more than one: its modules one after the other, nothing else changed."""

from __future__ import annotations

import json
import re
from importlib import resources

_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([\w.]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?!default)", re.MULTILINE)
_BODY = re.compile(r"<body>(.*)</body>", re.DOTALL)


def page_file(name: str) -> str:
    """A file of the page."""
    return (resources.files("pyverlet.viewers") / "page" / name).read_text(encoding="utf-8")


def script(entry: str = "notebook.js") -> str:
    """The module `entry` and all it imports as one module, with the page's STYLE and MARKUP as constants.

    The names of the modules' own functions and constants must differ; a test holds them to that.
    """
    body = _BODY.search(page_file("index.html"))
    assert body
    constants = {"STYLE": page_file("page.css"), "MARKUP": body[1].strip()}
    parts = [f"const {name} = {json.dumps(text)};\n" for name, text in constants.items()]
    seen: set[str] = set()

    def add(name: str) -> None:
        if name in seen:
            return
        seen.add(name)
        text = page_file(name)
        for imported in _IMPORT.findall(text):
            add(imported)
        parts.append(_EXPORT.sub("", _IMPORT.sub("", text)))

    add(entry)
    return "\n".join(parts)
