"""A program that fails, made as small as can be: whatever can go without the same check holding goes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from pyverlet.lab.fuzz.program import Program

Fails = Callable[[Program], int | None]
"""The frame in which a program still fails in the same way; None if it does not."""


def shrink(program: Program, fails: Fails, *, tries: int = 300) -> Program:
    """The smallest program found, by leaving out one thing after the other until nothing more can be left out."""
    smaller = True
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
            yield replace(program, frames=fewer, deeds=tuple(deed for deed in program.deeds if deed[0] < fewer))
    for fewer in (program.count // 10, program.count // 2, program.count * 3 // 4, program.count - 1):
        if 0 <= fewer < program.count:
            yield replace(program, count=fewer)
    for k in range(len(program.deeds)):
        yield replace(program, deeds=program.deeds[:k] + program.deeds[k + 1 :])
    for k in range(len(program.lines)):
        yield replace(program, lines=program.lines[:k] + program.lines[k + 1 :])
    for name in program.settings:
        yield replace(program, settings={key: value for key, value in program.settings.items() if key != name})
    for k, line in enumerate(program.lines):
        for shorter in _shorter(line):
            yield replace(program, lines=(*program.lines[:k], shorter, *program.lines[k + 1 :]))


def _shorter(line: str) -> Iterator[str]:
    """The call of a line with one of its named arguments left out."""
    start = line.find("=")
    while start > 0:
        name = start
        while line[name - 1].isidentifier():
            name -= 1
        depth, end = 0, start
        while end < len(line) and not (depth == 0 and line[end] in ",)"):
            depth += (line[end] in "([") - (line[end] in ")]")
            end += 1
        if line[name - 2 : name] == ", ":
            yield line[: name - 2] + line[end:]
        elif line[name - 1] == "(" and line[end : end + 2] == ", ":
            yield line[:name] + line[end + 2 :]
        start = line.find("=", start + 1)
