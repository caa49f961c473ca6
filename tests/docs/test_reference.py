"""Every public name is in the reference, with a docstring; and the check of the built pages sees what is wrong."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re
from pathlib import Path
from types import ModuleType

import pytest

import pyverlet as pv
from pyverlet import draw, lab, picture, record

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs" / "reference").glob("*.md"))
SHOWN = re.findall(r"^::: (\S+)$", "\n".join(page.read_text(encoding="utf-8") for page in PAGES), re.MULTILINE)


def test_every_public_name_is_in_the_reference() -> None:
    missing = [name for name in pv.__all__ if SHOWN.count(f"pyverlet.{name}") != 1]
    assert missing == [], "write `::: pyverlet.NAME` on one page of docs/reference/"
    assert all(inspect.getdoc(getattr(pv, name)) for name in pv.__all__)


@pytest.mark.parametrize("module", [draw, lab, picture, record], ids=lambda module: module.__name__)
def test_so_are_the_packages_beside_it(module: ModuleType) -> None:
    assert any(name == module.__name__ or name.startswith(f"{module.__name__}.") for name in SHOWN)


def test_pages_name_what_there_is() -> None:
    for name in SHOWN:
        found: object = pv
        for part in name.split(".")[1:]:
            if not hasattr(found, part) and isinstance(found, ModuleType):
                importlib.import_module(f"{found.__name__}.{part}")
            found = getattr(found, part)
        assert inspect.getdoc(found), name


def members() -> list[tuple[str, object]]:
    """(name, what it is) of every public method and property of public classes that pyverlet itself defines."""
    classes = [getattr(pv, name) for name in pv.__all__ if inspect.isclass(getattr(pv, name))]
    return sorted(
        {
            (f"{cls.__name__}.{name}", member)
            for cls in classes
            for name, member in inspect.getmembers(cls, lambda each: inspect.isroutine(each) or isinstance(each, property))
            if not name.startswith("_") and not hasattr(BaseException, name)
        },
        key=lambda pair: pair[0],
    )


def test_every_member_has_a_docstring_here_or_where_it_is_declared() -> None:
    assert len(members()) > 100
    protocol = {"apply": pv.forces.Force.apply, "potential": pv.forces.Conservative.potential}  # what forces have in common
    assert all(inspect.getdoc(each) for each in protocol.values())
    assert not [name for name, member in members() if not inspect.getdoc(member) and name.split(".")[1] not in protocol]


@pytest.fixture(scope="module")
def builder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_builder", ROOT / ".ci" / "docs.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_links_of_built_pages_are_checked(builder: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "there.html").write_text('<h1 id="top">There</h1>', encoding="utf-8")
    (tmp_path / "page.html").write_text(
        '<a href="there.html">a</a> <a href="there.html#top">b</a> <a href="https://example.org">c</a> <a href="#here">d</a>'
        '<p id="here">',
        encoding="utf-8",
    )
    assert builder.faults(tmp_path) == []
    (tmp_path / "page.html").write_text(
        '<a href="gone.html">a</a> <a href="there.html#gone">b</a> <img src="gone.png"> <script src="https://example.org/x.js">',
        encoding="utf-8",
    )
    wrong = builder.faults(tmp_path)
    assert len(wrong) == 4
    assert all("page.html" in fault for fault in wrong)
    assert sum("gone" in fault for fault in wrong) == 3
    assert sum("fetches https://example.org/x.js" in fault for fault in wrong) == 1
