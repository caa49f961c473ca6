"""Converts links to rows in blocks, the form that the core solves; between frames the tables of `world.links` are valid."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.core import unit
from pyverlet.laws.links._link import REMEMBERED
from pyverlet.laws.links._pool import DISTANCE, PIN, Pool
from pyverlet.laws.links._set import partners
from pyverlet.state.sorted_state import SortedState

NUMBERS = ("stiffness", "damping", "strength", *REMEMBERED)

Block = list[int]

CHUNK = 64
"""Approximate number of rows per work item of a thread."""


class CoreLinks:
    """The links of one world in the engine's form, as rows and pins, and where in the pool each comes from.

    Attributes:
        rows: arrays by their names in `core/link_arrays.py`.
    """

    def __init__(self) -> None:
        self.rows: dict[str, Array] | None = None
        self._apart: Any = None  # pairs that links or rules keep from colliding
        self._known: Any = None  # iterations, substeps and periods passed to the engine
        self.forget()

    def forget(self) -> None:
        """Discard the rows, so that the pool is read anew."""
        self._edits = self._revision = -1  # of the pool and of the rows, when the rows were made
        self._order: Array | None = None  # the order of rows then
        self._pinned = np.zeros(0, bool)

    def keep_apart(self, world: Any, engine: Any) -> None:
        """Pass the pairs that links and rules keep from colliding to the engine, if they have changed."""
        rules = [apart for rule in world._rules if len(apart := rule.apart(world))] if world.actors else []
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

    def load(self, world: Any, engine: Any, substeps: int) -> None:
        """Pass the current links to the engine for frames of so many substeps."""
        if not (world.links or self.rows):
            return
        links, periodic = world.links, world._sorted.periodic
        changed = self._follow(links.pool, world._sorted, world._state.shown["mass"])
        if changed or (links.iterations, substeps, periodic) != self._known:
            self._known = links.iterations, substeps, periodic
            engine.set_links(self.rows, links.iterations, substeps, *periodic.period)

    def _follow(self, pool: Pool, state: SortedState, mass: Array) -> bool:
        """Update the rows to the current links and order of rows; returns whether any array was replaced."""
        if not len(pool):
            changed, self.rows = self.rows is not None, None
            self.forget()
            return changed
        same = self.rows is not None and self._edits == pool.edits
        alike = self._order is state.particle and self._revision == state.revision
        if not same or not (alike or np.array_equal(self._pinned, np.isinf(mass[self._particle]))):
            self._edits, self._order = pool.edits, None
            self._pack(pool, mass)
            same = False
        self._revision = state.revision
        assert self.rows is not None
        pool.live = [(row, self.rows[f"{prefix}intact"]) for prefix, row in self._sources.items()]
        if self._order is not state.particle:
            self._order = state.particle
            index_of = np.empty(len(state.particle), np.uint32)
            index_of[state.particle] = np.arange(len(index_of))
            self.rows["sorted_index"][:] = index_of[self._particle]
        return not same

    def _pack(self, pool: Pool, mass: Array) -> None:
        self._particle = np.unique(pool.particle)
        self._pinned = np.isinf(mass[self._particle])
        compact = np.zeros(len(mass), np.int64)
        compact[self._particle] = np.arange(len(self._particle))
        node, first, whole = compact[pool.particle].tolist(), pool.first.tolist(), pool.rows["intact"] != 0
        pins = pool.rows["kind"] == PIN
        entries = {row: tuple(node[first[row] : first[row + 1]]) for row in np.flatnonzero(whole & ~pins).tolist()}
        found = _blocks(pool.rows["kind"].tolist(), entries)
        blocks, cuts = by_colour([block for block, _ in found], [nodes for _, nodes in found], self._pinned)
        order = [row for block in blocks for row in block]
        parts = [entries[row] for row in order]
        self._sources = {"": np.array(order, np.int64), "pin_": np.flatnonzero(whole & pins)}  # pool row of each row here
        made = cuts | {"sorted_index": np.zeros(len(self._particle), np.uint32)}
        made["first"] = np.concatenate((np.zeros(1, np.int64), np.cumsum([len(each) for each in parts], dtype=np.int64)))
        made["node"] = np.array([node for each in parts for node in each], np.int64)
        made["pin_node"] = compact[pool.particle[pool.first[self._sources["pin_"]]]]
        made["kind"] = pool.rows["kind"][self._sources[""]].astype(np.int32)
        for prefix, names in (("", ("rest", "slack", "upper", *NUMBERS)), ("pin_", ("point", *NUMBERS))):
            row = self._sources[prefix]
            made[f"{prefix}intact"] = np.ones(len(row), np.int32)
            for name in names:
                column = pool.rows[name][row]
                made[f"{prefix}{name}"] = column if prefix or column.ndim == 1 else column[:, 0].copy()
        self.rows = made

    def end(self, links: Any) -> None:
        """After a successful frame: write the results of links to their pool."""
        broken_rows: list[tuple[int, float]] = []  # rows that broke, and their tension, N
        pool: Pool = links.pool
        for prefix, row in self._sources.items() if links and self.rows else ():
            mine: Any = self.rows
            if len(row) and unit("tools", np.float64).put_links(pool.rows, mine, prefix, REMEMBERED, row):
                broken, pull = np.flatnonzero(mine[f"{prefix}intact"] == 0), mine[f"{prefix}pull"]
                pulls = np.hypot(*pull[broken].T) if prefix else pull[broken]
                broken_rows += zip(row[broken].tolist(), pulls.tolist(), strict=True)
        pool.live = []
        links.accept(broken_rows)


def _blocks(kinds: list[int], entries: dict[int, tuple[int, ...]]) -> list[tuple[Block, tuple[int, ...]]]:
    """Chains of distance links, each turned to begin where the one before ends; then all other rows singly."""
    distance = [row for row in entries if kinds[row] == DISTANCE]
    found: list[tuple[Block, tuple[int, ...]]] = []
    for run, nodes in follow([entries[row] for row in distance]):  # type: ignore[misc]
        block = [distance[k] for k in run]
        for k, row in enumerate(block):
            entries[row] = (nodes[k], nodes[k + 1])
        found.append((block, tuple(nodes)))
    return found + [([row], nodes) for row, nodes in entries.items() if kinds[row] != DISTANCE]


# ---- which are solved together, and which beside each other ------------------------------------------------------------------


def follow(ends: list[tuple[int, int]]) -> list[tuple[Block, list[int]]]:
    """Chains of links that follow each other: their numbers, and the particles along them, each once.

    Two links follow each other at a particle that has no other links; or if its number is the mean of those of their other ends,
    as along the rows, columns and diagonals of a grid; or if one was given right after the other.
    """
    at: dict[int, list[int]] = {}
    for row, pair in enumerate(ends):
        for particle in pair:
            at.setdefault(particle, []).append(row)
    other = {(row, pair[side]): pair[1 - side] for row, pair in enumerate(ends) for side in (0, 1)}
    after: dict[tuple[int, int], int] = {}
    for particle, rows in at.items():
        across = {other[row, particle]: row for row in rows}
        left = []
        for row in rows:
            opposite = across.get(2 * particle - other[row, particle])
            if len(rows) == 2 or (opposite is not None and opposite != row):
                after[row, particle] = (rows[0] + rows[1] - row) if len(rows) == 2 else opposite  # type: ignore[assignment]
            else:
                left.append(row)
        k = 0
        while k + 1 < len(left):
            if left[k + 1] == left[k] + 1:
                after[left[k], particle], after[left[k + 1], particle] = left[k + 1], left[k]
                k += 1
            k += 1
    runs, used = [], [False] * len(ends)
    open_ends = [(row, side) for row, pair in enumerate(ends) for side in (0, 1) if (row, pair[side]) not in after]
    for row, side in open_ends + [(row, 0) for row in range(len(ends))]:  # the rest are rings
        if used[row]:
            continue
        nodes, block = [ends[row][side]], []
        here: int | None = row
        seen = {nodes[0]}
        while here is not None and not used[here] and (end := other[here, nodes[-1]]) not in seen:
            used[here] = True
            block.append(here)
            nodes.append(end)
            seen.add(end)
            here = after.get((here, end))
        runs.append((block, nodes))
    runs += [([row], list(ends[row])) for row in range(len(ends)) if not used[row]]
    return [run for run in runs if run[0]]


def by_colour(blocks: list[Block], nodes: list[tuple[int, ...]], pinned: Array) -> tuple[list[Block], dict[str, Array]]:
    """Sort blocks by colour: blocks of one colour share no movable particle and are solved in parallel. Also returns the offsets:
    rows of each `block`, blocks of each `chunk`, chunks of each `colour`.
    """
    last: dict[int, set[int]] = {}
    colours: list[int] = []
    for joined in nodes:
        taken: set[int] = set()
        free = [node for node in joined if not pinned[node]]
        for node in free:
            taken |= last.setdefault(node, set())
        colour = 0
        while colour in taken:
            colour += 1
        colours.append(colour)
        for node in free:
            last[node].add(colour)
    order = sorted(range(len(blocks)), key=lambda k: colours[k])
    begins, chunk, colour_begin, rows = [0], [0], [0], 0
    for place, k in enumerate(order):
        opens = place > 0 and colours[k] != colours[order[place - 1]]
        if place > 0 and (opens or rows >= CHUNK):
            chunk.append(place)
            rows = 0
        if opens:
            colour_begin.append(len(chunk) - 1)
        rows += len(blocks[k])
        begins.append(begins[-1] + len(blocks[k]))
    if order:
        chunk.append(len(order))
        colour_begin.append(len(chunk) - 1)
    cuts = {name: np.array(cut, np.int64) for name, cut in (("block", begins), ("chunk", chunk), ("colour", colour_begin))}
    alone = [all(pinned[node] or len(last[node]) == 1 for node in nodes[k]) for k in order]
    return [blocks[k] for k in order], cuts | {"alone": np.array(alone, np.int32)}
