# mypy: ignore-errors
"""Draws outlines, areas and convex polygons on pixels; the alpha channel stays unchanged."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_integers, const_singles, doubles, indices, singles
from cython.cimports.libc.math import INFINITY, ceil, floor, hypot
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.pixel_blending import mixed


def stroke(cover, x0: cython.double, y0: cython.double, x1: cython.double, y1: cython.double, half: cython.double):
    """Raise the coverage `cover` (h, w), float32 from 0 to 1, to that of a line `2 half` pixels wide with round ends; y down."""
    c: cython.p_float = singles(cover)
    height: cython.double = cover.shape[0]
    width: int64_t = cover.shape[1]
    reach: cython.double = half + 0.5
    dx: cython.double = x1 - x0
    dy: cython.double = y1 - y0
    length2: cython.double = max(dx * dx + dy * dy, 1e-12)
    top: int64_t = cython.cast(int64_t, max(floor(min(y0, y1) - reach), 0.0))
    foot: int64_t = cython.cast(int64_t, min(ceil(max(y0, y1) + reach), height))
    left: int64_t = cython.cast(int64_t, max(floor(min(x0, x1) - reach), 0.0))
    right: int64_t = cython.cast(int64_t, min(ceil(max(x0, x1) + reach), cython.cast(cython.double, width)))
    with cython.nogil:
        for row in range(top, foot):
            for column in range(left, right):
                px: cython.double = column + 0.5 - x0
                py: cython.double = row + 0.5 - y0
                along: cython.double = min(max((px * dx + py * dy) / length2, 0.0), 1.0)
                distance: cython.double = hypot(px - along * dx, py - along * dy)
                part: cython.double = min(max(reach - distance, 0.0), 1.0)
                if part > c[row * width + column]:
                    c[row * width + column] = part


@kernel
def fill_line(
    cover: cython.p_float, at: int64_t, width: int64_t, crossing: cython.p_double, count: int64_t, slices: cython.double
) -> cython.void:
    """Add the spans between crossings 1 and 2, 3 and 4, and so on, to the row of pixels at cover[at]."""
    k: int64_t
    for i in range(1, count):  # insertion sort
        value: cython.double = crossing[i]
        k = i
        while k > 0 and crossing[k - 1] > value:
            crossing[k] = crossing[k - 1]
            k -= 1
        crossing[k] = value
    for i in range(0, count - 1, 2):
        a: cython.double = crossing[i]
        b: cython.double = crossing[i + 1]
        last: cython.double = min(ceil(b), cython.cast(cython.double, width))
        for column in range(cython.cast(int64_t, a), cython.cast(int64_t, last)):
            cover[at + column] += max(min(b, column + 1.0) - max(a, cython.cast(cython.double, column)), 0.0) / slices


def fill(cover, edges, slices: int64_t):
    """Add to `cover`, (h, w) float32, the inside (even-odd) of the closed lines whose edges (m, 4) are x0, y0, x1, y1 in pixels.

    Each row is cut into `slices` lines, exact along x.
    """
    c: cython.p_float = singles(cover)
    e: cython.pointer[cython.const[cython.double]] = const_doubles(edges)
    height: int64_t = cover.shape[0]
    width: int64_t = cover.shape[1]
    edges_: int64_t = len(edges)
    spare = np.empty(len(edges) + 1)
    crossing: cython.p_double = doubles(spare)
    with cython.nogil:
        for line in range(height * slices):
            y: cython.double = (line + 0.5) / slices
            count: int64_t = 0
            for k in range(edges_):
                y0: cython.double = e[4 * k + 1]
                y1: cython.double = e[4 * k + 3]
                if (y0 <= y) != (y1 <= y):
                    x: cython.double = e[4 * k] + (y - y0) / (y1 - y0) * (e[4 * k + 2] - e[4 * k])
                    crossing[count] = min(max(x, 0.0), cython.cast(cython.double, width))
                    count += 1
            fill_line(c, line // slices * width, width, crossing, count, cython.cast(cython.double, slices))


def tint(pixels, cover, colour: uint32_t):
    """Blend `colour`, uint32, into `pixels` (h, w) by the coverage `cover` (h, w)."""
    p: cython.pointer[uint32_t] = indices(pixels)
    c: cython.pointer[cython.const[cython.float]] = const_singles(cover)
    count: int64_t = pixels.size
    with cython.nogil:
        for k in range(count):
            p[k] = mixed(p[k], colour, c[k])


Span = cython.struct(low=cython.double, high=cython.double)


@kernel
def set_edges(
    edges: cython.p_double, points: cython.pointer[cython.const[cython.double]], first: int64_t, last: int64_t
) -> cython.void:
    """Fill `edges` (m, 3) with (nx, ny, c) for a polygon: nx x + ny y - c is the signed distance of (x, y) from an edge."""
    for k in range(first, last):
        after: int64_t = k + 1 if k + 1 < last else first
        x0: cython.double = points[2 * k]
        y0: cython.double = points[2 * k + 1]
        x1: cython.double = points[2 * after]
        y1: cython.double = points[2 * after + 1]
        length: cython.double = hypot(x1 - x0, y1 - y0)
        at: int64_t = 3 * (k - first)
        edges[at] = edges[at + 1] = 0.0
        edges[at + 2] = INFINITY  # an edge without length never cuts anything off
        if length > 0.0:
            nx: cython.double = (y0 - y1) / length
            ny: cython.double = (x1 - x0) / length
            edges[at] = nx
            edges[at + 1] = ny
            edges[at + 2] = nx * x0 + ny * y0


@kernel
def span(edges: cython.p_double, count: int64_t, y: cython.double, margin: cython.double) -> Span:
    """The interval (low, high) in x in which row y of pixels is at most `margin` outside any edge."""
    s: Span
    s.low = -INFINITY
    s.high = INFINITY
    for k in range(count):
        rest: cython.double = margin + edges[3 * k + 2] - edges[3 * k + 1] * y
        if edges[3 * k] > 1e-9:
            s.high = min(s.high, rest / edges[3 * k])
        elif edges[3 * k] < -1e-9:
            s.low = max(s.low, rest / edges[3 * k])
        elif rest < 0.0:
            s.high = -INFINITY
    return s


@kernel
def fill_convex(
    pixels: cython.pointer[uint32_t], height: int64_t, width: int64_t, edges: cython.p_double, count: int64_t,
    top: cython.double, foot: cython.double, colour: uint32_t,
) -> cython.void:  # fmt: skip
    """Fill the polygon with these edges, between the rows `top` and `foot`."""
    end: int64_t = min(cython.cast(int64_t, min(foot, cython.cast(cython.double, height))) + 1, height)
    for row in range(cython.cast(int64_t, max(top, 0.0)), end):
        y: cython.double = row + 0.5
        s: Span = span(edges, count, y, 0.5)
        core: Span = span(edges, count, y, -0.5)
        start: cython.double = min(max(s.low - 0.5, 0.0), cython.cast(cython.double, width))
        stop: cython.double = min(max(s.high + 0.5, 0.0), cython.cast(cython.double, width))
        for column in range(cython.cast(int64_t, start), cython.cast(int64_t, stop)):
            x: cython.double = column + 0.5
            amount: cython.double = 1.0
            if not (core.low <= x and x <= core.high):
                front: cython.double = -INFINITY
                for k in range(count):
                    front = max(front, edges[3 * k] * x + edges[3 * k + 1] * y - edges[3 * k + 2])
                amount = min(max(0.5 - front, 0.0), 1.0)
            if amount > 0.0:
                pixels[row * width + column] = mixed(pixels[row * width + column], colour, amount)


def draw_convex(pixels, points, first, colour: uint32_t):
    """Fill convex polygons in `colour`, uint32: corners first[k] to first[k + 1] of `points` (n, 2), counter-clockwise with y up.

    Points are pixels, y down. The coverage of a pixel on the rim follows from its distance to the nearest edge.
    """
    p: cython.pointer[uint32_t] = indices(pixels)
    c: cython.pointer[cython.const[cython.double]] = const_doubles(points)
    f: cython.pointer[cython.const[int64_t]] = const_integers(first)
    spare = np.empty(3 * len(points) + 1)
    edges: cython.p_double = doubles(spare)
    height: int64_t = pixels.shape[0]
    width: int64_t = pixels.shape[1]
    polygons: int64_t = len(first) - 1
    with cython.nogil:
        for polygon in range(polygons):
            a: int64_t = f[polygon]
            b: int64_t = f[polygon + 1]
            top: cython.double = INFINITY
            foot: cython.double = -INFINITY
            finite: cython.bint = True
            for k in range(a, b):
                finite = finite and c[2 * k + 1] == c[2 * k + 1]  # not NaN
                top = min(top, c[2 * k + 1] - 0.5)
                foot = max(foot, c[2 * k + 1] + 0.5)
            if finite and foot > 0.0 and top < height:
                set_edges(edges, c, a, b)
                fill_convex(p, height, width, edges, b - a, top, foot, colour)
