"""A world as a program: lines that build it, and what is done to it while it runs. What is printed is what was run.

One that fails is made as small as can be: whatever can go without the same check holding goes.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import pyverlet as pv
from pyverlet.world.world import World

Build = Callable[[int | None], World]  # a world on at most so many threads
Change = Callable[[World, int], None]  # does to a world what is due before a frame of this number


@dataclass(frozen=True)
class Program:
    """A world and its history."""

    seed: int  # of all that the lines draw by chance
    count: int  # circles, `n` in the lines
    settings: Mapping[str, str] = field(default_factory=dict)  # arguments of `pv.World`, as they are written
    lines: tuple[str, ...] = ()  # statements that fill `world`, in terms of `n` and `rng`
    changes: tuple[tuple[int, str], ...] = ()  # (frame, statement) what is done to `world` before this frame
    frames: int = 40  # how many are stepped
    dt: str = "1 / 60"  # s, as it is written

    @property
    def body(self) -> str:
        """The two functions: `build(threads)` and `change(world, frame)`."""
        settings = ", ".join(f"{name}={value}" for name, value in {**self.settings, "threads": "threads"}.items())
        built = [f"rng, n = np.random.default_rng({self.seed}), {self.count}", f"world = pv.World({settings})", *self.lines]
        changes = [f"if frame == {frame}:\n        {statement}" for frame, statement in self.changes]
        build, change = ("\n    ".join(lines) for lines in ([*built, "return world"], changes or ["pass"]))
        return f"def build(threads):\n    {build}\n\n\ndef change(world, frame):\n    {change}"

    def source(self, only: str | None = None) -> str:
        """The whole program, to be run by itself; `only`: the check that fails."""
        chosen = f", only={only!r}" if only else ""
        return (
            "import numpy as np\n\nimport pyverlet as pv\nfrom pyverlet.lab import fuzz\n\n\n"
            f"{self.body}\n\n\nfuzz.check(build, change, frames={self.frames}, dt={self.dt}{chosen})\n"
        )

    def functions(self) -> tuple[Build, Change]:
        """`build` and `change`, compiled from what is printed."""
        names: dict[str, Any] = {"np": np, "pv": pv}
        exec(compile(self.body, "<fuzzed world>", "exec"), names)
        return names["build"], names["change"]

    @property
    def seconds(self) -> float:
        """A frame, s."""
        top, _, bottom = self.dt.partition("/")
        return float(top) / float(bottom or 1)


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
