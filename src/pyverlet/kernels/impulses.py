"""Impulses between circles from what each circle has got: pushes along the normals of contacts that explain it."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel


@kernel
def least(a, b, normal, got, free, push, steps, tolerance):
    """Pushes (k,) of a on b whose sum on each free circle is as near to `got` (n, 2) as can be, from those given; N s.

    From 0 they become the smallest of those. Conjugate gradients on the normal equations (CGLS; Hestenes, Stiefel 1952), at most
    `steps` of them, until the gradient is `tolerance` of what it is at 0. free (n,): 1, or 0 for pinned circles. Returns how many
    steps were taken.
    """
    left, out, way = np.empty_like(got), np.zeros_like(got), np.zeros_like(push)
    slope = np.empty_like(push)
    begun = 0.0
    for k in range(a.shape[0]):
        x, y = free[b[k]] * got[b[k], 0] - free[a[k]] * got[a[k], 0], free[b[k]] * got[b[k], 1] - free[a[k]] * got[a[k], 1]
        begun += (x * normal[k, 0] + y * normal[k, 1]) ** 2
        out[a[k], 0] -= push[k] * normal[k, 0]
        out[a[k], 1] -= push[k] * normal[k, 1]
        out[b[k], 0] += push[k] * normal[k, 0]
        out[b[k], 1] += push[k] * normal[k, 1]
    for i in range(got.shape[0]):
        left[i, 0], left[i, 1] = free[i] * (got[i, 0] - out[i, 0]), free[i] * (got[i, 1] - out[i, 1])
        out[i, 0] = out[i, 1] = 0.0
    ahead = before = 0.0
    for step in range(steps + 1):
        size = 0.0
        for k in range(a.shape[0]):
            i, j = np.uint64(a[k]), np.uint64(b[k])
            along = (left[j, 0] - left[i, 0]) * normal[k, 0] + (left[j, 1] - left[i, 1]) * normal[k, 1]
            slope[k] = along
            size += along * along
            push[k] += ahead * way[k]
        if step == steps or not size > tolerance * tolerance * begun:
            return step
        part = size / before if step else 0.0
        before = size
        for k in range(a.shape[0]):
            along = slope[k] + part * way[k]
            way[k] = along
            x, y, i, j = along * normal[k, 0], along * normal[k, 1], np.uint64(a[k]), np.uint64(b[k])
            out[i, 0] -= x
            out[i, 1] -= y
            out[j, 0] += x
            out[j, 1] += y
        far = 0.0
        for i in range(got.shape[0]):
            out[i, 0] *= free[i]
            out[i, 1] *= free[i]
            far += out[i, 0] * out[i, 0] + out[i, 1] * out[i, 1]
        if far == 0.0:
            return step
        ahead = size / far
        for i in range(got.shape[0]):
            left[i, 0] -= ahead * out[i, 0]
            left[i, 1] -= ahead * out[i, 1]
            out[i, 0] = out[i, 1] = 0.0
    return steps
