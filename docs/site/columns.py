"""Arrays of a group or world are `Column("what it is")`: that text is their docstring in the reference."""

from __future__ import annotations

import ast
from typing import Any

import griffe


class Columns(griffe.Extension):
    """Reads it."""

    def on_attribute_instance(self, *, node: Any, attr: griffe.Attribute, **_: Any) -> None:
        """`name = Column("doc")` documents `name`, without showing its value."""
        value = getattr(node, "value", None)
        if not (isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id == "Column" and value.args):
            return
        attr.docstring = griffe.Docstring(ast.literal_eval(value.args[0]), lineno=node.lineno, parent=attr)
        attr.value = None
        attr.annotation = "NDArray"
