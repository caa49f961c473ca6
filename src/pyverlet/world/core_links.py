"""Links under the contact law: what the engine is given of them, and what they make of a frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.laws.links._set import partners
from pyverlet.world.link_rows import LinkRows


class CoreLinks:
    """The links of one world, as its engine has them."""

    def __init__(self) -> None:
        self._rows = LinkRows()
        self._apart: Any = None  # pairs that the engine does not let touch
        self._known: Any = None  # passes and seam that it knows

    def forget(self) -> None:
        """Read the tables of the world anew."""
        self._rows.forget()

    def keep_apart(self, world: Any, engine: Any) -> None:
        """Give the engine the pairs that links and rules keep from touching, if they are others than before."""
        rules = [apart for rule in world._rules if len(apart := rule.apart(world))]
        if not (world.links or rules or self._apart is not None):
            return
        apart = world.links.known_apart()
        if rules:
            apart = np.concatenate((apart, *rules))
            if self._apart is not None and np.array_equal(apart, self._apart):
                apart = self._apart
        if apart is not self._apart:
            self._apart = apart
            begin, to = partners(apart, len(world))
            engine.set_linked(begin, to.astype(np.int32))

    def load(self, world: Any, engine: Any) -> None:
        """Give the engine the links of now."""
        if not (world.links or self._rows.rows):
            return
        links, seam = world.links, world._slots.seam
        changed = self._rows.load(links, world._slots, world._state.mass)
        if changed or (links.iterations, seam) != self._known:
            self._known = links.iterations, seam
            engine.set_links(self._rows.rows, links.iterations, *seam.period)

    def end(self, world: Any) -> None:
        """The frame is good: what it did to the links holds."""
        world.links.accept(self._rows.hand_over() if world.links else [])
