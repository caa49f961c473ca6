"""Joins the modules of the page into a single script, for notebooks and single-file films."""

import html
import json
import re
from importlib import resources

_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([\w.]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?!default)", re.MULTILINE)
_BODY = re.compile(r"<body>(.*)</body>", re.DOTALL)

ALONE = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
"""Content security policy of a single-file page: it may load nothing else."""

TRANSPORT = """  <div id="transport"><input id="seek" data-testid="seek" type="range" min="0" max="0" step="any" value="0"
    aria-label="Time of the film"><span id="clock" data-testid="clock"></span></div>"""
"""The seek bar of a film."""


def page_file(name: str) -> str:
    """The text of a file of the page."""
    return (resources.files("pyverlet.viewers") / "page" / name).read_text(encoding="utf-8")


def script() -> str:
    """The notebook's module and its imports as one module, with the page's STYLE and MARKUP as constants.

    Functions and constants of all modules must have different names, which a test checks.
    """
    style, body = json.dumps(page_file("page.css")), json.dumps(markup())
    return f"const STYLE = {style};\n\nconst MARKUP = {body};\n\n{modules('notebook.js')}"


def markup() -> str:
    """The body of the page."""
    body = _BODY.search(page_file("index.html"))
    assert body
    return body[1].strip()


def modules(entry: str) -> str:
    """The module `entry` and its imports as one module."""
    parts: list[str] = []
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


def film(title: str, *, fps: int, colour: str, theme: str) -> str:
    """The page that plays a film, without the blocks of the film, which follow it. It makes no network requests.

    `colour`, one of `commands.COLOURINGS`, and `theme`, "dark" or "light", are the initial settings.
    """
    head = page_file("index.html")
    icon = next(line for line in head.splitlines() if 'rel="icon"' in line)
    dataset = f'id="pyverlet" data-fps="{fps}" data-colour="{colour}" data-theme="{theme}"'
    lines = [
        "<!doctype html>",
        '<html lang="en">',
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta http-equiv="Content-Security-Policy" content="{ALONE}">',
        f"<title>{html.escape(title)}</title>",
        icon.strip(),
        f"<style>{page_file('page.css')}</style>",
        markup().replace('id="pyverlet"', dataset, 1).replace("</aside>", f"</aside>\n{TRANSPORT}", 1),
        f'<script type="module">{modules("film.js")}</script>',
    ]
    return "\n".join(lines) + "\n"
