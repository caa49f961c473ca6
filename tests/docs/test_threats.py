"""What the page stands is a table in docs/viewer.md; each row names its test."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_each_row_has_a_test_that_is_there() -> None:
    _, _, table = (ROOT / "docs" / "viewer.md").read_text(encoding="utf-8").partition("| who, or what |")
    rows = [line for line in table.partition("\n\n")[0].splitlines()[2:] if line.startswith("|")]
    assert len(rows) >= 10
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests" / "viewers").glob("test_*.py"))
    for row in rows:
        named = re.findall(r"`(test_\w+)`", row)
        assert named, row
        assert [name for name in named if f"def {name}(" not in tests] == []
