"""Every public name is in the reference, with a docstring; and the check of the built pages sees what is wrong."""

import importlib
import inspect
import re
from pathlib import Path
from runpy import run_path
from types import ModuleType
from typing import Any

import nbformat
import pytest

import pyverlet
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


def test_links_of_built_pages_are_checked(tmp_path: Path) -> None:
    faults = run_path(str(ROOT / ".ci" / "docs.py"))["faults"]
    (tmp_path / "there.html").write_text('<h1 id="top">There</h1>', encoding="utf-8")
    (tmp_path / "page.html").write_text(
        '<a href="there.html">a</a> <a href="there.html#top">b</a> <a href="https://example.org">c</a> <a href="#here">d</a>'
        '<p id="here">',
        encoding="utf-8",
    )
    assert faults(tmp_path) == []
    (tmp_path / "page.html").write_text(
        '<a href="gone.html">a</a> <a href="there.html#gone">b</a> <img src="gone.png"> <script src="https://example.org/x.js">',
        encoding="utf-8",
    )
    wrong = faults(tmp_path)
    said = [sum(word in fault for fault in wrong) for word in ("page.html", "gone", "fetches https://example.org/x.js")]
    assert said == [len(wrong), 3, 1] == [4, 3, 1]


# ---- What the page stands is a table in docs/viewer.md; each row names its test ----


def test_each_row_has_a_test_that_is_there() -> None:
    _, _, table = (ROOT / "docs" / "viewer.md").read_text(encoding="utf-8").partition("| who, or what |")
    rows = [line for line in table.partition("\n\n")[0].splitlines()[2:] if line.startswith("|")]
    assert len(rows) >= 10
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests" / "viewers").glob("test_*.py"))
    for row in rows:
        named = re.findall(r"`(test_\w+)`", row)
        assert named, row
        assert [name for name in named if f"def {name}(" not in tests] == []


# ---- The notebook is the page, and runs from top to bottom ----


def test_it_is_the_page() -> None:
    written = run_path(str(ROOT / "docs" / "notebook.py"))["notebook"]()
    assert (ROOT / "docs" / "integrators.ipynb").read_text(encoding="utf-8") == written, "python docs/notebook.py"
    assert len(written) < 40_000


# The page it is written from runs in test_examples.py. Jupyter's own parts warn about each other.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_it_runs_from_top_to_bottom(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from nbclient import NotebookClient

    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(Path(pyverlet.__file__).parents[1]))  # the kernel sees the package this process sees
    book: Any = nbformat.reads((ROOT / "docs" / "integrators.ipynb").read_text(encoding="utf-8"), as_version=4)  # type: ignore[no-untyped-call]
    NotebookClient(book, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert any("image/png" in output.get("data", {}) for cell in code for output in cell.outputs)
