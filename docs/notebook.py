"""Writes docs/integrators.ipynb from docs/integrators.md: `python docs/notebook.py`. Code blocks become cells, the rest text.

A test holds the notebook to the page and runs it. Needs nbformat (the extra `test`).
"""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

PAGE = Path(__file__).with_name("integrators.md")
NOTEBOOK = PAGE.with_suffix(".ipynb")
CODE = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def notebook() -> str:
    """The notebook as text, without outputs: the same page always gives the same bytes."""
    cells = [new_code_cell("%matplotlib inline", id="cell-figures")]  # figures show where they are made
    for number, part in enumerate(CODE.split(PAGE.read_text(encoding="utf-8"))):
        if part.strip():
            make = new_code_cell if number % 2 else new_markdown_cell
            cells.append(make(part.strip("\n"), id=f"cell-{number}"))
    about = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return nbformat.writes(new_notebook(cells=cells, metadata=about)) + "\n"


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(), encoding="utf-8")
