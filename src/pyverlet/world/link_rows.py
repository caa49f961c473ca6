"""Links as rows in blocks, as the core solves them; the tables of `world.links` hold the truth between frames."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import InputError
from pyverlet.laws.links._chains import ChainPool
from pyverlet.laws.links._link import REMEMBERED
from pyverlet.laws.links._pool import Pool
from pyverlet.laws.links.pin import PinPool
from pyverlet.state.slots import Slots

Array = NDArray[Any]

DISTANCE, ANGLE, AREA, PIN_X, PIN_Y = range(5)
"""Kinds of rows, as the core numbers them."""

WIDEST_BAND = 8
"""Rows of a block that share a particle are no farther apart; others become blocks of their own."""

Block = list[int]


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


class LinkRows:
    """Rows, and where in the tables each comes from."""

    def __init__(self) -> None:
        self._signature: Any = None
        self._order: Any = None
        self._pinned = np.zeros(0, bool)
        self.rows: dict[str, Array] = {}
        self._cut = np.zeros(2, np.int64)

    def __len__(self) -> int:
        return len(self.rows["kind"]) if self.rows else 0

    def forget(self) -> None:
        """Read the tables anew when they are asked for."""
        self._signature = None

    def load(self, links: Any, state: Slots, mass: Array) -> None:
        """Bring the rows up to date with the links of a world and the order of its slots."""
        pools = list(links._kept)
        among = np.concatenate([np.empty(0, np.int64), *(pool.entries["particle"] for pool in pools)])
        pinned = np.isinf(mass[among])
        signature = [(pool, pool.rows, pool.edits) for pool in pools]
        if self._signature != signature or not np.array_equal(self._pinned, pinned):
            self._signature, self._pinned, self._order = signature, pinned, None
            self._pack(pools, mass)
        if self._order is not state.particle:
            self._order = state.particle
            slot_of = np.empty(len(state.particle), np.uint32)
            slot_of[state.particle] = np.arange(len(slot_of))
            self.rows["node"] = slot_of[self._particle]

    def _pack(self, pools: list[Pool], mass: Array) -> None:
        where: list[tuple[int, int, int]] = []  # pool, its row, kind
        parts: list[tuple[int, ...]] = []
        for number, pool in enumerate(pools):
            first, particle, intact = pool.first.tolist(), pool.entries["particle"].tolist(), pool.rows["intact"]
            for row in np.flatnonzero(intact).tolist():
                joined = tuple(particle[first[row] : first[row + 1]])
                if isinstance(pool, PinPool):
                    where += [(number, row, PIN_X), (number, row, PIN_Y)]
                    parts += [joined, joined]
                else:
                    kind = DISTANCE if isinstance(pool, ChainPool) else ANGLE + int(pool.rows["kind"][row])
                    where.append((number, row, kind))
                    parts.append(joined)
        blocks, bands = self._blocks([kind for *_, kind in where], parts)
        blocks, bands, clusters = _by_cluster(blocks, bands, parts, np.isinf(mass))
        order = [row for block in blocks for row in block]
        source = np.array([where[row] for row in order], np.int64).reshape(-1, 3)
        entries = [parts[row] for row in order]
        self._particle = np.array([particle for each in entries for particle in each], np.int64)
        self._clusters = clusters
        count = len(order)
        made = {name: np.zeros(count) for name in ("soft", "target", "aim", "left", "pivot", "inverse")}
        made |= {name: np.empty(count) for name in ("rest", "stiffness", "damping", "strength", *REMEMBERED)}
        made["upper"] = np.full(count, np.inf)
        made["kind"] = source[:, 2].astype(np.int32)
        made["intact"], made["acts"] = np.ones(count, np.int32), np.zeros(count, np.int32)
        made["first"] = np.concatenate((np.zeros(1, np.int64), np.cumsum([len(each) for each in entries], dtype=np.int64)))
        made["gradient"] = np.zeros((len(self._particle), 2))
        made["begin"] = np.concatenate((np.zeros(1, np.int64), np.cumsum([len(block) for block in blocks], dtype=np.int64)))
        made["band"] = np.array(bands, np.int64)
        size = np.bincount(clusters, minlength=1) if len(clusters) else np.zeros(1, int)
        made["single"] = (size[clusters] == 1).astype(np.int32) if len(clusters) else np.zeros(0, np.int32)
        made["matrix"] = np.zeros((count, max(bands, default=0) + 1))
        self._source = []
        for number, pool in enumerate(pools):
            here = np.flatnonzero(source[:, 0] == number)
            row, axis = source[here, 1], (source[here, 2] == PIN_Y).astype(int)
            self._source.append((pool, here, row, axis))
            table = pool.rows
            for name in ("stiffness", "damping", "strength"):
                made[name][here] = table[name][row]
            for name in REMEMBERED:
                made[name][here] = table[name][row, axis]
            made["rest"][here] = table["point"][row, axis] if isinstance(pool, PinPool) else table["rest"][row]
            if not isinstance(pool, PinPool):
                made["upper"][here] = table["upper"][row]
        several = np.repeat(made["single"] == 0, [len(block) for block in blocks])
        if (several & np.isinf(made["stiffness"])).any():
            self.forget()
            raise InputError(
                "impulses is True in a world with rigid links that form a net, a closed ring or a branching chain; allowed are "
                "chains of rigid links with their pins and angles, and anything of springs and of links with compliance"
            )
        self.rows = made

    def _blocks(self, kinds: list[int], parts: list[tuple[int, ...]]) -> tuple[list[Block], list[int]]:
        """Runs of distances, with the pins and angles at their particles in between; what fits nowhere is a block of its own."""
        distance = [row for row, kind in enumerate(kinds) if kind == DISTANCE]
        runs = follow([parts[row] for row in distance])  # type: ignore[misc]
        place: dict[int, tuple[int, int]] = {}
        keyed: list[list[tuple[float, int]]] = []
        for number, (block, nodes) in enumerate(runs):
            keyed.append([(float(k), distance[row]) for k, row in enumerate(block)])
            for k, node in enumerate(nodes):
                place.setdefault(node, (number, k))
        extra: list[Block] = []
        for row, kind in enumerate(kinds):
            if kind in (PIN_X, PIN_Y) and parts[row][0] in place:
                number, k = place[parts[row][0]]
                keyed[number].append((k - 0.5, row))
            elif kind == ANGLE and all(node in place for node in parts[row]):
                (a, i), (b, j), (c, k) = (place[node] for node in parts[row])
                if a == b == c and abs(i - j) == abs(k - j) == 1:
                    keyed[b].append((j + 0.25, row))
                else:
                    extra.append([row])
            elif kind == PIN_Y:
                extra[-1].append(row)
            elif kind != DISTANCE:
                extra.append([row])
        blocks = []
        for each in keyed:
            block = [row for _, row in sorted(each)]
            if _band(block, parts) > WIDEST_BAND:
                extra += [[row] for row in block if kinds[row] == ANGLE]
                block = [row for row in block if kinds[row] != ANGLE]
            blocks.append(block)
        blocks += extra
        return blocks, [_band(block, parts) for block in blocks]

    def cut(self, threads: int) -> Array:
        """(threads + 1,) the blocks of each thread: whole clusters, and about as many rows."""
        begin = self.rows["begin"]
        opens = np.flatnonzero(np.diff(self._clusters, prepend=-1, append=-1))
        wanted = begin[-1] * np.arange(threads + 1) // max(threads, 1)
        cut = opens[np.searchsorted(begin[opens], wanted)] if len(opens) else np.zeros(threads + 1, np.int64)
        cut[0], cut[-1] = 0, len(self._clusters)
        return np.ascontiguousarray(cut, np.int64)

    def hand_over(self) -> list[tuple[Pool, Array, Array]]:
        """Write what the frame did into the tables; returns of each pool the rows that broke, and their pull, N."""
        torn = []
        for pool, here, row, axis in self._source if self.rows else ():
            intact, pull, table = self.rows["intact"][here] != 0, self.rows["pull"][here], pool.rows
            for name in REMEMBERED:
                table[name][row, axis] = self.rows[name][here]
            table["intact"][row] = intact
            if isinstance(pool, PinPool):
                pull = np.repeat(np.hypot(pull[0::2], pull[1::2]), 2) if len(pull) else pull
            table["force"][row] = np.where(intact, pull, 0.0)
            if not intact.all():
                broken, which = np.unique(row[~intact], return_index=True)
                torn.append((pool, broken, pull[~intact][which]))
        return torn


def _band(block: Block, parts: list[tuple[int, ...]]) -> int:
    """How far apart rows of a block are that share a particle."""
    first: dict[int, int] = {}
    return max((k - first.setdefault(node, k) for k, row in enumerate(block) for node in parts[row]), default=0)


def _by_cluster(
    blocks: list[Block], bands: list[int], parts: list[tuple[int, ...]], pinned: Array
) -> tuple[list[Block], list[int], Array]:
    """The blocks of each cluster one after the other; clusters share no particle that can move."""
    root = list(range(len(blocks)))

    def find(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    holder: dict[int, int] = {}
    for number, block in enumerate(blocks):
        for row in block:
            for node in parts[row]:
                if not pinned[node]:
                    a, b = sorted((find(holder.setdefault(node, number)), find(number)))
                    root[b] = a
    roots = np.array([find(k) for k in range(len(blocks))], np.int64)
    order = np.argsort(roots, kind="stable")
    clusters = np.unique(roots[order], return_inverse=True)[1]
    return [blocks[k] for k in order], [bands[k] for k in order], clusters
