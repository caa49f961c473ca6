"""Join the modules of a unit of the core into one source, so that its functions are compiled together and inlined.

A unit is a module here and those it imports from here, each after its own imports. The joined source has one name space: imports
of siblings are dropped, and no two modules may define the same name. The build reads this file directly: it imports nothing from
the package.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).resolve().parent

_SIBLINGS: Final = "pyverlet.core."
_CALLED_BY_KERNELS: Final = ["@cython.cfunc", "@cython.nogil", "@cython.exceptval(check=False)"]
_WRITTEN: Final = {"@kernel": _CALLED_BY_KERNELS, "@inlined": ["@cython.inline", *_CALLED_BY_KERNELS]}
"""Expansions of the decorators of `kernels`."""


class JoinError(ValueError):
    """An error of modules that cannot be joined."""


@dataclass(frozen=True)
class Part:
    """One module of a unit, without its imports of siblings."""

    path: Path
    tree: ast.Module
    text: str
    """Has as many lines as the file."""


def _is_joined_import(node: ast.stmt) -> bool:
    """Whether this import is dropped from the joined source: a sibling's, or one from `__future__`."""
    if not isinstance(node, ast.ImportFrom) or node.module is None:
        return False
    return node.module == "__future__" or node.module.startswith(_SIBLINGS)


def _siblings(tree: ast.Module, path: Path) -> list[str]:
    """The names of the siblings that a module imports, in order."""
    names = []
    for node in tree.body:
        if _is_joined_import(node) and isinstance(node, ast.ImportFrom) and node.module != "__future__":
            if node.module == f"{_SIBLINGS}kernels":
                continue
            if renamed := [alias.name for alias in node.names if alias.asname or alias.name == "*"]:
                raise JoinError(
                    f"{path.name}, line {node.lineno}: {renamed[0]} is imported under another name; allowed is its own"
                )
            names.append(str(node.module).removeprefix(_SIBLINGS))
    return names


def _defined(tree: ast.Module) -> set[str]:
    """The names that a module defines, without imports."""
    names = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def parts(unit: str, folder: Path = FOLDER) -> list[Part]:
    """The modules of a unit, each after those it imports.

    Raises:
        JoinError: two modules define the same name, import each other, or rename what they import.
    """
    found: dict[str, Part] = {}
    defined: dict[str, str] = {}
    under_way: list[str] = []

    def visit(name: str) -> None:
        if name in found:
            return
        if name in under_way:
            raise JoinError(f"{' imports '.join([*under_way, name])}; allowed are no circles")
        path = folder / f"{name}.py"
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text, str(path))
        under_way.append(name)
        for sibling in _siblings(tree, path):
            visit(sibling)
        under_way.pop()
        for own in _defined(tree) - {"__all__"}:
            if own in defined:
                raise JoinError(f"{own} is defined in {defined[own]}.py and in {name}.py; allowed is one of each name in {unit}")
            defined[own] = name
        lines = text.split("\n")
        for node in tree.body:
            if _is_joined_import(node):
                lines[node.lineno - 1 : node.end_lineno] = [""] * ((node.end_lineno or node.lineno) - node.lineno + 1)
        kept = ast.Module([node for node in tree.body if not _is_joined_import(node)], tree.type_ignores)
        found[name] = Part(path, kept, "\n".join(lines))

    visit(unit)
    return list(found.values())


def joined(unit: str, folder: Path = FOLDER) -> tuple[str, list[tuple[Path, int]]]:
    """The joined source of a unit, and the file and line number of each of its lines but the first."""
    lines, origins = ["from __future__ import annotations"], []
    for part in parts(unit, folder):
        for number, line in enumerate(part.text.split("\n"), 1):
            written = _WRITTEN.get(line, [line])
            lines += written
            origins += [(part.path, number)] * len(written)
    return "\n".join(lines) + "\n", origins
