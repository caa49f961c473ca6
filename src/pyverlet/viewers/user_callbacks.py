"""Callbacks of the user's program, which draw over pictures and receive keys and clicks: a sketch's, or those given to `view`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from pyverlet.ground.errors import InputError
from pyverlet.scenes.sliders import Board, on_board


class UserCallbacks(Protocol):
    """Functions by the names `draw`, `keys` and `click`, and sliders. `scenes.sketch.Sketch` is one."""

    sliders: Board

    def has(self, hook: str) -> bool:
        """Whether there is such a function."""

    def call(self, hook: str, *arguments: Any) -> None:
        """Call it; an InputError says what is wrong, and it is not called any more."""


class CallbackFunctions:
    """Functions draw(world, pen), keys(world, key) and click(world, point, button) of a program, and its sliders."""

    def __init__(self, **functions: Callable[..., Any] | None) -> None:
        self.sliders = on_board()
        self._functions = {name: given for name, given in functions.items() if given is not None}
        for name, given in self._functions.items():
            if not callable(given):
                raise InputError(f"{name} is {given!r}; allowed is a function")

    def has(self, hook: str) -> bool:
        return hook in self._functions

    def call(self, hook: str, *arguments: Any) -> None:
        if hook not in self._functions:
            return
        try:
            self._functions[hook](*arguments)
        except Exception as error:
            del self._functions[hook]
            raise InputError(f"{hook} has failed, and is not called any more: {type(error).__name__}: {error}") from error
