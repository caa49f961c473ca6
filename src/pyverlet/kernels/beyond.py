"""Who reaches beyond a wall, eight at a time: hardly anybody does."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.bits import lowest_bit
from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import LANES, load, load_rows, spread, which_above


@kernel
def _list(beyond, k, inverse_mass, found, number):
    """Add those of the circles k, k + 1, ... that are free and whose bits are set to the `number` found so far."""
    while beyond != 0:
        lane = lowest_bit(beyond)
        found[number] = k + lane
        number += inverse_mass[k + lane] > 0
        beyond &= beyond - 1
    return number


@kernel
def beyond_circle(x0, y0, size, position, radius, inverse_mass, first, stop, found):
    """List the free circles from `first` up to `stop` that reach beyond the cage; returns how many."""
    number = np.int64(0)
    packed = stop - (stop - first) % LANES
    centre_x, centre_y, whole = spread(x0), spread(y0), spread(size)
    for k in range(first, packed, LANES):
        x, y = load_rows(position, k)
        dx, dy, room = x - centre_x, y - centre_y, whole - load(radius, k)
        beyond = which_above(dx * dx + dy * dy, room * room)
        if beyond != 0:
            number = _list(beyond, k, inverse_mass, found, number)
    for i in range(packed, stop):
        dx, dy, room = position[i, 0] - x0, position[i, 1] - y0, size - radius[i]
        if dx * dx + dy * dy > room * room and inverse_mass[i] > 0:
            found[number] = i
            number += 1
    return number


@kernel
def beyond_box(x0, y0, x1, y1, position, radius, inverse_mass, first, stop, found):
    """The same for a box."""
    number, zero = np.int64(0), position.dtype.type(0)  # not x0 - x0: a wall may be infinitely far away
    packed = stop - (stop - first) % LANES
    left, right, floor, ceiling, none = spread(x0), spread(x1), spread(y0), spread(y1), spread(zero)
    for k in range(first, packed, LANES):
        x, y = load_rows(position, k)
        r = load(radius, k)
        beyond = which_above(left + r - x, none) | which_above(x - (right - r), none)
        beyond |= which_above(floor + r - y, none) | which_above(y - (ceiling - r), none)
        if beyond != 0:
            number = _list(beyond, k, inverse_mass, found, number)
    for i in range(packed, stop):
        x, y, r = position[i, 0], position[i, 1], radius[i]
        if (x0 + r - x > zero or x - (x1 - r) > zero or y0 + r - y > zero or y - (y1 - r) > zero) and inverse_mass[i] > 0:
            found[number] = i
            number += 1
    return number
