"""Random worlds of everything there is, each held to what is promised of all: `pyverlet check fuzz`.

A world is a program, drawn by chance (`program`) and checked as it runs (`watch`). One that fails is made as small as can be, and
printed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pyverlet.common.errors import InputError
from pyverlet.lab.fuzz.program import Program, random_program, shrink
from pyverlet.lab.fuzz.watch import CHECKS, Broken, check

__all__ = ["CHECKS", "Broken", "Finding", "Program", "check", "fuzz", "random_program", "shrink"]


@dataclass(frozen=True)
class Finding:
    """One world: why it could not be built, or the promise it broke and the smallest program that does; None if all hold."""

    seed: int
    refused: str | None = None
    check: str | None = None
    program: str | None = None


def fuzz(worlds: int, seed: int = 0, *, small: bool = True, without: Sequence[str] = ()) -> Iterator[Finding]:
    """Check the worlds of so many seeds, from `seed` on.

    small: whether those that fail are made small, which takes some dozens of runs each. without: checks that are not made.
    """
    for number in range(seed, seed + worlds):
        yield look_at(random_program(number), small=small, without=without)


def look_at(program: Program, *, small: bool = True, without: Sequence[str] = ()) -> Finding:
    """Check one."""
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
    except Exception:  # what is left out was needed by what stays
        return None
    return None
