"""Who shares a world with a page that steps it waits for the end of the frame under way."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Concatenate, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S", bound="Shared")


class Shared:
    """Something that several threads may share."""

    turns: Callable[[], AbstractContextManager[None]] | None = None
    """Gives the caller the world between two frames; None as long as nobody shares it."""


def in_turn(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """A method that waits for its turn, if the world is shared."""

    @functools.wraps(method)
    def waiting(self: S, /, *arguments: P.args, **options: P.kwargs) -> R:
        if self.turns is None:
            return method(self, *arguments, **options)
        with self.turns():
            return method(self, *arguments, **options)

    return waiting
