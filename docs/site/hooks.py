"""What MkDocs does not know by itself: pages of the repository's root, and links to files that are not pages.

The same links work where the repository is read and on the site: a page of the root becomes a page of the site, and a linked file
of source gets a page that shows it.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath
from typing import Any

import griffe
from mkdocs.structure.files import File, Files, InclusionLevel

ROOT = Path(__file__).resolve().parents[2]
DOCS = "docs"
FROM_ROOT = {"ARCHITECTURE.md": "architecture.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
"""Page of the root: its name on the site."""

LINK = re.compile(r"(?<=\]\()(?!https?:|mailto:)([^)#\s]+)(?=[)#])")
LANGUAGES = {".py": "python", ".toml": "toml", ".js": "js", ".yml": "yaml"}


def written_at(page: str) -> str:
    """Where in the repository the page of the site is written."""
    return {name: path for path, name in FROM_ROOT.items()}.get(page, f"{DOCS}/{page}")


def target(page: str, link: str) -> str:
    """What in the repository a link of that page leads to."""
    return normpath(PurePosixPath(written_at(page)).parent / link)


def site_name(path: str) -> str:
    """What a file of the repository is called on the site."""
    if path in FROM_ROOT:
        return FROM_ROOT[path]
    if path.startswith(f"{DOCS}/") and (ROOT / path).is_file() and not path.endswith(".py"):
        return path.removeprefix(f"{DOCS}/")
    return f"source/{path.lstrip('.')}.md"


def shown(path: str) -> str:
    """The page for a file of source, or for a folder: what is in it."""
    place = ROOT / path
    if place.is_dir():
        files = sorted(each for each in place.iterdir() if each.is_file())
        here = str(PurePosixPath(site_name(path)).parent)
        links = (f"- [{each.name}]({relpath(site_name(f'{path}/{each.name}'), here)})" for each in files)
        return f"# {path}\n\n" + "\n".join(links)
    code, language = place.read_text(encoding="utf-8"), LANGUAGES.get(place.suffix, "text")
    return f"---\nsearch: {{exclude: true}}\n---\n# {place.name}\n\n`{path}`\n\n````{language}\n{code}````\n"


def names() -> str:
    """A table of every public name, with the first line of its docstring."""
    package: Any = griffe.load("pyverlet", search_paths=[str(ROOT / "src")])
    rows = ["| name | |", "| --- | --- |"]
    for name in sorted(package.exports, key=str.lower):
        text = package[name].docstring.value.splitlines()[0].replace("|", "\\|")
        rows.append(f"| [`{name}`][pyverlet.{name}] | {text} |")
    return "\n".join(rows) + "\n"


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of the root, and a page for each file that some page links to."""
    for path, name in FROM_ROOT.items():
        files.append(File.generated(config, name, content=(ROOT / path).read_text(encoding="utf-8")))
    wanted: set[str] = set()
    for file in files.documentation_pages():
        wanted |= {target(file.src_uri, link) for link in LINK.findall(file.content_string)}
    sources = {path for path in wanted if site_name(path).startswith("source/")}
    for folder in [path for path in sources if (ROOT / path).is_dir()]:
        sources |= {f"{folder}/{each.name}" for each in (ROOT / folder).iterdir() if each.is_file()}
    for path in sorted(sources):
        if (ROOT / path).exists():  # a link to nowhere is left to MkDocs, which refuses it
            made = File.generated(config, site_name(path), content=shown(path))
            made.inclusion = InclusionLevel.NOT_IN_NAV
            files.append(made)
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of the repository become links of the site."""
    here = page.file.src_uri
    if here.startswith("source/"):
        return markdown
    if here == "reference/index.md":
        markdown += "\n" + names()
    folder = str(PurePosixPath(here).parent)
    return LINK.sub(lambda found: relpath(site_name(target(here, found[1])), folder), markdown)
