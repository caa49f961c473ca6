"""Undo and redo: worlds as they were before they were changed by hand."""

from __future__ import annotations

from typing import Any

from pyverlet.world.panels import Panels

MOST = 50  # steps back
ROOM = 256_000_000  # bytes for all of them, about; two steps there are always
EACH = 400  # bytes a particle takes in a copy of a world, about


class History:
    """What was done to worlds by hand, each with what they were before it: all of it, their time too.

    A stroke is one thing done, from when a pointer comes down until it is released.
    """

    def __init__(self, panels: Panels) -> None:
        self._panels = panels
        self._back: list[Any] = []
        self._forth: list[Any] = []
        self._strokes: set[int] = set()
        self._before: Any = None

    @property
    def depth(self) -> tuple[int, int]:
        """How often one can undo, and redo."""
        return len(self._back), len(self._forth)

    def open(self, pointer: int) -> None:
        """A pointer is about to do something."""
        self._before = None if pointer in self._strokes else self._panels.save()

    def close(self, pointer: int, *, changed: bool) -> None:
        """It has; or nothing has come of it."""
        if changed and self._before is not None:
            self._back.append(self._before)
            self._forth.clear()
            self._strokes.add(pointer)
            most = max(2, min(MOST, ROOM // (EACH * max(1, sum(map(len, self._panels.worlds))))))
            del self._back[:-most]
        self._before = None

    def release(self, pointer: int) -> None:
        """What this pointer does next is another thing."""
        self._strokes.discard(pointer)

    def undo(self) -> bool:
        """Go back to before the last thing done; whether there was one."""
        return self._go(self._back, self._forth)

    def redo(self) -> bool:
        """Go to where the last undo was asked for."""
        return self._go(self._forth, self._back)

    def _go(self, source: list[Any], to: list[Any]) -> bool:
        if not source:
            return False
        self._strokes.clear()
        to.append(self._panels.save())
        self._panels.restore(source.pop())
        return True
