"""Which links are solved together, and which beside each other."""

from __future__ import annotations

import numpy as np

from pyverlet.ground.arrays import Array

Block = list[int]

CHUNK = 64
"""Rows that a thread takes at a time, about."""


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
