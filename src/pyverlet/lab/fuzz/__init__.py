"""Fuzzing: random worlds with all features, each checked against all guarantees: `pyverlet check fuzz`.

A world is a program, drawn at random (`program`) and checked as it runs (`watch`). One that fails is reduced to a minimal program
and printed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pyverlet.common.errors import InputError
from pyverlet.lab.fuzz.program import Program, random_program, shrink
from pyverlet.lab.fuzz.watch import CHECKS, Broken, check

__all__ = ["CHECKS", "Broken", "Finding", "Program", "check", "fuzz", "random_program", "shrink"]


@dataclass(frozen=True)
class Finding:
    """Result for one world: why it could not be built, or the broken guarantee and a minimal program; None if none broke."""

    seed: int
    refused: str | None = None
    check: str | None = None
    program: str | None = None


def fuzz(worlds: int, seed: int = 0, *, small: bool = True, without: Sequence[str] = ()) -> Iterator[Finding]:
    """Check the worlds of so many seeds, starting at `seed`.

    small: whether to reduce failing ones, which takes some dozens of runs each. without: checks to skip.
    """
    for number in range(seed, seed + worlds):
        yield look_at(random_program(number), small=small, without=without)


def look_at(program: Program, *, small: bool = True, without: Sequence[str] = ()) -> Finding:
    """Check one program."""
    try:
        _run(program, without=without)
    except InputError as error:
        return Finding(program.seed, refused=str(error))
    except Broken as broken:
        name = broken.check
        least = shrink(program, lambda simpler: _frame(simpler, name)) if small else program
        return Finding(program.seed, check=str(broken), program=least.source(only=name))
    return Finding(program.seed)


def _run(program: Program, only: str | None = None, without: Sequence[str] = ()) -> None:
    build, change = program.functions()
    check(build, change, frames=program.frames, dt=program.seconds, only=only, without=without)


def _frame(program: Program, name: str) -> int | None:
    try:
        _run(program, name)
    except Broken as broken:
        return broken.frame if broken.check == name else None
    except Exception:  # a remaining line needs what was left out
        return None
    return None
