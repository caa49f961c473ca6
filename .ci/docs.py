"""Build the documentation as a site, into site/: `python3 .ci/docs.py`. Open site/index.html; no server is needed.

Needs Python >= 3.11, and the network the first time, for an environment of its own with what the extra `docs` names. Every
warning is an error. Then the built pages are gone through: each link, with its anchor, leads to something, and nothing is fetched
from elsewhere when a page is opened.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import venv
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
SITE = ROOT / "site"
PYTHON = ROOT / ".venv-docs" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
FETCHED = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href"}
"""What a browser fetches when it opens a page."""


class Page(HTMLParser):
    """The links of a page, the names they may lead to, and what is fetched with it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what matters of this tag."""
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if tag in FETCHED and FETCHED[tag] in values and values.get("rel") != "canonical":
            self.fetched.append(values[FETCHED[tag]])


def faults(site: Path) -> list[str]:
    """A line for each link that leads nowhere, and for each thing a page would fetch from elsewhere."""
    pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        where = path.relative_to(site).as_posix()
        for link in page.links + page.fetched:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if link in page.fetched and parts.scheme != "data":
                    found.append(f"{where} fetches {link}")
                continue
            base = site if parts.path.startswith("/") else path.parent
            target = (base / unquote(parts.path).lstrip("/")).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            anchor = unquote(parts.fragment)
            if not target.exists():
                found.append(f"{where} links to {link}, which is not there")
            elif anchor and not anchor.startswith("__") and target in pages and anchor not in pages[target].anchors:
                found.append(f"{where} links to {link}, but there is no such place on that page")
    return found


def prepare() -> None:
    """An environment with what the extra `docs` names; the package itself is read, not installed."""
    if not PYTHON.exists():
        print("setting up .venv-docs", flush=True)
        venv.create(PYTHON.parent.parent, with_pip=True, clear=True)
    needed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]["docs"]
    subprocess.run([PYTHON, "-m", "pip", "--disable-pip-version-check", "-q", "install", *needed], check=True)


def main(arguments: list[str]) -> None:
    """Build, then check; with `--check SITE` only check."""
    if arguments[:1] != ["--check"]:
        prepare()
        without_news = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
        code = subprocess.call([PYTHON, "-m", "mkdocs", "build", "--strict", "--quiet"], cwd=ROOT, env=without_news)
        if code:
            sys.exit(code)
    site = Path(arguments[1]) if arguments[:1] == ["--check"] else SITE
    wrong = faults(site)
    for fault in wrong:
        print(fault, file=sys.stderr)
    if wrong:
        sys.exit(f"{len(wrong)} faults in {site}")
    print(f"{len(list(site.rglob('*.html')))} pages, every link leads somewhere: {site / 'index.html'}")


if __name__ == "__main__":
    main(sys.argv[1:])
