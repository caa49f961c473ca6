"""Links as rows in blocks, as the core solves them; the tables of `world.links` hold the truth between frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.laws.links._link import REMEMBERED
from pyverlet.laws.links._pool import DistancePool, PinPool, Pool
from pyverlet.laws.links._set import partners
from pyverlet.state.slots import Slots

DISTANCE, ANGLE, AREA = range(3)
"""Kinds of rows, as the core numbers them."""

NUMBERS = ("stiffness", "damping", "strength")

Block = list[int]

CHUNK = 64
"""Rows that a thread takes at a time, about."""


class CoreLinks:
    """The links of one world as rows and pins, as its engine has them, and where in the tables each comes from.

    Attributes:
        rows: arrays by their names in `core/link_arrays.py`.
    """

    def __init__(self) -> None:
        self.rows: dict[str, Array] | None = None
        self._apart: Any = None  # pairs that the engine does not let touch
        self._known: Any = None  # passes and seam that it knows
        self.forget()

    def forget(self) -> None:
        """Read the tables anew when they are asked for."""
        self._signature: Any = None
        self._pinned = np.zeros(0, bool)
        self._sources: list[tuple[Pool, Array, Array]] = []  # pool, its rows, where they are

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
        if not (world.links or self.rows):
            return
        links, seam = world.links, world._slots.seam
        changed = self._follow(links, world._slots, world._state.mass)
        if changed or (links.iterations, seam) != self._known:
            self._known = links.iterations, seam
            engine.set_links(self.rows, links.iterations, *seam.period)

    def _follow(self, links: Any, state: Slots, mass: Array) -> bool:
        """Bring the rows up to date with the links of a world and the order of its slots; whether anything is another array."""
        pools = list(links._kept)
        if not sum(len(pool.rows) for pool in pools):
            changed, self.rows = self.rows is not None, None
            self.forget()
            return changed
        signature = [(pool, pool.rows, pool.edits) for pool in pools]
        same = self.rows is not None and self._signature == signature
        if not same or not np.array_equal(self._pinned, np.isinf(mass[self._particle])):
            self._signature, self._order = signature, None
            self._pack(pools, mass)
            same = False
        assert self.rows is not None
        for pool, row, here in self._sources:
            pool.live = row, self.rows["pin_intact" if isinstance(pool, PinPool) else "intact"], here
        if self._order is not state.particle:
            self._order = state.particle
            slot_of = np.empty(len(state.particle), np.uint32)
            slot_of[state.particle] = np.arange(len(slot_of))
            self.rows["slot"][:] = slot_of[self._particle]
        return not same

    def _pack(self, pools: list[Pool], mass: Array) -> None:
        self._particle = np.unique(np.concatenate([pool.entries["particle"] for pool in pools]))
        self._pinned = np.isinf(mass[self._particle])
        compact = np.zeros(len(mass), np.int64)
        compact[self._particle] = np.arange(len(self._particle))
        where: list[tuple[int, int, int]] = []  # pool, its row, kind
        parts: list[tuple[int, ...]] = []
        for number, pool in enumerate(pools):
            if isinstance(pool, PinPool):
                continue
            first, node = pool.first.tolist(), compact[pool.entries["particle"]].tolist()
            for row in np.flatnonzero(pool.rows["intact"]).tolist():
                kind = DISTANCE if isinstance(pool, DistancePool) else ANGLE + int(pool.rows["kind"][row])
                where.append((number, row, kind))
                parts.append(tuple(node[first[row] : first[row + 1]]))
        found = self._blocks([kind for *_, kind in where], parts)
        blocks, cuts = by_colour([block for block, _ in found], [nodes for _, nodes in found], self._pinned)
        order = [row for block in blocks for row in block]
        source = np.array([where[row] for row in order], np.int64).reshape(-1, 3)
        entries = [parts[row] for row in order]
        self.rows = self._arrays(pools, source, entries) | self._pins(pools, compact) | cuts
        self.rows["slot"] = np.zeros(len(self._particle), np.uint32)

    def _blocks(self, kinds: list[int], parts: list[tuple[int, ...]]) -> list[tuple[Block, tuple[int, ...]]]:
        """Runs of distances that follow each other, each turned to begin where the one before ends; single rows after them."""
        distance = [row for row, kind in enumerate(kinds) if kind == DISTANCE]
        found: list[tuple[Block, tuple[int, ...]]] = []
        for run, nodes in follow([parts[row] for row in distance]):  # type: ignore[misc]
            block = [distance[k] for k in run]
            for k, row in enumerate(block):
                parts[row] = (nodes[k], nodes[k + 1])
            found.append((block, tuple(nodes)))
        return found + [([row], parts[row]) for row, kind in enumerate(kinds) if kind != DISTANCE]

    def _arrays(self, pools: list[Pool], source: Array, entries: list[tuple[int, ...]]) -> dict[str, Array]:
        count = len(entries)
        made: dict[str, Array] = {name: np.empty(count) for name in ("rest", "upper", *NUMBERS, *REMEMBERED)}
        made["slack"] = np.zeros(count)
        made["kind"], made["intact"] = source[:, 2].astype(np.int32), np.ones(count, np.int32)
        made["first"] = np.concatenate((np.zeros(1, np.int64), np.cumsum([len(each) for each in entries], dtype=np.int64)))
        made["node"] = np.array([node for each in entries for node in each], np.int64)
        self._sources = []
        for number, pool in enumerate(pools):
            here = np.flatnonzero(source[:, 0] == number)
            row, table = source[here, 1], pool.rows
            if isinstance(pool, PinPool):
                continue
            self._sources.append((pool, row, here))
            for name in ("rest", "upper", *NUMBERS, *(("slack",) if "slack" in table else ())):
                made[name][here] = table[name][row]
            for name in REMEMBERED:
                made[name][here] = table[name][row, 0]
        return made

    def _pins(self, pools: list[Pool], compact: Array) -> dict[str, Array]:
        pool = next((pool for pool in pools if isinstance(pool, PinPool)), None) or PinPool()
        row, table = np.flatnonzero(pool.rows["intact"]), pool.rows
        self._sources.append((pool, row, np.arange(len(row))))
        made = {f"pin_{name}": np.ascontiguousarray(table[name][row]) for name in ("point", *NUMBERS, *REMEMBERED)}
        made["pin_node"], made["pin_intact"] = compact[pool.entries["particle"][row]], np.ones(len(row), np.int32)
        return made

    def end(self, links: Any) -> None:
        """The frame is good: write what it did to the links of a world into the tables."""
        torn = []  # of each pool the rows that broke, and their pull, N
        for pool, row, here in self._sources if links and self.rows else ():
            pins, table = isinstance(pool, PinPool), pool.rows
            mine = {name: self.rows[f"pin_{name}" if pins else name][here] for name in ("intact", *REMEMBERED)}  # type: ignore[index]
            for name in REMEMBERED:
                table[name][row] = mine[name] if pins else mine[name][:, None]
            pull, intact = np.hypot(*mine["pull"].T) if pins else mine["pull"], mine["intact"] != 0
            table["intact"][row], pool.live = intact, None
            table["force"][row] = np.where(intact, pull, 0.0)
            if not intact.all():
                torn.append((pool, row[~intact], pull[~intact]))
        links.accept(torn)


# ---- which are solved together, and which beside each other ------------------------------------------------------------------


def follow(ends: list[tuple[int, int]]) -> list[tuple[Block, list[int]]]:
    """Runs of links that follow each other: their numbers, and the particles they go through, each once.

    Two follow each other at a particle without others; or if its number lies in the middle between those of their other ends,
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
    for row, side in open_ends + [(row, 0) for row in range(len(ends))]:  # those left are rings
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
    """The blocks of each colour one after the other: those of one share no particle that can move. And where they begin:
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
