"""Parses the ends of links: `(group, i, j)` within a group, `(group_a, i), (group_b, j)` between two, indices or arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common.arrays import Indices
from pyverlet.common.errors import InputError
from pyverlet.state.group import Group
from pyverlet.state.state import State


def parse(kind: str, ends: tuple[Any, ...], names: tuple[str, ...]) -> tuple[State, Indices]:
    """The world's particles and (k, p) indices among them, for the p ends called `names`.

    Raises:
        InputError: in one sentence that starts with `kind`.
    """
    if ends and isinstance(ends[0], Group) and len(ends) == 1 + len(names):
        pairs = [(ends[0], index) for index in ends[1:]]
    elif len(ends) == len(names) and all(isinstance(end, tuple) and len(end) == 2 for end in ends):
        pairs = list(ends)
    else:
        within = ", ".join(("group", *names))
        between = ", ".join(f"(group_{'abc'[n]}, {name})" for n, name in enumerate(names))
        given = ", ".join(map(_brief, ends))
        raise InputError(f"{kind} was given ({given}); allowed are ({within}) or ({between})")
    columns = [_column(kind, name, *pair) for name, pair in zip(names, pairs, strict=True)]
    state = pairs[0][0]._state
    if any(group._state is not state for group, _ in pairs):
        raise InputError(f"{kind} joins groups of different worlds; allowed are groups of one world")
    lengths = {len(column) for column in columns if len(column) > 1}
    if len(lengths) > 1:
        said = " and ".join(f"{name} has {len(column)}" for name, column in zip(names, columns, strict=True))
        raise InputError(f"{kind}: {said} indices; allowed are equally many, or one for all")
    joined = np.empty((max(map(len, columns)), len(columns)), np.int64)
    for n, column in enumerate(columns):
        joined[:, n] = column
    if len(joined) == 1 and len(set(joined[0].tolist())) == len(names):
        return state, joined
    for a in range(len(names)):
        for b in range(a):
            same = joined[:, a] == joined[:, b]
            if same.any():
                row = int(np.flatnonzero(same)[0])
                both = f"{names[b]}[{row}] and {names[a]}[{row}]"
                raise InputError(f"{kind}: {both} are the same particle, {joined[row, a]}; allowed are different ones")
    return state, joined


def parse_ring(kind: str, group: Any, ring: Any) -> tuple[State, Indices]:
    """The group's particles and (p,) indices among them of a ring of at least three distinct ones; None for all of them."""
    particles = _column(kind, "ring", group, np.arange(len(group)) if ring is None and isinstance(group, Group) else ring)
    if len(particles) < 3:
        raise InputError(f"{kind}: ring has {len(particles)} particles; allowed are at least 3")
    if len(np.unique(particles)) < len(particles):
        raise InputError(f"{kind}: ring has a particle twice; allowed are different ones, in order along the ring")
    return group._state, particles


def _brief(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _column(kind: str, name: str, group: Any, index: Any) -> Indices:
    if not isinstance(group, Group):
        raise InputError(f"{kind}: the group of {name} is {_brief(group)}; allowed is what world.add returns")
    where = group._where  # raises for a group whose particles were all removed
    among = where if isinstance(where, np.ndarray) else None  # for picked particles, all indices
    start, count = (0, len(where)) if among is not None else (where.start, where.stop - where.start)
    if among is None and type(index) is int and -count <= index < count:  # fast path for many single links
        return np.array([start + index % count])
    array = np.atleast_1d(np.asarray(index))
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InputError(f"{kind}: {name} is {_brief(index)}; allowed is an index in the group, or a (k,) array of them")
    wrong = (array < -count) | (array >= count)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        which = f"{name}[{first}]" if np.ndim(index) else name
        raise InputError(f"{kind}: {which} is {array[first]}; allowed is 0 to {count - 1} for a group of {count} particles")
    numbers: Indices = start + np.where(array < 0, array + count, array).astype(np.int64)
    return numbers if among is None else among[numbers]
