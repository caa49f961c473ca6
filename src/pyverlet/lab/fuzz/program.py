"""A world as a program: lines that build it, and what is done to it while it runs. What is printed is what was run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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
