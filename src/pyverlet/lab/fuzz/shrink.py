"""A program that fails, made as small as can be: whatever can go without the same check holding goes."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import replace

from pyverlet.lab.fuzz.program import Program

Fails = Callable[[Program], int | None]  # the frame in which a program still fails in the same way; None if it does not


def shrink(program: Program, fails: Fails) -> Program:
    """The smallest program found, by leaving out one thing after the other until nothing more can be left out."""
    smaller, tries = True, 300
    while smaller and tries > 0:
        smaller = False
        for simpler in _simpler(program):
            tries -= 1
            frame = fails(simpler)
            if frame is not None:
                program, smaller = simpler, True
                break
            if tries <= 0:
                break
    return program


def _simpler(program: Program) -> Iterator[Program]:
    """Programs with one thing less, the boldest cuts first."""
    for fewer in (program.frames // 4, program.frames // 2, program.frames * 3 // 4, program.frames - 1):
        if 1 <= fewer < program.frames:
            yield replace(program, frames=fewer, changes=tuple(change for change in program.changes if change[0] < fewer))
    for fewer in (program.count // 10, program.count // 2, program.count * 3 // 4, program.count - 1):
        if 0 <= fewer < program.count:
            yield replace(program, count=fewer)
    for k in range(len(program.changes)):
        yield replace(program, changes=program.changes[:k] + program.changes[k + 1 :])
    for k in range(len(program.lines)):
        yield replace(program, lines=program.lines[:k] + program.lines[k + 1 :])
    for name in program.settings:
        yield replace(program, settings={key: value for key, value in program.settings.items() if key != name})
    for k, line in enumerate(program.lines):
        for shorter in _shorter(line):
            yield replace(program, lines=(*program.lines[:k], shorter, *program.lines[k + 1 :]))


def _shorter(line: str) -> Iterator[str]:
    """The line with one named argument of a call left out."""
    tree = ast.parse(line)
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        for k in range(len(call.keywords)):
            argument = call.keywords.pop(k)
            yield ast.unparse(tree)
            call.keywords.insert(k, argument)
